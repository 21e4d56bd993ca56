"""The function that a fit minimises, for data of any kind.

Every set of data is a `DataTerm`. It turns values of the parameters into residuals that have unit
variance and no correlation if the law is right, so that a sum of squares is chi-squared. The
likelihood is the product over the terms; priors are normal in the parameter itself.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple, TypeVar

import numpy as np
from jax import Array
from numpy.typing import NDArray
from scipy.optimize import least_squares

from asperity.arrays import Bool, Float, Index
from asperity.errors import Argument, InputError
from asperity.inference import levenberg_marquardt
from asperity.inference.unknowns import Unknown
from asperity.laws import Law

T = TypeVar("T")

#: Residuals of parameters by name, and of arrays.
CompiledResiduals = Callable[[Mapping[str, Array], Any], Array]

#: Relative change of the coordinates at which a minimisation by the coarse model ends. The exact
#: model continues from there: its minimum is farther away.
_COARSE = 1e-3
#: Relative decrease of chi-squared that is negligible: with chi-squared of 100, a ten-thousandth of
#: a standard error. Orbits on the mesh are no more accurate.
_NEGLIGIBLE = 1e-10
#: Smallest distance of the start of a minimisation from the bounds.
_INSIDE = 2e-10


class Residuals(NamedTuple):
    """Residuals, with the observable and row of each.

    Attributes
    ----------
    values : array, shape (n,)
        (model - data) / standard uncertainty, whitened where observables are correlated.
    jacobian : array, shape (n, parameters)
    observable : array of str, shape (n,)
    row : array of int, shape (n,)
    log_scale : float
        Half the log determinant of the covariance: the sum of the logarithms of the standard
        uncertainties.
    """

    values: Float
    jacobian: Float
    observable: NDArray[np.str_]
    row: Index
    log_scale: float


class Minimum(NamedTuple):
    """The end of a minimisation.

    Attributes
    ----------
    u : array, shape (n,)
        Coordinates.
    chi2 : float
        Chi-squared; infinite without a solution.
    """

    u: Float
    chi2: float


class DataTerm(ABC):
    """One set of data in the likelihood.

    Attributes
    ----------
    name : str
        Name of the data in messages.
    observables : tuple of str
        Names of the observables of the data; the `observable` of each residual is one of these.
    nuisances : tuple of Unknown
        Free parameters of these data alone, such as the offset of a gauge.
    failure : str
        Message of a failed fit: why the residuals may not exist, and what to do.
    searches : bool or None
        Whether every call searches for orbits that the fast method does not reach. None for data
        other than periodic responses.
    affordable : int
        Number of evaluations for an integral over the parameters.
    """

    name: str
    observables: tuple[str, ...]
    nuisances: tuple[Unknown, ...] = ()
    failure: str
    searches: bool | None = None
    affordable: int = 256

    @property
    @abstractmethod
    def noise(self) -> Mapping[str, Any]:
        """Model of the noise and `effective_samples`, plain numbers and texts for JSON."""

    @property
    def profiled(self) -> int:
        """Number of parameters that the term itself fits at given values of all others.

        They count in AICc, BIC and degrees of freedom.
        """
        return 0

    @abstractmethod
    def residuals(self, values: Mapping[str, float]) -> Residuals | None:
        """Whitened residuals; None where the law has no solution.

        Parameters
        ----------
        values : mapping of str to float
            All free parameters and nuisances of the fit, in SI. The columns of the Jacobian are the
            derivatives with respect to these, in this order; zeros without dependence.
        """

    def log_likelihood(self, residuals: Residuals) -> float:
        """Logarithm of the density of the data at the estimate."""
        return log_density(residuals)

    def chi2_of_many(self, values: Sequence[Mapping[str, float]], *, near: bool = False) -> Float:
        """Sums of the squared residuals at many sets of parameters, without derivatives.

        Parameters
        ----------
        values : sequence of mapping of str to float
        near : bool
            Whether solutions are close to those of the last call of `residuals`, and start from
            them. The sums may then be those of a coarser model; only their differences are right.

        Returns
        -------
        array, shape (sets,)
            Infinite without a solution.
        """
        several = [self.residuals(numbers) for numbers in values]
        return np.array([np.inf if r is None else np.sum(r.values**2) for r in several])

    @abstractmethod
    def observed(self) -> Mapping[str, Float]:
        """Columns of the data, for files of draws."""

    def compiled(self, names: tuple[str, ...]) -> tuple[CompiledResiduals, Any]:
        """The residuals as a function for compiled programs, and its arrays.

        Parameters
        ----------
        names : tuple of str
            All free parameters and nuisances of the fit.

        Returns
        -------
        callable
            Function of the parameters by name and of the arrays; equal functions share a compiled
            program. The sum of squares is that of `residuals`, and NaN without a solution.
        pytree of arrays

        Raises
        ------
        InputError
            If the prediction of the data has no derivatives within compiled programs.
        """
        rule = "be of lock-in readings or recordings of sliding"
        advice = f"take intervals by profile likelihood ({Argument('profile', value='True')})"
        raise InputError("a posterior", rule, self.name, advice)

    def thinned(self, rows: int, data: int = 0) -> DataTerm | None:
        """The same data with fewer rows and a coarser model, for the search for minima.

        Some of these rows may have no solution: chi-squared is then that of the other rows, scaled
        to all rows.

        Parameters
        ----------
        rows, data : int
            Number of rows, spread over all rows, and smallest number of readings in them.

        Returns
        -------
        DataTerm or None
            None for data other than tables of lock-in readings.
        """
        return None

    def coarser(self, *, partly: bool = True) -> DataTerm:
        """The same data with a coarser model, for the approach to a minimum; itself without one.

        Parameters
        ----------
        partly : bool
            Whether half of the data may have no solution, as in `partial`.
        """
        return self

    def partial(self) -> DataTerm:
        """The same data, of which half without a solution may be left out; itself without these."""
        return self

    def smoother(self) -> DataTerm:
        """The same data with larger uncertainties: chi-squared then has fewer minima."""
        return self

    def uncertainty_of_noise(
        self, values: Mapping[str, float], slopes: Float, covariance: Float
    ) -> tuple[Float, Float]:
        """The addition of estimated noise to a covariance, and the variance of its diagonal.

        Parameters
        ----------
        values : mapping of str to float
            Free parameters and nuisances of the fit, in SI, at the estimate.
        slopes : array, shape (parameters,)
            Derivatives of the values with respect to the coordinates of the covariance.
        covariance : array, shape (parameters, parameters)
            Covariance under known noise.

        Returns
        -------
        array, shape (parameters, parameters), and array, shape (parameters,)
            Addition and variance; zeros if the uncertainties are given.
        """
        return np.zeros_like(covariance), np.zeros(slopes.size)

    def use_search(self, always: bool) -> None:  # noqa: B027
        """Set whether every call tries the slower method, for data that have one."""

    def warnings(
        self, residuals: Residuals, information: Float, outliers: Sequence[int] = ()
    ) -> Sequence[str]:
        """Warnings about these data.

        Parameters
        ----------
        residuals : Residuals
            Residuals at the estimate.
        information : array, shape (coordinates, coordinates)
            Information matrix of all data and priors at the estimate.
        outliers : sequence of int
            Rows without which the law describes a table.
        """
        return ()

    def instability(self, values: Mapping[str, float]) -> Sequence[str]:
        """Sentences on data that are no measurement if the free parameters are `values`, in SI."""
        return ()

    def reversal(self, values: Mapping[str, float]) -> Sequence[str]:
        """Sentences on data for which slip would reverse, as for `instability`."""
        return ()


@dataclass
class Objective:
    """Residuals, likelihood and prior as functions of the coordinates u of the free parameters.

    Attributes
    ----------
    terms : tuple of DataTerm
    law : type of Law
    unknowns : tuple of Unknown
        Free parameters of the law and the machine, then the nuisances of the terms.
    fixed : mapping of str to float or array
        Parameters that are not free, in SI.
    tolerance : float
        A minimisation ends at this relative change of the coordinates.
    curved : bool
        Whether chi-squared has narrow valleys that bend (`asperity.inference.levenberg_marquardt`).
    unsolved : int
        Number of evaluations so far at which a term had no solution by the slower method.
    """

    terms: tuple[DataTerm, ...]
    law: type[Law]
    unknowns: tuple[Unknown, ...]
    fixed: Mapping[str, Any]
    tolerance: float = 1e-10
    curved: bool = False
    unsolved: int = field(default=0, init=False, repr=False)
    # State of this object: `dataclasses.replace` does not copy it.
    _last: dict[bytes, tuple[Float, Float]] = field(default_factory=dict, init=False, repr=False)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the free parameters, in the order of the coordinates."""
        return tuple(k.name for k in self.unknowns)

    @property
    def interest(self) -> tuple[Unknown, ...]:
        """The free parameters that are no nuisances."""
        return tuple(k for k in self.unknowns if not k.nuisance)

    @property
    def bounds(self) -> tuple[Float, Float]:
        """Lower and upper bounds of the coordinates, each of shape (n,)."""
        low, high = np.array([k.bounds for k in self.unknowns]).reshape(-1, 2).T
        return low, high

    def named(self, u: Float) -> dict[str, float]:
        """Values by name at the coordinates u."""
        return {k.name: float(k.to_value(x)) for k, x in zip(self.unknowns, u, strict=True)}

    def coordinates(self, values: Mapping[str, float]) -> Float:
        """Coordinates of values by name."""
        return np.array([float(k.to_coordinate(values[k.name])) for k in self.unknowns])

    def ordered(self, u: Float) -> Float:
        """The same point with exchangeable parameters sorted, so that the first of each group rise.

        The point is unchanged if exchangeable parameters are not all free, have different priors,
        or cannot have each other's values.
        """
        sets = self.law.exchangeable
        known = {k.name: k for k in self.unknowns}
        if not sets or not all(n in known for names in sets for n in names):
            return u
        same = [zip(sets[0], names, strict=True) for names in sets[1:]]
        if any(known[a].prior != known[b].prior for pairs in same for a, b in pairs):
            return u
        values = self.named(u)
        ranked = sorted(sets, key=lambda names: values[names[0]])
        moved = values | {
            new: values[old]
            for names, others in zip(sets, ranked, strict=True)
            for new, old in zip(names, others, strict=True)
        }
        changed = [n for names in sets for n in names]
        if any(moved[n] <= 0 and known[n].logarithmic for n in changed):
            return u
        result = self.coordinates(moved)
        low, high = self.bounds
        return result if ((result >= low) & (result <= high)).all() else u

    def data_residuals(self, u: Float) -> list[Residuals] | None:
        """Residuals of each term, with derivatives in the coordinates; None without a solution."""
        values = self.named(u)
        slopes = np.array([k.slope(values[k.name]) for k in self.unknowns])
        result = []
        for term in self.terms:
            residuals = term.residuals(values)
            if residuals is None:
                return None
            result.append(residuals._replace(jacobian=residuals.jacobian * slopes))
        return result

    def residuals(self, u: Float) -> tuple[Float, Float]:
        """Residuals of data and priors and their Jacobian; NaN without a solution."""
        key = u.tobytes()
        if key not in self._last:
            # Two points are kept: a step that is rejected returns to the point before.
            for old in list(self._last)[:-1]:
                del self._last[old]
            self._last[key] = self._evaluate(u)
        return self._last[key]

    def _evaluate(self, u: Float) -> tuple[Float, Float]:
        data = self.data_residuals(u)
        if data is None:
            self.unsolved += self.searches
            return np.array([np.nan]), np.full((1, len(self.unknowns)), np.nan)
        priors, slopes = self.prior_residuals(u)
        return (
            np.concatenate([*(d.values for d in data), priors]),
            np.vstack([*(d.jacobian for d in data), slopes]),
        )

    def prior_residuals(self, u: Float) -> tuple[Float, Float]:
        """(value - mean) / standard deviation of each prior, and the Jacobian."""
        known = [(i, k, k.prior) for i, k in enumerate(self.unknowns) if k.prior is not None]
        values, jacobian = np.zeros(len(known)), np.zeros((len(known), len(self.unknowns)))
        for row, (i, unknown, prior) in enumerate(known):
            x = float(unknown.to_value(u[i]))
            values[row] = (x - prior.mean) / prior.sd
            jacobian[row, i] = unknown.slope(x) / prior.sd
        return values, jacobian

    def chi2(self, u: Float) -> float:
        """Chi-squared of data and priors; infinite without a solution."""
        value = float(np.sum(self.residuals(u)[0] ** 2))
        return value if math.isfinite(value) else math.inf

    def log_likelihood(self, u: Float) -> float:
        """Logarithm of the density of the data at u; minus infinity without a solution."""
        data = self.data_residuals(u)
        return -math.inf if data is None else float(sum(log_density(d) for d in data))

    def instability(self, u: Float) -> list[str]:
        """Sentences on data that are no measurement at u: `DataTerm.instability` of all terms."""
        values = self.named(u)
        return [sentence for term in self.terms for sentence in term.instability(values)]

    def forget(self) -> None:
        """Forget the last evaluations: a term has changed."""
        self._last.clear()

    def use_search(self, always: bool) -> None:
        """Set whether every call tries the slower method of the terms."""
        for term in self.terms:
            term.use_search(always)
        self.forget()

    def minimise(
        self,
        u: Float,
        kept: Mapping[int, float] | None = None,
        *,
        tolerance: float | None = None,
        evaluations: int = 100,
        negligible: float = 0.0,
    ) -> Minimum:
        """Minimise chi-squared from u.

        Parameters
        ----------
        u : array, shape (n,)
        kept : mapping of int to float, optional
            Values of coordinates, by index, that stay fixed.
        tolerance : float, optional
            Relative change of the coordinates that ends the minimisation; by default that of the
            objective.
        evaluations : int
            Largest number of evaluations of the residuals.
        negligible : float
            The minimisation ends at the first point from which chi-squared is expected to decrease
            by no more.
        """
        tolerance = self.tolerance if tolerance is None else tolerance
        kept = dict(kept or {})
        moving = [i for i in range(len(u)) if i not in kept]
        point = np.array(u, float)
        for i, value in kept.items():
            point[i] = value
        low, high = (ends[moving] for ends in self.bounds)
        # The start is so far inside the bounds that SciPy does not move it.
        inset = _INSIDE * np.clip(np.abs([low, high]), 1, 1e9)
        point[moving] = np.clip(point[moving], low + inset[0], high - inset[1])
        ahead = self.coarser()
        if ahead is not self:
            ending = max(tolerance, _COARSE)
            near = ahead.minimise(
                point, kept, tolerance=ending, evaluations=evaluations, negligible=negligible
            )
            self.unsolved += ahead.unsolved
            if self.chi2(point) >= self.chi2(near.u):
                point = near.u
        if not moving or not math.isfinite(self.chi2(point)):
            return Minimum(point, self.chi2(point))

        def of_moving(part: Float) -> tuple[Float, Float]:
            whole = point.copy()
            whole[moving] = part
            r, jacobian = self.residuals(whole)
            return r, jacobian[:, moving]

        def at_end(part: Float) -> bool:
            decrease = levenberg_marquardt.predicted_decrease
            return negligible > 0 and decrease(*of_moving(part), part, low, high) <= negligible

        def triangle(part: Float) -> Float:
            r, jacobian = of_moving(part)
            return compressed(np.column_stack([jacobian, r]))

        begin = point[moving]
        if at_end(begin):
            return Minimum(point, self.chi2(point))
        if self.curved:
            end = levenberg_marquardt.minimised(of_moving, begin, low, high, evaluations)
        else:
            end = least_squares(
                lambda part: triangle(part)[:, -1],
                begin,
                jac=lambda part: triangle(part)[:, :-1],
                bounds=(low, high),
                x_scale="jac",
                xtol=tolerance,
                ftol=max(1e-2 * tolerance, _NEGLIGIBLE),
                gtol=tolerance,
                max_nfev=evaluations,
                callback=lambda intermediate_result: _stop_if(at_end(intermediate_result.x)),
            ).x
        point[moving] = end
        return Minimum(point, self.chi2(point))

    def coarser(self, *, partly: bool = True) -> Objective:
        """The objective of `DataTerm.coarser` data; itself without a coarser model."""
        return self._of([term.coarser(partly=partly) for term in self.terms])

    def partial(self) -> Objective:
        """The objective of `DataTerm.partial` data; itself without these."""
        return self._of([term.partial() for term in self.terms])

    def smoother(self) -> Objective:
        """The objective of `DataTerm.smoother` data."""
        return self._of([term.smoother() for term in self.terms])

    def _of(self, terms: Sequence[DataTerm]) -> Objective:
        same = all(a is b for a, b in zip(terms, self.terms, strict=True))
        return self if same else replace(self, terms=tuple(terms))

    def expected_decrease(self, u: Float) -> float:
        """Possible decrease of chi-squared, by residuals that are linear in the coordinates.

        Nearly 0 at a minimum, also at a minimum on a bound; larger if a minimisation has stopped at
        the edge of the region in which the residuals exist.
        """
        return levenberg_marquardt.predicted_decrease(*self.residuals(u), u, *self.bounds)

    def active_bounds(self, u: Float, gradient: Float) -> Bool:
        """Mask of coordinates in which a bound prevents a decrease of chi-squared at u."""
        low, high = self.bounds
        return np.asarray(np.where(gradient > 0, u - low, high - u) < levenberg_marquardt.AT_BOUND)

    def terms_of(self, kind: type[T]) -> list[T]:
        """All terms of one kind, tables or recordings."""
        return [term for term in self.terms if isinstance(term, kind)]

    @property
    def has_table(self) -> bool:
        """Whether the data include periodic responses."""
        return any(term.searches is not None for term in self.terms)

    @property
    def searches(self) -> bool:
        """Whether every call tries the slower method of all tables."""
        return all(term.searches is not False for term in self.terms)

    @property
    def noise_is_known(self) -> bool:
        """Whether no noise is estimated: the data have no recordings."""
        return all(term.profiled == 0 for term in self.terms)

    def thinned(self, rows: int, data: int = 0) -> Objective | None:
        """The objective of `DataTerm.thinned` data; None unless the data are one table."""
        term = self.terms[0].thinned(rows, data) if len(self.terms) == 1 else None
        return None if term is None else replace(self, terms=(term,))

    def chi2_of_many(self, u: Float) -> Float:
        """Chi-squared of data and priors at many coordinates, shapes (samples, n) to (samples,).

        Parameters
        ----------
        u : array, shape (samples, n)
        """
        priors = np.array([np.sum(self.prior_residuals(x)[0] ** 2) for x in u])
        values = [self.named(x) for x in u]
        return sum((term.chi2_of_many(values) for term in self.terms), priors)


