"""Law + spring + mass + load = equation of motion."""

from asperity.slider.quasi_static import QuasiStatic
from asperity.slider.slider import Slider

__all__ = ["QuasiStatic", "Slider"]
