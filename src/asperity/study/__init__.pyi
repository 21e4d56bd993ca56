# Public names of the package, each with its module; `asperity._lazy` imports them when used.

from asperity.study.engine import SweepProgress as SweepProgress
from asperity.study.plan import SweepPlan as SweepPlan, load_plan as load_plan
from asperity.study.points import reasons as reasons
from asperity.study.results import (
    SweepStatus as SweepStatus,
    export_store as export_store,
    open_store as open_store,
    store_status as store_status,
    summary_statistics as summary_statistics,
)
from asperity.study.run import dry_run as dry_run, run_sweep as run_sweep
