"""Claims on slide-hold-slide tests: Figure 3 and the text on its models."""

from __future__ import annotations

import numpy as np

from asperity.ledger import check
from asperity_papers.marone1998.laboratory import (
    AGEING,
    LAWS,
    PRZ,
    SLIP,
    Float,
    Laboratory,
    Numbers,
    by_law,
    by_time,
    scans,
)

#: Hold times (s) of claims without a hold time; stiffnesses (1/m) of claims on stiffness.
TIMES = np.array([1.0, 10.0, 100.0, 1e3, 1e4])
STIFFNESSES = np.logspace(3, 6, 10)


def pairs(name: str) -> tuple[Float, Float]:
    """Hold times (s) and healing that were read off a curve of Figure 3."""
    table = np.array(scans()["figure_3"][name])
    return table[:, 0], table[:, 1]


def relative(new: Float, old: Float) -> float:
    """Largest relative difference."""
    return float(np.max(np.abs(new / old - 1)))


@check("maximum-at-load-velocity")
def maximum_at_load_velocity(laboratory: Laboratory) -> Numbers:
    def distance(name: str) -> Float:
        held, law = laboratory.holds(name, *laboratory.stiff, TIMES), laboratory.granite(name)
        rate_term = law.A * np.log(held.velocity_at_maximum / held.velocity)
        return np.max(np.abs(rate_term)) / law.A

    return by_law(distance)


@check("ageing-soft")
def ageing_soft(laboratory: Laboratory) -> Numbers:
    times = np.array([2.0, 10.0, 100.0, 1e3, 1e4, 1e5])
    return by_time(times, laboratory.healing(AGEING, *laboratory.soft, times))


@check("ageing-stiff", AGEING, "ageing")
@check("slip-curves", SLIP, "slip")
@check("prz-curves", PRZ, "perrin_rice_zheng")
def distance_from_curve(laboratory: Laboratory, name: str, reading: str) -> Numbers:
    times, read = pairs(reading)
    healing = laboratory.healing(name, *laboratory.stiff, times)
    return by_time(times, healing - read, "off at ") | by_time(times, healing)


@check("legend-velocity")
def legend_velocity(laboratory: Laboratory) -> Numbers:
    (time,), (read,) = pairs("ageing")
    k, V = laboratory.stiff
    legend, caption = (
        float(laboratory.healing(AGEING, k, v, time) - read)
        for v in (laboratory.numbers.V_stiff_legend, V)
    )
    return {"off": legend, "off, caption": caption}


@check("ageing-same-values")
def ageing_same_values(laboratory: Laboratory) -> Numbers:
    times = np.array([1e3, 1e4, 1e5])
    soft, stiff = (
        laboratory.healing(AGEING, *spring, times) for spring in (laboratory.soft, laboratory.stiff)
    )
    return by_time(times, stiff / soft - 1)


@check("ageing-same-rate")
def ageing_same_rate(laboratory: Laboratory) -> Numbers:
    soft, stiff = (
        float(laboratory.slope(AGEING, *spring, 1e3, 1e5))
        for spring in (laboratory.soft, laboratory.stiff)
    )
    return {"change": stiff / soft - 1, "soft": soft, "stiff": stiff}


@check("ageing-rate-independent-of-stiffness")
def ageing_rate_independent(laboratory: Laboratory) -> Numbers:
    slopes = laboratory.slope(AGEING, STIFFNESSES, laboratory.numbers.V_soft, 1e4, 1e5)
    return {"spread": float(np.ptp(slopes) / np.mean(slopes))}


def _over_stiffness(laboratory: Laboratory, name: str) -> Float:
    """Change of healing from one stiffness to the next, shape (stiffnesses - 1, times)."""
    V = laboratory.numbers.V_soft
    return np.diff(laboratory.healing(name, STIFFNESSES[:, None], V, TIMES), axis=0)


@check("ageing-rises-with-stiffness")
def ageing_rises(laboratory: Laboratory) -> Numbers:
    return {"smallest": float(_over_stiffness(laboratory, AGEING).min())}


@check("slip-falls-with-stiffness")
def slip_falls(laboratory: Laboratory) -> Numbers:
    change = _over_stiffness(laboratory, SLIP)
    extremes = {"largest": float(change.max()), "rising": float(np.mean(change > 0))}
    return extremes | by_time(TIMES, change.max(0), "largest at ")


@check("slip-rate-falls-with-stiffness")
def slip_rate_falls(laboratory: Laboratory) -> Numbers:
    p = laboratory.numbers
    k = np.array([p.k_soft, p.k_stiff])
    soft, stiff = laboratory.slope(SLIP, k, p.V_soft, 1e4, 1e5)
    return {"change": float(stiff - soft), "soft": float(soft), "stiff": float(stiff)}


@check("slip-difference-widens")
def slip_difference_widens(laboratory: Laboratory) -> Numbers:
    times = np.array([2.0, 10.0, 30.0, 100.0, 1e3, 1e4, 1e5])
    (soft, V), (stiff, slow) = laboratory.soft, laboratory.stiff
    reference = laboratory.healing(SLIP, soft, V, times)
    equal, actual = (reference - laboratory.healing(SLIP, stiff, v, times) for v in (V, slow))
    more = actual - equal
    return {"smallest": float(more.min())} | by_time(times, more)


@check("prz-less-sensitive")
def prz_less_sensitive(laboratory: Laboratory) -> Numbers:
    times = np.array([10.0, 100.0, 1e3, 1e4, 1e5])
    change = {
        name: np.abs(
            laboratory.healing(name, *laboratory.stiff, times)
            / laboratory.healing(name, *laboratory.soft, times)
            - 1
        )
        for name in (SLIP, PRZ)
    }
    less = change[SLIP] - change[PRZ]
    return {"smallest": float(less.min())} | by_time(times, less)


