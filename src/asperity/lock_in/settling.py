"""Settling of a channel: exponentials of unknown time constant in the least-squares fit.

After a modulation begins, the mean of the force and its harmonics approach their final values.
Over a window of a few time constants this settling is a part of the model::

    c_k(t) = drift or harmonic + amplitude e^(-(t - start)/tau),    k = 0, 1, ..., n

For each tau the amplitude is linear. Within a block e^(-t/tau) is a straight line to second order
of the block's length over tau, so the columns are combinations of the summed columns, and no second
pass over the samples is needed.

The frequency is that of the load. Its error turns the phase of every harmonic evenly through the
window; it is a parameter of the fit to each harmonic, with the variance that the load gives it. A
settling of a harmonic that does not end in the window cannot be distinguished from a slow change of
the response or of the load's amplitude, and is not extrapolated.

The likelihood (Student's t, because the noise is estimated from few lines) weighs the models
without a settling and with each tau. The correction of the reading is the weighted mean, and its
covariance includes that of the amplitude and the variance over tau.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from asperity.arrays import Float
from asperity.lock_in.noise import harmonic_sums, noise_around
from asperity.lock_in.normal_equations import BlockSums, inverted
from asperity.lock_in.reference import frequency_direction

#: Prior odds of a settling times the Occam factor of its amplitude, for the mean and for a
#: harmonic, which has two amplitudes. With these odds for the mean, a settling is preferred in 3 to
#: 10 of 1,000 steady recordings with white or AR(1) noise, and the uncertainty changes by less than
#: 10 % in 99 of 100.
_ODDS = (0.005, 0.0005)
#: A settling with a time constant above this share of the window does not end in the window: with a
#: linear drift in the model, the final level is an extrapolation.
OPEN = 1 / 3
#: A settling ends in the window if the probability of a time constant above `OPEN` is lower.
_UNFINISHED = 0.05
#: Longest time constant, in windows; number of time constants of a grid; and shortest time constant
#: of a harmonic, in periods, below which it overlaps with other harmonics.
_LONGEST, _TRIED, _SHORTEST = 2.0, 41, 4.0
#: Smallest gain, in units of the noise, at which a settling is considered.
_LEAST_GAIN = 4.0
#: A time constant is negligible if its log-likelihood is below the maximum by this much; and the
#: number of other time constants with which the sum approximates the integral over them.
_NEGLIGIBLE, _ENOUGH = 12.0, 9
#: The iteration ends when the noise falls by less than to this share of its last value.
_STILL = 0.8
_MOST_ZOOMS = 16


@dataclass(frozen=True, eq=False)
class Settling:
    """The settling of one order of a channel.

    Attributes
    ----------
    order : int
        0 for the mean, k for harmonic k.
    decay : float
        Most likely time constant (s).
    amplitude : complex
        At the beginning of the window, in the channel's unit; real for the mean. Of a harmonic the
        phase is that of the basis.
    odds : float
        Odds that there is a settling.
    longest : float
        95 % quantile of the time constant (s), if there is a settling.
    unfinished : float
        Probability that the time constant exceeds `OPEN` of the window, if there is a settling.
    shift : array, (linear,)
        Correction of the coefficients. It refers to the fit of the sums without `removed` if the
        settling is present, else to that of the original sums.
    covariance : array, (linear, linear)
        Correction of the covariance of the coefficients.
    removed : array, (blocks, size)
        Sums of columns times the most likely settling.
    noise : float
        Variance of white noise as strong as that of this order.
    gain : float
        Sum of squares that the settling explains, in units of `noise`.
    """

    order: int
    decay: float
    amplitude: complex
    odds: float
    longest: float
    unfinished: float
    shift: Float
    covariance: Float
    removed: Float
    noise: float
    gain: float

    def at(self, since: Float) -> Float:
        """The settling of a mean at times (s) since the window's beginning, (n,)."""
        return np.asarray(self.amplitude.real * np.exp(-since / self.decay))

    @property
    def possible(self) -> bool:
        """Whether the odds justify a correction."""
        return self.gain > _LEAST_GAIN

    @property
    def present(self) -> bool:
        """Whether it is more probable than not; of a harmonic, only if it ends in the window."""
        return self.odds > 1 and (not self.order or self.determined)

    @property
    def determined(self) -> bool:
        """Whether the settling ends in the window."""
        return self.unfinished < _UNFINISHED


def settling_of_mean(blocks: BlockSums) -> Settling | None:
    """Settling of the mean of the only channel; None if the blocks are too few for a fit."""
    linear = blocks.basis.linear
    gram, moments = blocks.totals()
    inner = inverted(gram[:linear, :linear])
    fitted = np.zeros(blocks.basis.size)
    fitted[:linear] = inner @ moments[:linear, 0]
    return _Profile(blocks, 0, fitted, inner, 0, 0.0).settling()


