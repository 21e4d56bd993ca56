"""Recordings of velocity steps and holds with faults of laboratories: wrong numbers that are ok.

    python -m benchmarks.hostile_sliding [--recordings 300] [--seed 0]

A slider with the ageing law is pulled at two to five velocities of 0.1 to 100 um/s, with holds of 2
to 200 s, on a spring 1.5 to 30 times as stiff as stable sliding needs, and sampled 1,500 to 60,000
times with noise of 3e-5 to 1e-3 and up to three of the faults of `FAULTS`. The numbers of each step
and hold from `asperity.measure` are compared with the motion without noise, in 95 % intervals.
"""

from __future__ import annotations

import numpy as np

import asperity as asp
from asperity.recording import Channel, Trace
from benchmarks.coverage import integrated
from benchmarks.populations import log_uniform, print_wrong, seeds

FAULTS = (
    "trend", "random walk", "lines", "coarse friction", "coarse displacement", "spikes", "gear",
    "contact displacement", "loading first", "jitter", "gap", "short", "load wanders",
)  # fmt: skip
#: A number is wrong if it is more than this many half widths of its 95 % interval off.
WRONG = 2.0


def motion(random, faults):
    """Numbers of the law and the spring, velocities, and bounds of the parts (s)."""
    A = log_uniform(random, 0.004, 0.02)
    B, D0 = A * random.uniform(0.4, 1.8), log_uniform(random, 1e-6, 3e-5)
    k = max(B - A, 0.2 * A) / D0 * log_uniform(random, 1.5, 30)
    numbers = {"A": A, "B": B, "D0": D0, "k": k, "mu0": 0.6, "V0": 1e-6, "alpha": 0.0}
    velocities = [log_uniform(random, 3e-7, 3e-5)]
    for _ in range(random.integers(1, 4)):
        last = velocities[-1]
        factor = 10 ** random.choice([-1, -0.5, 0.5, 1])
        inside = 1e-7 < last * factor < 1e-4
        step = last * factor if inside else last / factor
        velocities += [0.0, last] if random.random() < 0.35 else [step]
    slips = D0 * (random.uniform(3, 10) if "short" in faults else random.uniform(15, 60))
    # The spring is loaded within A/k.
    slips = slips * (1 + 3 * A / (k * D0)) * random.uniform(0.7, 1.5, len(velocities))
    each = zip(slips, velocities, strict=True)
    spans = [s / v if v else log_uniform(random, 2, 200) for s, v in each]
    return numbers, velocities, np.concatenate([[0.0], np.cumsum(spans)])


