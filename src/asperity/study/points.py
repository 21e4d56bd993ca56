"""Operating points of a chunk and their answers: numbers, and an outcome as code and as words.

Parameters may follow from dimensionless ratios.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.arrays import Bool, Float, Index
from asperity.errors import require
from asperity.laws import get_law
from asperity.loads.modulation import no_contact
from asperity.operating_point import known_parameters
from asperity.orbit.outcome import Outcome, sentence
from asperity.parameters import OUTPUTS, Output, Parameter, point_parameters
from asperity.parameters.arguments import shown
from asperity.theory.linear_stability import sliding_threshold

#: Memory of a point while it is solved (bytes): measured 1.6 kB for periodic responses and 1.2 kB
#: for stiffness thresholds (largest resident memory, 1e5 to 4e5 points of rice-ruina).
POINT_BYTES = 2000.0


@dataclass(frozen=True)
class Points:
    """Operating points of a chunk, as one-dimensional columns.

    Attributes
    ----------
    laws : str array, shape (points,)
    values : dict of str to array, shape (points,)
        SI numbers by name, NaN where a point has no value.
    data : str array, shape (points,), or None
        Data file of each point; None where no axis varies it.
    """

    laws: NDArray[np.object_]
    values: dict[str, Float]
    data: NDArray[np.object_] | None = None

    def __len__(self) -> int:
        return len(self.laws)

    def take(self, index: Any) -> Points:
        """The points `index`."""
        data = None if self.data is None else self.data[index]
        return Points(self.laws[index], {n: v[index] for n, v in self.values.items()}, data)

    def of_law(self, law: str) -> dict[str, Float]:
        """Values of all parameters of one law, with defaults where a point has no value."""
        of_law = {}
        for name, parameter in point_parameters(get_law(law)).items():
            default = math.nan if parameter.default is None else parameter.default
            values = self.values.get(name, np.full(len(self), default))
            of_law[name] = np.where(np.isnan(values), default, values)
        return of_law

    def by_law(self) -> Iterator[tuple[str, Index]]:
        """The laws of the points, each with the indices of its points."""
        for law in dict.fromkeys(self.laws):
            yield str(law), np.flatnonzero(self.laws == law)


@dataclass(frozen=True)
class Ratio:
    """A dimensionless ratio, and the parameter that it determines with others of the same point.

    Attributes
    ----------
    parameter : Parameter
        Name, meaning and rule of the ratio.
    target : str
        The parameter that the ratio determines.
    needs : tuple of str
        The other parameters in the definition of the ratio.
    solve : callable
        Maps the values of the point, with the ratio, to the target in SI.
    counts : tuple of str
        Further parameters, which count where the law of the point has them; NaN elsewhere.
    """

    parameter: Parameter
    target: str
    needs: tuple[str, ...]
    solve: Callable[[Mapping[str, Float]], Float]
    counts: tuple[str, ...] = ()


def critical_stiffness(p: Mapping[str, Any]) -> Float:
    """K_c (N/m) of unmodulated sliding on rigid asperities; not positive where there is none.

    Parameters
    ----------
    p : mapping of str to array
        A, B, D0 and W0 by name, and B2 and D2 of a law with a second state.
    """
    return sliding_threshold(p).stiffness * p["W0"]


def _dimensionless(name: str, aliases: tuple[str, ...], meaning: str, symbol: str) -> Parameter:
    return Parameter(
        name, "dimensionless", "positive", meaning, symbol, "drive", label=name, aliases=aliases
    )


#: Ratios by name; their formulas are aliases that a plan may write too.
RATIOS: Mapping[str, Ratio] = MappingProxyType(
    {
        "stiffness_ratio": Ratio(
            _dimensionless(
                "stiffness_ratio",
                ("K/Kc", "K/K_c"),
                "spring stiffness over the critical one of rigid asperities, (B - A) W0/D0",
                "K/K_c",
            ),
            "K",
            ("A", "B", "D0", "W0"),
            lambda p: p["stiffness_ratio"] * critical_stiffness(p),
            ("B2", "D2"),
        ),
        "slip_ratio": Ratio(
            _dimensionless(
                "slip_ratio",
                ("V/(f D0)", "V T/D0"),
                "slip in a period over the memory length, V/(f D0)",
                "V/(f D_0)",
            ),
            "frequency",
            ("V", "D0"),
            lambda p: p["V"] / (p["slip_ratio"] * p["D0"]),
        ),
    }
)


def known_quantities() -> dict[str, Parameter | Output]:
    """What an axis may vary, of any registered law, and what a map or a slice may show."""
    ratios = {name: ratio.parameter for name, ratio in RATIOS.items()}
    return {**known_parameters(), **ratios, **OUTPUTS}


class SweepOutcome(IntEnum):
    """Outcomes of a sweep's points, in addition to those of `asperity.orbit.outcome.Outcome`."""

    NOT_COMPUTED = -1
    CONVERGED = 0
    CONTACT_LOST = 50
    SOLVER_ERROR = 51
    WORKER_LOST = 52
    STABLE_THROUGHOUT = 60
    UNSTABLE_THROUGHOUT = 61
    NO_CROSSING = 62
    NO_RESPONSE = 63
    NO_SCALE = 64
    STOPPED = 70
    REFUSED = 71
    NO_SAMPLES = 72
    FIT_FAILED = 80
    NO_READINGS = 81


