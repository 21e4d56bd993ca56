"""Experiments on a simulated slider, recorded by the virtual tribometer and measured."""

from asperity._lazy import public_names
from asperity.experiment.amplitudes import (
    AmplitudeMotion as AmplitudeMotion,
    AmplitudePoint as AmplitudePoint,
    AmplitudeSeries as AmplitudeSeries,
    Exciter as Exciter,
    amplitude_motion as amplitude_motion,
    amplitude_series as amplitude_series,
)
from asperity.experiment.holds_and_steps import (
    Holds as Holds,
    VelocityStepResponse as VelocityStepResponse,
    hold_response as hold_response,
    step_response as step_response,
)
from asperity.experiment.loading import (
    ElasticLength as ElasticLength,
    elastic_length as elastic_length,
    loading_recording as loading_recording,
)
from asperity.experiment.programmes import (
    SlideHoldSlide as SlideHoldSlide,
    VelocitySteps as VelocitySteps,
    slide_hold_slide as slide_hold_slide,
    velocity_steps as velocity_steps,
)
from asperity.experiment.recorded_motion import (
    DISPLACEMENT as DISPLACEMENT,
    DRIVE as DRIVE,
    FORCE as FORCE,
    LOAD as LOAD,
)
from asperity.experiment.stick_slip import (
    StickSlip as StickSlip,
    stick_slip_response as stick_slip_response,
)
from asperity.tribometer.tribometer import channel_gain as channel_gain

__all__ = public_names(globals())
