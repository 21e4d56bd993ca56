"""Claims of sections II.B.1 and II.B.2: the mean force and its harmonics as measured.

A measurement cannot be computed. What the paper's own final model (elasto-plastic, quasi-static)
gives for it is compared with what the text states.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from asperity.papers.bureau2000.checks.model import (
    APPLIED,
    EXT,
    LD,
    READ,
    RR,
    STRONGEST,
    Model,
    Pair,
    at,
    both,
    percent,
    relative,
)
from asperity.papers.ledger.checks import CheckResult, check


@check("systematic-lowering")
def _systematic_lowering(model: Model) -> CheckResult:
    curves = [model.curve(RR), model.curve(LD), model.curve(EXT)]
    highest = max(float(np.max(r.delta_mu)) for r in curves)
    rises = max(float(np.diff(r.delta_mu, axis=1).max()) for r in curves)
    return CheckResult(
        {"largest delta mu": highest, "largest step": rises},
        "delta mu < 0 and falling at every amplitude from 0.005 to 0.625",
    )


@check("onset")
def _onset(model: Model) -> CheckResult:
    r, onset = model.curve(EXT), model.numbers.epsilon_onset
    drop = at(-r.delta_mu, onset)
    share = drop[0] / at(r.mu_ss)[0], drop[1] / at(r.mu_ss)[1]
    return CheckResult(
        {"1 um/s": share[0], "10 um/s": share[1]},
        f"drop of {drop[0]:.4f} there, {percent(share[0])} of mu",
    )


def _line(model: Model) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Straight lines through the drop from eps = 0.05 to 0.5: slopes, intercepts, residuals."""
    span = slice(APPLIED.index(model.numbers.epsilon_onset), APPLIED.index(STRONGEST) + 1)
    eps, drop = np.array(APPLIED[span]), -model.curve(EXT).delta_mu[:, span]
    slope, intercept = np.polyfit(eps, drop.T, 1)
    return slope, intercept, drop - (slope[:, None] * eps + intercept[:, None])


@check("drop-quasi-linear")
def _quasi_linear(model: Model) -> CheckResult:
    slope, intercept, residual = _line(model)
    worst = np.abs(residual).max(1) / (slope * STRONGEST + intercept)
    return CheckResult(
        {"1 um/s": worst[0], "10 um/s": worst[1]},
        f"within {percent(worst.max())} of a line of slope {slope[0]:.3f} (1 um/s)",
    )


@check("drop-not-through-zero")
def _not_through_zero(model: Model) -> CheckResult:
    slope, intercept, residual = _line(model)
    excess = -intercept / np.abs(residual).max(1)
    return CheckResult(
        {"1 um/s": excess[0], "10 um/s": excess[1]},
        f"the line reaches zero at eps = {both(tuple(-intercept / slope), 2)}",
    )


@check("drop-velocity-independent")
def _drop_velocity_independent(model: Model) -> CheckResult:
    r, mu = model.curve(EXT), model.curve(EXT).mu_ss
    amplitudes = [e for e in model.numbers["epsilon_figure3"].si_values or () if e > 0]
    changes = {f"eps = {e:g}": relative(at(r.delta_mu, e)) for e in amplitudes}
    # The slope of the mean with V is that of steady sliding and what the drop adds to it.
    slopes = [relative_slope(at(mu), at(r.delta_mu, e)) for e in amplitudes]
    return CheckResult(
        changes,
        "drop: "
        + "; ".join(f"{name} {change:+.1%}" for name, change in changes.items())
        + " from 1 to 10 um/s; slope of the mean: "
        + ", ".join(f"{slope:+.0%}" for slope in slopes),
    )


def relative_slope(mu_ss: Pair, delta_mu: Pair) -> float:
    """Relative change of d mu/d ln V by the modulation, between the two velocities."""
    return (delta_mu[1] - delta_mu[0]) / (mu_ss[1] - mu_ss[0])


@check("mu2-over-mu1")
def _weakly_anharmonic(model: Model) -> CheckResult:
    r = model.curve(EXT)
    ratios = {f"eps = {e:g}": at(r.mu2 / r.mu1, e) for e in READ}
    slow, fast = ([ratios[name][k] for name in ratios] for k in (0, 1))
    return CheckResult(
        _by_velocity(ratios),
        f"from {slow[0]:.3f} at eps = {READ[0]:g} to {slow[-1]:.3f} at {READ[-1]:g} at 1 um/s, "
        f"from {fast[0]:.3f} to {fast[-1]:.3f} at 10 um/s; {max(fast):.2f} at most",
    )


def _by_velocity(pairs: Mapping[str, Pair]) -> dict[str, float]:
    """Pairs of numbers at the two velocities, each with a name of its own."""
    names = ("1 um/s", "10 um/s")
    return {f"{key}, {names[k]}": pair[k] for k in (0, 1) for key, pair in pairs.items()}


@check("mu1-monotonic", "mu1")
@check("mu2-monotonic", "mu2")
def _monotonic(model: Model, name: str) -> CheckResult:
    r = model.curve(EXT)
    steps = np.diff({"mu1": r.mu1, "mu2": r.mu2}[name], axis=1).min(1)
    return CheckResult(
        {"1 um/s": steps[0], "10 um/s": steps[1]},
        f"rises between all {len(APPLIED)} amplitudes from 0.005 to 0.625",
    )


@check("mu1-velocity-independent")
def _mu1_velocity_independent(model: Model) -> CheckResult:
    r = model.curve(EXT)
    changes = {f"eps = {e:g}": relative(at(r.mu1, e)) for e in READ}
    return CheckResult(
        changes,
        "from 1 to 10 um/s: " + "; ".join(f"{k} {v:+.0%}" for k, v in changes.items()),
    )


@check("mu1-order")
def _mu1_order(model: Model) -> CheckResult:
    mu1 = model.outputs(EXT).mu1
    return CheckResult({"1 um/s": mu1[0], "10 um/s": mu1[1]}, both(mu1))


@check("drop-over-mu1")
def _two_orders(model: Model) -> CheckResult:
    ratio = model.outputs(EXT).drop_over_mu1
    return CheckResult(
        {"1 um/s": ratio[0], "10 um/s": ratio[1]}, f"drop over mu1 = {both(ratio, 2)}"
    )


@check("mu2-lower-when-slow")
def _mu2_lower_when_slow(model: Model) -> CheckResult:
    r = model.curve(EXT)
    rises = {f"eps = {e:g}": relative(at(r.mu2, e)) for e in READ}
    return CheckResult(
        rises, "from 1 to 10 um/s: " + "; ".join(f"{k} {v:+.0%}" for k, v in rises.items())
    )
