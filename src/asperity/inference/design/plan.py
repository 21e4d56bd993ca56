"""A plan of an experiment, checked against its laws and in SI."""

from __future__ import annotations

import contextlib
import math
import os
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from asperity.arrays import Float, spaced
from asperity.errors import InputError, closest, in_files, naming, require
from asperity.inference.fitting.inputs import (
    fixed_values,
    priors_of,
    require_motion,
    start_values,
)
from asperity.inference.objective import Objective
from asperity.inference.runs.assembly import stiffness_of_table
from asperity.inference.tables.table import OBSERVABLES, LockInTable
from asperity.inference.unknowns import (
    EPS_RATIO,
    published_numbers,
    require_free_names,
    unknowns_of,
)
from asperity.laws import Law, get_law
from asperity.laws.registry import known_law
from asperity.materials import Material, load as load_material
from asperity.parameters import MODULATION, Parameter, point_parameters, suggestion
from asperity.parameters.arguments import number, typed
from asperity.parameters.toml_file import toml_content
from asperity.questions.design import MOST, Design, Range
from asperity.questions.record import require_unit as with_unit, units_required
from asperity.units import to_radians, to_si

#: By default the ranges of these axes are divided by equal factors.
_LOGARITHMIC = ("V", "frequency")


class NoiseLevel(NamedTuple):
    """Standard uncertainty of one reading: sqrt(absolute^2 + (relative * value)^2).

    Attributes
    ----------
    absolute : float
        In the unit of the observable; phases in rad.
    relative : float
    """

    absolute: float
    relative: float = 0.0

    def at(self, value: Float) -> Float:
        """Standard uncertainty of readings of a value."""
        return np.asarray(np.hypot(self.absolute, self.relative * value))


@dataclass(frozen=True, eq=False)
class DesignPlan:
    """A checked plan.

    Attributes
    ----------
    name : str
        Name of the plan in messages.
    question : asperity.questions.design.Design
        Aim, budget, draws, seed, and whether inertia and radiation damping count.
    axes : mapping of str to array, shape (n,)
        Values in SI of V, epsilon (as applied), frequency, and parameters of the machine.
    noise : mapping of str to NoiseLevel
        Noise of each measured observable.
    truth : Objective
        The law that the readings are expected to follow, without data. Its unknowns start at the
        expected values.
    rival : Objective or None
        The law to be excluded; None if parameters are to be measured.
    uncertainty : mapping of str to float
        Standard deviation of free parameters for the draws, in SI.
    """

    name: str
    question: Design
    axes: Mapping[str, Float]
    noise: Mapping[str, NoiseLevel]
    truth: Objective
    rival: Objective | None
    uncertainty: Mapping[str, float]

    @property
    def priors(self) -> dict[str, bool]:
        """Names of all priors, and whether the parameter is one of the law of the readings."""
        of_law = {*self.truth.fixed, *self.truth.names}
        both = (*self.truth.unknowns, *(self.rival.unknowns if self.rival else ()))
        return {u.name: u.name in of_law for u in both if u.prior}

    @property
    def motion(self) -> dict[str, bool]:
        """Whether inertia and radiation damping count, as arguments of a response."""
        return {n: getattr(self.question, n) for n in ("inertia", "radiation_damping")}

    @property
    def budget(self) -> float:
        """The budget: a number of readings, or a time (s)."""
        return float(self.question.points or self.question.time or 0.0)

    def cost(self, V: Float) -> Float:
        """Cost of one reading at each velocity: 1, or settling_slip/V + integration (s)."""
        q = self.question
        if q.points is not None:
            return np.ones_like(V)
        return np.asarray((q.settling_slip or 0.0) / V + (q.integration or 0.0))

    def candidates(self) -> dict[str, Float]:
        """All combinations of the levels, by name of the axis; the last axis varies fastest."""
        grid = np.meshgrid(*self.axes.values(), indexing="ij")
        return {name: levels.ravel() for name, levels in zip(self.axes, grid, strict=True)}


