"""Periodic responses against an independent integration, closed forms and symmetries."""

from functools import cache

import numpy as np
import pytest

from asperity import Slider, averaged_response, periodic_response
from asperity.errors import InputError
from asperity.laws import (
    Amontons,
    CutOff,
    ElastoPlastic,
    ElastoPlasticAge,
    LinkerDieterich,
    Nagata,
    PerrinRiceZheng,
    PrakashClifton,
    Regularised,
    RiceRuina,
    RuinaSlip,
    StrengthArea,
    TwoState,
    registered,
)
from references.compilation import compiled_programs
from references.populations import population

#: What a converged point promises: relative in mean, harmonics and multipliers.
PROMISED = 1e-8
#: Below this modulus multipliers are promised to 1e-20 absolute.
VANISHING = 1e-12
#: Relative to the swing of F. A Fourier series whose harmonics are good to 1e-9 ends with terms
#: of about the square root of that.
WAVEFORM = 3e-5
#: The same arithmetic in other units: round-off times the condition of the orbit.
OTHER_UNITS = 1e-10

BASE = {"mu0": 0.5, "A": 0.013, "B": 0.026, "D0": 4e-7, "V0": 1e-6}
LENGTH = 7e-7
K, W0 = 2e5, 7.0
SAMPLES, SEGMENTS = 4096, 32

#: Law, and the variant of the reference's equations that it stands for.
LAWS = {
    "rice-ruina": (RiceRuina(**BASE), {}),
    "linker-dieterich": (LinkerDieterich(**BASE, alpha=0.2), {"alpha": 0.2}),
    "elasto-plastic": (ElastoPlastic(**BASE, lambda_=LENGTH), {"lambda_": LENGTH}),
    "elasto-plastic-age": (
        ElastoPlasticAge(**BASE, lambda_=LENGTH),
        {"lambda_": LENGTH, "ageing": "plastic"},
    ),
    "strength-area": (StrengthArea(**BASE), {"product": True}),
}
#: The same of laws beyond the paper.
FURTHER = {
    "regularised": (Regularised(**BASE), {}),
    "cut-off": (CutOff(**BASE, V1=1e-8, V2=1e-4), {"V1": 1e-8, "V2": 1e-4}),
    "ruina-slip": (RuinaSlip(**BASE), {"ageing": "slip"}),
    "perrin-rice-zheng": (PerrinRiceZheng(**BASE), {}),
    "nagata": (Nagata(**BASE | (stiff := {"A": 0.051, "B": 0.0565, "c": 2.0})), stiff),
    "two-state": (TwoState(**BASE, B2=0.005, D2=1.5e-6), {"B2": 0.005, "D2": 1.5e-6}),
    "prakash-clifton": (
        PrakashClifton(**BASE, L=1e-8, V_star=1e-7),
        {"L": 1e-8, "V_star": 1e-7},
    ),
}
#: The fast method is compiled for each law: in every run for one with and one without elastic
#: asperities, and for one of three states.
SUITE = ("rice-ruina", "elasto-plastic")
PAPER = population([*SUITE, *(name for name in LAWS if name not in SUITE)], short=2)
SHARP = "rice-ruina, sharpest pulse"
BEYOND = population(["two-state", *(name for name in FURTHER if name != "two-state")])
#: V, eps, f. Fast modulation, for every law.
FAST = [(V, eps, 120.0) for V in (1e-7, 1e-6) for eps in (0.005, 0.24, 0.5, 0.9)]
FAST += [(1e-5, 0.005, 120.0), (1e-5, 0.5, 120.0)]
#: Narrow pulses, slow modulation, and modulation near the stick-slip frequency V/(2 pi D0).
SLOW = [(1e-4, 0.005, 120.0), (1e-4, 0.24, 120.0), (1e-4, 0.9, 120.0), (1e-5, 0.9, 120.0)]
SLOW += [(1e-7, 0.5, 1.0), (1e-6, 0.005, 1.0), (1e-6, 0.9, 1.0)]
#: The same, of orbits to which the branch from steady sliding is followed.
FOLLOWED = [(1e-6, 0.24, 0.4), (1e-5, 0.5, 4.0)]
#: A pulse on the finest mesh, which takes as long as all other points: of one law, long.
SHARPEST = (1e-5, 0.9, 1.0)
#: Where the first grid of the fast method is enough, and one point for which it is not.
MILD = [(V, eps, 120.0) for V in (1e-6, 3e-6) for eps in (0.005, 0.05)]
STRONG = (1e-6, 0.12, 120.0)
#: One law with and one without elastic asperities: each has the robust method compiled, one of them
#: with the way along branches. The others have the points that the fast method answers.
POINTS = {name: FAST + SLOW * (name in ("rice-ruina", "elasto-plastic")) for name in LAWS}
POINTS |= {"rice-ruina": [*FAST, *SLOW, *FOLLOWED], SHARP: [SHARPEST]}
POINTS |= {
    name: [point for point in FAST if point[1] < 0.9]
    for name in ("elasto-plastic-age", "strength-area")
}


