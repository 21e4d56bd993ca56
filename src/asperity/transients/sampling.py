"""Times at which a trajectory is sampled."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np

from asperity.errors import InputError
from asperity.loads.programme.programme import BREAK
from asperity.units import to_si

#: Rows that doubles can count.
_MOST_ROWS = 2.0**53


class SampleTimes(ABC):
    """Sampling times in rising order, taken part by part."""

    @abstractmethod
    def take(self, end: float, most: int, steps: np.ndarray, closing: bool) -> np.ndarray:
        """Times (s) not taken yet that lie before `end`, at most `most` of them.

        Parameters
        ----------
        end : float
            Seconds of the programme.
        most : int
        steps : ndarray
            Beginnings of the integrator's steps up to there.
        closing : bool
            Whether the trajectory ends there; then `end` itself is included.
        """

    @abstractmethod
    def skip(self, t: float) -> None:
        """Skip the times up to `t`, inclusive."""


class StepTimes(SampleTimes):
    """The integrator's own steps, which are short where much happens."""

    def __init__(self) -> None:
        self._after = -np.inf

    def take(self, end: float, most: int, steps: np.ndarray, closing: bool) -> np.ndarray:
        """Beginnings of steps, and the end of the last."""
        times = np.append(steps, end) if closing else steps
        times = times[(times > self._after) & (times <= end)][:most]
        if times.size:
            self._after = float(times[-1])
        return times

    def skip(self, t: float) -> None:
        """As in `SampleTimes`."""
        self._after = t


class EvenTimes(SampleTimes):
    """Multiples of 1/rate, the first at t = 0."""

    def __init__(self, rate: float) -> None:
        self._rate, self._next = rate, 0

    def take(self, end: float, most: int, steps: np.ndarray, closing: bool) -> np.ndarray:
        """As in `SampleTimes`."""
        count = _limit(end, closing) * self._rate
        last = int(np.floor(count)) if closing else int(np.ceil(count)) - 1
        index = np.arange(self._next, min(last + 1, self._next + most))
        self._next += len(index)
        return index / self._rate

    def skip(self, t: float) -> None:
        """As in `SampleTimes`."""
        if t >= 0:
            self._next = int(np.floor(_limit(t, True) * self._rate)) + 1


class GivenTimes(SampleTimes):
    """Given times."""

    def __init__(self, times: np.ndarray) -> None:
        self._times, self._next = times, 0

    def take(self, end: float, most: int, steps: np.ndarray, closing: bool) -> np.ndarray:
        """As in `SampleTimes`."""
        limit = _limit(end, closing)
        last = int(np.searchsorted(self._times, limit, side="right" if closing else "left"))
        part = self._times[self._next : min(last, self._next + most)]
        self._next += len(part)
        return part

    def skip(self, t: float) -> None:
        """As in `SampleTimes`."""
        self._next = int(np.searchsorted(self._times, t, side="right"))


def _limit(end: float, closing: bool) -> float:
    """A time that coincides with a break point belongs to the segment after it."""
    return end * (1 + BREAK) if closing else end * (1 - BREAK)


def planned_rows(sampling: Any, duration: float) -> float | None:
    """Number of rows that `sampling` asks for, None where the integrator's steps decide.

    Parameters
    ----------
    sampling, duration
        As for `sample_times`.
    """
    if sampling is None:
        return None
    if isinstance(sampling, str) or np.ndim(sampling) == 0:
        return to_si(sampling, "frequency", "sampling") * duration + 1
    return float(np.size(sampling))


def sample_times(sampling: Any, duration: float) -> SampleTimes:
    """Sampling times by the argument `sampling`.

    Parameters
    ----------
    sampling : None, float, str or array
        None for the integrator's steps, a rate (Hz) or rising times (s).
    duration : float
        Of the programme (s).

    Raises
    ------
    InputError
        If the rate is not positive, or the times do not rise or lie outside the programme.
    """
    if sampling is None:
        return StepTimes()
    if isinstance(sampling, str) or np.ndim(sampling) == 0:
        rate = to_si(sampling, "frequency", "sampling")
        if not rate > 0:
            raise InputError(
                f"sampling must be positive, got {rate:g} Hz; give a rate such as '10 kHz'"
            )
        if rate * duration > _MOST_ROWS:
            raise InputError(
                f"sampling must come to at most {_MOST_ROWS:g} rows, got {rate:g} Hz for "
                f"{duration:g} s; lower the rate or shorten the programme"
            )
        return EvenTimes(rate)
    times = np.asarray(to_si(sampling, "time", "sampling"), float)
    if times.ndim != 1 or np.any(np.diff(times) < 0):
        raise InputError(
            "sampling must be times in rising order, got an array that falls or has more than "
            "one axis; sort them"
        )
    if times.size and (times[0] < 0 or times[-1] > duration * (1 + BREAK)):
        raise InputError(
            f"sampling must lie within the programme, 0 to {duration:g} s, got {times[0]:g} to "
            f"{times[-1]:g} s; leave the times outside out"
        )
    return GivenTimes(times)
