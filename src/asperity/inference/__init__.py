"""From data to verdict: which law, which numbers, and how sure."""

from asperity._lazy import public_names
from asperity.inference.comparison.compare import (
    Comparison as Comparison,
    Judged as Judged,
    compare as compare,
)
from asperity.inference.cycles import (
    AveragedCycle as AveragedCycle,
    averaged_cycle as averaged_cycle,
)
from asperity.inference.design import (
    Design as Design,
    DesignPlan as DesignPlan,
    design as design,
    plan_of as plan_of,
    read_plan as read_plan,
)
from asperity.inference.fitting.fit import fit as fit
from asperity.inference.fitting.intervals import bounded_interval as bounded_interval
from asperity.inference.fitting.plausibility import shift_of_estimates as shift_of_estimates
from asperity.inference.fitting.result import Estimate as Estimate, Fit as Fit, Optimum as Optimum
from asperity.inference.fitting.windows import (
    WindowedFit as WindowedFit,
    WindowEstimate as WindowEstimate,
    fit_windows as fit_windows,
)
from asperity.inference.holds import (
    HealingTable as HealingTable,
    equal_rows as equal_rows,
    healing_table as healing_table,
    read_healing as read_healing,
)
from asperity.inference.objective import DataTerm as DataTerm, Objective as Objective
from asperity.inference.posterior import (
    Posterior as Posterior,
    sample_posterior as sample_posterior,
)
from asperity.inference.runs.assembly import RunOptions as RunOptions
from asperity.inference.runs.run import RecordedRun as RecordedRun, recorded_run as recorded_run
from asperity.inference.runs.unloading import (
    MeasuredStiffness as MeasuredStiffness,
    measured_stiffness as measured_stiffness,
)
from asperity.inference.tables.table import (
    LockInTable as LockInTable,
    read_table as read_table,
    table_of as table_of,
)
from asperity.inference.unknowns import Prior as Prior

__all__ = public_names(globals())