_SENTENCES = {
    SweepOutcome.NOT_COMPUTED: "not computed yet",
    SweepOutcome.SOLVER_ERROR: (
        "the solver stopped with an unexpected error; the log of the run has its message"
    ),
    SweepOutcome.WORKER_LOST: (
        "the process that solved this point died at each attempt, perhaps for lack of memory; "
        "repeat with --retry-failed and fewer workers"
    ),
    SweepOutcome.STABLE_THROUGHOUT: (
        "no threshold: stable at every stiffness of the scan, from {detail:.4g} K_c; extend "
        "threshold.between"
    ),
    SweepOutcome.UNSTABLE_THROUGHOUT: (
        "no threshold: unstable at the stiffest spring of the scan, {detail:.4g} K_c; extend "
        "threshold.between"
    ),
    SweepOutcome.NO_CROSSING: (
        "stability changes between two neighbouring stiffnesses, near {detail:.6g} K_c, but no "
        "multiplier crosses the unit circle there"
    ),
    SweepOutcome.NO_RESPONSE: (
        "no periodic response at some of the stiffnesses of the scan, the first of them "
        "{detail:.4g} K_c"
    ),
    SweepOutcome.NO_SCALE: (
        "no threshold was searched for: its limits are multiples of K_c, and without modulation "
        "sliding is stable at any stiffness, or has no K_c in closed form"
    ),
    SweepOutcome.STOPPED: "the transient stopped before its end, at {detail:.6g} s",
    SweepOutcome.REFUSED: (
        "the numbers or the data of this point are invalid; the log of the run gives the reason"
    ),
    SweepOutcome.NO_SAMPLES: (
        "no sample of the motion, which ends at {detail:.6g} s, lies in the time interval of a "
        "number of transient.numbers"
    ),
    SweepOutcome.FIT_FAILED: (
        "the fit did not converge; asperity fit with the numbers of this point gives details"
    ),
    SweepOutcome.NO_READINGS: (
        "no readings to fit: at the true values some row of the table has no periodic response"
    ),
}


def outcome_words() -> dict[int, str]:
    """The word of each outcome code, as in the attribute ``flag_meanings``."""
    codes = {int(o): o.name.lower() for o in Outcome} | {
        int(o): o.name.lower() for o in SweepOutcome
    }
    return dict(sorted(codes.items()))


def _reason(outcome: int, detail: float) -> str:
    """The sentence of an outcome with its number."""
    if outcome == SweepOutcome.CONTACT_LOST:
        return no_contact(detail)
    if outcome in _SENTENCES:
        return _SENTENCES[SweepOutcome(outcome)].format(detail=detail)
    return sentence(outcome, detail)


