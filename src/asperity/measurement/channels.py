"""Which channels are load and shear, and which of their signs are conventions of the recorder."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from asperity.errors import InputError
from asperity.recording.finding import Finding

if TYPE_CHECKING:
    from asperity.recording.trace import Channel, Trace

Array = NDArray[np.float64]

#: Medians of F/W and of a recorded friction that differ by more than this share contradict each
#: other. Corrections for jackets, seals and changing areas are some percent; a wrong unit, column
#: or zero is more.
_CONTRADICTS = 0.1


def load_channel(trace: Trace, load: str) -> Channel | None:
    """The load; None where the user names none and none is recorded.

    Parameters
    ----------
    trace : Trace
    load : str
        Channel, by name or role.

    Raises
    ------
    InputError
        If the user names a load that is not there.
    """
    try:
        return trace.channel(load)
    except InputError:
        if load != "W" or "W" in trace.roles:
            raise
        return None


def shear_channel(trace: Trace, force: str, load: Channel | None) -> tuple[Channel, bool]:
    """The shear force or, where that makes no friction, the recorded friction coefficient.

    What the user has named goes first, the force before the friction. Of what goes by its name, a
    force (or stress) counts with a load of its dimension; without one the friction counts.

    Parameters
    ----------
    trace : Trace
    force : str
        Channel, by name or role.
    load : Channel or None

    Returns
    -------
    (Channel, bool)
        And whether it is a friction coefficient.

    Raises
    ------
    InputError
        If neither is recorded, or more than one can be meant.
    """
    if force != "F" or "F" in trace.roles:
        shear = trace.channel(force)
        return shear, shear.kind == "dimensionless"
    friction = _friction(trace)
    if "friction" in trace.roles and friction is not None:
        return friction, True
    try:
        shear = trace.channel("F")
    except InputError:
        if friction is None:
            raise
        return friction, True
    ratio = shear.kind == "dimensionless"
    if ratio or friction is None or (load is not None and load.kind == shear.kind):
        return shear, ratio
    return friction, True


def refuse_contradiction(trace: Trace, force: str, shear: Channel, friction: Array) -> None:
    """Refuse a recorded friction that is not F/W, where the user has chosen neither.

    Parameters
    ----------
    trace : Trace
    force : str
        Channel, by name or role.
    shear : Channel
        The force that F/W is made of.
    friction : array, (n,)
        F/W; NaN where undefined.

    Raises
    ------
    InputError
        With what to choose.
    """
    recorded = _friction(trace)
    named = force != "F" or {"F", "friction"} & set(trace.roles)
    if named or recorded is None or recorded is shear:
        return
    both = np.isfinite(friction) & np.isfinite(recorded.values)
    if not both.any():
        return
    made, written = (float(np.median(values[both])) for values in (friction, recorded.values))
    # The sign of a shear is a convention of the recorder.
    if abs(abs(made) - abs(written)) <= _CONTRADICTS * abs(written):
        return
    names = [next(n for n, c in trace.channels.items() if c is used) for used in (shear, recorded)]
    raise InputError(
        f"measure.force must agree with the recorded friction, got {made:.4g} for the median of "
        f"F/W with '{names[0]}' and {written:.4g} for that of '{names[1]}'; choose one, like "
        f"columns={{'F': '{names[0]}'}} or columns={{'friction': '{names[1]}'}}, or correct the "
        "unit of the force or the load"
    )


def _friction(trace: Trace) -> Channel | None:
    try:
        return trace.channel("friction")
    except InputError:
        return None


def compressive(load: Array, shear: Array) -> tuple[Array, Array, list[Finding]]:
    """Load and shear with the load positive in compression.

    A negative mean load is a convention of the recorder: contacts bear no tension. A shear that is
    negative as well follows the same convention, and is turned with it.

    Parameters
    ----------
    load, shear : array, (n,)
        As recorded.

    Returns
    -------
    (array, array, list of Finding)
        And what was turned, a warning if it is one of the two.
    """
    if not _mean(load) < 0:
        return load, shear, []
    if _mean(shear) < 0:
        said = (
            "Load and shear are negative on average, as where compression counts as negative; both "
            "were read with the other sign."
        )
        return -load, -shear, [Finding("sign", "note", 2.0, "", said)]
    said = (
        "The load is negative on average and the shear is not; the load was read with the other "
        "sign, as contacts bear compression. If its zero is off, correct that instead."
    )
    return -load, shear, [Finding("sign", "warning", 1.0, "", said)]


def _mean(values: Array) -> float:
    finite = values[np.isfinite(values)]
    with np.errstate(over="ignore"):
        return float(finite.mean()) if finite.size else 0.0
