"""Fits of simulated regular stick-slip: share of 95 % intervals with the truth, and their time.

    python -m benchmarks.stick_slip_fits [--recordings 40] [--seed 0] [--free B,D0] [--spread 0]
        [--velocities 1]

Each recording repeats the limit cycle of a Rice-Ruina law with inertia 40 times, with white noise
of 1 to 10 % of the drop. A, B, D0, K, V, M, the sampling rate and the noise are drawn at random.
With `--spread` the drops differ by this share: the law has no such cycles, and the fit must warn.
With `--velocities 2` a second recording at eight times the velocity is fitted together with it.
"""

import argparse
import time

import numpy as np

from asperity import Slider
from asperity.inference import averaged_cycle, fit
from asperity.laws import RiceRuina
from asperity.measurement.stick_slip.measure import measure_stick_slip
from asperity.questions.recording import Measurement
from asperity.transients.limit_cycle import CycleEnd, limit_cycle
from benchmarks.populations import inside
from benchmarks.stick_slip_recordings import repeated, trace_of

W0, CYCLES = 1.0, 40


def random_machine(rng):
    """Numbers of a law and a machine with stick-slip, and the velocity (m/s)."""
    A = rng.uniform(0.006, 0.02)
    B, D0 = A * rng.uniform(1.2, 1.8), 10 ** rng.uniform(-6.5, -5.3)
    K = (B - A) * W0 / D0 * 10 ** rng.uniform(-1.5, -0.5)
    V = 10 ** rng.uniform(-5, -3.5)
    # The slip lasts 1 to 3 % of the time that loads the spring by ten times (B - A) W0.
    M = K * (rng.uniform(0.01, 0.03) * 10 * (B - A) * W0 / (K * V) / np.pi) ** 2
    return {"A": A, "B": B, "D0": D0, "K": K, "M": M}, V


def averaged(truth, V, V0, rng, spread=0.0):
    """The averaged cycle of a recording at a velocity; None if there is no stick-slip."""
    law = RiceRuina(mu0=0.5, V0=V0, A=truth["A"], B=truth["B"], D0=truth["D0"])
    cycle = limit_cycle(Slider(law, spring=truth["K"], load=W0, mass=truth["M"]), V)
    if cycle.end is not CycleEnd.REPEATS:
        return None
    step = cycle.slip_duration / rng.uniform(10, 40)
    t, force = repeated(cycle, CYCLES, step, rng, spread)
    noise = 10 ** rng.uniform(-2, -1) * cycle.drop
    trace = trace_of(t, force + noise * rng.standard_normal(t.size))
    return averaged_cycle(
        measure_stick_slip(trace, Measurement(velocity=V, normal_load=W0)), f"{V:.3g} m/s"
    )


def judged(seed, free, spread, velocities):
    """Whether each interval contains the truth, its width, and the processor time of the fit."""
    rng = np.random.default_rng([seed, 5])
    truth, V = random_machine(rng)
    cycles = [averaged(truth, V * 8**i, V, rng, spread) for i in range(velocities)]
    if any(cycle is None for cycle in cycles):
        return None
    fixed = {n: v for n, v in truth.items() if n not in free}
    start = time.process_time()
    result = fit(cycles, "rice-ruina", free, fixed={**fixed, "V0": V}, starts=16)
    within = inside(result.parameters, {name: truth[name] for name in free})
    return {
        "seed": seed,
        "inside": {name: whole for name, (_, whole) in within.items()},
        "width": {
            n: float(np.log(p.interval_95[1] / p.interval_95[0])) if p.interval_95[0] else np.inf
            for n, p in result.parameters.items()
        },
        "undetermined": result.undetermined,
        "p": result.p_value,
        "irregular": any("irregular cycles" in text for text in result.warnings),
        "seconds": time.process_time() - start,
    }


def main():
    """Print each recording, then how often the intervals contain the truth."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--recordings", type=int, default=40)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--free", default="B,D0")
    parser.add_argument("--spread", type=float, default=0.0)
    parser.add_argument("--velocities", type=int, default=1)
    chosen = parser.parse_args()
    free = chosen.free.split(",")
    rows = []
    for seed in range(chosen.seed, chosen.seed + chosen.recordings):
        row = judged(seed, free, chosen.spread, chosen.velocities)
        if row is None:
            print(f"| {seed} | no regular stick-slip |", flush=True)
            continue
        rows.append(row)
        print(
            f"| {seed} | " + " | ".join(f"{k} {v}" for k, v in row.items() if k != "seed") + " |",
            flush=True,
        )
    for name in free:
        count = sum(row["inside"][name] for row in rows)
        width = np.median([row["width"][name] for row in rows])
        print(f"| {name} | in {count} of {len(rows)} | median width {width:.3g} of a logarithm |")
    print(
        f"| warned of irregular cycles | {sum(row['irregular'] for row in rows)} of {len(rows)} |"
    )
    print(f"| p below 0.01 | {sum(row['p'] < 0.01 for row in rows)} of {len(rows)} |")
    print(f"| seconds of processor time | {np.median([row['seconds'] for row in rows]):.3g} |")


if __name__ == "__main__":
    main()
