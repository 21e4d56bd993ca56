"""Where modulation stabilises and destabilises, held against closed forms and integrations."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import asperity as asp
from asperity import materials
from asperity.errors import InputError
from asperity.laws import get_law
from asperity.study.map import Axis
from asperity.study.threshold import natural_scales, stiffness_threshold
from asperity.theory.linear_stability import critical_stiffness

PMMA = materials.load("bureau2000")
SLIDERS = {
    law: asp.Slider(PMMA.law(law), spring=PMMA.K, load=PMMA.W0, mass=PMMA.M)
    for law in ("rice-ruina", "elasto-plastic")
}
KC = (PMMA.B - PMMA.A) * PMMA.W0 / PMMA.D0


def test_the_natural_scales_are_those_of_the_paper() -> None:
    Kc, fc = natural_scales(SLIDERS["rice-ruina"], "10 um/s")
    assert Kc == pytest.approx(KC, rel=1e-12)
    assert 2 * np.pi * fc == pytest.approx(1e-5 / PMMA.D0, rel=1e-12)


def test_without_modulation_the_thresholds_are_the_closed_forms() -> None:
    rigid = stiffness_threshold(SLIDERS["rice-ruina"], velocity=1e-6, epsilon=0.0, frequency=120.0)
    assert float(rigid.ratio) == pytest.approx(1.0, rel=1e-5)
    assert rigid.kind[()] == "Neimark-Sacker"
    elastic = stiffness_threshold(
        SLIDERS["elasto-plastic"], velocity=1e-6, epsilon=0.0, frequency=120.0
    )
    expected = PMMA.D0 / (PMMA.D0 + PMMA.A * PMMA.lambda_)
    assert float(elastic.ratio) == pytest.approx(expected, rel=1e-5)


def test_a_second_state_counts_in_the_scale_of_the_search() -> None:
    """B < A < B + B2 was refused as a law that strengthens with velocity."""
    numbers = {"mu0": 0.5, "A": 0.01, "B": 0.006, "D0": 4e-7, "V0": 1e-6, "B2": 0.012, "D2": 3e-6}
    slider = asp.Slider(get_law("two-state")(**numbers), spring=1e5, load=7.0)
    Kc, _ = natural_scales(slider, "1 um/s")
    assert Kc == pytest.approx(7.0 * critical_stiffness(slider.law, 1e-6), rel=1e-9)
    stable = asp.Slider(get_law("two-state")(**numbers | {"B2": 0.001}), spring=1e5, load=7.0)
    with pytest.raises(InputError, match=r"between must be given where .* any stiffness"):
        stiffness_threshold(stable, velocity=1e-6, epsilon=0.0, frequency=120.0)


def test_where_there_is_no_threshold_the_result_says_on_which_side() -> None:
    below = stiffness_threshold(
        SLIDERS["rice-ruina"],
        velocity=1e-6,
        epsilon=0.1,
        frequency=120.0,
        between=(1.2 * KC, 4 * KC),
    )
    above = stiffness_threshold(
        SLIDERS["rice-ruina"],
        velocity=1e-6,
        epsilon=0.1,
        frequency=120.0,
        between=(0.3 * KC, 0.6 * KC),
    )
    assert np.isnan(below.ratio)
    assert "stable at every stiffness" in below.result[()]
    assert f"from {1.2 * KC:.4g} N/m; extend between" in below.result[()]
    assert f"unstable at the stiffest spring of the scan, {0.6 * KC:.4g} N/m" in above.result[()]


def test_inertia_without_a_mass_is_refused() -> None:
    """The result was that no stiffness has a periodic response."""
    slider = asp.Slider(PMMA.law("rice-ruina"), spring=PMMA.K, load=PMMA.W0)
    with pytest.raises(InputError, match="mass must be positive, got 0 kg"):
        stiffness_threshold(slider, velocity=1e-6, epsilon=0.1, frequency=120.0, inertia=True)


def monodromy(rates, start, period: float, step: float = 1e-6) -> np.ndarray:
    """Derivatives of the states after a period, by central differences."""

    def after(y):
        done = solve_ivp(rates, (0.0, period), y, method="DOP853", rtol=1e-11, atol=1e-13)
        return done.y[:, -1]

    columns = [
        (after(start + step * e) - after(start - step * e)) / (2 * step) for e in np.eye(len(start))
    ]
    return np.column_stack(columns)


def periodic(rates, start, period: float) -> np.ndarray:
    """Close the orbit by Newton's method."""
    for _ in range(12):
        done = solve_ivp(rates, (0.0, period), start, method="DOP853", rtol=1e-11, atol=1e-13)
        matrix = monodromy(rates, start, period) - np.eye(len(start))
        change = np.linalg.solve(matrix, done.y[:, -1] - start)
        start = start - change
        if np.abs(change).max() < 1e-9:
            return start
    raise AssertionError("no orbit")


