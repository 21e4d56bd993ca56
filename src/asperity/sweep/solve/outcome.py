"""What became of a point of a sweep, as a code, a word and a sentence."""

from __future__ import annotations

from enum import IntEnum
from typing import Any

from asperity.orbit.outcome import Outcome, sentence


class SweepOutcome(IntEnum):
    """Outcomes beyond those of a periodic solve, which keep their codes."""

    NOT_COMPUTED = -1
    CONVERGED = 0
    CONTACT_LOST = 50
    SOLVER_ERROR = 51
    WORKER_LOST = 52
    STABLE_THROUGHOUT = 60
    UNSTABLE_THROUGHOUT = 61
    NO_CROSSING = 62
    NO_RESPONSE = 63
    STOPPED = 70
    REFUSED = 71
    FIT_FAILED = 80
    NO_READINGS = 81


_SENTENCES = {
    SweepOutcome.NOT_COMPUTED: "not computed yet",
    SweepOutcome.CONVERGED: "converged",
    SweepOutcome.CONTACT_LOST: (
        "the load does not stay positive within the period; lower its amplitudes"
    ),
    SweepOutcome.SOLVER_ERROR: (
        "the solver stopped with an error of its own; the log of the run holds its message"
    ),
    SweepOutcome.WORKER_LOST: (
        "the process that solved this point died each time, perhaps for want of memory; try "
        "again with --retry-failed and fewer workers"
    ),
    SweepOutcome.STABLE_THROUGHOUT: (
        "no threshold: stable at every stiffness looked at, from {detail:.4g} K_c; extend "
        "threshold.between"
    ),
    SweepOutcome.UNSTABLE_THROUGHOUT: (
        "no threshold: unstable at the stiffest spring looked at, {detail:.4g} K_c; extend "
        "threshold.between"
    ),
    SweepOutcome.NO_CROSSING: (
        "stability changes between two neighbouring stiffnesses, near {detail:.6g} K_c, but no "
        "multiplier crosses the unit circle there"
    ),
    SweepOutcome.NO_RESPONSE: (
        "no periodic response at some of the stiffnesses looked at, the first of them "
        "{detail:.4g} K_c"
    ),
    SweepOutcome.STOPPED: "the transient stopped before its end, at {detail:.6g} s",
    SweepOutcome.REFUSED: (
        "the numbers or the data of this point cannot be solved with; the log of the run says why"
    ),
    SweepOutcome.FIT_FAILED: (
        "the fit did not converge; asperity fit with the numbers of this point says more"
    ),
    SweepOutcome.NO_READINGS: (
        "no readings to fit: at the true values some row of the table has no periodic response"
    ),
}


def words() -> dict[int, str]:
    """A word for each code, as the attribute ``flag_meanings`` has it."""
    codes = {int(o): o.name.lower() for o in Outcome} | {
        int(o): o.name.lower() for o in SweepOutcome
    }
    return dict(sorted(codes.items()))


def reason(outcome: int, detail: float) -> str:
    """The sentence for a point."""
    if outcome in _SENTENCES:
        return _SENTENCES[SweepOutcome(outcome)].format(detail=detail)
    return sentence(outcome, detail)


def flag_attributes() -> dict[str, Any]:
    """Attributes by which any reader understands the codes."""
    known = words()
    return {
        "units": "1",
        "long_name": "what became of the point",
        "flag_values": list(known),
        "flag_meanings": " ".join(known.values()),
    }
