"""Options of ``asperity fit`` for the posterior, and the posterior as a person reads it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from asperity.errors import InputError

if TYPE_CHECKING:
    from asperity.inference import Fit
    from asperity.inference.posterior import Posterior


@dataclass(frozen=True)
class PosteriorOptions:
    """What to sample, and where the draws go.

    Attributes
    ----------
    wanted : bool
    chains, draws, seed : int
    out : Path or None
        NetCDF of the draws.
    """

    wanted: bool
    chains: int
    draws: int
    seed: int
    out: Path | None

    def check(self) -> None:
        """Refuse what cannot be done before anything is computed."""
        from asperity.outputs import output_file

        if not self.wanted:
            if self.out is not None:
                raise InputError("--out must come with --posterior, got it alone; add --posterior")
            return
        from asperity.inference.posterior import require_bayes
        from asperity.inference.posterior.sampling import require_sizes

        require_sizes(self.chains, self.draws)
        require_bayes()
        if self.out is not None:
            if self.out.suffix.lower() != ".nc":
                raise InputError(
                    f"--out must be a NetCDF file, got '{self.out}'; write it like --out "
                    "posterior.nc"
                )
            output_file(self.out, "--out", example="posterior.nc")

    def sample(self, fit: Fit) -> Posterior | None:
        """Sample, with a progress bar, and write the draws."""
        if not self.wanted or not fit.converged:
            return None
        from asperity.cli.progress import bar
        from asperity.inference.posterior import sample_posterior
        from asperity.outputs import written_file

        with bar("draw") as update:
            posterior = sample_posterior(
                fit,
                chains=self.chains,
                draws=self.draws,
                seed=self.seed,
                progress=lambda done, total: update(done, total, ""),
            )
        if self.out is not None:
            with written_file(self.out, "--out") as path:
                posterior.to_netcdf(path)
        return posterior


def posterior_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Options about the posterior, gathered into `sampling`."""

    @wraps(command)
    def gathered(
        *,
        posterior: bool,
        chains: int,
        draws: int,
        seed: int,
        out: Path | None,
        **others: Any,
    ) -> Any:
        sampling = PosteriorOptions(posterior, chains, draws, seed, out)
        return command(sampling=sampling, **others)

    result: Callable[..., Any] = gathered
    for option in (
        click.option("--posterior", is_flag=True, help="Sample the posterior (extra 'bayes')."),
        click.option("--chains", default=4, show_default=True, metavar="N", help="Chains."),
        click.option(
            "--draws", default=1000, show_default=True, metavar="N", help="Draws of each chain."
        ),
        click.option("--seed", default=0, show_default=True, metavar="N", help="Of the draws."),
        click.option("--out", type=Path, metavar="NC", help="Where the draws go, for ArviZ."),
    ):
        result = option(result)
    return result


def posterior_text(posterior: Posterior) -> str:
    """A posterior as a person reads it."""
    from asperity.cli.report import aligned

    chains, draws = posterior.log_density.shape
    rows = [("", "mean", "sd", "95 % interval", "", "R-hat", "ESS bulk", "ESS tail")]
    rows += [
        (
            name,
            f"{p.mean:.6g}",
            f"{p.sd:.2g}",
            f"{p.interval_95[0]:.5g} to {p.interval_95[1]:.5g}",
            p.unit,
            f"{p.r_hat:.4f}",
            f"{p.ess_bulk:.0f}",
            f"{p.ess_tail:.0f}",
        )
        for name, p in posterior.parameters.items()
    ]
    lines = [
        f"posterior, {chains} chains of {draws} draws, {int(posterior.diverging.sum())} diverging",
        aligned(rows, "  "),
    ]
    return "\n".join([*lines, *(f"warning: {w}" for w in posterior.warnings)])
