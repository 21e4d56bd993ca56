"""Inertia, radiation damping and other modulations against SciPy's integration.

The equations are written out here once more, in physical units and states of their own. From the
states that the package gives for theta = 0 they are integrated over one period, which must close,
give the same harmonics and, by complex steps in the start, the same multipliers.
"""

from dataclasses import dataclass
from types import SimpleNamespace

import jax
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import wrightomega

import asperity as asp
from asperity.errors import InputError
from asperity.laws import get_law
from asperity.loads import Periodic, modulated, sampled
from references.populations import population

MU0, A, B, D0, V0, LAMBDA = 0.5, 0.013, 0.026, 4e-7, 1e-6, 7e-7
K, W0, M = 2e5, 7.0, 1.6
SAMPLES = 2048


def slider(elastic, **changed):
    law = get_law("elasto-plastic" if elastic else "rice-ruina")
    own = {"lambda_": LAMBDA} if elastic else {}
    numbers = {"spring": K, "load": W0, "mass": M} | changed
    return asp.Slider(law(mu0=MU0, A=A, B=B, D0=D0, V0=V0, **own), **numbers)


def two_tones(theta):
    return 1 + 0.3 * np.cos(theta) + 0.1 * np.cos(2 * theta + 0.7)


TILT = 0.05


@dataclass(frozen=True)
class Case:
    """An operating point; shear and pull are what `Excitation` calls so."""

    elastic: bool
    V: float
    f: float
    epsilon: float | None = 0.24
    inertia: bool = False
    eta: float | None = None
    M: float = M
    modulation: object = None
    load: object = None
    shear: object = staticmethod(np.zeros_like)
    pull: object = staticmethod(np.ones_like)

    def w(self, theta):
        return self.load(theta) if self.load else 1 + self.epsilon * np.cos(theta)

    @staticmethod
    def slope(wave, theta):
        """Derivative of an analytic function of a real phase, exact by a complex step."""
        return wave(theta + 1e-30j).imag / 1e-30


CASES = {
    "inertial": Case(True, 1e-6, 120.0, inertia=True),
    "inertial, fast and strong": Case(True, 1e-4, 60.0, 0.5, inertia=True),
    "inertial and radiating": Case(True, 1e-6, 120.0, inertia=True, eta=500.0),
    "stiff inertial": Case(False, 1e-6, 120.0, inertia=True),
    "radiating": Case(False, 1e-5, 60.0, 0.3, eta=2000.0),
    "radiating asperities": Case(True, 1e-6, 120.0, eta=500.0),
    "two tones, tilted exciter, modulated pull": Case(
        True,
        1e-6,
        120.0,
        None,
        modulation=modulated(0.3, load={2: (0.1, 0.7)}, tilt=TILT, pull=0.2, pull_phase=-1.0),
        load=two_tones,
        shear=lambda theta: np.tan(TILT) * (two_tones(theta) - 1),
        pull=lambda theta: 1 + 0.2 * np.cos(theta - 1.0),
    ),
    "tilted exciter, modulated pull": Case(
        True,
        1e-5,
        120.0,
        None,
        modulation=modulated(0.2, load={2: (0.0, 0.0)}, tilt=TILT, pull=0.5, pull_phase=0.3),
        load=lambda theta: 1 + 0.2 * np.cos(theta),
        shear=lambda theta: np.tan(TILT) * 0.2 * np.cos(theta),
        pull=lambda theta: 1 + 0.5 * np.cos(theta + 0.3),
    ),
    "stiff inertial, fast": Case(False, 2e-5, 120.0, 0.4, inertia=True),
}


def friction(plastic, age):
    """Eq. (1); `age` is ln(V0 Phi/D0)."""
    return MU0 + A * np.log(plastic / V0) + B * age


def plastic_velocity(mu, age):
    return V0 * np.exp((mu - MU0 - B * age) / A)


def renewal(v, age):
    """Eq. (2) for ln(V0 Phi/D0)."""
    return V0 / D0 * np.exp(-age) - v / D0


