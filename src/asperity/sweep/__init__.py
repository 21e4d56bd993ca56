"""Many operating points: tables, maps, thresholds, and sweeps of any size.

Names are imported when first used: workers of a sweep set the number of threads before JAX loads.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from asperity.sweep.export import export_store
    from asperity.sweep.load import load_plan
    from asperity.sweep.plan.model import SweepPlan
    from asperity.sweep.read import open_store, reasons
    from asperity.sweep.run.dry_run import dry_run
    from asperity.sweep.run.run import SweepSummary, run_sweep
    from asperity.sweep.status import SweepStatus, store_status, summary_statistics

#: Public names and their modules.
_HOMES = {
    "SweepPlan": "plan.model",
    "SweepStatus": "status",
    "SweepSummary": "run.run",
    "dry_run": "run.dry_run",
    "export_store": "export",
    "load_plan": "load",
    "open_store": "read",
    "reasons": "read",
    "run_sweep": "run.run",
    "store_status": "status",
    "summary_statistics": "status",
}

__all__ = [
    "SweepPlan",
    "SweepStatus",
    "SweepSummary",
    "dry_run",
    "export_store",
    "load_plan",
    "open_store",
    "reasons",
    "run_sweep",
    "store_status",
    "summary_statistics",
]


def __getattr__(name: str) -> object:
    from importlib import import_module

    if name not in _HOMES:
        raise AttributeError(f"module 'asperity.sweep' has no attribute '{name}'")
    return getattr(import_module(f"asperity.sweep.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
