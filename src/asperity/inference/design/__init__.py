"""What to measure next: operating points that measure a parameter or exclude a law best."""

from asperity._lazy import public_names
from asperity.inference.design.design import (
    Design as Design,
    DesignedPoint as DesignedPoint,
    ExpectedError as ExpectedError,
    design as design,
)
from asperity.inference.design.plan import (
    DesignPlan as DesignPlan,
    plan_of as plan_of,
    read_plan as read_plan,
)

__all__ = public_names(globals())
