"""Figure 12: the leading Floquet multiplier against the amplitude; and the stability diagram.

The diagram, critical stiffness against amplitude and against frequency, is drawn for the
documentation.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

import asperity as asp
from asperity.figures import COLOURS
from asperity.ledger import FigureNumbers
from asperity_papers.bureau2000.curves import BORNE, FigureCurve, figure_numbers, solve_curves
from asperity_papers.bureau2000.machine import (
    EXT,
    LD,
    RR,
    SPEEDS,
    Float,
    Machine,
    steady_multiplier,
)

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: The secant iteration ends when no threshold moves by more than this; tests ask for 1e-6.
_TOLERANCE = 1e-9
_MOST_STEPS = 12


def variants(machine: Machine) -> dict[str, tuple[str, dict[str, float]]]:
    """The laws compared: name, law and the parameters that replace the paper's."""
    p = machine.numbers
    return {
        "RR": (RR, {}),
        f"LD {p.alpha:g}": (LD, {"alpha": p.alpha}),
        f"LD {p.alpha_low:g}": (LD, {"alpha": p.alpha_low}),
        "EXT": (EXT, {}),
    }


def log_multiplier(machine: Machine, variant: str, V: Float, epsilon: Float) -> Float:
    """Real part of the logarithm of the leading multiplier; NaN where not solved."""
    law, overrides = variants(machine)[variant]
    response = asp.periodic_response(
        machine.slider(law, **overrides), velocity=V, epsilon=epsilon,
        frequency=machine.numbers.frequency,
    )  # fmt: skip
    return np.where(response.converged, response.log_multipliers[..., 0].real, np.nan)


def thresholds(machine: Machine, variant: str, V: Float, bracket: tuple[Float, Float]) -> Float:
    """Amplitude eps_eff at which modulation makes sliding stable, for each velocity.

    Secant iteration on ln|m|, which is smooth and nearly quadratic in eps there.

    Parameters
    ----------
    machine : Machine
    variant : str
        A key of `variants`.
    V : array, shape (n,)
        Pulling velocities (m/s).
    bracket : (array, array), shape (n,)
        Amplitudes on either side.

    Returns
    -------
    array, shape (n,)
        NaN where the multiplier does not cross 1 between them.
    """

    def level(epsilon: Float) -> Float:
        return log_multiplier(machine, variant, V, epsilon)

    old, new = bracket
    at_old, at_new = level(old), level(new)
    for _ in range(_MOST_STEPS):
        # Once two iterates agree to the last digit there is no secant, and nothing left to do.
        flat = at_new == at_old
        step = np.where(flat, 0.0, at_new * (new - old) / np.where(flat, 1.0, at_new - at_old))
        old, at_old = new, at_new
        new = np.clip(new - step, bracket[0], bracket[1])
        if np.abs(new - old).max() < _TOLERANCE:
            break
        at_new = level(new)
    # At an end of the bracket the iterates agree as well, without a crossing.
    crossed = (np.abs(new - old) < _TOLERANCE) & (np.abs(at_old) < _TOLERANCE)
    return np.where(crossed, new, np.nan)


def floquet_figure(machine: Machine) -> FigureNumbers:
    """Stability against eps_eff, by law and velocity, with the thresholds."""
    V, rigid = np.array(machine.velocities), machine.slider(RR)
    eps, names = machine.borne_amplitudes(), variants(machine)
    data = solve_curves(
        machine,
        (
            FigureCurve(f"{variant}, {name}", law, speed, eps, overrides=overrides)
            for variant, (law, overrides) in names.items()
            for name, speed in zip(SPEEDS, V, strict=True)
        ),
    )
    read = figure_numbers(machine, "", data, {})
    scalars = {"K_over_Kc": machine.stiffness_ratio}
    for speed in V:
        steady = steady_multiplier(rigid, speed, machine.numbers.frequency)
        scalars[f"steady {speed:.0e}"] = float(steady)
    for variant in names:
        low, high = np.array([_bracket(read.curve(f"{variant}, {name}")) for name in SPEEDS]).T
        crossed = thresholds(machine, variant, V, (low, high))
        for name, value in zip(SPEEDS, crossed, strict=True):
            scalars[f"threshold {variant}, {name}"] = float(value)
    start = data.drop_duplicates("curve")
    starts = {
        f"start {curve}": float(value)
        for curve, value in zip(start["curve"], start["floquet_max"], strict=True)
    }
    return figure_numbers(machine, "figure-12", data, scalars, quoted=starts)


