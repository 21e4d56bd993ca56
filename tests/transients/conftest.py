"""Transients of the published equations by SciPy, sharing nothing with the package.

Unknowns in SI: extension d of the spring, ln of the age Phi, displacement x, and with inertia the
velocity v, or its logarithm where the asperities are rigid, and the elastic displacement u of the
asperities.
"""

import dataclasses
import itertools
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import asperity as asp


@dataclasses.dataclass(frozen=True)
class Experiment:
    """A slider with Rice-Ruina friction, Linker-Dieterich ageing and elastic asperities, SI."""

    mu0: float = 0.5
    A: float = 0.013
    B: float = 0.026
    D0: float = 4e-7
    V0: float = 1e-6
    K: float = 4e5
    W0: float = 7.0
    M: float = 0.0
    eta: float = 0.0
    lambda_: float = 0.0
    alpha: float = 0.0

    @property
    def slider(self) -> asp.Slider:
        common = {"mu0": self.mu0, "A": self.A, "B": self.B, "D0": self.D0, "V0": self.V0}
        if self.lambda_:
            law = asp.laws.ElastoPlastic(**common, lambda_=self.lambda_)
        elif self.alpha:
            law = asp.laws.LinkerDieterich(**common, alpha=self.alpha)
        else:
            law = asp.laws.RiceRuina(**common)
        return asp.Slider(law, spring=self.K, load=self.W0, mass=self.M)

    @property
    def options(self) -> dict:
        """Arguments of `transient` for inertia and damping."""
        return {"inertia": self.M > 0, "radiation_damping": self.eta or None}

    def friction(self, v: float, log_age: float) -> float:
        rate = self.A * np.log(v / self.V0)
        return self.mu0 + rate + self.B * (np.log(self.V0 / self.D0) + log_age)

    def velocity(self, friction: float, log_age: float) -> float:
        log_state = np.log(self.V0 / self.D0) + log_age
        return self.V0 * np.exp((friction - self.mu0 - self.B * log_state) / self.A)

    def steady(self, V: float, W: float) -> np.ndarray:
        """Extension, ln age, displacement, and what inertia adds, in steady sliding."""
        log_age = np.log(self.D0 / V)
        mu = self.friction(V, log_age)
        start = [(mu * W + self.eta * V) / self.K, log_age, 0.0]
        if self.M:
            start += [V, mu * self.lambda_] if self.lambda_ else [np.log(V)]
        elif self.eta and self.lambda_:
            start += [mu * self.lambda_]
        return np.array(start)

    def rates(self, t: float, y: np.ndarray, load: Callable, pull: Callable) -> list[float]:
        (W, dW), V = load(t), pull(t)
        d, log_age, _, *rest = y
        v, more = self._velocities(self.K * d, W, dW, V, log_age, rest)
        ageing = np.exp(-log_age) - v / self.D0 - self.alpha / self.B * dW / W
        return [V - v, ageing, v, *more]

    def _velocities(self, F, W, dW, V, log_age, rest) -> tuple[float, list[float]]:
        if self.M and self.lambda_:
            v, u = rest
            slip = self.velocity(u / self.lambda_, log_age)
            force = F - W * u / self.lambda_ - self.eta * v
            return v, [force / self.M, v - slip]
        if self.M:
            v = np.exp(rest[0])
            force = F - W * self.friction(v, log_age) - self.eta * v
            return v, [force / (self.M * v)]
        if self.eta and self.lambda_:
            u = rest[0]
            v = (F - W * u / self.lambda_) / self.eta
            slip = self.velocity(u / self.lambda_, log_age)
            return v, [v - slip]
        if self.eta:  # friction and damping in parallel

            def excess(log_v: float) -> float:
                v = np.exp(log_v)
                return W * self.friction(v, log_age) + self.eta * v - F

            v = np.exp(brentq(excess, -90.0, 5.0, xtol=1e-14, rtol=1e-14))
            return v, []
        slip = self.velocity(F / W, log_age)
        soft = self.lambda_ * self.K / W
        # v - d(F lambda/W)/dt = slip, with dF/dt = K (V - v)
        v = (slip + soft * V - self.lambda_ * F * dW / W**2) / (1 + soft)
        return v, []

    def step_of_load(self, y: np.ndarray, before: float, after: float) -> np.ndarray:
        """What jumps with the load.

        Phi does (Linker-Dieterich), and so does the slider if it has no mass: the spring and the
        asperities share the force anew, and dPhi = -Phi dx / D0.
        """
        y = y.copy()
        y[1] -= self.alpha / self.B * np.log(after / before)
        if not self.M and not self.eta:
            d = y[0] * (1 + self.K * self.lambda_ / before) / (1 + self.K * self.lambda_ / after)
            y[1] -= (y[0] - d) / self.D0
            y[2] += y[0] - d
            y[0] = d
        return y


