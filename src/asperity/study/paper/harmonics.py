"""Numbers of the figures on the harmonics: 4, 8, 9 and 11."""

from __future__ import annotations

import numpy as np

from asperity.study.paper.curves import Curve, solve_curves
from asperity.study.paper.machine import (
    EXT,
    LD,
    RR,
    applied_amplitudes,
    borne_amplitudes,
    fitted_transmission,
    paper,
    slider,
    velocities,
    velocity_text,
)
from asperity.study.paper.numbers import FigureNumbers, stated


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


def figure_4() -> FigureNumbers:
    """Harmonics against eps at 120 Hz."""
    seen = stated()
    slow, fast = velocities()
    data = solve_curves(
        Curve(velocity_text(V), EXT, V, applied_amplitudes(), fitted_transmission())
        for V in (slow, fast)
    )
    found = FigureNumbers("figure-04", "Figure 4", "A weakly anharmonic force response", data)
    mu1 = [found.last(velocity_text(V), "mu1") for V in (slow, fast)]
    mu2 = [found.last(velocity_text(V), "mu2") for V in (slow, fast)]
    ratio = [second / first for first, second in zip(mu1, mu2, strict=True)]
    return found.told(
        scalars={
            "mu1_slow": mu1[0],
            "mu1_fast": mu1[1],
            "mu2_slow": mu2[0],
            "mu2_fast": mu2[1],
            "ratio_slow": ratio[0],
            "ratio_fast": ratio[1],
        },
        caption=(
            f"Elasto-plastic law, ε_eff = ε/2.1. At ε = {seen.epsilon:g}, μ₁ = "
            f"{1e3 * mu1[0]:.2f} × 10⁻³ at 1 µm/s and {1e3 * mu1[1]:.2f} × 10⁻³ at 10 µm/s, where "
            "the text states the order 10⁻³ and no dependence on V. μ₂/μ₁ is "
            f"{ratio[0]:.2f} and {ratio[1]:.2f}; the text states 0.1 to 0.2, with μ₂ lower at the "
            "smaller V. At small ε the two velocities do differ in the model: there sliding, not "
            "the asperities' elasticity, makes the force oscillate."
        ),
        alt=(
            "Three panels against modulation amplitude for 1 and 10 µm/s: the first harmonic, the "
            "second harmonic, and their ratio. The first harmonics meet at large amplitude, the "
            "second is larger at the larger velocity, the ratio lies in the stated band from 0.1 "
            "to 0.2 at large amplitude."
        ),
    )


def figure_8() -> FigureNumbers:
    """Rice-Ruina: harmonics against eps_eff."""
    slow, fast = velocities()
    data = solve_curves(Curve(velocity_text(V), RR, V, borne_amplitudes()) for V in (slow, fast))
    found = FigureNumbers("figure-08", "Figure 8", "Rice–Ruina: the harmonics come out wrong", data)
    growth = [
        found.last(velocity_text(fast), n) / found.last(velocity_text(slow), n)
        for n in ("mu1", "mu2")
    ]
    filled = found.last(velocity_text(fast), "mu1") / pulse_limit(fast)
    return found.told(
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
            "dependence on V that the experiment does not show. Both saturate, because slip ends "
            "as one short pulse a period, beyond which the force cannot go: grey lines, "
            f"μ₁ = 2VK/(ωW₀), of which {100 * filled:.0f} % are reached, and μ₂ = VK/(ωW₀)."
        ),
        alt=(
            "First and second harmonic of the Rice-Ruina law against effective amplitude. At 10 "
            "µm/s both rise fast and saturate; at 1 µm/s they are ten times smaller, close to the "
            "axis."
        ),
    )


