"""Periodic solutions of the published equations, independent of the package.

The equations are in physical units as the papers print them. States are the extension d of the
spring (m, from steady sliding) and those of the law, all positive, the age Phi (s) first; with
inertia also the velocity v (m/s) and the elastic displacement of the asperities (m). SciPy's DOP853
integrates over one period, and Newton's method makes the end equal to the start;
`multiple_shooting` does so for many operating points, stable or not, and adds Floquet multipliers.
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
    """Parameters of an experiment (SI); `ageing`, `product` and `load_rate` select variants."""

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

    def age(self, friction: float, velocity: float) -> float:
        """The friction law solved for the age."""
        rate = self.A * np.log(velocity / self.V0)
        if self.product:
            log_age = (friction / (self.mu0 + rate) - 1) * self.mu0 / self.B
        else:
            log_age = (friction - self.mu0 - rate) / self.B
        return self.D0 / self.V0 * np.exp(log_age)

    @property
    def internal_steady(self) -> list[float]:
        """States of the law in steady sliding at V."""
        return [self.D0 / self.V]

    @property
    def scale(self) -> np.ndarray:
        """Typical changes of the states."""
        inertial = [self.V, self.A * self.lambda_] if self.M else []
        return np.array([self.A * self.W0 / self.K, *self.internal_steady, *inertial])

    @property
    def steady(self) -> np.ndarray:
        inertial = [self.V, self.mu * self.lambda_] if self.M else []
        return np.array([0.0, *self.internal_steady, *inertial])

    def slip(self, F: float, W: float, internal: list[float]) -> float:
        """The plastic velocity."""
        return self.plastic_velocity(F / W, *internal)

    def internal_rates(
        self, v: float, plastic: float, internal: list[float], W: float, dW: float
    ) -> list[float]:
        """Time derivatives of the states of the law."""
        return [self.ageing_rate(v, plastic, *internal, dW / W)]

    def internal_guess(self, F: np.ndarray, W: np.ndarray, v: np.ndarray) -> list[np.ndarray]:
        """Approximate states of the law at the force F and the velocity v.

        Each has the shape (points, phases). One follows from the friction law; the others are taken
        as constant over a period.
        """
        return [self.age(F / W, v)]

    def rates(self, t: float, state: np.ndarray, epsilon: float) -> list[float]:
        """Time derivatives of the states; with M, also of v and of the elastic displacement."""
        d = state[0]
        W = self.W0 * (1 + epsilon * np.cos(self.omega * t))
        dW = -self.W0 * epsilon * self.omega * np.sin(self.omega * t) * self.load_rate
        F = self.mu * self.W0 + self.K * d
        if self.M:
            return self._inertial(F, W, dW, *state[1:])
        internal = list(state[1:])
        plastic = self.slip(F, W, internal)
        # v - d(F lambda/W)/dt = plastic, with dF/dt = K (V - v)
        soft = self.lambda_ * self.K / W
        v = (plastic + soft * self.V - self.lambda_ * F * dW / W**2) / (1 + soft)
        return [self.V - v, *self.internal_rates(v, plastic, internal, W, dW)]

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
        jump = self.alpha / self.B * log_load_rate * age if np.any(self.alpha) else 0.0
        return 1 - renewed - jump


@dataclasses.dataclass(frozen=True)
class PrintedRegularised(Printed):
    """Rice, Lapusta and Ranjith (2001): F/W = A asinh[v/(2 V0) exp((mu0 + B ln(V0 Phi/D0))/A)]."""

    @property
    def mu(self) -> float:
        strength = self.mu0 - self.B * np.log(self.V / self.V0)
        return self.A * np.arcsinh(self.V / (2 * self.V0) * np.exp(strength / self.A))

    def plastic_velocity(self, friction: float, age: float) -> float:
        strength = self.mu0 + self.B * np.log(self.V0 * age / self.D0)
        return 2 * self.V0 * np.sinh(friction / self.A) * np.exp(-strength / self.A)

    def age(self, friction: float, velocity: float) -> float:
        strength = self.A * np.log(2 * self.V0 / velocity * np.sinh(friction / self.A))
        return self.D0 / self.V0 * np.exp((strength - self.mu0) / self.B)


@dataclasses.dataclass(frozen=True)
class PrintedCutOff(Printed):
    """F/W = f0 + A ln(1 + v/V1) + B ln(1 + V2 Phi/D0), with mu0 at V0."""

    V1: float = 1e-8
    V2: float = 1e-4

    @property
    def f0(self) -> float:
        rate, state = np.log(1 + self.V0 / self.V1), np.log(1 + self.V2 / self.V0)
        return self.mu0 - self.A * rate - self.B * state

    @property
    def mu(self) -> float:
        rate, state = np.log(1 + self.V / self.V1), np.log(1 + self.V2 / self.V)
        return self.f0 + self.A * rate + self.B * state

    def plastic_velocity(self, friction: float, age: float) -> float:
        rate = friction - self.f0 - self.B * np.log(1 + self.V2 * age / self.D0)
        return self.V1 * (np.exp(rate / self.A) - 1)

    def age(self, friction: float, velocity: float) -> float:
        state = friction - self.f0 - self.A * np.log(1 + velocity / self.V1)
        return self.D0 / self.V2 * (np.exp(state / self.B) - 1)


@dataclasses.dataclass(frozen=True)
class PrintedPerrinRiceZheng(Printed):
    """dPhi/dt = 1 - (v Phi/(2 D0))^2; friction sees V0 Phi/(2 D0)."""

    @property
    def internal_steady(self) -> list[float]:
        return [2 * self.D0 / self.V]

    def plastic_velocity(self, friction: float, age: float) -> float:
        return super().plastic_velocity(friction, age / 2)

    def age(self, friction: float, velocity: float) -> float:
        return 2 * super().age(friction, velocity)

    def ageing_rate(self, v: float, plastic: float, age: float, log_load_rate: float) -> float:
        return 1 - (v * age / (2 * self.D0)) ** 2


@dataclasses.dataclass(frozen=True)
class PrintedNagata(Printed):
    """dPhi/dt = 1 - v Phi/D0 - (c/B) Phi (dF/dt)/W0."""

    A: float = 0.051
    B: float = 0.0565
    c: float = 2.0

    def ageing_rate(self, v: float, plastic: float, age: float, log_load_rate: float) -> float:
        force_rate = self.K * (self.V - v)
        return 1 - v * age / self.D0 - self.c / self.B * age * force_rate / self.W0


@dataclasses.dataclass(frozen=True)
class PrintedTwoState(Printed):
    """Friction mu0 + A ln(v/V0) + B ln(V0 Phi/D0) + B2 ln(V0 Phi2/D2), the slip law for both."""

    B2: float = 0.005
    D2: float = 1.5e-6

    @property
    def mu(self) -> float:
        return self.mu0 - (self.B + self.B2 - self.A) * np.log(self.V / self.V0)

    @property
    def internal_steady(self) -> list[float]:
        return [self.D0 / self.V, self.D2 / self.V]

    def slip(self, F: float, W: float, internal: list[float]) -> float:
        second = self.B2 * np.log(self.V0 * internal[1] / self.D2)
        return self.plastic_velocity(F / W - second, internal[0])

    def internal_rates(self, v, plastic, internal, W, dW) -> list[float]:
        renewed = [v * internal[0] / self.D0, v * internal[1] / self.D2]
        return [-x * np.log(x) for x in renewed]

    def internal_guess(self, F, W, v) -> list[np.ndarray]:
        log_v = np.log(v / self.V0)
        log_age = -(v * log_v).mean(1, keepdims=True) / v.mean(1, keepdims=True) + 0 * v
        return [self.age(F / W - self.B2 * log_age, v), self.D2 / self.V0 * np.exp(log_age)]


@dataclasses.dataclass(frozen=True)
class PrintedPrakashClifton(Printed):
    """F = W_e mu(v, Phi), dW_e/dt = -(v + V_star)/L (W_e - W)."""

    L: float = 3e-7
    V_star: float = 1e-7

    @property
    def internal_steady(self) -> list[float]:
        return [self.D0 / self.V, self.W0 + 0 * self.V]

    def slip(self, F: float, W: float, internal: list[float]) -> float:
        return self.plastic_velocity(F / internal[1], internal[0])

    def internal_rates(self, v, plastic, internal, W, dW) -> list[float]:
        age, effective = internal
        relaxation = (v + self.V_star) / self.L * (effective - W)
        return [self.ageing_rate(v, plastic, age, 0.0), -relaxation]

    def internal_guess(self, F, W, v) -> list[np.ndarray]:
        weight = v + self.V_star
        effective = (weight * W).mean(1, keepdims=True) / weight.mean(1, keepdims=True) + 0 * v
        return [self.age(F / effective, v), effective]


#: Laws whose equations are not variants of `Printed`, by their name in the package.
PRINTED = {
    "regularised": PrintedRegularised,
    "cut-off": PrintedCutOff,
    "perrin-rice-zheng": PrintedPerrinRiceZheng,
    "nagata": PrintedNagata,
    "two-state": PrintedTwoState,
    "prakash-clifton": PrintedPrakashClifton,
}


def one_period(p: Printed, start: np.ndarray, epsilon: float) -> np.ndarray:
    """States at SAMPLES + 1 instants of one period, shape (SAMPLES + 1, states)."""
    times = np.linspace(0, 1 / p.frequency, SAMPLES + 1)
    states = [start]
    # Restarted at every sample, as dense output has a lower order than the method.
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


def periodic_response(p: Printed, epsilon: float, drop: float = 0.0) -> np.ndarray:
    """Change of the mean and complex harmonics 1 and 2 of F/W0, as (mean, c1, c2).

    Newton's method starts where F/W0 is lower by `drop` than in steady sliding.
    """
    free = p.scale > 0  # rigid asperities have no elastic displacement
    scale, start = p.scale[free], p.steady
    start[0] -= drop * p.W0 / p.K
    if p.M:
        start[-1] -= drop * p.lambda_
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

    Each is an even series in eps; with two amplitudes the error is of order (eps mu/A)^4.
    """

    def scaled(e: float) -> np.ndarray:
        return periodic_response(p, e) / np.array([e**2, e, e**2])

    return (4 * scaled(epsilon / 2) - scaled(epsilon)) / 3


