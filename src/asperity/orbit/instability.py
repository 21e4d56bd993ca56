"""Points without an orbit where sliding is too unstable for any orbit to be found or observed."""

from __future__ import annotations

import numpy as np

from asperity.orbit.batches import run_chunks
from asperity.orbit.outcome import Outcome
from asperity.orbit.solution import Solution
from asperity.slider.problem import Problem
from asperity.theory.adiabatic import adiabatic_growth

#: Exponent of the growth of a disturbance by which the error of a mesh, 1e-6 or less, becomes as
#: large as the orbit.
LARGEST_GROWTH = 15.0

#: Points in a call.
CHUNK = 8


def mark_too_unstable(problem: Problem, solution: Solution) -> None:
    """Give failed points the outcome SENSITIVE where disturbances of slow sliding grow too much."""
    failed = np.isin(solution.outcome, (Outcome.NO_ORBIT, Outcome.NOT_RESOLVED))
    amplitude = np.broadcast_to(problem.load.amplitude, failed.shape)
    rows = np.flatnonzero(failed & solution.informed)
    for part, growth in run_chunks(adiabatic_growth, (problem,), rows, CHUNK):
        part = part[growth > LARGEST_GROWTH]
        share = np.where(solution.outcome[part] == Outcome.NO_ORBIT, solution.detail[part], 1.0)
        solution.detail[part] = np.minimum(share, 1.0) * amplitude[part]
        solution.outcome[part] = Outcome.SENSITIVE
