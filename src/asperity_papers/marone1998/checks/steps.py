"""Claims on velocity steps: Figure 2 and the text on it."""

from __future__ import annotations

import numpy as np

from asperity import Slider, transient
from asperity.experiment import VelocityStepResponse, step_response
from asperity.ledger import check
from asperity.loads import Programme, Slide
from asperity.theory import holds_and_steps
from asperity_papers.marone1998.laboratory import (
    AGEING,
    LAWS,
    PRZ,
    SLIP,
    Laboratory,
    Numbers,
    by_law,
)

#: Stiffness of a nearly rigid spring, in multiples of the paper's.
_STIFF = 1e4


def up_and_down(
    laboratory: Laboratory, name: str, factor: float = 1.0, *, settling: bool = False
) -> VelocityStepResponse:
    """The steps of Figure 2, both from steady sliding."""
    p = laboratory.numbers
    slow, fast = laboratory.pair("V_2")
    return step_response(
        laboratory.illustration(name),
        velocity_before=[slow, fast],
        velocity=[fast, slow],
        stiffness=factor * p.k_2,
        settling=settling,
    )


@check("figure-2-ageing", AGEING)
@check("figure-2-slip", SLIP)
@check("figure-2-prz", PRZ)
def figure_2(laboratory: Laboratory, name: str) -> Numbers:
    step, D0 = up_and_down(laboratory, name, settling=True), laboratory.numbers.D0_2
    return {
        "peak": float(step.direct[0]),
        "at load": float(step.distance[0] / D0),
        "trough": float(step.direct[1]),
        "settled": float(step.settling_distance[0] / D0),
    }


@check("peak-height", "direct")
@check("peak-to-end", "evolution")
def size_of_change(laboratory: Laboratory, name: str) -> Numbers:
    """Change of friction with the printed spring, and with a nearly rigid spring."""

    def change(law: str, *stiffness: float) -> float:
        return float(getattr(up_and_down(laboratory, law, *stiffness), name)[0])

    stiff = {f"{letter}, stiff": change(law, _STIFF) for law, letter in LAWS.items()}
    return by_law(change) | stiff


@check("end-level")
def end_level(laboratory: Laboratory) -> Numbers:
    """Drop of friction from before the step to 7 Dc after it, and to steady sliding."""
    p = laboratory.numbers
    slow, fast = laboratory.pair("V_2")
    steps = Programme(Slide(7 * p.D0_2 / fast, velocity=fast), load=1.0, velocity=slow)

    def drop(name: str) -> float:
        run = transient(Slider(laboratory.illustration(name), spring=p.k_2, load=1.0), steps)
        return float(run.force[0] - run.force[-1])

    step = up_and_down(laboratory, AGEING)
    return by_law(drop) | {"in the end": float(step.before[0] - step.after[0])}


@check("direct-effect")
def direct_effect(laboratory: Laboratory) -> Numbers:
    signs: Numbers = {}
    for name, letter in LAWS.items():
        up, down = up_and_down(laboratory, name).direct
        signs |= {f"{letter}, up": float(up), f"{letter}, down": -float(down)}
    return signs


@check("ageing-asymmetric")
def ageing_asymmetric(laboratory: Laboratory) -> Numbers:
    D0, law = laboratory.numbers.D0_2, laboratory.illustration(AGEING)
    u, imposed = np.linspace(0, 10, 100_001) * D0, {}
    for r in (10.0, 0.1):
        state = np.abs(np.asarray(holds_and_steps.state_after_step(law, r, u)))
        imposed[r] = u[np.argmax(state <= 0.05 * np.log(10))]
    on_spring = up_and_down(laboratory, AGEING, settling=True).settling_slip / D0
    return {
        "ratio, imposed velocity": float(imposed[10.0] / imposed[0.1]),
        "ratio, spring of Figure 2": float(on_spring[0] / on_spring[1]),
        "up": float(on_spring[0]),
        "down": float(on_spring[1]),
    }
