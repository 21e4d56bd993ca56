"""Residuals of answers in the equations of motion, which are written here independently.

The waveform (F/W0, slip rate) that the package returns is differentiated spectrally and must obey
the equations of the spring, of the age and of friction; its harmonics must be those of the answer.
This detects answers that claim convergence and are no solution, by any method.
"""

from __future__ import annotations

import dataclasses
import itertools
from functools import partial

import numpy as np
from scipy.integrate import solve_ivp

from asperity import Slider, periodic_response
from asperity.laws import ElastoPlastic, RiceRuina
from asperity.orbit import PeriodicResponse
from asperity.orbit.search import CHOICES
from asperity.slider.problem import Problem, checked_problem, flatten
from benchmarks.populations import log_uniform

#: Residual of either equation over its largest term. The waveform has an error of 3e-5 of its
#: swing, more in its steepest parts, and is differentiated once.
RESIDUAL = 1e-3
#: Error of the mean slip rate over V; it needs no derivative and determines the mean of F.
SLIP = 1e-6
#: Error of harmonics over the swing of the waveform.
HARMONICS = 3e-5
#: A spectrum is resolved by its samples if its last 16th, over its maximum, is below this.
RESOLVED = 1e-6

#: Largest change of the exponents between samples at which an integration starts, and the least
#: number of these samples.
_CHANGE, _LEAST = 0.25, 100
#: An integration with more evaluations has run away.
_MOST_CALLS = 300_000

LAWS = {"rice-ruina": RiceRuina, "elasto-plastic": ElastoPlastic}
Numbers = dict[str, np.ndarray]


def draw(law: str, count: int, seed: int) -> Numbers:
    """Operating points (SI) over the whole range of the package, each (count,)."""
    random = np.random.default_rng(seed)
    spread = partial(log_uniform, random, size=count)

    numbers = {"mu0": random.uniform(0.4, 0.8, count), "A": spread(0.002, 0.05)}
    numbers |= {"D0": spread(1e-7, 2e-6), "W0": spread(3.0, 16.0), "V0": np.full(count, 1e-6)}
    numbers["B"] = numbers["A"] * spread(1.15, 4.0)
    critical = (numbers["B"] - numbers["A"]) * numbers["W0"] / numbers["D0"]
    numbers |= {"K": critical * spread(0.1, 100.0), "V": spread(1e-9, 1e-3)}
    numbers |= {"epsilon": random.uniform(0, 0.9, count), "f": spread(1e-5, 1e4)}
    if law == "elasto-plastic":
        numbers["lambda_"] = spread(5e-8, 2e-6)
    return numbers


def slider_of(law: str, numbers: Numbers) -> Slider:
    """Sliders of the points."""
    kind = LAWS[law]
    parameters = {f.name: numbers[f.name] for f in dataclasses.fields(kind)}
    return Slider(kind(**parameters), spring=numbers["K"], load=numbers["W0"])


def problem_of(law: str, numbers: Numbers) -> Problem:
    """Equations and load of the points."""
    drive = {"velocity": numbers["V"], "epsilon": numbers["epsilon"], "frequency": numbers["f"]}
    return flatten(checked_problem(slider_of(law, numbers), **drive))[0]


def answer(
    law: str, numbers: Numbers, samples: int, methods: tuple[str, ...] = CHOICES
) -> PeriodicResponse:
    """Response of the package at the points, with waveforms."""
    return periodic_response(
        slider_of(law, numbers),
        velocity=numbers["V"],
        epsilon=numbers["epsilon"],
        frequency=numbers["f"],
        waveform=samples,
        workers=1,
        methods=methods,
    )


