"""Fits of one recording in several windows, to see how much the choice of the window matters."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import ndtri

from asperity.errors import InputError, named, require, worded
from asperity.inference.fitting.fit import fit
from asperity.inference.fitting.inputs import free_by_default
from asperity.inference.fitting.intervals import LEVELS, Interval
from asperity.inference.fitting.result import Fit, Warned
from asperity.inference.runs.run import RecordedRun, recorded_run
from asperity.laws import Law, get_law
from asperity.outputs.json import plain
from asperity.parameters.arguments import counted, typed
from asperity.recording import Trace
from asperity.recording.readers import read

#: Share of the first and of the last segment that automatic windows leave out.
_LEFT_OUT = 1 / 3
#: Random starts of the fits of later windows, in addition to the estimate of the first window.
_STARTS = 8
#: An estimate further than this many standard errors from the mean over all windows is reported.
_FAR_OFF = 3.0


@dataclass(frozen=True)
class WindowEstimate:
    """A parameter over several windows of one recording, in SI.

    Attributes
    ----------
    name, unit : str
    value : float
        Mean of the estimates, weighted by precision; of logarithms where the fit uses them.
    se : float
        Standard error, from noise and from the spread over the windows.
    se_noise, se_window : float
        Both parts of `se`: the mean standard error, and the spread.
    interval_68, interval_95 : (float, float)
    values : tuple of float
        Estimate of each window; NaN where the fit failed.
    """

    name: str
    unit: str
    value: float
    se: float
    se_noise: float
    se_window: float
    interval_68: Interval
    interval_95: Interval
    values: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class WindowedFit(Warned):
    """Fits of one recording in several windows.

    Attributes
    ----------
    windows : tuple of (float, float)
        First and last time of each window (s), in the time of the recording.
    fits : tuple of Fit
        Fits in the same order.
    parameters : mapping of str to WindowEstimate
        Parameters of the law and the machine, without nuisance parameters.
    undetermined : tuple of str
        Parameters that the windows do not determine, or on which they contradict each other.
    sentences : tuple of str
        As in `Warned`, which has the warnings.
    """

    windows: tuple[tuple[float, float], ...]
    fits: tuple[Fit, ...]
    parameters: Mapping[str, WindowEstimate]
    undetermined: tuple[str, ...]
    sentences: tuple[str, ...]

    @property
    def new_warnings(self) -> tuple[str, ...]:
        """Warnings that the fit in the first window does not have."""
        known = [f"{_shown(w)}: {text}" for w in self.windows for text in self.fits[0].sentences]
        return tuple(worded(text) for text in self.sentences if text not in known)

    def record(self) -> dict[str, Any]:
        """Plain numbers and texts, for JSON."""
        parameters = {
            name: {key: value for key, value in vars(p).items() if key != "name"}
            for name, p in self.parameters.items()
        }
        names = ("windows", "parameters", "undetermined", "warnings", "new_warnings")
        whole = {name: getattr(self, name) for name in names} | {"parameters": parameters}
        return {name: plain(value) for name, value in whole.items()}


@typed
def fit_windows(
    recording: Trace | str | os.PathLike[str],
    law: str | type[Law],
    free: Sequence[str] | None = None,
    windows: Sequence[tuple[float, float]] | None = None,
    *,
    reading: Mapping[str, Any] | None = None,
    progress: Callable[[int, int], None] | None = None,
    **options: Any,
) -> WindowedFit:
    """Fit a law to several windows of a recording.

    Parameters
    ----------
    recording : Trace or path
    law : str or type of Law
    free : sequence of str, optional
        As in `fit`. By default the parameters that the first window can determine, for all windows.
    windows : sequence of (float, float), optional
        First and last times (s) of two or more windows; the first is the main window. By default
        the whole recording, and the recording without a third of its first segment, without a third
        of its last, and without both.
    reading : mapping, optional
        Further arguments of `recorded_run`.
    progress : callable, optional
        Called with the number of windows fitted so far and the number of all windows.
    **options
        Further arguments of `fit`.

    Returns
    -------
    WindowedFit

    Raises
    ------
    InputError
        As in `recorded_run` and `fit`; if there are fewer than two windows.

    Notes
    -----
    Windows overlap. Their spread is therefore no second measurement of the noise: it shows errors
    that depend on the window, such as trends that the model lacks.
    """
    trace = recording if isinstance(recording, Trace) else read(recording)
    given = dict(reading or {})
    if windows is not None and len(windows) < 2:
        raise InputError("windows", "be two or more", len(windows), "add one")
    first = recorded_run(trace, **given, window=None if windows is None else windows[0])
    spans = (
        _automatic_windows(first)
        if windows is None
        else tuple((float(a), float(b)) for a, b in windows)
    )
    if free is None:
        chosen = get_law(law) if isinstance(law, str) else law
        free = free_by_default(chosen, [first], options.get("fixed"), options.get("material"))
    advance = counted(progress, len(spans))
    fits = [fit(first, law, free, **options)]
    advance(1)
    if fits[0].converged:
        start = {k.name: fits[0].values[k.name] for k in fits[0].objective.interest}
        options = {"starts": _STARTS, **options, "start": start}
    for span in spans[1:]:
        fits.append(fit(recorded_run(trace, **given, window=span), law, free, **options))
        advance(1)
    failed = [i for i, result in enumerate(fits) if not result.converged]
    sentences = [f"{_shown(spans[i])}: {fits[i].message}" for i in failed]
    usable = [result for result in fits if result.converged]
    estimates: dict[str, WindowEstimate] = {}
    undetermined = []
    for unknown in usable[0].objective.interest if usable else ():
        estimates[unknown.name], known = _window_estimate(unknown, fits)
        far_off = disagreeing(unknown, estimates[unknown.name], spans)
        if far_off or not known:
            undetermined.append(unknown.name)
        sentences += far_off
    for span, result in zip(spans, fits, strict=True):
        sentences += [f"{_shown(span)}: {text}" for text in result.sentences]
    return WindowedFit(spans, tuple(fits), estimates, tuple(undetermined), tuple(sentences))


def _shown(span: tuple[float, float]) -> str:
    return f"window {span[0]:.6g} to {span[1]:.6g} s"


def _automatic_windows(run: RecordedRun) -> tuple[tuple[float, float], ...]:
    """The whole run, and the run without parts of its first and its last segment."""
    rule = f"be given for {run.name}"
    require(run.cuts, "windows", rule, "none: its velocity does not change", "write them")
    begin, end = run.origin, run.origin + float(run.time[-1])
    edges = run.drive.edges[[run.cuts[0], run.cuts[-1]]]
    later = begin + _LEFT_OUT * float(edges[0])
    earlier = end - _LEFT_OUT * (end - begin - float(edges[1]))
    return (begin, end), (later, end), (begin, earlier), (later, earlier)


def disagreeing(
    unknown: Any, over: WindowEstimate, spans: Sequence[tuple[float, float]]
) -> list[str]:
    """Sentences on windows whose estimate is far off: another minimum, or a short window."""
    mean = float(unknown.to_coordinate(over.value))
    total = over.se / abs(float(unknown.slope(over.value)))
    result = []
    for span, value in zip(spans, over.values, strict=True):
        if abs(float(unknown.to_coordinate(value)) - mean) > _FAR_OFF * total:
            result.append(
                f"{_shown(span)}: {named(over.name)} is {value:.4g} {over.unit}, far from the "
                "estimates of the other windows, and has a small weight; look at its fit first"
            )
    return result


def _window_estimate(unknown: Any, fits: Sequence[Fit]) -> tuple[WindowEstimate, bool]:
    """One parameter over the windows, and whether the windows determine it."""
    result = [f.parameters[unknown.name] for f in fits if f.converged]
    u = np.array([float(unknown.to_coordinate(p.value)) for p in result])
    noise = np.array(
        [abs(p.se / unknown.slope(p.value)) if np.isfinite(p.se) else 1e6 for p in result]
    )
    weight = np.maximum(noise, 1e-12) ** -2.0
    weight /= weight.sum()
    mean = float(weight @ u)
    spread = float(np.sqrt(weight @ (u - mean) ** 2))
    mean_noise = float(weight @ noise)
    total = float(np.hypot(mean_noise, spread))
    value = float(unknown.to_value(mean))
    slope = abs(float(unknown.slope(value)))

    def interval(level: float) -> Interval:
        reach = -float(ndtri((1 - level) / 2)) * total
        low, high = unknown.bounds
        return unknown.end(max(mean - reach, low)), unknown.end(min(mean + reach, high))

    estimate = WindowEstimate(
        unknown.name,
        result[0].unit,
        value,
        slope * total,
        slope * mean_noise,
        slope * spread,
        interval(LEVELS[0]),
        interval(LEVELS[1]),
        tuple(f.parameters[unknown.name].value if f.converged else np.nan for f in fits),
    )
    return estimate, total <= unknown.widest(mean)