def respond(name, V, epsilon, frequency, **options):
    slider = Slider(LAWS[name][0], spring=K, load=W0)
    options = {"waveform": SAMPLES} | options
    return periodic_response(slider, velocity=V, epsilon=epsilon, frequency=frequency, **options)


@cache
def solved(name):
    """Response of a law at its points."""
    return respond(law_of(name), *np.transpose(POINTS[name]))


def law_of(name):
    """Law of a case: that before a comma."""
    return name.partition(",")[0]


@pytest.fixture(scope="module", params=[*PAPER, pytest.param(SHARP, marks=pytest.mark.long)])
def case(request, reference):
    """Name of a case, its response, and the reference's solution.

    The reference's Newton's method starts from the package's orbit, 0.1 % off.
    """
    name = request.param
    V, epsilon, frequency = np.transpose(POINTS[name])[..., None]
    printed = reference.Printed(V=V, frequency=frequency, **LAWS[law_of(name)][1])
    force, log_slip = solved(name).waveform[..., :: SAMPLES // SEGMENTS]
    shot = reference.multiple_shooting(printed, epsilon, force, 1.001 * log_slip)
    return name, solved(name), shot


def multiplier_error(multipliers, expected):
    return np.abs(multipliers - expected) / np.maximum(np.abs(expected), VANISHING)


def test_every_registered_law_is_tested():
    assert {*LAWS, *FURTHER, "amontons"} == {
        name for name, law in registered().items() if law.__module__.startswith("asperity.")
    }


@pytest.mark.parametrize("name", BEYOND)
def test_other_laws_have_the_mean_harmonics_and_multipliers_of_their_published_equations(
    reference, name
):
    """Mean, harmonics and multipliers of their published equations."""
    law, variant = FURTHER[name]
    V, epsilon, frequency = np.transpose(MILD + [STRONG] * (name == "ruina-slip"))[..., None]
    response = periodic_response(
        Slider(law, spring=K, load=W0),
        velocity=V[:, 0],
        epsilon=epsilon[:, 0],
        frequency=frequency[:, 0],
        waveform=SEGMENTS,
        methods=("fourier",),
    )
    assert list(response.result) == ["converged"] * len(V)
    printed = reference.printed.get(name, reference.Printed)
    force, log_slip = response.waveform
    shot = reference.multiple_shooting(
        printed(V=V, frequency=frequency, **variant), epsilon, force, 1.001 * log_slip
    )
    assert reference.disagreement(response, shot).max() < PROMISED


def test_every_reference_point_converges(case):
    name, response, _ = case
    assert list(response.result) == ["converged"] * len(POINTS[name])


@pytest.mark.parametrize("name", population(SUITE))
def test_hundreds_of_points_take_coarser_grids_with_the_same_results(name, monkeypatch):
    """Up to a block of 240 points takes the finest grid, for which one program is compiled."""
    # Programs that are dropped to save memory would be counted again.
    monkeypatch.setattr("asperity.orbit.batches.spare_mappings", lambda: None)
    random = np.random.default_rng(1)
    V, epsilon = 10 ** random.uniform(-7, -5, 480), random.uniform(0.005, 0.6, 480)
    # No other test compiles programs for three harmonics.
    options = {"waveform": 0, "harmonics": 3, "methods": ("fourier",)}
    with compiled_programs() as compiled:
        halves = [
            respond(name, V[part], epsilon[part], 120.0, **options)
            for part in (slice(0, 240), slice(240, None))
        ]
    assert sum("fast_solve" in program for program in compiled) == 1
    with compiled_programs() as compiled:
        whole = respond(name, V, epsilon, 120.0, **options)
    assert sum("fast_solve" in program for program in compiled) == 2
    assert whole.converged.all()
    for field in ("mean_friction", "harmonics", "multipliers"):
        expected = np.concatenate([np.asarray(getattr(half, field)) for half in halves])
        error = np.abs(getattr(whole, field) - expected)
        assert (error / np.maximum(np.abs(expected), VANISHING)).max() < PROMISED


def test_mean_harmonics_and_multipliers_are_those_of_the_integration(reference, case):
    assert reference.disagreement(*case[1:]).max() < PROMISED


def test_the_waveform_is_that_of_the_integration(case):
    _, response, shot = case
    force = response.waveform[0, :, :: SAMPLES // SEGMENTS]
    swing = np.ptp(force, axis=1, keepdims=True)
    assert (np.abs(force - shot.force) / swing).max() < WAVEFORM


def test_harmonics_are_the_fourier_series_of_the_waveform(case):
    _, response, _ = case
    spectrum = np.fft.rfft(response.waveform[0]) / SAMPLES
    swing = np.ptp(response.waveform[0], axis=1)
    assert (np.abs(spectrum[:, 0].real - response.mean_friction) / swing).max() < WAVEFORM
    assert (np.abs(2 * spectrum[:, 1:9] - response.harmonics).max(1) / swing).max() < WAVEFORM


def test_amplitudes_and_phases_are_those_of_the_documented_sum():
    response = solved("elasto-plastic")
    theta = response.theta[:, None]
    rest = response.waveform[0].T - response.mean_friction
    rest = rest - response.mu1 * np.cos(theta + response.phase1)
    rest = rest - response.mu2 * np.cos(2 * theta + response.phase2)
    weak = response.epsilon < 0.01
    beyond = np.abs(response.harmonics[:, 2:]).sum(1)
    # Beyond the eighth, harmonics at eps mu/A = 0.2 are below round-off.
    assert (np.abs(rest).max(0) < 1.001 * beyond + 1e-13)[weak].all()
    assert (beyond < 0.1 * response.mu2)[weak].all()


def test_force_follows_slow_modulation_and_lags_fast_modulation_by_a_quarter_period():
    stiff = Slider(RiceRuina(**BASE), spring=100 * K, load=W0)
    response = periodic_response(
        stiff, velocity=1e-6, epsilon=0.005, frequency=[1e-5, 1e4], waveform=1
    )
    # Fast: the interface slips least where the load peaks, and the force is the integral of that.
    # It is not quite a quarter: the spring gains VK/(w W0 A) = 3.5e-3 of A W0 per radian.
    np.testing.assert_allclose(response.phase1, [0.0, -np.pi / 2], atol=5e-3)
    assert response.mu1[0] == pytest.approx(0.5 * 0.005, rel=1e-3)


@pytest.mark.parametrize("name", population(["elasto-plastic", "rice-ruina"]))
def test_the_fast_and_the_robust_method_agree(name):
    random = np.random.default_rng(20260)
    count = 96

    def spread(low, high):
        return np.exp(random.uniform(np.log(low), np.log(high), count))

    numbers = BASE | {"A": spread(0.002, 0.05), "D0": spread(1e-7, 2e-6)}
    numbers["B"] = numbers["A"] * random.uniform(1.2, 4, count)
    if name == "elasto-plastic":
        numbers["lambda_"] = spread(1e-7, 2e-6)
    slider = Slider(type(LAWS[name][0])(**numbers), spring=spread(2e4, 2e6), load=W0)
    drive = {
        "velocity": spread(1e-8, 1e-5),
        "epsilon": random.uniform(0, 0.9, count),
        "frequency": spread(30.0, 3000.0),
    }
    fast, robust = (
        periodic_response(slider, **drive, waveform=1, methods=(method,))
        for method in ("fourier", "collocation")
    )
    assert robust.converged.all()
    both = fast.converged
    assert both.mean() > 0.5
    np.testing.assert_allclose(fast.mean_friction[both], robust.mean_friction[both], rtol=PROMISED)
    error = np.abs(fast.harmonics - robust.harmonics)[both]
    amplitude = np.abs(robust.harmonics)[both]
    assert (error[:, :2] / amplitude[:, :2]).max() < PROMISED
    assert (error / amplitude[:, :1]).max() < PROMISED
    assert multiplier_error(fast.multipliers, robust.multipliers)[both].max() < PROMISED


def test_pulses_too_narrow_for_the_fast_method_are_solved_by_the_robust_one(reference):
    # The force is resolved by its grid, and the slip rate, hence the multipliers, is not quite.
    names = ("mu0", "A", "B", "D0", "K", "W0", "V", "epsilon", "frequency")
    points = [
        (0.57, 0.0051883, 0.0127723, 1.39147e-7, 562420, 9.803, 7.21473e-5, 0.888433, 1e4),
        (0.681, 0.0039304, 0.0064719, 2.93931e-7, 567613, 9.766, 6.63044e-5, 0.825056, 1e4),
        (0.4835, 0.0020921, 0.0050157, 1.56597e-6, 69748, 4.804, 4.04143e-4, 0.754019, 1e4),
        (0.797, 0.0033894, 0.0047345, 1.50703e-6, 316191, 5.605, 8.17341e-8, 0.780402, 17.483),
    ]
    n = dict(zip(names, np.transpose(points), strict=True))
    law = RiceRuina(**{k: n[k] for k in ("mu0", "A", "B", "D0")}, V0=1e-6)
    response = periodic_response(
        Slider(law, spring=n["K"], load=n["W0"]),
        velocity=n["V"],
        epsilon=n["epsilon"],
        frequency=n["frequency"],
        waveform=SEGMENTS,
    )
    assert response.converged.all()
    columns = {k: a[:, None] for k, a in n.items()}
    epsilon = columns.pop("epsilon")
    shot = reference.multiple_shooting(reference.Printed(**columns), epsilon, *response.waveform)
    assert reference.disagreement(response, shot).max() < PROMISED


class TestShapes:
    def test_arrays_of_one_shape_are_as_many_points(self):
        V, epsilon, frequency = np.transpose(FAST[:4])
        response = respond("rice-ruina", V, epsilon, frequency)
        assert response.mean_friction.shape == (4,)
        assert response.harmonics.shape == (4, 8)
        assert response.multipliers.shape == (4, 2)
        assert response.waveform.shape == (2, 4, SAMPLES)
        error = np.abs(response.harmonics - solved("rice-ruina").harmonics[:4]).max(1)
        # Chunks run until their slowest point is done: more steps may be taken in company.
        assert (error / response.mu1).max() < PROMISED

    def test_axes_broadcast_and_points_do_not_depend_on_each_other(self):
        V, epsilon = np.array([1e-7, 1e-6]), np.array([0.1, 0.24, 0.3])
        grid = respond("rice-ruina", V[:, None], epsilon, 120.0, waveform=1)
        assert grid.mean_friction.shape == (2, 3)
        assert grid.harmonics.shape == (2, 3, 8)
        for i, j in np.ndindex(2, 3):
            alone = respond("rice-ruina", V[i], epsilon[j], 120.0, waveform=1)
            assert alone.mean_friction == pytest.approx(grid.mean_friction[i, j], rel=PROMISED)
            assert np.abs(alone.harmonics - grid.harmonics[i, j]).max() < PROMISED * alone.mu1

    def test_numbers_give_arrays_without_axes(self):
        response = respond("rice-ruina", 1e-6, 0.24, 120.0, harmonics=8)
        for value in (response.mean_friction, response.mu1, response.phase2, response.stable):
            assert np.shape(value) == ()
        assert response.harmonics.shape == (8,)
        assert response.multipliers.shape == (2,)
        assert response.waveform.shape == (2, SAMPLES)
        assert response.result[()] == "converged"

    def test_parameters_of_the_slider_broadcast_too(self):
        slider = Slider(RiceRuina(**BASE), spring=[[1e5], [2e5]], load=W0)
        response = periodic_response(
            slider, velocity=1e-6, epsilon=[0.1, 0.2, 0.3], frequency=120.0, waveform=1
        )
        assert response.mu1.shape == (2, 3)
        # mu1 is proportional to K while the spring force hardly moves.
        assert response.mu1[1] / response.mu1[0] == pytest.approx(2.0, rel=1e-3)


def steady_multipliers(name, V, frequency):
    """Eigenvalues of steady sliding, linearised by hand; slopes A', B' of F/W in ln v, ln Phi."""
    log = np.log(V / BASE["V0"])
    product = name == "strength-area"
    A = BASE["A"] * (1 - product * BASE["B"] / BASE["mu0"] * log)
    B = BASE["B"] * (1 + product * BASE["A"] / BASE["mu0"] * log)
    soft = LENGTH * K / W0 if name.startswith("elasto") else 0.0
    share = 1 / (1 + soft)  # of a change of v_pl that the slider's velocity makes
    age = 1.0 if name == "elasto-plastic-age" else share
    stiffness = share * K * BASE["D0"] / W0
    rates = np.array([[-stiffness / A, stiffness * B / A], [-age / A, age * B / A - 1]])
    return np.exp(np.linalg.eigvals(rates * V / BASE["D0"]) / frequency)


@pytest.mark.parametrize("name", PAPER)
@pytest.mark.parametrize("V", [1e-7, 1e-6])
def test_without_modulation_it_is_steady_sliding(name, V):
    check_steady(name, V, 120.0)


# Beyond the Fourier stages.
@pytest.mark.parametrize(("V", "frequency"), [(1e-5, 120.0), (1e-6, 1.0)])
@pytest.mark.parametrize("name", ["rice-ruina", "elasto-plastic"])
def test_slow_modulation_of_no_amplitude_is_steady_sliding(name, V, frequency):
    check_steady(name, V, frequency)


def check_steady(name, V, frequency):
    response = respond(name, V, 0.0, frequency, waveform=1)
    assert response.mean_friction == pytest.approx(response.mu_ss, rel=1e-14)
    assert np.abs(response.harmonics).max() < 1e-15
    expected = steady_multipliers(name, V, frequency)
    ordered = sorted(response.multipliers, key=lambda m: (-abs(m), m.imag))
    expected = sorted(expected, key=lambda m: (-round(abs(m), 9), m.imag))
    # The argument of a pair close to 1 is the root of a small difference.
    np.testing.assert_allclose(ordered, expected, rtol=1e-10)
    assert response.stable == (np.abs(expected).max() < 1)


def test_amontons_follows_the_load():
    epsilon = np.array([0.0, 0.24, 0.9])
    slider = Slider(Amontons(mu0=0.6), spring=K, load=W0)
    response = periodic_response(
        slider, velocity=1e-6, epsilon=epsilon, frequency=120.0, waveform=16
    )
    np.testing.assert_allclose(response.mean_friction, 0.6, rtol=1e-15)
    np.testing.assert_allclose(response.delta_mu, 0.0, atol=1e-15)
    np.testing.assert_allclose(response.mu1, 0.6 * epsilon, rtol=1e-14, atol=1e-16)
    np.testing.assert_allclose(response.phase1[1:], 0.0, atol=1e-15)
    np.testing.assert_allclose(np.abs(response.harmonics[:, 1:]), 0.0, atol=1e-15)
    expected = 0.6 * (1 + epsilon[:, None] * np.cos(response.theta))
    np.testing.assert_allclose(response.waveform[0], expected, rtol=1e-15)
    assert response.multipliers.shape == (3, 0)
    assert response.converged.all()
    assert response.stable.all()


def test_a_law_without_dynamics_has_no_limit_of_fast_modulation():
    slider = Slider(Amontons(mu0=0.6), spring=K, load=W0)
    with pytest.raises(InputError, match=r"law must depend on the velocity .* got amontons"):
        averaged_response(slider, velocity=1e-6, epsilon=0.2)


def test_other_units_change_nothing():
    length, time, force = 3.7, 0.21, 5.3
    speed = length / time
    numbers = BASE | {
        "D0": BASE["D0"] * length,
        "V0": BASE["V0"] * speed,
        "lambda_": LENGTH * length,
    }
    slider = Slider(ElastoPlastic(**numbers), spring=K * force / length, load=W0 * force)
    V, epsilon, frequency = np.transpose(POINTS["elasto-plastic"])
    scaled = periodic_response(
        slider, velocity=V * speed, epsilon=epsilon, frequency=frequency / time, waveform=1
    )
    response = solved("elasto-plastic")
    np.testing.assert_allclose(scaled.mean_friction, response.mean_friction, rtol=OTHER_UNITS)
    error = np.abs(scaled.harmonics[:, :2] / response.harmonics[:, :2] - 1)
    assert error.max() < OTHER_UNITS
    assert multiplier_error(scaled.multipliers, response.multipliers).max() < OTHER_UNITS


def test_text_with_units_equals_si_numbers():
    slider = Slider(
        RiceRuina(mu0="0.5", A="1.3 %", B=0.026, D0="0.4 um", V0="1 um/s"),
        spring="0.2 N/um",
        load="7 N",
    )
    text = periodic_response(
        slider, velocity="1 um/s", epsilon="24 %", frequency="120 Hz", waveform=1
    )
    number = respond("rice-ruina", 1e-6, 0.24, 120.0, waveform=1)
    assert text.mean_friction == pytest.approx(number.mean_friction, rel=1e-12)
    np.testing.assert_allclose(text.harmonics[:2], number.harmonics[:2], rtol=1e-10)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"epsilon": 1.0}, "epsilon must be at least 0 and below 1"),
        ({"epsilon": [0.1, -0.1]}, "got -0.1"),
        ({"epsilon": np.nan}, "got nan"),
        ({"velocity": 0.0}, "velocity must be positive, got 0 m/s"),
        ({"velocity": np.nan}, "velocity must be finite, got nan m/s"),
        ({"velocity": "1 um"}, "velocity"),
        ({"frequency": -1.0}, "frequency must be positive, got -1 Hz"),
        ({"frequency": "754 rad/s"}, "frequency"),
        ({"harmonics": 1}, "harmonics must be at least 2"),
        ({"velocity": [1e-6, 2e-6], "epsilon": [0.1, 0.2, 0.3]}, "(2,), (3,)"),
    ],
)
def test_bad_input_is_refused_in_one_sentence(changed, said):
    drive = {"velocity": 1e-6, "epsilon": 0.24, "frequency": 120.0}
    slider = Slider(RiceRuina(**BASE), spring=K, load=W0)
    with pytest.raises(InputError) as caught:
        periodic_response(slider, **drive | changed)
    message = str(caught.value)
    assert said in message
    assert "\n" not in message
    assert not message.endswith(".")


