"""Periodic orbits: several methods, Floquet multipliers, derivatives.

Names are imported when first used, because the modules of the derivatives load slowly.
"""

from asperity._lazy import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