@dataclasses.dataclass(frozen=True)
class Phase:
    """Load and its rate, and pulling velocity, as functions of the time since its beginning."""

    duration: float
    load: Callable
    pull: Callable


def level(duration: float, load: float, pull: float) -> Phase:
    return Phase(duration, lambda t: (load, 0.0), lambda t: pull)


def swing(duration: float, load: float, pull: float, epsilon: float, frequency: float) -> Phase:
    w = 2 * np.pi * frequency
    return Phase(
        duration,
        lambda t: (load * (1 + epsilon * np.cos(w * t)), -load * epsilon * w * np.sin(w * t)),
        lambda t: pull,
    )


@dataclasses.dataclass(frozen=True)
class Solution:
    """States at sampling times; `force` and `x` at those times."""

    experiment: Experiment
    states: np.ndarray  # (n, states)

    @property
    def force(self) -> np.ndarray:
        return self.experiment.K * self.states[:, 0]

    @property
    def x(self) -> np.ndarray:
        return self.states[:, 2]


def integrate(
    experiment: Experiment,
    start: np.ndarray,
    before: float,
    phases: list[Phase],
    times: np.ndarray,
    method: str = "DOP853",
    rtol: float = 1e-11,
) -> Solution:
    """States at `times`, right-hand values at the beginnings of phases."""
    y, parts = start, []
    starts = np.concatenate([[0.0], np.cumsum([p.duration for p in phases])])
    scale = np.array([1e-5, 1.0, 1e-5, *np.ones(len(y) - 3)])
    if experiment.M and experiment.lambda_:
        scale[3:] = [1e-6, 1e-6]
    elif len(y) > 3 and not experiment.M:
        scale[3:] = 1e-6
    for phase, (begin, end) in zip(phases, itertools.pairwise(starts), strict=True):
        last = end == starts[-1]
        inside = times[(times >= begin - 1e-9) & ((times < end - 1e-9) | last)]
        local = np.clip(inside - begin, 0.0, phase.duration)
        y = experiment.step_of_load(y, before, phase.load(0.0)[0])
        with np.errstate(over="ignore", invalid="ignore"):  # of steps that are then refused
            run = solve_ivp(
                experiment.rates,
                (0.0, phase.duration),
                y,
                method,
                t_eval=np.unique([*local, phase.duration]),
                args=(phase.load, phase.pull),
                rtol=rtol,
                atol=1e-2 * rtol * scale,
            )
        assert run.success, run.message
        y, before = run.y[:, -1], phase.load(phase.duration)[0]
        parts.append(run.y[:, : len(local)])
    return Solution(experiment, np.concatenate(parts, axis=1).T)


class Physical(NamedTuple):
    """What tests use of this file."""

    Experiment: type[Experiment]
    Phase: type[Phase]
    level: Callable[..., Phase]
    swing: Callable[..., Phase]
    integrate: Callable[..., Solution]


@pytest.fixture(scope="session")
def physical() -> Physical:
    return Physical(Experiment, Phase, level, swing, integrate)
