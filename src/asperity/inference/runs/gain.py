"""Gain of a force gauge as a nuisance of recordings: recorded over computed friction.

A gain multiplies F/W. Under a constant load A, B, mu0 and K over 1/gain give the same recording, so
that it is known from a calibration alone, which is its prior.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from asperity.errors import InputError
from asperity.inference.runs.run import RecordedRun
from asperity.inference.unknowns import Prior, Unknown, unknown_of
from asperity.parameters import Parameter

#: Name of the gain in the motion of a run, and of that of every run in priors.
GAIN = "gain"
PARAMETER = Parameter(
    GAIN, "dimensionless", "positive", "recorded friction over that of the law", place="drive"
)


def gain_of(suffix: str, priors: Mapping[str, Prior]) -> Unknown | None:
    """The gain of a run as a free parameter; None without a prior.

    Parameters
    ----------
    suffix : str
        "[name of the run]" where there are several sets of data.
    priors : mapping of str to Prior
        ``gain`` for that of every run by itself, or ``gain[name]``.
    """
    name = GAIN + suffix
    prior = priors.get(name, priors.get(GAIN))
    if prior is None:
        return None
    return unknown_of(replace(PARAMETER, name=name), prior.mean, prior, None, nuisance=True)


def require_calibrated(
    runs: Sequence[RecordedRun],
    free: Sequence[str],
    priors: Mapping[str, Prior],
    *,
    mu0_given: bool,
    beside_table: bool,
) -> None:
    """Refuse a gain without a prior, and one that a load change would seem to measure.

    Parameters
    ----------
    runs : sequence of RecordedRun
    free : sequence of str
    priors : mapping of str to Prior
    mu0_given : bool
        Whether mu0 is free or has a number that is not taken from the recording.
    beside_table : bool
        Whether lock-in readings are fitted together with the runs.

    Raises
    ------
    InputError
    """
    given = [n for n in priors if n.partition("[")[0] == GAIN]
    several = len(runs) > 1 or beside_table
    for name in free:
        if name.partition("[")[0] == GAIN and name not in given and GAIN not in given:
            raise InputError(
                f"{name} must have a prior, got none: A, B, mu0 and K scale with it, so that a "
                "recording cannot tell it; give one by a calibration of the gauge, like "
                f'--prior "{name}=1+-0.02"'
            )
    known = [GAIN, *((f"{GAIN}[{run.name}]" for run in runs) if several else ())]
    for name in [*given, *(n for n in free if n.partition("[")[0] == GAIN)]:
        if name not in known:
            raise InputError(
                f"prior of a gain must name {' or '.join(known)}, got '{name}'; correct the name"
            )
    varying = [run.name for run in runs if run.load_varies]
    if given and varying and not mu0_given:
        raise InputError(
            f"mu0 must be free or given with a gain under a load that changes, as in {varying[0]}, "
            "got neither: the first friction would stand for it, without the gain; free mu0, or "
            "fix it"
        )
