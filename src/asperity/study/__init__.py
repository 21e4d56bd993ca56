"""Many operating points: tables, maps, thresholds, and sweeps of any size.

Names are imported when first used: workers of a sweep set the number of threads before JAX loads.
"""

from asperity._lazy import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
