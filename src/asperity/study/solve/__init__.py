"""Kinds of solve: what a sweep solves at each of its points."""

from asperity.study.solve.fit import FitSolve
from asperity.study.solve.kind import PeriodicSolve, SolveKind
from asperity.study.solve.threshold import ThresholdSolve
from asperity.study.solve.transient import TransientSolve

#: Every kind of solve, by its name in plans.
SOLVES: dict[str, SolveKind] = {
    kind.name: kind for kind in (PeriodicSolve(), ThresholdSolve(), TransientSolve(), FitSolve())
}

__all__ = ["SOLVES", "SolveKind"]
