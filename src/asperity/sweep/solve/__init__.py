"""What a sweep solves at each of its points: one module a kind."""

from asperity.sweep.solve.fit import FitSolve
from asperity.sweep.solve.kind import SolveKind
from asperity.sweep.solve.periodic import PeriodicSolve
from asperity.sweep.solve.threshold import ThresholdSolve
from asperity.sweep.solve.transient import TransientSolve

#: Every kind, by the name that plans use.
SOLVES: dict[str, SolveKind] = {
    kind.name: kind for kind in (PeriodicSolve(), ThresholdSolve(), TransientSolve(), FitSolve())
}

__all__ = ["SOLVES", "SolveKind"]
