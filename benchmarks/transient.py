"""The rows of transients: protocols integrated in time, compared with SciPy.

Three protocols with the paper's numbers: a load modulation switched on, elasto-plastic law and a
stiffer spring, with and without inertia; and stick-slip with inertia on rigid asperities. A time is
that of one protocol; an error is the largest of F/W0 over its samples, relative to the largest
F/W0, compared with SciPy's integrators at their smallest tolerance. SciPy's LSODA has the loosest
tolerance that is as accurate as the package, or its smallest if none is. It is called by
`solve_ivp` and by the older `odeint`, which has less overhead.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, exp, sin

import numpy as np
from scipy.integrate import odeint, solve_ivp

import asperity as asp
from asperity.loads import Modulate, Programme, Slide
from benchmarks.clock import timed
from benchmarks.table import Row

MU0, A, B, D0, V0, W0, M, LAMBDA = 0.5, 0.013, 0.026, 4e-7, 1e-6, 7.0, 1.6, 6.2e-7
_TOLERANCES = (1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12)

#: Largest exponent, so that failing trial steps do not overflow.
_LARGEST = 300.0


@dataclass(frozen=True)
class Protocol:
    """A transient for the package and for SciPy.

    Attributes
    ----------
    name : str
    rates : callable
        (t, y) -> dy/dt in plain Python; the first state is F/W0.
    start : list of float
    times : array
        Samples (s).
    ours : callable
        rtol -> F/W0 at the samples.
    reference : str
        Method of `solve_ivp` for the exact solution.
    """

    name: str
    rates: Callable
    start: list[float]
    times: np.ndarray
    ours: Callable[[float], np.ndarray]
    reference: str


def _slider(law: type[asp.laws.RiceRuina], K: float, **more: float) -> asp.Slider:
    return asp.Slider(law(mu0=MU0, A=A, B=B, D0=D0, V0=V0, **more), spring=K, load=W0, mass=M)


def modulation(seconds: float, inertia: bool) -> Protocol:
    """W0 (1 + 0.24 cos wt) at 120 Hz switched on, elastic asperities; x is the last state."""
    K, omega, V = 4e5, 240 * np.pi, 1e-6
    ratio = LAMBDA * K / W0

    def quasi_static(t: float, y: np.ndarray) -> list[float]:
        f, phi, _ = y
        w, slope = 1 + 0.24 * cos(omega * t), -0.24 * omega * sin(omega * t)
        slip = V0 * exp(min((f / w - MU0 - B * phi) / A, _LARGEST))
        rate = (V - slip + LAMBDA * f * slope / w**2) / (W0 / K + LAMBDA / w)
        v = V - W0 / K * rate
        return [rate, (V0 * exp(min(-phi, _LARGEST)) - v) / D0, v]

    def inertial(t: float, y: np.ndarray) -> list[float]:
        f, phi, v, g, _ = y
        w = 1 + 0.24 * cos(omega * t)
        slip = V0 * exp(min((g - MU0 - B * phi) / A, _LARGEST))
        ageing = (V0 * exp(min(-phi, _LARGEST)) - v) / D0
        return [K / W0 * (V - v), ageing, W0 / M * (f - w * g), (v - slip) / LAMBDA, v]

    times = np.linspace(0, seconds, int(seconds * 1000) + 1)
    programme = Programme(Modulate(seconds, 0.24, "120 Hz"), load=W0, velocity=V)

    def ours(rtol: float) -> np.ndarray:
        slider = _slider(asp.laws.ElastoPlastic, K, lambda_=LAMBDA)
        motion = asp.transient(slider, programme, sampling=times, inertia=inertia, rtol=rtol)
        return motion.force / W0

    if inertia:
        start = [MU0, 0.0, V, MU0, 0.0]
        return Protocol("inertial modulation on", inertial, start, times, ours, "DOP853")
    # The load steps up by 24 %: the asperities become stiffer, and the slider moves.
    f = MU0 * (1 + ratio) / (1 + ratio / 1.24)
    x = (MU0 - f) * W0 / K
    start = [f, -x / D0, x]
    return Protocol("modulation on", quasi_static, start, times, ours, "DOP853")


def stick_slip(seconds: float) -> Protocol:
    """A soft spring at 11 um/s, with inertia: ln v is a state."""
    K, V = 1e5, 1.1e-5

    def rates(t: float, y: np.ndarray) -> list[float]:
        v = V0 * exp(min(y[1], _LARGEST))
        friction = MU0 + A * y[1] + B * y[2]
        return [
            K / W0 * (V - v),
            W0 / (M * v) * (y[0] - friction),
            (V0 * exp(min(-y[2], _LARGEST)) - v) / D0,
            v,
        ]

    times = np.linspace(0, seconds, int(seconds * 1000) + 1)
    programme = Programme(Slide(seconds, V), load=W0, velocity=1e-5)

    def ours(rtol: float) -> np.ndarray:
        motion = asp.transient(
            _slider(asp.laws.RiceRuina, K), programme, sampling=times, inertia=True, rtol=rtol
        )
        return motion.force / W0

    log_v = np.log(1e-5 / V0)
    start = [MU0 + (A - B) * log_v, log_v, -log_v, 0.0]
    return Protocol("stick-slip", rates, start, times, ours, "Radau")


def transient_rows(seconds: float, repeats: int) -> list[Row]:
    """For each protocol: the package, then LSODA at the tolerance that is as accurate."""
    rows = []
    for protocol in (modulation(seconds, False), modulation(seconds, True), stick_slip(seconds)):
        true = _reference(protocol)

        def error(force: np.ndarray, true: np.ndarray = true) -> float:
            return float(np.max(np.abs(force - true)) / np.max(np.abs(true)))

        time, force = timed(lambda protocol=protocol: protocol.ours(1e-9), repeats)
        reached = error(force)
        rows.append(Row(f"asperity transient, {protocol.name}", 1, time, mean=reached))
        for name, solve in (("solve_ivp LSODA", _solve_ivp), ("odeint LSODA", _odeint)):
            for tolerance in _TOLERANCES:
                peer, force = timed(
                    lambda p=protocol, s=solve, r=tolerance: s(p, r), 1, warm_up=False
                )
                if error(force) <= max(reached, 1e-9):
                    break
            remark = "" if error(force) <= max(reached, 1e-9) else ", less accurate"
            note = f"rtol {tolerance:.0e}{remark}; {peer / time:.1f} x asperity"
            rows.append(Row(f"{name}, {protocol.name}", 1, peer, mean=error(force), note=note))
    return rows


def _reference(protocol: Protocol) -> np.ndarray:
    run = solve_ivp(
        protocol.rates, (0, protocol.times[-1]), protocol.start, protocol.reference,
        protocol.times, rtol=3e-13 if protocol.reference == "DOP853" else 1e-11, atol=1e-13,
    )  # fmt: skip
    return run.y[0]


def _solve_ivp(protocol: Protocol, rtol: float) -> np.ndarray:
    run = solve_ivp(
        protocol.rates, (0, protocol.times[-1]), protocol.start, "LSODA", protocol.times,
        rtol=rtol, atol=0.01 * rtol,
    )  # fmt: skip
    return run.y[0]


def _odeint(protocol: Protocol, rtol: float) -> np.ndarray:
    path = odeint(
        protocol.rates, protocol.start, protocol.times, tfirst=True, rtol=rtol,
        atol=0.01 * rtol, mxstep=100_000,
    )  # fmt: skip
    return path[:, 0]
