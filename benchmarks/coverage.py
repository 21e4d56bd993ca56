"""Coverage of intervals of fits to recordings: the share that contains the true value.

``python -m benchmarks.coverage [--sets 200] [--case steps|holds|loads] [--residual FILE]
[--stiff K]``

Recordings are computed by SciPy (LSODA, relative tolerance 1e-11) from the printed equations, with
noise like that of real recordings: white, correlated over half a second and over eight, and a line.
Each is fitted by `asperity.inference.fit` twice, the second time with white noise of the size of
the residuals, as by least squares with its covariance. The share of 68 and 95 % intervals that
contain the truth is printed for both. With ``--residual`` the noise is that of a real recording,
velstep1_TR2_exp013_sepiolite.txt. ``--stiff 3e5`` is a machine of that stiffness over the load
(1/m), whose spring relaxes between two samples: the velocities change at random times between
samples, and the noise is white.
"""

from __future__ import annotations

import argparse
import json
import time as clock
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.signal import lfilter

from asperity.inference import RecordedRun, RunOptions, fit, recorded_run
from asperity.recording import Channel, Trace
from benchmarks.populations import inside

TRUTH = {"mu0": 0.6, "A": 0.009, "B": 0.0105, "D0": 6.5e-6, "V0": 3e-6, "alpha": 0.2}
#: Stiffness over the load (1/m), and the load (Pa).
STIFFNESS, LOAD = 4e3, 2e7
#: Standard deviation of the noise, that of the residual of a fit to 3 to 10 um/s on basalt (10 and
#: 100 samples a second).
NOISE = 8e-4
#: Standard deviation of a load that changes, over the load.
LOAD_NOISE = 2e-4
#: Standard deviation of the white noise of stiff machines.
STIFF_NOISE = 2e-4
#: Window (s) of the recording whose residual is resampled.
WINDOW = (10000, 10800)


@dataclass(frozen=True)
class Case:
    """A programme of the drive: velocities (m/s), times of their changes (s), and W/W0."""

    velocities: tuple[float, ...]
    changes: tuple[float, ...]
    end: float
    rate: float
    loads: tuple[tuple[float, float], ...] = ((0.0, 1.0),)

    @property
    def law(self) -> str:
        """Law of the fit, with alpha if the load changes."""
        return "linker-dieterich" if len(self.loads) > 1 else "rice-ruina"

    @property
    def true(self) -> dict[str, float]:
        """True values of the parameters whose intervals are counted."""
        names = ("A", "B", "D0", *(("alpha",) if len(self.loads) > 1 else ()))
        return {**{n: TRUTH[n] for n in names}, "K": STIFFNESS * LOAD}

    def load(self, time: np.ndarray) -> np.ndarray:
        """W/W0, linear between the given times."""
        return np.interp(time, *np.array(self.loads).T)

    def slip(self, time: np.ndarray) -> np.ndarray:
        """Displacement of the drive (m)."""
        edges = np.array([0.0, *self.changes, self.end])
        moved = np.cumsum(np.array(self.velocities) * np.diff(edges))
        return np.interp(time, edges, [0.0, *moved])


CASES = {
    "steps": Case((3e-6, 1e-5, 3e-6), (40.0, 80.0), 140.0, 10.0),
    "holds": Case((1e-5, 0.0, 1e-5, 0.0, 1e-5), (20.0, 30.0, 50.0, 80.0), 110.0, 10.0),
    # Load steps of 10 % within half a second, and a velocity step for A and B.
    "loads": Case(
        (3e-6, 1e-5),
        (90.0,),
        140.0,
        10.0,
        ((30.0, 1.0), (30.5, 1.1), (60.0, 1.1), (60.5, 1.0)),
    ),
}


def friction(case: Case, time: np.ndarray) -> np.ndarray:
    """Friction of the ageing law at the samples, by SciPy."""
    changes = sorted({*case.changes, *(t for t, _ in case.loads if t > 0)})
    edges = [0.0, *changes, case.end]
    velocities = [
        case.velocities[np.searchsorted(case.changes, (a + b) / 2)] for a, b in pairwise(edges)
    ]
    share = TRUTH["alpha"] if len(case.loads) > 1 else 0.0
    numbers = TRUTH | {"k": STIFFNESS, "alpha": share}
    return integrated(numbers, edges, velocities, time, case.load)


