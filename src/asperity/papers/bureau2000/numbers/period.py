"""One period of the motion at the central point, with both age laws.

At 0.5 of modulation, 1 um/s and 120 Hz the asperities' elasticity moves the slider to and fro much
faster than it is pulled. The paper's age law is printed with that velocity; the variant has the
plastic velocity of the joint in its place.
"""

from __future__ import annotations

import pandas as pd

from asperity.orbit import over_a_period, periodic_response
from asperity.papers.bureau2000.numbers.figure_numbers import FigureNumbers, stated
from asperity.papers.bureau2000.numbers.machine import (
    EXT,
    EXT_AGE,
    mu_ss,
    paper,
    slider,
    velocities,
)

#: Instants of the period: pulses of slip are a third of a radian wide and less.
_SAMPLES = 512

#: Columns of the table, with their units and meaning.
PERIOD_COLUMNS = {
    "curve": "name of the curve",
    "law": "friction law",
    "inertia": "whether the mass of the slider counts",
    "phase": "1; time over the period, 0 at the largest load",
    "load": "1; W/W0",
    "force": "1; F/W0, the force of the pulling spring",
    "velocity": "1; velocity of the slider over the pulling velocity",
    "plastic_velocity": "1; plastic velocity of the joint over the pulling velocity",
    "age": "1; V Phi/D0",
}

#: Curves: name to law, and whether the mass counts.
CASES = {
    "age on the slider's velocity": (EXT, False),
    "age on the plastic velocity": (EXT_AGE, False),
    "with inertia": (EXT, True),
}


def one_period(law: str, V: float, epsilon: float, *, inertia: bool = False) -> pd.DataFrame:
    """Force, velocities and age over one period of the periodic orbit.

    Parameters
    ----------
    law : str
        An elasto-plastic law.
    V, epsilon : float
        Pulling velocity (m/s) and amplitude on the contacts.
    inertia : bool

    Returns
    -------
    DataFrame
        With the columns of `PERIOD_COLUMNS` but "curve".
    """
    response = periodic_response(
        slider(law), velocity=V, epsilon=epsilon, frequency=paper().frequency, inertia=inertia,
        waveform=_SAMPLES,
    )  # fmt: skip
    return pd.DataFrame({"law": law, "inertia": inertia, **over_a_period(response)._asdict()})


def period_figure() -> FigureNumbers:
    """One period at 0.5 of modulation and 1 um/s, with both age laws and with inertia."""
    V, epsilon = velocities()[0], stated().epsilon_eff
    tables = [
        one_period(law, V, epsilon, inertia=inertia).assign(curve=name)
        for name, (law, inertia) in CASES.items()
    ]
    data = pd.concat(tables, ignore_index=True)[list(PERIOD_COLUMNS)]
    found = FigureNumbers(
        "figure-13", "A figure of our own", "One period of the motion", data,
        columns=PERIOD_COLUMNS,
    )  # fmt: skip
    printed, plastic, inertial = (found.curve(name) for name in CASES)
    drops = [float(rows["force"].mean()) - mu_ss(V) for rows in (printed, plastic, inertial)]
    low, high = float(printed["velocity"].min()), float(printed["velocity"].max())
    fastest = float(printed["plastic_velocity"].max())
    smaller = 1 - drops[1] / drops[0]
    return found.described(
        scalars={
            "velocity_min": low,
            "velocity_max": high,
            "plastic_velocity_max": fastest,
            "drop_printed": drops[0],
            "drop_plastic_age": drops[1],
            "drop_inertia": drops[2],
            "plastic_age_smaller_by": smaller,
        },
        caption=(
            f"Elasto-plastic law at 1 µm/s, 120 Hz and ε_eff = {epsilon:g}. Slip comes in one "
            f"pulse a period, when the load is least, of up to {fastest:.1f} V. The slider itself "
            f"swings between {low:.0f} V and +{high:.0f} V on its asperities, most of the time "
            "elastically. The printed age law (full line) uses this velocity, which changes "
            "sign; with the plastic velocity of the joint in its place (dashed) the drop "
            f"of the mean is {100 * smaller:.1f} % smaller. Both are "
            "without inertia; dark: with the mass of the slider, which rings at the asperities' "
            "resonance after each pulse."
        ),
        alt=(
            "Five panels over one period of the load: the load, the velocity of the slider, which "
            f"swings between {low:.0f} and {high:.0f} times the pulling velocity, the plastic "
            "velocity, one pulse at the minimum of the load, the force of the spring and the age "
            "of the interface, for the printed age law, its variant, and with inertia."
        ),
    )
