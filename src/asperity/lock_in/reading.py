"""Result of a lock-in: harmonics with their uncertainties, their covariance, and the residual."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

import numpy as np
from scipy.special import fdtri, stdtrit

from asperity.arrays import Complex, Float
from asperity.errors import require, require_known
from asperity.lock_in.noise import LocalNoise
from asperity.lock_in.normal_equations import BlockSums, inverted
from asperity.lock_in.settling import Settling

#: Samples of a piece of a window in which fast oscillations are searched.
PIECE = 1 << 16
#: Standard deviation (rad) of an angle that is uniform over the circle, pi/sqrt(3).
_UNKNOWN_PHASE = math.pi / math.sqrt(3)
#: Points of a window at which the range of the drift is taken.
_ALONG = 101

_SCALARS = ("W0", "epsilon", "frequency", "mean_force", "mean_friction")


@dataclass(frozen=True)
class Phasor:
    """Complex amplitude c of Re(c e^(i n phi)), phi the phase of the load.

    Attributes
    ----------
    value : complex
        Its modulus is the peak amplitude, its argument the phase against the load.
    covariance : array, (2, 2)
        Covariance of the real and the imaginary part.
    dof : float
        Degrees of freedom of the covariance.
    """

    value: complex
    covariance: Float
    dof: float

    @property
    def amplitude(self) -> float:
        """Peak amplitude."""
        return abs(self.value)

    @property
    def phase(self) -> float:
        """Phase (rad) in (-pi, pi]."""
        angle = math.atan2(self.value.imag, self.value.real)
        return math.pi if angle == -math.pi else angle

    @property
    def amplitude_uncertainty(self) -> float:
        """Standard uncertainty of the amplitude, to first order (valid below a third of it)."""
        return self._along(self._direction)

    @property
    def phase_uncertainty(self) -> float:
        """Standard uncertainty (rad) of the phase; at most pi/sqrt(3), an unknown phase."""
        along = self._direction
        across = self._along(np.array([-along[1], along[0]]))
        return min(across / self.amplitude if self.amplitude else math.inf, _UNKNOWN_PHASE)

    def excludes(self, value: complex, level: float = 0.95) -> bool:
        """Whether `value` lies outside the confidence ellipse of probability `level`."""
        away = np.array([value.real - self.value.real, value.imag - self.value.imag])
        # Without noise the ellipse is a point.
        spread = np.linalg.eigvalsh(self.covariance)
        if not spread[0] > 1e-14 * spread[1]:
            return bool(away.any())
        distance = float(away @ np.linalg.solve(self.covariance, away)) / 2
        return bool(distance > fdtri(2, self.dof, level))

    @property
    def _direction(self) -> Float:
        if not self.amplitude:
            return np.array([1.0, 0.0])
        return np.array([self.value.real, self.value.imag]) / self.amplitude

    def _along(self, direction: Float) -> float:
        return math.sqrt(max(float(direction @ self.covariance @ direction), 0.0))


@dataclass(frozen=True, eq=False)
class LockInReading:
    """Harmonics of F/W0 against the measured load, with their joint covariance.

    Attributes
    ----------
    W0, mean_force : float
        Means over the window, in the unit of the channels; with drift, of the fitted drift.
    epsilon : float
        Relative peak amplitude of the load at the fundamental.
    frequency : float
        Hz.
    mean_friction : float
        mean_force/W0.
    harmonics : complex array, (n,)
        c_1 ... c_n of F/W0; mu_n is the modulus, phase_n the argument.
    load_harmonics : complex array, (n,)
        Harmonics of W/W0; the first is epsilon, real.
    names : tuple of str
        Names of the rows of `covariance`: W0, epsilon, frequency, mean_force, mean_friction, then
        re1, im1, ... of the force and load_re2, load_im2, ... of the load.
    covariance : array, (len(names), len(names))
    dof : array, (n + 1,)
        Degrees of freedom of the noise near k f, k = 0..n.
    drift : array, (2, degree)
        Change of load and force from the first to the last sample, by each drift term.
    drift_uncertainty : array, (2, degree)
        Their standard uncertainties.
    drift_range : array, (2,)
        Largest less smallest value of the fitted drift of load and force in the window.
    start, end : float
        First and last time (s) of the window.
    samples : int
    phase : float
        Phase of the load at the middle of the window (rad).
    noise : LocalNoise
    blocks : BlockSums
    residual : complex array, (blocks, n + 1, 2)
        Sums of the residuals of load and force times e^(-ik phi), over each block.
    settlings : tuple of Settling
        Possible settlings of the force, if the fit includes them.
    """

    W0: float
    epsilon: float
    frequency: float
    mean_force: float
    mean_friction: float
    harmonics: Complex
    load_harmonics: Complex
    names: tuple[str, ...]
    covariance: Float
    dof: Float
    drift: Float
    drift_uncertainty: Float
    drift_range: Float
    start: float
    end: float
    samples: int
    phase: float
    noise: LocalNoise
    blocks: BlockSums
    residual: Complex
    settlings: tuple[Settling, ...] = ()

    @property
    def settling(self) -> Settling | None:
        """The settling of the mean force, if it is present."""
        return next((s for s in self.settlings if s.present and not s.order), None)

    def without_settling(self, time: Float, force: Float) -> Float:
        """A force of the window without the settling of its mean; arrays (n,)."""
        settling = self.settling
        return force if settling is None else force - settling.at(time - self.start)

    @property
    def periods(self) -> float:
        """Number of modulation periods in the window."""
        return (self.end - self.start) * self.frequency

    def cycles(self, time: Float) -> Float:
        """Phase of the load at times (s) of the window, over 2 pi; arrays (n,)."""
        middle = (self.start + self.end) / 2
        return self.frequency * (time - middle) + self.phase / (2 * np.pi)

    def waves(self, cycles: Float, channel: int) -> Float:
        """Sum of the fitted harmonics of W/W0 (channel 0) or F/W0 (1) at phases over 2 pi, (n,)."""
        total, power, turn = np.zeros(cycles.shape), 1.0, np.exp(2j * np.pi * cycles)
        for harmonic in (self.load_harmonics, self.harmonics)[channel]:
            power = power * turn
            total += (harmonic * power).real
        return total

    def residual_of_piece(self, time: Float, values: Float) -> tuple[slice, Float]:
        """The middle of a window, `PIECE` samples at most, and the residual of a fit to it alone.

        Parameters
        ----------
        time, values : array, (n,)
            Times and channel of the window.
        """
        at = max(0, (time.size - PIECE) // 2)
        piece = slice(at, at + PIECE)
        basis, part = self.blocks.basis, values[piece]
        columns = basis.columns(time[piece])[: basis.linear]
        return piece, part - inverted(columns @ columns.T) @ (columns @ part) @ columns

    def observables(self) -> dict[str, float]:
        """W0, epsilon, frequency, mean_force, mean_friction, then mu1, phase1, ... by name."""
        numbers = {name: float(getattr(self, name)) for name in _SCALARS}
        for n in range(1, self.harmonics.size + 1):
            phasor = self.phasor(n)
            numbers |= {f"mu{n}": phasor.amplitude, f"phase{n}": phasor.phase}
        return numbers

    def uncertainty(self, name: str) -> float:
        """Standard uncertainty of a number; one of `names`, mu1, phase1, mu2, ...

        Raises
        ------
        InputError
            For any other name.
        """
        polar = re.fullmatch(r"(mu|phase)(\d+)", name)
        if polar:
            phasor = self.phasor(int(polar[2]))
            return phasor.amplitude_uncertainty if polar[1] == "mu" else phasor.phase_uncertainty
        require_known(name, self.names, "LockInReading.uncertainty", "name a number")
        at = self.names.index(name)
        return math.sqrt(max(float(self.covariance[at, at]), 0.0))

    def phasor(self, n: int) -> Phasor:
        """Harmonic n of F/W0 with its uncertainty."""
        rule, advice = f"be one of 1 to {self.harmonics.size}", "ask for more harmonics"
        require(1 <= n <= self.harmonics.size, "LockInReading.phasor", rule, n, advice)
        return self._phasor(n, self.harmonics, "")

    def load_phasor(self, n: int) -> Phasor:
        """Harmonic n >= 2 of W/W0 with its uncertainty."""
        return self._phasor(n, self.load_harmonics, "load_")

    def _phasor(self, n: int, harmonics: Complex, prefix: str) -> Phasor:
        at = [self.names.index(f"{prefix}{part}{n}") for part in ("re", "im")]
        dof = float(min(self.dof[n], self.dof[1]))
        return Phasor(complex(harmonics[n - 1]), self.covariance[np.ix_(at, at)], dof)

    def half_width(self, name: str, level: float = 0.95) -> float:
        """Half width of the confidence interval of a number, by Student's t.

        For a phase it is pi where the amplitude of its harmonic is compatible with zero.

        Parameters
        ----------
        name : str
            As in `uncertainty`.
        level : float
            Probability.
        """
        if name.startswith("phase") and not self.phasor(int(name[5:])).excludes(0, level):
            return math.pi
        digits = "".join(filter(str.isdigit, name.removeprefix("W0")))
        at = {"W0": 0, "mean_force": 0, "mean_friction": 0}.get(name, int(digits or 1))
        quantile = stdtrit(min(self.dof[at], self.dof[min(at, 1)]), 0.5 + level / 2)
        return float(quantile) * self.uncertainty(name)


def reading_of(
    blocks: BlockSums,
    beta: Float,
    omega: float,
    covariance: Float,
    noise: LocalNoise,
    residual: Complex,
    *,
    fitted: bool,
    settlings: tuple[Settling, ...] = (),
    span: tuple[float, float] | None = None,
) -> LockInReading:
    """The reading from the coefficients of load and force.

    Parameters
    ----------
    blocks : BlockSums
    beta : array, (linear, 2)
        Coefficients of load and force.
    omega : float
        Angular frequency (rad/s).
    covariance : array
        Covariance of (beta of the load, omega if `fitted`, beta of the force).
    noise, residual
        As in `LockInReading`.
    fitted : bool
        Whether omega was fitted.
    settlings : tuple of Settling
    span : (float, float), optional
        First and last time (s) of the samples; by default those of the basis.
    """
    basis = blocks.basis
    start, end = span or (basis.centre - basis.half_width, basis.centre + basis.half_width)
    # Powers of the drift are those of u, from -1 to 1 over the basis.
    low, high = ((at - basis.centre) / basis.half_width for at in (start, end))
    n, first, linear = basis.harmonics, basis.drift, basis.linear
    # Amplitudes of cos and sin are the real part and minus the imaginary one of a phasor.
    phasors = beta[first : first + n] - 1j * beta[first + n : linear]
    order = np.arange(1, first + 1)
    average = (high**order - low**order) / (order * (high - low))
    mean_load, mean_force = average @ beta[:first]
    rule = "have a mean to be relative to"
    require(mean_load, "lock_in.load", rule, "0", "give the load and not its change")
    # Phase of W/W0: a load that is recorded as negative has a positive amplitude too.
    phase = float(np.angle(phasors[0, 0] / mean_load))
    turn = np.exp(-1j * phase * np.arange(1, n + 1))
    relative = phasors * turn[:, None] / mean_load
    jacobian = _jacobian(basis.drift, average, phasors, relative, mean_load, mean_force, fitted)
    names = (
        *_SCALARS,
        *(f"{part}{k}" for k in range(1, n + 1) for part in ("re", "im")),
        *(f"load_{part}{k}" for k in range(2, n + 1) for part in ("re", "im")),
    )
    powers = np.arange(1, first)
    across = (high**powers - low**powers)[:, None]
    variances = np.diagonal(covariance).clip(min=0)
    uncertainties = np.sqrt([variances[1:first], variances[linear + fitted :][1:first]]).T
    along = np.linspace(low, high, _ALONG)[:, None] ** np.arange(first)
    return LockInReading(
        W0=float(mean_load),
        epsilon=float(abs(relative[0, 0])),
        frequency=omega / (2 * math.pi),
        mean_force=float(mean_force),
        mean_friction=float(mean_force / mean_load),
        harmonics=relative[:, 1],
        load_harmonics=relative[:, 0],
        names=names,
        covariance=jacobian @ covariance @ jacobian.T,
        dof=noise.dof,
        drift=(beta[1:first] * across).T,
        drift_uncertainty=(uncertainties * abs(across)).T,
        drift_range=np.ptp(along @ beta[:first], axis=0),
        start=start,
        end=end,
        samples=int(blocks.count.sum()),
        phase=phase + omega * ((start + end) / 2 - basis.centre),
        noise=noise,
        blocks=blocks,
        residual=residual,
        settlings=settlings,
    )


def _jacobian(
    first: int,
    average: Float,
    phasors: Complex,
    relative: Complex,
    mean_load: float,
    mean_force: float,
    fitted: bool,
) -> Float:
    """Derivatives of the numbers of a reading by (beta of the load, omega, beta of the force)."""
    n = phasors.shape[0]
    linear = first + 2 * n
    # The numbers are computed from these rows as they are from the coefficients themselves.
    every = np.eye(2 * linear + fitted)
    of_load, of_force = every[:linear], every[linear + fitted :]
    load, force = (rows[first : first + n] - 1j * rows[first + n :] for rows in (of_load, of_force))
    level, mean = average @ of_load[:first] / mean_load, average @ of_force[:first]
    # Relative change of the load's fundamental: real part amplitude, imaginary part phase.
    fundamental = load[0] / phasors[0, 0]
    order = np.arange(1, n + 1)[:, None]
    turn = np.exp(-1j * np.angle(phasors[0, 0] / mean_load) * order) / mean_load
    lost = 1j * order * fundamental.imag + level
    force_rows = turn * force - relative[:, 1:] * lost
    load_rows = turn * load - relative[:, :1] * lost
    return np.vstack(
        [
            level * mean_load,
            abs(relative[0, 0]) * (fundamental.real - level),
            every[linear : linear + fitted].sum(0) / (2 * math.pi),
            mean,
            mean / mean_load - mean_force / mean_load * level,
            np.stack([force_rows.real, force_rows.imag], axis=1).reshape(2 * n, -1),
            np.stack([load_rows.real, load_rows.imag], axis=1).reshape(2 * n, -1)[2:],
        ]
    )