def integrated(
    numbers: Mapping[str, float],
    edges: Sequence[float],
    velocities: Sequence[float],
    time: np.ndarray,
    load: Callable[[Any], Any] = np.ones_like,
    tolerance: float = 1e-11,
    start: tuple[float, float] = (0.0, 0.0),
) -> np.ndarray:
    """F/W of the ageing law at times by SciPy; the motion starts in steady sliding plus `start`.

    The numbers are mu0, A, B, D0, V0, alpha and k = K/W0. The velocity of the drive is constant
    between the edges (s), and W/W0 is `load` of the time.
    """
    mu0, A, B, D0, V0, alpha, k = (numbers[n] for n in ("mu0", "A", "B", "D0", "V0", "alpha", "k"))

    def rhs(t: float, y: np.ndarray, V: float) -> list[float]:
        # y[1] + alpha/B ln w is the logarithm of the age, by Linker and Dieterich.
        w = load(t)
        log_age = y[1] - alpha / B * np.log(w)
        v = V0 * np.exp((y[0] / w - mu0 - B * log_age) / A)
        return [k * (V - v), (V0 * np.exp(-log_age) - v) / D0]

    first = np.log(velocities[0] / V0)
    y = np.array([mu0 + (A - B) * first, -first]) + start
    out = np.empty_like(time)
    for V, (a, b) in zip(velocities, pairwise(edges), strict=True):
        here = (time >= a) & ((time < b) | (b == edges[-1]))
        solution = solve_ivp(
            rhs, (a, b), y, method="LSODA", rtol=tolerance, atol=tolerance / 100,
            dense_output=True, args=(V,),
        )  # fmt: skip
        out[here] = solution.sol(time[here])[0] / load(time[here])
        y = solution.y[:, -1]
    return out


def trace_of(
    time: np.ndarray, mu: np.ndarray, slip: np.ndarray, load: np.ndarray | None = None
) -> Trace:
    """A recording of friction, displacement (m) and perhaps normal stress (Pa)."""
    channels = {
        "friction": Channel(mu, "dimensionless", "", "friction", ""),
        "displacement": Channel(slip, "length", "m", "displacement", "m"),
    }
    if load is not None:
        channels["normal_stress"] = Channel(load, "pressure", "Pa", "ns", "Pa")
    return Trace(time, channels)


def wander(white: np.ndarray, start: float, steps: float) -> np.ndarray:
    """Noise of unit variance with a correlation over `steps` samples, from white noise."""
    a = np.exp(-1 / steps)
    return np.asarray(lfilter([1.0], [1.0, -a], white * np.sqrt(1 - a * a), zi=[a * start])[0])


def coloured(random: np.random.Generator, n: int, rate: float) -> np.ndarray:
    """Noise like that of real gauges: white, correlated over 0.5 s and 8 s, and a line."""
    white = random.normal(size=n)
    t = np.arange(n) / rate
    line = np.sqrt(2) * np.cos(2 * np.pi * (1.37 * t + random.random()))
    quick, slow = (
        wander(start=random.normal(), white=random.normal(size=n), steps=rate * tau)
        for tau in (0.5, 8.0)
    )
    return NOISE * (0.7 * white + 0.5 * quick + 0.4 * slow + 0.2 * line)


def resampled(path: Path) -> Callable[[np.random.Generator, int, float], np.ndarray]:
    """Noise with the spectrum of the residual of a fit to a real recording, at its sampling rate.

    The phases of the whole residual are random, and a part of the noise is taken, scaled to the
    standard deviation `NOISE`.
    """
    run = recorded_run(path, window=WINDOW)
    result = fit(run, "rice-ruina", ["A", "B", "D0"], starts=16)
    residual = run.friction - result.objective.terms[0].fitted_friction(result.values)
    amplitudes = np.abs(np.fft.rfft(residual - residual.mean()))

    def noise(random: np.random.Generator, n: int, rate: float) -> np.ndarray:
        phases = np.exp(2j * np.pi * random.random(amplitudes.size))
        whole = np.fft.irfft(amplitudes * phases, residual.size)
        first = random.integers(0, residual.size - n + 1)
        return NOISE * whole[first : first + n] / residual.std()

    return noise


