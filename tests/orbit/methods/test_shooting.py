"""Shooting, the fast method with inertia, against collocation, and its own checks.

The two methods share the equations of motion and nothing else: steps, unknowns and the way to the
multipliers differ. The equations themselves are held against SciPy in `test_motions`.
"""

import numpy as np
import pytest

import asperity as asp
from asperity.laws import get_law
from asperity.orbit.methods import shooting as shooting_method
from asperity.orbit.solution import SearchOptions
from asperity.slider.problem import checked_problem, flatten

K, W0, D0, V0, MU0 = 2e5, 7.0, 4e-7, 1e-6, 0.5
#: The default, for which other tests have the programs compiled.
HARMONICS = 8

#: What both methods promise of each number, relative.
PROMISED = 1e-8
#: Multipliers below 1e-6, and those below 1e-7 of the largest, are promised absolutely.
VANISHING, DROWNED = 1e-6, 1e-7


def random_points(count, seed):
    """Sliders and drives far beyond those of the paper."""
    rng = np.random.default_rng(seed)

    def spread(low, high):
        return 10 ** rng.uniform(np.log10(low), np.log10(high), count)

    A = spread(0.008, 0.03)
    law = {"mu0": MU0, "A": A, "B": A * rng.uniform(0.5, 2.5, count), "D0": D0, "V0": V0}
    law["lambda_"] = spread(5e-7, 3e-6)
    drive = {
        "velocity": spread(1e-8, 1e-5),
        "epsilon": rng.uniform(0.005, 0.5, count),
        "frequency": spread(80.0, 500.0),
    }
    return law, spread(0.5, 3.0), drive


def respond(name, points, **options):
    law, M, drive = points
    slider = asp.Slider(get_law(name)(**law), spring=K, load=W0, mass=M)
    return asp.periodic_response(
        slider, **drive, inertia=True, harmonics=HARMONICS, workers=1, **options
    )


def test_agrees_with_collocation():
    # Points that collocation finds from the averaged limit, without the methods behind it.
    points = random_points(12, seed=11)
    fast = respond("elasto-plastic", points, methods=("fourier",))
    solved = np.flatnonzero(fast.converged)
    assert len(solved) >= 7
    law, M, drive = points
    law, drive = (
        {name: a[solved] if np.ndim(a) else a for name, a in numbers.items()}
        for numbers in (law, drive)
    )
    robust = respond("elasto-plastic", (law, M[solved], drive), methods=("collocation",))
    assert robust.converged.all()
    for name in ("mean_friction", "mu1", "mu2"):
        gap = np.abs(getattr(fast, name)[solved] / getattr(robust, name) - 1)
        assert gap.max() < 2 * PROMISED
    for of_fast, expected in zip(fast.multipliers[solved], robust.multipliers, strict=True):
        size = np.abs(expected)
        size = np.maximum(size, max(VANISHING, DROWNED * size.max()))
        gap = np.abs(of_fast[:, None] - expected).min(0) / size
        assert gap.max() < 2 * PROMISED


PAPER = {"mu0": MU0, "A": 0.013, "B": 0.026, "D0": D0, "V0": V0, "lambda_": 7e-7}
DRIVE = {"velocity": [2e-7, 1e-6, 8e-6], "epsilon": [0.1, 0.24, 0.28], "frequency": 120.0}


def shoot(drive=DRIVE, mass=1.6):
    """The solution by shooting alone, and the points that it does not solve."""
    slider = asp.Slider(get_law("elasto-plastic")(**PAPER), spring=K, load=W0, mass=mass)
    problem, shape = flatten(checked_problem(slider, inertia=True, **drive))
    points = int(np.prod(shape))
    reported = []
    solution = shooting_method.Shooting().solve(
        problem, SearchOptions(HARMONICS, 0, reported.append)
    )
    left = np.flatnonzero(~solution.converged)
    assert sum(reported) == points - len(left)
    return solution, left


