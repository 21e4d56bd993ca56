"""Further tests of a law: its evidence, cross-validation by runs, and doubts about a verdict.

Evidence is the probability of the data under a law, averaged over its prior. The integral of
likelihood times prior over the parameters is computed by importance sampling from Student's t about
the mode in whitened coordinates; without samples, by the normal approximation (Laplace).

Cross-validation leaves out one run at a time. Readings of one run share their errors: leaving out
single readings would flatter every law. A run is a file, or all rows with the same entry in the
column ``run``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from asperity.arrays import Bool, Float
from asperity.errors import Argument
from asperity.inference.fitting.result import Fit
from asperity.inference.objective import Residuals, log_density
from asperity.inference.posterior.density import Whitened
from asperity.inference.runs.noise import innovations
from asperity.inference.runs.term import RunTerm
from asperity.inference.tables.term import LockInTerm

#: A law whose chi-squared has a lower probability is excluded if another law fits better.
IMPOSSIBLE = 1e-3
#: Differences of AICc from which a law is disfavoured (weight 1/7) and excluded (1/150).
DISFAVOURED, EXCLUDED = 4.0, 10.0
#: A law whose evidence is lower by this factor is disfavoured: strong evidence.
FACTOR = 20.0

#: Degrees of freedom of the distribution from which samples are drawn.
_TAILS = 5.0
#: With fewer effective samples the evidence is not reliable.
_ENOUGH = 50.0

#: Number of parts of a recording. A stretch that holds this share of the difference between two
#: laws is named if it is shorter than the last share of the recording.
_PARTS, _MOST, _SHORT = 200, 0.8, 0.1


@dataclass(frozen=True)
class Evidence:
    """Evidence of a law.

    Attributes
    ----------
    log : float
        Natural logarithm of the evidence.
    standard_error : float
        Standard error of `log`, due to sampling.
    effective_samples : float
        Effective number of samples, from the importance weights.
    laplace : float
        The normal approximation of `log`.
    failed : int
        Samples at which the law has no solution; they count as impossible.
    prior : mapping
        Prior of each parameter, as plain numbers: the evidence depends on the ranges.
    """

    log: float
    standard_error: float
    effective_samples: float
    laplace: float
    failed: int
    prior: dict[str, Any]

    @property
    def reliable(self) -> bool:
        """Whether there are enough effective samples."""
        return self.effective_samples >= _ENOUGH


def evidence_of(fit: Fit, *, samples: int | None = None, seed: int = 0) -> Evidence:
    """Evidence of a fitted law.

    Parameters
    ----------
    fit : Fit
        Converged.
    samples : int, optional
        By default 1024 for a table, 256 with a recording, and 80 where orbits are searched for; 0
        for the normal approximation alone.
    seed : int

    Notes
    -----
    The prior is that of `Coordinates`. If the range of a parameter that these data determine is k
    times wider, the logarithm of the evidence is lower by ln k.
    """
    if samples is None:
        samples = min(term.affordable for term in fit.objective.terms)
    if not fit.objective.unknowns:
        # Without free parameters there is no average.
        density = fit.log_likelihood
        return Evidence(density, 0.0, float(samples), density, 0, {})
    whitened = Whitened.of(fit)
    n = whitened.mode.size
    (mode,), (at_mode,) = _with_log_prior(whitened, np.zeros((1, n)))
    laplace = fit.objective.log_likelihood(mode) + at_mode + 0.5 * n * math.log(2 * math.pi)
    if samples == 0:
        return Evidence(laplace, math.nan, 0.0, laplace, 0, whitened.prior_record())
    # Loading all of scipy.stats would take longer than the start of a fit of a velocity step.
    from scipy.stats import multivariate_t

    proposal = multivariate_t(np.zeros(n), np.eye(n), df=_TAILS, seed=seed)
    z = np.asarray(proposal.rvs(samples)).reshape(samples, n)
    log_weights = _log_target(fit, whitened, z) - proposal.logpdf(z).reshape(samples)
    failed = int((~np.isfinite(log_weights)).sum())
    log_weights = np.where(np.isfinite(log_weights), log_weights, -np.inf)
    top = log_weights.max()
    weights = np.exp(log_weights - top)
    mean = weights.mean()
    return Evidence(
        float(top + math.log(mean)),
        float(weights.std(ddof=1) / (mean * math.sqrt(samples))),
        float(weights.sum() ** 2 / (weights**2).sum()),
        laplace,
        failed,
        whitened.prior_record(),
    )


def _with_log_prior(whitened: Whitened, z: Float) -> tuple[Float, Float]:
    """Coordinates of the fit, and the logarithm of the prior times the volume dq/dz du/dq."""
    q = whitened.mode + z @ whitened.root.T
    u = np.asarray(whitened.coordinates.to_u(q))
    volume = np.asarray(whitened.coordinates.log_slope(q)).sum(-1)
    volume = volume + np.linalg.slogdet(whitened.root)[1]
    return u, whitened.coordinates.log_density(u) + volume


def _log_target(fit: Fit, whitened: Whitened, z: Float) -> Float:
    """Logarithm of likelihood times prior times volume, shape (samples,)."""
    u, total = _with_log_prior(whitened, z)
    values = [fit.objective.named(x) for x in u]
    for term, residuals in zip(fit.objective.terms, fit.residuals, strict=True):
        # The difference from the estimate: the error of a coarse model of searched orbits cancels.
        at_estimate, *chi2 = term.chi2_of_many([fit.values, *values], near=True)
        total += log_density(residuals) - 0.5 * (np.array(chi2) - at_estimate)
    return total


@dataclass(frozen=True)
class CrossValidation:
    """Predictive densities of runs that were left out.

    Attributes
    ----------
    log_density : float
        Expected log predictive density: the sum over the runs.
    runs : mapping of str to float
        Log predictive density of each run.
    message : str
        Reason if there are no numbers.
    """

    log_density: float
    runs: dict[str, float]
    message: str = ""

    def difference(self, other: CrossValidation) -> tuple[float, float]:
        """Difference of the log densities from another law's, and its standard error."""
        apart = np.array([self.runs[name] - other.runs[name] for name in self.runs])
        if apart.size < 2:
            return float(apart.sum()), math.nan
        return float(apart.sum()), float(apart.std(ddof=1) * math.sqrt(apart.size))