def figure_9() -> FigureNumbers:
    """Linker-Dieterich with two coefficients, and Rice-Ruina to hold it against."""
    p, (slow, fast), eps = paper(), velocities(), borne_amplitudes()
    data = solve_curves(
        [
            *(
                Curve(_alpha_name(a, V), LD, V, eps, overrides={"alpha": a})
                for a in (p.alpha, p.alpha_low)
                for V in (slow, fast)
            ),
            *(Curve(f"RR, {velocity_text(V)}", RR, V, eps) for V in (slow, fast)),
        ]
    )
    found = FigureNumbers(
        "figure-09", "Figure 9", "Linker–Dieterich ageing: too small a drop, or no difference", data
    )
    at = float(stated().epsilon_eff)
    share = _at(found, _alpha_name(p.alpha, slow), "delta_mu", at) / stated().drop[0]
    near = {
        n: _at(found, _alpha_name(p.alpha_low, fast), n, at)
        / _at(found, f"RR, {velocity_text(fast)}", n, at)
        - 1
        for n in ("delta_mu", "mu1", "mu2")
    }
    caption_mean = _at(found, _alpha_name(p.alpha_low, slow), "delta_mu", at) / _at(
        found, _alpha_name(p.alpha, slow), "delta_mu", at
    )
    return found.told(
        scalars={"share_of_drop": share, "low_over_high": caption_mean}
        | {f"low_alpha_{n}": value for n, value in near.items()},
        caption=(
            f"Linker–Dieterich law. α = 0.2 gives {100 * share:.0f} % of the stated drop of the "
            f"mean. With α = 0.02 drop, μ₁ and μ₂ differ by {100 * abs(near['delta_mu']):.1f}, "
            f"{100 * abs(near['mu1']):.1f} and {100 * abs(near['mu2']):.1f} % from Rice–Ruina "
            "(thin), and share its faults. The paper's caption calls 1 µm/s, α = 0.02 (grey) "
            "undistinguishable from the dotted line of α = 0.2; for μ₁ and μ₂ it is, but the mean "
            f"of the one falls {caption_mean:.1f} times as much as that of the other."
        ),
        alt=(
            "Change of the mean, first and second harmonic of the Linker-Dieterich law against "
            "effective amplitude. With alpha 0.2 the mean falls half as much as with alpha 0.02; "
            "the harmonics grow tenfold with velocity and saturate, whatever alpha."
        ),
    )


def figure_11() -> FigureNumbers:
    """The elasto-plastic law, and what the uncertainty of lambda makes of it."""
    slow, fast = velocities()
    data = solve_curves(_elasto_plastic_curves())
    found = FigureNumbers(
        "figure-11",
        "Figure 11",
        "Elastic asperities: hardly any dependence on V, no saturation",
        data,
    )
    at = stated().epsilon_eff
    change = [
        _at(found, velocity_text(fast), n, at) / _at(found, velocity_text(slow), n, at)
        for n in ("mu1", "mu2")
    ]
    bend = [late_over_early_slope(found, velocity_text(V), "mu1") for V in (slow, fast)]
    plateau = _at(found, velocity_text(slow), "mu1", at) / (at * elastic_slope(slow))
    return found.told(
        scalars={
            "growth_mu1": change[0],
            "growth_mu2": change[1],
            "late_over_early_slow": bend[0],
            "late_over_early_fast": bend[1],
            "over_plateau": plateau,
            "elastic_slope": elastic_slope(slow),
        },
        caption=(
            "Elasto-plastic law, λ = 0.7 µm. For ten times the velocity, at ε_eff = 0.5/2.1, μ₁ "
            f"changes by the factor {change[0]:.2f} and μ₂ by {change[1]:.2f}, where Rice–Ruina "
            "has ten; and nothing saturates below ε_eff = 0.3. Band: λ = 0.62 ± 0.15 µm, as "
            "measured quasi-statically, at 1 µm/s. Grey: ε_eff μ̄ l/(1 + l), l = λK/W₀, the "
            "elastic response of the asperities alone, which does not depend on V but through μ̄. "
            "Without inertia, as the paper's Eq. (29); the claims say what inertia changes."
        ),
        alt=(
            "Change of the mean, first and second harmonic of the elasto-plastic law against "
            "effective amplitude. The mean is as in Rice-Ruina; the harmonics of the two "
            "velocities are close to each other and keep rising up to 0.3."
        ),
    )


def _elasto_plastic_curves() -> list[Curve]:
    """Both velocities, and the ends of the measured lambda at the slow one."""
    slow, eps = velocities()[0], borne_amplitudes()
    measured = paper()["lambda_quasi_static"]
    spread = measured.si_uncertainty or 0.0
    ends = {"lambda low": measured.si - spread, "lambda high": measured.si + spread}
    return [
        *(Curve(velocity_text(V), EXT, V, eps) for V in velocities()),
        *(Curve(name, EXT, slow, eps, overrides={"lambda_": at}) for name, at in ends.items()),
    ]


def late_over_early_slope(found: FigureNumbers, curve: str, column: str) -> float:
    """Slope of a curve in its last tenth over its mean slope; small where it saturates."""
    rows = found.curve(curve)
    x, y = rows["epsilon_eff"].to_numpy(), rows[column].to_numpy()
    tenth = len(x) // 10
    return float((y[-1] - y[-1 - tenth]) / (x[-1] - x[-1 - tenth]) / (y[-1] / x[-1]))


def _alpha_name(alpha: float, velocity: float) -> str:
    return f"alpha = {alpha:g}, {velocity_text(velocity)}"


def _at(found: FigureNumbers, curve: str, column: str, epsilon_eff: float) -> float:
    rows = found.curve(curve)
    return float(np.interp(epsilon_eff, rows["epsilon_eff"], rows[column]))
