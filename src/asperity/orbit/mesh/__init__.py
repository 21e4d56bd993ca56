"""Orbits on meshes: collocation, Newton's method on the whole orbit, observables."""
