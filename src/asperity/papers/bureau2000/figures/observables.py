"""Where measured points of each observable belong in the figures."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from asperity.papers.bureau2000.figures.elements import APPLIED, BORNE
from asperity.papers.measured_points import Observable


def _harmonics(x: str, first: int, scale: float) -> tuple[Observable, ...]:
    return tuple(
        Observable(column, x, panel=first + i, y_scale=scale)
        for i, column in enumerate(("mu1", "mu2"))
    )


_DROP = Observable("delta_mu", APPLIED)
_DROP_BORNE = Observable("delta_mu", BORNE)

#: Figures that take points, and what they show; the abscissa of Fig. 3 carries a unit of velocity.
OBSERVABLES: Mapping[str, tuple[Observable, ...]] = MappingProxyType(
    {
        "figure-02": (_DROP,),
        "figure-03": (Observable("mean_friction", "V", kind="velocity", x_scale=1e6),),
        "figure-04": _harmonics(APPLIED, 0, 1e3),
        "figure-05": (_DROP,),
        "figure-06": (_DROP,),
        "figure-07": (_DROP,),
        "figure-08": _harmonics(BORNE, 0, 1.0),
        "figure-09": (_DROP_BORNE, *_harmonics(BORNE, 1, 1.0)),
        "figure-11": (_DROP_BORNE, *_harmonics(BORNE, 1, 1e3)),
    }
)
