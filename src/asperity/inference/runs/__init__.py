"""Recordings in the likelihood: the motion through a whole run, and coloured noise."""
