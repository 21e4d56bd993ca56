"""The stretch and the half of a recording that decide between two laws, and doubts about them."""

from __future__ import annotations

import numpy as np

from asperity.errors import Argument
from asperity.inference.comparison.scale import EXCLUDED
from asperity.inference.fitting.result import Fit, Float
from asperity.inference.runs.noise import innovations
from asperity.inference.runs.term import RunTerm

#: Parts of a recording, share of the difference of two laws that a stretch of them must hold, and
#: share of the recording up to which such a stretch is named.
_PARTS, _MOST, _SHORT = 200, 0.8, 0.1


def support(best: Fit, other: Fit) -> tuple[str, str]:
    """Doubts about what decides between two laws, and a stretch that decides, as sentences.

    Two of the doubts are about the window. The difference of AICc is a sum over the recording, in
    the proportion of the squared innovations: the verdict rests on a short stretch without which it
    would not exclude the other law; and it changes with the window where one half is for the other
    law by as much as excludes. With the better law true that has a probability below exp(-5), by
    Markov's inequality for the ratio of likelihoods.

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
        name, time = first.name, first.run.time
        edges, total = _gains(first, best, second, other)
        begin, end, _ = _shortest(edges, total, _MOST, time)
        span = f"{begin:.4g} to {end:.4g} s of {name}"
        whole, behind = float(time[-1] - time[0]), other.aicc - best.aicc
        a, b, share = _shortest(edges, total, 1 - EXCLUDED / max(behind, EXCLUDED), time)
        if behind >= EXCLUDED and b - a <= _SHORT * whole:
            doubts.append(
                f"it rests on {a:.4g} to {b:.4g} s of {name}, {(b - a) / whole:.1%} of the "
                f"recording: without that stretch the AICc of {other.law} is "
                f"{behind * (1 - share):.3g} above that of {best.law}, and {EXCLUDED:g} excludes "
                f"(compare without it: {Argument('window')})"
            )
        elif end - begin <= _SHORT * whole:
            stretches.append(
                f"Most of what tells {best.law} from {other.law} lies in {span}, "
                f"{(end - begin) / whole:.1%} of it"
            )
        middle = len(edges) // 2
        halves = {"first": behind * total[middle], "second": behind * (1 - total[middle])}
        doubts += [
            f"it changes with the window: the {half} half of {name} alone is for {other.law}, by "
            f"{-gain:.3g} in AICc"
            for half, gain in halves.items()
            if gain <= -EXCLUDED
        ]
        inside = [f"{t:.4g} s" for t in first.run.jumps or () if begin <= t <= end]
        if inside:
            doubts.append(f"the recording jumps at {', '.join(inside)}, in the deciding {span}")
        doubts += [f"even under {best.law} {doubt}" for doubt in first.doubts]
    doubt = f"This verdict is doubtful: {'; '.join(doubts)}. " if doubts else ""
    return doubt, "".join(f" {sentence}." for sentence in stretches)


def _gains(first: RunTerm, best: Fit, second: RunTerm, other: Fit) -> tuple[Float, Float]:
    """Edges of the parts of a recording, as samples, and the share of the gain up to each.

    The gain is that of `best` in the sum of squared innovations. Both laws are judged by the noise
    that the better one leaves.
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
    return edges, total / total[-1]


def _shortest(edges: Float, total: Float, share: float, time: Float) -> tuple[float, float, float]:
    """Ends (s) of the shortest stretch with so much of the gain, and how much it has.

    The whole recording where no stretch does.
    """
    within = total[None, :] - total[:, None] >= share
    within[0, -1] = True
    length = np.where(np.triu(within, 1), edges[None, :] - edges[:, None], edges[-1] + 1)
    i, j = np.unravel_index(np.argmin(length), length.shape)
    return float(time[edges[i]]), float(time[edges[j] - 1]), float(total[j] - total[i])
