"""Conversions that need a number from outside the recording; only the user calls them.

Rock mechanics records stresses over an area, coefficients of friction, and stiffness as change of
friction per length of slip. The models here are in forces: F = mu W, W = sigma_n A, K = k W.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

from asperity.errors import InputError, require
from asperity.parameters.arguments import number
from asperity.recording.trace import Channel, Trace
from asperity.units import to_si

_PER_LENGTH = re.compile(r"\s*([-+.\deE]+)\s*(?:friction|mu|1)?\s*/\s*(.+?)\s*")


def stress_to_force(
    trace: Trace, area: float | str, channels: Sequence[str] | None = None
) -> Trace:
    """Convert stresses to forces by the nominal contact area.

    Parameters
    ----------
    trace : Trace
        Any recording.
    area : float or str
        Nominal contact area (m^2, or a text such as ``"25 cm^2"``), the same for all channels.
    channels : sequence of str, optional
        Names or roles; all pressures by default.

    Returns
    -------
    Trace
        With these channels in newton under the same names, the area in its provenance.

    Raises
    ------
    InputError
        If the area is not positive, or a channel is no pressure.
    """
    size = number(area, "stress_to_force.area", "area", "positive")
    wanted = [k for k, c in trace.channels.items() if c.kind == "pressure"]
    if channels is not None:
        wanted = [_pressure(trace, name) for name in channels]
    advice = "leave it out, or give the channel its unit"
    require(wanted, "stress_to_force.area", "go with a stress", "a recording without", advice)
    converted = {
        name: replace(c, values=c.values * size, kind="force", unit="N") if name in wanted else c
        for name, c in trace.channels.items()
    }
    note = {"area (m^2)": size, "stresses made forces": wanted}
    return replace(trace, channels=converted, provenance={**trace.provenance, **note})


def _pressure(trace: Trace, name: str) -> str:
    channel = trace.channel(name)
    rule, got = "be pressures", f"'{name}' in '{channel.unit}'"
    require(channel.kind == "pressure", "stress_to_force.channels", rule, got, "leave it out")
    return trace.name_of(channel)


def friction_to_force(trace: Trace, name: str = "F") -> Trace:
    """Shear force (or stress) F = mu W from a recorded coefficient of friction.

    Parameters
    ----------
    trace : Trace
        With the roles ``friction`` and ``W``.
    name : str
        The new channel, in the unit of W.

    Raises
    ------
    InputError
        If one of the two is missing or ambiguous, or `name` is taken.
    """
    friction, load = trace.channel("friction"), trace.channel("W")
    got = f"'{name}', which the trace has"
    require(name not in trace.channels, "friction_to_force.name", "be free", got, "give another")
    made = Channel(friction.values * load.values, load.kind, load.unit, name)
    note = {"shear from friction": f"{friction.recorded_name} x {load.recorded_name}"}
    return replace(
        trace,
        channels={**trace.channels, name: made},
        provenance={**trace.provenance, **note},
    )


def stiffness_from_friction(stiffness: float | str, load: float | str) -> float:
    """Convert a stiffness in friction per length to force per length, K = k W.

    Parameters
    ----------
    stiffness : float or str
        Friction per metre, or a text such as ``"1e-3 /um"`` or ``"0.5 friction/mm"``.
    load : float or str
        Mean normal load W, N; or normal stress as a text such as ``"20 MPa"``.

    Returns
    -------
    float
        N/m; Pa/m if the load is a stress.

    Raises
    ------
    InputError
        If one of the two is not understood or not positive.
    """
    per_length = stiffness
    if isinstance(stiffness, str):
        match = _PER_LENGTH.fullmatch(stiffness)
        if match is None:
            rule, advice = "be a friction per length", "write it like '1e-3 /um'"
            raise InputError("stiffness_from_friction.stiffness", rule, f"'{stiffness}'", advice)
        per_length = to_si(match[1], "dimensionless", "stiffness_from_friction.stiffness")
        per_length /= to_si(f"1 {match[2]}", "length", "stiffness_from_friction.stiffness")
    kind = (
        "pressure" if isinstance(load, str) and load.rstrip().endswith(("Pa", "bar")) else "force"
    )
    weight = to_si(load, kind, "stiffness_from_friction.load")
    product = float(per_length) * weight
    holds, rule = float(per_length) > 0 and weight > 0, "have a positive stiffness and load"
    require(holds, "stiffness_from_friction", rule, f"{stiffness} and {load}", "check the signs")
    return product
