"""Plans of an experiment: what can be set, what is measured how well, and what is asked."""

from asperity.inference.design.plan.file import plan_of, read_plan
from asperity.inference.design.plan.record import DesignPlan, Hypothesis

__all__ = ["DesignPlan", "Hypothesis", "plan_of", "read_plan"]