def _bracket(rows: pd.DataFrame) -> tuple[float, float]:
    """Neighbouring amplitudes between which the leading multiplier crosses 1."""
    unstable = (rows["floquet_max"] > 1).to_numpy()
    eps = rows[BORNE].to_numpy()
    (crossings,) = np.nonzero(unstable[:-1] & ~unstable[1:])
    if crossings.size == 0:
        return np.nan, np.nan
    return float(eps[crossings[0]]), float(eps[crossings[0] + 1])


# --- The stability diagram -----------------------------------------------------------------------


@dataclass(frozen=True)
class Case:
    """A model of the slider.

    Attributes
    ----------
    law : str
    inertia : bool
    """

    law: str
    inertia: bool = False

    @property
    def name(self) -> str:
        """What tables call it."""
        return f"{self.law}, inertia" if self.inertia else self.law


#: Rigid and elastic asperities, without and with the slider's mass.
CASES = (Case(RR), Case(EXT), Case(RR, inertia=True), Case(EXT, inertia=True))


def stabilisation_diagram(
    amplitudes: Float,
    frequencies: Float,
    *,
    cases: tuple[Case, ...] = CASES,
    levels: tuple[float, ...] = (0.05, 0.1, 0.2),
    velocity: float = 1e-6,
    scan: int = 24,
) -> pd.DataFrame:
    """Critical stiffness of the modulated slider, in two cuts.

    Parameters
    ----------
    amplitudes : array, shape (n,)
        Amplitudes on the contacts at the paper's 120 Hz, cut "amplitude", for all cases.
    frequencies : array, shape (m,)
        Frequencies (Hz) of cut "frequency", for the elasto-plastic law at all `levels`.
    cases : tuple of Case
    levels : tuple of float
        Amplitudes on the contacts.
    velocity : float
        Pulling velocity (m/s).
    scan : int
        See `asperity.stiffness_threshold`.

    Returns
    -------
    DataFrame
        Columns ``cut, case, epsilon, frequency, ratio, kind, mode_frequency, result``.
    """
    machine, rows = Machine(), []

    def add(cut: str, case: Case, epsilon: Float, frequency: Float) -> None:
        threshold = asp.stiffness_threshold(
            machine.slider(case.law), epsilon=epsilon, frequency=frequency, velocity=velocity,
            inertia=case.inertia, scan=scan,
        )  # fmt: skip
        eps, f = np.broadcast_arrays(epsilon, frequency)
        columns = {"cut": cut, "case": case.name, "epsilon": eps, "frequency": f}
        results = {n: getattr(threshold, n) for n in ("ratio", "kind", "mode_frequency", "result")}
        rows.append(pd.DataFrame(columns | results))

    for case in cases:
        add("amplitude", case, amplitudes, np.array(machine.numbers.frequency))
    for level in levels:
        add("frequency", Case(EXT), np.array(level), frequencies)
    return pd.concat(rows, ignore_index=True)


def resonance_map(
    frequencies: Any,
    amplitudes: Any,
    *,
    stiffness: float = 2.0,
    velocity: float = 1e-6,
    inertia: bool = True,
) -> xarray.Dataset:
    """Response over frequency and amplitude, of a slider that is stable without modulation.

    With inertia, elastic asperities resonate at sqrt(W0/(lambda M))/2 pi = 400 Hz; a modulation at
    about twice that frequency excites them whatever the spring.

    Parameters
    ----------
    frequencies, amplitudes : axes of `asperity.map`
        Of ``frequency`` and ``epsilon``.
    stiffness : float
        K over K_c.
    velocity : float
        Pulling velocity (m/s).
    inertia : bool
        Whether the mass counts.
    """
    p = Machine().numbers
    Kc = (p.B - p.A) * p.W0 / p.D0
    numbers = {name: p[name].si for name in ("mu0", "A", "B", "D0", "V0", "lambda", "W0", "M")}
    numbers |= {"K": stiffness * Kc, "V": velocity, "inertia": float(inertia)}
    return asp.map(EXT, numbers, x=frequencies, y=amplitudes)


_RIGID, _ELASTIC = COLOURS["rice-ruina"], COLOURS["elasto-plastic"]
_CASES: dict[str, tuple[str, dict[str, Any]]] = {
    "rice-ruina": ("rigid asperities", {"color": _RIGID}),
    "elasto-plastic": ("elastic asperities", {"color": _ELASTIC}),
    "rice-ruina, inertia": ("rigid, inertia", {"color": _RIGID, "linestyle": "dashed"}),
    "elasto-plastic, inertia": ("elastic, inertia", {"color": _ELASTIC, "linestyle": "dashed"}),
}
_RATIO = r"critical stiffness $K^*/K_c$"


