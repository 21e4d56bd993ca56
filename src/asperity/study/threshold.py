"""Stiffness thresholds: the stiffness above which modulated sliding is stable.

A threshold is a zero of ln|m| of the leading multiplier along a line of increasing stiffness. Many
lines are searched together.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from asperity.arrays import Float
from asperity.errors import InputError, require
from asperity.laws import Law
from asperity.outputs import require_memory
from asperity.parameters import DRIVE, law_parameters
from asperity.parameters.arguments import at_least, broadcast_shape, number, typed
from asperity.slider import Slider, equation_of_motion
from asperity.slider.parameters import slider_values
from asperity.study.crossings import STABILITY, find_crossings
from asperity.study.points import POINT_BYTES, Answers, SweepOutcome, critical_stiffness
from asperity.study.responses import answers_of_law, bifurcation_kinds
from asperity.theory.linear_stability import sliding_threshold

#: What happens at a threshold.
BIFURCATIONS = ("fold", "period doubling", "Neimark-Sacker")
#: Limits of the search, over K_c.
_BETWEEN = (0.3, 4.0)


@dataclass(frozen=True)
class StiffnessThreshold:
    """Stiffness at which the response loses stability when the spring is softened.

    Attributes
    ----------
    K : array, shape (...)
        The stiffness (N/m); NaN without a threshold.
    ratio : array, shape (...)
        K/K_c, with K_c from `natural_scales`; NaN also for a law without A, B and D0. Of `nagata`,
        `cut-off` and `strength-area` unmodulated sliding is unstable below another stiffness:
        `asperity.theory.linear_stability.critical_stiffness` has it over W0.
    kind : str array, shape (...)
        "fold", "period doubling" or "Neimark-Sacker".
    mode_frequency : array, shape (...)
        Frequency of the mode that starts to grow (Hz), modulo the modulation frequency.
    result : str array, shape (...)
        "converged", or why there is no threshold.
    """

    K: Float
    ratio: Float
    kind: NDArray[np.object_]
    mode_frequency: Float
    result: NDArray[np.object_]


@typed
def natural_scales(slider: Slider, velocity: ArrayLike | str) -> tuple[float, float]:
    """K_c (N/m) and the stick-slip frequency f_c (Hz) at K_c, on rigid asperities.

    K_c = (B - A) W0/D0 and f_c = sqrt((B - A)/A) V/(2 pi D0), Eqs. (18) and (19) of
    Bureau et al. (2000); for a law with a second state see
    `asperity.theory.linear_stability.sliding_threshold`.

    Parameters
    ----------
    slider : Slider
        Slider of a law with A, B and D0; numbers, no arrays.
    velocity : float or str
        Pulling velocity V (m/s).

    Raises
    ------
    InputError
        If the law has no A, B or D0.
    """
    rule, got = "have A, B and D0 for a critical stiffness in closed form", slider.law.name
    advice = "give the limits of the search as between=(softest, stiffest)"
    require({"A", "B", "D0"} <= set(law_parameters(type(slider.law))), "law", rule, got, advice)
    p = _numbers(slider)
    V = number(velocity, "velocity", "velocity", "positive")
    frequency = sliding_threshold(p).wavenumber * V / (2 * np.pi)
    return float(critical_stiffness(p)), float(frequency)


@typed
def stiffness_threshold(
    slider: Slider,
    *,
    velocity: ArrayLike | str,
    epsilon: Any,
    frequency: Any,
    inertia: bool = False,
    radiation_damping: ArrayLike | str | None = None,
    between: tuple[Any, Any] | None = None,
    scan: Annotated[int, at_least(2)] = 24,
) -> StiffnessThreshold:
    """The highest stiffness at which the leading multiplier passes the unit circle.

    Parameters
    ----------
    slider : Slider
        With numbers, no arrays; the stiffness of the slider has no effect.
    velocity : float or str
        Pulling velocity V (m/s).
    epsilon, frequency : array
        Relative amplitude of the load on the contacts and frequency (Hz); they broadcast.
    inertia : bool
        Whether the mass is included.
    radiation_damping : float or str, optional
        eta (N s/m).
    between : pair of float or str, optional
        Softest and stiffest spring of the search (N/m); 0.3 and 4 times K_c by default.
    scan : int
        Number of stiffnesses solved before the search, at equal ratios. A change of stability and
        back between two of them is not detected.

    Raises
    ------
    InputError
        If a number breaks its rule, or the law has no K_c and `between` is not given; as
        `asperity.slider.equation_of_motion`.

    Examples
    --------
    >>> import asperity as asp
    >>> pmma = asp.materials.load("bureau2000")
    >>> slider = asp.Slider(pmma.law("rice-ruina"), spring="0.2 N/um", load=pmma.W0)
    >>> asp.stiffness_threshold(slider, velocity="1 um/s", epsilon=0.1, frequency="120 Hz")
    """
    eps, f = DRIVE["epsilon"].check(epsilon), DRIVE["frequency"].check(frequency)
    shape = broadcast_shape("epsilon and frequency", eps, f)
    eps, f = np.broadcast_to(eps, shape), np.broadcast_to(f, shape)
    try:
        critical, _ = natural_scales(slider, velocity)
    except InputError:
        if between is None:
            raise
        critical = np.nan
    low, high = _ends(critical, between)
    V = number(velocity, "velocity", "velocity", "positive")
    eta = 0.0 if radiation_damping is None else radiation_damping
    eta = number(eta, "radiation_damping", "damping", "not negative")
    # The equations refuse inertia without a mass.
    equation_of_motion(slider, V, 1.0, inertia=inertia, eta=eta or None)
    values = _numbers(slider) | {"V": V, "eta": eta, "inertia": float(inertia)}
    count = eps.size
    require_scan(count, scan, "scan")
    searched = search_thresholds(
        type(slider.law),
        {name: np.full(count, float(value)) for name, value in values.items()}
        | {"epsilon": eps.ravel(), "frequency": f.ravel()},
        np.full(count, low),
        np.full(count, high),
        scan,
    )
    K = searched["K"].reshape(shape)
    code = np.nan_to_num(searched["bifurcation"], nan=-1).astype(int)
    kinds = np.array([*BIFURCATIONS, ""], dtype=object)[code]
    # Stiffnesses are in N/m here, and in K_c in a sweep.
    texts = [text.replace(" K_c", " N/m").replace("threshold.", "") for text in searched.result]
    return StiffnessThreshold(
        K=K,
        ratio=K / (critical if critical > 0 else np.nan),
        kind=kinds.reshape(shape),
        mode_frequency=searched["mode_frequency"].reshape(shape),
        result=np.array(texts, dtype=object).reshape(shape),
    )


def require_scan(points: int, scan: int, name: str) -> None:
    """Refuse a scan that does not fit in memory.

    Raises
    ------
    InputError
        About the field `name`.
    """
    require_memory(
        points * scan * POINT_BYTES, name, f"{scan:,} stiffnesses at each of {points:,} points",
        "lower it",
    )  # fmt: skip


def search_thresholds(
    law: type[Law], values: Mapping[str, Float], low: Float, high: Float, scan: int
) -> Answers:
    """The highest stiffness at which each operating point loses stability.

    Parameters
    ----------
    law : type of Law
    values : mapping of str to array, shape (points,)
        All numbers but K in SI, by name.
    low, high : array, shape (points,)
        Softest and stiffest spring of the search (N/m).
    scan : int
        Number of stiffnesses solved before the search, at equal ratios.

    Returns
    -------
    Answers
        ``K`` (N/m), ``mode_frequency`` (Hz), |arg m|/(2 pi) of the leading multiplier times the
        frequency, and ``bifurcation``, its number in `BIFURCATIONS`. The detail of a point without
        a threshold is the stiffness (N/m) of its outcome: of a failed point, or of an end of the
        scan.
    """
    count = len(low)

    def stiffness(where: Float) -> Float:
        line = where[:, 1].astype(int)
        return np.asarray(low[line] * (high[line] / low[line]) ** where[:, 0])

    def solve(where: Float) -> Answers:
        """Responses at the rows of `where`: fraction of the line, number of the line."""
        at = {name: numbers[where[:, 1].astype(int)] for name, numbers in values.items()}
        return answers_of_law(law, at | {"K": stiffness(where)}, STABILITY)

    steps = np.linspace(0.0, 1.0, scan)
    grid = np.stack([a.ravel() for a in np.meshgrid(steps, np.arange(count, dtype=float))], -1)
    scanned = solve(grid)
    g = scanned["log_multiplier"].reshape(count, scan)
    failed = ~scanned.converged.reshape(count, scan)
    with np.errstate(invalid="ignore"):
        crossed = (g[:, :-1] > 0) & (g[:, 1:] < 0)
    # All stiffer springs of the scan must have a stable response.
    last = scan - 2 - np.argmax(crossed[:, ::-1], axis=1)
    stiffer = np.array([(g[i, k + 1 :] < 0).all() for i, k in enumerate(last)], dtype=bool)
    usable = crossed.any(axis=1) & stiffer
    line = np.flatnonzero(usable)
    k = last[line]
    crossings = find_crossings(
        solve,
        np.stack([steps[k], line], axis=-1),
        np.stack([steps[k + 1], line], axis=-1),
        g[line, k],
        g[line, k + 1],
    )
    answers = Answers.empty(("K", "mode_frequency", "bifurcation"), count)
    at, located = stiffness(crossings.where), crossings.located
    answers.fail(line, SweepOutcome.NO_CROSSING, at)
    points = crossings.points.take(located)
    kinds = [
        BIFURCATIONS.index(k) if k in BIFURCATIONS else np.nan for k in bifurcation_kinds(points)
    ]
    mode = np.abs(points["multiplier_argument"]) / (2 * np.pi) * values["frequency"][line[located]]
    numbers = {"K": at[located], "mode_frequency": mode, "bifurcation": np.array(kinds, float)}
    answers.put(line[located], Answers(numbers, points.outcome, points.detail))
    for i in np.flatnonzero(~usable):
        if failed[i].any():
            first = low[i] * (high[i] / low[i]) ** steps[np.argmax(failed[i])]
            answers.fail(i, SweepOutcome.NO_RESPONSE, first)
        elif g[i, -1] > 0:
            answers.fail(i, SweepOutcome.UNSTABLE_THROUGHOUT, high[i])
        else:
            answers.fail(i, SweepOutcome.STABLE_THROUGHOUT, low[i])
    return answers


def _numbers(slider: Slider) -> dict[str, float]:
    """Parameters of a slider by name, as numbers."""
    values = slider_values(slider)
    arrays = [name for name, value in values.items() if np.size(value) != 1]
    got = f"an array for {', '.join(arrays)}"
    require(not arrays, "slider", "have numbers for a threshold", got, "call it once for each")
    return {name: float(np.ravel(value)[0]) for name, value in values.items()}


def _ends(critical: float, between: tuple[Any, Any] | None) -> tuple[float, float]:
    """Limits of the search (N/m), in ascending order."""
    if between is None:
        rule = "be given where unmodulated sliding is stable at any stiffness"
        advice = "give two stiffnesses"
        require(not critical <= 0, "between", rule, f"none and K_c = {critical:g} N/m", advice)
        return _BETWEEN[0] * critical, _BETWEEN[1] * critical
    low, high = (number(end, "between", "stiffness", "positive") for end in between)
    rule = "go from a softer to a stiffer spring"
    require(low < high, "between", rule, f"{low:g} to {high:g} N/m", "swap them")
    return low, high