def equations(case):
    """Rates, spring force over W0 from the states, first states, scales, and whether stiff.

    The states are the elongation of the spring (or of spring and asperities), then those of the
    moving slider and of its contacts.
    """
    omega, eta, mass = 2 * np.pi * case.f, case.eta or 0.0, case.M
    pull = lambda t: case.V * case.pull(omega * t)  # noqa: E731
    push = lambda t: W0 * case.shear(omega * t)  # noqa: E731
    W = lambda t: W0 * case.w(omega * t)  # noqa: E731
    spring = lambda t, Y: K * Y[0] / W0  # noqa: E731
    swing = 1e-3 * W0 / K

    def on_asperities(t, Y):
        x, v, mu, age = Y
        force = K * x + push(t) - W(t) * mu - eta * v
        rest = [(v - plastic_velocity(mu, age)) / LAMBDA, renewal(v, age)]
        return np.array([pull(t) - v, force / mass, *rest])

    def bare(t, Y):
        x, log_v, age = Y
        v = np.exp(log_v)
        force = K * x + push(t) - W(t) * friction(v, age) - eta * v
        return np.array([pull(t) - v, force / (mass * v), renewal(v, age)])

    def radiating(t, Y):
        x, age = Y
        # A W ln(v/V0) + eta v = rest: Wright's omega function.
        rest = K * x + push(t) - W(t) * (MU0 + B * age)
        size = A * W(t) / eta
        v = size * wrightomega(rest / (A * W(t)) + np.log(V0 / size))
        return np.array([pull(t) - v, renewal(v, age)])

    def radiating_asperities(t, Y):
        x, mu, age = Y
        v = (K * x + push(t) - W(t) * mu) / eta
        return np.array([pull(t) - v, (v - plastic_velocity(mu, age)) / LAMBDA, renewal(v, age)])

    def carried(t, Y):
        """F_i/W of spring and asperities in series, elongated by Y[0] together."""
        return (K * Y[0] + push(t)) / (W(t) + K * LAMBDA)

    def relaxed(t, Y):
        mu, age = carried(t, Y), Y[1]
        plastic = plastic_velocity(mu, age)
        # The asperities' elongation mu lambda is stretched by the pull as well as by the load.
        phase, rate = omega * t, omega * W0
        stretch = rate * (case.slope(case.shear, phase) - mu * case.slope(case.w, phase))
        mu_rate = (stretch + K * (pull(t) - plastic)) / (W(t) + K * LAMBDA)
        return np.array([pull(t) - plastic, renewal(plastic + LAMBDA * mu_rate, age)])

    def series(t, Y):
        return (W(t) * carried(t, Y) - push(t)) / W0

    if case.inertia and case.elastic:
        return on_asperities, spring, [swing, case.V, 0.01, 1.0], False
    if case.inertia:
        return bare, spring, [swing, 1.0, 1.0], True
    if case.eta and case.elastic:
        return radiating_asperities, spring, [swing, 0.01, 1.0], True
    if case.eta:
        return radiating, spring, [swing, 1.0], False
    return relaxed, series, [swing, 1.0], False


def first_states(case, start):
    """The package's states at theta = 0 as those of `equations`."""
    elongation = start[0] * W0 / K
    if not case.inertia:
        return np.array([elongation, *start[1:]])
    if case.elastic:
        return np.array([elongation, start[1] * case.V, *start[2:]])
    return np.array([elongation, start[1] + np.log(case.V), start[2]])


# The last ones repeat the stiff one, of which SciPy's implicit method takes longest, and the load.
@pytest.fixture(scope="module", params=population(CASES, short=len(CASES) - 2))
def integrated(request):
    """A case, its response, and SciPy's solution over a period from the same start."""
    case = CASES[request.param]
    response = asp.periodic_response(
        slider(case.elastic, mass=case.M),
        velocity=case.V,
        frequency=case.f,
        epsilon=case.epsilon,
        modulation=case.modulation,
        inertia=case.inertia,
        radiation_damping=case.eta,
    )
    assert response.result[()] == "converged"
    rates, force, scale, stiff = equations(case)
    start = first_states(case, response.start)
    solution = integrate(rates, start, case, scale, stiff, dense_output=True)
    return SimpleNamespace(**locals())


def integrate(rates, start, case, scale, stiff, **options):
    method = {"method": "Radau", "rtol": 1e-10} if stiff else {"method": "DOP853", "rtol": 1e-12}
    atol = 1e-12 * np.array(scale)
    solution = solve_ivp(rates, (0, 1 / case.f), start, atol=atol, **method, **options)
    assert solution.success
    return solution


