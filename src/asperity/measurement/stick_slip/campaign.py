"""A campaign of stick-slip: a series of recordings of one machine, healing and threshold."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from asperity.arrays import Float
from asperity.errors import symbol
from asperity.measurement.stick_slip.healing import StickSlipHealing, of_campaign
from asperity.measurement.stick_slip.regimes import REPEATED
from asperity.parameters.parameter import Drawn, SummaryLine
from asperity.units import format_si

if TYPE_CHECKING:
    from asperity.experiment import StickSlip

#: Shares by which stiffnesses and loads of one machine differ at most.
_SAME = 0.05


@dataclass(frozen=True)
class StickSlipSeries:
    """Recordings at one stiffness and one load.

    Attributes
    ----------
    K, W0 : float
        Medians (N/m, N); NaN where they are not known.
    rows : tuple of mapping
        Rows of the campaign's table, in the order of V.
    """

    K: float
    W0: float
    rows: tuple[Mapping[str, Any], ...]

    @property
    def name(self) -> str:
        """The machine in words."""
        known = (("K", self.K, "stiffness"), ("W0", self.W0, "force"))
        parts = [
            f"{symbol(name)} = {format_si(v, kind, 4)}" for name, v, kind in known if np.isfinite(v)
        ]
        return ", ".join(parts) or f"{symbol('K')} and {symbol('W0')} not known"

    def column(self, name: str) -> Float:
        """Numbers of the rows; NaN where they are not known."""
        return np.array([row.get(name) for row in self.rows], float)

    def mass(self, default: float) -> float:
        """Median M of the rows (kg); the default where it is not known."""
        known = self.column("M")
        known = known[np.isfinite(known)]
        return float(np.median(known)) if known.size else default

    def healing(self) -> StickSlipHealing:
        """Growth of the drop with the stick time that the velocity sets.

        Recordings that are not stick-slip of one regime are left out, and those with a bad check
        but that of the sampling: slips between two samples have their drops.
        """
        doubts = [row["checks"].replace("sampling: bad", "") for row in self.rows]
        clear = np.array(
            [
                r["regime"] in REPEATED and "bad" not in d
                for r, d in zip(self.rows, doubts, strict=True)
            ]
        )
        numbers = ("stick_duration", "drop", "drop_uncertainty")
        stick, drop, uncertainty = (self.column(name) for name in numbers)
        kept = clear & (uncertainty > 0) & (stick > 0)
        return of_campaign(stick[kept], drop[kept], uncertainty[kept])

    def b_minus_a(self, healing: StickSlipHealing) -> tuple[tuple[float, float], str]:
        """95 % interval of B - A, and the condition on which it holds, or why it does not.

        The factors between growth and B - A are those of B > 1.3 A, of M V^2 < A D0 W0, at the
        fastest recording, and of K < (B - A) W0/(2 D0). The last two give
        A > 2 K M V^2/((B - A) W0^2), which is no friction where it exceeds the peak force. A slip
        that damping stops without an overshoot drops by half; Ruina's slip law has factors down
        to 1.
        """
        none = float("nan"), float("nan")
        if healing.reason:
            return none, healing.reason
        condition = (
            f"of the ageing law, where it alone damps slips ({symbol('B - A')} is up to twice as "
            f"large where the machine stops them), {symbol('B')} is above 1.3 {symbol('A')}, "
            f"{symbol('K')} is below half of the critical stiffness and "
        )
        energy = self.mass(np.nan) * float(np.nanmax(self.column("V"), initial=-np.inf)) ** 2
        if not np.isfinite(energy * self.W0):
            return healing.b_minus_a, f"{condition}{symbol('M V^2 < A D0 W0')}: M is not known"
        least = 2 * self.K * energy / (healing.b_minus_a[1] * self.W0**2)
        if least > np.nanmax(self.column("force_before"), initial=0.0):
            slow = symbol("M V^2 < A D0 W0")
            return none, f"inertia counts: {slow} would need {symbol('A')} above {least:.2g}"
        length = f"{energy / self.W0:.2g} m ({symbol('M V^2/W0')})"
        return healing.b_minus_a, f"{condition}{symbol('A D0')} above {length}"


@dataclass(frozen=True, eq=False, repr=False)
class StickSlipCampaign(Drawn):
    """Recordings by their machine.

    Attributes
    ----------
    series : tuple of StickSlipSeries
        In order of rising stiffness.
    model : StickSlip or None
        Cycles of a law to draw with them: a row for each of `modelled`, over the velocity.
    modelled : tuple of int
        Series that the model has.
    """

    series: tuple[StickSlipSeries, ...]
    model: StickSlip | None = None
    modelled: tuple[int, ...] = ()

    _drawn_by = "asperity.figures.stick_slip:draw_campaign"

    @classmethod
    def of(cls, table: Iterable[Mapping[str, Any]]) -> StickSlipCampaign:
        """The campaign of a table; rows without a regime are left out."""
        rows = [row for row in table if row.get("regime")]
        machine = np.array([[row.get(name) for name in ("K", "W0")] for row in rows], float)
        machine = machine.reshape(-1, 2)
        groups: list[list[int]] = []
        for n in np.lexsort(machine.T[::-1]):
            for group in groups:
                if np.allclose(machine[n], machine[group[0]], rtol=_SAME, atol=0, equal_nan=True):
                    group.append(int(n))
                    break
            else:
                groups.append([int(n)])
        series = []
        for group in groups:
            K, W0 = np.median(machine[group], axis=0)
            ordered = sorted((rows[n] for n in group), key=lambda row: row.get("V") or 0.0)
            series.append(StickSlipSeries(float(K), float(W0), tuple(ordered)))
        return cls(tuple(series))

    def healing_record(self) -> list[dict[str, Any]]:
        """Healing of each series, with K and W0, as numbers and texts."""
        records = []
        for one in self.series:
            healing = one.healing()
            record = {"K": one.K, "W0": one.W0, **asdict(healing)}
            interval, condition = one.b_minus_a(healing)
            record |= {"b_minus_a_interval_95": interval, "b_minus_a_condition": condition}
            records.append(record)
        return records

    def summary(self) -> tuple[str, list[SummaryLine]]:
        """Healing of each series."""
        count = sum(len(s.rows) for s in self.series)
        lines = []
        for one in self.series:
            healing = one.healing()
            low, high = healing.interval_95
            value = f"{healing.drop_per_efold:.2g} +- {healing.drop_uncertainty:.1g}"
            value += f" (95 %: {low:.2g} to {high:.2g}), {healing.recordings} recordings"
            if healing.reason:
                value = f"cannot tell: {healing.reason}"
            lines.append(SummaryLine(one.name, value, "drop per e-fold of stick time"))
            if not healing.reason:
                (low, high), condition = one.b_minus_a(healing)
                value = f"{low:.2g} to {high:.2g} (95 %), {condition}"
                value = f"cannot tell: {condition}" if np.isnan(low) else value
                lines.append(SummaryLine(symbol("B - A"), value))
        return f"StickSlipCampaign, {count} recordings", lines
