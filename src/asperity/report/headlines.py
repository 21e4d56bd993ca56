"""What the paper concludes, and whether the numbers behind the figures bear it out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from asperity.study.paper import FigureNumbers

#: "Of the order of": within half a decade to either side.
_HALF_DECADE = 10**0.5


@dataclass(frozen=True)
class Headline:
    """A conclusion of the paper.

    Attributes
    ----------
    claim : str
    found : str
        The numbers that decide.
    holds : bool
    """

    claim: str
    found: str
    holds: bool


def headlines(figures: Mapping[str, FigureNumbers]) -> list[Headline]:
    """The paper's main conclusions in its own order, then two that are about its assumptions."""
    read = {name: figure.scalars for name, figure in figures.items()}
    return [
        _drop(read["figure-02"]),
        _rice_ruina(read["figure-07"], read["figure-08"]),
        _linker_dieterich(read["figure-09"]),
        _elasto_plastic(read["figure-11"]),
        _air(read["figure-02"], read["figure-05"]),
        _steady(read["figure-12"]),
    ]


def _drop(read: Mapping[str, float]) -> Headline:
    slow, fast = read["relative_drop_slow"], read["relative_drop_fast"]
    return Headline(
        "A modulation of the load lowers the mean friction: by 20 % at ε = 0.5, whatever the "
        "velocity.",
        f"{100 * slow:.1f} % at 1 µm/s and {100 * fast:.1f} % at 10 µm/s, with the fitted "
        "ε_eff = ε/2.1.",
        abs(slow - 0.2) < 0.025 and abs(fast - 0.2) < 0.025,
    )


def _rice_ruina(mean: Mapping[str, float], harmonics: Mapping[str, float]) -> Headline:
    growth = harmonics["growth_mu1"]
    reached = harmonics["share_of_limit"]
    return Headline(
        "The Rice–Ruina law gets the mean right and the harmonics wrong: they grow in proportion "
        "to V, and saturate.",
        f"Mean {mean['drop_at_scaled']:.4f} against −0.1 stated; μ₁ {growth:.2f}-fold for "
        f"10-fold V, at {100 * reached:.0f} % of its limit.",
        abs(mean["drop_at_scaled"] + 0.1) < 0.01 and growth > 9 and reached > 0.9,
    )


def _linker_dieterich(read: Mapping[str, float]) -> Headline:
    share, near = read["share_of_drop"], read["low_alpha_mu1"]
    return Headline(
        "Linker–Dieterich ageing does not help: α = 0.2 gives far too small a drop, α = 0.02 is "
        "hardly told from Rice–Ruina.",
        f"{100 * share:.0f} % of the stated drop; μ₁ {100 * abs(near):.1f} % from Rice–Ruina’s.",
        share < 0.6 and abs(near) < 0.05,
    )


def _elasto_plastic(read: Mapping[str, float]) -> Headline:
    growth, second = read["growth_mu1"], read["growth_mu2"]
    late = min(read["late_over_early_slow"], read["late_over_early_fast"])
    return Headline(
        "Elastic asperities in series with the joint make the harmonics nearly independent of V, "
        "without saturation below ε_eff = 0.3.",
        f"μ₁ by the factor {growth:.2f} and μ₂ by {second:.2f} for 10-fold V; the slope of μ₁ at "
        f"0.3 is still {100 * late:.0f} % of its average.",
        growth < 1.2 and second < 2 and late > 0.5,
    )


def _air(fitted: Mapping[str, float], read: Mapping[str, float]) -> Headline:
    share, ratio = fitted["transmission_air"], read["air_over_vacuum"]
    return Headline(
        "The air between the surfaces bears the rest: a model of the layer gives the order of "
        "magnitude of the contacts' share, ε_eff/ε = 0.48 at 120 Hz and 0.4 (air over vacuum) at "
        "200 Hz.",
        f"From its own inputs the model gives {share:.2f} and {ratio:.2f}: half of it, at both "
        "frequencies, as the paper says.",
        all(1 / _HALF_DECADE < x < _HALF_DECADE for x in (share / 0.48, ratio / 0.4)),
    )


def _steady(read: Mapping[str, float]) -> Headline:
    ratio, threshold = read["K_over_Kc"], read["threshold RR, 1 um/s"]
    return Headline(
        "The spring is stiff enough for steady sliding without modulation, K/K_c ≳ 1.",
        f"The paper's central values give K/K_c = {ratio:.2f}: unstable. Within their "
        "uncertainties it can be either. Modulation stabilises the Rice–Ruina slider above "
        f"ε_eff = {threshold:.3f} (1 µm/s).",
        ratio >= 1,
    )
