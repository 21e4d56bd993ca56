"""Methods that find a periodic orbit: Fourier, series, shooting, collocation, branch following."""