def draw_stabilisation(
    cuts: pd.DataFrame, stick_slip_frequency: float, resonance: xarray.Dataset
) -> Figure:
    """Critical stiffness against amplitude and frequency, and the resonance of the asperities.

    Parameters
    ----------
    cuts : DataFrame
        From `stabilisation_diagram`.
    stick_slip_frequency : float
        f_c (Hz).
    resonance : Dataset
        From `resonance_map`.
    """
    from asperity.figures import draw_plane, new_figure

    figure = new_figure(5.0, 9.6)
    amplitude, frequency, plane = figure.subplots(3, 1)
    _draw_amplitudes(amplitude, cuts[cuts["cut"] == "amplitude"])
    _draw_frequencies(frequency, cuts[cuts["cut"] == "frequency"], stick_slip_frequency)
    mesh = draw_plane(plane, resonance, "log_multiplier")
    bar = figure.colorbar(mesh, ax=plane, pad=0.02, aspect=20, extend="both")
    bar.set_label(r"$\ln|m|$")
    bar.ax.minorticks_off()
    plane.set_ylabel(r"amplitude $\epsilon_{\mathrm{eff}}$")
    for axis, letter in zip((amplitude, frequency, plane), "abc", strict=True):
        axis.set_title(f"({letter})", loc="left", fontsize=11)
    amplitude.set_title("120 Hz, far above stick-slip", fontsize=11)
    frequency.set_title("elastic asperities, no inertia", fontsize=11)
    plane.set_title(r"elastic asperities with inertia, $K=2K_c$", fontsize=11)
    return figure


def _draw_amplitudes(axis: Axes, rows: pd.DataFrame) -> None:
    for case, curve in rows.groupby("case", sort=False):
        label, line = _CASES[str(case)]
        axis.plot(curve["epsilon"], curve["ratio"], label=label, **line)
    axis.axhline(1, color=COLOURS["grey"], linewidth=0.9)
    axis.set(
        xlabel=r"amplitude $\epsilon_{\mathrm{eff}}$",
        ylabel=_RATIO,
        xlim=(0, rows["epsilon"].max()),
        ylim=(0.55, 1.1),
    )
    axis.legend(loc="lower left")
    axis.text(
        0.97,
        0.97,
        "stable above the curves",
        transform=axis.transAxes,
        ha="right",
        va="top",
        color=COLOURS["grey"],
    )


def _draw_frequencies(axis: Axes, rows: pd.DataFrame, f_c: float) -> None:
    from cmcrameri import cm
    from matplotlib.lines import Line2D

    levels = sorted(rows["epsilon"].unique())
    shades = cm.lipari_r(np.linspace(0.25, 0.85, len(levels)))
    for level, shade in zip(levels, shades, strict=True):
        curve = rows[rows["epsilon"] == level].sort_values("frequency")
        x, y = (curve["frequency"] / f_c).to_numpy(), curve["ratio"].to_numpy()
        kinds = curve["kind"].to_numpy(dtype=str)
        for k in range(len(x) - 1):
            # A stretch is drawn as the kind at both its ends, a change of kind as a thin step.
            same = kinds[k] == kinds[k + 1]
            axis.plot(x[k : k + 2], y[k : k + 2], color=shade, alpha=1.0 if same else 0.6,
                      linewidth=_width(kinds[k] if same else ""))  # fmt: skip
    handles = [
        Line2D([], [], color=shade, label=rf"$\epsilon_{{\mathrm{{eff}}}}={level:g}$")
        for level, shade in zip(levels, shades, strict=True)
    ]
    handles += [
        Line2D([], [], color="#111111", linewidth=_width(kind), label=name)
        for kind, name in (("period doubling", "period doubling"),
                           ("Neimark-Sacker", "Neimark–Sacker"))
    ]  # fmt: skip
    axis.axhline(1, color=COLOURS["grey"], linewidth=0.9, zorder=0)
    axis.axvline(2, color=COLOURS["grey"], linewidth=0.9, linestyle="dotted", zorder=0)
    axis.set(
        xscale="log",
        xlabel=r"frequency $f/f_c$",
        ylabel=_RATIO,
        xlim=(rows["frequency"].min() / f_c, rows["frequency"].max() / f_c),
        ylim=(0.6, 2.4),
    )
    axis.legend(handles=handles, loc="upper right")


def _width(kind: str) -> float:
    """Period doubling is the broad line: dashes would be shorter than the stretches."""
    return 2.8 if kind == "period doubling" else 1.3
