"""Maximum likelihood: starts, minima, intervals and what a fit says of itself."""
