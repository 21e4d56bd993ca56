"""`Trace`: a measured or simulated recording, with time and channels in SI and its findings."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from asperity.arrays import Float
from asperity.errors import Argument, InputError, InputTypeError, listed, require, require_known
from asperity.parameters.arguments import of_type, shown, typed
from asperity.parameters.parameter import Displayed, SummaryLine, count_text, number_line
from asperity.recording.defects.check import CHECKED, defects
from asperity.recording.defects.sampling import even_rate
from asperity.recording.finding import Finding, with_cause
from asperity.recording.roles import find_channel
from asperity.units import KINDS, from_si, to_si

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, eq=False)
class Channel:
    """A recorded quantity.

    Attributes
    ----------
    values : ndarray, shape (n,)
        float64, in SI; as recorded where the unit is unknown. Read-only.
    kind : str or None
        Key of `asperity.units.KINDS`; None where the unit is unknown.
    unit : str
        SI unit of `values`; empty for a pure number and for an unknown unit.
    recorded_name, recorded_unit : str
        As in the file; empty without one.
    """

    values: Float
    kind: str | None = None
    unit: str = ""
    recorded_name: str = ""
    recorded_unit: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", _column(self.values, "Channel.values"))
        if self.kind is not None:
            require_known(self.kind, KINDS, "Channel.kind", "be a kind of quantity")

    def to(self, unit: str) -> Float:
        """Values in another unit, such as ``"MPa"``; raises `InputError` if it does not fit."""
        if self.kind is None:
            got = f"'{self.recorded_unit}' for '{self.recorded_name}'"
            advice = f"name it when reading, like {Argument('units', self.recorded_name, 'N')}"
            raise InputError("Channel.unit", "be known to be converted", got, advice)
        return np.asarray(from_si(self.values, unit, self.kind))


@dataclass(frozen=True, eq=False)
class Trace(Displayed):
    """Channels over a common time axis, with findings and provenance.

    Attributes
    ----------
    time : ndarray, shape (n,)
        Seconds, float64, as recorded: neither sorted nor made even. Read-only.
    channels : mapping of str to Channel
        In the order of the file, under their recorded names; time is not among them.
    findings : tuple of Finding
        Findings of the reader and of `asperity.recording.check`.
    provenance : dict
        Origin of the trace: file, format and decisions of the reader; or the simulation.
    roles : mapping of str to str
        Channels chosen for a role, such as ``{"F": "Shear"}``; other roles go by name.
    """

    time: Float
    channels: Mapping[str, Channel]
    findings: tuple[Finding, ...] = ()
    provenance: dict[str, Any] = field(default_factory=dict)
    roles: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "time", _column(self.time, "Trace.time"))
        channels = of_type(self.channels, Mapping[str, Channel], "Trace.channels")
        object.__setattr__(self, "channels", MappingProxyType(dict(channels)))
        object.__setattr__(self, "findings", tuple(self.findings))
        for name, channel in self.channels.items():
            rule, advice = "be as long as time", "cut them to the same length"
            got = f"{channel.values.size} values of '{name}' for {self.time.size} times"
            require(channel.values.size == self.time.size, "Trace.channels", rule, got, advice)

    def __len__(self) -> int:
        return self.time.size

    def __repr__(self) -> str:
        units = {n: c.unit if c.kind else c.recorded_unit for n, c in self.channels.items()}
        names = listed((f"{n} ({unit})" if unit else n for n, unit in units.items()), most=12)
        return (
            f"<Trace: {len(self)} samples of {names}; {count_text(len(self.findings), 'finding')}>"
        )

    def summary(self) -> tuple[str, list[SummaryLine]]:
        """Times, channels with their units, and findings."""
        lines = [number_line("time", self.time, "s")]
        lines += [
            number_line(n, c.values, c.unit if c.kind else c.recorded_unit)
            for n, c in self.channels.items()
        ]
        lines += [SummaryLine("finding", str(finding)) for finding in self.findings]
        return f"Trace, {count_text(len(self), 'sample')}", lines

    @typed
    def channel(self, name: str) -> Channel:
        """Channel by its name, the heading it was recorded under, or a role.

        Roles are W, F, velocity, displacement and friction, and go by other names too, such as
        ``"load"`` and ``"shear force"``.

        Raises
        ------
        InputError
            If no channel, or more than one, can be meant; the message names them, and says what is
            wrong with the columns of the file.
        """
        kinds = {key: c.kind for key, c in self.channels.items()}
        headings = {key: c.recorded_name for key, c in self.channels.items()}
        try:
            return self.channels[find_channel(name, kinds, self.roles, headings)]
        except InputError as error:
            raise with_cause(error, self.findings) from None

    @typed
    def has(self, name: str) -> bool:
        """Whether `channel` finds a channel of this name, heading or role."""
        try:
            self.channel(name)
        except InputError:
            return False
        return True

    @typed
    def name_of(self, channel: Channel) -> str:
        """The name of one of the channels."""
        name = next((name for name, c in self.channels.items() if c is channel), "")
        require(name, "channel", "be one of the trace", "another", "take one of its channels")
        return name

    @property
    def sample_rate(self) -> float | None:
        """Samples per second, Hz; None where the sampling is uneven."""
        return even_rate(self.time)

    @typed
    def slice(self, start: float | str | None = None, end: float | str | None = None) -> Trace:
        """Samples with ``start <= time < end``, checked again.

        Parameters
        ----------
        start, end : float, str or None
            Seconds on the clock of the trace, or texts such as ``"10 s"``; None is no limit.

        Raises
        ------
        InputError
            If no sample lies between them.
        """
        inside = np.ones(len(self), dtype=bool)
        if start is not None:
            inside &= self.time >= to_si(start, "time", "slice.start")
        if end is not None:
            inside &= self.time < to_si(end, "time", "slice.end")
        if not inside.any():
            rule, got = "enclose samples", f"{start} to {end}"
            raise InputError("slice.start and slice.end", rule, got, f"{_extent(self.time)}")
        cut = {k: replace(c, values=c.values[inside]) for k, c in self.channels.items()}
        return checked(replace(self, time=self.time[inside], channels=cut))

    def to_dataset(self) -> xr.Dataset:
        """Labelled `xarray.Dataset` over ``time``: units, recorded names, findings, provenance."""
        import xarray as xr

        variables = {
            name: (
                "time",
                c.values,
                {
                    "units": c.unit if c.kind else c.recorded_unit,
                    "long_name": c.recorded_name or name,
                    "recorded_unit": c.recorded_unit,
                },
            )
            for name, c in self.channels.items()
        }
        return xr.Dataset(
            variables,
            coords={"time": ("time", self.time, {"units": "s", "long_name": "time"})},
            attrs={
                "findings": "\n".join(map(str, self.findings)),
                "provenance": json.dumps(self.provenance, default=str),
            },
        )


@typed
def check(trace: Trace) -> tuple[Finding, ...]:
    """Check a recording for defects that can make a measurement wrong.

    Parameters
    ----------
    trace : Trace
        Any recording; it is not changed.

    Returns
    -------
    tuple of Finding
        ``"backward time"``, ``"repeated time"``, ``"rounded time"``, ``"gap"``,
        ``"uneven sampling"``, ``"missing values"``, ``"infinite"``, ``"constant"``, ``"spike"`` and
        ``"saturation"``; at most one of each name for time and for each channel. Empty without a
        defect.

    Notes
    -----
    A gap is a step of time longer than 1.5 times the median of the 24 steps before it and of the
    24 steps after it, and outside the scatter of these steps. A change of the sampling rate is
    "uneven sampling" and no gap. Saturation is an excess of samples at exactly the largest or
    smallest value, or several such samples in a row, where no two samples are equal by chance or
    the signal falls from them more abruptly than a rounded smooth top. A spike of at most three
    samples differs from the samples on both sides by more than ten times the usual difference.
    """
    columns = {name: channel.values for name, channel in trace.channels.items()}
    return tuple(defects(trace.time, columns))


def checked(trace: Trace) -> Trace:
    """A recording with findings of `check` as it is now, and its other findings."""
    kept = tuple(f for f in trace.findings if f.name not in CHECKED)
    return replace(trace, findings=kept + check(trace))


def _column(values: Any, name: str) -> Float:
    """A read-only float64 view; the caller's array is unchanged."""
    try:
        column = np.asarray(values, dtype=np.float64).view()
    except (TypeError, ValueError):
        raise InputTypeError(name, "be numbers in SI", shown(values)) from None
    require(column.ndim == 1, name, "have one dimension", column.ndim, "give one array per channel")
    column.flags.writeable = False
    return column


def _extent(time: Float) -> str:
    if not np.isfinite(time).any():
        return "the trace has no finite time"
    return f"the trace runs from {np.nanmin(time):.10g} s to {np.nanmax(time):.10g} s"
