"""The periodic response of a slider to a harmonic modulation of its normal load."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import jax
import numpy as np
from jax.typing import ArrayLike

from asperity.errors import InputError
from asperity.loads import Harmonic, Modulation
from asperity.slider import Slider, equation_of_motion
from asperity.solve.found import Found
from asperity.solve.kernels import Problem
from asperity.solve.outcome import Outcome
from asperity.solve.parallel import WORTHWHILE, available_cores, find_orbits_on_cores
from asperity.solve.response import PeriodicResponse
from asperity.solve.search import METHODS, find_orbits
from asperity.units import KINDS, to_si


def periodic_response(
    slider: Slider,
    *,
    velocity: ArrayLike | str,
    epsilon: ArrayLike | str | None = None,
    frequency: ArrayLike | str,
    modulation: Modulation | None = None,
    inertia: bool = False,
    radiation_damping: ArrayLike | str | None = None,
    harmonics: int = 8,
    waveform: int = 0,
    progress: Callable[[int], None] | None = None,
    methods: tuple[str, ...] = METHODS,
    workers: int | None = None,
) -> PeriodicResponse:
    """Periodic response to W = W0 (1 + eps cos wt), stable or not.

    Arrays may stand wherever a number does, the parameters of the slider included; they
    broadcast as NumPy's do, and every operating point is solved on its own.

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
        Called with the number of points finished since the last call.
    methods : tuple of str
        Which to use of "fourier", the fast method (shooting with inertia on elastic asperities),
        "smooth", series for slow modulation, and "collocation", the robust method. All, in this
        order, unless they are to be held against each other.
    workers : int, optional
        Processes to use; by default one per core for 200,000 points or more, else this one alone.

    Returns
    -------
    PeriodicResponse
        A point that fails says why in `result`; its numbers are NaN and `converged` is False.

    Raises
    ------
    InputError
        If a value breaks its rule, or shapes do not broadcast.

    Notes
    -----
    Bureau et al. (2000), Eqs. (1), (2), (6), (8) and (26)-(29). Where converged,
    mean, mu1, mu2 and multipliers are good to 1e-8 relative (multipliers of modulus below 1e-12
    to 1e-20 absolute; with inertia or several states of the law, those below 1e-6 to 1e-14, and
    those below 1e-7 of the largest to 1e-15 of that).
    """
    if harmonics < 2:
        raise InputError(f"harmonics must be at least 2, got {harmonics}; ask for 2 or more")
    for unknown in set(methods) - set(METHODS):
        raise InputError(
            f"methods must be among {', '.join(METHODS)}, got '{unknown}'; leave it out for all"
        )
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
    report = progress or (lambda _: None)
    if slider.law.rate_dependent:
        options = {"harmonics": harmonics, "phases": waveform, "methods": methods}
        if workers is None:
            workers = available_cores() if points >= WORTHWHILE else 1
        if workers > 1:
            found = find_orbits_on_cores(flat, points, workers, progress=report, **options)
        else:
            found = find_orbits(flat, points, progress=report, **options)
    else:
        found = _proportional(flat, points, harmonics, waveform)
        report(points)
    mu_ss = np.asarray(slider.law.mu_ss(problem.system.V)) * np.ones(shape)
    return PeriodicResponse.from_search(found, shape, mu_ss, *problem)


def checked_problem(
    slider: Slider,
    *,
    velocity: Any,
    epsilon: Any,
    frequency: Any,
    modulation: Modulation | None = None,
    inertia: bool = False,
    radiation_damping: Any = None,
) -> Problem:
    """Equations and load of what is asked, parameters of any shapes.

    Raises
    ------
    InputError
        If a value breaks its rule; as `equation_of_motion`.
    """
    V = checked_positive(velocity, "velocity", "velocity")
    f = checked_positive(frequency, "frequency", "frequency")
    load = checked_modulation(epsilon, modulation)
    eta = None
    if radiation_damping is not None:
        eta = checked_positive(radiation_damping, "damping", "radiation_damping")
    return Problem(equation_of_motion(slider, V, 2 * np.pi * f, inertia=inertia, eta=eta), load)


def checked_positive(value: Any, kind: str, name: str) -> np.ndarray:
    """An array of velocities or frequencies in SI, all positive.

    Raises
    ------
    InputError
        Otherwise.
    """
    array = np.asarray(to_si(value, kind, name), dtype=float)
    bad = array[~(array > 0)]
    if bad.size:
        got = f"{bad.flat[0]:g} {KINDS[kind].si}".rstrip()
        raise InputError(f"{name} must be positive, got {got}; give a value above zero")
    return array


def checked_modulation(epsilon: Any, modulation: Modulation | None) -> Modulation:
    """The modulation asked for, as an amplitude or as a programme.

    Raises
    ------
    InputError
        Unless exactly one of the two is given; as `checked_epsilon`.
    """
    if (epsilon is None) == (modulation is None):
        given = "neither" if epsilon is None else "both"
        raise InputError(
            f"exactly one of epsilon and modulation must be given, got {given}; "
            "give epsilon for a harmonic load and modulation for any other"
        )
    return Harmonic(checked_epsilon(epsilon)) if modulation is None else modulation


def checked_epsilon(value: Any) -> np.ndarray:
    """Relative amplitude as an array, 0 <= eps < 1.

    Raises
    ------
    InputError
        Outside that range: contact would be lost.
    """
    array = np.asarray(to_si(value, "dimensionless", "epsilon"), dtype=float)
    bad = array[~((array >= 0) & (array < 1))]
    if bad.size:
        raise InputError(
            f"epsilon must be at least 0 and below 1, so that contact is never lost, "
            f"got {bad.flat[0]:g}; give the relative amplitude of the load, such as 0.24 or '24 %'"
        )
    return array


def flatten(problem: Problem) -> tuple[Problem, tuple[int, ...]]:
    """Broadcast all parameters against each other and lay the points out along one axis."""
    leaves = jax.tree.leaves(problem)
    try:
        shape = np.broadcast_shapes(*(np.shape(leaf) for leaf in leaves))
    except ValueError:
        shapes = sorted({str(np.shape(leaf)) for leaf in leaves if np.shape(leaf)})
        raise InputError(
            f"parameters must have shapes that broadcast, got {', '.join(shapes)}; "
            "give arrays of one shape, or add axes of length 1"
        ) from None
    return (
        jax.tree.map(lambda a: np.ravel(np.broadcast_to(np.asarray(a, float), shape)), problem),
        shape,
    )


def _proportional(problem: Problem, points: int, harmonics: int, phases: int) -> Found:
    """A law without rate dependence: the force follows load and shear force, without dynamics."""
    system, load = problem
    count = max(phases, 4 * harmonics)

    def force(samples: int) -> np.ndarray:
        theta = 2 * np.pi * np.arange(samples)[:, None] / max(samples, 1)
        at, law = load.at(theta), system.slider.law
        friction = law.friction(system.V, law.steady_state(system.V), at.w)
        return np.asarray(at.w * friction - at.shear)

    spectrum = np.fft.rfft(force(count), axis=0) / count
    wave = np.stack([force(phases), np.zeros((phases, points))])
    return Found(
        spectrum[0].real,
        2 * spectrum[1 : harmonics + 1],
        np.zeros((0, points), dtype=complex),
        np.zeros((0, points)),
        wave,
        np.zeros(points, dtype=np.int64),
        np.full(points, int(Outcome.CONVERGED)),
        np.zeros(points),
    )