def test_the_integrated_orbit_closes_after_a_period(integrated):
    gap = (integrated.solution.y[:, -1] - integrated.start) / integrated.scale
    assert np.abs(gap).max() < 1e-6


def test_mean_and_harmonics_are_those_of_the_integrated_force(integrated):
    t = np.arange(SAMPLES) / SAMPLES / integrated.case.f
    spectrum = np.fft.rfft(integrated.force(t, integrated.solution.sol(t))) / SAMPLES
    assert integrated.response.mean_friction == pytest.approx(spectrum[0].real, rel=1e-9)
    # Dense output is less accurate than the steps.
    np.testing.assert_allclose(integrated.response.harmonics[:2], 2 * spectrum[1:3], rtol=2e-7)


def test_multipliers_are_those_of_the_integrated_monodromy_matrix(integrated):
    """By complex steps in the start; where SciPy's method must be implicit, by real ones."""
    case, columns = integrated.case, []
    for j, size in enumerate(integrated.scale):
        unit = np.eye(len(integrated.scale))[j] * size
        ends = [
            integrate(
                integrated.rates,
                integrated.start + h * unit,
                case,
                integrated.scale,
                integrated.stiff,
            ).y[:, -1]
            for h in ((1e-5, -1e-5) if integrated.stiff else (1e-30j,))
        ]
        change = (ends[0] - ends[1]) / 2e-5 if integrated.stiff else ends[0].imag / 1e-30
        columns.append(change / size)
    expected = np.linalg.eigvals(np.stack(columns, axis=1))
    multipliers = integrated.response.multipliers
    for m in multipliers[np.abs(multipliers) > 1e-3]:
        assert np.abs(expected - m).min() < (2e-5 if integrated.stiff else 1e-7) * np.abs(m)


@pytest.mark.parametrize("elastic", [True, False])
def test_for_vanishing_mass_and_damping_the_response_is_quasi_static(elastic):
    """Differences vanish in proportion to the mass, and to the damping."""
    drive = {"velocity": 1e-6, "epsilon": 0.24, "frequency": 120.0}
    plain = asp.periodic_response(slider(elastic), **drive)
    # On asperities the mass counts by its resonance, otherwise by its momentum.
    masses = np.array([4e-3, 2e-3]) if elastic else np.array([2e-3, 1e-3])
    heavy = asp.periodic_response(slider(elastic, mass=masses), inertia=True, **drive)
    damped = asp.periodic_response(slider(elastic), radiation_damping=[20.0, 10.0], **drive)
    for response in (heavy, damped):
        for name in ("mean_friction", "mu1", "mu2"):
            gap = getattr(response, name) - getattr(plain, name)
            assert np.abs(gap[1] / getattr(plain, name)) < 2e-3
            assert gap[0] / gap[1] == pytest.approx(2, abs=0.15)


def test_a_sampled_period_is_the_modulation_it_was_sampled_from():
    theta, samples = np.linspace(0, 7, 50), np.arange(64) * 2 * np.pi / 64
    built = modulated(0.3, load={2: (0.1, 0.7)}, pull=0.2, pull_phase=-1.0)
    read = sampled(7.0 * two_tones(samples), velocity=3 * (1 + 0.2 * np.cos(samples - 1.0)))
    for one, other in zip(built.at(theta), read.at(theta), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-13)
    assert read.amplitude == pytest.approx(0.3)


@pytest.mark.parametrize("count", [3, 4, 9, 64])
def test_a_sampled_period_has_its_samples(count):
    load = np.random.default_rng(count).uniform(0.8, 1.2, count)
    w = sampled(load).at(np.arange(count) * 2 * np.pi / count).w
    np.testing.assert_allclose(w, load / load.mean(), rtol=1e-12)


@pytest.mark.parametrize("count", [1, 8, 9, 300])
def test_a_sum_of_few_and_of_many_harmonics_is_the_sum_of_its_terms(count):
    theta, k = np.linspace(0, 7, 50)[:, None], np.arange(1, count + 1)
    a, b = np.random.default_rng(count).normal(size=(2, count, 3)) / count
    at = Periodic(load=tuple(zip(a, b, strict=True))).at(theta)
    cos, sin = np.cos(k * theta), np.sin(k * theta)
    np.testing.assert_allclose(at.w, 1 + cos @ a + sin @ b, atol=1e-12)
    np.testing.assert_allclose(at.w_slope, (k * cos) @ b - (k * sin) @ a, atol=1e-10)


