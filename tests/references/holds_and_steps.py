"""Holds and velocity steps by SciPy, from the printed equations of the laws."""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp

#: Marone (1998), Eqs. (2)-(4), as d ln(theta/theta_ss(V0))/dt from ln(theta V0/theta_ss V0) and v.
STATE_RATES = {
    "rice-ruina": lambda v, y, D0, V0: (V0 * np.exp(-y) - v) / D0,
    "ruina-slip": lambda v, y, D0, V0: -v / D0 * (y + np.log(v / V0)),
    "perrin-rice-zheng": lambda v, y, D0, V0: (V0 * np.exp(-y) - v**2 / V0 * np.exp(y)) / (2 * D0),
}


class Interface:
    """A law on a spring of stiffness k = K/W0 (1/m), without inertia; mu is counted from mu0."""

    def __init__(self, name, A, B, D0, k, V0=1e-6):
        self.rate, self.A, self.B, self.D0, self.k, self.V0 = STATE_RATES[name], A, B, D0, k, V0

    def log_v(self, mu, y):
        return np.log(self.V0) + (mu - self.B * y) / self.A

    def steady(self, V):
        y = -np.log(V / self.V0)
        return np.array([(self.A - self.B) * np.log(V / self.V0), y])

    def integrate(self, start, pull, duration, V, event=None):
        """(mu, y, slip) and time at the end, or where v crosses V in the direction `event`."""

        def rates(_, Y):
            v = np.exp(self.log_v(Y[0], Y[1]))
            return [self.k * (pull - v), self.rate(v, Y[1], self.D0, self.V0), v]

        def crossing(_, Y):
            return self.log_v(Y[0], Y[1]) - np.log(V)

        crossing.terminal, crossing.direction = True, event or 0
        run = solve_ivp(
            rates, (0, duration), [*start, 0.0], "DOP853", rtol=1e-12,
            atol=[1e-14, 1e-12, 1e-18], events=crossing if event else None,
        )  # fmt: skip
        assert run.success, run.message
        return run.y[:, -1], run.t[-1]

    def hold(self, V, time):
        """Steady mu, minimum and maximum, slip during the hold and during reloading."""
        start = self.steady(V)
        (low, y, slip), _ = self.integrate(start, 0.0, time, V)
        # An upper bound of the time in which friction can rise.
        longest = 5 * (self.B * np.log(1e9 + time * V / self.D0) / self.k + 50 * self.D0) / V
        (high, _, more), _ = self.integrate([low, y], V, longest, V, event=1)
        return start[0], low, high, slip, more

    def step(self, V_before, V):
        """Steady mu before the step, extremum, and steady mu after it."""
        up = 1 if V_before < V else -1
        longest = 1e3 * (1 / self.k + self.D0) / V
        (extremum, *_), _ = self.integrate(self.steady(V_before), V, longest, V, event=up)
        return self.steady(V_before)[0], extremum, self.steady(V)[0]
