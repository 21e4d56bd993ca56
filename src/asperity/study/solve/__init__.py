"""What a sweep solves at each of its points: one module a kind."""

from asperity.study.solve.fit import FitSolve
from asperity.study.solve.kind import SolveKind
from asperity.study.solve.periodic import PeriodicSolve
from asperity.study.solve.threshold import ThresholdSolve
from asperity.study.solve.transient import TransientSolve

#: Every kind, by the name that plans use.
SOLVES: dict[str, SolveKind] = {
    kind.name: kind for kind in (PeriodicSolve(), ThresholdSolve(), TransientSolve(), FitSolve())
}

__all__ = ["SOLVES", "SolveKind"]