def test_many_harmonics_are_the_passes_of_a_loop():
    """Unrolled, hundreds of harmonics took minutes to compile; of a few, a loop is slower."""

    def loops(count):
        load = Periodic(load=((0.1, 0.0),) * count)
        return jax.jit(load.at).lower(0.3).as_text().count("stablehlo.while")

    assert (loops(3), loops(300)) == (0, 1)


@pytest.mark.parametrize("inertia", [False, True])
@pytest.mark.parametrize("load", [Periodic(), sampled([3.0, 3.0, 3.0, 3.0])], ids=str)
def test_a_constant_load_is_steady_sliding(load, inertia):
    drive = {"velocity": [1e-6, 2e-6], "frequency": 120.0, "inertia": inertia}
    steady = asp.periodic_response(slider(True), modulation=load, **drive)
    assert steady.converged.all()
    np.testing.assert_allclose(steady.delta_mu, 0, atol=1e-15)
    np.testing.assert_allclose(steady.mu1, 0, atol=1e-15)
    expected = asp.periodic_response(slider(True), epsilon=0.0, **drive).multipliers
    np.testing.assert_allclose(steady.multipliers, expected, rtol=1e-9)


def test_slopes_are_derivatives():
    theta, h = np.linspace(0, 7, 50), 1e-5
    programme = modulated(0.3, load={3: (0.1, 0.7)}, tilt="10 deg")
    after, before, here = (programme.at(theta + d) for d in (h, -h, 0.0))
    np.testing.assert_allclose((after.w - before.w) / (2 * h), here.w_slope, atol=1e-9)
    np.testing.assert_allclose((after.shear - before.shear) / (2 * h), here.shear_slope, atol=1e-9)


def test_one_harmonic_is_the_harmonic_load():
    drive = {"velocity": 1e-6, "frequency": 120.0}
    plain = asp.periodic_response(slider(True), epsilon=0.3, **drive)
    # The second point makes these the equations of the cases above, and so their programs.
    programme = modulated(0.3, load={2: (0.0, 0.0)}, tilt=[0.0, TILT], pull=[0.0, 0.2])
    built = asp.periodic_response(slider(True), modulation=programme, **drive)
    for name in ("mean_friction", "mu1", "mu2", "phase1", "phase2"):
        assert getattr(built, name)[0] == pytest.approx(float(getattr(plain, name)), rel=1e-8)
    np.testing.assert_allclose(built.multipliers[0], plain.multipliers, rtol=1e-8)


@pytest.mark.parametrize(
    ("build", "said"),
    [
        (lambda: modulated(0.7, load={2: (0.4, np.pi)}), "load must stay positive over the period"),
        # One sample, between two of 720 phases.
        (lambda: sampled(np.where(np.arange(1440) == 721, -0.05, 1)), "load must stay positive"),
        (lambda: modulated(0.1, load={1: (0.1, 0.0)}), "load must have harmonics from 2 on, got 1"),
        (lambda: modulated(0.1, load={2: 0.4}), r"load\[2\] must be a pair of amplitude and phase"),
        (lambda: modulated(0.1, tilt="95 deg"), "tilt must be less than a right angle"),
        (lambda: modulated(0.1, tilt="5 turns"), "tilt must be an angle in rad or deg"),
        (lambda: sampled(), "load, velocity or shear must be given"),
        (lambda: sampled(shear=[0.2, 0.3, 0.1]), "shear must have a mean of zero, got 0.2"),
        (lambda: sampled([1.0, np.nan, 1.0]), "load must be finite, got nan"),
        (lambda: sampled(velocity=[-1.0, -2.0, -1.0]), "velocity must have a positive mean"),
    ],
)
def test_impossible_modulations_are_refused(build, said):
    with pytest.raises(InputError, match=said):
        build()


