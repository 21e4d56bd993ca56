"""Maximum likelihood: starts, minima, intervals, and the description of a fit."""
