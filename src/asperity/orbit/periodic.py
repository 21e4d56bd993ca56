"""The periodic response of a slider to a harmonic modulation of its normal load.

`averaged_response` is its limit of fast modulation, where it no longer depends on the frequency.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated

import jax
import numpy as np
from jax import Array
from jax.typing import ArrayLike

from asperity._processes import available_cores, process_count
from asperity.errors import require
from asperity.laws import Law
from asperity.loads import Harmonic, Modulation, Periodic
from asperity.orbit.outcome import Outcome
from asperity.orbit.response import PeriodicResponse
from asperity.orbit.search import (
    CHOICES,
    WORTHWHILE,
    chosen_methods,
    find_orbits,
    find_orbits_on_cores,
)
from asperity.orbit.solution import SearchOptions, Solution
from asperity.orbit.steady_sliding import steady_sliding
from asperity.parameters import DRIVE
from asperity.parameters.arguments import at_least, counted, typed
from asperity.slider import QuasiStatic, Slider
from asperity.slider.problem import Problem, checked_problem, flatten


@typed
def periodic_response(
    slider: Slider,
    *,
    velocity: ArrayLike | str,
    epsilon: ArrayLike | str | None = None,
    frequency: ArrayLike | str,
    modulation: Modulation | None = None,
    inertia: bool = False,
    radiation_damping: ArrayLike | str | None = None,
    harmonics: Annotated[int, at_least(2)] = 8,
    waveform: Annotated[int, at_least(0)] = 0,
    progress: Callable[[int, int], None] | None = None,
    methods: tuple[str, ...] = CHOICES,
    workers: Annotated[int, process_count] | None = None,
) -> PeriodicResponse:
    """Periodic response to W = W0 (1 + eps cos wt), stable or not.

    Arrays may stand wherever a number does, the parameters of the slider included; they
    broadcast as NumPy's do, and every operating point is solved independently.

    Parameters
    ----------
    slider : Slider
    velocity : array or str
        Pulling velocity V (m/s), positive.
    epsilon : array or str
        Relative amplitude of the load that the contacts carry, 0 <= eps < 1.
    frequency : array or str
        Modulation frequency (Hz), positive; not rad/s.
    modulation : Modulation, optional
        In place of `epsilon`: any periodic load, shear force and pulling velocity, from
        `asperity.loads.modulated` or `asperity.loads.sampled`.
    inertia : bool
        Whether the mass of the slider counts.
    radiation_damping : array or str, optional
        eta (N s/m), positive: waves radiated from the interface take the force eta v.
    harmonics : int
        Number of harmonics of the force, at least 2.
    waveform : int
        Samples of the force and slip rate over the period to keep; 0 for none.
    progress : callable, optional
        Called with the number of points finished so far and of all points.
    methods : tuple of str
        Methods to use: "fourier", the fast method (shooting with inertia on elastic asperities);
        "series", for slow or weak modulation; "collocation", the robust method, and the methods
        that follow branches to initial guesses for it. All by default.
    workers : int, optional
        Number of processes; by default one per core for 200,000 points or more, otherwise one.

    Returns
    -------
    PeriodicResponse
        `result` has the reason of a failed point; its numbers are NaN and `converged` is False.

    Raises
    ------
    InputError
        If a value breaks its rule, or shapes do not broadcast.

    Examples
    --------
    >>> import asperity as asp
    >>> pmma = asp.materials.load("bureau2000")
    >>> slider = asp.Slider(pmma.law("elasto-plastic"), spring=pmma.K, mass=pmma.M, load=pmma.W0)
    >>> asp.periodic_response(slider, velocity="1 um/s", epsilon=0.24, frequency="120 Hz").plot()

    Notes
    -----
    Bureau et al. (2000), Eqs. (1), (2), (6), (8) and (26)-(29). Where converged,
    mean, mu1, mu2 and multipliers are good to 1e-8 relative (harmonics below 1e-9 to 1e-17
    absolute, the round-off of w: `perturbation_response` has the limit of small epsilon;
    multipliers of modulus below 1e-12 to 1e-20 absolute; with inertia or several states of the law,
    those below 1e-6 to 1e-14, and those below 1e-7 of the largest to 1e-15 of that).

    Orbits are searched for where epsilon is at most 0.999 and the rate of steady sliding per
    radian, about the larger of V/(omega D0) and V K/(omega W0 A), is from 1e-9 to 1e15. Points
    outside get the outcome `Outcome.OUT_OF_RANGE` at once.
    """
    chosen = chosen_methods(methods)
    problem = checked_problem(
        slider,
        velocity=velocity,
        epsilon=epsilon,
        frequency=frequency,
        modulation=modulation,
        inertia=inertia,
        radiation_damping=radiation_damping,
    )
    flat, shape = flatten(problem)
    points = int(np.prod(shape, dtype=int))
    options = SearchOptions(harmonics, waveform, counted(progress, points))
    if slider.law.rate_dependent:
        if workers is None:
            workers = available_cores() if points >= WORTHWHILE else 1
        if workers > 1:
            solution = find_orbits_on_cores(flat, options, chosen, workers)
        else:
            solution = find_orbits(flat, options, chosen)
    else:
        solution = _proportional(flat, points, options)
        options.progress(points)
    mu_ss = np.asarray(_mu_ss(slider.law, problem.system.V)) * np.ones(shape)
    return PeriodicResponse.from_search(solution, shape, mu_ss, *problem)


@jax.jit
def _mu_ss(law: Law, V: ArrayLike) -> Array:
    return law.mu_ss(V)


def _proportional(problem: Problem, points: int, options: SearchOptions) -> Solution:
    """A law without rate dependence: the force follows load and shear force, without dynamics."""
    harmonics, phases, *_ = options
    count = max(phases, 4 * harmonics + 2 * _harmonics_of(problem.load))
    spectrum = np.fft.rfft(_force(problem, count), axis=0) / count
    solution = Solution.empty(0, points, options)
    solution.mean_friction[:] = spectrum[0].real
    solution.harmonics[:] = 2 * spectrum[1 : harmonics + 1]
    if phases:
        solution.waveform[0] = _force(problem, phases)
    solution.waveform[1] = 0.0
    solution.outcome[:] = Outcome.CONVERGED
    return solution


def _force(problem: Problem, samples: int) -> np.ndarray:
    """Force over W0 at evenly spaced phases, shape (samples, points)."""
    theta = 2 * np.pi * np.arange(samples)[:, None] / samples
    return np.asarray(_following_force(problem, theta))


@jax.jit
def _following_force(problem: Problem, theta: ArrayLike) -> Array:
    system, load = problem
    at, law = load.at(theta), system.slider.law
    friction = law.friction(system.V, law.steady_state(system.V), at.w)
    return at.w * friction - at.shear


#: Harmonics that a user's own load is taken to have.
_MOST_HARMONICS = 1024


def _harmonics_of(load: Modulation) -> int:
    """Number of harmonics of the load and the shear force."""
    if isinstance(load, Harmonic):
        return 1
    if isinstance(load, Periodic):
        return max(len(load.load), len(load.shear))
    return _MOST_HARMONICS


#: Rate per radian of a perturbation that stands in for zero: the response differs from the limit by
#: about this rate. At smaller rates the elastic motion of the asperities, which does not vanish,
#: hides the rest of the response.
_STIFFNESS = 1e-8


@typed
def averaged_response(
    slider: Slider,
    *,
    velocity: ArrayLike | str,
    epsilon: ArrayLike | str,
    harmonics: Annotated[int, at_least(2)] = 8,
) -> PeriodicResponse:
    """Response to a modulation far faster than the interface: spring force and age are constant.

    The states stay at the values at which the mean slip velocity is V and the age has no
    mean drift; for Rice-Ruina friction

        < exp[(f/w - mu_ss - B phi)/A] > = 1,     < e^(-phi) > = 1.

    Elastic asperities keep modulating the force: mu1 tends to its velocity-independent plateau.

    Parameters
    ----------
    slider : Slider
    velocity : array or str
        Pulling velocity V (m/s), positive.
    epsilon : array or str
        Relative amplitude, 0 <= eps < 1.
    harmonics : int

    Returns
    -------
    PeriodicResponse
        Its `frequency` is the finite frequency of the calculation.

    Raises
    ------
    InputError
        As `periodic_response`; if the law does not depend on the velocity.

    Examples
    --------
    >>> import asperity as asp
    >>> pmma = asp.materials.load("bureau2000")
    >>> slider = asp.Slider(pmma.law("rice-ruina"), spring="0.2 N/um", load=pmma.W0)
    >>> print(asp.averaged_response(slider, velocity="1 um/s", epsilon=[0.1, 0.2]).delta_mu)
    """
    rule, got = "depend on the velocity to have a limit of fast modulation", slider.law.name
    require(slider.law.rate_dependent, "law", rule, got, "take periodic_response at any frequency")
    V = DRIVE["V"].check(velocity)
    problem, shape = flatten(
        Problem(QuasiStatic(slider, V, np.asarray(1.0)), Harmonic(np.asarray(0.0)))
    )
    stiffness = steady_sliding(problem).rate
    omega = np.maximum(stiffness.reshape(shape), 1e-300) / _STIFFNESS
    return periodic_response(
        slider,
        velocity=V,
        epsilon=epsilon,
        frequency=omega / (2 * np.pi),
        harmonics=harmonics,
    )
