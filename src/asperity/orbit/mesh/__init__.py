"""Orbits on meshes: collocation, Newton's method on a whole orbit, and what is read from it."""
