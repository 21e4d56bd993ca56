"""A second opinion: the paper's equations integrated in time, closed into a periodic orbit.

Plain NumPy and SciPy, nothing shared with `asperity.laws`, `asperity.slider` or `asperity.orbit`:
the equations of section III are written out again, so that agreement with a formula or with the
fast solver is an independent check. The inertia of the slider, which the quasi-static solver leaves
out, is an option. One period is integrated by DOP853 and closed by Newton's method.

States, dimensionless: y = F/W0 - mu, phi = ln(V Phi/D0), and with inertia also u = ln(v/V), for
rigid asperities.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]

_SAMPLES = 64
_NEWTON_STEPS = 25
_CLOSED = 1e-10
#: Exponents beyond this occur only in trial steps, which the integrator rejects.
_EXPONENT = 200.0


@dataclass(frozen=True)
class IntegratedPoint:
    """Numbers of one operating point, SI; lambda_ = 0 are rigid asperities, M = 0 no inertia."""

    mu: float
    A: float
    B: float
    D0: float
    K: float
    W0: float
    V: float
    frequency: float
    M: float = 0.0
    alpha: float = 0.0
    lambda_: float = 0.0

    @property
    def omega(self) -> float:
        """Angular frequency (rad/s)."""
        return 2 * np.pi * self.frequency

    @property
    def size(self) -> int:
        """Number of states."""
        return 3 if self.M else 2

    def rates(self, t: float, flat: Float, epsilon: float) -> Float:
        """Time derivatives of copies of the states, laid out as (size, copies)."""
        Y = flat.reshape(self.size, -1)
        w = 1 + epsilon * np.cos(self.omega * t)
        log_w_rate = -epsilon * self.omega * np.sin(self.omega * t) / w
        of_states = self._inertial if self.M else self._quasi_static
        return np.concatenate(of_states(Y, w, log_w_rate))

    def _ageing(self, v: Float, phi: Float, log_w_rate: float) -> Float:
        """Eq. (6) for phi; Eq. (2) at alpha = 0. `v` over V."""
        renewal = self.V / self.D0 * (_exp(-phi) - v)
        return renewal - (self.alpha / self.B * log_w_rate if self.alpha else 0.0)

    def _quasi_static(self, Y: Float, w: float, log_w_rate: float) -> list[Float]:
        y, phi = Y
        f = self.mu + y
        # Eq. (1) solved for the velocity of its rate term, over V.
        slip = _exp((f / w - self.mu - self.B * phi) / self.A)
        # d/dt (x - F lambda/W) = V slip with x = V t - F/K: Eq. (29) differentiated.
        asperities = self.lambda_ / w
        driven = self.V * (1 - slip) + asperities * f * log_w_rate
        rate = driven / (self.W0 / self.K + asperities)
        v = 1 - rate * self.W0 / (self.K * self.V)
        return [rate, self._ageing(v, phi, log_w_rate)]

    def _inertial(self, Y: Float, w: float, log_w_rate: float) -> list[Float]:
        assert not self.lambda_  # elastic asperities are integrated without inertia only
        y, phi, u = Y
        v = _exp(u)
        friction = w * (self.mu + self.A * u + self.B * phi)
        u_rate = self.W0 * (self.mu + y - friction) / (self.M * self.V * v)
        return [self.K * self.V / self.W0 * (1 - v), self._ageing(v, phi, log_w_rate), u_rate]


@dataclass(frozen=True)
class IntegratedOrbit:
    """Periodic orbit: complex Fourier coefficients of the states, shape (size, 3), and mu."""

    coefficients: NDArray[np.complex128]
    mu: float

    @property
    def delta_mu(self) -> float:
        """Mean of F/W0 minus mu."""
        return float(self.coefficients[0, 0].real)

    @property
    def c1(self) -> complex:
        """First harmonic of F/W0, peak amplitude and phase."""
        return complex(self.coefficients[0, 1])

    @property
    def c2(self) -> complex:
        """Second harmonic of F/W0."""
        return complex(self.coefficients[0, 2])

    @property
    def log_age1(self) -> complex:
        """First harmonic of ln Phi."""
        return complex(self.coefficients[1, 1])


def periodic_orbit(p: IntegratedPoint, epsilon: float, drop: float = 0.0) -> IntegratedOrbit:
    """Periodic orbit at the amplitude `epsilon`, stable or not.

    Parameters
    ----------
    p : IntegratedPoint
    epsilon : float
    drop : float
        Guess of the change of the mean of F/W0, where Newton's method starts.

    Raises
    ------
    ArithmeticError
        If Newton's method does not close the orbit.
    """
    start = np.zeros(p.size)
    start[0] = drop
    nudge = 1e-7 * np.ones(p.size)
    for _ in range(_NEWTON_STEPS):
        copies = np.column_stack([start, start[:, None] + np.diag(nudge)])
        ends = _advance(p, copies, epsilon)[..., -1]
        monodromy = (ends[:, 1:] - ends[:, :1]) / nudge
        step = np.linalg.solve(np.eye(p.size) - monodromy, ends[:, 0] - start)
        start = start + step
        if np.abs(step).max() < _CLOSED:
            samples = _advance(p, start[:, None], epsilon)[:, 0, :-1]
            spectrum = np.fft.fft(samples)[:, :3] / _SAMPLES
            return IntegratedOrbit(spectrum * np.array([1, 2, 2]), p.mu)
    raise ArithmeticError("no periodic orbit found by the reference integration")


def _exp(exponent: Float) -> Float:
    return np.exp(np.clip(exponent, -_EXPONENT, _EXPONENT))


def _advance(p: IntegratedPoint, states: Float, epsilon: float) -> Float:
    """Copies of the states at _SAMPLES + 1 instants of one period, (size, copies, instants)."""
    from scipy.integrate import solve_ivp

    period = 1 / p.frequency
    run = solve_ivp(
        p.rates,
        (0.0, period),
        states.ravel(),
        "DOP853",
        t_eval=np.linspace(0, period, _SAMPLES + 1),
        args=(epsilon,),
        rtol=1e-10,
        atol=1e-14,
    )
    return np.asarray(run.y).reshape(*states.shape, -1)
