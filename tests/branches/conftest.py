"""Shooting for Rice-Ruina friction, written once more, sharing nothing with the package.

States f = F/W0 and phi = ln(V Phi/D0), in time; one period integrated by SciPy's DOP853 together
with the variational equations.
"""

import dataclasses

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import asperity as asp


@dataclasses.dataclass(frozen=True)
class Shooting:
    """An experiment, SI."""

    K: float
    V: float = 1e-6
    frequency: float = 120.0
    mu0: float = 0.5
    A: float = 0.013
    B: float = 0.026
    D0: float = 4e-7
    W0: float = 7.0

    @property
    def slider(self):
        law = asp.laws.RiceRuina(mu0=self.mu0, A=self.A, B=self.B, D0=self.D0, V0=1e-6)
        return asp.Slider(law, spring=self.K, load=self.W0, mass=1.6)

    @property
    def Kc(self):
        return (self.B - self.A) * self.W0 / self.D0

    def flow(self, state, epsilon, periods=1):
        """States and derivative of them by the first ones after whole periods."""
        omega = 2 * np.pi * self.frequency
        mu = self.mu0 - (self.B - self.A) * np.log(self.V / 1e-6)

        def rates(t, y):
            f, phi = y[:2]
            w = 1 + epsilon * np.cos(omega * t)
            slip = np.exp((f / w - mu - self.B * phi) / self.A)
            renewal = np.exp(-phi)
            by_f, by_phi = slip / (self.A * w), -slip * self.B / self.A
            spring, memory = self.K * self.V / self.W0, self.V / self.D0
            jacobian = np.array(
                [
                    [-spring * by_f, -spring * by_phi],
                    [-memory * by_f, -memory * (renewal + by_phi)],
                ]
            )
            flat = (jacobian @ y[2:].reshape(2, 2)).ravel()
            return np.array([spring * (1 - slip), memory * (renewal - slip), *flat])

        start = np.array([*state, 1.0, 0.0, 0.0, 1.0])
        span = (0, periods / self.frequency)
        last = solve_ivp(rates, span, start, "DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
        return last[:2], last[2:].reshape(2, 2)

    def orbit(self, state, epsilon, periods=1):
        """Initial states of the periodic orbit near `state`, and its monodromy matrix."""
        state = np.asarray(state, float)
        for _ in range(20):
            end, monodromy = self.flow(state, epsilon, periods)
            step = np.linalg.solve(monodromy - np.eye(2), end - state)
            state = state - step
            if np.abs(step).max() < 1e-9:
                return state, self.flow(state, epsilon, periods)[1]
        raise AssertionError("shooting found no periodic orbit")

    def followed(self, epsilon, steps):
        """The orbit at `epsilon` by natural continuation from steady sliding."""
        state = np.array([self.mu0 - (self.B - self.A) * np.log(self.V / 1e-6), 0.0])
        for share in np.linspace(0, 1, steps + 1)[1:]:
            state, monodromy = self.orbit(state, share * epsilon)
        return state, monodromy

    def crossing(self, test, low, high, state):
        """Epsilon at which a function of the monodromy matrix vanishes."""
        return brentq(lambda e: test(self.orbit(state, e)[1]), low, high, xtol=1e-14, rtol=1e-12)


@pytest.fixture(scope="session")
def shooting():
    return Shooting