def leave_one_run_out(fit: Fit) -> CrossValidation:
    """Cross-validation of a converged fit to tables of lock-in readings.

    The density of a run is normal about the prediction of the fit to the other runs. Its variance
    includes the uncertainty of the parameters from these runs and the errors of the readings.
    """
    tables = fit.objective.terms_of(LockInTerm)
    if not tables or len(fit.objective.terms) > 1:
        return CrossValidation(math.nan, {}, "data other than tables have no runs to leave out")
    (term,) = tables
    names = list(dict.fromkeys(term.table.run.tolist()))
    if len(names) < 2:
        return CrossValidation(
            math.nan, {}, "all rows are of one run; name the runs in a column 'run'"
        )
    runs = {name: _predictive(fit, term, term.table.run == name) for name in names}
    if not all(math.isfinite(value) for value in runs.values()):
        return CrossValidation(math.nan, runs, "the other runs do not determine the parameters")
    return CrossValidation(sum(runs.values()), runs)


def _predictive(fit: Fit, term: LockInTerm, left_out: Bool) -> float:
    """Log density of the rows left out, predicted by the other rows."""
    objective = fit.objective
    rest = replace(objective, terms=(term.weighted(np.where(left_out, 0.0, 1.0)),))
    u = rest.minimise(objective.coordinates(fit.values))[0]
    data = objective.data_residuals(u)
    if data is None:
        return math.nan
    out = left_out[data[0].row]
    r_out, J_out = data[0].values[out], data[0].jacobian[out]
    J = np.vstack([data[0].jacobian[~out], objective.prior_residuals(u)[1]])
    information = J.T @ J
    if u.size and np.linalg.cond(information) > 1e14:
        return math.nan
    spread = np.eye(r_out.size) + J_out @ np.linalg.solve(information, J_out.T)
    log_scale = float(term.weights.log_scales[left_out].sum())
    distance = float(r_out @ np.linalg.solve(spread, r_out))
    return float(
        -0.5 * (distance + np.linalg.slogdet(spread)[1] + r_out.size * math.log(2 * math.pi))
        - log_scale
    )


