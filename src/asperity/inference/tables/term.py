"""Lock-in readings in the likelihood: predictions at the rows of a table, with derivatives."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import NDArray
from scipy.special import ndtri

from asperity.arrays import Bool, Float
from asperity.errors import Argument, named, require
from asperity.inference.objective import CompiledResiduals, DataTerm, Residuals
from asperity.inference.tables.residuals import (
    Prediction,
    Weights,
    columns_of,
    leverages,
    residuals_of,
    slopes_of,
    standardised,
    weights_of,
)
from asperity.inference.tables.table import LockInTable
from asperity.laws import Law
from asperity.orbit import (
    KnownOrbits,
    Outcome,
    ResponseFunction,
    response_function,
)
from asperity.parameters import law_parameters
from asperity.slider.parameters import law_from

#: Largest number of rows whose orbits are remembered, about ten kilobytes each.
_REMEMBERED = 2048
#: Root of the sum of the squared relative changes of the parameters, below which a known orbit is
#: near (`KnownOrbits`). Newton's method from near orbits failed at 1,900 rows of six tables; for 50
#: of these rows another initial guess, without a transient, led to an orbit.
_NEAR = 0.1
#: Smallest share of rows with an orbit in the coarse model: some rows may have slip events, whose
#: orbits this model does not reach, even at the minimum.
_LEAST_SHARE = 0.5
#: Relative uncertainty with which chi-squared is smooth: without it the minimum of one of 62 tables
#: of slow modulation is missed (`benchmarks.random_truths --slow`, seed 13 of linker-dieterich).
_SMOOTHING = 0.3
#: Growth of a perturbation in a period above which a response is never read: by e in 100 periods.
_UNSTABLE = 0.01
#: Largest share of readings that are named as outliers.
_FEW = 0.05
#: A warning names a reading if its uncertainty, absolute and relative to the reading, is below the
#: first share of those of the other rows, and its leverage exceeds the second number.
_SMALL_ERROR, _DECISIVE = 0.1, 0.9
#: Evaluations of an integral; fewer with searched orbits, which take a hundred times as long.
_SAMPLES, _SEARCHED_SAMPLES = 1024, 80


def outlier_sentence(rows: NDArray[np.str_]) -> list[str]:
    """A sentence on rows without which the law describes a table; none without such rows."""
    if not rows.size:
        return []
    return [
        f"without {' and '.join(rows)} chi-squared would be as it should be: "
        f"{'that is an outlier' if rows.size == 1 else 'those are outliers'}, which "
        "may shift every estimate; check the measurement, or fit without it"
    ]


def _require_motion_of_rows(table: LockInTable, motion: Mapping[str, bool]) -> None:
    """Refuse a table whose columns count inertia or damping where the fit does not."""
    for name, option in (("inertia", "inertia"), ("eta", "radiation_damping")):
        counted = np.nan_to_num(table.points.get(name, 0.0)) > 0
        rule, got = f"agree with the column '{name}' of {table.name}", "False"
        advice = f"add {Argument(option, value='True')}, or remove the column"
        require(motion[option] or not counted.any(), option, rule, got, advice)


def _in_rows(fixed: Mapping[str, Any], rows: int) -> dict[str, Float]:
    """Numbers with a value in each row."""
    return {n: np.broadcast_to(np.asarray(v, float), (rows,)) for n, v in fixed.items()}


class LockInTerm(DataTerm):
    """A table of lock-in readings as a `DataTerm` of an objective.

    Parameters
    ----------
    table : LockInTable
    law : type of Law
    fixed : mapping of str to array, shape () or (rows,)
        All parameters that are not free, in SI.
    inertia, radiation_damping : bool
        Whether mass and damping count in the equation of motion.

    Attributes
    ----------
    searches : bool
        Whether every call searches for orbits that the fast method does not reach.
    coarse : bool
        Whether orbits are computed on the coarse mesh of `response_function`, for searches.
    least : float
        Smallest share of rows with a periodic orbit. If other rows lack an orbit, chi-squared is
        that of the rows with an orbit, scaled to all rows.
    """

    searches: bool = False
    affordable = _SAMPLES
    failure = (
        "no start has a periodic orbit at every operating point; give start values, or fix "
        "parameters for which sliding is stable"
    )

    def __init__(
        self,
        table: LockInTable,
        law: type[Law],
        fixed: Mapping[str, Any],
        *,
        inertia: bool = False,
        radiation_damping: bool = False,
    ) -> None:
        self.table, self.law = table, law
        self.name, self.observables = table.name, table.observables
        self.motion: dict[str, Any] = {"inertia": inertia, "radiation_damping": radiation_damping}
        _require_motion_of_rows(table, self.motion)
        self.fixed = _in_rows(fixed, table.rows)
        # Programs are compiled for the whole table, and used for any of its rows.
        function = partial(response_function, law, **self.motion, least_points=table.rows)
        self._functions: dict[bool | str, ResponseFunction] = {
            way: function(search=way) for way in (False, "direct", "coarse")
        }
        self._visited: list[tuple[dict[str, float], KnownOrbits]] = []
        self.coarse, self.least = False, 1.0
        self._weights: Weights | None = None
        self._slopes: Float | None = None

    @property
    def noise(self) -> dict[str, Any]:
        """Normal errors as in the table."""
        kind = "correlated within a row" if self.table.covariances else "independent"
        return {"model": f"{kind}, normal, as given", "effective_samples": self._count}

    @property
    def weights(self) -> Weights:
        """Residuals as linear functions of predictions."""
        if self._weights is None:
            self._weights = weights_of(self.table, self._slopes)
        return self._weights

    @property
    def measured_epsilon(self) -> bool:
        """Whether the table has uncertainties of epsilon."""
        return bool(np.nan_to_num(self.table.errors.get("epsilon", 0.0)).any())

    def estimate_error(self, values: Mapping[str, float]) -> None:
        """Include the errors of epsilon, by the slopes of the predictions at these parameters."""
        function = self._function(coarse=self.coarse)
        given = parameters_at(self.fixed, values, function)
        known = self._nearest(values) if self.searches else None
        response, derivatives = function.value_and_jacobian(given, known, names=["epsilon"])
        slope, none = derivatives["epsilon"], np.zeros(self.table.rows)
        at = Prediction(response.mean_friction, none, np.asarray(response.harmonics))
        change = Prediction(slope.mean_friction, none, np.asarray(slope.harmonics))
        # The contacts carry eps_ratio times the measured amplitude.
        ratio = np.broadcast_to(
            values.get("eps_ratio", self.fixed.get("eps_ratio", 1.0)), none.shape
        )
        slopes = slopes_of(at, change) * ratio[:, None]
        self._slopes, self._weights = np.nan_to_num(slopes), None

    def residuals(self, values: Mapping[str, float]) -> Residuals | None:
        """Residuals in standard uncertainties; None if too few rows have a periodic orbit."""
        every = self.least == 1
        predicted, derivatives, outcome = self.predicted(values, every=every)
        solved = outcome == Outcome.CONVERGED
        share = solved.mean()
        if share < self.least:
            return None
        result = residuals_of(self.weights, predicted, derivatives)
        if share < 1:
            there, scale = solved[result.row], 1 / math.sqrt(share)
            result = result._replace(
                values=scale * np.where(there, result.values, 0.0),
                jacobian=scale * np.where(there[:, None], result.jacobian, 0.0),
            )
        # Far from all data derivatives may overflow although the orbit converges.
        finite = np.isfinite(result.values).all() and np.isfinite(result.jacobian).all()
        return result if finite else None

    def compiled(
        self, names: tuple[str, ...]
    ) -> tuple[CompiledResiduals, tuple[dict[str, Float], Weights]]:
        """As in `DataTerm`."""
        way = tuple(self.motion.items())
        return _CompiledResiduals(self.law, way, self.searches), (self.fixed, self.weights)

    def with_rows(self, kept: Bool, *, coarse: bool = False) -> LockInTerm:
        """The term for some of its rows, with their orbits, optionally on the coarse mesh."""
        part, rows = self.with_table(self.table.without(~kept)), np.flatnonzero(kept)
        part.fixed = {n: v[kept] for n, v in self.fixed.items()}
        part._slopes = None if self._slopes is None else self._slopes[kept]
        part._visited = [(free, known.picked(rows)) for free, known in self._visited]
        part.coarse, part.least = coarse, _LEAST_SHARE if coarse else self.least
        return part

    def with_table(self, table: LockInTable) -> LockInTerm:
        """The term with other readings at the same operating points."""
        result = copy(self)
        result.table, result._weights = table, None
        return result

    def with_fixed(self, fixed: Mapping[str, Any]) -> LockInTerm:
        """The term with other numbers that are not free, and without its orbits."""
        result = copy(self)
        result.fixed, result._visited = _in_rows(fixed, self.table.rows), []
        return result

    def weighted(self, weights: Float) -> LockInTerm:
        """The term with the residuals of each row multiplied by a weight, shape (rows,)."""
        result, weights_now = copy(self), self.weights
        result._weights = weights_now._replace(
            matrix=weights_now.matrix * weights[:, None, None],
            target=weights_now.target * weights[:, None],
        )
        return result

    def chi2_of_many(self, values: Sequence[Mapping[str, float]], *, near: bool = False) -> Float:
        """Chi-squared at many sets of parameters, by one call; see `DataTerm`."""
        weights, rows, sets = self.weights, self.table.rows, len(values)
        free = {n: np.repeat([v[n] for v in values], rows) for n in values[0]}
        predicted, outcome = self.predicted_at_many(free, repeats=sets, near=near)
        residuals = weights.compared(columns_of(predicted).reshape(sets, rows, -1))
        solved = (outcome == Outcome.CONVERGED).reshape(sets, rows)
        share = np.maximum(solved.mean(1), 1 / rows)
        total = np.sum(np.where(solved[..., None], residuals, 0.0) ** 2, (1, 2)) / share
        return np.where(share >= self.least, np.nan_to_num(total, nan=np.inf), np.inf)

    def use_search(self, always: bool) -> None:
        """As in `DataTerm`; the slower method searches for orbits."""
        self.searches, self.affordable = always, _SEARCHED_SAMPLES if always else _SAMPLES

    def coarser(self, *, partly: bool = True) -> LockInTerm:
        """As in `DataTerm`; both terms share their orbits."""
        if not self.searches or self.coarse:
            return self
        result = self.partial() if partly else copy(self)
        result.coarse = True
        return result

    def partial(self) -> LockInTerm:
        """As in `DataTerm`; both terms share their orbits."""
        result = copy(self)
        result.least = _LEAST_SHARE
        return result

    def smoother(self) -> LockInTerm:
        """As in `DataTerm`: 30 % of each harmonic, and of the median of mu1 for the mean."""
        values, errors = self.table.values, dict(self.table.errors)
        for name, column in values.items():
            size = np.abs(column)
            if name.startswith("phase"):
                size = np.ones(column.size)
            elif not name.startswith("mu") and "mu1" in values:
                size = np.full(column.size, np.nanmedian(values["mu1"]))
            errors[name] = np.hypot(errors[name], _SMOOTHING * size)
        return self.with_table(replace(self.table, errors=errors))

    @property
    def _count(self) -> int:
        """Number of readings."""
        return sum(int(np.isfinite(v).sum()) for v in self.table.values.values())

    def thinned(self, rows: int, data: int = 0) -> LockInTerm:
        """The term for few rows, spread over the operating points; see `DataTerm`."""
        table = self.table
        kept = max(rows, math.ceil(data / max(self._count / table.rows, 1e-9)))
        # Points that are close together add little information.
        order = np.lexsort([table.points[name] for name in ("epsilon", "frequency", "V")])
        chosen = order[np.linspace(0, table.rows - 1, min(kept, table.rows)).round().astype(int)]
        return self.with_rows(np.isin(np.arange(table.rows), chosen), coarse=True)

    def observed(self) -> dict[str, Float]:
        """Operating points and readings."""
        return {**self.table.points, **self.table.values}

    def warnings(
        self, residuals: Residuals, information: Float, outliers: Sequence[int] = ()
    ) -> list[str]:
        """Warnings about outliers, uncertainties, and weak amplitudes without a phase."""
        sentences = list(self.table.remarks)
        sentences += outlier_sentence(self.table.row_names[list(outliers)])
        expected = -ndtri(0.005 / residuals.values.size)
        apart = np.abs(standardised(residuals, information))
        beyond = np.flatnonzero(apart > expected)
        # Many such rows are no outliers: the law or the uncertainties are wrong.
        few = beyond if beyond.size <= max(1, _FEW * apart.size) else beyond[:0]
        if outliers:
            # Other readings may be off only because the fit follows the outliers.
            few = beyond[np.isin(residuals.row[beyond], outliers)]
        for j in sorted(few, key=lambda j: -apart[j])[:5]:
            sentences.append(
                f"{residuals.observable[j]} of {self.table.row_names[residuals.row[j]]} is "
                f"{apart[j]:.3g} standard uncertainties off, more than chance allows; check that "
                "reading"
            )
        sentences += self._small_errors(residuals, information)
        for n in (1, 2):
            name = f"mu{n}"
            if name in self.table.values and f"phase{n}" not in self.table.values:
                weak = int(np.sum(self.table.values[name] < 3 * self.table.errors[name]))
                if weak:
                    sentences.append(
                        f"{weak} reading{'s' * (weak > 1)} of {name} below three standard "
                        f"uncertainties without phase{n}: an amplitude so small is biased upwards"
                    )
        return sentences

    def instability(self, values: Mapping[str, float]) -> list[str]:
        """As in `DataTerm`: rows whose response is unstable."""
        function = self._functions["coarse"]
        growth = function.growth(parameters_at(self.fixed, values, function), self._nearest(values))
        rows = np.flatnonzero(np.nan_to_num(growth) > _UNSTABLE)
        if not rows.size:
            return []
        worst = rows[np.argmax(growth[rows])]
        most = growth[worst]
        times = f"{math.exp(most):.3g}" if most < 100 else f"10^{most / math.log(10):.0f}"
        return [
            f"with these estimates the response of {rows.size} of {growth.size} rows is unstable, "
            f"most of all that of {self.table.row_names[worst]} (perturbations grow {times} times "
            "in a period): the slider would stick and slip there, and could not be read. The true "
            "values lie elsewhere in the intervals, or a fixed number is wrong: check "
            f"{named('K')} and {named('D0')}, or take more observables or points"
        ]

    def reversal(self, values: Mapping[str, float]) -> list[str]:
        """As in `DataTerm`: rows in whose response slip would reverse."""
        function = self._functions["coarse"]
        rows = np.flatnonzero(function.reverses(parameters_at(self.fixed, values, function)))
        if not rows.size:
            return []
        names = self.table.row_names
        return [
            "with these estimates slip would reverse for part of the period in the response of "
            f"{rows.size} of {len(names)} rows, the first of them {names[rows[0]]}: the law slips "
            "forwards only, and describes them wrongly; leave these rows out"
        ]

    def _small_errors(self, residuals: Residuals, information: Float) -> list[str]:
        """Sentences on readings that decide the fit by uncertainties far below the others."""
        table, decisive = self.table, leverages(residuals.jacobian, information) > _DECISIVE
        sentences = []
        for name, values in table.values.items():
            size = table.values[f"mu{name[-1]}"] if name.startswith("phase") else np.abs(values)
            # The error of a phase is an error across the phasor.
            error = table.errors[name] * (size if name.startswith("phase") else 1.0)
            known = np.isfinite(values) & (size > 0)
            if not known.any():
                continue
            relative = error / np.where(known, size, 1.0)
            share = np.maximum(
                error / np.median(error[known]), relative / np.median(relative[known])
            )
            rows = residuals.row[decisive & (residuals.observable == name)]
            sentences += [
                f"{name}_err of {table.row_names[row]} is {share[row]:.2g} times that of the other "
                "rows: the fit goes through this reading, and its intervals hold only if this "
                "uncertainty is right; check it"
                for row in rows[known[rows] & (share[rows] < _SMALL_ERROR)]
            ]
        return sentences

    def _function(self, *, coarse: bool) -> ResponseFunction:
        return self._functions[("coarse" if coarse else "direct") if self.searches else False]

    def predicted(
        self, free: Mapping[str, float], *, every: bool = False
    ) -> tuple[Prediction, dict[str, Prediction], NDArray[np.int64]]:
        """Prediction, its derivatives by the free parameters, and the outcome of every row.

        Parameters
        ----------
        free : mapping of str to float
        every : bool
            Whether all rows need an orbit: without one, derivatives are left out.
        """
        applied = self.fixed["epsilon"]
        function = self._function(coarse=self.coarse)
        given = parameters_at(self.fixed, free, function)
        known = self._nearest(free) if self.searches else None
        named = ["epsilon" if n == "eps_ratio" else n for n in free]
        wanted = [n for n in named if n in function.parameters]
        values, slopes = function.value_and_jacobian(
            given, known, motions=every or None, every=every, names=wanted
        )
        if known is not None and np.mean(values.outcome == Outcome.CONVERGED) >= self.least:
            self._visited.append((dict(free), known))
            del self._visited[: -max(4, _REMEMBERED // self.table.rows)]
        mu_ss, mu_slopes = _steady(self.law, given, function.compiled_points(self.table.rows))
        predicted = Prediction(
            np.asarray(values.mean_friction), mu_ss, np.asarray(values.harmonics)
        )
        derivatives, zero = {}, np.zeros(self.table.rows)
        # Parameters of other data have no influence.
        none: Any = Prediction(zero, zero, np.zeros((zero.size, 2), complex))
        for name in free:
            source, factor = ("epsilon", applied) if name == "eps_ratio" else (name, 1.0)
            slope = slopes.get(source, none)
            derivatives[name] = Prediction(
                np.asarray(slope.mean_friction) * factor,
                mu_slopes.get(name, zero),
                np.asarray(slope.harmonics) * np.reshape(factor, (-1, 1)),
            )
        return predicted, derivatives, np.asarray(values.outcome)

    def predicted_at_many(
        self, free: Mapping[str, Float], repeats: int, *, near: bool = False
    ) -> tuple[Prediction, NDArray[np.int64]]:
        """Predictions of many sets of parameters, without derivatives.

        Parameters
        ----------
        free : mapping of str to array, shape (repeats * rows,)
            Each set repeated for all rows.
        repeats : int
            Number of sets.
        near : bool
            Whether orbits are close to those of the last call with derivatives, and start from
            them, on the coarse mesh.
        """
        function = self._function(coarse=self.coarse or near)
        fixed = {n: np.tile(v, repeats) for n, v in self.fixed.items()}
        given = parameters_at(fixed, free, function)
        last = self._visited[-1][1] if self._visited else KnownOrbits(self.table.rows)
        parts, together = [], function.compiled_points(1)
        for start in range(0, repeats * self.table.rows, together):
            part = {n: v[start : start + together] for n, v in given.items()}
            rows = np.arange(start, start + len(part["V"])) % self.table.rows
            known = last.picked(rows) if near and self.searches else None
            values = function(part, known, motions=True if near and self.searches else None)
            mu_ss = _steady(self.law, part, together)[0]
            parts.append((values.mean_friction, mu_ss, values.harmonics, values.outcome))
        mean, steady, harmonics, outcome = (
            np.concatenate([np.asarray(p) for p in column]) for column in zip(*parts, strict=True)
        )
        return Prediction(mean, steady, harmonics), outcome

    def _nearest(self, free: Mapping[str, float]) -> KnownOrbits:
        """For each row, the known orbit with the most similar parameters.

        A call starts from these orbits and replaces them. The orbits of the last call would be a
        poor start if a minimiser returns from a step that was too long.
        """
        now = np.array(list(free.values()))
        pairs = [[f.get(n, v) for n, v in free.items()] for f, _ in self._visited]
        visited = np.reshape(pairs, (len(pairs), len(free)))
        largest = np.maximum(np.maximum(np.abs(visited), np.abs(now)), 1e-300)
        squares = np.sum(((visited - now) / largest) ** 2, axis=-1)
        result = KnownOrbits(self.table.rows)
        for k in np.argsort(squares, kind="stable"):
            result.complete(self._visited[k][1], near=bool(squares[k] < _NEAR**2))
            if result.known.all():
                break
        return result


def parameters_at(
    fixed: Mapping[str, Any], free: Mapping[str, Any], function: ResponseFunction
) -> dict[str, Any]:
    """Parameters of a response at the rows of a table, with the amplitude on the contacts.

    Parameters
    ----------
    fixed : mapping of str to array, shape (rows,)
        `epsilon` is as applied.
    free : mapping of str to float or array, shape (rows,)
        Parameters that do not belong to the response are left out.
    function : ResponseFunction
    """
    given = on_contacts({**fixed, **free})
    rows = np.shape(fixed["epsilon"])
    module = jnp if any(isinstance(v, jax.core.Tracer) for v in given.values()) else np
    return {n: module.broadcast_to(v, rows) for n, v in given.items() if n in function.parameters}


def on_contacts(parameters: Mapping[str, Any]) -> dict[str, Any]:
    """Parameters with epsilon multiplied by eps_ratio: the amplitude that the contacts carry."""
    given = dict(parameters)
    given["epsilon"] = given["epsilon"] * given.pop("eps_ratio", 1.0)
    return given


def _steady(
    law: type[Law], given: Mapping[str, Float], compiled: int
) -> tuple[Float, dict[str, Float]]:
    """mu_ss(V) at each row and its derivatives in the parameters of the law.

    The program is compiled for `compiled` rows.
    """
    rows = len(given["V"])
    padded = {
        p: np.pad(given[p], (0, compiled - rows), "edge") for p in (*law_parameters(law), "V")
    }
    value, slopes = _steady_slopes(padded, law=law)
    return np.asarray(value)[:rows], {n: np.asarray(s)[:rows] for n, s in slopes.items()}


@partial(jax.jit, static_argnames=("law",))
def _steady_slopes(given: Mapping[str, Array], *, law: type[Law]) -> tuple[Array, dict[str, Array]]:
    V = given["V"]
    # Rows are independent: the gradient of their sum holds the derivative of each row.
    value, pull = jax.vjp(
        lambda numbers: steady_friction(law, {**numbers, "V": V}),
        {n: v for n, v in given.items() if n != "V"},
    )
    return value, pull(jnp.ones_like(value))[0]


def steady_friction(law: type[Law], given: Mapping[str, Array]) -> Array:
    """mu_ss(V) at each row, for parameters of shape (rows,)."""
    return law_from(law, given).mu_ss(given["V"])


@dataclass(frozen=True)
class _CompiledResiduals:
    """Residuals of a table within compiled programs."""

    law: type[Law]
    motion: tuple[tuple[str, Any], ...]
    search: bool

    def __call__(self, values: Mapping[str, Array], data: tuple[dict[str, Any], Weights]) -> Array:
        fixed, weights = data
        function = response_function(self.law, **dict(self.motion), search=self.search)
        given = parameters_at(fixed, values, function)
        result = function(given)
        mu_ss = steady_friction(self.law, given)
        predicted = Prediction(result.mean_friction, mu_ss, result.harmonics)
        return weights.compared(columns_of(predicted, jnp))
