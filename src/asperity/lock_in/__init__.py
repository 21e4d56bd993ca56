"""Lock-in reading: harmonics of the shear force against the phase of the measured load."""
