"""The slider, its equations of motion, and their parameters by name."""

from asperity._lazy import public_names
from asperity.slider.inertial import (
    Inertial as Inertial,
    RadiatingAsperities as RadiatingAsperities,
    StiffInertial as StiffInertial,
)
from asperity.slider.motion import Motion as Motion
from asperity.slider.problem import equation_of_motion as equation_of_motion
from asperity.slider.quasi_static import QuasiStatic as QuasiStatic
from asperity.slider.radiation_damping import Radiating as Radiating
from asperity.slider.reversing import ReversingInertial as ReversingInertial, reversing as reversing
from asperity.slider.slider import Slider as Slider

__all__ = public_names(globals())
