"""Recordings in the likelihood: motion through a whole run, and noise as it is."""