def derivatives(p: Printed, epsilon: float, names: tuple[str, ...]) -> np.ndarray:
    """Derivatives of mean, c1 and c2 of F/W0 by logarithms, complex, shape (3, names + 1).

    The logarithms are those of the parameters `names` and of epsilon. The equations, without mass,
    are integrated together with their variational equations.
    """
    n, columns, tiny = len(p.steady), len(p.steady) + len(names) + 1, 1e-30

    def moved(value: float, column: int) -> np.ndarray:
        return value * (1 + 1j * tiny * (np.arange(columns) == column))

    numbers = {name: moved(getattr(p, name), n + i) for i, name in enumerate(names)}
    q, swing = dataclasses.replace(p, **numbers), moved(epsilon, columns - 1)

    def rates(share: float, packed: np.ndarray) -> np.ndarray:
        """By the share of the period: of states over `scale`, and of the integrals of the force."""
        rows = packed.reshape(n + 5, 1 + columns)[:n]
        state = p.scale[:, None] * (rows[:, :1] + 1j * tiny * rows[:, 1:])
        rate = np.array(q.rates(share / q.frequency, state, swing)) / q.frequency
        force, turn = q.mu + q.K * state[0] / q.W0, np.exp(-2j * np.pi * share * np.arange(3))
        waves = [part * force for t in turn for part in (t.real, t.imag)]
        result = np.concatenate([rate / p.scale[:, None], waves[:1], waves[2:]])
        return np.column_stack([result[:, 0].real, result.imag / tiny]).ravel()

    start = p.steady / p.scale
    for _ in range(12):
        packed = np.zeros((n + 5, 1 + columns))
        packed[:n, 0], packed[:n, 1 : 1 + n] = start, np.eye(n)
        run = solve_ivp(rates, (0, 1), packed.ravel(), "DOP853", rtol=1e-12, atol=1e-14)
        last = run.y[:, -1].reshape(packed.shape)
        apart = np.column_stack([last[:n, 0] - start, last[:n, 1 + n :]])
        step, *changes = np.linalg.solve(np.eye(n) - last[:n, 1 : 1 + n], apart).T
        if np.abs(step).max() < 1e-8:  # the next step would be round-off
            break
        start = start + step
    else:
        raise AssertionError("the reference integration found no periodic solution")
    slopes = last[n:, 1 : 1 + n] @ np.transpose(changes) + last[n:, 1 + n :]
    mean, *waves = slopes
    return np.array([mean, 2 * (waves[0] + 1j * waves[1]), 2 * (waves[2] + 1j * waves[3])])


