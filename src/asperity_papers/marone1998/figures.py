"""The figures that the paper's equations give, with the readings of the printed ones."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np
import pandas as pd

from asperity import InputError, Slider, materials, transient
from asperity.ledger import FigureNumbers, PaperFigure, figure_words
from asperity.loads import Programme, Slide
from asperity.materials import Material
from asperity_papers.marone1998.checks.summaries import afterslip_relation
from asperity_papers.marone1998.laboratory import AGEING, DECADE, LAWS, Laboratory, scans

#: Friction of a law is drawn this much above the next one.
OFFSET = 0.04
_PER_STRETCH = 400


def figure_2(laboratory: Laboratory) -> FigureNumbers:
    """Velocity steps up and down, integrated in time."""
    p, rows, peaks = laboratory.numbers, [], {}
    slow, fast = laboratory.pair("V_2")
    for n, (name, letter) in enumerate(LAWS.items()):
        slider = Slider(laboratory.illustration(name), spring=p.k_2, load=1.0)
        lengths, V = np.array([2.0, 7.0, 6.1]), np.array([slow, fast, slow])
        spans = lengths * p.D0_2 / V
        steps = (Slide(float(s), velocity=float(v)) for s, v in zip(spans, V, strict=True))
        programme = Programme(*steps, load=1.0, velocity=slow)
        ends = np.concatenate([[0.0], np.cumsum(spans)])
        way = np.concatenate([[0.0], np.cumsum(lengths)])
        # Dense just after each step, evenly spaced beyond.
        share = np.unique(
            np.concatenate([np.linspace(0, 1, _PER_STRETCH), np.geomspace(1e-4, 1, _PER_STRETCH)])
        )
        time = np.unique(np.concatenate([a + share * s for a, s in zip(ends, spans, strict=False)]))
        run = transient(slider, programme, sampling=time)
        if run.stopped is not None:
            rule, got = "reach the end of the figure", run.stopped.partition(":")[0]
            raise InputError(f"the motion of {name}", rule, got, "stiffen the spring")
        friction = run.force - run.force[0]
        load = np.interp(run.time, ends, way) - 2
        peaks[f"peak {letter}"] = float(friction.max())
        shift = OFFSET * (len(LAWS) - 1 - n)
        rows.append(pd.DataFrame({"curve": letter, "load": load, "friction": friction + shift}))
    quoted = {"a": p.A_2 * DECADE, "b": p.B_2 * DECADE, "offset": OFFSET}
    return FigureNumbers("figure-02", pd.concat(rows, ignore_index=True), peaks, quoted)


#: Springs of Figure 3, and their symbols in the names of its curves.
_SPRINGS = {"soft": "k_n", "stiff": "k_s"}


def figure_3(laboratory: Laboratory) -> FigureNumbers:
    """Healing against hold time, three laws at two springs, and the points."""
    time = np.geomspace(2, 1e5, 48)
    springs = {"soft": laboratory.soft, "stiff": laboratory.stiff}
    rows = [
        pd.DataFrame(
            {
                "curve": f"{letter}, {_SPRINGS[spring]}",
                "hold_time": time,
                "healing": laboratory.healing(name, *springs[spring], time),
            }
        )
        for name, letter in LAWS.items()
        for spring in _SPRINGS
    ]
    equal = laboratory.healing(AGEING, laboratory.stiff[0], laboratory.soft[1], time)
    rows.append(
        pd.DataFrame({"curve": "D, k_s, equal velocity", "hold_time": time, "healing": equal})
    )
    points = []
    for spring, (k, V) in springs.items():
        at, read = np.array(scans()["figure_3"][spring]).T
        points.append(
            pd.DataFrame(
                {
                    "series": spring,
                    "hold_time": at,
                    "healing": read,
                    "healing_uncertainty": scans()["figure_3"]["error"] / 2,
                    "ageing": laboratory.healing(AGEING, k, V, at),
                    "ageing_equal": laboratory.healing(AGEING, k, laboratory.soft[1], at),
                }
            )
        )
    table = pd.concat(points, ignore_index=True)
    stiff = table[table["series"] == "stiff"]
    scalars = {
        f"rms {name}": float(np.sqrt(np.mean((stiff["healing"] - stiff[column]) ** 2)))
        for name, column in (("actual", "ageing"), ("equal", "ageing_equal"))
    }
    data = pd.concat(rows, ignore_index=True)
    return FigureNumbers("figure-03", data, scalars, points=table)


def figure_5(laboratory: Laboratory) -> FigureNumbers:
    """Static friction against 1/hold time and dynamic friction against velocity, in one plot."""
    p, over = laboratory.numbers, np.geomspace(1e-4, 1e4, 49)
    static = p.mu0 - p.B_5 * np.log(over)
    dynamic = np.asarray(laboratory.gouge().mu_ss(p.V0 * over))
    read = p.mu0 + scans()["figure_5"]["velocity_slope"] * np.log10(over)
    data = pd.concat(
        [
            pd.DataFrame({"curve": name, "over": over, "friction": values})
            for name, values in (("static", static), ("dynamic", dynamic), ("read", read))
        ],
        ignore_index=True,
    )
    slopes = {"static slope": -p.B_5 * DECADE, "dynamic slope": -p.B_less_A_5 * DECADE}
    return FigureNumbers("figure-05", data, slopes)


def figure_16(laboratory: Laboratory) -> FigureNumbers:
    """Slip after an earthquake: the printed relation through the readings of the curve."""
    fit, scan = afterslip_relation(laboratory), scans()["figure_16b"]
    days, slip = np.array(scan["slip"]).T
    time = np.concatenate([[0.0], np.geomspace(0.05, 365, 100)])

    def relation(t: np.ndarray) -> np.ndarray:
        return np.asarray(slip[0] + fit["alpha"] * np.log1p(fit["rate"] * t))

    data = pd.DataFrame({"curve": "relation", "days": time, "slip": relation(time)})
    points = pd.DataFrame(
        {
            "series": "read",
            "days": days,
            "slip": slip,
            "slip_uncertainty": scan["pixel"],
            "relation": relation(days),
        }
    )
    scalars = {name: fit[name] for name in ("alpha", "beta", "rate", "worst")}
    return FigureNumbers("figure-16", data, scalars, points=points)


NUMBERS: Mapping[str, Callable[[Laboratory], FigureNumbers]] = {
    "figure-02": figure_2,
    "figure-03": figure_3,
    "figure-05": figure_5,
    "figure-16": figure_16,
}


def _figure(name: str) -> PaperFigure:
    numbers = NUMBERS[name](Laboratory(materials.load("marone1998")))
    words = figure_words(__package__)
    paper = "Marone (1998), " + words.figures[name].place
    tables = {name: (numbers.data, (paper, "computed from the numbers that are printed with it"))}
    if numbers.points is not None:
        tables[f"{name}-points"] = (numbers.points, (paper, "readings of the figure"))
    return words.figure(numbers, tables)


FIGURES = tuple(partial(_figure, name) for name in NUMBERS)


def moved_lines(name: str, numbers: Material) -> list[dict[str, object]]:
    """The lines of a figure with other numbers, for the browser page."""
    data = NUMBERS[name](Laboratory(numbers)).data
    return [
        {"name": str(curve), "values": {c: rows[c].to_numpy() for c in rows if c != "curve"}}
        for curve, rows in data.groupby("curve", sort=False)
    ]