def _stop_if(ended: bool) -> None:
    """End an iteration of SciPy by the exception that it asks for."""
    if ended:
        raise StopIteration


def compressed(columns: Float) -> Float:
    """Few rows with the same inner products of the columns as many rows.

    Parameters
    ----------
    columns : array, shape (m, n)

    Returns
    -------
    array, shape (at most n, n)
        Triangle R of columns = Q R; the columns themselves if they are not finite.

    Notes
    -----
    Blocks of rows are factorised one by one (Demmel et al., SIAM J. Sci. Comput. 34, A206, 2012):
    in one factorisation of thousands of rows, threads of BLAS would wait for each other.
    """
    if not np.isfinite(columns).all():
        return columns
    width = columns.shape[1]
    block = 8 * width
    while columns.shape[0] > block:
        whole = columns.shape[0] // block * block
        blocks = columns[:whole].reshape(-1, block, width)
        factors = np.asarray(np.linalg.qr(blocks, mode="r"))
        columns = np.vstack([factors.reshape(-1, width), columns[whole:]])
    return np.asarray(np.linalg.qr(columns, mode="r"))


def log_density(data: Residuals) -> float:
    """Logarithm of the normal density of the data of a term."""
    n = data.values.size
    return -0.5 * (float(np.sum(data.values**2)) + n * math.log(2 * math.pi)) - data.log_scale


def aicc_penalty(parameters: float, data: float) -> float:
    """The term that AICc adds to the deviance; infinite if there are too few data."""
    if not parameters:
        return 0.0
    if data <= parameters + 1:
        return math.inf
    return 2 * parameters + 2 * parameters * (parameters + 1) / (data - parameters - 1)
