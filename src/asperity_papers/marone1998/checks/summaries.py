"""Claims on data and their summaries, on stress drops, on gouge, and on afterslip."""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares

from asperity.experiment import hold_response
from asperity.ledger import check
from asperity_papers.marone1998.laboratory import AGEING, DECADE, Laboratory, Numbers, scans


@check("decade-of-velocity")
def decade_of_velocity(laboratory: Laboratory) -> Numbers:
    """Change of healing and of static friction of the gouge of Figure 5 per decade of velocity."""
    p, law = laboratory.numbers, laboratory.gouge()
    held = hold_response(
        law, hold_time=1e4, velocity=laboratory.pair("V_5"), stiffness=p.k_stiff, settling=False
    )
    healing, absolute = np.diff(held.healing)[0], np.diff(held.maximum)[0]
    return {
        "scan": scans()["figure_4"]["offset"],
        "healing": float(healing),
        "static friction": float(absolute),
        "b ln 10": p.B_5 * DECADE,
        "a ln 10": (p.B_5 - p.B_less_A_5) * DECADE,
    }


@check("intrinsic-and-dilation")
def intrinsic_and_dilation(laboratory: Laboratory) -> Numbers:
    scan = scans()["figure_7"]
    bare, gouge = scan["bare"][0], np.array(scan["gouge"])
    needed = gouge[:, 0] - bare
    return {"needed low": float(needed.min()), "needed high": float(needed.max())}


def _read(name: str) -> tuple[np.ndarray, np.ndarray]:
    depth, slip = np.array(scans()["figure_16a"][name]).T
    return depth, slip


@check("afterslip-equals-coseismic")
def afterslip_equals_coseismic(laboratory: Laboratory) -> Numbers:
    h, coseismic = _read("coseismic")
    net = np.interp(h, *_read("net"), left=1.0)
    # The depth at which half of the net slip is coseismic.
    return {"km": float(np.interp(0.0, -(coseismic - 0.5 * net), h))}


@check("buried-slip")
def buried_slip(laboratory: Laboratory) -> Numbers:
    h, coseismic = _read("coseismic")
    return {"km": float(h[np.argmin(coseismic > 0)])}


@check("afterslip-equals-dynamic")
def afterslip_equals_dynamic(laboratory: Laboratory) -> Numbers:
    return {"afterslip": float(np.interp(2.5, *_read("net")))}


@check("slip-falls-with-depth")
def slip_falls_with_depth(laboratory: Laboratory) -> Numbers:
    h, coseismic = _read("coseismic")
    depth, net = _read("net")
    both = np.interp(h, depth, net, left=1.0)
    ratio = (both - coseismic)[:-1] / coseismic[:-1]
    return {
        "coseismic": -float(np.max(np.diff(coseismic))),
        "net": -float(np.max(np.diff(net))),
        "faster": float(np.min(-np.diff(coseismic) + np.diff(both))),
        "ratio rises": float(np.min(np.diff(ratio))),
    }


@check("afterslip-relation")
def afterslip_relation(laboratory: Laboratory) -> Numbers:
    """Alpha and beta of the printed relation, fitted to the curve of Figure 16b."""
    scan = scans()["figure_16b"]
    t, u = np.array(scan["slip"]).T
    after = u[1:] - u[0]

    def residuals(p: np.ndarray) -> np.ndarray:
        alpha, rate = np.exp(p)
        return np.asarray(alpha * np.log1p(rate * t[1:]) - after)

    fit = least_squares(residuals, np.log([40.0, 1.0]), xtol=1e-14, ftol=1e-14, gtol=1e-14)
    alpha, rate = np.exp(fit.x)
    return {
        "worst": float(np.max(np.abs(fit.fun)) / (2 * scan["pixel"])),
        "alpha": float(alpha), "beta": float(alpha * rate), "rate": float(rate),
    }  # fmt: skip


@check("maximum-condition")
def maximum_condition(laboratory: Laboratory) -> Numbers:
    """1 plus the quantity that is zero at the maximum: printed, healing; derived, mu'/(k V)."""
    k, V = laboratory.stiff
    held = laboratory.holds(AGEING, k, V, 1e3)
    return {
        "printed": 1 + float(held.healing),
        "derived": 1 + float((V - held.velocity_at_maximum) / V),
        "independent": 1.0,
    }


@check("memory-length-against-strain")
@check("distance-to-weakening")
def not_readable(laboratory: Laboratory) -> Numbers:
    """No numbers: scans.toml has no readings of Figures 8 and 12."""
    return {}
