"""Friction under a modulated normal load: laws, periodic responses, and the paper they come from.

Nothing heavy is loaded here; each name below is imported when first used.
"""

from asperity._lazy import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
