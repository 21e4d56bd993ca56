"""Files of laboratories to one checked `Trace`: one module a format."""

from asperity.instrument.readers.read import read

__all__ = ["read"]