def expected_values(hypothesis: Objective) -> dict[str, float]:
    """Expected values of the free parameters, in SI."""
    return {u.name: u.middle for u in hypothesis.unknowns}


def with_prior_means(hypothesis: Objective, means: Mapping[str, float]) -> Objective:
    """The hypothesis with other means of its priors, by name; those without a name stay."""
    unknowns = tuple(
        replace(u, prior=replace(u.prior, mean=means.get(u.name, u.prior.mean))) if u.prior else u
        for u in hypothesis.unknowns
    )
    return replace(hypothesis, unknowns=unknowns)


@typed
def read_plan(path: str | os.PathLike[str]) -> DesignPlan:
    """Read a plan from a TOML file; quantities carry their unit.

    Parameters
    ----------
    path : str or path

    Raises
    ------
    InputError
        If the file cannot be read, or a field is wrong.
    """
    file, content = toml_content(path, "plan")
    for key in ("law", "rival"):
        place = content.get(key)
        # A law that is defined in a file is searched in the folder of the plan.
        if isinstance(place, str) and ".py:" in place:
            content[key] = str(file.parent / place)
    with naming(in_files, symbols=str):
        try:
            return plan_of(content, name=file.name, require_unit=True)
        except InputError as error:
            raise error.worded().shortened().in_file(str(path)) from None


@typed
def plan_of(
    content: Mapping[str, Any] | Design, *, name: str = "plan", require_unit: bool = False
) -> DesignPlan:
    """A plan from the content of a file as a dictionary, or from a question.

    Parameters
    ----------
    content : mapping or Design
        Keys as in docs/design.md.
    name : str
        Name of the plan in messages and in the design.
    require_unit : bool
        Whether to refuse numbers without a unit, as in files; otherwise they are SI.

    Raises
    ------
    InputError
        If a field is wrong.
    """
    with units_required() if require_unit else contextlib.nullcontext():
        question = content if isinstance(content, Design) else Design(**content)
        return _checked(question, name)


def _checked(question: Design, name: str) -> DesignPlan:
    law = _law(question.law, "law")
    material = None if question.material is None else load_material(question.material)
    known = _known(law)
    axes = _axes(question, {n: p for n, p in known.items() if p.place != "law"})
    # A table with the ends of all axes stands for the candidates.
    ends = {n: np.array([levels.min(), levels.max()]) for n, levels in axes.items()}
    table = LockInTable(name, ends, {}, {})
    rival_law = None if question.rival is None else _law(question.rival, "rival")
    # Numbers of a plan may be of either law.
    every = known if rival_law is None else {**_known(rival_law), **known}
    truth = _hypothesis(question, law, every, question.free, material, table)
    rival = None
    if rival_law is not None:
        free = question.rival_free or tuple(n for n in truth.names if n in _known(rival_law))
        of_truth = () if rival_law is law else known
        rival = _hypothesis(question, rival_law, every, free, material, table, of_truth)
        holds = rival_law is not law or not set(truth.names) <= set(rival.names)
        rule, got = "differ from the law", f"{law.name} with the same free parameters"
        require(holds, "rival", rule, got, "name another law, or leave one out in rival_free")
    known_to_both = (*truth.unknowns, *(rival.unknowns if rival else ()))
    require_free_names(known_to_both, None, {n: p for n, p in question.prior.items() if p})
    noise = _noise(question)
    uncertainty = _uncertainties(question, known, material, truth)
    expected = {**truth.fixed, **expected_values(truth)}
    # A prior is another measurement of the interface that the readings are of.
    truth = with_prior_means(truth, expected)
    rival = None if rival is None else with_prior_means(rival, expected)
    plan = DesignPlan(name, question, axes, noise, truth, rival, uncertainty)
    require_motion(truth.names, plan.motion)
    for label in ("values", "fixed", "ranges"):
        require_motion(getattr(question, label), plan.motion, label=label)
    if rival is not None:
        require_motion(rival.names, plan.motion, label="rival_free")
    for parameter in question.measure:
        rule, advice = "name free parameters", f"free it or choose among {', '.join(truth.names)}"
        require(parameter in truth.names, "measure", rule, f"'{parameter}'", advice)
    largest = float(axes["epsilon"].max())
    for hypothesis in (truth, rival) if rival else (truth,):
        carried = {**hypothesis.fixed, **expected_values(hypothesis)}["eps_ratio"] * largest
        got, advice = f"{carried:g}", "contact would be lost"
        require(not carried >= 1, "ranges.epsilon times eps_ratio", "be below 1", got, advice)
    unknown = sum(1 for u in truth.unknowns if u.prior is None)
    if question.points is not None and question.points * len(noise) < unknown:
        rule = "give at least as many data as free parameters"
        got = f"{question.points * len(noise)} for {unknown} without a prior"
        raise InputError("points", rule, got, "plan more, or free fewer")
    return plan


