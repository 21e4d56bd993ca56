"""Experiments on a simulated slider, recorded by the virtual tribometer and read as any other."""

from asperity.study.experiment.amplitudes import (
    AmplitudePoint,
    AmplitudeSeries,
    amplitude_series,
)
from asperity.study.experiment.exciter import Exciter
from asperity.study.experiment.loading import ElasticLength, elastic_length, loading_recording

__all__ = [
    "AmplitudePoint",
    "AmplitudeSeries",
    "ElasticLength",
    "Exciter",
    "amplitude_series",
    "elastic_length",
    "loading_recording",
]
