"""Figures 13 and 15, which are not in the paper: one period of the motion, and its resonance.

At 0.5 of modulation, 1 um/s and 120 Hz the asperities' elasticity moves the slider to and fro much
faster than it is pulled. The paper's age law is printed with that velocity; the variant has the
plastic velocity of the joint in its place. The mass and the asperities' shear stiffness W0/lambda
resonate at 400 Hz, between the third and the fourth harmonic of 120 Hz and at the second of 200
Hz. The paper's models leave the mass out.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd

from asperity import InputError, periodic_response
from asperity.ledger import FigureNumbers
from asperity.orbit import over_a_period
from asperity_papers.bureau2000.curves import CurveFigure, FigureCurve, figure_numbers
from asperity_papers.bureau2000.machine import EXT, EXT_AGE, Float, Machine

#: Instants of the period: pulses of slip are a third of a radian wide and less.
_SAMPLES = 512

#: Curves: name to law, and whether the mass counts.
PERIODS = {
    "age on the slider's velocity": (EXT, False),
    "age on the plastic velocity": (EXT_AGE, False),
    "with inertia": (EXT, True),
}


def one_period(
    machine: Machine,
    law: str,
    V: float,
    epsilon: float,
    *,
    inertia: bool = False,
    samples: int = _SAMPLES,
) -> pd.DataFrame:
    """Force, velocities and age over one period of the periodic orbit.

    Parameters
    ----------
    machine : Machine
    law : str
        An elasto-plastic law.
    V, epsilon : float
        Pulling velocity (m/s) and amplitude on the contacts.
    inertia : bool
    samples : int
        Instants of the period.

    Returns
    -------
    DataFrame
        With the columns of figure 13 but "curve".

    Raises
    ------
    InputError
        If there is no periodic orbit.
    """
    response = periodic_response(
        machine.slider(law), velocity=V, epsilon=epsilon, frequency=machine.numbers.frequency,
        inertia=inertia, waveform=samples,
    )  # fmt: skip
    if not response.converged:
        rule = f"have a periodic orbit of {law} at {1e6 * V:g} um/s"
        raise InputError("the motion", rule, str(response.result), "change the numbers")
    return pd.DataFrame({"law": law, "inertia": inertia, **over_a_period(response)._asdict()})


def period_figure(machine: Machine) -> FigureNumbers:
    """One period at 0.5 of modulation and 1 um/s, with both age laws and with inertia."""
    V, epsilon = machine.velocities[0], machine.strongest
    tables = [
        one_period(machine, law, V, epsilon, inertia=inertia) for law, inertia in PERIODS.values()
    ]
    data = pd.concat(tables, keys=list(PERIODS), names=["curve"]).reset_index("curve")
    return figure_numbers(machine, "figure-13", data.reset_index(drop=True))


# --- The resonance of the slider on its asperities -----------------------------------------------

#: Quality factor of the damped resonance. The paper gives no damping; ten is our choice.
QUALITY = 10.0
#: Ranges of the two cuts: beyond the published values of lambda (um), and around 120 and 200 Hz.
_LENGTHS, _FREQUENCIES, _POINTS = (0.4, 1.0), (80.0, 800.0), 100


def resonance_curves(machine: Machine) -> list[FigureCurve]:
    """Cuts over lambda and frequency at 10 um/s; names are "lambda, inertia" and the like."""
    p, V, epsilon = machine.numbers, machine.velocities[1], machine.strongest
    lengths: Float = 1e-6 * np.linspace(*_LENGTHS, _POINTS)
    # The paper's frequencies are among them: the peaks are narrower than two points.
    experiments = [p.frequency, p.frequency_vacuum]
    between = np.geomspace(*_FREQUENCIES, _POINTS - len(experiments))
    cuts = (
        FigureCurve("lambda", EXT, V, epsilon, overrides={"lambda_": lengths}),
        FigureCurve("frequency", EXT, V, epsilon, frequency=np.sort([*between, *experiments])),
    )
    # A damper between slider and track, parallel to asperities and joint. What it adds to the mean
    # force, its value (N s/m) times V, is below 0.001 W0 at 10 um/s.
    damping = float(np.sqrt(p.M * p.W0 / p.lambda_) / QUALITY)
    cases = {"no inertia": (False, 0), "inertia": (True, 0), "inertia, damped": (True, damping)}
    return [
        replace(cut, name=f"{cut.name}, {name}", inertia=inertia, damping=damping)
        for name, (inertia, damping) in cases.items()
        for cut in cuts
    ]


#: Drop, mu1 and mu2 against lambda at 120 Hz and against frequency at 0.7 um.
resonance_figure = CurveFigure("figure-15", resonance_curves)
