"""A quasi-static slider with the ageing law by SciPy, pulled at a sequence of velocities."""

import numpy as np
from benchmarks.coverage import integrated


def pulled_in_parts(velocities, lengths, rates):
    """Bounds (s), times (s), slip at these (m), and slip of each part (m), for parts of a velocity.

    Lengths are slips (m), or durations (s) where the velocity is zero; rates are in 1/s.
    """
    spans = [s / v if v else s for v, s in zip(velocities, lengths, strict=True)]
    bounds = np.concatenate([[0.0], np.cumsum(spans)])
    parts = zip(bounds[:-1], bounds[1:], rates, strict=True)
    time = np.concatenate([np.arange(a, b - 1e-9, 1 / rate) for a, b, rate in parts])
    slips = [s if v else 0.0 for v, s in zip(velocities, lengths, strict=True)]
    slip = np.interp(time, bounds, np.concatenate([[0.0], np.cumsum(slips)]))
    return bounds, time, slip, slips


def spring_slider(velocities, bounds, times, *, A, B, D0, k, mu0=0.6, V0=1e-6, rtol=1e-8):
    """Friction at `times` between the bounds; the stiffness `k` is K/W0 (1/m)."""
    numbers = {"A": A, "B": B, "D0": D0, "k": k, "mu0": mu0, "V0": V0, "alpha": 0.0}
    return integrated(numbers, bounds, velocities, times, tolerance=rtol)