def recording(seed):
    """Faults, planted numbers, and the recording."""
    r = np.random.default_rng(seed)
    faults = {str(name) for name in r.choice(FAULTS, r.integers(0, 4), replace=False)}
    numbers, velocities, bounds = motion(r, faults)
    end, k = bounds[-1], numbers["k"]
    rate = max(min(60_000 / end, log_uniform(r, 5, 300)), 1_500 / end)
    time = np.arange(int(end * rate)) / rate
    slip = np.interp(time, bounds, np.concatenate([[0], np.cumsum(velocities * np.diff(bounds))]))
    clean = integrated(numbers, bounds, velocities, time, tolerance=1e-8)
    noise = log_uniform(r, 3e-5, 1e-3)
    friction = clean + noise * r.normal(size=time.size)
    x = slip + log_uniform(r, 1e-9, 3e-7) * r.normal(size=time.size)
    if "trend" in faults:
        friction += 0.02 * r.normal() * slip / slip[-1] + 0.01 * r.normal() * (slip / slip[-1]) ** 2
    if "random walk" in faults:
        walk = np.cumsum(r.normal(size=time.size)) / np.sqrt(time.size)
        friction += log_uniform(r, 3e-4, 5e-3) * walk
    if "lines" in faults:
        for f in rate * log_uniform(r, 0.003, 0.4, 2):
            friction += log_uniform(r, 3e-5, 5e-4) * np.sin(2 * np.pi * f * time)
    if "gear" in faults:
        wave = numbers["D0"] * log_uniform(r, 0.5, 20)
        x += 0.1 * wave * np.sin(slip / wave)
    if "contact displacement" in faults:
        x -= (clean - clean[0]) / k
    if "coarse friction" in faults:
        step = log_uniform(r, 1e-4, 2e-3)
        friction = step * np.round(friction / step)
    if "coarse displacement" in faults:
        step = log_uniform(r, 1e-8, 3e-6)
        x = step * np.round(x / step)
    if "spikes" in faults:
        at = r.choice(time.size, r.integers(1, 15), replace=False)
        size = log_uniform(r, 3e-3, 0.3, at.size)
        friction[at] += r.choice([-1, 1], at.size) * size
    if "loading first" in faults:
        lead = 0.6 / (k * velocities[0])
        before = np.linspace(0, lead, min(max(int(lead * rate), 10), 30_000), endpoint=False)
        loading = clean[0] * before / lead
        friction = np.concatenate([loading + noise * r.normal(size=before.size), friction])
        x = np.concatenate([velocities[0] * (before - lead), x])
        time, clean = np.concatenate([before, time + lead]), np.concatenate([loading, clean])
        bounds = bounds + lead
    recorded_time = time + 0.1 / rate * r.normal(size=time.size) * ("jitter" in faults)
    kept = np.ones(time.size, bool)
    if "gap" in faults:
        first = int(r.uniform(0.1, 0.8) * time.size)
        kept[first : first + int(log_uniform(r, 1, 0.03 * time.size))] = False
    channels = {"slip": Channel(x[kept], "length", "m", "slip", "m")}
    if "load wanders" in faults:
        W = 2e7 * (1 + 0.01 * np.sin(2 * np.pi * time / end * r.uniform(0.3, 3)))
        channels["W"] = Channel(W[kept], "pressure", "Pa", "normal stress", "Pa")
        channels["F"] = Channel((friction * W)[kept], "pressure", "Pa", "shear stress", "Pa")
    else:
        channels["friction"] = Channel(friction[kept], "dimensionless", "", "friction", "")
    planted = numbers["A"] - numbers["B"], velocities, bounds, time, clean
    return faults, planted, Trace(recorded_time[kept], channels)


def judged(seed):
    """Verdict, and errors of A - B and of healing in half widths of their 95 % intervals."""
    faults, (change, velocities, bounds, time, clean), trace = recording(seed)
    measurement = asp.measure(trace, modulated=False)
    row = {"seed": seed, "faults": sorted(faults), "verdict": measurement.verdict, "errors": []}
    for step in measurement.steps:
        at = int(np.argmin(np.abs(bounds[1:-1] - step.time)))
        slower, faster = sorted(velocities[at : at + 2])
        if slower and faster and slower / 1.2 < step.velocity_before < 1.2 * faster:
            error = (step.rate_dependence - change) / step.rate_interval_95
            row["errors"].append(("A - B", float(error)))
    # With a trend or a random walk the planted healing is not that of the recording.
    for hold in measurement.holds if not faults & {"trend", "random walk"} else ():
        at = int(np.argmin(np.abs(bounds[:-1] - hold.start)))
        if velocities[at] or not 0.8 < hold.hold_time / (bounds[at + 1] - bounds[at]) < 1.2:
            continue
        after = (time >= bounds[at + 1]) & (time <= bounds[at + 2])
        level = float(clean[time <= bounds[at]][-1])
        error = (hold.healing - (clean[after].max() - level)) / hold.interval_95
        row["errors"].append(("healing", float(error)))
    return row


def main():
    """Print how often intervals contain the truth with verdict ok, and the wrong numbers."""
    rows = [judged(k) for k in seeds(__doc__, 300)]
    good = [row for row in rows if row["verdict"] == "ok"]
    print(f"{len(good)} of {len(rows)} are ok")
    for name in ("A - B", "healing"):
        errors = np.abs([z for row in good for which, z in row["errors"] if which == name])
        print(f"{name}: {np.mean(errors < 1):.1%} of {errors.size} within the 95 % interval")
    for row in good:
        wrong = [(name, round(z, 1)) for name, z in row["errors"] if abs(z) > WRONG]
        if wrong:
            print_wrong(row["seed"], row["faults"], wrong)


if __name__ == "__main__":
    main()
