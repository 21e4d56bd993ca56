"""Many operating points: tables, maps, thresholds, and sweeps of any size.

Names are imported when first used: workers of a sweep set the number of threads before JAX loads.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from asperity._lazy import lazy_names

if TYPE_CHECKING:
    from asperity.study.engine import SweepProgress
    from asperity.study.estimate import dry_run
    from asperity.study.export import export_store
    from asperity.study.outcome import reasons
    from asperity.study.plan import SweepPlan, load_plan
    from asperity.study.results import SweepStatus, open_store, store_status, summary_statistics
    from asperity.study.run import run_sweep

#: Module of each public name.
_HOMES = {
    "SweepPlan": "plan",
    "SweepStatus": "results",
    "SweepProgress": "engine",
    "dry_run": "estimate",
    "export_store": "export",
    "load_plan": "plan",
    "open_store": "results",
    "reasons": "outcome",
    "run_sweep": "run",
    "store_status": "results",
    "summary_statistics": "results",
}

__all__ = [
    "SweepPlan",
    "SweepProgress",
    "SweepStatus",
    "dry_run",
    "export_store",
    "load_plan",
    "open_store",
    "reasons",
    "run_sweep",
    "store_status",
    "summary_statistics",
]


__getattr__ = lazy_names(__name__, _HOMES)


def __dir__() -> list[str]:
    return sorted(__all__)
