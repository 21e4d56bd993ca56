"""Verdicts on a reading: every doubt as a number, a threshold and a sentence."""
