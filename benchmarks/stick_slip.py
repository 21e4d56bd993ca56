"""Measurements of simulated stick-slip: false and missed events, coverage, campaigns, speed.

    python -m benchmarks.stick_slip [--recordings 200] [--campaigns 20] [--healing 40] [--seed 0]

Recordings are straight loading and slips of a free slider at constant friction, with noise of 1 to
30 % of the drop, white or correlated, impulses, small events among large ones, a gauge that rings,
creep, and a friction level that drifts along the track, each drawn at random;
`benchmarks.stick_slip_recordings` defines a fault. Campaigns are motions of a slider with inertia
at stiffnesses and velocities on both sides of the threshold, from which the steps of the paper
determine A, B and D0. Printed are the errors over standard errors of these, of K/W0 at the
threshold (mean over velocities) and of each frequency there. Healing is B - A from recordings of
one machine at four velocities, each a repeated limit cycle with inertia, with noise of 1 to 10 % of
the drop and drops that spread by up to 10 %.
"""

import argparse
import time as clock
from pathlib import Path

import numpy as np

from asperity import Slider, laws
from asperity.inference import table_of
from asperity.loads import Programme, Slide
from asperity.measurement.stick_slip.campaign import StickSlipCampaign
from asperity.measurement.stick_slip.catalogue import stick_slip_row
from asperity.measurement.stick_slip.measure import measure_stick_slip
from asperity.measurement.stick_slip.threshold import thresholds
from asperity.questions.recording import Measurement
from asperity.transients import transient
from asperity.transients.limit_cycle import CycleEnd, limit_cycle
from benchmarks.stick_slip_recordings import (
    judged,
    random_saw,
    repeated,
    saw,
    tables,
    trace_of,
)


def campaign_numbers(seed):
    """Errors of A, B and D0 by the steps of the paper over standard errors; a random campaign."""
    from asperity_papers.bureau2000.recipe import THRESHOLD_COLUMNS, Thresholds, paper_procedure

    rng = np.random.default_rng([seed, 2])
    A = rng.uniform(0.01, 0.02)
    truth = {"A": A, "B": A * rng.uniform(1.5, 2.5), "D0": rng.uniform(3e-7, 8e-7)}
    law, W0 = laws.RiceRuina(mu0=rng.uniform(0.3, 0.6), V0=1e-6, **truth), 7.0
    critical = (truth["B"] - A) * W0 / truth["D0"]
    # Springs at equal ratios; the threshold lies anywhere between two of them.
    springs = critical * rng.uniform(1, 1.3) * 1.3 ** np.arange(-3.0, 3.0)
    rows = []
    for V in (1e-6, 1e-5, 1e-4):
        for K in springs:
            slider = Slider(law, spring=K, load=W0, mass=1e-3)
            seconds = 500 * truth["D0"] / V
            drive = Programme(Slide(duration=seconds, velocity=V), load=W0, velocity=V / 2)
            motion = transient(slider, drive, sampling=2e4 / seconds, inertia=True, rtol=1e-6)
            friction = motion.force / W0 + 5e-4 * rng.standard_normal(motion.force.size)
            trace = trace_of(motion.time, friction)
            machine = Measurement(stiffness=float(K), velocity=V, normal_load=W0)
            rows.append(stick_slip_row(Path("made"), measure_stick_slip(trace, machine)))
    ends = [end for end in thresholds(rows) if not end.reason]
    level = [row for row in rows if row["kind"] == "level"]
    columns = {n: [row[n] for row in level] for n in ("V", "K", "mean_friction", "epsilon")}
    columns["mean_friction_err"] = [row["mean_friction_uncertainty"] for row in level]
    if not ends:
        return dict.fromkeys((*truth, "K/W0", "frequency"), np.nan)
    bifurcations = {n: [getattr(end, n) for end in ends] for n in THRESHOLD_COLUMNS}
    result = paper_procedure(table_of(columns), Thresholds("made", **bifurcations))
    numbers = {n: (result.numbers[n].value - truth[n]) / result.numbers[n].se for n in truth}
    # Errors of K/W0 are common to all velocities; those of the frequencies are independent.
    limit = critical / W0
    numbers["K/W0"] = np.mean([(end.K_over_W0 - limit) / end.K_over_W0_err for end in ends])
    root = np.sqrt((truth["B"] - A) / A) / (2 * np.pi * truth["D0"])
    numbers["frequency"] = [
        float((end.frequency - end.V * root) / end.frequency_err) for end in ends
    ]
    return numbers


def healing_interval(seed):
    """Ends of the 95 % interval of B - A over the truth, and a reason if there is no interval."""
    rng = np.random.default_rng([seed, 3])
    A = rng.uniform(0.008, 0.02)
    difference, D0, W0 = A * rng.uniform(0.3, 2.0), 10 ** rng.uniform(-6.7, -5.0), 5.0
    K = difference * W0 / D0 * 10 ** rng.uniform(-1.3, -0.3)
    V = 10 ** rng.uniform(-6, -5) * 10 ** np.linspace(0, rng.uniform(0.6, 1.5), 4)
    M = A * D0 * W0 / V.max() ** 2 * 10 ** rng.uniform(-3, 0)
    law = laws.RiceRuina(mu0=0.5, V0=1e-6, A=A, B=A + difference, D0=D0)
    noise, spread, rows = 10 ** rng.uniform(-2, -1), rng.choice([0, 0.03, 0.1]), []
    for v in V:
        cycle = limit_cycle(Slider(law, spring=K, load=W0, mass=M), float(v))
        if cycle.end is not CycleEnd.REPEATS:
            continue
        step = max(cycle.slip_duration / 10, cycle.period / 5000)
        t, force = repeated(cycle, 30, step, rng, spread)
        force = force + noise * cycle.drop * rng.standard_normal(t.size)
        trace = trace_of(t, force)
        machine = Measurement(stiffness=float(K), velocity=float(v), mass=float(M), normal_load=W0)
        rows.append(stick_slip_row(Path("made"), measure_stick_slip(trace, machine)))
    if not rows:
        return np.nan, np.nan, "no limit cycle"
    (series,) = StickSlipCampaign.of(rows).series
    healing = series.healing()
    return *(end / difference for end in healing.b_minus_a), healing.reason


def main():
    """Print the results of recordings, campaigns and healing, and the time of a long recording."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--recordings", type=int, default=200)
    parser.add_argument("--campaigns", type=int, default=20)
    parser.add_argument("--healing", type=int, default=40)
    parser.add_argument("--seed", type=int, default=0)
    chosen = parser.parse_args()
    seeds = range(chosen.seed, chosen.seed + chosen.recordings)
    print("\n".join(tables([{"seed": k} | judged(random_saw(k)) for k in seeds])))
    for seed in range(chosen.seed, chosen.seed + chosen.campaigns):
        numbers = campaign_numbers(seed).items()
        words = (f"{n} {' '.join(f'{one:+.2f}' for one in np.atleast_1d(z))}" for n, z in numbers)
        print(f"| campaign {seed} | " + " | ".join(words), flush=True)
    for seed in range(chosen.seed, chosen.seed + chosen.healing):
        low, high, reason = healing_interval(seed)
        cell = reason or f"{low:.2f} to {high:.2f} times the truth"
        print(f"| B - A {seed} | {cell} |", flush=True)
    long = saw(0, events=1500, cycle=480, spread=0.2)
    start = clock.perf_counter()
    measure_stick_slip(long.trace())
    print(f"| {long.force.size} samples | {clock.perf_counter() - start:.2f} s |")


if __name__ == "__main__":
    main()
