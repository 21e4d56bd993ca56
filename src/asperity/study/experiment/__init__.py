"""Experiments on a simulated slider, recorded by the virtual tribometer and read as any other."""

from asperity.study.experiment.amplitude_protocol import AmplitudeMotion, amplitude_motion
from asperity.study.experiment.amplitude_readings import AmplitudePoint, AmplitudeSeries
from asperity.study.experiment.amplitudes import amplitude_series
from asperity.study.experiment.exciter import Exciter
from asperity.study.experiment.gain import channel_gain
from asperity.study.experiment.loading import ElasticLength, elastic_length, loading_recording

__all__ = [
    "AmplitudeMotion",
    "AmplitudePoint",
    "AmplitudeSeries",
    "ElasticLength",
    "Exciter",
    "amplitude_motion",
    "amplitude_series",
    "channel_gain",
    "elastic_length",
    "loading_recording",
]
