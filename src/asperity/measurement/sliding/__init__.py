"""Recordings without modulation: segments of constant velocity, velocity steps, holds."""
