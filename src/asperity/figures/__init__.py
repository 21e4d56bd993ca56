"""Figures: numbers to CSV, then to a picture. Nothing is solved here.

Each name below is imported when first used, because importing Matplotlib takes long.
"""

from asperity._lazy import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