def test_an_orbit_whose_branch_is_lost_is_that_on_which_the_motion_settles():
    """Near the resonance of mass and spring; following its branch ended after minutes."""
    mu0, a, b, length, v0 = 0.7387356623, 0.00703358068, 0.0146487103, 8.18735677e-7, 1e-6
    stiffness, mass, load, eta = 367667.66, 0.52086995, 1.03718515, 22.1435
    pull, frequency, epsilon = 8.36269e-5, 90.92317, 0.0641268
    law = get_law("ruina-slip")(mu0=mu0, A=a, B=b, D0=length, V0=v0)
    response = asp.periodic_response(
        asp.Slider(law, spring=stiffness, load=load, mass=mass), velocity=pull, epsilon=epsilon,
        frequency=frequency, inertia=True, radiation_damping=eta,
    )  # fmt: skip
    assert response.stable

    def rates(t, y):
        force, log_v, phi = y
        w, v = 1 + epsilon * np.cos(2 * np.pi * frequency * t), pull * np.exp(log_v)
        friction = mu0 + a * np.log(v / v0) + b * phi
        excess = load * (force - w * friction) - eta * v
        change = -v / length * (np.log(v / v0) + phi)
        return [stiffness / load * (pull - v), excess / (mass * v), change]

    span, start = (0, 1 / frequency), response.start
    run = solve_ivp(rates, span, start, "Radau", rtol=1e-9, atol=1e-11, dense_output=True)
    np.testing.assert_allclose(run.y[:, -1], start, atol=1e-9)
    spectrum = np.fft.rfft(run.sol(np.arange(SAMPLES) / SAMPLES / frequency)[0]) / SAMPLES
    assert response.mean_friction == pytest.approx(spectrum[0].real, rel=1e-8)
    np.testing.assert_allclose(response.harmonics[:2], 2 * spectrum[1:3], rtol=1e-6)


def test_inertia_needs_a_mass_and_damping_a_value():
    drive = {"velocity": 1e-6, "epsilon": 0.1, "frequency": 120.0}
    with pytest.raises(InputError, match=r"slider\.mass must be positive, got 0 kg; give the mass"):
        asp.periodic_response(slider(True, mass=0.0), inertia=True, **drive)
    with pytest.raises(InputError, match="radiation_damping must be positive"):
        asp.periodic_response(slider(True), radiation_damping=0.0, **drive)
    with pytest.raises(InputError, match="exactly one of epsilon and modulation"):
        asp.periodic_response(slider(True), velocity=1e-6, frequency=120.0)


@pytest.mark.parametrize("more", [{"inertia": True}, {"radiation_damping": 500.0}])
def test_a_law_without_rate_has_no_dynamics_to_add_inertia_to(more):
    null = asp.Slider(get_law("amontons")(mu0=0.5), spring=K, load=W0, mass=M)
    with pytest.raises(InputError, match="law must depend on the velocity with inertia"):
        asp.periodic_response(null, velocity=1e-6, epsilon=0.1, frequency=120.0, **more)


def test_a_law_without_rate_balances_the_shear_force():
    """F = mu W - T: what the tilted exciter pushes the spring need not pull."""
    null = asp.Slider(get_law("amontons")(mu0=0.5), spring=K, load=W0)
    tilted = modulated(0.2, load={2: (0.0, 0.0)}, tilt=TILT)
    response = asp.periodic_response(null, velocity=1e-6, frequency=120.0, modulation=tilted)
    assert response.mu1 == pytest.approx(0.2 * (0.5 - np.tan(TILT)), rel=1e-12)


def test_a_law_without_rate_has_the_harmonics_of_a_load_with_many():
    """A load that is nearly a square: its harmonics beyond those asked for do not fold back."""
    theta = 2 * np.pi * np.arange(256) / 256
    square = sampled(1 + 0.3 * np.sign(np.cos(theta + 0.01)))
    null = asp.Slider(get_law("amontons")(mu0=0.5), spring=K, load=W0)
    response = asp.periodic_response(null, velocity=1e-6, frequency=120.0, modulation=square)
    of_load = [0.5 * (a - 1j * b) for a, b in square.load[:8]]
    assert response.harmonics == pytest.approx(np.array(of_load), abs=1e-14)


def test_provenance_writes_the_modulation_out():
    programme = modulated(0.2, load={2: (0.1, 0.0)}, pull=0.5)
    null = asp.Slider(get_law("amontons")(mu0=0.5), spring=K, load=W0)
    response = asp.periodic_response(null, velocity=1e-5, frequency=120.0, modulation=programme)
    assert response.provenance["modulation"] == (
        "w(t) = 1 + (0.2) cos(1 w t) + (0.1) cos(2 w t), V(t)/V = 1 + (0.5) cos(1 w t)"
    )
