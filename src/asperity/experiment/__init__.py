"""Experiments on a simulated slider, recorded by the virtual tribometer and read as any other."""

from asperity.experiment.amplitudes import (
    AmplitudeMotion,
    AmplitudePoint,
    AmplitudeSeries,
    amplitude_motion,
    amplitude_series,
)
from asperity.experiment.exciter import Exciter
from asperity.experiment.loading import ElasticLength, elastic_length, loading_recording
from asperity.experiment.recipes import (
    SlideHoldSlide,
    VelocitySteps,
    slide_hold_slide,
    velocity_steps,
)
from asperity.tribometer.tribometer import channel_gain

__all__ = [
    "AmplitudeMotion",
    "AmplitudePoint",
    "AmplitudeSeries",
    "ElasticLength",
    "Exciter",
    "SlideHoldSlide",
    "VelocitySteps",
    "amplitude_motion",
    "amplitude_series",
    "channel_gain",
    "elastic_length",
    "loading_recording",
    "slide_hold_slide",
    "velocity_steps",
]
