"""From data to verdict: which law, which numbers, and how sure."""

from asperity.inference.comparison.compare import Comparison, Judged, compare
from asperity.inference.cycles.cycle import AveragedCycle, averaged_cycle
from asperity.inference.design import Design, DesignPlan, design, plan_of, read_plan
from asperity.inference.fitting.fit import fit
from asperity.inference.fitting.intervals import bounded_interval
from asperity.inference.fitting.plausibility import shift_of_estimates
from asperity.inference.fitting.result import Estimate, Fit, Optimum
from asperity.inference.fitting.windows import WindowedFit, WindowEstimate, fit_windows
from asperity.inference.holds.table import HealingTable, healing_table, read_healing
from asperity.inference.objective import DataTerm, Objective
from asperity.inference.posterior import Posterior, sample_posterior
from asperity.inference.runs.assembly import RunOptions
from asperity.inference.runs.run import RecordedRun, recorded_run
from asperity.inference.runs.unloading import MeasuredStiffness, measured_stiffness
from asperity.inference.tables.table import LockInTable, read_table, table_of
from asperity.inference.unknowns import Prior

__all__ = [
    "AveragedCycle",
    "Comparison",
    "DataTerm",
    "Design",
    "DesignPlan",
    "Estimate",
    "Fit",
    "HealingTable",
    "Judged",
    "LockInTable",
    "MeasuredStiffness",
    "Objective",
    "Optimum",
    "Posterior",
    "Prior",
    "RecordedRun",
    "RunOptions",
    "WindowEstimate",
    "WindowedFit",
    "averaged_cycle",
    "bounded_interval",
    "compare",
    "design",
    "fit",
    "fit_windows",
    "healing_table",
    "measured_stiffness",
    "plan_of",
    "read_healing",
    "read_plan",
    "read_table",
    "recorded_run",
    "sample_posterior",
    "shift_of_estimates",
    "table_of",
]
