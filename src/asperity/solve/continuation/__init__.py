"""Continuation of periodic orbits in parameters, their bifurcations, and stability boundaries."""