def faults(
    numbers: Numbers, waveform: np.ndarray, mean: np.ndarray, harmonics: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Which points contradict the equations, and which are resolved by their samples.

    Parameters
    ----------
    numbers : dict
        As `draw` returns them.
    waveform : array, shape (2, points, samples)
        F/W0 and ln(slip rate/V).
    mean : array, shape (points,)
        Mean of F/W0.
    harmonics : array, shape (points, count), complex
        Harmonics of F/W0.

    Returns
    -------
    wrong, resolved : bool array, shape (points,)
        A point that is not resolved is not marked as wrong.
    """
    n = {name: a[:, None] for name, a in numbers.items()}
    wrong, resolved = np.zeros((2, waveform.shape[1]), dtype=bool)
    for step in (8, 4, 2, 1):  # the fewest samples that resolve: more of them amplify round-off
        friction, log_slip = waveform[..., ::step]
        residual, end = _residuals(n, friction, log_slip)
        swing = np.ptp(friction, axis=1)
        spectrum = 2 * np.fft.rfft(friction)[:, 1 : 1 + harmonics.shape[1]] / friction.shape[1]
        fault = residual > RESIDUAL
        fault |= np.abs(np.exp(log_slip).mean(1) - 1) > SLIP
        fault |= np.abs(spectrum - harmonics).max(1) > HARMONICS * swing
        fault |= np.abs(friction.mean(1) - mean) > HARMONICS * swing + 1e-14
        now = ~resolved & (end < RESOLVED)
        wrong[now], resolved[now] = fault[now], True
    return wrong, resolved


def faults_marched(
    numbers: Numbers, waveform: np.ndarray, mean: np.ndarray, harmonics: np.ndarray
) -> np.ndarray:
    """Which points contradict the equations, by SciPy from sample to sample.

    For pulses too narrow for `faults`, whose arguments it has. The printed equations are integrated
    from sample to sample, selected so that states change little between them. At each sample slip
    rate and age must be those of the waveform; mean and harmonics are integrated along.
    """
    return np.array(
        [
            _is_wrong({k: float(a[i]) for k, a in numbers.items()}, *waveform[:, i], *answer)
            for i, answer in enumerate(zip(mean, harmonics, strict=True))
        ],
        dtype=bool,
    )


def _is_wrong(
    n: dict[str, float],
    friction: np.ndarray,
    log_slip: np.ndarray,
    mean: float,
    harmonics: np.ndarray,
) -> bool:
    numbers = (friction, log_slip, mean, harmonics)
    if not all(np.isfinite(a).all() for a in numbers):
        return True
    omega, samples = 2 * np.pi * n["f"], len(friction)
    gain = n["V"] * n["K"] / (omega * n["W0"])
    elastic = n.get("lambda_", 0.0) * n["K"] / n["W0"]
    orders, calls = np.arange(1, len(harmonics) + 1), itertools.count()

    def slip_of(w: float, force: float, phi: float) -> float:
        rate = (force / w - n["mu0"] - n["B"] * phi) / n["A"]
        return np.exp(rate) * n["V0"] / n["V"]

    def rates(theta: float, y: np.ndarray) -> np.ndarray:
        force, phi = base + y[0], y[1]
        w, dw = 1 + n["epsilon"] * np.cos(theta), -n["epsilon"] * np.sin(theta)
        slip = slip_of(w, force, phi)
        pull = gain * (1 - slip) + elastic * force * dw / w**2
        d_force = pull / (1 + elastic / w)
        v = 1 - d_force / gain
        ageing = (n["V0"] * np.exp(-phi) - n["V"] * v) / (n["D0"] * omega)
        if (count := next(calls)) > _MOST_CALLS:
            raise RuntimeError(f"no end after {count} calls")
        waves = y[0] * np.exp(-1j * orders * theta)
        return np.hstack([d_force, ageing, slip - 1, y[0], waves.real, waves.imag])

    theta = 2 * np.pi * np.arange(samples + 1) / samples
    load = 1 + n["epsilon"] * np.cos(theta)
    phi = _age(n, load[:-1], friction, log_slip)
    base, gap, integrals = friction.mean(), 0.0, np.zeros(2 + 2 * len(orders))
    states = np.stack([log_slip, phi])
    path = np.abs(np.diff(states, append=states[:, :1])).sum(0)
    # Samples are at most a hundredth of the period and the time of ageing apart, in which a
    # disturbance grows by a few e; between them the states change by about a quarter.
    least = max(_LEAST, 2 * np.pi * n["V"] / (n["D0"] * omega))
    passed = np.floor(np.cumsum(path) / _CHANGE + np.arange(samples) * least / samples)
    nodes = np.flatnonzero(np.diff(passed, prepend=-1.0))
    for k, after in zip(nodes, [*nodes[1:], samples], strict=True):
        start = np.hstack([friction[k] - base, phi[k], np.zeros_like(integrals)])
        span, calls = (theta[k], theta[after]), itertools.count()
        try:
            run = solve_ivp(rates, span, start, "LSODA", rtol=1e-9, atol=1e-12)
        except RuntimeError:
            return True
        if not run.success:
            return True
        end, following = run.y[:, -1], after % samples
        arrived = np.log(slip_of(load[after], base + end[0], end[1]))
        # Gaps are added up, as an error spread over the period is small between two samples.
        gap += abs(arrived - log_slip[following]) + abs(end[1] - phi[following])
        integrals += end[2:] / (2 * np.pi)
    cosines, sines = np.split(integrals[2:], 2)
    swing = np.ptp(friction)
    error = np.abs(2 * (cosines + 1j * sines) - harmonics).max()
    error = max(error, abs(base + integrals[1] - mean))
    return bool(gap > RESIDUAL or abs(integrals[0]) > SLIP or error > HARMONICS * swing)


def _derivative(y: np.ndarray) -> np.ndarray:
    """d/dtheta of periodic samples."""
    k = np.arange(y.shape[-1] // 2 + 1)
    return np.fft.irfft(1j * k * np.fft.rfft(y), y.shape[-1])


def _age(n: Numbers, w: np.ndarray, friction: np.ndarray, log_slip: np.ndarray) -> np.ndarray:
    """ln(V0 Phi/D0) from the friction law."""
    rate = n["A"] * (log_slip + np.log(n["V"] / n["V0"]))
    return (friction / w - n["mu0"] - rate) / n["B"]


def _residuals(
    n: Numbers, friction: np.ndarray, log_slip: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Residuals of spring equation and age law, over their largest terms; ends of spectra."""
    samples = friction.shape[1]
    theta = 2 * np.pi * np.arange(samples) / samples
    w, dw = 1 + n["epsilon"] * np.cos(theta), -n["epsilon"] * np.sin(theta)
    omega, slip = 2 * np.pi * n["f"], np.exp(log_slip)
    gain = n["V"] * n["K"] / (omega * n["W0"])
    d_friction = _derivative(friction)
    v = 1 - d_friction / gain  # velocity of the slider over V
    # v_pl = d/dt (x - F lambda/W), over V
    elastic = n["lambda_"] * n["K"] / n["W0"] if "lambda_" in n else 0.0
    strained = elastic / gain * (d_friction / w - friction * dw / w**2)
    # The amplification of the last digit of the force by differentiation is no residual.
    noise = np.finfo(float).eps * samples / 2 * np.abs(friction).max(1) / gain[:, 0]
    spring = np.maximum(np.abs(v - strained - slip).max(1) - noise, 0.0) / slip.max(1)
    phi = _age(n, w, friction, log_slip)
    terms = np.stack(
        [n["V0"] / n["D0"] * np.exp(-phi), -n["V"] / n["D0"] * v, -omega * _derivative(phi)]
    )
    noise = noise * (n["V"] / n["D0"])[:, 0]
    ageing = np.maximum(np.abs(terms.sum(0)).max(1) - noise, 0.0) / np.abs(terms).max((0, 2))
    ends = []
    for term in (slip, np.exp(-phi)):
        spectrum = np.abs(np.fft.rfft(term))
        ends.append(spectrum[:, -samples // 32 :].max(1) / spectrum.max(1))
    return np.maximum(spring, ageing), np.max(ends, axis=0)