class Shot(NamedTuple):
    """Periodic solutions; the first axis of every array is the operating points."""

    mean: np.ndarray
    harmonics: np.ndarray  # c1, c2 of F/W0
    log_multipliers: np.ndarray  # by decreasing real part
    force: np.ndarray  # F/W0 at the start of each segment

    @property
    def multipliers(self) -> np.ndarray:
        return np.exp(self.log_multipliers)


def multiple_shooting(
    p: Printed, epsilon: np.ndarray, force: np.ndarray, log_slip: np.ndarray
) -> Shot:
    """Newton's method on the ends of the segments of a period, with variational equations.

    Parameters of `p` that vary and `epsilon` have the shape (points, 1). The initial guess is
    `force`, F/W0, and `log_slip`, ln(v_pl/V), at equally spaced phases, (points, segments). The
    states of the law, which vary by many orders of magnitude, are integrated as logarithms.
    """
    segments = force.shape[1]
    W = p.W0 * (1 + epsilon * np.cos(2 * np.pi * np.arange(segments) / segments))
    internal = p.internal_guess(p.W0 * force, W, p.V * np.exp(log_slip))
    start = np.stack([(force - p.mu) * p.W0 / p.K, *np.log(internal)])
    swing = np.ptp(start[0], axis=1, keepdims=True)
    scale = np.stack([swing, *(np.ones_like(swing) for _ in internal)])
    for _ in range(8):
        ends, maps, integrals = _segments(p, epsilon, start, scale)
        gap = (ends - np.roll(start, -1, axis=2)) / scale
        step = _around_the_period(maps, gap)
        start = start + step * scale
        if np.abs(step).max() < 1e-8:  # the next step would be round-off
            break
    else:
        raise AssertionError("the reference integration found no periodic solution")
    _, maps, integrals = _segments(p, epsilon, start, scale)
    origin = start[0, :, :1]
    spectrum = (integrals[:3] * p.K / p.W0).sum(-1)
    mean = (p.mu + origin * p.K / p.W0)[:, 0] + spectrum[0].real
    logs = _log_multipliers(maps, integrals[3].real.sum(-1))
    return Shot(mean, 2 * spectrum[1:].T, logs, p.mu + start[0] * p.K / p.W0)


