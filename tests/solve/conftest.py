"""An integration of the published equations that shares nothing with the package.

The equations are written in physical units as the paper prints them. States: the extension d of
the spring (m, counted from steady sliding) and the age Phi (s); with inertia, also the velocity v
(m/s) and the elastic displacement of the asperities (m). One period is integrated by SciPy's DOP853
and the periodic solution found by Newton's method on the end point.
"""

import dataclasses
import itertools
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest
from scipy.integrate import solve_ivp

SAMPLES = 32


@dataclasses.dataclass(frozen=True)
class Printed:
    """Parameters of one experiment, SI; `ageing` and `load_rate` select variants."""

    mu0: float = 0.5
    A: float = 0.013
    B: float = 0.026
    D0: float = 4e-7
    V0: float = 1e-6
    K: float = 2e5
    W0: float = 7.0
    V: float = 1e-6
    frequency: float = 120.0
    alpha: float = 0.0
    lambda_: float = 0.0
    M: float = 0.0
    ageing: str = "slider"
    product: bool = False
    load_rate: bool = True

    @property
    def omega(self) -> float:
        return 2 * np.pi * self.frequency

    @property
    def mu(self) -> float:
        """Steady friction coefficient at V."""
        log = np.log(self.V / self.V0)
        if self.product:
            return self.mu0 * (1 + self.A / self.mu0 * log) * (1 - self.B / self.mu0 * log)
        return self.mu0 - (self.B - self.A) * log

    def plastic_velocity(self, friction: float, age: float) -> float:
        """The friction law, Eq. (1) or (3)-(5), solved for the velocity in its rate term."""
        log_age = np.log(self.V0 * age / self.D0)
        if self.product:
            strength = friction / (self.mu0 * (1 + self.B / self.mu0 * log_age))
            return self.V0 * np.exp((strength - 1) * self.mu0 / self.A)
        return self.V0 * np.exp((friction - self.mu0 - self.B * log_age) / self.A)

    @property
    def scale(self) -> np.ndarray:
        """Typical changes of the states."""
        inertial = [self.V, self.A * self.lambda_] if self.M else []
        return np.array([self.A * self.W0 / self.K, self.D0 / self.V, *inertial])

    @property
    def steady(self) -> np.ndarray:
        inertial = [self.V, self.mu * self.lambda_] if self.M else []
        return np.array([0.0, self.D0 / self.V, *inertial])

    def rates(self, t: float, state: np.ndarray, epsilon: float) -> list[float]:
        """Time derivatives of the states; with M, also of v and of the elastic displacement."""
        d, age = state[:2]
        W = self.W0 * (1 + epsilon * np.cos(self.omega * t))
        dW = -self.W0 * epsilon * self.omega * np.sin(self.omega * t) * self.load_rate
        F = self.mu * self.W0 + self.K * d
        if self.M:
            return self._inertial(F, W, dW, age, *state[2:])
        plastic = self.plastic_velocity(F / W, age)
        # v - d(F lambda/W)/dt = plastic, with dF/dt = K (V - v)
        soft = self.lambda_ * self.K / W
        v = (plastic + soft * self.V - self.lambda_ * F * dW / W**2) / (1 + soft)
        return [self.V - v, self.ageing_rate(v, plastic, age, dW / W)]

    def _inertial(self, F, W, dW, age, v, elastic) -> list[float]:
        """Eq. (8); the asperities carry F_i = W elastic/lambda, or are rigid."""
        if self.lambda_:
            interface = W * elastic / self.lambda_
            plastic = self.plastic_velocity(interface / W, age)
        else:
            log_age = np.log(self.V0 * age / self.D0)
            interface = W * (self.mu0 + self.A * np.log(v / self.V0) + self.B * log_age)
            plastic = v
        ageing = self.ageing_rate(v, plastic, age, dW / W)
        return [self.V - v, ageing, (F - interface) / self.M, v - plastic]

    def ageing_rate(self, v: float, plastic: float, age: float, log_load_rate: float) -> float:
        """Eq. (2) or (6), the slip law, or the variant on the plastic velocity."""
        renewed = (plastic if self.ageing == "plastic" else v) * age / self.D0
        if self.ageing == "slip":
            return -renewed * np.log(renewed)
        jump = self.alpha / self.B * log_load_rate * age if self.alpha else 0.0
        return 1 - renewed - jump


def one_period(p: Printed, start: np.ndarray, epsilon: float) -> np.ndarray:
    """States at SAMPLES + 1 instants of one period, shape (SAMPLES + 1, states)."""
    times = np.linspace(0, 1 / p.frequency, SAMPLES + 1)
    states = [start]
    # Restarted at every sample: dense output is of lower order than the method.
    for begin, end in itertools.pairwise(times):
        run = solve_ivp(
            p.rates,
            (begin, end),
            states[-1],
            "DOP853",
            args=(epsilon,),
            rtol=1e-12,
            atol=1e-16 * epsilon * p.scale + 1e-40,
        )
        states.append(run.y[:, -1])
    return np.array(states)


def periodic_response(p: Printed, epsilon: float) -> np.ndarray:
    """Change of the mean and complex harmonics 1 and 2 of F/W0, as (mean, c1, c2)."""
    free = p.scale > 0  # rigid asperities have no elastic displacement
    scale, start = p.scale[free], p.steady
    for _ in range(12):
        orbit = one_period(p, start, epsilon)
        gap = ((orbit[-1] - start)[free]) / scale
        moved = [one_period(p, start + 1e-5 * s, epsilon)[-1] for s in np.diag(p.scale)[free]]
        monodromy = np.column_stack([(m - orbit[-1])[free] / scale / 1e-5 for m in moved])
        step = np.linalg.solve(monodromy - np.eye(scale.size), -gap)
        start[free] += step * scale
        if np.abs(step).max() < 1e-12:
            break
    else:
        raise AssertionError("the reference integration found no periodic solution")
    spectrum = np.fft.fft(one_period(p, start, epsilon)[:-1, 0]) / SAMPLES * p.K / p.W0
    return np.array([spectrum[0], 2 * spectrum[1], 2 * spectrum[2]])


def expansion(p: Printed, epsilon: float = 1e-3) -> np.ndarray:
    """(mean/eps^2, c1/eps, c2/eps^2) in the limit eps -> 0, by Richardson extrapolation.

    Each is an even series in eps; two amplitudes leave an error of order (eps mu/A)^4.
    """

    def scaled(e: float) -> np.ndarray:
        return periodic_response(p, e) / np.array([e**2, e, e**2])

    return (4 * scaled(epsilon / 2) - scaled(epsilon)) / 3


class Reference(NamedTuple):
    """What tests use of this file."""

    Printed: type[Printed]
    expansion: Callable[..., np.ndarray]
    periodic_response: Callable[..., np.ndarray]


@pytest.fixture(scope="session")
def reference() -> Reference:
    return Reference(Printed, expansion, periodic_response)
