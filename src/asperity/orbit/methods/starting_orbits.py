"""An orbit of every point on a coarse mesh, for programs that follow or differentiate orbits."""

from __future__ import annotations

from functools import partial

import numpy as np

from asperity.orbit.batches import mesh_chunk, put, run_chunks, take
from asperity.orbit.mesh.remeshing import remeshed
from asperity.orbit.methods.branch_following.from_steady_sliding import (
    MESHES,
    orbits_along_branches,
)
from asperity.orbit.methods.collocation.frequency_path import orbits_from_high_frequency
from asperity.orbit.methods.collocation.initial_guess import (
    InitialGuess,
    orbits_from_averaged_limit,
)
from asperity.slider.problem import Problem


def starting_orbits(problem: Problem, points: int, intervals: int) -> InitialGuess:
    """Find an orbit of every point, by whichever method of collocation finds one.

    Parameters
    ----------
    problem : Problem
        NumPy arrays with the points along the last axis.
    points : int
    intervals : int
        Of the mesh of the orbits.
    """
    guess = InitialGuess.none(problem, points, intervals)
    chunk = mesh_chunk(problem.system.size)
    remesh = partial(remeshed, intervals=intervals)
    along = [lambda part, n, mesh=mesh: orbits_along_branches(part, n, mesh)[0] for mesh in MESHES]
    for find in (orbits_from_averaged_limit, *along, orbits_from_high_frequency):
        left = np.flatnonzero(~guess.found)
        if not len(left):
            break
        part = take(problem, left)
        attempt = find(part, len(left))
        guess.outcome[left], guess.detail[left] = attempt.outcome, attempt.detail
        found = np.flatnonzero(attempt.found)
        for rows, orbit in run_chunks(remesh, (part, attempt.orbit), found, chunk):
            put(guess.orbit, left[rows], orbit)
        guess.found[left[found]] = True
    return guess
