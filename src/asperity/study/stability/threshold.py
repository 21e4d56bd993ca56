"""The stiffness above which modulated sliding is stable."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.laws import get_law
from asperity.study.map.crossing import find_crossings
from asperity.study.map.plane import Points, solve_points
from asperity.study.operating_point import numbers_for, quantities, sourced_numbers
from asperity.study.paper import paper

Float = NDArray[np.float64]


@dataclass(frozen=True)
class StiffnessThreshold:
    """Stiffness at which the response loses stability when the spring is softened.

    Attributes
    ----------
    ratio : array, shape (...)
        K*/K_c, with K_c = (B - A) W0/D0 of unmodulated sliding on rigid asperities; NaN where
        none was found.
    kind : str array, shape (...)
        "fold", "period doubling" or "Neimark-Sacker".
    mode_frequency : array, shape (...)
        Frequency of the mode that starts to grow (Hz), modulo the modulation frequency.
    result : str array, shape (...)
        "converged", or why there is no threshold.
    """

    ratio: Float
    kind: NDArray[np.object_]
    mode_frequency: Float
    result: NDArray[np.object_]


def natural_scales(velocity: float = 1e-6) -> tuple[float, float]:
    """K_c (N/m) and the stick-slip frequency f_c (Hz) at K_c, with the paper's numbers.

    K_c = (B - A) W0/D0 and f_c = sqrt((B - A)/A) V/(2 pi D0), Eqs. (18) and (19) of
    Bureau et al. (2000).
    """
    p = paper()
    return (
        (p.B - p.A) * p.W0 / p.D0,
        float(np.sqrt((p.B - p.A) / p.A) * velocity / (2 * np.pi * p.D0)),
    )


def stiffness_threshold(
    law: str,
    *,
    epsilon: Any,
    frequency: Any,
    velocity: float = 1e-6,
    inertia: bool = False,
    changes: Mapping[str, str] | None = None,
    between: tuple[float, float] = (0.3, 4.0),
    scan: int = 24,
) -> StiffnessThreshold:
    """The highest stiffness at which the leading multiplier passes the unit circle.

    Parameters
    ----------
    law : str
        Of the paper's slider.
    epsilon, frequency : array
        Amplitude on the contacts and frequency (Hz); they broadcast.
    velocity : float
        Pulling velocity (m/s).
    inertia : bool
        Whether the mass counts.
    changes : mapping of str to str, optional
        Texts with units in place of the paper's numbers.
    between : (float, float)
        Stiffnesses to look between, over K_c.
    scan : int
        Stiffnesses looked at before the search, at equal ratios: what is narrower is not seen.

    Raises
    ------
    InputError
        If a number breaks its rule.
    """
    eps, f = np.broadcast_arrays(np.asarray(epsilon, float), np.asarray(frequency, float))
    rays = _Rays(law, eps.ravel(), f.ravel(), velocity, inertia, changes or {}, between)
    count = eps.size
    steps = np.linspace(0.0, 1.0, scan)
    grid = np.stack([a.ravel() for a in np.meshgrid(steps, np.arange(count, dtype=float))], -1)
    seen = rays.solve(grid)
    g = seen["log_multiplier"].reshape(count, scan)
    reasons = np.where(seen.converged, "", seen.result).reshape(count, scan)
    with np.errstate(invalid="ignore"):
        crossed = (g[:, :-1] > 0) & (g[:, 1:] < 0)
    # The stable side must reach up to the stiffest spring, with a response everywhere.
    last = scan - 2 - np.argmax(crossed[:, ::-1], axis=1)
    stiffer = np.array([(g[i, k + 1 :] < 0).all() for i, k in enumerate(last)], dtype=bool)
    usable = crossed.any(axis=1) & stiffer
    ray = np.flatnonzero(usable)
    k = last[ray]
    found = find_crossings(
        rays,
        np.stack([steps[k], ray], axis=-1),
        np.stack([steps[k + 1], ray], axis=-1),
        g[ray, k],
        g[ray, k + 1],
    )
    ratio, turn = np.full(count, np.nan), np.full(count, np.nan)
    kind, result = np.full(count, "", dtype=object), np.full(count, "", dtype=object)
    ratio[ray] = np.where(found.found, rays.ratio(found.where[:, 0]), np.nan)
    turn[ray] = np.abs(found.points["multiplier_argument"]) / (2 * np.pi)
    kind[ray], result[ray] = found.points.mode, found.reason
    for i in np.flatnonzero(~usable):
        failed = [text for text in reasons[i] if text]
        side = f"unstable up to {between[1]:g}" if g[i, -1] > 0 else f"stable from {between[0]:g}"
        result[i] = failed[-1] if failed else f"no threshold: {side} K_c"
    shaped = (a.reshape(eps.shape) for a in (ratio, kind, turn * f.ravel(), result))
    return StiffnessThreshold(*shaped)


class _Rays:
    """Rays of growing stiffness, each with its own amplitude and frequency."""

    def __init__(
        self,
        law: str,
        epsilon: Float,
        frequency: Float,
        velocity: float,
        inertia: bool,
        changes: Mapping[str, str],
        between: tuple[float, float],
    ) -> None:
        self.law, self.epsilon, self.frequency = get_law(law), epsilon, frequency
        self.between = between
        given = {"V": f"{velocity!r} m/s", "epsilon": "0", "frequency": "1 Hz", **changes}
        numbers = numbers_for(law, sourced_numbers(given, paper()))
        defaults = {n: q.default for n, q in quantities(self.law).items() if q.default is not None}
        self.fixed = defaults | {n: s.value for n, s in numbers.items()} | {"inertia": inertia}
        self.Kc = natural_scales()[0]

    def ratio(self, u: Float) -> Float:
        """K/K_c at the fractions `u` of a ray."""
        low, high = self.between
        return np.asarray(low * (high / low) ** u)

    def solve(self, where: Float) -> Points:
        """Responses at (fraction, number of the ray)."""
        ray = np.round(where[:, 1]).astype(int)
        values = {n: np.full(len(where), float(v)) for n, v in self.fixed.items()}
        values |= {"epsilon": self.epsilon[ray], "frequency": self.frequency[ray]}
        values["K"] = self.Kc * self.ratio(where[:, 0])
        return solve_points(self.law, values)
