"""Numbers of the figures on the harmonics: 4, 8, 9 and 11."""

from __future__ import annotations

import numpy as np

from asperity.papers.bureau2000.numbers.bands import band_curves, band_ends
from asperity.papers.bureau2000.numbers.curves import FigureCurve, solve_curves
from asperity.papers.bureau2000.numbers.figure_numbers import FigureNumbers, stated
from asperity.papers.bureau2000.numbers.machine import (
    EXT,
    LD,
    RR,
    Float,
    applied_amplitudes,
    borne_amplitudes,
    fitted_share,
    paper,
    slider,
    velocities,
    velocity_text,
)
from asperity.papers.bureau2000.numbers.mean import inertial_name


def pulse_limit(velocity: float) -> float:
    """Largest mu1 that slip can produce without elastic asperities, 2 V K/(omega W0).

    The spring gains V K/omega per radian; slip in one short pulse a period makes the force a
    sawtooth, whose harmonics n are 2 V K/(n omega W0).
    """
    p = paper()
    return 2 * velocity * p.K / (2 * np.pi * p.frequency * p.W0)


def elastic_slope(velocity: float) -> float:
    """D mu1/d eps of the velocity-independent plateau, mu l/(1 + l) with l = lambda K/W0."""
    chosen = slider(EXT)
    ratio = float(np.asarray(chosen.law.elastic_length) * chosen.K / chosen.W0)
    return float(chosen.law.mu_ss(velocity)) * ratio / (1 + ratio)


def curves_4() -> list[FigureCurve]:
    """Both velocities, with the mass and at the ends of the uncertainties."""
    return _elastic(applied_amplitudes(), fitted_share())


def _elastic(eps: Float, share: float = 1.0) -> list[FigureCurve]:
    named = {velocity_text(V): V for V in velocities()}
    slow = next(iter(named))
    return [
        *(FigureCurve(name, EXT, V, eps, share) for name, V in named.items()),
        *(
            FigureCurve(inertial_name(name), EXT, V, eps, share, inertia=True)
            for name, V in named.items()
        ),
        *band_curves(slow, named[slow], eps, share),
    ]


def figure_4() -> FigureNumbers:
    """Harmonics against eps at 120 Hz."""
    seen, share = stated(), fitted_share()
    names = [velocity_text(V) for V in velocities()]
    data = solve_curves(curves_4())
    found = FigureNumbers("figure-04", "Figure 4", "A weakly anharmonic force response", data)
    mu1 = [found.last(name, "mu1") for name in names]
    mu2 = [found.last(name, "mu2") for name in names]
    inertial = [found.last(inertial_name(name), "mu2") for name in names]
    ratio = [second / first for first, second in zip(mu1, mu2, strict=True)]
    ends = band_ends(found, names[0], "mu1", seen.epsilon_eff)
    return found.described(
        scalars={
            "mu1_slow": mu1[0],
            "mu1_fast": mu1[1],
            "mu2_slow": mu2[0],
            "mu2_fast": mu2[1],
            "mu2_inertia_slow": inertial[0],
            "mu2_inertia_fast": inertial[1],
            "ratio_slow": ratio[0],
            "ratio_fast": ratio[1],
            **{f"mu1 {end}": value for end, value in ends.items()},
        },
        caption=(
            f"Elasto-plastic law, ε_eff = {share:g} ε. At ε = {seen.epsilon:g}, μ₁ = "
            f"{1e3 * mu1[0]:.2f} × 10⁻³ at 1 µm/s and {1e3 * mu1[1]:.2f} × 10⁻³ at 10 µm/s, where "
            "the text states the order 10⁻³ and no dependence on V. μ₂/μ₁ is "
            f"{ratio[0]:.2f} and {ratio[1]:.2f}; the text states 0.1 to 0.2, with μ₂ lower at the "
            "smaller V. At small ε the two velocities do differ in the model: there sliding, not "
            "the asperities' elasticity, makes the force oscillate. Band: A, B and λ within their "
            "published uncertainties, at 1 µm/s. Dark: with the mass of the slider, μ₂ at "
            f"ε = {seen.epsilon:g} is {inertial[0] / mu2[0]:.2f} times as large at 1 µm/s and "
            f"{inertial[1] / mu2[1]:.2f} times at 10 µm/s."
        ),
        alt=(
            "Three panels against modulation amplitude for 1 and 10 µm/s: the first harmonic, the "
            "second harmonic, and their ratio. The first harmonics meet at large amplitude, the "
            "second is larger at the larger velocity, the ratio lies in the stated band from 0.1 "
            "to 0.2 at large amplitude. With inertia the second harmonic is larger."
        ),
    )


