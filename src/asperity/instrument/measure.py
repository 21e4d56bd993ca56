"""From a recording to a reading with its verdicts: what `asperity measure` does."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from asperity.errors import InputError
from asperity.instrument import quality_checks as checks
from asperity.instrument import quality_plausible as plausible
from asperity.instrument import quality_steadiness as steadiness
from asperity.instrument.lock_in import DRIFTS, lock_in
from asperity.instrument.lock_in_reading import Reading
from asperity.instrument.measure_samples import Samples, about_window, usable
from asperity.instrument.measure_series import Level, block_means, level, steady_from
from asperity.instrument.measure_window import (
    Stretch,
    clean_run,
    settled,
    stretches,
    whole_periods,
)
from asperity.instrument.quality import Check, Verdict, worst
from asperity.instrument.reference import Line, around, require_modulated, strongest_line

if TYPE_CHECKING:
    from asperity.instrument.trace import Trace

Array = NDArray[np.float64]

#: A line this often above its background is a modulation.
_LINE = 8.0
#: Pieces of a long recording that are searched for the modulation, and their samples.
_PIECES, _PIECE = 32, 1 << 15


@dataclass(frozen=True, eq=False)
class Measurement:
    """A reading of one modulated stretch, what was around it, and what is to be thought of it.

    Attributes
    ----------
    reading : Reading
    before, after : Level or None
        F(0): force without modulation next to the stretch, in the channels' unit.
    static_friction : float
        F(0)/W0 of the unmodulated load, mean of before and after; NaN if neither was recorded.
    delta_mu, delta_mu_uncertainty : float
        mean_friction - static_friction, and its standard uncertainty.
    checks : tuple of Check
        Every question with number, limits and sentence.
    stretches : tuple of Stretch
        Modulated and unmodulated parts of the whole recording.
    samples : Samples
        What could be used of it.
    window : (int, int)
        Samples that were read, as a slice of `samples`.
    chosen_by : {"program", "user"}
        Who chose the window.
    """

    reading: Reading
    before: Level | None
    after: Level | None
    static_friction: float
    delta_mu: float
    delta_mu_uncertainty: float
    checks: tuple[Check, ...]
    stretches: tuple[Stretch, ...]
    samples: Samples
    window: tuple[int, int]
    chosen_by: str

    @property
    def verdict(self) -> Verdict:
        """The gravest of all."""
        return worst(self.checks)


def measure(
    trace: Trace,
    *,
    load: str = "W",
    force: str = "F",
    frequency: float | None = None,
    harmonics: int = 4,
    window: tuple[float, float] | None = None,
    detrend: str = "linear",
    only_whole_periods: bool = False,
    refine: bool = True,
) -> Measurement:
    """Read the response to a modulated load out of a recording, and judge it.

    Parameters
    ----------
    trace : Trace
    load, force : str
        Channels, by name or role.
    frequency : float, optional
        Hz, to start from; None finds it.
    harmonics : int
    window : (float, float), optional
        First and last time (s) to read. None takes the longest modulated stretch, without what has
        not settled, and away from gaps and saturation where the rest is long enough.
    detrend : {"none", "linear", "quadratic"}
    only_whole_periods : bool
        Cut the window to whole periods. The fit does not need it.
    refine : bool
        Fit the frequency. If not, `frequency` is taken to be exact.

    Returns
    -------
    Measurement

    Raises
    ------
    InputError
        If channels, window or frequency do not fit the recording, or no modulation stands out and
        no frequency is given.
    """
    if detrend not in DRIFTS:
        raise InputError(
            f"measure.detrend must be none, linear or quadratic, got '{detrend}'; choose one"
        )
    samples = usable(trace, load, force)
    line = modulation_line(samples.time, samples.load, frequency)
    require_modulated(line, samples.load)
    if frequency is None and line.amplitude < _LINE * line.background:
        raise InputError(
            f"measure.load must be modulated, got its strongest line, at {line.frequency:.4g} Hz, "
            f"at {line.amplitude / line.background:.2g} times its surroundings; give the frequency "
            "if you know it, or measure without modulation"
        )
    start = frequency if frequency is not None and not refine else line.frequency
    parts = _parts(samples, line, start)
    if window is None:
        chosen = max((p for p in parts if p.modulated), key=lambda part: part.stop - part.first)
        first, stop = _chosen(samples, chosen, start, DRIFTS[detrend])
    else:
        first, stop = _given(samples.time, window)
        # F(0) is that beside the stretch that is read, and not beside a longer one.
        chosen = max(parts, key=lambda p: (min(p.stop, stop) - max(p.first, first), p.modulated))
    if only_whole_periods:
        stop = first + whole_periods(samples.time[first:stop], start)
    cut = slice(first, stop)
    time, force_values = samples.time[cut], samples.force[cut]
    reading = lock_in(
        time,
        samples.load[cut],
        force_values,
        frequency=start,
        harmonics=harmonics,
        detrend=detrend,
        refine=refine,
    )
    before, after = _around(samples, parts, chosen)
    answers = (
        *_asked(reading, time, samples.load[cut], force_values),
        checks.drift(reading, *(b[0] if b else None for b in (before, after))),
        *checks.findings(
            about_window(samples, float(time[0]), float(time[-1])),
            time.size,
            float(time[-1] - time[0]),
        ),
    )
    friction, doubt = _static_friction([b for b in (before, after) if b])
    return Measurement(
        reading=reading,
        before=before[0] if before else None,
        after=after[0] if after else None,
        static_friction=friction,
        delta_mu=reading.mean_friction - friction,
        delta_mu_uncertainty=float(np.hypot(reading.uncertainty("mean_friction"), doubt)),
        checks=answers,
        stretches=tuple(parts),
        samples=samples,
        window=(first, stop),
        chosen_by="program" if window is None else "user",
    )


def _asked(reading: Reading, time: Array, load: Array, force: Array) -> tuple[Check, ...]:
    """What is asked of every window."""
    rate = 1 / float(np.median(np.diff(time[: 1 << 14])))
    return (
        checks.modulation(reading),
        checks.periods(reading),
        checks.signal(reading),
        plausible.contact(reading),
        plausible.friction(reading),
        plausible.response(reading),
        plausible.aliasing(reading, rate),
        steadiness.leakage(reading),
        steadiness.steady_load(reading, time, load),
        steadiness.steady_force(reading, time, force),
        steadiness.steady_response(reading),
        checks.transient(reading),
        checks.stick_slip(reading, time, force),
        checks.load_harmonics(reading),
        checks.resolution(reading, load, force),
    )


def modulation_line(time: Array, load: Array, near: float | None = None) -> Line:
    """The modulation of a load, be it in only a part of the recording.

    Parameters
    ----------
    time, load : array, (n,)
    near : float, optional
        Hz, within 5 %.
    """
    lines = [strongest_line(time, load, between=around(near))]
    if time.size > 2 * _PIECE:
        for at in np.linspace(0, time.size - _PIECE, _PIECES).astype(int):
            piece = slice(at, at + _PIECE)
            # A slow modulation that fits no piece is found in the whole.
            if near is None or near * (time[at + _PIECE - 1] - time[at]) > 4:
                lines.append(strongest_line(time[piece], load[piece], between=around(near)))
    return max(lines, key=lambda line: line.amplitude)


def _parts(samples: Samples, line: Line, frequency: float) -> list[Stretch]:
    whole = Stretch(0, samples.time.size, line.amplitude)
    if line.amplitude < _LINE * line.background:
        return [whole]
    found = stretches(samples.time, samples.load, frequency)
    return found if any(part.modulated for part in found) else [whole]


def _chosen(samples: Samples, part: Stretch, frequency: float, degree: int) -> tuple[int, int]:
    first, stop = clean_run(part.first, part.stop, samples.defects)
    inside = slice(first, stop)
    return first + settled(samples.time[inside], samples.force[inside], frequency, degree), stop


def _given(time: Array, window: tuple[float, float]) -> tuple[int, int]:
    start, end = window
    first, stop = np.searchsorted(time, [start, end], side="left")
    stop = int(np.searchsorted(time, end, side="right"))
    if not start < end or stop - int(first) < 16:
        raise InputError(
            f"measure.window must enclose at least 16 samples, got {start:g} s to {end:g} s; the "
            f"recording runs from {time[0]:.10g} s to {time[-1]:.10g} s"
        )
    return int(first), stop


def _around(
    samples: Samples, parts: list[Stretch], chosen: Stretch
) -> tuple[tuple[Level, Level] | None, tuple[Level, Level] | None]:
    """Force and load without modulation, before and after the stretch that is read."""
    at, most = parts.index(chosen), chosen.stop - chosen.first
    sides: list[tuple[Level, Level] | None] = []
    for step in (-1, 1):
        beside = parts[at + step] if 0 <= at + step < len(parts) else None
        if beside is None or beside.modulated or beside.stop - beside.first < 16:
            sides.append(None)
            continue
        first, stop = beside.first, beside.stop
        # What is much later, or much earlier, says little.
        if step > 0:
            stop = min(stop, first + 2 * most)
        else:
            first = max(first, stop - most)
        if step > 0 or any(part.modulated for part in parts[: at - 1]):
            # The force has to find back from the modulation before.
            means = block_means(samples.force[first:stop], 100)
            first += steady_from(means, 1) * max(1, (stop - first) // 100)
        cut = slice(first, stop)
        sides.append(
            (
                level(samples.time[cut], samples.force[cut]),
                level(samples.time[cut], samples.load[cut]),
            )
        )
    return sides[0], sides[1]


def _static_friction(sides: list[tuple[Level, Level]]) -> tuple[float, float]:
    """F(0)/W0 and its standard uncertainty, drift between the sides included."""
    if not sides:
        return np.nan, np.nan
    ratios = [force.value / load.value for force, load in sides]
    doubts = [force.uncertainty / load.value for force, load in sides]
    doubt = float(np.sqrt(np.sum(np.square(doubts))) / len(sides))
    # A drift is somewhere between its ends: an even distribution about the mean.
    drifted = abs(ratios[-1] - ratios[0]) / np.sqrt(12)
    return float(np.mean(ratios)), float(np.hypot(doubt, drifted))
