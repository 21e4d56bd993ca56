"""The slider, its equations of motion, and their parameters by name."""

from asperity.slider.inertial import Inertial, RadiatingAsperities, StiffInertial
from asperity.slider.motion import Motion
from asperity.slider.problem import equation_of_motion
from asperity.slider.quasi_static import QuasiStatic
from asperity.slider.radiating import Radiating
from asperity.slider.reversing import ReversingInertial, reversing
from asperity.slider.slider import Slider

__all__ = [
    "Inertial",
    "Motion",
    "QuasiStatic",
    "Radiating",
    "RadiatingAsperities",
    "ReversingInertial",
    "Slider",
    "StiffInertial",
    "equation_of_motion",
    "reversing",
]
