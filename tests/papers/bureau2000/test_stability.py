"""Thresholds of stability, compared with an independent variational integration.

The equations are the paper's, written in f = F/W0, phi = ln(V Phi/D0); the orbit is closed by
Newton's method on the end of one period, with the monodromy matrix of the variational equations.
"""

import dataclasses

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from asperity import Slider, periodic_response
from asperity_papers.bureau2000 import stability
from asperity_papers.bureau2000.machine import EXT, RR, Machine

MU0, A, B, D0, V0, W0, K = 0.5, 0.013, 0.026, 4e-7, 1e-6, 7.0, 2e5
PERIOD = 1 / 120


@dataclasses.dataclass(frozen=True)
class Equations:
    V: float
    epsilon: float
    alpha: float = 0.0
    lambda_: float = 0.0

    @property
    def mu(self):
        return MU0 - (B - A) * np.log(self.V / V0)

    def rates(self, t, f, phi):
        omega = 2 * np.pi / PERIOD
        w = 1 + self.epsilon * np.cos(omega * t)
        dw = -self.epsilon * omega * np.sin(omega * t)
        plastic = self.V * np.exp((f / w - self.mu - B * phi) / A)
        df = (self.V - plastic + self.lambda_ * f * dw / w**2) / (W0 / K + self.lambda_ / w)
        v = self.V - W0 / K * df
        return df, self.V / D0 * np.exp(-phi) - v / D0 - self.alpha / B * dw / w

    def with_variation(self, t, y):
        step = 1e-30
        value = self.rates(t, y[0], y[1])
        columns = [self.rates(t, y[0] + 1j * step, y[1]), self.rates(t, y[0], y[1] + 1j * step)]
        jacobian = np.imag(np.array(columns).T) / step
        return np.concatenate([value, (jacobian @ y[2:].reshape(2, 2)).ravel()])

    def one_period(self, start):
        run = solve_ivp(
            self.with_variation,
            (0, PERIOD),
            np.concatenate([start, np.eye(2).ravel()]),
            "DOP853",
            rtol=1e-12,
            atol=1e-15,
            max_step=PERIOD / 40,
        )
        return run.y[:2, -1], run.y[2:, -1].reshape(2, 2)

    def averaged(self):
        """Initial guess: constant f and phi = c - (alpha/B) ln w of the averaged equations."""
        w = 1 + self.epsilon * np.cos(np.linspace(0, 2 * np.pi, 400, endpoint=False))
        c = np.log(np.mean(w ** (self.alpha / B)))
        age = B * c - self.alpha * np.log(w)

        def excess(f):
            return np.log(np.mean(np.exp((f / w - self.mu - age) / A)))

        return np.array([brentq(excess, 0.01, 0.6), age[0] / B])

    def multiplier(self):
        """Largest modulus of the Floquet multipliers of the periodic orbit."""
        start = self.averaged()
        for _ in range(25):
            end, monodromy = self.one_period(start)
            step = np.linalg.solve(monodromy - np.eye(2), start - end)
            start = start + step * min(1, 0.02 / max(np.abs(step).max(), 1e-12))
            if np.abs(step).max() < 1e-11:
                return np.abs(np.linalg.eigvals(monodromy)).max()
        raise AssertionError("the reference integration found no periodic solution")


def steady_multiplier(slider, V, frequency):
    """Floquet multiplier of unmodulated sliding over one period."""
    return float(periodic_response(slider, velocity=V, epsilon=0, frequency=frequency).floquet_max)


@pytest.fixture
def figure(figures):
    return figures["figure-12"]


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
# The slope of |m| in eps is 0.012 and 0.12: these errors of |m| are 1e-6 in the threshold.
@pytest.mark.parametrize(
    ("speed", "V", "modulus"), [("1 um/s", 1e-6, 1e-8), ("10 um/s", 1e-5, 1e-7)]
)
def test_the_multiplier_is_one_at_the_threshold(figure, variant, parameters, speed, V, modulus):
    epsilon = figure.scalars[f"threshold {variant}, {speed}"]
    assert Equations(V, epsilon, **parameters).multiplier() == pytest.approx(1, abs=modulus)


def test_curves_are_stable_above_the_threshold_and_unstable_below(figure):
    for curve in figure.data["curve"].unique():
        rows, threshold = figure.curve(curve), figure.scalars[f"threshold {curve}"]
        assert (rows["stable"] == (rows["epsilon_eff"] > threshold)).all()


def test_unmodulated_sliding_is_unstable_at_the_central_values(figure):
    assert figure.scalars["K_over_Kc"] == pytest.approx(0.88, abs=0.005)
    assert figure.scalars["steady 1e-06"] == pytest.approx(1.00125995, abs=1e-8)


@pytest.mark.parametrize(("law", "lambda_"), [(RR, 0.0), (EXT, 7e-7)])
@pytest.mark.parametrize("V", [1e-6, 1e-5])
def test_the_multiplier_of_steady_sliding_agrees_with_its_closed_form(law, lambda_, V):
    steady = Equations(V, 0.0, lambda_=lambda_)
    assert steady_multiplier(Machine().slider(law), V, 120.0) == pytest.approx(
        steady.multiplier(), rel=1e-10
    )


def test_the_growth_rate_vanishes_at_the_critical_stiffness():
    slider = Machine().slider(RR)
    stiffness = (B - A) * W0 / D0
    critical = Slider(slider.law, spring=stiffness, load=float(slider.W0))
    assert abs(steady_multiplier(critical, 1e-6, 1.0) - 1) < 1e-10
    assert steady_multiplier(slider, 1e-6, 1.0) > 1


def test_a_threshold_outside_its_bracket_is_nan():
    V = np.array([1e-6])
    epsilon = stability.thresholds(Machine(), "RR", V, (np.array([0.02]), np.array([0.05])))
    assert np.isnan(epsilon).all()
