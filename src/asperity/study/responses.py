"""Periodic responses at operating points, for tables, maps, thresholds and sweeps."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.arrays import Bool, Float, Index
from asperity.laws import Law
from asperity.operating_point import lowest_loads, motions, respond, without_mass
from asperity.orbit import PeriodicResponse
from asperity.orbit.floquet import kind_of_crossing
from asperity.orbit.outcome import Outcome
from asperity.parameters import RULES, point_parameters
from asperity.parameters.arguments import increments
from asperity.study.points import Answers, SweepOutcome


def answers_of_law(
    law: type[Law],
    values: Mapping[str, Float],
    outputs: Sequence[str],
    progress: Callable[[int], None] | None = None,
) -> Answers:
    """Periodic responses of one law; points with the same equation of motion are solved together.

    Parameters
    ----------
    law : type of Law
    values : mapping of str to array, shape (points,)
        SI numbers by the names of `point_parameters`.
    outputs : sequence of str
        Attributes of a `PeriodicResponse` with one number a point, and ``log_multiplier``, ln|m| of
        the leading multiplier (-inf for a law without dynamics), and ``multiplier_argument``, its
        arg m (rad).
    progress : callable, optional
        Called with the number of points finished since the last call.
    """
    answers = Answers.empty(outputs, len(values["V"]))
    sound = solvable(law, values, answers)
    if progress is not None and len(sound) < len(answers):
        progress(len(answers) - len(sound))
    for group in motions({n: v[sound] for n, v in values.items()}) if len(sound) else []:
        index = sound[group]
        of_group = {n: v[index] for n, v in values.items()}
        response = respond(law, of_group, increments(progress), workers=1)
        converged = response.converged
        # A point that failed may have a phase of 0 with an amplitude of NaN.
        numbers = {n: np.where(converged, _output(response, n), np.nan) for n in outputs}
        detail = np.where(converged & ~response.reverses, 0.0, response.detail)
        answers.put(index, Answers(numbers, response.outcome.astype(np.int16), detail))
    return answers


def broken_rules(law: type[Law], values: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """What makes points invalid: name of a parameter, or "law", and at which points it does.

    Parameters
    ----------
    law : type of Law
    values : mapping of str to float or array, shape (points,)
        As for `answers_of_law`.
    """
    for name, parameter in point_parameters(law).items():
        if name in values:
            with np.errstate(invalid="ignore"):
                holds = RULES[parameter.rule].holds(values[name])
            yield name, ~(np.isfinite(values[name]) & holds)
    yield "M", without_mass(values)
    if not law.rate_dependent:
        yield "law", (values["inertia"] > 0) | (values["eta"] > 0)


def solvable(law: type[Law], values: Mapping[str, Float], answers: Answers) -> Index:
    """Indices of the points that can be solved; `answers` gets the outcome of the others."""
    wrong = np.any([at for _, at in broken_rules(law, values)], axis=0)
    answers.fail(wrong, Outcome.INVALID)
    sound = np.flatnonzero(~wrong)
    lowest = lowest_loads({n: v[sound] for n, v in values.items()})
    lost = ~(lowest > 0)
    answers.fail(sound[lost], SweepOutcome.CONTACT_LOST, lowest[lost])
    return sound[~lost]


def is_stable(answers: Answers) -> Bool:
    """Whether all multipliers are inside the unit circle; False where not converged."""
    return answers.converged & (answers["log_multiplier"] < 0)


def bifurcation_kinds(answers: Answers) -> NDArray[np.object_]:
    """Bifurcation at which the leading multiplier crosses the unit circle; "" where unknown."""
    return kind_of_crossing(answers["log_multiplier"] + 1j * answers["multiplier_argument"])


def _output(response: PeriodicResponse, name: str) -> Float:
    if name not in ("log_multiplier", "multiplier_argument"):
        return np.asarray(getattr(response, name), dtype=float)
    logs = response.log_multipliers
    leading = logs[..., 0] if logs.shape[-1] else np.full(len(logs), -np.inf + 0j)
    return np.asarray(leading.real if name == "log_multiplier" else leading.imag)