def find_settlings(
    blocks: BlockSums,
    channel: int,
    fitted: Float,
    inner: Float,
    omega_variance: float,
) -> tuple[Settling, ...]:
    """The possible settlings of a channel: of its mean and of each harmonic.

    Parameters
    ----------
    blocks : BlockSums
    channel : int
    fitted : array, (size,)
        Coefficients of the fit without settling.
    inner : array, (linear, linear)
        Inverse of the normal matrix.
    omega_variance : float
        Variance of the angular frequency, in (rad/s)^2; 0 if it is exact.
    """
    linear = blocks.basis.linear
    settlings: dict[int, Settling] = {}
    # The beginning of a settling has a broad spectrum, which resembles a short settling of the next
    # order: those that are present are fitted again without the others.
    sweep = list(range(blocks.basis.harmonics + 1))
    for _ in range(2):
        for order in sweep:
            settlings.pop(order, None)
            cleaned = without(blocks, channel, tuple(settlings.values()))
            left = (cleaned.moments - blocks.moments)[:, :linear, channel].sum(0)
            coefficients = fitted.copy()
            coefficients[:linear] += inner @ left
            profile = _Profile(cleaned, channel, coefficients, inner, order, omega_variance)
            settling = profile.settling()
            if settling is not None and settling.possible:
                settlings[order] = settling
        sweep = [order for order, settling in sorted(settlings.items()) if settling.present]
        if len(sweep) < 2:
            break
    return tuple(settlings[order] for order in sorted(settlings))


def without(blocks: BlockSums, channel: int, settlings: tuple[Settling, ...]) -> BlockSums:
    """The sums without the settlings that are present in a channel."""
    present = [settling.removed for settling in settlings if settling.present]
    if not present:
        return blocks
    moments = blocks.moments.copy()
    moments[:, :, channel] -= np.sum(present, axis=0)
    return replace(blocks, moments=moments)


