"""The version, alone in a file: the build reads it, and reading it must cost nothing."""

__version__ = "0.1.0"