def _segments(p: Printed, epsilon, start, scale) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """States at the ends, transfer maps over `scale`, and integrals over each segment.

    The integrals are the means over the period of d - d(0) times 1, e^-iwt and e^-2iwt, and
    the integral of the trace of the Jacobian.
    """
    n, shape = start.shape[0], start.shape[1:]
    length = np.broadcast_to(1 / (p.frequency * shape[1]), (shape[0], 1))
    begin = np.arange(shape[1]) * length
    count = n + n**2 + 6
    step = 1e-30

    def rates(s: float, packed: np.ndarray) -> np.ndarray:
        y = packed.reshape(count, *shape)
        state, t = start + y[:n], begin + s * length
        maps = y[n : n + n**2].reshape(n, n, *shape)
        columns = []
        for k in range(n):
            moved = state.astype(complex)
            moved[k] += 1j * step * scale[k]
            physical = [moved[0], *np.exp(moved[1:])]
            rate = p.rates(t, np.stack(physical), epsilon)
            logs = (r / x for r, x in zip(rate[1:], physical[1:], strict=True))
            columns.append(np.stack([rate[0], *logs]))
        jacobian = np.stack([c.imag / step / scale for c in columns], axis=1)
        turn = np.exp(-1j * p.omega * t)
        offset = (state[0] - start[0, :, :1]) * p.frequency
        waves = offset * turn, offset * turn**2
        moved_maps = np.einsum("ij...,jk...->ik...", jacobian, maps).reshape(n**2, *shape)
        parts = [part for wave in waves for part in (wave.real, wave.imag)]
        integrals = np.stack([offset, *parts, np.trace(jacobian)])
        return (length * np.concatenate([columns[0].real, moved_maps, integrals])).ravel()

    first = np.zeros((count, *shape))
    first[n : n + n**2 : n + 1] = 1
    size = np.ones((count, *shape))
    size[:n] = scale
    size[n + n**2 : -1] = scale[0]
    bound = 1e-12 * size.ravel()
    run = solve_ivp(rates, (0, 1), first.ravel(), "DOP853", rtol=1e-11, atol=bound)
    last = run.y[:, -1].reshape(count, *shape)
    maps = last[n : n + n**2].reshape(n, n, *shape)
    offset, real, imag, real_2, imag_2, trace = last[n + n**2 :]
    integrals = np.stack([offset, real + 1j * imag, real_2 + 1j * imag_2, trace])
    return start + last[:n], maps, integrals


