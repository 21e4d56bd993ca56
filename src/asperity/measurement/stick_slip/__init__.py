"""Stick-slip: events of slip, what the recording is, healing."""
