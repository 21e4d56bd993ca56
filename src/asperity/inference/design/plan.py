"""A plan of an experiment in SI: what can be set, what is measured how well, and what is asked."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from asperity.inference.unknowns import Unknown
from asperity.laws import Law

Float = NDArray[np.float64]


@dataclass(frozen=True)
class Axis:
    """Values that one quantity of the experiment can take.

    Attributes
    ----------
    name : str
        V, epsilon (as applied), frequency, or a parameter of the machine.
    levels : array, shape (n,)
        In SI, as given or evenly spaced between the ends of a range.
    """

    name: str
    levels: Float


@dataclass(frozen=True)
class NoiseLevel:
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


@dataclass(frozen=True)
class Budget:
    """What limits the experiment: a number of readings, or a time.

    Attributes
    ----------
    readings : int or None
    time : float or None
        Time available (s).
    settling_slip : float
        Slip before each reading (m): it takes settling_slip/V.
    integration : float
        Duration of a reading (s).
    """

    readings: int | None = None
    time: float | None = None
    settling_slip: float = 0.0
    integration: float = 0.0

    @property
    def total(self) -> float:
        """What may be spent: a number of readings, or a time (s)."""
        return float(self.readings if self.readings is not None else self.time or 0.0)

    def cost(self, V: Float) -> Float:
        """What one reading costs at each velocity, in the unit of `total`."""
        if self.readings is not None:
            return np.ones_like(V)
        return self.settling_slip / V + self.integration


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """A law with its free parameters, as a later fit would have them.

    Attributes
    ----------
    law : type of Law
    unknowns : tuple of Unknown
    values : mapping of str to float
        Values of the free parameters that the design is made for, in SI.
    fixed : mapping of str to float
    """

    law: type[Law]
    unknowns: tuple[Unknown, ...]
    values: Mapping[str, float]
    fixed: Mapping[str, float]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the free parameters."""
        return tuple(u.name for u in self.unknowns)

    @property
    def coordinates(self) -> Float:
        """Coordinates of `values`."""
        return np.array([float(u.to_coordinate(self.values[u.name])) for u in self.unknowns])


@dataclass(frozen=True, eq=False)
class DesignPlan:
    """A checked plan.

    Attributes
    ----------
    name : str
        What messages call the plan.
    axes : tuple of Axis
    noise : mapping of str to NoiseLevel
        By observable: what is measured.
    budget : Budget
    truth : Hypothesis
        The law that the readings are expected to follow.
    rival : Hypothesis or None
        The law to be excluded; None where parameters are to be measured.
    measured : tuple of str
        Parameters to be measured; empty where a law is to be excluded.
    draws : int
        Values of the uncertain parameters to average over; 0 for the given values alone.
    uncertainty : mapping of str to float
        Standard deviation of the free parameters over which is averaged, in SI.
    usable_share : float
        Share of the draws in which a point must slide steadily to be a candidate.
    inertia, radiation_damping : bool
    seed : int
    """

    name: str
    axes: tuple[Axis, ...]
    noise: Mapping[str, NoiseLevel]
    budget: Budget
    truth: Hypothesis
    rival: Hypothesis | None = None
    measured: tuple[str, ...] = ()
    draws: int = 0
    uncertainty: Mapping[str, float] = field(default_factory=dict)
    usable_share: float = 0.9
    inertia: bool = False
    radiation_damping: bool = False
    seed: int = 0

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of levels along each axis."""
        return tuple(a.levels.size for a in self.axes)

    def candidates(self) -> dict[str, Float]:
        """Every combination of the levels, by name of the axis, the last axis fastest."""
        grid = np.array(list(itertools.product(*(a.levels for a in self.axes))))
        return {a.name: grid[:, i] for i, a in enumerate(self.axes)}