def _around_the_period(maps: np.ndarray, gap: np.ndarray) -> np.ndarray:
    """Solve d_next - map d = gap around the cycle for every point."""
    n, points, segments = gap.shape
    matrix = np.zeros((points, segments, n, segments, n))
    for i in range(segments):
        matrix[:, i, :, (i + 1) % segments] += np.eye(n)
        matrix[:, i, :, i] -= np.moveaxis(maps[..., i], -1, 0)
    matrix = matrix.reshape(points, n * segments, n * segments)
    right = np.moveaxis(gap, 0, 2).reshape(points, n * segments, 1)
    return np.moveaxis(np.linalg.solve(matrix, right).reshape(points, segments, n), 2, 0)


def _log_multipliers(maps: np.ndarray, log_determinant: np.ndarray) -> np.ndarray:
    """Logarithms; the smaller one of a pair follows from the determinant, to full accuracy."""
    rows, n = [], maps.shape[0]
    for point, determinant in zip(np.moveaxis(maps, 2, 0), log_determinant, strict=True):
        total, log_scale = np.eye(n), 0.0
        for i in range(point.shape[2]):
            total = point[..., i] @ total
            log_scale += np.log(np.abs(total).max())
            total = total / np.abs(total).max()
        values = np.linalg.eigvals(total).astype(complex)
        if n > 2:
            logs = np.log(values) + log_scale
            rows.append(logs[np.lexsort((-logs.imag, -logs.real.round(9)))])
            continue
        log = np.log(values[np.argmax(np.abs(values))])
        if log.imag in (0, np.pi):
            rows.append([log + log_scale, determinant - log.real - log_scale + 1j * log.imag])
        else:
            rows.append(determinant / 2 + 1j * abs(log.imag) * np.array([1, -1]))
    return np.array(rows)


#: Multipliers below this modulus are promised to an absolute 1e-20.
VANISHING = 1e-12


def disagreement(response, shot: Shot) -> np.ndarray:
    """Relative errors of mean, harmonics and multipliers, the largest of each; (points, 3)."""
    size = np.maximum(np.abs(shot.multipliers), VANISHING)
    errors = [
        np.abs(response.mean_friction / shot.mean - 1),
        np.abs(response.harmonics[..., :2] / shot.harmonics - 1).max(-1),
        (np.abs(response.multipliers - shot.multipliers) / size).max(-1),
    ]
    return np.stack(errors, axis=-1)


class Reference(NamedTuple):
    """The names of this module that tests use."""

    Printed: type[Printed]
    printed: dict[str, type[Printed]]
    expansion: Callable[..., np.ndarray]
    derivatives: Callable[..., np.ndarray]
    periodic_response: Callable[..., np.ndarray]
    multiple_shooting: Callable[..., Shot]
    disagreement: Callable[..., np.ndarray]


@pytest.fixture(scope="session")
def reference() -> Reference:
    return Reference(
        Printed,
        PRINTED,
        expansion,
        derivatives,
        periodic_response,
        multiple_shooting,
        disagreement,
    )
