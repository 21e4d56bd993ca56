"""Plans of sweeps: what varies, what stays, and what is solved at every point."""

from asperity.sweep.plan.grid import SweepGrid
from asperity.sweep.plan.load import load_plan
from asperity.sweep.plan.mistakes import PlanError
from asperity.sweep.plan.model import SweepPlan

__all__ = ["PlanError", "SweepGrid", "SweepPlan", "load_plan"]
