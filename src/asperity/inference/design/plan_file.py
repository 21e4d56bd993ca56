"""Plans as files have them: each field checked and converted to SI, and what must agree."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.errors import InputError, closest
from asperity.inference.design.plan import Axis, Budget, DesignPlan, Hypothesis, NoiseLevel
from asperity.inference.fitting.inputs import fixed_values, require_motion, start_values
from asperity.inference.tables.table import OBSERVABLES, LockInTable
from asperity.inference.unknowns import EPS_RATIO, Prior, material_priors, unknowns_of
from asperity.laws import Law, get_law
from asperity.laws.registry import known_law
from asperity.materials import Material
from asperity.materials import load as load_material
from asperity.parameters import MODULATION, Parameter, point_parameters
from asperity.parameters.toml_file import toml_content
from asperity.units import to_radians, to_si

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


Float = NDArray[np.float64]

#: Levels of a range if the plan gives none.
_LEVELS = 7
#: Ranges of these are divided by equal factors unless the plan says otherwise.
_LOGARITHMIC = ("V", "frequency")
#: Candidates beyond this number are refused: a design would take hours.
_MOST_CANDIDATES = 100_000
#: Largest number of readings.
_MOST_POINTS = 100_000


@dataclass(frozen=True)
class PlanFields:
    """The content of a plan file, one method a field.

    Every method raises `InputError` where the field breaks its rule.

    Attributes
    ----------
    content : mapping
        As the file has it.
    name : str
        What messages call the plan.
    require_unit : bool
        Refuse numbers without a unit.
    """

    content: Mapping[str, Any]
    name: str
    require_unit: bool

    def table(self, key: str) -> Mapping[str, Any]:
        """A table of the plan; empty where it is not given."""
        value = self.content.get(key, {})
        if not isinstance(value, Mapping):
            raise InputError(
                f"{self.name}.{key} must be a table, got {value!r}; write [{key}] and a line for "
                "each name"
            )
        return value

    def law(self, key: str) -> type[Law]:
        """A law by its name or place."""
        value = self.content.get(key)
        if not isinstance(value, str):
            raise InputError(
                f"{self.name}.{key} must be the name of a law, got {value!r}; write it like "
                "'elasto-plastic'"
            )
        law = get_law(known_law(value))
        if not law.rate_dependent:
            raise InputError(
                f"{self.name}.{key} must depend on the velocity, got {law.name}; its one number "
                "follows from the mean friction"
            )
        return law

    def material(self, key: str) -> Material | None:
        """A material by its name; None where it is not given."""
        value = self.content.get(key)
        if value is not None and not isinstance(value, str):
            raise InputError(
                f"{self.name}.{key} must be the name of a material, got {value!r}; write it like "
                "'bureau2000'"
            )
        return None if value is None else load_material(value)

    def names(self, key: str, *, required: bool = False) -> tuple[str, ...]:
        """A list of names; one name stands for a list of one."""
        value = self.content.get(key, [])
        value = [value] if isinstance(value, str) else value
        if not isinstance(value, Sequence) or not all(isinstance(n, str) for n in value):
            raise InputError(
                f"{self.name}.{key} must be a list of names, got {value!r}; write it like "
                "['alpha', 'A']"
            )
        if required and not value:
            raise InputError(
                f"{self.name}.{key} must name parameters, got none; a design is for a later fit"
            )
        return tuple(value)

    def quantity(self, value: Any, parameter: Parameter, label: str) -> Any:
        """A value of a parameter in SI, checked by the rule of the parameter."""
        si = to_si(value, parameter.kind, label, require_unit=self.require_unit)
        return parameter.check(si, label)

    def numbers(self, key: str, known: Mapping[str, Parameter]) -> dict[str, float]:
        """A table of values of parameters, in SI."""
        result = {}
        for name, value in self.table(key).items():
            if name not in known:
                raise InputError(
                    f"{self.name}.{key} must have names of parameters, got '{name}'; "
                    f"{closest(name, known)}"
                )
            result[name] = float(self.quantity(value, known[name], f"{self.name}.{key}.{name}"))
        return result

    def axes(self, known: Mapping[str, Parameter]) -> tuple[Axis, ...]:
        """The ranges, in the order of the plan."""
        table = self.table("ranges")
        missing = [n for n in ("V", "epsilon", "frequency") if n not in table]
        if missing:
            raise InputError(
                f"{self.name}.ranges must have V, epsilon and frequency, got none for "
                f"{', '.join(missing)}; give a value, a list, or from and to"
            )
        axes = []
        for name, given in table.items():
            if name not in known:
                raise InputError(
                    f"{self.name}.ranges must be of the drive or the machine, got '{name}'; "
                    f"{closest(name, known)}"
                )
            axes.append(Axis(name, self.levels(name, given, known[name])))
        count = math.prod(a.levels.size for a in axes)
        if count > _MOST_CANDIDATES:
            raise InputError(
                f"{self.name}.ranges must have at most {_MOST_CANDIDATES} combinations, got "
                f"{count}; give fewer levels"
            )
        return tuple(axes)

    def levels(self, name: str, given: Any, parameter: Parameter) -> Float:
        """Values of one axis in SI: given ones, or divisions of a range."""
        label = f"{self.name}.ranges.{name}"
        if not isinstance(given, Mapping):
            values = given if isinstance(given, list | tuple | np.ndarray) else [given]
            if len(values) == 0:
                raise InputError(f"{label} must have values, got an empty list; give one")
            levels = np.array([float(self.quantity(v, parameter, label)) for v in values])
            if np.unique(levels).size != levels.size:
                raise InputError(f"{label} must have each value once, got {given!r}; drop copies")
            return levels
        allowed = ("from", "to", "levels", "spacing")
        for key in given:
            if key not in allowed:
                raise InputError(
                    f"{label} must have known keys, got '{key}'; {closest(key, allowed)}"
                )
        if "from" not in given or "to" not in given:
            raise InputError(f"{label} must have from and to, got {dict(given)!r}; give both")
        low, high = (
            float(self.quantity(given[k], parameter, f"{label}.{k}")) for k in ("from", "to")
        )
        if not low < high:
            raise InputError(f"{label}.to must be above from, got {high:g}; exchange the two")
        spacing = given.get("spacing", "log" if name in _LOGARITHMIC else "linear")
        if spacing not in ("log", "linear"):
            raise InputError(
                f"{label}.spacing must be 'log' or 'linear', got {spacing!r}; choose one"
            )
        if spacing == "log" and low <= 0:
            raise InputError(
                f"{label}.from must be positive with spacing 'log', got {low:g}; raise it, or "
                "choose 'linear'"
            )
        count = _whole(given.get("levels", _LEVELS), f"{label}.levels", 2, _MOST_CANDIDATES)
        return np.geomspace(low, high, count) if spacing == "log" else np.linspace(low, high, count)

    def noise(self) -> dict[str, NoiseLevel]:
        """Standard uncertainties of a reading, by observable."""
        table = self.table("noise")
        if not table:
            raise InputError(
                f"{self.name}.noise must say what is measured how well, got nothing; write [noise] "
                "and lines like mu1 = 2e-5"
            )
        for name in table:
            if name not in OBSERVABLES:
                raise InputError(
                    f"{self.name}.noise must be of observables, got '{name}'; "
                    f"{closest(name, OBSERVABLES)}"
                )
        result = {n: self.level(n, table[n]) for n in OBSERVABLES if n in table}
        for n in (1, 2):
            if f"phase{n}" in result and f"mu{n}" not in result:
                raise InputError(
                    f"{self.name}.noise must have mu{n} where it has phase{n}, got none; add it"
                )
        return result

    def level(self, name: str, given: Any) -> NoiseLevel:
        """Standard uncertainty of one observable."""
        label = f"{self.name}.noise.{name}"
        parts = given if isinstance(given, Mapping) else {"absolute": given}
        for key in parts:
            if key not in ("absolute", "relative"):
                raise InputError(
                    f"{label} must have known keys, got '{key}'; choose absolute or relative"
                )
        phase = name.startswith("phase")
        if phase and "relative" in parts:
            raise InputError(f"{label} must be absolute, got a relative part; give an angle")
        absolute = parts.get("absolute", 0.0)
        a = _angle(absolute, label) if phase else float(to_si(absolute, "dimensionless", label))
        r = float(to_si(parts.get("relative", 0.0), "dimensionless", f"{label}.relative"))
        if a < 0 or r < 0 or (a == 0 and r == 0 and not phase):
            raise InputError(
                f"{label} must be positive, got {max(a, r) if min(a, r) >= 0 else min(a, r):g}; "
                "give the standard uncertainty of one reading"
            )
        return NoiseLevel(a, r)

    def budget(self) -> Budget:
        """The number of readings, or the time and what a reading takes of it."""
        points, time = self.content.get("points"), self.content.get("time")
        if (points is None) == (time is None):
            raise InputError(
                f"{self.name} must have points or time, got {'none' if points is None else 'both'}"
                "; give a number of readings, or the time available"
            )
        costs = {
            key: float(to_si(self.content[key], kind, f"{self.name}.{key}", require_unit=True))
            for key, kind in (("settling_slip", "length"), ("integration", "time"))
            if key in self.content
        }
        for key, value in costs.items():
            if value < 0 or points is not None:
                raise InputError(
                    f"{self.name}.{key} must "
                    + ("go with time" if points is not None else "not be negative")
                    + f", got {self.content[key]}; "
                    + ("leave it out" if points is not None else "give zero or more")
                )
        if points is not None:
            return Budget(readings=_whole(points, f"{self.name}.points", 1, _MOST_POINTS))
        if not costs or max(costs.values()) == 0:
            raise InputError(
                f"{self.name} must say what a reading takes, got no settling_slip and no "
                "integration; give one or both"
            )
        total = float(to_si(time, "time", f"{self.name}.time", require_unit=True))
        if total <= 0:
            raise InputError(f"{self.name}.time must be positive, got {total:g} s; give more")
        return Budget(
            time=total,
            settling_slip=costs.get("settling_slip", 0.0),
            integration=costs.get("integration", 0.0),
        )

    def hypothesis(
        self, law: type[Law], free: Sequence[str], material: Material | None, table: LockInTable
    ) -> Hypothesis:
        """A law with its free and fixed parameters; `table` stands for the candidates."""
        known = {**point_parameters(law), EPS_RATIO.name: EPS_RATIO}
        every = {**known, **point_parameters(self.law("law"))}
        given = {n: v for n, v in self.numbers("values", every).items() if n in known}
        fixed = {n: v for n, v in self.numbers("fixed", every).items() if n in known}
        for name in fixed:
            if name in table.points:
                raise InputError(
                    f"{self.name}.fixed must not have what ranges has, got '{name}'; drop one"
                )
        for name in free:
            if name in table.points:
                raise InputError(
                    f"{self.name}.free must not have what ranges has, got '{name}'; it is set, "
                    "not fitted"
                )
        for name in given:
            if name in fixed and name not in free:
                raise InputError(f"{self.name}.{name} must be given once, got two; drop one")
            if name not in free and name in known and self.law("law") is law:
                fixed[name] = given[name]
        start = start_values(law, free, {n: v for n, v in given.items() if n in free}, material)
        if "eps_ratio" in free:
            start.setdefault("eps_ratio", 1.0)
        missing = [n for n in free if n in known and n not in start]
        if missing:
            raise InputError(
                f"{self.name}.values must have a value for each free parameter of {law.name}, got "
                f"none for {', '.join(missing)}; a design is made for values that are expected"
            )
        unknowns = unknowns_of(
            law,
            free,
            largest_epsilon=float(table.points["epsilon"].max()),
            start=start,
            priors=self.priors(free),
        )
        constants = fixed_values(law, table, free, fixed, material)
        return Hypothesis(
            law,
            unknowns,
            {n: start[n] for n in free},
            {n: float(v) for n, v in constants.items() if n not in table.points},
        )

    def priors(self, free: Sequence[str]) -> dict[str, Prior]:
        """Priors of the later fit."""
        given = self.content.get("prior")
        if given is None:
            return {}
        if isinstance(given, str):
            return material_priors(load_material(given), free)
        raise InputError(
            f"{self.name}.prior must be the name of a material, got {given!r}; write it like "
            "'bureau2000'"
        )

    def uncertainties(
        self, known: Mapping[str, Parameter], material: Material | None, truth: Hypothesis
    ) -> dict[str, float]:
        """Standard deviations of the free parameters that are drawn, in SI."""
        given = self.numbers_of_spread(known)
        result = {}
        for name in truth.names:
            if name in given:
                result[name] = given[name]
            elif material is not None and name in material and material[name].uncertainty:
                result[name] = float(material[name].si_uncertainty or 0.0)
        for name in given:
            if name not in truth.names:
                raise InputError(
                    f"{self.name}.uncertainty must be of free parameters, got '{name}'; free it or "
                    "leave it out"
                )
        if not result:
            raise InputError(
                f"{self.name}.uncertainty must have a free parameter to draw, got none; add one, "
                "or leave draws out"
            )
        return result

    def numbers_of_spread(self, known: Mapping[str, Parameter]) -> dict[str, float]:
        """The table of standard deviations, in SI."""
        result = {}
        for name, value in self.table("uncertainty").items():
            label = f"{self.name}.uncertainty.{name}"
            if name not in known:
                raise InputError(
                    f"{self.name}.uncertainty must have names of parameters, got '{name}'; "
                    f"{closest(name, known)}"
                )
            result[name] = float(
                to_si(value, known[name].kind, label, require_unit=self.require_unit)
            )
            if result[name] < 0:
                raise InputError(f"{label} must not be negative, got {result[name]:g}; change it")
        return result

    def whole(self, key: str, default: int, low: int, high: int) -> int:
        """A whole number between two limits."""
        return _whole(self.content.get(key, default), f"{self.name}.{key}", low, high)

    def share(self, key: str, default: float) -> float:
        """A number above 0 and at most 1."""
        value = self.content.get(key, default)
        result = float(to_si(value, "dimensionless", f"{self.name}.{key}"))
        if not 0 < result <= 1:
            raise InputError(
                f"{self.name}.{key} must be above 0 and at most 1, got {result:g}; change it"
            )
        return result

    def switch(self, key: str) -> bool:
        """True or false."""
        value = self.content.get(key, False)
        if not isinstance(value, bool):
            raise InputError(f"{self.name}.{key} must be true or false, got {value!r}; choose one")
        return value


def _whole(value: Any, label: str, low: int, high: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise InputError(
            f"{label} must be a whole number from {low} to {high}, got {value!r}; change it"
        )
    return value


def _angle(value: Any, label: str) -> float:
    """An angle in rad from a text with its unit; of numbers only 0 needs none."""
    if isinstance(value, str) or (value == 0 and not isinstance(value, bool)):
        return float(to_radians(value, label))
    raise InputError(
        f"{label} must be an angle in rad or deg, with its unit, got {value!r}; "
        "write it like '1 deg' or '20 mrad'"
    )
