"""A figure of our own: the resonance of the slider on its asperities.

The mass and the asperities' shear stiffness W0/lambda resonate at 400 Hz, between the third and
the fourth harmonic of 120 Hz and at the second of 200 Hz. The paper's models leave the mass out.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from asperity.papers.bureau2000.numbers.curves import FigureCurve, solve_curves
from asperity.papers.bureau2000.numbers.figure_numbers import FigureNumbers, stated
from asperity.papers.bureau2000.numbers.machine import (
    EXT,
    Float,
    mu_ss,
    paper,
    velocities,
)

#: Quality factor of the damped resonance. The paper gives no damping; ten is our choice.
QUALITY = 10.0
#: Ranges of the two cuts: beyond what is published of lambda (um), and around 120 and 200 Hz.
_LENGTHS, _FREQUENCIES, _POINTS = (0.4, 1.0), (80.0, 800.0), 100

#: Values of lambda (um) that the caption names: the ends and the middle of its measured range, and
#: the fitted one.
_MARKED = (0.47, 0.62, 0.70, 0.77)

QUASI_STATIC, UNDAMPED, DAMPED = "no inertia", "inertia", "inertia, damped"
LENGTH, FREQUENCY = "lambda", "frequency"


def contact_resonance() -> float:
    """Frequency (Hz) at which the mass oscillates on the asperities' shear stiffness."""
    p = paper()
    return float(np.sqrt(p.W0 / (p.lambda_ * p.M)) / (2 * np.pi))


def contact_damping(quality: float = QUALITY) -> float:
    """Damper between slider and track (N s/m) that gives the resonance a quality factor.

    It is parallel to the asperities and the joint: sqrt(M W0/lambda)/quality. What it adds to the
    mean force, its value times V, is below 0.001 W0 at 10 um/s.
    """
    p = paper()
    return float(np.sqrt(p.M * p.W0 / p.lambda_) / quality)


def cases() -> Mapping[str, tuple[bool, float]]:
    """Name of a case to whether the mass counts, and the damping (N s/m)."""
    return {
        QUASI_STATIC: (False, 0.0),
        UNDAMPED: (True, 0.0),
        DAMPED: (True, contact_damping()),
    }


def resonance_curves(V: float, epsilon: float) -> list[FigureCurve]:
    """Both cuts for all `cases`; names are "lambda, inertia" and the like.

    Parameters
    ----------
    V, epsilon : float
        Pulling velocity (m/s) and amplitude on the contacts, the same at all points.
    """
    lengths: Float = 1e-6 * np.linspace(*_LENGTHS, _POINTS)
    # The paper's own frequencies among them: the peaks are narrower than two points.
    own = [paper().frequency, paper().frequency_vacuum]
    frequencies: Float = np.sort([*np.geomspace(*_FREQUENCIES, _POINTS - len(own)), *own])
    over_length = FigureCurve(LENGTH, EXT, V, epsilon, overrides={"lambda_": lengths})
    over_frequency = FigureCurve(FREQUENCY, EXT, V, epsilon, frequency=frequencies)
    return [
        replace(cut, name=f"{cut.name}, {name}", inertia=inertia, damping=damping)
        for name, (inertia, damping) in cases().items()
        for cut in (over_length, over_frequency)
    ]


def resonance_figure() -> FigureNumbers:
    """Drop, mu1 and mu2 against lambda at 120 Hz and against frequency at 0.7 um."""
    p, V, epsilon = paper(), velocities()[1], stated().epsilon_eff
    found = FigureNumbers(
        "figure-15",
        "A figure of our own",
        "The slider resonates on its asperities",
        solve_curves(resonance_curves(V, epsilon)),
    )
    still, moved = (f"{FREQUENCY}, {name}" for name in (QUASI_STATIC, UNDAMPED))
    drop = {
        name: -at_frequency(found, name, "delta_mu", p.frequency_vacuum) for name in (still, moved)
    }
    second = at_frequency(found, moved, "mu2", p.frequency_vacuum) / at_frequency(
        found, still, "mu2", p.frequency_vacuum
    )
    changes = {
        f"{column} at lambda {length:g} um": _change(found, column, 1e-6 * length)
        for column in ("delta_mu", "mu2")
        for length in _MARKED
    }
    percent = {name: 100 * value / mu_ss(V) for name, value in drop.items()}
    by = [100 * value for value in changes.values()]
    return found.described(
        scalars={
            "contact_resonance": contact_resonance(),
            "contact_damping": contact_damping(),
            "relative_drop_200Hz": percent[still] / 100,
            "relative_drop_200Hz_inertia": percent[moved] / 100,
            "mu2_ratio_200Hz": second,
            **{f"change of {name}": value for name, value in changes.items()},
        },
        caption=(
            f"Elasto-plastic law at 10 µm/s and ε_eff = {epsilon:g}; left against λ at 120 Hz, "
            "right against the frequency at λ = 0.7 µm. Green: without inertia, as in the paper. "
            "Dark: with the mass of the slider, which on the asperities' stiffness W₀/λ resonates "
            f"at {contact_resonance():.0f} Hz; orange, dashed: the same with a damper between "
            f"slider and track that gives this resonance a quality factor of {QUALITY:g} (our "
            "choice: the paper gives none). Ochre band: λ = 0.62 ± 0.15 µm; ochre lines: 0.7 µm, "
            "120 and 200 Hz. How much inertia matters depends on λ: at 0.47, 0.62, 0.70 and "
            f"0.77 µm the drop changes by {by[0]:+.0f}, {by[1]:+.0f}, {by[2]:+.0f} and "
            f"{by[3]:+.0f} % and μ₂ by "
            f"{by[4]:+.0f}, {by[5]:+.0f}, {by[6]:+.0f} and {by[7]:+.0f} %. "
            f"At 200 Hz, the frequency of Figure 5, the drop goes from {percent[still]:.1f} to "
            f"{percent[moved]:.1f} % and μ₂ rises {second:.0f}-fold."
        ),
        alt=(
            "Three rows, the drop of the mean, the first and the second harmonic, against the "
            "elastic length and against frequency. Without inertia the curves are smooth; with "
            "inertia they have peaks where a harmonic of the modulation meets the resonance of "
            f"the slider on its asperities at {contact_resonance():.0f} Hz, the largest for a "
            "modulation near 200 and near 400 Hz."
        ),
    )


def at_frequency(found: FigureNumbers, curve: str, column: str, frequency: float) -> float:
    """A quantity on a cut over the frequency, linear in ln f between the points."""
    rows = found.curve(curve)
    return float(np.interp(np.log(frequency), np.log(rows["frequency"]), rows[column]))


def _change(found: FigureNumbers, column: str, length: float) -> float:
    """Relative change of a quantity by inertia at one lambda (m)."""
    still, moved = (found.curve(f"{LENGTH}, {name}") for name in (QUASI_STATIC, UNDAMPED))
    values = [float(np.interp(length, rows["lambda"], rows[column])) for rows in (still, moved)]
    return values[1] / values[0] - 1
