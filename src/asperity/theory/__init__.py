"""Closed forms and limits: averaged, adiabatic, first and second order in eps."""

from asperity.theory.perturbation import PerturbationResponse, perturbation_response

__all__ = ["PerturbationResponse", "perturbation_response"]
