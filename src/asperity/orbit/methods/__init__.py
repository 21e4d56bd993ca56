"""Methods that find a periodic orbit: Fourier, shooting, collocation, continuation, transients."""
