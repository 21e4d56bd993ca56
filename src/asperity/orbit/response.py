"""The record of a periodic response, with its provenance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from asperity.arrays import Bool, Complex, Float
from asperity.errors import InputError
from asperity.loads import Harmonic, Modulation
from asperity.orbit.floquet import from_logs, kind_of_crossing, without_lost_arguments
from asperity.orbit.outcome import Outcome, sentences
from asperity.orbit.solution import Solution
from asperity.parameters import DRIVE, OUTPUTS, Parameter
from asperity.parameters.arguments import shown, typed
from asperity.parameters.parameter import (
    Drawn,
    SummaryLine,
    count_text,
    number_line,
    parameter_line,
)
from asperity.slider import Motion, Slider
from asperity.slider.parameters import equation_parameters, equation_values, equations_as_text

if TYPE_CHECKING:
    import xarray


#: Variables of the dataset with one value a point.
_VARIABLES = (
    *("mean_friction", "delta_mu", "mu_ss", "mu1", "mu2", "phase1", "phase2", "floquet_max"),
    *("mode", "mode_frequency", "growth_rate", "stable", "reverses", "converged", "result"),
)


@dataclass(frozen=True, repr=False)
class PeriodicResponse(Drawn):
    """Periodic response at one or many operating points.

    Convention: w(t) = 1 + eps cos(wt) and F/W0 = mean_friction + sum mu_n cos(n wt + phase_n), with
    peak amplitudes mu_n = |c_n| and phases arg c_n in (-pi, pi]. Under another `load` t = 0 is its
    phase theta = 0: phases are against the load where its first harmonic is largest there.

    Attributes
    ----------
    mean_friction : array, shape (...)
        Mean of F/W0.
    delta_mu : array, shape (...)
        mean_friction - mu_ss: negative where modulation lowers friction. Without modulation it is
        the force of radiation damping, eta V/W0, if the equations have one.
    mu_ss : array, shape (...)
        Friction coefficient of unmodulated steady sliding.
    harmonics : complex array, shape (..., count)
        c_1, c_2, ...
    mode, mode_frequency, growth_rate : array, shape (...)
        Bifurcation of the leading multiplier, its frequency (Hz) and growth rate (1/s).
    multipliers : complex array, shape (..., states)
        Floquet multipliers, by falling modulus.
    log_multipliers : complex array, shape (..., states)
        ln|m| + i arg m. Where a multiplier overflows ln|m| does not; arg m is then NaN. Of
        orbits so unstable that no mesh resolves them the first is a lower bound and the others are
        NaN; of multipliers that are 0 as doubles ln|m| is an estimate.
    stable : bool array, shape (...)
        All multipliers inside the unit circle; False where not converged.
    converged : bool array, shape (...)
    iterations : int array, shape (...)
        Steps of the fast method, or intervals of the mesh of the robust one.
    outcome : int array, shape (...)
        `Outcome` of each point.
    result : str array, shape (...)
        "converged", or why not.
    start : array, shape (..., states)
        States of `motion` at the phase theta = 0.
    waveform : array, shape (2, ..., samples)
        F/W0 and ln(v_plastic / V) at the phases `theta`; the latter is 0 for a law without rate
        dependence, which does not determine it.
    theta : array, shape (samples,)
    motion : Motion
        Equation of motion, with the slider.
    load : Modulation
        The modulation of the load.
    slider, velocity, epsilon, frequency
        The operating point, in SI; epsilon is the amplitude of the load's first harmonic.
    """

    _drawn_by = "asperity.figures.response:draw_response"

    mean_friction: Float
    mu_ss: Float
    harmonics: Complex
    log_multipliers: Complex
    start: Float
    waveform: Float
    iterations: NDArray[np.int64]
    outcome: NDArray[np.int64]
    detail: Float
    motion: Motion
    load: Modulation

    @classmethod
    @typed
    def from_search(
        cls,
        solution: Solution,
        shape: tuple[int, ...],
        mu_ss: Float | float,
        motion: Motion,
        load: Modulation,
    ) -> PeriodicResponse:
        """The results of a search in the shape of the arguments."""

        def shaped(a: np.ndarray) -> np.ndarray:
            return np.moveaxis(a, -1, 0).reshape((*shape, *a.shape[:-1]))

        names = ("mean_friction", "harmonics", "start", "iterations", "outcome", "detail")
        return cls(
            **{name: shaped(getattr(solution, name)) for name in names},
            mu_ss=mu_ss,
            log_multipliers=without_lost_arguments(shaped(solution.log_multipliers)),
            waveform=np.stack([shaped(part) for part in solution.waveform]),
            motion=motion,
            load=load,
        )

    @property
    def slider(self) -> Slider:
        """Law, spring, mass and mean load."""
        return self.motion.slider

    @property
    def velocity(self) -> Float:
        """Pulling velocity (m/s)."""
        return np.asarray(self.motion.V)

    @property
    def epsilon(self) -> Float:
        """Amplitude of the first harmonic of the load."""
        return np.asarray(self.load.amplitude)

    @property
    def has_epsilon(self) -> bool:
        """Whether the load is harmonic or has a first harmonic; a modulated pull has none."""
        return isinstance(self.load, Harmonic) or bool(np.any(self.epsilon))

    @property
    def frequency(self) -> Float:
        """Modulation frequency (Hz)."""
        return np.asarray(self.motion.omega) / (2 * np.pi)

    @property
    def delta_mu(self) -> Float:
        """Change of the mean by the modulation."""
        return self.mean_friction - self.mu_ss

    @property
    def mu1(self) -> Float:
        """Amplitude of the first harmonic over W0."""
        return np.abs(self.harmonics[..., 0])

    @property
    def mu2(self) -> Float:
        """Amplitude of the second harmonic over W0."""
        return np.abs(self.harmonics[..., 1])

    @property
    def phase1(self) -> Float:
        """Phase of the first harmonic against cos wt (rad); no meaning at epsilon 0."""
        return np.angle(self.harmonics[..., 0])

    @property
    def phase2(self) -> Float:
        """Phase of the second harmonic against cos 2wt (rad); no meaning at epsilon 0."""
        return np.angle(self.harmonics[..., 1])

    @property
    def multipliers(self) -> Complex:
        """Floquet multipliers; beyond the range of doubles they are inf or 0."""
        return from_logs(self.log_multipliers)

    @property
    def floquet_max(self) -> Float:
        """Largest modulus of the multipliers; 0 for a law without dynamics."""
        with np.errstate(over="ignore"):
            return np.exp(_leading(self.log_multipliers).real)

    @property
    def converged(self) -> Bool:
        """Whether each point was solved."""
        return np.asarray(self.outcome == Outcome.CONVERGED)

    @property
    def reverses(self) -> Bool:
        """Whether slip would reverse for part of the period, of a law that slips forwards only.

        Such an orbit obeys the equations as they stand, but no interface.
        """
        return self.converged & np.asarray(self.detail < 0)

    @property
    def stable(self) -> Bool:
        """Whether a small perturbation dies out from period to period; it may grow within one."""
        with np.errstate(invalid="ignore"):
            return self.converged & np.asarray(self.floquet_max < 1)

    @property
    def mode(self) -> NDArray[np.object_]:
        """Bifurcation by the argument of the leading multiplier, stable or not.

        "fold", "period doubling" or "Neimark-Sacker"; "" where not converged or not known.
        """
        return kind_of_crossing(_leading(self.log_multipliers))

    @property
    def mode_frequency(self) -> Float:
        """Frequency of the leading mode (Hz): 0 at a fold, f/2 at a period doubling.

        Known from the monodromy up to multiples of the modulation frequency f and up to its sign.
        """
        return np.asarray(
            np.abs(_leading(self.log_multipliers).imag) / (2 * np.pi) * self.frequency
        )

    @property
    def growth_rate(self) -> Float:
        """Rate at which the leading mode grows (1/s); negative where the orbit is stable."""
        return np.asarray(_leading(self.log_multipliers).real * self.frequency)

    @property
    def result(self) -> NDArray[np.object_]:
        """For each point "converged", with the reservation of `reverses`, or why it failed."""
        return sentences(np.asarray(self.outcome), np.asarray(self.detail))

    @property
    def theta(self) -> Float:
        """Phases of the waveform (rad)."""
        samples = self.waveform.shape[-1]
        return 2 * np.pi * np.arange(samples) / max(samples, 1)

    def summary(self) -> tuple[str, list[SummaryLine]]:
        """Law, equation of motion, and the outcome."""
        law, points = self.slider.law.name, self.mean_friction.size
        title = f"PeriodicResponse, {law}, {self.motion.name}, {count_text(points, 'point')}"
        names = ("V", "epsilon", "frequency") if self.has_epsilon else ("V", "frequency")
        lines = [parameter_line(DRIVE[n], getattr(self, DRIVE[n].argument)) for n in names]
        lines += [
            number_line(name, getattr(self, name), OUTPUTS[name].meaning)
            for name in ("mean_friction", "delta_mu", "mu1", "mu2", "floquet_max")
        ]
        if points == 1:
            lines.append(
                SummaryLine("stable", str(bool(self.stable.item())), OUTPUTS["stable"].meaning)
            )
            return title, [*lines, SummaryLine("result", str(self.result.item()))]
        stable, converged = int(self.stable.sum()), int(self.converged.sum())
        lines.append(SummaryLine("stable", f"{stable} of {points}", OUTPUTS["stable"].meaning))
        return title, [*lines, SummaryLine("converged", f"{converged} of {points}")]

    def to_dataset(self, dims: tuple[str, ...] | None = None) -> xarray.Dataset:
        """The response as a labelled dataset, ready for NetCDF.

        Parameters
        ----------
        dims : tuple of str, optional
            Names of the axes. By default an axis along which one parameter varies, and that
            varies along no other, has the name of the parameter; others are ``axis_0``, ...

        Returns
        -------
        xarray.Dataset
            Every variable has `units` and `long_name`; real and imaginary parts of complex ones
            are separate variables. All parameters are coordinates, those that vary along the
            axes that they vary along; attributes hold the provenance.

        Raises
        ------
        InputError
            If `dims` does not have one name for each axis.
        """
        import xarray

        shape = self.mean_friction.shape
        values = self._parameter_values()
        dims = dimension_names(shape, {n: np.shape(v) for n, (_, v) in values.items()}, dims)

        def variable(name: str, array: Any, *extra: str, part: str = "") -> tuple:
            output = OUTPUTS[name]
            label = f"{part} part of {output.meaning}" if part else output.meaning
            return (*dims, *extra), array, {"units": output.unit, "long_name": label}

        data = {name: variable(name, getattr(self, name)) for name in _VARIABLES}
        for name in ("mode", "result"):
            data[name] = variable(name, getattr(self, name).astype(str))
        for name, axis in (("harmonics", "harmonic"), ("log_multipliers", "multiplier")):
            for part in ("real", "imag"):
                array = getattr(getattr(self, name), part)
                data[f"{name}_{part}"] = variable(name, array, axis, part=part)
        coords = {}
        for name, (parameter, value) in values.items():
            array = np.asarray(value)
            of_array = dims[len(dims) - array.ndim :]
            long = [d for d, size in zip(of_array, array.shape, strict=True) if size > 1]
            coords[name] = (
                long,
                array.reshape([n for n in array.shape if n > 1]),
                parameter.attributes,
            )
        return xarray.Dataset(data, coords=coords, attrs=self.provenance)

    def _parameter_values(self) -> dict[str, tuple[Parameter, Any]]:
        """Parameters of the equations and of the drive with their values, of any shape."""
        known = equation_parameters(self.motion, self.load)
        values = equation_values(self.motion, self.load)
        # A load that is not harmonic has no epsilon: its first harmonic gives it.
        pairs = {name: (p, values[name]) for name, p in known.items()}
        return pairs | {"epsilon": (DRIVE["epsilon"], self.epsilon)}

    @property
    def provenance(self) -> dict[str, Any]:
        """Version, law, conventions, tolerance and source of the numbers."""
        return {
            **equations_as_text(self.motion, equation_values(self.motion, self.load)),
            "relative_tolerance": 1e-8,
            "modulation": self.load.formula,
            "convention": "F/W0 = mean + sum mu_n cos(n w t + phase_n), load w(t) = W/W0",
        }


def _leading(logs: Complex) -> Complex:
    """Logarithm of the leading multiplier; of a law without dynamics that of 0."""
    if logs.shape[-1] == 0:
        return np.full(logs.shape[:-1], complex(-np.inf, np.nan))
    return logs[..., 0]


def dimension_names(
    shape: tuple[int, ...], shapes: Mapping[str, tuple[int, ...]], dims: Any = None
) -> tuple[str, ...]:
    """Names of the axes of a grid.

    Parameters
    ----------
    shape : tuple of int
        Shape of the grid.
    shapes : mapping of str to tuple of int
        Shape of each parameter, broadcastable to `shape`.
    dims : tuple of str, optional
        Names of the axes in place of automatic ones.

    Raises
    ------
    InputError
        If there are not as many names as axes, or a name occurs twice.
    """
    if dims is not None:
        chosen = [dims] if isinstance(dims, str) else dims
        texts = isinstance(chosen, list | tuple) and all(isinstance(n, str) for n in chosen)
        if texts and len(chosen) == len(set(chosen)) == len(shape):
            return tuple(chosen)
        rule = f"be {len(shape)} different names, one for each axis"
        advice = "leave it out to have the axes named by what varies"
        raise InputError("dims", rule, shown(dims), advice)
    along: dict[str, list[int]] = {}
    for name, shape_of in shapes.items():
        along[name] = [
            i + len(shape) - len(shape_of) for i, size in enumerate(shape_of) if size > 1
        ]
    names = []
    for axis in range(len(shape)):
        varying = [name for name, axes in along.items() if axis in axes]
        alone = len(varying) == 1 and along[varying[0]] == [axis]
        names.append(varying[0] if alone else f"axis_{axis}")
    return tuple(names)
