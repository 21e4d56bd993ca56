"""Plans of sweeps from their files."""

from __future__ import annotations

import os

from asperity.parameters.toml_file import toml_content
from asperity.sweep.plan import PlanError, SweepPlan
from asperity.sweep.record import without_unit


def load_plan(path: str | os.PathLike[str]) -> SweepPlan:
    """Read a plan from a TOML file, in which every quantity carries its unit.

    Parameters
    ----------
    path : str or path

    Raises
    ------
    InputError
        If the file cannot be read or is not TOML.
    PlanError
        An `InputError` with all mistakes.
    """
    file, content = toml_content(path, "plan")
    try:
        plan = SweepPlan(**{"folder": file.parent, **content})
    except PlanError as error:
        raise PlanError(error.mistakes, str(path)) from None
    mistakes = without_unit(plan)
    if mistakes:
        raise PlanError(mistakes, str(path))
    return plan
