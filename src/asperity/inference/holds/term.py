"""Healing in the likelihood: holds and reloads by integration, with exact derivatives."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import NDArray

from asperity.inference.holds.table import HEALING, HealingTable
from asperity.inference.objective import DataTerm, Residuals
from asperity.laws import Law
from asperity.parameters import law_parameters
from asperity.slider import Slider
from asperity.transients.hold_and_step import hold

Float = NDArray[np.float64]

#: Holds in a call of the compiled programs, of a table and of many sets of parameters.
_ROWS, _MANY = 32, 1024


class HoldTerm(DataTerm):
    """A table of holds as a `DataTerm` of an objective.

    Errors that the table does not give are one for all rows. It is `error`, at first a guess that
    changes no estimate, and then the standard deviation of what the law leaves.

    Parameters
    ----------
    table : HealingTable
    law : type of Law
    fixed : mapping of str to float
        Parameters of the law that are not free, in SI.
    """

    observables = (HEALING,)
    failure = (
        "no start has a solution at every hold; give start values nearer to those of the interface"
    )

    def __init__(self, table: HealingTable, law: type[Law], fixed: Mapping[str, Any]) -> None:
        self.table, self.law, self.name = table, law, table.name
        self._fields = {n: p.path.rsplit(".", 1)[-1] for n, p in law_parameters(law).items()}
        self._fixed = {n: float(v) for n, v in fixed.items() if n in self._fields}
        self.error = 0.1 * float(np.ptp(table.healing)) or 1e-3
        self._freedom = math.inf

    @property
    def profiled(self) -> int:
        """The error, if it is estimated."""
        return int(self.table.errors is None)

    @property
    def sigma(self) -> Float:
        """Standard uncertainty of each row."""
        errors = self.table.errors
        return np.full(self.table.rows, self.error) if errors is None else errors

    @property
    def noise(self) -> Mapping[str, Any]:
        """Independent normal errors, as given or estimated."""
        if self.profiled:
            model = "independent, normal, one error for all holds, estimated from the residuals"
        else:
            model = "independent, normal, as given"
        more = {"error": self.error} if self.profiled else {}
        return {"model": model, "effective_samples": self.table.rows, **more}

    def estimate_error(self, values: Mapping[str, float], parameters: int) -> None:
        """Take the error from the residuals at the estimate of so many parameters."""
        residuals = self.residuals(values)
        freedom = self.table.rows - parameters
        if not self.profiled or residuals is None or freedom < 1:
            return
        self.error *= max(math.sqrt(float(np.sum(residuals.values**2)) / freedom), 1e-12)
        self._freedom = float(freedom)

    def residuals(
        self, values: Mapping[str, float], *, search: bool | None = None
    ) -> Residuals | None:
        """Residuals in standard uncertainties; None where a hold has no solution."""
        names = tuple(n for n in values if n in self._fields)
        rows = self.table.rows
        predicted, columns = np.empty(rows), np.zeros((rows, len(values)))
        places = [list(values).index(n) for n in names]
        for i in range(0, rows, _ROWS):
            at = np.minimum(np.arange(i, i + _ROWS), rows - 1)
            kept = slice(i, min(i + _ROWS, rows))
            value, slopes = _with_slopes(
                self.law, tuple(self._fields.items()), names, self._given(values, at), *self._at(at)
            )
            predicted[kept] = np.asarray(value)[: kept.stop - i]
            for place, slope in zip(places, np.asarray(slopes), strict=True):
                columns[kept, place] = slope[: kept.stop - i]
        sigma = self.sigma
        whitened = (predicted - self.table.healing) / sigma
        if not (np.isfinite(whitened).all() and np.isfinite(columns).all()):
            return None
        return Residuals(
            whitened,
            columns / sigma[:, None],
            np.full(rows, HEALING),
            np.arange(rows),
            float(np.log(sigma).sum()),
        )

    def _given(self, values: Mapping[str, Any], at: NDArray[np.intp]) -> dict[str, Array]:
        """Parameters of the law at some rows."""
        known = {**self._fixed, **{n: v for n, v in values.items() if n in self._fields}}
        return {n: jnp.broadcast_to(jnp.asarray(v, float), at.shape) for n, v in known.items()}

    def _at(self, at: NDArray[np.intp]) -> tuple[Array, Array, Array]:
        table = self.table
        return jnp.asarray(table.K[at]), jnp.asarray(table.V[at]), jnp.asarray(table.hold_time[at])

    def uncertainty_of_noise(
        self, values: Mapping[str, float], slopes: Float, covariance: Float
    ) -> tuple[Float, Float]:
        """Of an estimated error: the covariance scales with its square."""
        spread = 2 * np.diag(covariance) ** 2 / self._freedom
        return np.zeros_like(covariance), spread

    def observed(self) -> Mapping[str, Float]:
        """Holds and healing."""
        t = self.table
        return {"hold_time": t.hold_time, "V": t.V, "K": t.K, HEALING: t.healing}

    def warnings(
        self, residuals: Residuals, information: Float, outliers: Sequence[int] = ()
    ) -> Sequence[str]:
        """How the error was estimated, if it was."""
        if not self.profiled:
            return ()
        return (
            f"{self.name} has no healing_err: one standard uncertainty for all holds, "
            f"{self.error:.3g}, is estimated from the residuals, and chi-squared judges nothing",
        )


@partial(jax.jit, static_argnums=(0, 1))
def _healing(
    law: type[Law],
    fields: tuple[tuple[str, str], ...],
    given: dict[str, Array],
    K: Array,
    V: Array,
    hold_time: Array,
) -> Array:
    slider = Slider(
        law(**{field: given[n] for n, field in fields}), spring=K, load=jnp.ones_like(K)
    )
    found, _ = hold(slider, V, hold_time)
    return found.maximum - found.level


@partial(jax.jit, static_argnums=(0, 1, 2))
def _with_slopes(
    law: type[Law],
    fields: tuple[tuple[str, str], ...],
    names: tuple[str, ...],
    given: dict[str, Array],
    K: Array,
    V: Array,
    hold_time: Array,
) -> tuple[Array, Array]:
    """Healing, and its derivatives to the named parameters, shape (names, points)."""

    def of(values: dict[str, Array]) -> Array:
        return _healing(law, fields, {**given, **values}, K, V, hold_time)

    def along(shares: Array) -> Array:
        change = {n: jnp.broadcast_to(s, K.shape) for n, s in zip(names, shares, strict=True)}
        return jax.jvp(of, ({n: given[n] for n in names},), (change,))[1]

    return of({}), jax.vmap(along)(jnp.eye(len(names)))
