"""A plan of an experiment: settings, noise of the readings, and aim."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field, StrictBool, StrictInt, model_validator

from asperity.errors import InputError, MistakesError, require
from asperity.questions.fit import Priors
from asperity.questions.record import WHOLE, Given, Names, Question, Record, quantity
from asperity.questions.sweep import PlanError

#: Readings, levels of an axis, and draws at most.
MOST, _MOST_DRAWS = 100_000, 1000


class Range(Record):
    """Values that one quantity can take: a value, a list, or ``from`` and ``to``.

    Attributes
    ----------
    values : tuple of float or str, optional
    from_, to : float or str, optional
        Ends of a range, written ``from``.
    levels : int
        Values of a range.
    spacing : {"log", "linear"}, optional
        Spacing of the levels; by default equal factors for V and frequency.
    """

    values: tuple[Given, ...] | None = None
    from_: Given | None = Field(default=None, alias="from")
    to: Given | None = None
    levels: Annotated[StrictInt, Field(ge=2, le=MOST), WHOLE] = 7
    spacing: Literal["log", "linear"] | None = None

    @model_validator(mode="before")
    @classmethod
    def _listed(cls, value: Any) -> Any:
        if isinstance(value, Mapping):
            return value
        several = isinstance(value, list | tuple | np.ndarray)
        return {"values": tuple(value) if several else (value,)}

    @model_validator(mode="after")
    def _one_form(self) -> Range:
        of_range = self.model_fields_set - {"values"}
        if self.values is not None and of_range:
            got = f"values and {', '.join(sorted(name.rstrip('_') for name in of_range))}"
            raise InputError("", "have values, or from and to", got, "leave one out")
        if self.values is None and (self.from_ is None or self.to is None):
            raise InputError("", "have from and to", "only one end", "give both")
        if self.values is not None and not self.values:
            raise InputError("", "have values", "an empty list", "give one")
        return self


class Noise(Record):
    """Standard uncertainty of one reading: sqrt(absolute^2 + (relative * value)^2).

    Attributes
    ----------
    absolute : float or str
        In the unit of the observable; of a phase with its unit.
    relative : float or str
    """

    absolute: Given = 0.0
    relative: Given = 0.0

    @model_validator(mode="before")
    @classmethod
    def _plain(cls, value: Any) -> Any:
        return value if isinstance(value, Mapping) else {"absolute": value}


class Design(Question):
    """A plan of an experiment.

    Attributes
    ----------
    law : str
        Law that the readings are expected to follow.
    free : tuple of str
        Free parameters of the later fit.
    ranges : dict of str to Range
        V, epsilon, frequency, and other settings of the machine.
    noise : dict of str to Noise
        For each observable that is measured.
    measure : tuple of str
        Parameters to be measured; or `rival` is given.
    rival : str, optional
        A law that the readings shall exclude.
    rival_free : tuple of str, optional
        Its free parameters.
    points : int, optional
        Readings; or `time` is given.
    time : float or str, optional
        Time available (s).
    settling_slip : float or str
        Slip before each reading (m).
    integration : float or str
        Duration of a reading (s).
    material : str, optional
    prior : dict of str to NormalPrior
    values, fixed : dict of str to float or str
        Expected values of free parameters, and fixed ones.
    draws : int
        Values of the uncertain parameters to average over.
    uncertainty : dict of str to float or str
        Standard deviations of the free parameters over which is averaged.
    usable_share : float
        Share of the draws in which a point must slide steadily to be a candidate.
    inertia, radiation_damping : bool
    seed : int
    """

    subject: ClassVar[str] = "plan"
    mistakes_error: ClassVar[type[MistakesError]] = PlanError

    law: str
    free: Annotated[Names, Field(min_length=1)]
    ranges: dict[str, Range]
    noise: Annotated[dict[str, Noise], Field(min_length=1)]
    measure: Names = ()
    rival: str | None = None
    rival_free: Names | None = None
    points: Annotated[StrictInt, Field(ge=1, le=MOST), WHOLE] | None = None
    time: quantity("time", "positive") | None = None  # type: ignore[valid-type]
    settling_slip: quantity("length", "not negative") | None = None  # type: ignore[valid-type]
    integration: quantity("time", "not negative") | None = None  # type: ignore[valid-type]
    material: str | None = None
    prior: Priors = Field(default_factory=dict)
    values: dict[str, Given] = Field(default_factory=dict)
    fixed: dict[str, Given] = Field(default_factory=dict)
    draws: Annotated[StrictInt, Field(ge=0, le=_MOST_DRAWS), WHOLE] = 0
    uncertainty: dict[str, Given] = Field(default_factory=dict)
    usable_share: Annotated[quantity("dimensionless"), Field(gt=0, le=1)] = 0.9  # type: ignore[valid-type]
    inertia: StrictBool = False
    radiation_damping: StrictBool = False
    seed: Annotated[StrictInt, Field(ge=0, le=2**31 - 1), WHOLE] = 0

    @model_validator(mode="after")
    def _one_aim(self) -> Design:
        if bool(self.measure) == (self.rival is not None):
            rule, got = "have one aim, measure or rival", "both" if self.measure else "none"
            raise InputError("plan", rule, got, "name parameters to measure, or a rival law")
        if self.rival_free is not None and self.rival is None:
            raise InputError("rival_free", "go with a rival", "no rival", "leave it out")
        if self.draws and self.rival is not None:
            advice = "laws are separated at one set of values"
            raise InputError("draws", "be 0 with a rival", self.draws, advice)
        missing = [n for n in ("V", "epsilon", "frequency") if n not in self.ranges]
        rule, got = "have V, epsilon and frequency", f"none for {', '.join(missing)}"
        require(not missing, "ranges", rule, got, "give a value, a list, or from and to")
        for n in (1, 2):
            holds = f"phase{n}" not in self.noise or f"mu{n}" in self.noise
            require(holds, "noise", f"have mu{n} where it has phase{n}", "none", "add it")
        return self

    @model_validator(mode="after")
    def _used_by_draws(self) -> Design:
        for name in ("uncertainty", "usable_share"):
            unset = getattr(self, name) == Design.model_fields[name].get_default(
                call_default_factory=True
            )
            require(self.draws or unset, name, "go with draws", "none", "add draws, like draws = 8")
        return self

    @model_validator(mode="after")
    def _one_budget(self) -> Design:
        if (self.points is None) == (self.time is None):
            rule, got = "have points or time", "none" if self.points is None else "both"
            raise InputError("plan", rule, got, "give a number of readings, or the time available")
        costs = {n: getattr(self, n) for n in ("settling_slip", "integration")}
        given = [n for n, cost in costs.items() if cost is not None]
        if self.points is not None and given:
            raise InputError(given[0], "go with time", "points", "leave it out")
        if self.time is not None and not any(costs.values()):
            got = "no settling_slip and no integration"
            raise InputError("plan", "say what a reading takes", got, "give one or both")
        return self
