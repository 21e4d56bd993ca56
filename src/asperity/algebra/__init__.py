"""Numerical methods for many operating points at once: linear systems, tableaux, continuation."""
