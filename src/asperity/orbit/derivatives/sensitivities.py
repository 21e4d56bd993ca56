"""Derivatives of the periodic response at operating points, by every parameter."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import numpy as np
from jax.typing import ArrayLike
from numpy.typing import NDArray

from asperity.arrays import Bool, Complex, Float
from asperity.loads import Modulation
from asperity.orbit.derivatives.parametrised import ParametrisedProblem, ResponseValues
from asperity.orbit.derivatives.response_function import ResponseFunction
from asperity.orbit.observables import without_round_off
from asperity.orbit.outcome import Outcome
from asperity.parameters.arguments import typed
from asperity.slider import Slider
from asperity.slider.problem import checked_problem, flatten

#: Points that are differentiated at a time, which bounds the memory.
_BLOCK = 1024


@dataclass(frozen=True)
class Sensitivities:
    """Derivatives at one or many operating points.

    Attributes
    ----------
    parameters : tuple of str
        Names, in the order of the last axis: those of the law, then K, W0, M, V, frequency, eta
        (with radiation damping only), and epsilon or the coefficients of the load.
    outcome : int array, shape (...)
        `Outcome` of each point.
    converged : bool array, shape (...)
        False where there is no resolved orbit; the derivatives are NaN there.
    mean_friction, mu1, mu2, phase1, phase2 : array, shape (..., parameters)
        d(output)/d(parameter) in SI; phases in rad. NaN where a harmonic vanishes, as without
        modulation, and to lambda at lambda = 0 with inertia or radiation damping: the equations of
        rigid asperities do not have it.
    log_multipliers : complex array, shape (..., states, parameters)
        Derivatives of ln|m| + i arg m, sorted as in `PeriodicResponse`; of a complex pair the one
        with the positive argument comes first. NaN where the mesh does not resolve the multipliers,
        and where the interface sticks for a part of the period (`cut-off`): their changes with the
        instants at which it begins and ends to stick are not computed.
    """

    parameters: tuple[str, ...]
    outcome: NDArray[np.int64]
    mean_friction: Float
    mu1: Float
    mu2: Float
    phase1: Float
    phase2: Float
    log_multipliers: Complex

    @property
    def converged(self) -> Bool:
        """Whether each point was solved."""
        return np.asarray(self.outcome == Outcome.CONVERGED)


@typed
def sensitivities(
    slider: Slider,
    *,
    velocity: ArrayLike | str,
    epsilon: ArrayLike | str | None = None,
    frequency: ArrayLike | str,
    modulation: Modulation | None = None,
    inertia: bool = False,
    radiation_damping: ArrayLike | str | None = None,
) -> Sensitivities:
    """Derivatives of mean, harmonics and multipliers with respect to every parameter.

    Parameters
    ----------
    slider : Slider
        With a rate-dependent law.
    velocity, epsilon, frequency, modulation, inertia, radiation_damping
        As in `periodic_response`; arrays broadcast.

    Returns
    -------
    Sensitivities

    Raises
    ------
    InputError
        As `periodic_response`; if the law does not depend on the velocity.

    Examples
    --------
    >>> import asperity as asp
    >>> pmma = asp.materials.load("bureau2000")
    >>> slider = asp.Slider(pmma.law("rice-ruina"), spring="0.2 N/um", load=pmma.W0)
    >>> d = asp.sensitivities(slider, velocity="1 um/s", epsilon=0.24, frequency="120 Hz")
    >>> dict(zip(d.parameters, d.mean_friction))

    Notes
    -----
    As `response_function`, with the parameters of the slider.
    """
    problem, shape = flatten(
        checked_problem(
            slider,
            velocity=velocity,
            epsilon=epsilon,
            frequency=frequency,
            modulation=modulation,
            inertia=inertia,
            radiation_damping=radiation_damping,
        )
    )
    model = ResponseFunction.of(ParametrisedProblem.of(problem), harmonics=2, multipliers=True)
    numbers = model.equations.values(problem)
    points = int(np.prod(shape, dtype=int))
    blocks = [
        model.value_and_jacobian({n: v[i : i + _BLOCK] for n, v in numbers.items()})
        for i in range(0, points, _BLOCK)
    ]
    values, derivatives = jax.tree.map(lambda *parts: np.concatenate(parts), *blocks)
    columns = [_outputs(values, derivatives[name]) for name in model.parameters]
    table = np.stack(columns, axis=-1).reshape(*shape, -1, len(columns))
    if "lambda" in model.parameters and not problem.system.has_elastic_asperities:
        table[..., model.parameters.index("lambda")] = np.nan
    return Sensitivities(
        model.parameters,
        values.outcome.reshape(shape),
        *(table[..., i, :].real for i in range(5)),
        log_multipliers=table[..., 5:, :],
    )


def _outputs(values: ResponseValues, change: ResponseValues) -> Complex:
    """Derivatives of the outputs to one parameter, (points, outputs)."""
    numbers = np.column_stack([values.mean_friction, values.harmonics])
    harmonics = without_round_off(numbers.T)[1:].T
    with np.errstate(all="ignore"):  # NaN without an orbit, and where a harmonic vanishes
        relative = change.harmonics / harmonics
        growth, turn = relative.real * np.abs(harmonics), relative.imag
    return np.column_stack([change.mean_friction, growth, turn, change.log_multipliers])