def flag_attributes() -> dict[str, Any]:
    """CF attributes of the variable ``outcome``: codes and their meanings."""
    known = outcome_words()
    return {
        "units": "1",
        "long_name": "outcome of the point",
        "flag_values": list(known),
        "flag_meanings": " ".join(known.values()),
    }


def reasons(outcome: Any, detail: Any) -> NDArray[np.object_]:
    """Outcomes of points as sentences.

    Parameters
    ----------
    outcome, detail : array
        Variables of a store, or parts of them.
    """
    outcome, detail = np.broadcast_arrays(outcome, detail)
    for name, values, kinds in (("outcome", outcome, "iu"), ("detail", detail, "iuf")):
        numbers = values.dtype.kind in kinds
        require(numbers, name, "be the variable of a store", shown(values), f"take store.{name}")
    texts = np.full(outcome.shape, "converged", dtype=object)
    for i in map(tuple, np.argwhere((outcome != SweepOutcome.CONVERGED) | (detail < 0))):
        texts[i] = _reason(int(outcome[i]), float(detail[i]))
    return texts


@dataclass
class Answers:
    """Numbers and outcomes of points.

    Attributes
    ----------
    numbers : dict of str to array, shape (points,)
        Outputs by name; NaN where a point failed.
    outcome : int16 array, shape (points,)
        A `SweepOutcome`, or an `asperity.orbit.outcome.Outcome`.
    detail : array, shape (points,)
        The number in the sentence of the outcome; 0 where the sentence has no number.
    """

    numbers: dict[str, Float]
    outcome: NDArray[np.int16]
    detail: Float

    @classmethod
    def empty(cls, names: Sequence[str], count: int) -> Answers:
        """Answers of `count` points that are not computed yet."""
        return cls(
            {name: np.full(count, np.nan) for name in names},
            np.full(count, SweepOutcome.NOT_COMPUTED, dtype=np.int16),
            np.zeros(count),
        )

    def __len__(self) -> int:
        return len(self.outcome)

    def __getitem__(self, name: str) -> Float:
        return self.numbers[name]

    def take(self, index: Any) -> Answers:
        """The answers of the points `index`, which is an array of numbers, a mask or a slice."""
        numbers = {name: values[index] for name, values in self.numbers.items()}
        return Answers(numbers, self.outcome[index], self.detail[index])

    def with_others(self, others: Answers) -> Answers:
        """These answers, followed by others of the same outputs."""
        numbers = {n: np.concatenate([v, others[n]]) for n, v in self.numbers.items()}
        outcome = np.concatenate([self.outcome, others.outcome])
        return Answers(numbers, outcome, np.concatenate([self.detail, others.detail]))

    def put(self, index: Any, others: Answers) -> None:
        """Replace the answers at `index` by `others`."""
        for name, values in others.numbers.items():
            self.numbers[name][index] = values
        self.outcome[index], self.detail[index] = others.outcome, others.detail

    def fail(self, index: Any, outcome: int, detail: Any = 0.0) -> None:
        """Set an outcome at the points `index`, and their numbers to NaN."""
        for values in self.numbers.values():
            values[index] = np.nan
        self.outcome[index], self.detail[index] = outcome, detail

    @property
    def converged(self) -> Bool:
        """Points with an answer."""
        return np.asarray(self.outcome == SweepOutcome.CONVERGED)

    @property
    def reverses(self) -> Bool:
        """Responses on which slip would reverse, see `asperity.orbit.PeriodicResponse`."""
        return self.converged & np.asarray(self.detail < 0)

    @property
    def failed(self) -> int:
        """Number of points without an answer."""
        return int(np.count_nonzero(~self.converged))

    @property
    def result(self) -> NDArray[np.object_]:
        """The word "converged", or the sentence of the outcome."""
        return reasons(self.outcome, self.detail)
