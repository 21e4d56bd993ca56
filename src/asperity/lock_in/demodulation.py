"""Lock-in reading: harmonics of the shear force against the phase of the measured load.

The load and the shear force are fitted, by least squares, with drift terms and harmonics of one
frequency, which is itself a parameter of the load's fit. The force's harmonics are then rotated by
the phase of the load's fundamental, in the convention of the package::

    W/W0 = 1 + eps cos phi + ...,      F/W0 = mean + sum of mu_n cos(n phi + phase_n).

Windows need not hold whole periods, nor the clock be even. Every number comes with its
covariance: noise is estimated at the frequency where it acts (`asperity.lock_in.noise`), and the
noise of the load is propagated through frequency, phase, amplitude and mean.

A `LockInStream` reads recordings that do not fit into memory, or are not finished yet.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal, TypeAlias

import numpy as np

from asperity.arrays import Float
from asperity.errors import require
from asperity.lock_in.noise import local_noise, noise_around, residual_sums, sum_covariance
from asperity.lock_in.normal_equations import (
    Basis,
    BlockSums,
    even_step,
    inverted,
    join,
    merged,
    sums,
)
from asperity.lock_in.reading import LockInReading, reading_of
from asperity.lock_in.reference import (
    CONVERGED,
    MOST_STEPS,
    around,
    fit_frequency,
    frequency_direction,
    frequency_step,
    load_columns,
    require_modulated,
    strongest_line,
    window_basis,
)
from asperity.lock_in.settling import Settling, find_settlings, without
from asperity.parameters.arguments import at_least, typed

#: Approximate number of blocks of a window.
BLOCKS = 1024
#: Share of the window on which the frequency is fitted first.
_FIRST_SHARE = 0.125
#: Steps of the frequency, as phase (rad) at the ends of the window, that are left to the
#: first-order correction: up to `_SHORT_STEP`, and with more than `_LONG` samples, where another
#: pass takes longer, up to `CONVERGED`.
_SHORT_STEP, _LONG = 1e-8, 1 << 17
#: Drift that is fitted together with the harmonics, and its degree.
Detrend: TypeAlias = Literal["none", "linear", "quadratic"]
DRIFTS: Mapping[Detrend, int] = {"none": 0, "linear": 1, "quadratic": 2}

#: Largest error of the frequency, as phase (rad) at the ends of the window. It is corrected to
#: first order; the remaining relative error is about a hundredth.
_OFF = 0.1


@typed
def lock_in(
    time: Float,
    load: Float,
    force: Float,
    *,
    frequency: float | None = None,
    harmonics: Annotated[int, at_least(1)] = 4,
    detrend: Detrend = "linear",
    refine: bool = True,
    settles: bool = False,
) -> LockInReading:
    """Measure the harmonics of a force against the phase of the load that modulates it.

    Parameters
    ----------
    time, load, force : array, (n,)
        Seconds and two forces, or stresses, in equal units; finite, time rising.
    frequency : float, optional
        Initial guess (Hz); None takes the strongest line of the load.
    harmonics : int
        Number of harmonics.
    detrend : {"none", "linear", "quadratic"}
        Drift that is fitted together with the harmonics, for both channels.
    refine : bool
        Fit the frequency. If not, `frequency` is taken to be exact.
    settles : bool
        Model the settling of the force (`asperity.lock_in.settling`): mean and harmonics are then
        the final values, with an uncertainty that includes the extrapolation.

    Returns
    -------
    LockInReading

    Raises
    ------
    InputError
        If there are too few samples, the clock does not rise, or the frequency is not resolved.
    """
    degree = DRIFTS[detrend]
    _check(time, load, force, harmonics, degree)
    known, rule = refine or frequency is not None, "be given with refine=False"
    require(known, "lock_in.frequency", rule, "None", "give it in Hz")
    if refine:
        line = strongest_line(time, load, between=around(frequency))
        require_modulated(line, load)
        start = line.frequency
    else:
        start = float(frequency or 0.0)
    _check_resolved(time, start, harmonics)
    step = even_step(time, 2 * np.pi * start * harmonics)
    if step is None:
        rule, got = "rise from sample to sample", "equal or decreasing times"
        advice = "sort or cut the recording"
        require((time[1:] > time[:-1]).all(), "lock_in.time", rule, got, advice)
    if refine:
        start = fit_frequency(
            time, load, start, harmonics=harmonics, degree=degree, step=step, share=_FIRST_SHARE
        )
    # Most often the frequency of a part is accurate enough for one pass over all samples.
    enough = _SHORT_STEP if time.size < _LONG else CONVERGED
    for _ in range(MOST_STEPS):
        _check_resolved(time, start, harmonics)
        basis = window_basis(time, 2 * np.pi * start, harmonics, degree)
        blocks = _check_finite(sums(basis, time, [load, force], blocks=BLOCKS, step=step))
        change = frequency_step(blocks) if refine else 0.0
        if abs(change) * basis.half_width < enough:
            break
        start += change / (2 * np.pi)
    return read(blocks, refine=refine, settles=settles)


def read(
    blocks: BlockSums,
    *,
    refine: bool = True,
    settles: bool = False,
    span: tuple[float, float] | None = None,
) -> LockInReading:
    """The reading from the sums of load and force, in this order.

    Parameters
    ----------
    blocks : BlockSums
        Block sums of one recording, or joined from its parts.
    refine : bool
        Correct the frequency to first order, from the sums.
    settles : bool
        As in `lock_in`.
    span : (float, float), optional
        First and last time (s) of the samples; by default those of the basis.
    """
    basis, linear = blocks.basis, blocks.basis.linear
    gram, moments = blocks.totals()
    inner = inverted(gram[:linear, :linear])
    beta = inner @ moments[:linear]
    selected = load_columns(basis, beta[:, 0], refine)
    outer = inverted(selected.T @ gram @ selected)
    slope, change = np.zeros(linear), 0.0
    if refine:
        solution = outer @ (selected.T @ moments[:, 0])
        change = float(solution[linear])
        slope = -inner @ (gram @ frequency_direction(basis, beta[:, 1]))[:linear]
        beta = np.stack([solution[:linear], beta[:, 1] + slope * change], axis=1)
    full = _on_basis(basis, beta, change)
    settlings: tuple[Settling, ...] = ()
    if settles:
        residual = residual_sums(blocks, full)
        around, _ = noise_around(1, blocks, residual[:, 1], settles=False)
        variance = float(around[0, 0].real * outer[linear, linear]) if refine else 0.0
        settlings = find_settlings(blocks, 1, full[:, 1], inner, variance)
        without_settling = without(blocks, 1, settlings)
        beta[:, 1] -= inner @ (moments - without_settling.totals()[1])[:linear, 1]
        blocks, full = without_settling, _on_basis(basis, beta, change)
    residual = residual_sums(blocks, full)
    mean_settles = any(s.present and not s.order for s in settlings)
    noise = local_noise(blocks, residual, mean_settles)
    plain = np.eye(basis.size)[:, :linear]
    disturbed = sum_covariance(basis, gram, noise, (selected, plain))
    # Errors of (beta of the load, omega, beta of the force) are linear in the sums of the noise.
    size = selected.shape[1]
    errors = np.zeros((size + linear, size + linear))
    errors[:size, :size], errors[size:, size:] = outer, inner
    if refine:
        errors[size:, :size] = np.outer(slope, outer[linear])
    covariance = errors @ disturbed @ errors.T
    for settling in settlings:
        beta[:, 1] += settling.shift
        covariance[size:, size:] += settling.covariance
    omega = basis.omega + change
    return reading_of(
        blocks, beta, omega, covariance, noise, residual,
        fitted=refine, settlings=settlings, span=span,
    )  # fmt: skip


def _on_basis(basis: Basis, beta: Float, change: float) -> Float:
    """Coefficients of both fits on the whole basis, the frequency changed to first order."""
    full = np.zeros((basis.size, 2))
    full[: basis.linear] = beta
    for c in (0, 1):
        full[:, c] += change * frequency_direction(basis, beta[:, c])
    return full


def _check_lengths(time: Float, load: Float, force: Float, field: str) -> None:
    rule, got = "have one length", f"{time.size}, {load.size} and {force.size}"
    require(time.size == load.size == force.size, field, rule, got, "cut them to the same samples")


def _check(time: Float, load: Float, force: Float, harmonics: int, degree: int) -> None:
    _check_lengths(time, load, force, "lock_in.time, load and force")
    least = 2 * (degree + 1 + 2 * harmonics) + 2
    holds, rule = not time.size < least, f"hold at least {least} samples for {harmonics} harmonics"
    require(holds, "lock_in.time", rule, time.size, "give a longer window or fewer harmonics")


def _check_finite(blocks: BlockSums, field: str = "lock_in.load and force") -> BlockSums:
    """Refuse samples that are not finite, which show in their sums."""
    got, advice = "values that are not", "leave out their samples, as asperity.measure does"
    require(np.isfinite(blocks.moments).all(), field, "be finite", got, advice)
    return blocks


def _check_resolved(time: Float, frequency: float, harmonics: int) -> None:
    span = float(time[-1] - time[0])
    # Gaps do not lower the sampling rate of the remaining samples.
    rate = 1 / float(np.median(np.diff(time[: 1 << 14])))
    rule, got = "have at least one period in the window", f"{frequency:.6g} Hz in {span:.6g} s"
    advice = "give a longer window or another frequency"
    require(frequency > 0 and not frequency * span < 1, "lock_in.frequency", rule, got, advice)
    rule = "lie below half the sampling rate"
    got = f"{harmonics} harmonics of {frequency:.6g} Hz at {rate:.6g} samples per second"
    require(not 2 * harmonics * frequency >= rate, "lock_in.harmonics", rule, got, "ask for fewer")


@typed
class LockInStream:
    """Lock-in of samples that are added one piece after the other.

    Only sums are kept: about a thousand small matrices, however long the recording.

    Parameters
    ----------
    frequency : float
        Modulation frequency (Hz), accurate to a tenth of a radian at the ends of the window. The
        remaining error is fitted and corrected.
    start, end : float
        First and last time (s) of all samples that will be added.
    harmonics : int
    detrend : {"none", "linear", "quadratic"}

    Raises
    ------
    InputError
        If `harmonics` or `detrend` break their rule, or the window or the frequency is not
        positive.
    """

    def __init__(
        self,
        frequency: float,
        *,
        start: float,
        end: float,
        harmonics: Annotated[int, at_least(1)] = 4,
        detrend: Detrend = "linear",
    ) -> None:
        rule, advice = "follow start and frequency be positive", "give them in this order"
        got = f"{start:g} s, {end:g} s and {frequency:g} Hz"
        require(end > start and frequency > 0, "LockInStream.end", rule, got, advice)
        half = (end - start) / 2
        omega, degree = 2 * np.pi * frequency, DRIFTS[detrend]
        self._basis = Basis(omega, harmonics, degree, start + half, half)
        self._parts: list[BlockSums] = []
        self._span = np.inf, -np.inf

    def add(self, time: Float, load: Float, force: Float) -> None:
        """Add the next samples, arrays (n,) each.

        Raises
        ------
        InputError
            If they have different lengths, lie outside the window or are not finite.
        """
        _check_lengths(time, load, force, "LockInStream.add")
        basis = self._basis
        first, last = basis.centre - basis.half_width, basis.centre + basis.half_width
        slack = 1e-9 * basis.half_width
        inside = time[0] >= first - slack and time[-1] <= last + slack
        rule = f"get times from {first:.10g} s to {last:.10g} s"
        got = f"{time[0]:.10g} s to {time[-1]:.10g} s"
        require(inside, "LockInStream.add", rule, got, "give start and end of all that follows")
        share = (time[-1] - time[0]) / (2 * basis.half_width)
        step = even_step(time, basis.omega * basis.harmonics)
        blocks = max(1, round(BLOCKS * share))
        part = merged(sums(basis, time, [load, force], blocks=blocks, step=step), blocks)
        self._parts.append(_check_finite(part, "LockInStream.add"))
        self._span = min(self._span[0], float(time[0])), max(self._span[1], float(time[-1]))

    def read(self) -> LockInReading:
        """The reading of all samples added so far.

        Raises
        ------
        InputError
            If there are none, or the frequency is not accurate enough.
        """
        require(self._parts, "LockInStream.add", "be called before read", "no samples", "add some")
        reading = read(join(self._parts), span=self._span)
        omega, rule = self._basis.omega, f"be good to {_OFF} rad at the ends of the window"
        near = abs(2 * np.pi * reading.frequency - omega) * self._basis.half_width <= _OFF
        measured = f"about {reading.frequency:.10g} Hz was measured"
        got = f"{omega / (2 * np.pi):.10g} Hz where {measured}"
        require(near, "LockInStream.frequency", rule, got, "start again with that")
        return reading
