"""Experiments on a simulated slider, recorded by the virtual tribometer and measured."""

from asperity.experiment.amplitudes import (
    AmplitudeMotion,
    AmplitudePoint,
    AmplitudeSeries,
    Exciter,
    amplitude_motion,
    amplitude_series,
)
from asperity.experiment.loading import ElasticLength, elastic_length, loading_recording
from asperity.experiment.memory import (
    Holds,
    VelocityStepResponse,
    hold_response,
    step_response,
)
from asperity.experiment.motion import DISPLACEMENT, DRIVE, FORCE, LOAD
from asperity.experiment.recipes import (
    SlideHoldSlide,
    VelocitySteps,
    slide_hold_slide,
    velocity_steps,
)
from asperity.experiment.stick_slip import StickSlip, stick_slip_response
from asperity.tribometer.tribometer import channel_gain

__all__ = [
    "DISPLACEMENT",
    "DRIVE",
    "FORCE",
    "LOAD",
    "AmplitudeMotion",
    "AmplitudePoint",
    "AmplitudeSeries",
    "ElasticLength",
    "Exciter",
    "Holds",
    "SlideHoldSlide",
    "StickSlip",
    "VelocityStepResponse",
    "VelocitySteps",
    "amplitude_motion",
    "amplitude_series",
    "channel_gain",
    "elastic_length",
    "hold_response",
    "loading_recording",
    "slide_hold_slide",
    "step_response",
    "stick_slip_response",
    "velocity_steps",
]
