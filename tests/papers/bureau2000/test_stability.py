"""Thresholds of stability, compared with shooting on the published equations."""

import numpy as np
import pytest

from asperity_papers.bureau2000 import stability

SEGMENTS = 16


@pytest.fixture
def figure(figures):
    return figures["figure-12"]


def averaged_guess(p, epsilon, force):
    """F/W0 and ln(v_pl/V) at the segments of a period, as in the limit of fast modulation.

    The force and B ln Phi + alpha ln w are constant, but for the stretch of the spring by the slip.
    """
    w = 1 + epsilon * np.cos(2 * np.pi * np.arange(SEGMENTS) / SEGMENTS)
    exponent = (force / w + p.alpha * np.log(w)) / p.A
    log_slip = exponent - np.log(np.exp(exponent).mean(1, keepdims=True))
    stretch = p.V * p.K / (p.W0 * p.frequency * SEGMENTS) * (1 - np.exp(log_slip))
    return force + np.cumsum(stretch, axis=1) - stretch, log_slip


def test_rice_ruina_is_stabilised_at_10_to_15_percent(figure):
    for speed in ("1 um/s", "10 um/s"):
        assert 0.10 < figure.scalars[f"threshold RR, {speed}"] < 0.15


@pytest.mark.parametrize(
    ("variant", "parameters"),
    [
        ("RR", {}),
        ("LD 0.2", {"alpha": 0.2}),
        ("LD 0.02", {"alpha": 0.02}),
        ("EXT", {"lambda_": 7e-7}),
    ],
)
def test_the_multiplier_is_one_at_the_threshold(figure, reference, variant, parameters):
    curves = [f"{variant}, {speed}" for speed in ("1 um/s", "10 um/s")]
    epsilon = np.array([[figure.scalars[f"threshold {curve}"]] for curve in curves])
    force = [
        [figure.at(curve, "mean_friction", at, "epsilon_eff")]
        for curve, (at,) in zip(curves, epsilon, strict=True)
    ]
    p = reference.Printed(V=np.array([[1e-6], [1e-5]]), **parameters)
    shot = reference.multiple_shooting(p, epsilon, *averaged_guess(p, epsilon, np.array(force)))
    # The slope of |m| in eps is 0.012 and 0.12: these errors of |m| are 1e-6 in the threshold.
    np.testing.assert_array_less(np.abs(np.abs(shot.multipliers[:, 0]) - 1), [1e-8, 1e-7])


def test_curves_are_stable_above_the_threshold_and_unstable_below(figure):
    for curve in figure.data["curve"].unique():
        rows, threshold = figure.curve(curve), figure.scalars[f"threshold {curve}"]
        assert (rows["stable"] == (rows["epsilon_eff"] > threshold)).all()


def test_unmodulated_sliding_is_unstable_at_the_central_values(figure):
    assert figure.scalars["K_over_Kc"] == pytest.approx(0.88, abs=0.005)
    assert figure.scalars["steady 1e-06"] == pytest.approx(1.00125995, abs=1e-8)


@pytest.mark.parametrize(("variant", "lambda_"), [("RR", 0.0), ("EXT", 7e-7)])
@pytest.mark.parametrize(("speed", "V"), [("1 um/s", 1e-6), ("10 um/s", 1e-5)])
def test_unmodulated_sliding_grows_by_its_eigenvalue(figure, reference, variant, lambda_, speed, V):
    p, step = reference.Printed(V=V, lambda_=lambda_), 1e-30
    columns = [np.imag(p.rates(0.0, p.steady + 1j * step * e, 0.0)) / step for e in np.eye(2)]
    growth = np.linalg.eigvals(np.transpose(columns)).real.max()
    first = figure.curve(f"{variant}, {speed}").iloc[0]
    assert first["epsilon_eff"] == 0
    assert first["floquet_max"] == pytest.approx(np.exp(growth / 120), rel=1e-10)


@pytest.mark.parametrize(("gap", "known"), [([], True), ([60], True), ([44], False), ([45], False)])
def test_a_threshold_next_to_a_point_that_failed_is_nan(figure, gap, known):
    rows = figure.curve("RR, 1 um/s").reset_index(drop=True)
    rows.loc[gap, "converged"], rows.loc[gap, "floquet_max"] = False, np.nan
    threshold = figure.scalars["threshold RR, 1 um/s"]
    assert rows["epsilon_eff"][44] < threshold < rows["epsilon_eff"][45]
    expected = threshold if known else np.nan
    assert stability.fall_below_one(rows) == pytest.approx(expected, rel=1e-9, nan_ok=True)


def test_a_curve_that_does_not_become_stable_has_no_threshold(figure):
    assert np.isnan(stability.fall_below_one(figure.curve("RR, 1 um/s")[:40]))
    assert np.isnan(stability.fall_below_one(figure.curve("RR, 1 um/s")[50:]))
    assert np.isnan(stability.fall_below_one(figure.curve("RR, 1 um/s").assign(floquet_max=np.nan)))
