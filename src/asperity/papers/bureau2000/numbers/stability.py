"""A figure of our own: the leading Floquet multiplier against the amplitude of the modulation."""

from __future__ import annotations

import numpy as np
import pandas as pd

from asperity.orbit import periodic_response
from asperity.papers.bureau2000.numbers.curves import FigureCurve, solve_curves
from asperity.papers.bureau2000.numbers.figure_numbers import FigureNumbers
from asperity.papers.bureau2000.numbers.machine import (
    EXT,
    LD,
    RR,
    Float,
    borne_amplitudes,
    paper,
    slider,
    velocities,
    velocity_text,
)
from asperity.papers.bureau2000.numbers.steady import floquet_max, stiffness_ratio

#: The secant iteration ends when no threshold moves by more than this; tests ask for 1e-6.
_TOLERANCE = 1e-9
_MOST_STEPS = 12


def variants() -> dict[str, tuple[str, dict[str, float]]]:
    """The laws compared: name, law and the parameters that replace the paper's."""
    p = paper()
    return {
        "RR": (RR, {}),
        f"LD {p.alpha:g}": (LD, {"alpha": p.alpha}),
        f"LD {p.alpha_low:g}": (LD, {"alpha": p.alpha_low}),
        "EXT": (EXT, {}),
    }


def log_multiplier(variant: str, V: Float, epsilon: Float) -> Float:
    """Real part of the logarithm of the leading multiplier; NaN where not solved."""
    law, overrides = variants()[variant]
    response = periodic_response(
        slider(law, **overrides), velocity=V, epsilon=epsilon, frequency=paper().frequency
    )
    return np.where(response.converged, response.log_multipliers[..., 0].real, np.nan)


def thresholds(variant: str, V: Float, bracket: tuple[Float, Float]) -> Float:
    """Amplitude eps_eff at which modulation makes sliding stable, for each velocity.

    Secant iteration on ln|m|, which is smooth and nearly quadratic in eps there.

    Parameters
    ----------
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
    old, new = bracket
    at_old, at_new = log_multiplier(variant, V, old), log_multiplier(variant, V, new)
    for _ in range(_MOST_STEPS):
        # Once two iterates agree to the last digit there is no secant, and nothing left to do.
        flat = at_new == at_old
        step = np.where(flat, 0.0, at_new * (new - old) / np.where(flat, 1.0, at_new - at_old))
        old, at_old = new, at_new
        new = np.clip(new - step, bracket[0], bracket[1])
        if np.abs(new - old).max() < _TOLERANCE:
            break
        at_new = log_multiplier(variant, V, new)
    # At an end of the bracket the iterates agree as well, without a crossing.
    crossed = (np.abs(new - old) < _TOLERANCE) & (np.abs(at_old) < _TOLERANCE)
    return np.where(crossed, new, np.nan)


def curve_name(variant: str, V: float) -> str:
    """Name of a curve, as "RR, 1 um/s"."""
    return f"{variant}, {velocity_text(V)}"


def floquet_figure() -> FigureNumbers:
    """Stability against eps_eff, by law and velocity, with the thresholds."""
    V = np.array(velocities())
    data = solve_curves(
        FigureCurve(curve_name(variant, speed), law, speed, borne_amplitudes(), overrides=overrides)
        for variant, (law, overrides) in variants().items()
        for speed in V
    )
    found = FigureNumbers("figure-12", "A figure of our own", "Modulation stabilises sliding", data)
    scalars = {"K_over_Kc": stiffness_ratio(slider(RR))}
    scalars |= {f"steady {s:.0e}": float(floquet_max(slider(RR), s, paper().frequency)) for s in V}
    for variant in variants():
        brackets = [_bracket(found.curve(curve_name(variant, speed))) for speed in V]
        low, high = np.array(brackets).T
        crossed = thresholds(variant, V, (low, high))
        for speed, value in zip(V, crossed, strict=True):
            scalars[f"threshold {curve_name(variant, speed)}"] = float(value)
    return found.described(scalars=scalars, caption=_caption(scalars, V), alt=_alt(scalars, V))


def _bracket(rows: pd.DataFrame) -> tuple[float, float]:
    """Neighbouring amplitudes between which the leading multiplier crosses 1."""
    unstable = (rows["floquet_max"] > 1).to_numpy()
    eps = rows["epsilon_eff"].to_numpy()
    (crossings,) = np.nonzero(unstable[:-1] & ~unstable[1:])
    if crossings.size == 0:
        return np.nan, np.nan
    return float(eps[crossings[0]]), float(eps[crossings[0] + 1])


def _caption(scalars: dict[str, float], V: Float) -> str:
    slow, fast = (scalars[f"threshold {curve_name('RR', speed)}"] for speed in V)
    elastic = scalars[f"threshold {curve_name('EXT', V[0])}"]
    return (
        f"Largest modulus of the Floquet multipliers of one period. The paper's central values "
        f"give K/K_c = {scalars['K_over_Kc']:.2f}, so unmodulated sliding is unstable (dots at "
        "ε = 0, closed form) although the text has K/K_c ≳ 1; modulation stabilises it where the "
        f"curve crosses 1: for Rice–Ruina at ε_eff = {slow:.4f} (1 µm/s) and {fast:.4f} "
        f"(10 µm/s), for the elasto-plastic law at {elastic:.4f} (1 µm/s). Cochard, Bureau and "
        "Baumberger (2003) studied this effect."
    )


def _alt(scalars: dict[str, float], V: Float) -> str:
    thresholds_ = "; ".join(
        f"{variant} {scalars[f'threshold {curve_name(variant, V[0])}']:.3f}"
        for variant in variants()
    )
    return (
        "Modulus of the leading Floquet multiplier against effective amplitude, one panel a "
        "velocity: all curves start above 1 and fall through it. Thresholds at 1 µm/s: "
        f"{thresholds_}."
    )
