"""The limit of a map without modulation, in closed form where there is one."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.sweep.map.plane import MapPlane
from asperity.theory import closed_forms as cf

Float = NDArray[np.float64]

#: Laws whose steady sliding loses stability at a stiffness known in closed form.
_RIGID = ("rice-ruina", "linker-dieterich", "ruina-slip")
_ELASTIC = {"elasto-plastic": "slider", "elasto-plastic-age": "plastic"}


def critical_stiffness_along(plane: MapPlane) -> dict[str, Float]:
    """K_c (N/m) of unmodulated sliding along the other axis, where K is on one of the two.

    Returns
    -------
    dict of str to array
        By the name of the other axis; empty if K is on neither, or there is no closed form for
        the law with this inertia and damping.
    """
    axes = {plane.x.name: plane.x, plane.y.name: plane.y}
    if "K" not in axes:
        return {}
    (other,) = (axis for name, axis in axes.items() if name != "K")
    u = np.linspace(0.0, 1.0, other.count)
    where = np.stack([u, 0 * u] if other is plane.x else [0 * u, u], axis=-1)
    values = plane.values(where)
    if np.any(values["eta"] > 0):
        return {}
    heavy, name = bool(np.any(values["inertia"])), plane.law.name
    rigid = name in _RIGID or (name in _ELASTIC and not np.any(values["lambda"]))
    if not rigid and (heavy or name not in _ELASTIC):
        return {}
    numbers: dict[str, Any] = {n: values[n] for n in ("A", "B", "D0", "K", "W0", "V", "M")}
    elastic: Any = values.get("lambda", np.zeros(1))
    numbers |= {"mu": values["mu0"], "omega": 2 * np.pi * values["frequency"]}
    p = cf.SmallModulation(**numbers, lambda_=elastic)
    if not rigid:
        found = cf.critical_stiffness_elastic(p, _ELASTIC[name])
    else:
        found = cf.critical_stiffness_inertial(p) if heavy else cf.critical_stiffness(p)
    return {other.name: np.asarray(found)}
