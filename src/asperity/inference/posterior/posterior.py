"""A sampled posterior: draws, intervals, and convergence of the chains."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

import jax
import numpy as np
from numpy.typing import NDArray

from asperity._version import __version__
from asperity.arrays import Bool, Float
from asperity.errors import named
from asperity.inference.fitting.intervals import LEVELS, Interval
from asperity.inference.fitting.result import Fit, Warned
from asperity.inference.posterior.density import Whitened
from asperity.outputs.json import plain

#: Chains agree below this R-hat (Vehtari et al., 2021).
_LARGEST_R_HAT = 1.01
#: Quantiles are reliable from this number of effective draws per chain on (same source).
_EFFECTIVE_DRAWS = 100.0
#: A warning is given if a larger share of trajectories ends without a solution.
_FEW_FAILED = 1e-3


class Transitions(NamedTuple):
    """Draws of a chain with their statistics.

    Attributes
    ----------
    z : array, shape (draws, n)
    log_density : array, shape (draws,)
    acceptance : array, shape (draws,)
        Mean acceptance over the trajectory.
    steps : int array, shape (draws,)
        Number of evaluations of the gradient.
    diverging : bool array, shape (draws,)
        Whether the energy rose by more than 1000.
    failed : bool array, shape (draws,)
        Whether the trajectory ended at a point without a density.
    energy : array, shape (draws,)
    """

    z: Any
    log_density: Any
    acceptance: Any
    steps: Any
    diverging: Any
    failed: Any
    energy: Any


@dataclass(frozen=True)
class Marginal:
    """The posterior of one parameter, in SI.

    Attributes
    ----------
    name, unit : str
    mean, sd, median : float
    interval_68, interval_95 : (float, float)
        Between quantiles of equal tails.
    r_hat, ess_bulk, ess_tail : float
        Rank-normalised split R-hat and effective sample sizes.
    """

    name: str
    unit: str
    mean: float
    sd: float
    median: float
    interval_68: Interval
    interval_95: Interval
    r_hat: float
    ess_bulk: float
    ess_tail: float


@dataclass(frozen=True, eq=False)
class Posterior(Warned):
    """Draws from the posterior of a fit.

    Attributes
    ----------
    fit : Fit
        The fit.
    parameters : mapping of str to Marginal
    draws : mapping of str to array, shape (chains, draws)
        Draws in SI.
    log_density : array, shape (chains, draws)
        Logarithm of the density, up to a constant.
    acceptance, energy : array, shape (chains, draws)
    steps : int array, shape (chains, draws)
        Evaluations of the gradient.
    diverging, failed : bool array, shape (chains, draws)
        Whether the energy of the trajectory was not conserved; whether the trajectory ended at
        values at which the law has no solution.
    seed : int
    prior : mapping
        Prior of each parameter, as plain numbers.
    sentences : tuple of str
        As in `Warned`, which has the warnings.
    """

    fit: Fit
    parameters: Mapping[str, Marginal]
    draws: Mapping[str, Float]
    log_density: Float
    acceptance: Float
    energy: Float
    steps: NDArray[np.int64]
    diverging: Bool
    failed: Bool
    seed: int
    prior: Mapping[str, Any]
    sentences: tuple[str, ...]

    @property
    def converged(self) -> bool:
        """Whether the chains agree and have enough effective draws."""
        chains = self.log_density.shape[0]
        return all(
            p.r_hat <= _LARGEST_R_HAT and min(p.ess_bulk, p.ess_tail) >= _EFFECTIVE_DRAWS * chains
            for p in self.parameters.values()
        )

    def record(self) -> dict[str, Any]:
        """Summary as plain numbers and texts, for JSON."""
        chains, draws = self.log_density.shape
        return {
            "converged": self.converged,
            "chains": chains,
            "draws": draws,
            "seed": self.seed,
            "parameters": {
                name: {key: plain(value) for key, value in vars(p).items() if key != "name"}
                | {"prior": self.prior[name]}
                for name, p in self.parameters.items()
            },
            "divergences": int(self.diverging.sum()),
            "failed": int(self.failed.sum()),
            "mean_acceptance": float(self.acceptance.mean()),
            "gradients": int(self.steps.sum()),
            "warnings": list(self.warnings),
        }

    def to_datatree(self) -> Any:
        """Groups posterior, sample_stats and observed_data, in the format of ArviZ."""
        from arviz_base import from_dict

        tree = from_dict(
            {
                "posterior": dict(self.draws),
                "sample_stats": {
                    "lp": self.log_density,
                    "acceptance_rate": self.acceptance,
                    "energy": self.energy,
                    "n_steps": self.steps,
                    "diverging": self.diverging,
                    "failed": self.failed,
                },
                "observed_data": _observed(self.fit),
            }
        )
        for name, p in self.parameters.items():
            tree["posterior"][name].attrs["units"] = p.unit
        tree.attrs |= {
            "title": f"Posterior of {self.fit.law}",
            "source": f"asperity {__version__}",
            "seed": self.seed,
        }
        return tree

    def to_netcdf(self, path: str | Path) -> None:
        """Write the draws as NetCDF, which ``arviz.from_netcdf`` and ``xarray.open_datatree`` read.

        Parameters
        ----------
        path : str or Path
        """
        self.to_datatree().to_netcdf(path, engine="h5netcdf")


def posterior_of(
    fit: Fit, whitened: Whitened, runs: Sequence[Sequence[Transitions]], *, seed: int
) -> Posterior:
    """The posterior from the blocks of all chains, without their warm-up."""
    # Untyped, and installed only with the extra.
    array_stats: Any = import_module("arviz_stats.base").array_stats
    chains = [jax.tree.map(lambda *blocks: np.concatenate(blocks), *run) for run in runs]
    stats: Transitions = jax.tree.map(lambda *whole: np.stack(whole), *chains)
    u = whitened.u_of(stats.z)
    draws, marginals = {}, {}
    for i, unknown in enumerate(fit.objective.unknowns):
        x = np.asarray(unknown.to_value(u[..., i]))
        draws[unknown.name] = x
        tails = [(1 + sign * level) / 2 for level in LEVELS for sign in (-1, 1)]
        median, low_68, high_68, low_95, high_95 = np.quantile(x, [0.5, *tails]).tolist()
        marginals[unknown.name] = Marginal(
            unknown.name,
            unknown.parameter.unit,
            float(x.mean()),
            float(x.std(ddof=1)),
            median,
            (low_68, high_68),
            (low_95, high_95),
            float(array_stats.rhat(x)),
            float(array_stats.ess(x, method="bulk")),
            float(array_stats.ess(x, method="tail", prob=(0.05, 0.95))),
        )
    kept = stats._asdict()
    kept.pop("z")
    return Posterior(
        fit=fit, parameters=marginals, draws=draws, seed=seed, prior=whitened.prior_record(),
        sentences=tuple(_warnings(marginals, stats)), **kept,
    )  # fmt: skip


def _warnings(marginals: Mapping[str, Marginal], stats: Transitions) -> list[str]:
    warnings = []
    chains = stats.log_density.shape[0]
    for name, p in marginals.items():
        if not p.r_hat <= _LARGEST_R_HAT:
            warnings.append(
                f"chains disagree about {named(name)} (R-hat {p.r_hat:.3f}); sample more draws, "
                "and look for more than one maximum"
            )
        elif min(p.ess_bulk, p.ess_tail) < _EFFECTIVE_DRAWS * chains:
            warnings.append(
                f"draws of {named(name)} say as much as {p.ess_bulk:.0f} independent ones (in "
                f"the tails {p.ess_tail:.0f}), which is too few; sample more"
            )
    failed, lost = int(stats.failed.sum()), int((stats.diverging & ~stats.failed).sum())
    if lost:
        warnings.append(
            f"{lost} of {stats.diverging.size} trajectories diverged: the posterior bends more "
            "sharply somewhere than the sampler can follow, and draws there are missing"
        )
    if failed > _FEW_FAILED * stats.failed.size:
        warnings.append(
            f"{failed} of {stats.failed.size} trajectories ended where the law has no motion that "
            "the program can compute (at some row of a table the fast method finds no periodic "
            "orbit, or in a recording sliding accelerates without bound); the posterior is cut off "
            "there"
        )
    return warnings


def _observed(fit: Fit) -> dict[str, Float]:
    """Columns of all data; with several recordings, names end in the name of the recording."""
    terms = fit.objective.terms
    return {
        f"{name}[{term.name}]" if term.profiled and len(terms) > 1 else name: column
        for term in terms
        for name, column in term.observed().items()
    }
