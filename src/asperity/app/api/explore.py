"""The Explore tab: the response at an operating point.

The fast methods answer within milliseconds. The job `search` looks for orbits that they do not
solve, after the last change of a slider.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache, lru_cache, partial
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from asperity.app.api import as_code, catalogue
from asperity.app.api.operating_point import (
    Name,
    OperatingPoint,
    borne_share,
    epsilon_on_contacts,
    solve,
)
from asperity.app.endpoints import Answer, Job
from asperity.app.preparation import is_ready
from asperity.laws import get_law, registered
from asperity.orbit import (
    Outcome,
    PeriodicResponse,
    over_a_period,
    response_function,
)

#: Numbers of harmonics and of instants of the period, and of amplitudes and frequencies of curves.
_HARMONICS, _INSTANTS, _AMPLITUDES, _FREQUENCIES = 8, 256, 24, 80
#: Quantities with a curve against the amplitude.
_CURVES = ("mean_friction", "mu1", "mu2", "phase1", "phase2")
#: Methods that take milliseconds.
_FAST = ("fourier",)
#: Laws at the start of the tab, and amplitudes that need different grids of the fast method.
_FIRST = ("elasto-plastic", "rice-ruina", "linker-dieterich")
_AMPLITUDE, _LARGE = (0.1,), (0.3, 0.5)
#: Programs that are compiled when the server starts.
AT_START = (*_FIRST, *(f"{name} at large amplitudes" for name in _FIRST))
#: Amplitudes that a search solves between two reports.
_STEP = 3


class Explored(OperatingPoint):
    """An operating point, and the laws that are compared there.

    Attributes
    ----------
    laws : list of str
        Laws whose curves against the amplitude are compared.
    """

    laws: Annotated[list[Name], Field(max_length=13, default_factory=list)]

    def amplitudes(self) -> np.ndarray:
        """Amplitudes of the curves: over the range of the slider."""
        slider = catalogue.slider("epsilon", self.chosen_material())
        return np.linspace(slider["low"], slider["high"], _AMPLITUDES)

    def frequencies(self) -> np.ndarray:
        """Frequencies (Hz) of the air layer's curve: over the range of the slider."""
        slider = catalogue.slider("frequency", self.chosen_material())
        return np.geomspace(slider["low"], slider["high"], _FREQUENCIES)


def explore(question: Explored) -> dict[str, Any]:
    """Response, curves and share of the air layer, as far as the fast methods can solve them."""
    numbers = question.sourced()
    values = {name: number.value for name, number in numbers.items()}
    epsilon = epsilon_on_contacts(question, values)
    laws = list(dict.fromkeys([question.law, *question.laws]))
    for name in laws:
        get_law(name)
    answer: dict[str, Any] = {
        "numbers": values,
        "origins": {name: number.origin for name, number in numbers.items()},
        "epsilon": epsilon,
        "air": _air(question, values),
    }
    waiting = [n for n in laws if not is_ready(n)]
    if waiting:
        answer["preparing"] = waiting[0]
    if question.law in waiting:
        return answer
    point = solve(question.law, values, epsilon, methods=_FAST, **_KEPT)
    answer["point"] = point_record(point, searched=False)
    grid = question.amplitudes()
    answer["amplitudes"] = grid
    answer["curves"] = {n: _fast_curve(question, n, grid) for n in laws if n not in waiting}
    return answer


_KEPT = {"harmonics": _HARMONICS, "waveform": _INSTANTS}


def _fast_curve(question: Explored, name: str, grid: np.ndarray) -> dict[str, Any]:
    """Curves against the amplitude; NaN where only a search finds an orbit."""
    values = question.values(name)
    others = tuple((n, v) for n, v in values.items() if n != "epsilon")
    return _curve(name, others, tuple(grid.tolist()))


# The amplitude, and numbers of another law, do not change a curve.
@lru_cache(maxsize=32)
def _curve(
    name: str, others: tuple[tuple[str, float], ...], amplitudes: tuple[float, ...]
) -> dict[str, Any]:
    values, grid = dict(others), np.array(amplitudes)
    if not get_law(name).rate_dependent:
        response = solve(name, values, grid)
        return {**{n: getattr(response, n) for n in _CURVES}, "left": []}
    # The fast method solves the quasi-static equations only.
    if values.get("inertia") or values.get("eta"):
        empty = np.full(len(grid), np.nan)
        return {**dict.fromkeys(_CURVES, empty), "left": list(range(len(grid)))}
    function = _function(name)
    needed = {n: v for n, v in values.items() if n in function.parameters}
    result = function({**needed, "epsilon": grid})
    c1, c2 = np.asarray(result.harmonics).T
    return {
        "mean_friction": np.asarray(result.mean_friction),
        "mu1": np.abs(c1),
        "mu2": np.abs(c2),
        # Without modulation there is no phase.
        "phase1": np.where(grid > 0, np.angle(c1), np.nan),
        "phase2": np.where(grid > 0, np.angle(c2), np.nan),
        "left": np.flatnonzero(np.asarray(result.outcome) != Outcome.CONVERGED),
    }


_function = cache(partial(response_function, harmonics=2, multipliers=False, search=False))


