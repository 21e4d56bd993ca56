"""Derivatives of periodic orbits by the implicit function theorem."""
