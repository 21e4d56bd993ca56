"""The compiled equations of every law, `asperity.slider.pointwise`, and the printed equations.

Rates, slip velocity and Jacobian are compared at random states away from steady sliding, under a
changing load. Solvers of orbits on meshes use nothing else of a law.
"""

import numpy as np
import pytest

import asperity as asp
from asperity.laws import get_law, registered
from asperity.loads import Harmonic
from asperity.slider import QuasiStatic
from asperity.slider.pointwise import excitation_at, values_at

BASE = {"mu0": 0.5, "A": 0.013, "B": 0.026, "D0": 4e-7, "V0": 1e-6}
K, W0, V, FREQUENCY, EPSILON = 2e5, 7.0, 2e-6, 120.0, 0.3
#: Round-off times exponents of some tens.
EXACT = 1e-10
#: For each law its parameters besides `BASE`, and the options of the printed equations.
CASES = {
    "rice-ruina": ({}, {}),
    "linker-dieterich": ({"alpha": 0.2}, {"alpha": 0.2}),
    "elasto-plastic": ({"lambda_": 7e-7}, {"lambda_": 7e-7}),
    "elasto-plastic-age": ({"lambda_": 7e-7}, {"lambda_": 7e-7, "ageing": "plastic"}),
    "strength-area": ({}, {"product": True}),
    "regularised": ({}, {}),
    "cut-off": (cut := {"V1": 1e-8, "V2": 1e-4}, cut),
    "ruina-slip": ({}, {"ageing": "slip"}),
    "perrin-rice-zheng": ({}, {}),
    "nagata": (stiff := {"A": 0.051, "B": 0.0565, "c": 2.0}, stiff),
    "two-state": (two := {"B2": 0.005, "D2": 1.5e-6}, two),
    "prakash-clifton": (lagging := {"L": 3e-7, "V_star": 1e-7}, lagging),
}


def test_every_rate_dependent_law_is_compared_with_its_publication():
    names = {
        name
        for name, law in registered().items()
        if law.__module__.startswith("asperity.") and law.rate_dependent
    }
    assert names == set(CASES)


def compiled(name, theta, slip):
    """Compiled values at random states of the law and these slip velocities (m/s)."""
    law = get_law(name)(**BASE | CASES[name][0])
    points = theta.shape[1]
    system = QuasiStatic(
        asp.Slider(law, spring=np.full(points, K), load=W0), V=V, omega=2 * np.pi * FREQUENCY
    )
    at = excitation_at(Harmonic(np.full(points, EPSILON)), theta)
    random = np.random.default_rng(3)
    steady = np.asarray(law.steady_state(V))
    states = steady[:, None, None] + random.normal(0, 0.3, (len(steady), *theta.shape))
    friction = np.asarray(law.friction(slip, tuple(states), at.w))
    elongation = friction * (at.w + float(law.elastic_length) * K / W0)
    Y = np.stack([elongation, *states])
    return values_at(system, at, np.zeros((len(Y), points)), Y), Y, at


def absorbed(name, w, w_rate, force, force_rate):
    """What the state of the law adds to the logarithm of the printed state, and its rate."""
    p = BASE | CASES[name][0]
    if name == "linker-dieterich":
        return p["alpha"] / p["B"] * np.log(w), p["alpha"] / p["B"] * w_rate / w
    if name == "nagata":
        return p["c"] / p["B"] * force, p["c"] / p["B"] * force_rate
    return 0.0, 0.0


#: Units (SI) of the variables whose logarithms are the states of a law: D0/V0 for an age.
SIZES = {"perrin-rice-zheng": [0.8], "two-state": [0.4, 1.5], "prakash-clifton": [0.4, W0]}


def compare(reference, name, **mistake):
    random = np.random.default_rng(5)
    theta = random.uniform(0, 2 * np.pi, (40, 2))
    slip = V * np.exp(random.normal(0, 1, theta.shape))
    values, Y, at = compiled(name, theta, slip)
    p = reference.printed.get(name, reference.Printed)(
        V=V, frequency=FREQUENCY, **BASE | CASES[name][1] | mistake
    )
    # Force and its rate from z = F/W0 (1 + L/w), the first state.
    force, ratio = np.asarray(values.force), p.lambda_ * K / W0
    force_rate = (values.rates[0] + ratio * force * at.w_slope / at.w**2) / (1 + ratio / at.w)
    extra, extra_rate = absorbed(name, at.w, at.w_slope, force, force_rate)
    internal = [
        size * np.exp(state - extra)
        for size, state in zip(SIZES.get(name, [0.4]), Y[1:], strict=True)
    ]
    plastic = p.slip(W0 * force, W0 * at.w, internal)
    np.testing.assert_allclose(plastic, slip, rtol=EXACT)
    np.testing.assert_allclose(np.exp(values.log_slip), plastic / V, rtol=EXACT)
    printed = p.rates(theta / p.omega, [(force - p.mu) * W0 / K, *internal], EPSILON)
    expected = [r / x / p.omega for r, x in zip(printed[1:], internal, strict=True)]
    for rate, exact in (
        (force_rate, printed[0] * K / W0 / p.omega),
        *zip(values.rates[1:], np.array(expected) + extra_rate, strict=True),
    ):
        np.testing.assert_allclose(rate, exact, rtol=0, atol=EXACT * np.abs(exact).max())


@pytest.mark.parametrize("name", CASES)
def test_rates_and_slip_agree_with_the_printed_equations(reference, name):
    compare(reference, name)


@pytest.mark.parametrize(
    ("name", "mistake"),
    [
        ("elasto-plastic", {"load_rate": False}),
        ("elasto-plastic-age", {"ageing": "slider"}),
        ("linker-dieterich", {"alpha": 0.1}),
        ("strength-area", {"product": False}),
        ("nagata", {"c": 1.9}),
        ("two-state", {"D2": 1.6e-6}),
        ("prakash-clifton", {"V_star": 2e-7}),
    ],
)
def test_planted_mistakes_are_detected(reference, name, mistake):
    with pytest.raises(AssertionError, match="Not equal to tolerance"):
        compare(reference, name, **mistake)


@pytest.mark.parametrize("name", CASES)
def test_the_jacobian_agrees_with_differences_of_the_rates(name):
    """Central differences over two steps, extrapolated."""
    theta = np.random.default_rng(5).uniform(0, 2 * np.pi, (40, 2))
    values, Y, at = compiled(name, theta, np.full(theta.shape, V))
    law = get_law(name)(**BASE | CASES[name][0])
    system = QuasiStatic(
        asp.Slider(law, spring=np.full(2, K), load=W0), V=V, omega=2 * np.pi * FREQUENCY
    )

    def outputs(k, h):
        moved = Y + h * np.eye(len(Y))[k][:, None, None]
        changed = values_at(system, at, np.zeros((len(Y), 2)), moved)
        return np.concatenate([changed.rates, changed.log_slip[None]])

    for k in range(len(Y)):
        coarse, fine = ((outputs(k, h) - outputs(k, -h)) / (2 * h) for h in (2e-3, 1e-3))
        expected = (4 * fine - coarse) / 3
        computed = np.concatenate([values.jacobian[:, k], values.slip_gradient[k][None]])
        error = np.abs(computed - expected).max((1, 2))
        assert (error < 1e-3 * np.abs(expected).max((1, 2)) + 1e-9).all()
