"""Periodic orbits: several methods, Floquet multipliers, derivatives.

Names are imported when first used, because the modules of the derivatives load slowly.
"""

from asperity._lazy import lazy_names

__getattr__, __all__ = lazy_names(__name__, __file__)


def __dir__() -> list[str]:
    return sorted(__all__)
