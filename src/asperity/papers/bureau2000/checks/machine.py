"""Claims of section II.A: the machine, and the steadiness of sliding."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from asperity.orbit import PeriodicResponse
from asperity.papers.bureau2000.checks.model import (
    APPLIED,
    EXT,
    STRONGEST,
    Model,
    Pair,
    at,
    both,
    with_value,
)
from asperity.papers.ledger.checks import CheckResult, check
from asperity.theory import closed_forms as cf


@check("spring-most-compliant")
def _most_compliant(model: Model) -> CheckResult:
    p = model.numbers
    lightest, _ = p["W0_range"].si_range or (np.nan, np.nan)
    ratio = lightest / p.lambda_ / p.K
    return CheckResult(
        {"3 N": ratio},
        f"asperities {ratio:.0f} times stiffer at 3 N, {p.W0 / p.lambda_ / p.K:.0f} at 7 N",
    )


@check("dead-weight")
def _dead_weight(model: Model) -> CheckResult:
    p, standard_gravity = model.numbers, 9.80665
    weight = p.M * standard_gravity
    return CheckResult({"weight": weight}, f"{weight:.1f} N")


@check("away-from-resonance")
def _away_from_resonance(model: Model) -> CheckResult:
    p = model.numbers
    natural = {
        "spring": np.sqrt(p.K / p.M),
        "asperities, tangential": np.sqrt(p.W0 / (p.lambda_ * p.M)),
        "asperities, normal": np.sqrt(p.W0 / (p.lambda_z * p.M)),
    }
    hertz = {name: float(w / (2 * np.pi)) for name, w in natural.items()}
    distance = {
        f"{f:g} Hz": min(abs(f / own - 1) for own in hertz.values())
        for f in (p.frequency, p.frequency_vacuum)
    }
    listed = ", ".join(f"{name} {f:.0f} Hz" for name, f in hertz.items())
    return CheckResult(distance, listed)


@check("no-stick-slip-under-modulation")
def _no_stick_slip(model: Model) -> CheckResult:
    Kc = float(cf.critical_stiffness(model.small_modulation(model.velocities[0])))
    critical = Model(with_value(model.numbers, "K", Kc))
    r = critical.curve(EXT)
    worst = {
        name: max(at(r.floquet_max, eps)[k] for eps in APPLIED if eps <= STRONGEST)
        for k, name in enumerate(("1 um/s", "10 um/s"))
    }
    return CheckResult(
        worst,
        f"at K = Kc a leading multiplier of at most {max(worst.values()):.4f}; at the central K "
        f"stable from eps = {both(stabilising_amplitude(model.curve(EXT)), 2)} on",
    )


def stabilising_amplitude(r: PeriodicResponse) -> Pair:
    """Applied amplitude at which the leading multiplier of a curve enters the unit circle."""
    logs = np.log(r.floquet_max)

    def crossing(row: NDArray[np.float64]) -> float:
        # Falls with eps; np.interp wants its abscissae to rise.
        return float(np.interp(0.0, row[::-1], APPLIED[::-1]))

    return crossing(logs[0]), crossing(logs[1])