def point_record(response: PeriodicResponse, *, searched: bool) -> dict[str, Any]:
    """One response as the page shows it."""
    converged = bool(response.converged)
    record: dict[str, Any] = {"converged": converged, "searched": searched or converged}
    if not converged:
        return {**record, "result": str(response.result[()]) if searched else ""}
    period = over_a_period(response)
    return {
        **record,
        "result": stability_sentence(response) + _reservation(response),
        "stable": bool(response.stable),
        "phase": period.phase,
        "force": period.force,
        "slip": period.plastic_velocity,
        "age": period.age,
        "harmonics": response.harmonics,
        "multipliers": response.multipliers,
        **{name: getattr(response, name)[()] for name in _SHOWN},
        "mode": str(response.mode[()]),
    }


_SHOWN = (
    *("mean_friction", "delta_mu", "mu_ss", "mu1", "mu2", "phase1", "phase2"),
    *("floquet_max", "mode_frequency", "growth_rate"),
)


def _reservation(response: PeriodicResponse) -> str:
    """What limits a converged response, as the end of a sentence; empty if nothing does."""
    return "; " + str(response.result[()]).partition(", ")[2] if response.reverses else ""


def stability_sentence(response: PeriodicResponse) -> str:
    """Stability of one response in plain words."""
    if response.log_multipliers.shape[-1] == 0:
        return "no dynamics: the force follows the load"
    rate, turn = float(response.growth_rate), float(response.mode_frequency)
    swings = f" swings at {turn:.3g} Hz and" if turn > 0 else ""
    if bool(response.stable):
        # e^-3 is 5 %.
        fades = f"fades to 5 % in {-3 / rate:.3g} s" if rate else "stays"
        return f"stable: a small disturbance{swings} {fades}"
    kind = str(response.mode[()])
    doubles = f"doubles in {np.log(2) / rate:.3g} s" if rate else "stays"
    outcome = {
        "fold": "; the slip runs away or stops (a fold)",
        "period doubling": "; every second period becomes another (a period doubling)",
        "Neimark-Sacker": ": expect stick-slip (a Neimark-Sacker bifurcation)",
    }.get(kind, "")
    return f"unstable: a small disturbance{swings} {doubles}{outcome}"


def _air(question: Explored, values: Mapping[str, float]) -> dict[str, Any] | None:
    if question.air is None:
        return None
    frequency = question.frequencies()
    share, phase = borne_share(question, values, frequency)
    here, lag = borne_share(question, values, values["frequency"])
    return {
        "frequency": frequency,
        "share": share,
        "phase": phase,
        "share_here": float(here),
        "phase_here": float(lag),
        "numbers": question.air_values(),
    }


def text(question: Explored) -> dict[str, str]:
    """The same operating point as Python and as a command."""
    values = question.values()
    return as_code.explore(question, values, epsilon_on_contacts(question, values))


def search(argument: Mapping[str, Any], report: Callable[..., None]) -> dict[str, Any]:
    """Search for the orbits that the fast methods did not solve: the point, then the curves.

    Each message has ``point``, or ``curve`` with the law, the indices and their values.
    """
    question = Explored(**argument)
    values = question.values()
    epsilon = epsilon_on_contacts(question, values)
    on_progress = lambda done, points: report()  # noqa: E731
    point = solve(question.law, values, epsilon, progress=on_progress, **_KEPT)
    report(point=point_record(point, searched=True))
    grid = question.amplitudes()
    for name in dict.fromkeys([question.law, *question.laws]):
        left = np.asarray(_fast_curve(question, name, grid)["left"], dtype=int)
        numbers = question.values(name)
        for start in range(0, len(left), _STEP):
            rows = left[start : start + _STEP]
            result = solve(name, numbers, grid[rows], progress=on_progress)
            values_there = {n: getattr(result, n) for n in _CURVES}
            reasons = [str(text) for text in result.result]
            report(
                curve=name, rows=rows, converged=result.converged, result=reasons, **values_there
            )
    return {}


def preparations() -> dict[str, Callable[[], Any]]:
    """Quasi-static programs by law; those of `AT_START` are compiled when the server starts.

    The grid of the fast method depends on the amplitude, and each grid needs a program.
    """
    names = [name for name, law in registered().items() if law.rate_dependent]
    tasks: dict[str, Callable[[], Any]] = {
        name: partial(_prepare, name, _AMPLITUDE) for name in names
    }
    more = {f"{n} at large amplitudes": partial(_prepare, n, _LARGE) for n in _FIRST}
    return tasks | more


def _prepare(name: str, amplitudes: tuple[float, ...]) -> None:
    numbers = {"V": 1e-6, "epsilon": amplitudes[0], "frequency": 120.0}
    question = Explored.model_validate({"law": name, "numbers": numbers})
    values = question.values()
    for epsilon in amplitudes:
        solve(name, values, epsilon, methods=_FAST, **_KEPT)
    _fast_curve(question, name, question.amplitudes())


ENDPOINTS = (
    Answer("explore", Explored, explore),
    Answer("explore/text", Explored, text),
    Job("explore/search", Explored, "asperity.app.api.explore:search", lane="search", seconds=300),
)
