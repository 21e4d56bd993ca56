"""Stabilisation of sliding by a modulated load, after Cochard, Bureau and Baumberger (2003).

Their paper maps where modulation stabilises and where it destabilises; here the same questions are
asked of the laws of Bureau et al. (2000), with and without inertia.
"""

from asperity.study.stability.diagram import (
    CASES,
    Case,
    resonance_map,
    stabilisation_diagram,
)
from asperity.study.stability.threshold import (
    StiffnessThreshold,
    natural_scales,
    stiffness_threshold,
)

__all__ = [
    "CASES",
    "Case",
    "StiffnessThreshold",
    "natural_scales",
    "resonance_map",
    "stabilisation_diagram",
    "stiffness_threshold",
]
