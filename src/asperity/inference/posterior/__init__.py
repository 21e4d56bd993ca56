"""Posteriors of fits: the No-U-Turn sampler, diagnostics, and draws that ArviZ opens."""

from asperity.inference.posterior.posterior import Marginal, Posterior
from asperity.inference.posterior.sampling import require_bayes, sample_posterior

__all__ = ["Marginal", "Posterior", "require_bayes", "sample_posterior"]
