"""Programmes of load and drive: steps, ramps, holds, modulation, recorded signals."""
