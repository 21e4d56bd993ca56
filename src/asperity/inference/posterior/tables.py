"""Likelihood of lock-in readings as a compiled program evaluates it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array

from asperity.inference.tables.residuals import Prediction, columns_of
from asperity.inference.tables.term import LockInTerm
from asperity.laws import Law
from asperity.orbit import response_function
from asperity.parameters import law_parameters


class LockInArrays(NamedTuple):
    """Numbers of a table.

    Attributes
    ----------
    fixed : dict of str to array, shape (rows,)
        Parameters that are not free.
    matrix, target : array
        As of `Weights`; rows that fill up have weights of 0.
    """

    fixed: dict[str, Any]
    matrix: Any
    target: Any


@dataclass(frozen=True)
class LockInLikelihood:
    """Log likelihood of a table, but for a constant.

    Attributes
    ----------
    law : type of Law
    inertia, radiation_damping : bool
    search : bool
        Whether orbits that the fast method does not find are searched for, which takes long.
    """

    law: type[Law]
    inertia: bool
    radiation_damping: bool
    search: bool

    def __call__(self, values: Mapping[str, Array], data: LockInArrays) -> Array:
        """Log likelihood of parameters by name; those of other data are left alone."""
        columns = columns_of(self._predicted(values, data), jnp)
        residuals = jnp.einsum("rsc,rc->rs", data.matrix, columns) - data.target
        return -0.5 * jnp.sum(residuals**2)

    def _predicted(self, values: Mapping[str, Array], data: LockInArrays) -> Prediction:
        given = {n: v for n, v in data.fixed.items() if n != "eps_ratio"}
        applied = data.fixed["epsilon"]
        ratio = values.get("eps_ratio", data.fixed.get("eps_ratio", 1.0))
        given |= {n: v + 0 * applied for n, v in values.items() if n != "eps_ratio"}
        given["epsilon"] = applied * ratio
        function = _response(self.law, self.inertia, self.radiation_damping, self.search)
        found = function({n: v for n, v in given.items() if n in function.parameters})
        fields = {f.rstrip("_"): f for f in self.law.__dataclass_fields__}
        own = self.law(**{fields[n]: given[n] for n in law_parameters(self.law)})
        return Prediction(found.mean_friction, own.mu_ss(given["V"]), found.harmonics)


@cache
def _response(law: type[Law], inertia: bool, radiation_damping: bool, search: bool) -> Any:
    return response_function(
        law, inertia=inertia, radiation_damping=radiation_damping, search=search
    )


def likelihood_of_table(term: LockInTerm) -> tuple[LockInLikelihood, LockInArrays]:
    """The likelihood of a table, and its arrays, filled up to one of a few sizes."""
    forward, weights = term.forward, term.weights
    rows = term.table.rows
    size = max(4, 1 << (rows - 1).bit_length())
    more = ((0, size - rows),)
    arrays = LockInArrays(
        {n: np.pad(v, more, mode="edge") for n, v in forward.fixed.items()},
        np.pad(weights.matrix, (*more, (0, 0), (0, 0))),
        np.pad(weights.target, (*more, (0, 0))),
    )
    likelihood = LockInLikelihood(
        forward.law, forward.inertia, forward.radiation_damping, forward.uses_search
    )
    return likelihood, arrays