def test_a_point_that_fails_has_a_reason_and_does_not_affect_others():
    # K < Kc at a quarter of the stick-slip frequency: the branch turns back at small eps.
    V, epsilon, frequency = np.transpose([FAST[5], (1e-5, 0.24, 1.0), FOLLOWED[0]])
    counts = []
    response = respond(
        "rice-ruina", V, epsilon, frequency, progress=lambda *count: counts.append(count)
    )
    assert list(response.converged) == [True, False, True]
    assert response.result[1].startswith(
        "on the branch from steady sliding the slip velocity grows"
    )
    assert not response.stable[1]
    for numbers in (response.mean_friction, response.harmonics, response.multipliers):
        assert np.isnan(numbers[1]).all()
        assert np.isfinite(numbers[[0, 2]]).all()
    assert np.isnan(response.waveform[:, 1]).all()
    expected = solved("rice-ruina").mean_friction[[5, -2]]
    np.testing.assert_allclose(response.mean_friction[[0, 2]], expected, rtol=PROMISED)
    assert counts[-1] == (3, 3)
    assert counts == sorted(counts)


# As many points as of another test, which shares its programs.
@pytest.mark.parametrize("count", [1, 96])
def test_progress_counts_every_point_once(count):
    counts = []
    epsilon = np.linspace(0.01, 0.3, count)
    progress = {"progress": lambda *n: counts.append(n)}
    respond("elasto-plastic", 1e-6, epsilon, 120.0, waveform=1, **progress)
    assert counts[-1] == (count, count)