def curves_8() -> list[FigureCurve]:
    """Both velocities."""
    return [FigureCurve(velocity_text(V), RR, V, borne_amplitudes()) for V in velocities()]


def figure_8() -> FigureNumbers:
    """Rice-Ruina: harmonics against eps_eff."""
    slow, fast = velocities()
    data = solve_curves(curves_8())
    found = FigureNumbers("figure-08", "Figure 8", "Rice–Ruina: the harmonics come out wrong", data)
    growth = [
        found.last(velocity_text(fast), n) / found.last(velocity_text(slow), n)
        for n in ("mu1", "mu2")
    ]
    filled = found.last(velocity_text(fast), "mu1") / pulse_limit(fast)
    return found.described(
        scalars={
            "growth_mu1": growth[0],
            "growth_mu2": growth[1],
            "share_of_limit": filled,
            "limit_slow": pulse_limit(slow),
            "limit_fast": pulse_limit(fast),
        },
        caption=(
            "Rice–Ruina law. For ten times the velocity μ₁ grows "
            f"{growth[0]:.1f}-fold and μ₂ {growth[1]:.1f}-fold at ε_eff = 0.3: the quasi-linear "
            "dependence on V that the experiment does not show; on the logarithmic axes the "
            "two curves are parallel. Ochre: what the text states of the experiment, μ₁ of order "
            "10⁻³ (half a decade to either side) and μ₂ 0.1 to 0.2 of it, at ε = 0.5 and at both "
            "velocities. Both harmonics saturate, because slip ends as one short pulse a period, "
            "beyond which the force cannot go: grey lines, μ₁ = 2VK/(ωW₀), of which "
            f"{100 * filled:.0f} % are reached, and μ₂ = VK/(ωW₀)."
        ),
        alt=(
            "First and second harmonic of the Rice-Ruina law against effective amplitude, on "
            "logarithmic axes: at both velocities they rise and saturate, at 1 µm/s ten times "
            "lower than at 10 µm/s and below what the text states."
        ),
    )


def curves_9() -> list[FigureCurve]:
    """Two coefficients at both velocities, and Rice-Ruina."""
    p, eps = paper(), borne_amplitudes()
    return [
        *(
            FigureCurve(_alpha_name(a, V), LD, V, eps, overrides={"alpha": a})
            for a in (p.alpha, p.alpha_low)
            for V in velocities()
        ),
        *(FigureCurve(f"RR, {velocity_text(V)}", RR, V, eps) for V in velocities()),
    ]


def figure_9() -> FigureNumbers:
    """Linker-Dieterich with two coefficients, and Rice-Ruina to hold it against."""
    p, (slow, fast) = paper(), velocities()
    data = solve_curves(curves_9())
    found = FigureNumbers(
        "figure-09", "Figure 9", "Linker–Dieterich ageing: too small a drop, or no difference", data
    )
    at = float(stated().epsilon_eff)
    share = found.at(_alpha_name(p.alpha, slow), "delta_mu", at) / stated().drops[0]
    near = {
        n: found.at(_alpha_name(p.alpha_low, fast), n, at)
        / found.at(f"RR, {velocity_text(fast)}", n, at)
        - 1
        for n in ("delta_mu", "mu1", "mu2")
    }
    caption_mean = found.at(_alpha_name(p.alpha_low, slow), "delta_mu", at) / found.at(
        _alpha_name(p.alpha, slow), "delta_mu", at
    )
    return found.described(
        scalars={"share_of_drop": share, "low_over_high": caption_mean}
        | {f"low_alpha_{n}": value for n, value in near.items()},
        caption=(
            f"Linker–Dieterich law. α = 0.2 gives {100 * share:.0f} % of the stated drop of the "
            f"mean. With α = 0.02 drop, μ₁ and μ₂ differ by {100 * abs(near['delta_mu']):.1f}, "
            f"{100 * abs(near['mu1']):.1f} and {100 * abs(near['mu2']):.1f} % from Rice–Ruina "
            "(thin), and share its faults: the first harmonic at 1 µm/s stays far below the "
            "stated order (ochre, as in Figure 8). The paper's caption calls 1 µm/s, α = 0.02 "
            "(grey) undistinguishable from the dotted line of α = 0.2; for μ₁ and μ₂ it is, but "
            f"the mean of the one falls {caption_mean:.1f} times as much as that of the other."
        ),
        alt=(
            "Change of the mean, first and second harmonic of the Linker-Dieterich law against "
            "effective amplitude. With alpha 0.2 the mean falls half as much as with alpha 0.02; "
            "the harmonics grow tenfold with velocity and saturate, whatever alpha."
        ),
    )