def runs_of(
    case: Case,
    sets: int,
    seed: int = 0,
    noise: Callable[[np.random.Generator, int, float], np.ndarray] | None = None,
) -> Iterator[RecordedRun]:
    """Recordings of one motion with different noise."""
    time = np.arange(int(case.end * case.rate)) / case.rate
    clean = friction(case, time)
    slip = case.slip(time)
    for k in range(sets):
        random = np.random.default_rng([seed, k])
        noisy = clean + (noise or coloured)(random, time.size, case.rate)
        displacement = slip + 2e-8 * random.normal(size=time.size)
        load = LOAD * case.load(time)
        if len(case.loads) > 1:
            load += LOAD_NOISE * LOAD * random.normal(size=time.size)
        yield recorded_run(trace_of(time, noisy, displacement, load), name="run")


def runs_of_stiff(case: Case, sets: int, seed: int = 0) -> Iterator[RecordedRun]:
    """Recordings in white noise whose velocities change at random times between two samples."""

    def white(random: np.random.Generator, n: int, rate: float) -> np.ndarray:
        return STIFF_NOISE * random.normal(size=n)

    for k in range(seed, seed + sets):
        late = np.random.default_rng([99, k]).uniform(0, 1 / case.rate, len(case.changes))
        changes = tuple((np.array(case.changes) + late).tolist())
        yield from runs_of(replace(case, changes=changes), 1, 1000 + k, white)


TRUE = CASES["steps"].true


def covered(
    runs: Iterable[RecordedRun], case: Case, options: RunOptions | None = None, starts: int = 4
) -> dict[str, Any]:
    """Shares of intervals that contain the truth, and means of their widths, by parameter."""
    true = case.true
    hits = {n: np.zeros(2) for n in true}
    widths: dict[str, list[float]] = {n: [] for n in true}
    errors: dict[str, list[float]] = {n: [] for n in true}
    failed, noise_rejected, done = 0, 0, 0
    begun = clock.perf_counter()
    for run in runs:
        result = fit(
            run,
            case.law,
            [n for n in true if n != "K"],
            start=true,
            runs=options,
            starts=starts,
        )
        if not result.converged:
            failed += 1
            continue
        done += 1
        noise_rejected += any("noise" in w for w in result.warnings)
        for n, within in inside(result.parameters, true).items():
            p, truth = result.parameters[n], true[n]
            hits[n] += within
            widths[n].append(p.se / truth)
            errors[n].append(p.value / truth - 1)
    return {
        "sets": done,
        "failed": failed,
        "noise_warnings": noise_rejected,
        "seconds": clock.perf_counter() - begun,
        "parameters": {
            n: {
                "cover_68": hits[n][0] / max(done, 1),
                "cover_95": hits[n][1] / max(done, 1),
                "mean_se": float(np.mean(widths[n])),
                "scatter": float(np.std(errors[n])),
                "bias": float(np.mean(errors[n])),
            }
            for n in true
        },
    }


def print_shares(name: str, result: dict[str, Any]) -> None:
    """A line for each parameter of a result of `covered`."""
    for n, row in result["parameters"].items():
        print(
            f"{name} {n:3} 68 %: {100 * row['cover_68']:5.1f}  95 %: {100 * row['cover_95']:5.1f}  "
            f"se {row['mean_se']:.3g} scatter {row['scatter']:.3g} bias {row['bias']:+.2g}",
            flush=True,
        )


def main() -> None:
    """Print the table of both kinds of intervals."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sets", type=int, default=200)
    parser.add_argument("--case", choices=list(CASES), action="append")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--stiff", type=float, metavar="K", help="stiffness over the load (1/m)")
    parser.add_argument("--white-only", action="store_true")
    parser.add_argument("--coloured-only", action="store_true")
    parser.add_argument("--residual", type=Path, metavar="FILE", help="of the sepiolite step")
    arguments = parser.parse_args()
    noise = resampled(arguments.residual) if arguments.residual else None
    if arguments.stiff:
        global STIFFNESS
        STIFFNESS = arguments.stiff
    for name in arguments.case or list(CASES):
        ways = {"autoregressive": RunOptions(), "white": RunOptions(order=0)}
        if arguments.white_only:
            ways.pop("autoregressive")
        if arguments.coloured_only:
            ways.pop("white")
        for way, options in ways.items():
            case = CASES[name]
            which = (case, arguments.sets, arguments.seed)
            runs = runs_of_stiff(*which) if arguments.stiff else runs_of(*which, noise)
            result = covered(runs, case, options)
            print(json.dumps({"case": name, "noise": way, **result}), flush=True)
            print_shares(f"{name:6} {way:14}", result)


if __name__ == "__main__":
    main()
