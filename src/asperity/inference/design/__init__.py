"""What to measure next: operating points that measure a parameter or exclude a law best."""

from asperity.inference.design.design import design
from asperity.inference.design.plan import DesignPlan, plan_of, read_plan
from asperity.inference.design.result import Design, DesignedPoint, ExpectedError

__all__ = [
    "Design",
    "DesignPlan",
    "DesignedPoint",
    "ExpectedError",
    "design",
    "plan_of",
    "read_plan",
]
