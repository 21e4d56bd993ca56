"""Fourier collocation for orbits that move little within a period: the fast method."""
