"""Closed forms and limits: averaged, adiabatic, first and second order in eps."""

from asperity.theory import closed_forms, holds_and_steps, linear_stability
from asperity.theory.ageing_response import AgeingResponse, ageing_response
from asperity.theory.closed_forms import SmallModulation
from asperity.theory.perturbation import PerturbationResponse, perturbation_response
from asperity.theory.stick_slip import StickSlipCycle, healing_drop, overshooting_cycle

__all__ = [
    "AgeingResponse",
    "PerturbationResponse",
    "SmallModulation",
    "StickSlipCycle",
    "ageing_response",
    "closed_forms",
    "healing_drop",
    "holds_and_steps",
    "linear_stability",
    "overshooting_cycle",
    "perturbation_response",
]
