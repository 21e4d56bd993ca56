"""Orbits from the search, each on a collocation mesh on which it can be differentiated."""
