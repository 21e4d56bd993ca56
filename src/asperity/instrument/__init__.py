"""Signals as a laboratory has them: a `Trace` of channels over time, read, checked and measured."""

from asperity.instrument.checks import check
from asperity.instrument.finding import Finding
from asperity.instrument.readers import read
from asperity.instrument.trace import Channel, Trace

__all__ = ["Channel", "Finding", "Trace", "check", "read"]