def test_waveform_has_the_harmonics_and_the_mean_slip():
    law = PAPER | {"A": np.full(3, 0.013)}
    response = respond("elasto-plastic", (law, 1.6, DRIVE), methods=("fourier",), waveform=256)
    force, log_slip = response.waveform
    spectrum = np.fft.rfft(force, axis=-1) / 256
    np.testing.assert_allclose(spectrum[:, 0].real, response.mean_friction, rtol=1e-10)
    harmonics = 2 * spectrum[:, 1 : HARMONICS + 1]
    np.testing.assert_allclose(harmonics[:, :2], response.harmonics[:, :2], rtol=1e-7)
    # The far end of the spring gains on the joint by nothing in a period.
    np.testing.assert_allclose(np.exp(log_slip).mean(-1), 1.0, rtol=1e-7)


def plant(monkeypatch, mistake):
    """Have every pass over the period return what `mistake` makes of it."""
    original = shooting_method.newton_pass

    def mistaken(problem, start, *, steps):
        return mistake(original(problem, start, steps=steps), int(steps.number))

    monkeypatch.setattr(shooting_method, "newton_pass", mistaken)


def test_no_mistake_no_alarm():
    solution, left = shoot()
    assert len(left) == 0
    assert np.isfinite(solution.log_multipliers).all()


def observed(mistake):
    """A mistake in the observables of a pass."""
    return lambda p, n: p._replace(observables=p.observables._replace(**mistake(p.observables, n)))


@pytest.mark.parametrize(
    "mistake",
    [
        # Derivatives that grow or shrink, the same on every division: Liouville's formula sees it.
        observed(lambda o, _: {"monodromy": o.monodromy * (1 + 3e-8)}),
        observed(lambda o, _: {"log_determinant": o.log_determinant * 1.001}),
        # A method of low order: its error falls too slowly with the number of steps.
        observed(lambda o, n: {"harmonics": o.harmonics * (1 + 3e-3 / n)}),
        observed(lambda o, n: {"mean_friction": o.mean_friction * (1 + 3e-3 / n)}),
        # The same of the derivatives, with the right determinant.
        observed(
            lambda o, n: {
                "monodromy": o.monodromy.at[0].multiply(1 + 1e-2 / n).at[1].divide(1 + 1e-2 / n)
            }
        ),
        # A period that does not close.
        lambda p, _: p._replace(change=p.change + 1e-8),
        lambda p, _: p._replace(step=p.step * np.nan),
    ],
)
def test_planted_mistakes_in_an_integration_pass_are_detected(monkeypatch, mistake):
    plant(monkeypatch, mistake)
    solution, left = shoot()
    assert len(left) == 3
    assert np.isnan(solution.mean_friction).all()
    assert np.isnan(solution.log_multipliers).all()


def test_shooting_leaves_points_that_it_cannot_solve():
    """A resonance far above what the steps resolve, and slip that relaxes within one of them."""
    assert len(shoot(mass=1e-7)[1]) == 3
    fast = {"velocity": [1e-3, 1e-6], "epsilon": 0.3, "frequency": [20.0, 120.0]}
    solution, left = shoot(fast)
    assert list(left) == [0]
    assert np.isnan(solution.mean_friction[0])
    assert np.isfinite(solution.mean_friction[1])


def test_points_that_shooting_cannot_solve_go_to_collocation():
    law = PAPER | {"A": np.full(2, 0.013)}
    drive = {"velocity": [1e-4, 1e-6], "epsilon": 0.3, "frequency": [60.0, 120.0]}
    counts = []
    response = respond(
        "elasto-plastic", (law, 1.6, drive), progress=lambda done, _: counts.append(done)
    )
    assert response.converged.all()
    assert counts[-1] == 2
    alone = respond("elasto-plastic", (law, 1.6, drive), methods=("fourier",))
    assert list(alone.converged) == [False, True]