@check("prz-below-data")
def prz_below_data(laboratory: Laboratory) -> Numbers:
    below: Numbers = {}
    for name, spring in (("soft", laboratory.soft), ("stiff", laboratory.stiff)):
        times, read = (column[pairs(name)[0] >= 400] for column in pairs(name))
        model = laboratory.healing(PRZ, *spring, times)
        fits = [np.polyfit(np.log10(times), values, 1)[0] for values in (read, model)]
        below |= {
            f"values, {name}": float(np.min(read - model)),
            f"rate, {name}": float(fits[0] - fits[1]),
        }
    return below


def _misfit(laboratory: Laboratory, V: float) -> float:
    times, read = pairs("stiff")
    difference = laboratory.healing(AGEING, laboratory.numbers.k_stiff, V, times) - read
    return float(np.sqrt(np.mean(difference**2)))


@check("actual-velocities-improve")
def actual_velocities(laboratory: Laboratory) -> Numbers:
    equal, actual = (_misfit(laboratory, v) for v in (laboratory.soft[1], laboratory.stiff[1]))
    return {"improvement": equal - actual, "equal": equal, "actual": actual}


@check("data-same")
def data_same(laboratory: Laboratory) -> Numbers:
    times, soft = pairs("soft")
    stiff = dict(zip(*pairs("stiff"), strict=True))
    differences = np.array([stiff[t] for t in times]) - soft
    slopes = [np.polyfit(np.log10(times), y, 1)[0] for y in (soft, soft + differences)]
    return {
        "smallest": float(differences.min()),
        "largest": float(differences.max()),
        "mean": float(differences.mean()),
        "standard error": float(differences.std(ddof=1) / np.sqrt(len(differences))),
        "soft rate": float(slopes[0]),
        "stiff rate": float(slopes[1]),
    }


@check("healing-scales-as-b")
def healing_scales_as_b(laboratory: Laboratory) -> Numbers:
    ratios = {}
    for B in (0.009, 0.012, 0.018):
        slope = laboratory.slope(AGEING, *laboratory.soft, 1e6, 1e7, B=B)
        ratios[f"b = {B:g}"] = float(slope / (B * np.log(10)))
    return ratios


@check("long-hold-limit")
def long_hold_limit(laboratory: Laboratory) -> Numbers:
    """theta/t, and V over the velocity of the drive, after long holds with both springs."""
    numbers: Numbers = {}
    times = np.array([1e3, 1e4, 1e5])
    for label, (k, V) in (("soft", laboratory.soft), ("stiff", laboratory.stiff)):
        held = laboratory.holds(AGEING, k, V, times)
        age = np.exp(held.states[:, 1]) * laboratory.numbers.D0 / laboratory.numbers.V0
        growth = 1 - held.end_velocity * age / laboratory.numbers.D0
        numbers |= {
            f"V falls, {label}": float(np.min(-np.diff(np.log(held.end_velocity)))),
            f"rate rises, {label}": float(np.min(np.diff(growth))),
            f"rate at 1e5 s, {label}": float(growth[-1]),
            f"theta/t at 1e5 s, {label}": float(age[-1] / times[-1]),
            f"V/Vl at 1e5 s, {label}": float(held.end_velocity[-1] / V),
        }
    return numbers


@check("rises-with-velocity")
def rises_with_velocity(laboratory: Laboratory) -> Numbers:
    p = laboratory.numbers
    V = p.V_soft * np.array([[1.0], [10.0]])
    return by_law(
        lambda name: np.min(np.diff(laboratory.healing(name, p.k_stiff, V, TIMES), axis=0))
    )


@check("product-of-velocity-and-time")
def product(laboratory: Laboratory) -> Numbers:
    p = laboratory.numbers
    V, time = p.V_soft * np.array([1.0, 10.0]), np.array([1e3, 1e2])

    def change(name: str) -> Float:
        slow, fast = laboratory.healing(name, p.k_stiff, V, time)
        return fast / slow - 1

    return by_law(change)


@check("faster-falls-faster")
def faster_falls_faster(laboratory: Laboratory) -> Numbers:
    p = laboratory.numbers
    lower: Numbers = {}
    V = p.V_soft * np.array([[1.0], [10.0]])
    times = np.array([1.0, 10.0, 100.0, 1e3])
    for name, letter in LAWS.items():
        slow, fast = laboratory.holds(name, p.k_stiff, V, times).end_velocity
        lower |= by_time(times, fast / slow, f"{letter}, ")
    return lower


@check("lower-velocity-higher-state")
def higher_state(laboratory: Laboratory) -> Numbers:
    p = laboratory.numbers
    more: Numbers = {}
    V = p.V_soft * np.array([[1.0], [10.0]])
    times = np.array([10.0, 100.0, 1e3, 1e4])
    for name, letter in LAWS.items():
        slow, fast = laboratory.holds(name, p.k_stiff, V, times).states[..., 1]
        more |= by_time(times, fast - slow, f"{letter}, ")
    return more


@check("not-the-direct-effect")
def not_the_direct_effect(laboratory: Laboratory) -> Numbers:
    p = laboratory.numbers

    def change(name: str) -> Float:
        base, more = (
            laboratory.healing(name, *laboratory.stiff, 1e3, A=A) for A in (p.A, 1.5 * p.A)
        )
        return abs(more / base - 1)

    return by_law(change)


@check("stress-falls-by-slip")
def stress_falls_by_slip(laboratory: Laboratory) -> Numbers:
    k, V = laboratory.stiff

    def difference(name: str) -> float:
        held = laboratory.holds(name, k, V, TIMES)
        return relative(held.relaxation, k * held.hold_slip)

    return by_law(difference)