def curves_11() -> list[FigureCurve]:
    """Both velocities, with the mass and at the ends of the uncertainties."""
    return _elastic(borne_amplitudes())


def figure_11() -> FigureNumbers:
    """The elasto-plastic law, what the uncertainties make of it, and inertia."""
    slow = velocities()[0]
    names = [velocity_text(V) for V in velocities()]
    data = solve_curves(curves_11())
    found = FigureNumbers(
        "figure-11",
        "Figure 11",
        "Elastic asperities: hardly any dependence on V, no saturation",
        data,
    )
    at = stated().epsilon_eff
    change = [found.at(names[1], n, at) / found.at(names[0], n, at) for n in ("mu1", "mu2")]
    bend = [late_over_early_slope(found, name, "mu1") for name in names]
    plateau = found.at(names[0], "mu1", at) / (at * elastic_slope(slow))
    ends = band_ends(found, names[0], "mu1", at)
    inertial = [
        found.at(inertial_name(name), "mu2", at) / found.at(name, "mu2", at) for name in names
    ]
    return found.described(
        scalars={
            "growth_mu1": change[0],
            "growth_mu2": change[1],
            "late_over_early_slow": bend[0],
            "late_over_early_fast": bend[1],
            "over_plateau": plateau,
            "elastic_slope": elastic_slope(slow),
            "inertia_mu2_slow": inertial[0],
            "inertia_mu2_fast": inertial[1],
            **{f"mu1 {end}": value for end, value in ends.items()},
        },
        caption=(
            f"Elasto-plastic law, λ = 0.7 µm. For ten times the velocity, at ε_eff = {at:g}, μ₁ "
            f"changes by the factor {change[0]:.2f} and μ₂ by {change[1]:.2f}, where Rice–Ruina "
            "has ten; and nothing saturates below ε_eff = 0.3. Bands at 1 µm/s: the wide one is "
            "λ = 0.62 ± 0.15 µm, as measured quasi-statically, the narrow one A and B within "
            "their published uncertainties (A at constant B − A). Grey: ε_eff μ̄ l/(1 + l), "
            "l = λK/W₀, the elastic response of the asperities alone, which does not depend on V "
            "but through μ̄. Green without inertia, as the paper's Eq. (29); dark with the mass of "
            f"the slider, which makes μ₂ {inertial[0]:.2f} times as large at 1 µm/s and "
            f"{inertial[1]:.2f} times at 10 µm/s, at ε_eff = {at:g}."
        ),
        alt=(
            "Change of the mean, first and second harmonic of the elasto-plastic law against "
            "effective amplitude. The mean is as in Rice-Ruina; the harmonics of the two "
            "velocities are close to each other and keep rising up to 0.3. With inertia the mean "
            "falls further and the second harmonic is larger."
        ),
    )


def late_over_early_slope(found: FigureNumbers, curve: str, column: str) -> float:
    """Slope of a curve in its last tenth over its mean slope; small where it saturates."""
    rows = found.curve(curve)
    x, y = rows["epsilon_eff"].to_numpy(), rows[column].to_numpy()
    tenth = len(x) // 10
    return float((y[-1] - y[-1 - tenth]) / (x[-1] - x[-1 - tenth]) / (y[-1] / x[-1]))


def _alpha_name(alpha: float, velocity: float) -> str:
    return f"alpha = {alpha:g}, {velocity_text(velocity)}"