class _Profile:
    """Least squares of one order over the time constant."""

    def __init__(
        self,
        blocks: BlockSums,
        channel: int,
        fitted: Float,
        inner: Float,
        order: int,
        omega_variance: float,
    ) -> None:
        basis, n = blocks.basis, blocks.basis.harmonics
        self._blocks, self._channel, self._order = blocks, channel, order
        self._fitted, self._inner = fitted, inner
        # Each column of a settling is a straight line in u times one of these.
        level = np.array([0]) if not order else basis.drift + order - 1 + np.array([0, n])
        self._columns = [level]
        if order or basis.degree:
            self._columns.append(level + (2 * n if order else 1))
        span = 2 * basis.half_width
        self._half = span * blocks.count / (2 * blocks.count.sum())
        self._begun = blocks.middle - (basis.centre - basis.half_width)
        self._u = (blocks.middle - basis.centre) / basis.half_width
        periods = _SHORTEST if order else 1.0
        shortest = max(4 * float(self._half.max()), periods * 2 * np.pi / basis.omega)
        self._range = np.log([shortest, max(_LONGEST * span, 2 * shortest)])
        self._left = blocks.moments[:, :, channel] - blocks.gram @ fitted
        # Change of this harmonic with the frequency, by a standard deviation, apart from what the
        # linear columns make up for; and its sums.
        self._turn = np.zeros(basis.size)
        if order:
            turn = frequency_direction(basis, fitted[: basis.linear])
            self._turn[level + 2 * n] = np.sqrt(omega_variance) * turn[level + 2 * n]
            across = (blocks.gram.sum(0) @ self._turn)[: basis.linear]
            self._turn[: basis.linear] = -inner @ across
        self._turned = blocks.gram @ self._turn

    def settling(self) -> Settling | None:
        """The settling of this order; None if the blocks are too few for a fit."""
        if self._half.size < 8:
            return None
        begin, end = self._range
        # The frequency is free until the noise is known.
        before, noise = np.inf, 0.0
        for _ in range(_MOST_ZOOMS):
            logs = np.linspace(begin, end, _TRIED)
            gain, amplitude, schur, moved, turn = self._solved(np.exp(logs), noise)
            best = int(np.argmax(gain))
            removed = self._removed(np.exp(logs[best : best + 1]), amplitude[best])
            explained = (
                self._blocks.gram[:, :, : self._inner.shape[0]] @ moved[best] @ amplitude[best]
            )
            left = self._left - removed + explained - turn[best] * self._turned
            noise, dof = self._noise(left, settles=True)
            fits = _log_likelihood(gain[best] - gain, noise, dof, self._columns[0].size)
            counts = np.flatnonzero(fits > -_NEGLIGIBLE)
            # The residual of a coarse grid of time constants counts as noise; refine it.
            if counts.size >= _ENOUGH and noise > _STILL * before:
                break
            before = noise
            step = logs[1] - logs[0]
            begin = max(self._range[0], logs[counts[0]] - step)
            end = min(self._range[1], logs[counts[-1]] + step)
        none = _log_likelihood(gain[best], noise, dof, self._columns[0].size)
        # Before the data all time constants are equally likely on a logarithmic scale.
        prior = _ODDS[min(self._order, 1)] * (logs[1] - logs[0]) / np.ptp(self._range)
        weights = prior * np.exp(fits)
        odds = float(np.exp(min(np.log(weights.sum()) - none, 700.0)))
        chances = np.cumsum(weights) / weights.sum()
        longest = float(np.exp(logs[int(np.searchsorted(chances, 0.95))]))
        late = np.exp(logs) > OPEN * 2 * self._blocks.basis.half_width
        unfinished = float(weights[late].sum() / weights.sum())
        present = odds > 1 and (not self._order or unfinished < _UNFINISHED)
        if odds < 1:
            # A settling that does not end in the window cannot be distinguished from drift.
            weights[late] = 0.0
        elif not present:
            weights[:] = 0.0
        weights = np.append(weights, np.exp(none))
        weights /= weights.sum()
        # Changes of the coefficients: minus the amplitude times the coefficients of the column.
        changes = np.zeros((weights.size, self._inner.shape[0]))
        changes[:-1] = -np.einsum("tlq,tq->tl", moved, amplitude)
        mean = weights @ changes
        spread = (changes - mean).T * weights @ (changes - mean)
        inverse = np.linalg.inv(schur) * noise
        spread += np.einsum("t,tlq,tqp,tmp->lm", weights[:-1], moved, inverse, moved)
        height = amplitude[best]
        return Settling(
            self._order,
            float(np.exp(logs[best])),
            complex(height[0], -height[1] if self._order else 0.0),
            odds,
            longest,
            unfinished,
            mean - changes[best] if present else mean,
            spread,
            removed,
            noise,
            float(gain[best] / noise),
        )

    def _lines(self, decays: Float) -> list[Float]:
        """Level, and slope in u, of e^(-t/tau) in each block; (decays, blocks) each."""
        z = self._half / decays[:, None]
        height = np.exp(-self._begun / decays[:, None])
        # sinh(z)/z and its derivative to 1e-11: no time constant is below four half lengths.
        square = z**2
        mean = 1 + square / 6 * (1 + square / 20 * (1 + square / 42))
        bend = z / 3 * (1 + square / 10 * (1 + square / 28 * (1 + square / 54)))
        level, slope = height * mean, -3 * height * bend / self._half
        slope = slope * self._blocks.basis.half_width
        if len(self._columns) == 1:
            return [level]
        return [level - slope * self._u, slope]

    def _solved(self, decays: Float, noise: float) -> tuple[Float, Float, Float, Float, Float]:
        """Gain, amplitudes, normal matrices, coefficients of the columns, and turn for each decay.

        The turn is that of the phase of the harmonic, in standard deviations of the frequency.
        """
        gram, linear = self._blocks.gram, self._blocks.basis.linear
        lines = self._lines(decays)
        pairs = list(zip(lines, self._columns, strict=True))
        # (decays, size, q): products of all columns with those of the settling.
        across = np.sum([np.tensordot(line, gram[:, :, at], axes=1) for line, at in pairs], axis=0)
        right = np.sum(
            [np.tensordot(line, self._left[:, at], axes=1) for line, at in pairs], axis=0
        )
        square = np.sum(
            [
                np.tensordot(line * other, gram[:, at[:, None], to], axes=1)
                for line, at in pairs
                for other, to in pairs
            ],
            axis=0,
        )
        moved = self._inner @ across[:, :linear]
        schur = square - across[:, :linear].transpose(0, 2, 1) @ moved
        weight = float(self._turned.sum(0) @ self._turn) + noise
        share = np.zeros_like(right)
        if self._turn.any():
            share = np.einsum("l,tlq->tq", self._turn, across) / weight
        alone = float(self._turn @ self._left.sum(0)) / max(weight, 1e-300)
        schur -= weight * share[:, :, None] * share[:, None, :]
        right -= weight * alone * share
        amplitude = np.linalg.solve(schur, right[..., None])[..., 0]
        turn = alone - (share * amplitude).sum(1)
        return (amplitude * right).sum(1), amplitude, schur, moved, turn

    def _removed(self, decay: Float, amplitude: Float) -> Float:
        """Sums of all columns times a settling, (blocks, size)."""
        gram = self._blocks.gram
        made = np.zeros(gram.shape[:2])
        for line, at in zip(self._lines(decay), self._columns, strict=True):
            made += line[0][:, None] * (gram[:, :, at] @ amplitude)
        return made

    def _noise(self, left: Float, *, settles: bool) -> tuple[float, float]:
        """Variance of white noise as strong as that of this order, and its degrees of freedom."""
        around = harmonic_sums(left, self._blocks.basis)[:, self._order, None]
        spectrum, dof = noise_around(self._order, self._blocks, around, settles=settles)
        # Rounding of the channel is noise too, where there is no other.
        rounding = np.finfo(float).eps * float(np.abs(self._fitted).max())
        least = np.finfo(float).tiny
        return max(float(spectrum[0, 0].real), rounding**2, least), dof


def _log_likelihood(loss: Float | float, noise: float, dof: float, amplitudes: int) -> Float:
    """Student's log-likelihood of a loss of squares, relative to none."""
    return np.asarray(-(dof + amplitudes) / 2 * np.log1p(np.asarray(loss) / noise / dof))
