"""The stretch of a recording that decides between two laws, and doubts about it."""

from __future__ import annotations

import numpy as np

from asperity.inference.fitting.result import Fit
from asperity.inference.runs.noise import innovations
from asperity.inference.runs.term import RunTerm

#: Parts of a recording, share of the difference of two laws that a stretch of them must hold, and
#: share of the recording up to which such a stretch is named.
_PARTS, _MOST, _SHORT = 200, 0.8, 0.1
#: Probability below which the noise is not the process that was fitted.
_NOT_WHITE = 1e-3


def support(best: Fit, other: Fit) -> tuple[str, str]:
    """Doubts about the stretches that decide between two laws, and where these lie, as sentences.

    Parameters
    ----------
    best, other : Fit
        Converged, to the same data.

    Returns
    -------
    doubts, stretches : str
        Empty where there is nothing to say.
    """
    doubts, stretches = [], []
    pairs = zip(best.objective.terms_of(RunTerm), other.objective.terms_of(RunTerm), strict=True)
    for first, second in pairs:
        begin, end = _deciding(first, best, second, other)
        span = f"{begin:.4g} to {end:.4g} s of {first.name}"
        inside = [f"{t:.4g} s" for t in first.run.jumps or () if begin <= t <= end]
        if inside:
            doubts.append(f"the recording jumps at {', '.join(inside)}, in the deciding {span}")
        if first.law_fails_after_changes:
            doubts.append(f"even {best.law} misses what follows the velocity changes")
        if first.noise["whiteness_p"] < _NOT_WHITE:
            doubts.append(f"the noise of {first.name} is not the process that was fitted")
        whole = first.run.time[-1] - first.run.time[0]
        if end - begin <= _SHORT * whole:
            stretches.append(
                f"What tells {best.law} from {other.law} lies in {span}, "
                f"{(end - begin) / whole:.1%} of it: compare without it too (--window)"
            )
    doubt = f"In doubt, since {' and '.join(doubts)}. " if doubts else ""
    return doubt, "".join(f" {sentence}." for sentence in stretches)


def _deciding(first: RunTerm, best: Fit, second: RunTerm, other: Fit) -> tuple[float, float]:
    """Times (s) of the shortest stretch with most of the difference of two log-likelihoods.

    Both laws are judged by the noise that the better one leaves.
    """
    run = first.run
    noise = [model.whitening for model in first.models]
    squares = [
        innovations(run.friction - term.fitted_friction(fit.values), noise, run.stretches) ** 2
        for term, fit in ((first, best), (second, other))
    ]
    edges = np.linspace(0, run.time.size, min(_PARTS, run.time.size) + 1).astype(int)
    gains = np.add.reduceat(squares[1] - squares[0], edges[:-1])
    total = np.concatenate([[0.0], np.cumsum(gains)])
    within = total[None, :] - total[:, None] >= _MOST * total[-1]
    length = np.where(np.triu(within, 1), edges[None, :] - edges[:, None], run.time.size + 1)
    i, j = np.unravel_index(np.argmin(length), length.shape)
    return float(run.time[edges[i]]), float(run.time[edges[j] - 1])
