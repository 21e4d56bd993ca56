"""Plans as files have them: every key looked up, and what must agree between keys."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from asperity.errors import InputError, closest
from asperity.inference.design.plan.fields import PlanFields
from asperity.inference.design.plan.record import Axis, DesignPlan
from asperity.inference.fitting.inputs import require_motion
from asperity.inference.tables.table import LockInTable
from asperity.inference.unknowns import EPS_RATIO
from asperity.parameters import MODULATION, point_parameters
from asperity.parameters.toml_file import toml_content

#: Largest number of draws.
_MOST_DRAWS = 1000

_KEYS = (
    *("law", "free", "material", "prior", "measure", "rival", "rival_free", "points", "time"),
    *("settling_slip", "integration", "draws", "usable_share", "inertia", "radiation_damping"),
    *("seed", "ranges", "fixed", "values", "uncertainty", "noise"),
)


def read_plan(path: str | os.PathLike[str]) -> DesignPlan:
    """Read a plan from a TOML file; quantities carry their unit.

    Parameters
    ----------
    path : str or path

    Raises
    ------
    InputError
        If the file cannot be read or anything in it is wrong.
    """
    file, content = toml_content(path, "plan")
    for key in ("law", "rival"):
        place = content.get(key)
        # A law in a file of its own stands beside the plan.
        if isinstance(place, str) and ".py:" in place:
            content[key] = str(file.parent / place)
    return plan_of(content, name=file.name, require_unit=True)


def plan_of(
    content: Mapping[str, Any], *, name: str = "plan", require_unit: bool = False
) -> DesignPlan:
    """A plan from the content of a file, or the same as a dictionary.

    Parameters
    ----------
    content : mapping
        Keys as in docs/design.md.
    name : str
        What messages call the plan.
    require_unit : bool
        Refuse numbers without a unit, as files do; else they are SI.

    Raises
    ------
    InputError
        If anything is wrong.
    """
    for key in content:
        if key not in _KEYS:
            raise InputError(f"{name} must have known keys, got '{key}'; {closest(key, _KEYS)}")
    reader = PlanFields(content, name, require_unit)
    law = reader.law("law")
    material = reader.material("material")
    known = {
        n: p
        for n, p in {**point_parameters(law), EPS_RATIO.name: EPS_RATIO}.items()
        if n not in MODULATION and n != "inertia"
    }
    axes = reader.axes({n: p for n, p in known.items() if p.place != "law" and n != "eps_ratio"})
    ratio = reader.numbers("values", known).get("eps_ratio", 1.0)
    table = _first_rows(name, axes)
    measured = reader.names("measure")
    rival_law = reader.law("rival") if "rival" in content else None
    if bool(measured) == (rival_law is not None):
        raise InputError(
            f"{name} must have one aim, measure or rival, got "
            f"{'both' if measured else 'none'}; name parameters to measure, or a rival law"
        )
    truth = reader.hypothesis(law, reader.names("free", required=True), material, table)
    rival = None
    if rival_law is not None:
        own = {*point_parameters(rival_law), EPS_RATIO.name}
        free = reader.names("rival_free") or tuple(n for n in truth.names if n in own)
        rival = reader.hypothesis(rival_law, free, material, table)
        if rival_law is law and set(truth.names) <= set(rival.names):
            raise InputError(
                f"{name}.rival must differ from the law, got {law.name} with the same free "
                "parameters; name another law, or leave one out in rival_free"
            )
    elif "rival_free" in content:
        raise InputError(f"{name}.rival_free must go with a rival, got no rival; leave it out")
    motion = {name: reader.switch(name) for name in ("inertia", "radiation_damping")}
    require_motion(truth.names, motion, label=f"{name}.free", plan=True)
    if rival is not None:
        require_motion(rival.names, motion, label=f"{name}.rival_free", plan=True)
    for parameter in measured:
        if parameter not in truth.names:
            raise InputError(
                f"{name}.measure must name free parameters, got '{parameter}'; free it or "
                f"choose among {', '.join(truth.names)}"
            )
    draws = reader.whole("draws", 0, 0, _MOST_DRAWS)
    if draws and rival is not None:
        raise InputError(
            f"{name}.draws must be 0 with a rival, got {draws}; laws are separated at one set of "
            "values"
        )
    uncertainty = reader.uncertainties(known, material, truth) if draws else {}
    for hypothesis in (truth, rival) if rival else (truth,):
        largest = max(float(a.levels.max()) for a in axes if a.name == "epsilon")
        carried = hypothesis.values.get("eps_ratio", hypothesis.fixed.get("eps_ratio", ratio))
        if carried * largest >= 1:
            raise InputError(
                f"{name}.ranges.epsilon times eps_ratio must be below 1, got "
                f"{carried * largest:g}; contact would be lost"
            )
    noise, budget = reader.noise(), reader.budget()
    unknown = sum(1 for u in truth.unknowns if u.prior is None)
    if budget.readings is not None and budget.readings * len(noise) < unknown:
        raise InputError(
            f"{name}.points must give at least as many data as free parameters, got "
            f"{budget.readings * len(noise)} for {unknown} without a prior; plan more, or free "
            "fewer"
        )
    return DesignPlan(
        name=name,
        axes=axes,
        noise=noise,
        budget=budget,
        truth=truth,
        rival=rival,
        measured=measured,
        draws=draws,
        uncertainty=uncertainty,
        usable_share=reader.share("usable_share", 0.9),
        **motion,
        seed=reader.whole("seed", 0, 0, 2**31 - 1),
    )


def _first_rows(name: str, axes: Sequence[Axis]) -> LockInTable:
    """The ends of all axes as rows, which stand for the candidates in checks."""
    ends = {a.name: np.array([a.levels.min(), a.levels.max()]) for a in axes}
    return LockInTable(name, ends, {}, {})
