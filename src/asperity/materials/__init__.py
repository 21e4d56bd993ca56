"""Published numbers, one file a paper: ``materials.load("bureau2000")``.

A material file is TOML; `asperity.materials.Number` describes its numbers. Loading one loads
pydantic, importing this package does not.
"""

from asperity._lazy import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