def _law(name: str, field: str) -> type[Law]:
    law = get_law(known_law(name))
    advice = "its one number follows from the mean friction"
    require(law.rate_dependent, field, "depend on the velocity", law.name, advice)
    return law


def _known(law: type[Law]) -> dict[str, Parameter]:
    """Parameters that a plan may name."""
    every = {**point_parameters(law), EPS_RATIO.name: EPS_RATIO}
    return {n: p for n, p in every.items() if n not in MODULATION and n != "inertia"}


def _quantity(value: Any, parameter: Parameter, label: str) -> float:
    """A value of a parameter in SI, checked by the rule of the parameter."""
    return float(parameter.check(with_unit(value, parameter.kind, label), label))


def _numbers(question: Design, field: str, known: Mapping[str, Parameter]) -> dict[str, float]:
    """A table of values of parameters, in SI."""
    result = {}
    for name, value in getattr(question, field).items():
        if name not in known:
            rule = "have names of parameters"
            raise InputError(field, rule, f"'{name}'", suggestion(name, known))
        result[name] = _quantity(value, known[name], f"{field}.{name}")
    return result


def _axes(question: Design, known: Mapping[str, Parameter]) -> dict[str, Float]:
    """Levels of each range, in the order of the plan."""
    axes = {}
    for name, given in question.ranges.items():
        if name not in known or name == EPS_RATIO.name:
            rule = "be of the drive or the machine"
            raise InputError("ranges", rule, f"'{name}'", closest(name, known))
        axes[name] = _levels(name, given, known[name])
    count = math.prod(levels.size for levels in axes.values())
    rule = f"have at most {MOST} combinations"
    require(not count > MOST, "ranges", rule, count, "give fewer levels")
    return axes


def _levels(name: str, given: Range, parameter: Parameter) -> Float:
    """Values of one axis in SI: a list, or divisions of a range."""
    label = f"ranges.{name}"
    if given.values is not None:
        levels = np.array([_quantity(v, parameter, label) for v in given.values])
        if np.unique(levels).size != levels.size:
            raise InputError(label, "have each value once", list(given.values), "drop copies")
        return levels
    low = _quantity(given.from_, parameter, f"{label}.from")
    high = _quantity(given.to, parameter, f"{label}.to")
    require(low < high, f"{label}.to", "be above from", f"{high:g}", "exchange the two")
    log = (given.spacing or ("log" if name in _LOGARITHMIC else "linear")) == "log"
    rule, advice = "be positive with spacing 'log'", "raise it, or choose 'linear'"
    require(low > 0 or not log, f"{label}.from", rule, f"{low:g}", advice)
    return spaced(low, high, given.levels, log=log)