def test_twice_the_natural_frequency_doubles_the_period() -> None:
    """An integration of the printed equations, in the variables f and phi = ln(V Phi/D0)."""
    V, eps, f = 1e-6, 0.2, 1.0
    result = stiffness_threshold(SLIDERS["rice-ruina"], velocity=1e-6, epsilon=eps, frequency=f)
    assert result.kind[()] == "period doubling"
    assert float(result.ratio) > 2
    K, W0, D0, A, B = float(result.ratio) * KC, PMMA.W0, PMMA.D0, PMMA.A, PMMA.B

    def rates(t, y):
        force, phi = y
        w = 1 + eps * np.cos(2 * np.pi * f * t)
        v = V * np.exp((force / w - PMMA.mu0 - B * phi) / A)
        return [K / W0 * (V - v), V / D0 * np.exp(-phi) - v / D0]

    slider = asp.Slider(PMMA.law("rice-ruina"), spring=K, load=W0)
    response = asp.periodic_response(slider, velocity=V, epsilon=eps, frequency=f)
    start = periodic(rates, np.array([float(response.mean_friction), 0.0]), 1 / f)
    multipliers = np.linalg.eigvals(monodromy(rates, start, 1 / f))
    assert multipliers.real.min() == pytest.approx(-1.0, abs=2e-4)
    assert np.abs(multipliers.imag).max() == 0


def test_far_above_stick_slip_the_threshold_knows_no_frequency() -> None:
    result = stiffness_threshold(
        SLIDERS["rice-ruina"], velocity=1e-6, epsilon=0.2, frequency=np.array([20.0, 120.0, 700.0])
    )
    np.testing.assert_allclose(result.ratio, result.ratio[1], rtol=1e-3)
    assert (result.ratio < 0.85).all()


def test_a_planted_mistake_in_the_scale_is_seen(monkeypatch) -> None:
    from asperity.study import threshold

    monkeypatch.setattr(threshold, "natural_scales", lambda slider, V: (1.01 * KC, 0.4))
    wrong = stiffness_threshold(SLIDERS["rice-ruina"], velocity=1e-6, epsilon=0.0, frequency=120.0)
    assert abs(float(wrong.ratio) - 1) > 5e-3


@pytest.mark.long
def test_twice_the_resonance_of_the_asperities_doubles_the_period() -> None:
    """An integration of the inertial equations: force, velocity, interface force and age."""
    V, eps, f, K = 1e-6, 0.15, 810.0, 2 * KC
    numbers = {n: PMMA[n].si for n in ("mu0", "A", "B", "D0", "V0", "lambda", "W0", "M")}
    numbers |= {"K": K, "V": V, "inertia": 1.0}
    axes = {"x": Axis("frequency", 700.0, f, 2), "y": Axis("epsilon", 0.02, eps, 2)}
    dataset = asp.map("elasto-plastic", numbers, **axes)
    assert dataset["stable"].values.tolist() == [[True, True], [True, False]]
    assert dataset["mode"].values[1, 1] == "period doubling"
    W0, D0, A, B, M, lam = PMMA.W0, PMMA.D0, PMMA.A, PMMA.B, PMMA.M, PMMA.lambda_
    omega = 2 * np.pi * f

    def rates(theta, y):
        force, u, inner, phi = y  # F/W0, dx/dt over V, F_i/W0, ln(V Phi/D0)
        w, dw = 1 + eps * np.cos(theta), -eps * omega * np.sin(theta)
        slip = V * np.exp((inner / w - PMMA.mu0 - B * phi) / A)
        v = V * u
        return np.array([
            K / W0 * (V - v),
            W0 / (M * V) * (force - inner),
            w / lam * (v - slip) + inner * dw / w,
            V / D0 * np.exp(-phi) - v / D0,
        ]) / omega  # fmt: skip

    mean = float(dataset["mean_friction"].values[1, 1])
    start = np.array([mean, 1.0, mean, 0.0])
    start = periodic(rates, start, 2 * np.pi)
    multipliers = np.linalg.eigvals(monodromy(rates, start, 2 * np.pi))
    leading = multipliers[np.argmax(np.abs(multipliers))]
    assert leading.real < -1
    assert np.log(abs(leading)) == pytest.approx(
        float(dataset["log_multiplier"].values[1, 1]), rel=1e-4
    )
