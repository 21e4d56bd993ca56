"""A branch of periodic orbits: points, stability and bifurcations."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from asperity.arrays import Bool, Complex, Float
from asperity.orbit.floquet import from_logs
from asperity.parameters.parameter import Displayed, SummaryLine, count_text, number_line
from asperity.slider import Motion
from asperity.slider.parameters import equations_as_text

if TYPE_CHECKING:
    import xarray

    from asperity.branches.follower import BranchFollower, BranchOrbit
    from asperity.branches.parameters import ContinuedParameter
    from asperity.orbit.mesh.arclength import ContinuationPoint
    from asperity.slider.problem import Problem


@dataclass(frozen=True)
class Bifurcation:
    """A bifurcation of a branch.

    Attributes
    ----------
    kind : str
        "fold", "period doubling" or "Neimark-Sacker"; "branch point" where a multiplier passes
        +1 and the branch does not turn.
    value : float
        Value of the parameter, SI.
    error : float
        Relative change of `value` between two meshes; inf where the finer one failed.
    mean_friction : float
    log_multipliers : complex array, shape (states,)
        ln|m| + i arg m by falling modulus.
    frequency : float
        Frequency (Hz) of the mode that passes the unit circle, between 0 and half the frequency of
        the modulation: multipliers do not tell frequencies apart that differ by whole multiples of
        the latter. 0 at folds.
    unstable_before, unstable_after : int
        Number of multipliers outside the unit circle on the two sides, along the branch.
    index : int
        The bifurcation lies between this point of the branch and the next.
    critical : BranchOrbit
        The critical orbit, from which a doubled branch starts.
    """

    kind: str
    value: float
    error: float
    mean_friction: float
    log_multipliers: Complex
    frequency: float
    unstable_before: int
    unstable_after: int
    index: int
    critical: BranchOrbit = field(repr=False)

    @property
    def multipliers(self) -> Complex:
        """Floquet multipliers by falling modulus."""
        return from_logs(self.log_multipliers)

    @property
    def stability_change(self) -> int:
        """+1 if the branch becomes stable here, -1 if it becomes unstable, else 0."""
        return int(self.unstable_after == 0) - int(self.unstable_before == 0)

    def __str__(self) -> str:
        """One line."""
        mode = f", mode at {self.frequency:.6g} Hz" if self.frequency else ""
        return (
            f"{self.kind} at {self.value:.10g}{mode}: "
            f"{self.unstable_before} -> {self.unstable_after} unstable multipliers"
        )


class BranchOrigin(NamedTuple):
    """Line and operating point of a branch.

    Attributes
    ----------
    follower : BranchFollower
    moving : ContinuedParameter
    problem : Problem
        The operating point at the start.
    """

    follower: BranchFollower
    moving: ContinuedParameter
    problem: Problem


@dataclass(frozen=True, repr=False)
class Branch(Displayed):
    """A branch of periodic orbits in one parameter, in the order in which it was followed.

    Convention as `PeriodicResponse`: F/W0 = mean_friction + sum Re(c_n e^{i n w t}). On a branch
    of doubled period mean and harmonics are those over two periods of the modulation, c_n
    belongs to n f / 2, and a multiplier is that of two periods.

    Attributes
    ----------
    name, unit : str
        The parameter and its SI unit.
    parameter : array, shape (points,)
        Values along the branch; not monotonic at folds.
    mean_friction : array, shape (points,)
    harmonics : complex array, shape (points, count)
        c_1, c_2, ...
    log_multipliers : complex array, shape (points, states)
        ln|m| + i arg m by falling modulus.
    reverses : bool array, shape (points,)
        Whether slip would reverse on the orbit, see `PeriodicResponse.reverses`.
    periods : int
        Periods of the modulation in a period of the orbit.
    bifurcations : tuple of Bifurcation
        In the order of the branch.
    result : str
        Reason why the branch ends, and where a bifurcation was not located.
    completed : bool
        Whether the branch ends at an end of the span.
    motion : Motion
        Equation of motion, with the slider; the continued parameter has its value at the start.
    fixed : dict
        The other parameters of the operating point, SI.
    origin : BranchOrigin
        Line and operating point, from which a doubled branch starts.
    last : ContinuationPoint
        The last orbit, on its mesh.
    """

    name: str
    unit: str
    parameter: Float
    mean_friction: Float
    harmonics: Complex
    log_multipliers: Complex
    reverses: Bool
    periods: int
    bifurcations: tuple[Bifurcation, ...]
    result: str
    completed: bool
    motion: Motion
    fixed: dict[str, float]
    origin: BranchOrigin = field(repr=False)
    last: ContinuationPoint = field(repr=False)

    def summary(self) -> tuple[str, list[SummaryLine]]:
        """The parameter, and the bifurcations of the branch."""
        law = self.motion.slider.law.name
        points = count_text(len(self.parameter), "point")
        lines = [
            number_line(self.name, self.parameter, self.unit),
            number_line("mean_friction", self.mean_friction),
            *(SummaryLine("bifurcation", str(b)) for b in self.bifurcations),
            SummaryLine("result", self.result),
        ]
        return f"Branch, {law}, {self.motion.name}, {points}", lines

    @property
    def mu1(self) -> Float:
        """Amplitude of the harmonic at the frequency of the modulation, over W0."""
        return np.abs(self.harmonics[:, self.periods - 1])

    @property
    def mu2(self) -> Float:
        """Amplitude of the harmonic at twice the frequency of the modulation, over W0."""
        return np.abs(self.harmonics[:, 2 * self.periods - 1])

    @property
    def multipliers(self) -> Complex:
        """Floquet multipliers; beyond the range of doubles they are inf or 0."""
        return from_logs(self.log_multipliers)

    @property
    def unstable(self) -> NDArray[np.int64]:
        """Number of multipliers outside the unit circle."""
        return np.asarray((self.log_multipliers.real > 0).sum(1))

    @property
    def stable(self) -> Bool:
        """Whether a small perturbation dies out."""
        return np.asarray((self.log_multipliers.real < 0).all(1))

    @property
    def thresholds(self) -> Float:
        """Values of the parameter at which the leading multiplier crosses the unit circle."""
        return np.array([b.value for b in self.bifurcations if b.stability_change])

    def to_dataset(self) -> xarray.Dataset:
        """The branch as a labelled dataset, ready for NetCDF.

        Returns
        -------
        xarray.Dataset
            Along the dimensions `point` and `bifurcation`; every variable has `units` and
            `long_name`, real and imaginary parts are separate variables.
        """
        import xarray

        def variable(dims: tuple[str, ...], values: Any, units: str, name: str) -> tuple:
            return dims, values, {"units": units or "1", "long_name": name}

        points = {
            "parameter": (self.unit, self.name),
            "mean_friction": ("", "mean of F/W0"),
            "mu1": ("", "amplitude of F/W0 at the frequency of the modulation, peak"),
            "mu2": ("", "amplitude of F/W0 at twice the frequency of the modulation, peak"),
            "stable": ("", "whether all multipliers are inside the unit circle"),
            "reverses": ("", "whether slip would reverse, of a law that slips forwards only"),
        }
        data = {n: variable(("point",), getattr(self, n), *about) for n, about in points.items()}
        bifurcations = {
            "kind": ("", "kind of the bifurcation"),
            "value": (self.unit, self.name),
            "frequency": ("Hz", "frequency of the critical mode"),
            "stability_change": ("", "+1 gained, -1 lost, 0 neither"),
        }
        for name, about in bifurcations.items():
            values = np.array([getattr(b, name) for b in self.bifurcations])
            data[f"bifurcation_{name}"] = variable(("bifurcation",), values, *about)
        for name, axis in (("harmonics", "harmonic"), ("log_multipliers", "multiplier")):
            for part in ("real", "imag"):
                values, label = getattr(getattr(self, name), part), f"{part} part of {name}"
                data[f"{name}_{part}"] = variable(("point", axis), values, "", label)
        return xarray.Dataset(data, attrs=self.provenance)

    @property
    def provenance(self) -> dict[str, Any]:
        """Version, law, equation of motion, load, fixed parameters, and why the branch ends."""
        return {
            **equations_as_text(self.motion, self.fixed),
            "continued_parameter": self.name,
            "periods": self.periods,
            "result": self.result,
            "modulation": self.origin.problem.load.formula,
            "convention": "F/W0 = mean + sum Re(c_n e^{i n w t / periods}), c_n in harmonics_real "
            "and harmonics_imag; mu1 and mu2 are the amplitudes at w and 2 w",
        }
