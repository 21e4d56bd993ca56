"""The record of a periodic response."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from asperity.loads import Modulation
from asperity.slider import Motion, Slider
from asperity.solve.floquet import from_logs, kind_of_crossing, without_lost_arguments
from asperity.solve.outcome import Outcome, sentences
from asperity.solve.provenance import provenance_of

if TYPE_CHECKING:
    import xarray

Float = NDArray[np.float64]


@dataclass(frozen=True)
class PeriodicResponse:
    """Periodic response at one or many operating points.

    Convention: w(t) = 1 + eps cos(wt) and F/W0 = mean_friction + sum mu_n cos(n wt + phase_n), with
    peak amplitudes mu_n = |c_n| and phases arg c_n in (-pi, pi].

    Attributes
    ----------
    mean_friction : array, shape (...)
        Mean of F/W0.
    delta_mu : array, shape (...)
        mean_friction - mu_ss(V): negative where modulation lowers friction.
    mu_ss : array, shape (...)
        Friction coefficient of unmodulated steady sliding.
    harmonics : complex array, shape (..., count)
        c_1, c_2, ...
    mode, mode_frequency, growth_rate : array, shape (...)
        What the leading multiplier stands for, its frequency (Hz) and growth rate (1/s).
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
        F/W0 and ln(v_plastic / V) at the phases `theta`.
    theta : array, shape (samples,)
    motion : Motion
        Equation of motion, with the slider.
    load : Modulation
        What is modulated.
    slider, velocity, epsilon, frequency
        What was asked, in SI; epsilon is the amplitude of the load's first harmonic.
    """

    mean_friction: Float
    mu_ss: Float
    harmonics: NDArray[np.complex128]
    log_multipliers: NDArray[np.complex128]
    start: Float
    waveform: Float
    iterations: NDArray[np.int64]
    outcome: NDArray[np.int64]
    detail: Float
    motion: Motion
    load: Modulation

    @classmethod
    def from_search(
        cls,
        found: Any,
        shape: tuple[int, ...],
        mu_ss: Float,
        motion: Motion,
        load: Modulation,
    ) -> PeriodicResponse:
        """Lay the results of a search out in the shape of the question."""

        def shaped(a: np.ndarray) -> np.ndarray:
            return np.moveaxis(a, -1, 0).reshape((*shape, *a.shape[:-1]))

        return cls(
            mean_friction=shaped(found.mean_friction),
            mu_ss=mu_ss,
            harmonics=shaped(found.harmonics),
            log_multipliers=without_lost_arguments(shaped(found.log_multipliers)),
            start=shaped(found.start),
            waveform=np.stack([shaped(found.waveform[0]), shaped(found.waveform[1])]),
            iterations=shaped(found.iterations),
            outcome=shaped(found.outcome),
            detail=shaped(found.detail),
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
        """Phase of the first harmonic against the load (rad)."""
        return np.angle(self.harmonics[..., 0])

    @property
    def phase2(self) -> Float:
        """Phase of the second harmonic against the load's phase (rad)."""
        return np.angle(self.harmonics[..., 1])

    @property
    def multipliers(self) -> NDArray[np.complex128]:
        """Floquet multipliers; beyond the range of doubles they are inf or 0."""
        return from_logs(self.log_multipliers)

    @property
    def floquet_max(self) -> Float:
        """Largest modulus of the multipliers; 0 for a law without dynamics."""
        if self.log_multipliers.shape[-1] == 0:
            return np.zeros(self.mean_friction.shape)
        with np.errstate(over="ignore"):
            return np.exp(self.log_multipliers[..., 0].real)

    @property
    def converged(self) -> NDArray[np.bool_]:
        """Whether each point was solved."""
        return np.asarray(self.outcome == Outcome.CONVERGED)

    @property
    def stable(self) -> NDArray[np.bool_]:
        """Whether a small perturbation dies out."""
        with np.errstate(invalid="ignore"):
            return self.converged & np.asarray(self.floquet_max < 1)

    @property
    def mode(self) -> NDArray[np.object_]:
        """Bifurcation that the leading multiplier stands for, whether it has crossed or not.

        "fold", "period doubling" or "Neimark-Sacker"; "" where not converged or not known.
        """
        if self.log_multipliers.shape[-1] == 0:
            return np.full(self.mean_friction.shape, "", dtype=object)
        return kind_of_crossing(self.log_multipliers[..., 0])

    @property
    def mode_frequency(self) -> Float:
        """Frequency of the leading mode (Hz): 0 at a fold, f/2 at a period doubling.

        Known from the monodromy up to multiples of the modulation frequency f and up to its sign.
        """
        if self.log_multipliers.shape[-1] == 0:
            return np.full(self.mean_friction.shape, np.nan)
        turn = np.abs(self.log_multipliers[..., 0].imag) / (2 * np.pi)
        return np.asarray(turn * self.frequency)

    @property
    def growth_rate(self) -> Float:
        """Rate at which the leading mode grows (1/s); negative where the orbit is stable."""
        if self.log_multipliers.shape[-1] == 0:
            return np.full(self.mean_friction.shape, -np.inf)
        return np.asarray(self.log_multipliers[..., 0].real * self.frequency)

    @property
    def result(self) -> NDArray[np.object_]:
        """Of each point: converged, or the reason why not."""
        return sentences(np.asarray(self.outcome), np.asarray(self.detail))

    @property
    def theta(self) -> Float:
        """Phases of the waveform (rad)."""
        samples = self.waveform.shape[-1]
        return 2 * np.pi * np.arange(samples) / max(samples, 1)

    def to_dataset(self, dims: tuple[str, ...] | None = None) -> xarray.Dataset:
        """The response as a labelled dataset, ready for NetCDF.

        Parameters
        ----------
        dims : tuple of str, optional
            Names of the axes; ``axis_0``, ... by default.

        Returns
        -------
        xarray.Dataset
            Every variable has `units` and `long_name`; real and imaginary parts of complex ones
            are variables of their own; attributes hold the provenance.
        """
        import xarray

        shape = self.mean_friction.shape
        dims = dims or tuple(f"axis_{i}" for i in range(len(shape)))

        def variable(values: Any, units: str, name: str, *extra: str) -> tuple:
            return (*dims, *extra), values, {"units": units, "long_name": name}

        def asked(values: Any, units: str, name: str) -> tuple:
            return variable(np.broadcast_to(values, shape), units, name)

        data = {
            "mean_friction": variable(self.mean_friction, "1", "mean of F/W0"),
            "delta_mu": variable(self.delta_mu, "1", "change of the mean by the modulation"),
            "mu1": variable(self.mu1, "1", "first harmonic of F/W0, peak"),
            "mu2": variable(self.mu2, "1", "second harmonic of F/W0, peak"),
            "phase1": variable(self.phase1, "rad", "phase of the first harmonic"),
            "phase2": variable(self.phase2, "rad", "phase of the second harmonic"),
            "floquet_max": variable(self.floquet_max, "1", "largest modulus of the multipliers"),
            "mode": variable(self.mode.astype(str), "1", "bifurcation of the leading multiplier"),
            "mode_frequency": variable(self.mode_frequency, "Hz", "frequency of the leading mode"),
            "growth_rate": variable(self.growth_rate, "1/s", "growth rate of the leading mode"),
            "stable": variable(self.stable, "1", "all multipliers inside the unit circle"),
            "converged": variable(self.converged, "1", "whether the point was solved"),
            "result": variable(self.result.astype(str), "1", "converged, or why not"),
        }
        for name, values, axis in (
            ("harmonics", self.harmonics, "harmonic"),
            ("log_multipliers", self.log_multipliers, "multiplier"),
        ):
            for part in ("real", "imag"):
                label = f"{part} part of {name}"
                data[f"{name}_{part}"] = variable(getattr(values, part), "1", label, axis)
        coords = {
            "velocity": asked(self.velocity, "m/s", "pulling velocity"),
            "epsilon": asked(self.epsilon, "1", "relative load amplitude"),
            "frequency": asked(self.frequency, "Hz", "modulation frequency"),
        }
        return xarray.Dataset(data, coords=coords, attrs=self.provenance)

    @property
    def provenance(self) -> dict[str, Any]:
        """Version, law, conventions, tolerance and source of the numbers."""
        return provenance_of(self)
