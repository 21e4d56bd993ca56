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
from asperity.slider.named import slider_from
from asperity.transients.hold_and_step import hold

Float = NDArray[np.float64]

#: Tables are filled up to a multiple of so many holds.
_ROWS = 32


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
        self._fixed = {n: float(v) for n, v in fixed.items() if n in law_parameters(law)}
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
        names = tuple(n for n in values if n in law_parameters(self.law))
        table, rows = self.table, self.table.rows
        at = np.minimum(np.arange(-(-rows // _ROWS) * _ROWS), rows - 1)
        known = self._fixed | {n: values[n] for n in names}
        given = {n: jnp.full(at.shape, v) for n, v in known.items()}
        drive = (jnp.asarray(x[at]) for x in (table.K, table.V, table.hold_time))
        predicted, slopes = (np.asarray(a) for a in _with_slopes(self.law, names, given, *drive))
        columns = np.zeros((rows, len(values)))
        columns[:, [n in names for n in values]] = slopes.T[:rows]
        sigma = self.sigma
        whitened = (predicted[:rows] - table.healing) / sigma
        if not (np.isfinite(whitened).all() and np.isfinite(columns).all()):
            return None
        return Residuals(
            whitened,
            columns / sigma[:, None],
            np.full(rows, HEALING),
            np.arange(rows),
            float(np.log(sigma).sum()),
        )

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
def _with_slopes(
    law: type[Law],
    names: tuple[str, ...],
    given: dict[str, Array],
    K: Array,
    V: Array,
    hold_time: Array,
) -> tuple[Array, Array]:
    """Healing, and its derivatives to the named parameters, shape (names, points)."""

    def of(values: dict[str, Array]) -> Array:
        slider = slider_from(law, {**given, **values, "K": K, "W0": jnp.ones_like(K)})
        reloading, _ = hold(slider, V, hold_time)
        return reloading.maximum - reloading.level

    def along(shares: Array) -> Array:
        change = {n: jnp.broadcast_to(s, K.shape) for n, s in zip(names, shares, strict=True)}
        return jax.jvp(of, ({n: given[n] for n in names},), (change,))[1]

    return of({}), jax.vmap(along)(jnp.eye(len(names)))