def _noise(question: Design) -> dict[str, NoiseLevel]:
    """Standard uncertainties of a reading, by observable, in the order of `OBSERVABLES`."""
    for name in question.noise:
        if name not in OBSERVABLES:
            rule = "be of observables"
            raise InputError("noise", rule, f"'{name}'", closest(name, OBSERVABLES))
    levels = {}
    for name in (name for name in OBSERVABLES if name in question.noise):
        absolute, relative = question.noise[name].absolute, question.noise[name].relative
        label, phase = f"noise.{name}", name.startswith("phase")
        rule = "be absolute"
        require(not phase or not relative, label, rule, "a relative part", "give an angle")
        if phase and not isinstance(absolute, str) and absolute != 0:
            rule = "be an angle in rad or deg, with its unit"
            raise InputError(label, rule, repr(absolute), "write it like '1 deg' or '20 mrad'")
        a = float(to_radians(absolute, label) if phase else to_si(absolute, "dimensionless", label))
        r = float(to_si(relative, "dimensionless", f"{label}.relative"))
        if a < 0 or r < 0 or (a == 0 and r == 0 and not phase):
            worst = max(a, r) if min(a, r) >= 0 else min(a, r)
            advice = "give the standard uncertainty of one reading"
            raise InputError(label, "be positive", f"{worst:g}", advice)
        levels[name] = NoiseLevel(a, r)
    return levels


def _hypothesis(
    question: Design,
    law: type[Law],
    every: Mapping[str, Parameter],
    free: Sequence[str],
    material: Material | None,
    table: LockInTable,
    of_truth: Collection[str] = (),
) -> Objective:
    """A law with its free and fixed parameters, without data.

    The numbers of the plan are of parameters in `every`. An expected value of a parameter that is
    not free is a fixed number; but those of `of_truth`, the parameters of another law that the
    readings follow, say nothing about this law. `table` stands for the candidates.
    """
    known = _known(law)
    given, fixed = (
        {n: v for n, v in _numbers(question, field, every).items() if n in known}
        for field in ("values", "fixed")
    )
    rule = "not have what ranges has"
    for name in fixed:
        require(name not in table.points, "fixed", rule, f"'{name}'", "drop one")
    for name in free:
        require(name not in table.points, "free", rule, f"'{name}'", "it is set, not fitted")
    for name in given:
        rule = "be given once"
        require(name not in fixed or name in free, f"values.{name}", rule, "two", "drop one")
        if name not in free and name not in of_truth:
            fixed[name] = given[name]
    start = start_values(law, free, {n: v for n, v in given.items() if n in free}, material)
    if "eps_ratio" in free:
        start.setdefault("eps_ratio", 1.0)
    missing = [n for n in free if n in known and n not in start]
    rule = f"have a value for each free parameter of {law.name}"
    got = f"none for {', '.join(missing)}"
    require(not missing, "values", rule, got, "a design is made for values that are expected")
    constants = fixed_values(law, table, free, fixed, material)
    load, largest = constants.get("W0", math.nan), float(table.points["epsilon"].max())
    start, priors = stiffness_of_table(start, priors_of(question.prior, free), load)
    unknowns = unknowns_of(law, free, largest_epsilon=largest, start=start, priors=priors)
    constants = {n: float(v) for n, v in constants.items() if n not in table.points}
    return Objective((), law, unknowns, constants)


def _uncertainties(
    question: Design,
    known: Mapping[str, Parameter],
    material: Material | None,
    truth: Objective,
) -> dict[str, float]:
    """Standard deviations of the free parameters that are drawn, in SI."""
    given = {}
    for name, value in question.uncertainty.items():
        label = f"uncertainty.{name}"
        holds, rule = name in known and name in truth.names, "be of free parameters"
        require(holds, "uncertainty", rule, f"'{name}'", "free it or leave it out")
        kind = known[name].kind
        given[name] = number(with_unit(value, kind, label), label, kind, "not negative")
    for name, published in published_numbers(material, truth.names).items():
        if published.uncertainty:
            given.setdefault(name, float(published.si_uncertainty or 0.0))
    rule = "have a free parameter to draw"
    require(given or not question.draws, "uncertainty", rule, "none", "add one, or leave draws out")
    return {n: given[n] for n in truth.names if n in given}