def support(best: Fit, other: Fit) -> tuple[str, str]:
    """Sentences on doubts about the verdict between two laws, and on stretches that decide it.

    Two doubts are about the window. The difference of AICc is a sum over the recording, in
    proportion to the squared innovations. The verdict may rest on a short stretch: without it, the
    other law would not be excluded. Or it may depend on the window: one half of the recording alone
    would exclude the better law. If the better law is true, the latter has a probability below
    exp(-5), by Markov's inequality for the ratio of likelihoods.

    Parameters
    ----------
    best, other : Fit
        Converged fits to the same data.

    Returns
    -------
    doubts, stretches : str
        Empty if there are none.
    """
    doubts, stretches = [], []
    behind = other.aicc - best.aicc
    apart = _deviance(*other.residuals) - _deviance(*best.residuals)
    pairs = zip(best.parts(RunTerm), other.parts(RunTerm), strict=True)
    for (first, ours), (second, theirs) in pairs:
        name, time = first.name, first.run.recorded_times(first.run.time)
        # The part of the difference of AICc that this recording has among all data.
        gain = behind - (apart - (_deviance(theirs) - _deviance(ours)))
        doubts += [f"even under {best.law} {doubt}" for doubt in first.doubts]
        if gain <= -EXCLUDED:
            doubts.append(f"{name} alone is for {other.law}, by {-gain:.3g} in AICc")
        edges, total = _gains(first, best, second, other)
        if gain <= 0 or not total[-1] > 0:
            continue
        total = total / total[-1]
        begin, end, _ = _shortest(edges, total, _MOST * behind / gain, time)
        span = f"{begin:.4g} to {end:.4g} s of {name}"
        whole = float(time[-1] - time[0])
        a, b, share = _shortest(edges, total, max(behind - EXCLUDED, 0.0) / gain, time)
        if behind >= EXCLUDED and b - a <= _SHORT * whole:
            doubts.append(
                f"it rests on {a:.4g} to {b:.4g} s of {name}, {(b - a) / whole:.1%} of the "
                f"recording: without that stretch the AICc of {other.law} is "
                f"{behind - gain * share:.3g} above that of {best.law}, and {EXCLUDED:g} excludes "
                f"(compare without it: {Argument('window')})"
            )
        elif end - begin <= _SHORT * whole:
            stretches.append(
                f"Most of what tells {best.law} from {other.law} lies in {span}, "
                f"{(end - begin) / whole:.1%} of it"
            )
        middle = len(edges) // 2
        halves = {"first": gain * total[middle], "second": gain * (1 - total[middle])}
        doubts += [
            f"it changes with the window: the {half} half of {name} alone is for {other.law}, by "
            f"{-part:.3g} in AICc"
            for half, part in halves.items()
            if part <= -EXCLUDED
        ]
        jumps = first.run.recorded_times(first.run.jumps or ())
        inside = [f"{t:.4g} s" for t in jumps if begin <= t <= end]
        if inside:
            doubts.append(f"the recording jumps at {', '.join(inside)}, in the deciding {span}")
    doubt = f"This verdict is doubtful: {'; '.join(doubts)}. " if doubts else ""
    return doubt, "".join(f" {sentence}." for sentence in stretches)


def _deviance(*data: Residuals) -> float:
    """-2 ln of the density of some data."""
    return -2 * sum(map(log_density, data))


def _gains(first: RunTerm, best: Fit, second: RunTerm, other: Fit) -> tuple[Float, Float]:
    """Edges of the parts of a recording, as sample numbers, and the cumulative gain at each edge.

    The gain is the decrease of the sum of squared innovations from `other` to `best`. Both laws are
    judged by the noise under the better law, without the samples that are wrong under it.
    """
    run = first.run
    noise = [model.whitening for model in first.models]
    squares = [
        innovations(
            run.friction - term.fitted_friction(fit.values), noise, run.stretches, first.basis
        )
        ** 2
        for term, fit in ((first, best), (second, other))
    ]
    edges = np.linspace(0, run.time.size, min(_PARTS, run.time.size) + 1).astype(int)
    gains = np.add.reduceat(squares[1] - squares[0], edges[:-1])
    total = np.concatenate([[0.0], np.cumsum(gains)])
    return edges, total


def _shortest(edges: Float, total: Float, share: float, time: Float) -> tuple[float, float, float]:
    """Ends (s) of the shortest stretch with a given share of the gain, and its actual share.

    The whole recording if no stretch has this share.
    """
    within = total[None, :] - total[:, None] >= share
    within[0, -1] = True
    length = np.where(np.triu(within, 1), edges[None, :] - edges[:, None], edges[-1] + 1)
    i, j = np.unravel_index(np.argmin(length), length.shape)
    return float(time[edges[i]]), float(time[edges[j] - 1]), float(total[j] - total[i])
