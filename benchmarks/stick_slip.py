"""Stick-slip recordings of known truth, read: false and missed events, coverage, speed.

    python -m benchmarks.stick_slip [--recordings 200] [--campaigns 20] [--healing 40] [--seed 0]

Recordings are straight loading and slips of a free slider at constant friction, with noise of 1 to
30 % of the drop, white or correlated, impulses, small events among large ones, a gauge that rings,
creep, and a friction level that drifts along the track, each drawn at random. An answer is wrong
where more than 2 % of the events are false, more than 5 % of those above the stated threshold are
missed, or the mean drop is off by more than 5 %; it is flagged where a check is not ok.
Campaigns are motions
of a slider with inertia over K and V on both sides of the threshold, measured and given to the
paper's own steps: columns are A, B and D0, and the mean over the velocities of K/W0 and each
frequency at the threshold, less their truth over their standard errors. Healing is B - A from
recordings of one machine at four velocities, each a limit cycle with inertia over and over, with
noise of 1 to 10 % of the drop and cycles whose sizes spread by up to 10 %.
"""

import argparse
import time as clock
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import brentq
from scipy.signal import lfilter

from asperity import Slider, laws
from asperity.inference import table_of
from asperity.loads import Programme, Slide
from asperity.measurement.stick_slip.campaign import StickSlipCampaign
from asperity.measurement.stick_slip.catalogue import stick_slip_row
from asperity.measurement.stick_slip.measure import Machine, measure_stick_slip
from asperity.measurement.stick_slip.threshold import thresholds
from asperity.recording import Channel, Trace
from asperity.transients import transient
from asperity.transients.limit_cycle import CycleEnd, limit_cycle

RATE = 2000.0


@dataclass(frozen=True)
class Saw:
    """A recording and what it is made of.

    Attributes
    ----------
    force : array, (n,)
        F/W, sampled at `RATE`.
    onset, end : array, (k,)
        Times (s) of each slip.
    drop : array, (k,)
    loading_slope : float
        1/s.
    """

    force: np.ndarray
    onset: np.ndarray
    end: np.ndarray
    drop: np.ndarray
    loading_slope: float

    @property
    def time(self):
        """Seconds."""
        return np.arange(self.force.size) / RATE

    def trace(self):
        """The recording as the program reads it."""
        return Trace(self.time, {"mu": Channel(self.force, "dimensionless", "", "mu", "1")})


def saw(
    seed,
    events=100,
    *,
    cycle=1000,
    slip=20,
    drop=0.1,
    spread=0.0,
    small=0.0,
    small_size=0.2,
    noise=0.05,
    correlation=0.0,
    impulses=0.004,
    wave=0.0,
    ringing=0.0,
    creep=0.0,
):
    """A recording with `events` slips.

    Parameters
    ----------
    cycle, slip : int
        Samples of the stick that loads by `drop`, and of a slip.
    spread : float
        Relative standard deviation of the drops.
    small, small_size : float
        Share of the events that are small, and their size over `drop`.
    noise : float
        Standard deviation over `drop`; an AR(1) process of coefficient `correlation`.
    impulses : float
        Share of the samples that have one, of 0.6 `drop` standard deviation.
    wave : float
        Amplitude over `drop` of a slow wave of friction along the track, 20 cycles long.
    ringing : float
        Amplitude over the drop of the gauge's oscillation after a slip.
    creep : float
        Share of the drop by which the force lags before the onset, over a tenth of the stick.
    """
    rng = np.random.default_rng(seed)
    slope = drop / cycle
    parts = [0.3 + slope * np.arange(cycle // 2)]
    level, at = parts[0][-1], cycle // 2
    onset = []
    for _ in range(events):
        size = max(drop * (1 + spread * rng.standard_normal()), 0.25 * drop)
        if small and rng.random() < small:
            size = small_size * drop
        u = np.arange(1, slip + 1) / slip
        # A free slider at constant friction under the drive: a cosine from -a to pi + a.
        a = brentq(_loaded, 0.0, 1.5, args=(slope * slip / size,))
        fall = (1 - np.cos((np.pi + 2 * a) * u - a) / np.cos(a)) / 2
        parts.append(level - size * fall)
        onset.append(at - 1)
        level -= size
        # Creep takes longer to load.
        stick = (1 + creep) * size / slope * (1 + 0.3 * spread * rng.standard_normal())
        stick = max(int(stick), 8)
        j = np.arange(1, stick + 1)
        loading = level + slope * j
        loading -= creep * size * np.exp((j - stick) / (0.1 * stick))
        ring = 0.0
        if ringing:
            # Six samples long; it has died out after a hundred.
            ring = -ringing * size * np.exp(-j / 20) * np.sin(2 * np.pi * j / 6)
        parts.append(loading + ring)
        level = loading[-1]
        at += slip + stick
    clean = np.concatenate(parts)
    clean = clean + wave * drop * np.sin(2 * np.pi * np.arange(clean.size) / (20.3 * cycle))
    white = rng.standard_normal(clean.size)
    if correlation:
        white = lfilter([np.sqrt(1 - correlation**2)], [1, -correlation], white)
    force = clean + noise * drop * white
    hit = rng.random(clean.size) < impulses
    force = force + 0.6 * drop * rng.standard_normal(clean.size) * hit
    onset = np.array(onset)
    # The wave is part of the drop.
    drops = clean[onset] - clean[onset + slip]
    return Saw(force, onset / RATE, (onset + slip) / RATE, drops, slope * RATE)


def _loaded(angle, share):
    """Zero where the drive loads this share of the drop in a slip from -angle to pi + angle."""
    return (np.pi / 2 + angle) * np.tan(angle) - share


def matched(saw_, events, tolerance=0.02):
    """Indices of true events and of those read that belong together, by their middles."""
    true = (saw_.onset + saw_.end) / 2
    read = (events.onset + events.end) / 2
    if not read.size:
        return np.empty(0, int), np.empty(0, int)
    nearest = np.abs(read[:, None] - true).argmin(0)
    close = np.abs(read[nearest] - true) < tolerance
    return np.flatnonzero(close), nearest[close]


def random_options(seed):
    """Arguments of `saw`, drawn at random."""
    rng = np.random.default_rng([seed, 1])

    def often(share, value):
        return value if rng.random() < share else 0.0

    cycle = int(np.exp(rng.uniform(np.log(150), np.log(2000))))
    small = often(0.4, rng.uniform(0.1, 0.5))
    return {
        "events": int(rng.integers(20, 200)),
        "cycle": cycle,
        "slip": max(int(cycle * np.exp(rng.uniform(np.log(0.01), np.log(0.2)))), 4),
        "spread": often(0.6, rng.uniform(0.05, 0.3)),
        "small": small,
        "small_size": rng.uniform(0.1, 0.5),
        "noise": np.exp(rng.uniform(np.log(0.01), np.log(0.3))),
        "correlation": often(0.3, rng.uniform(0.3, 0.9)),
        "impulses": often(0.7, rng.uniform(5e-4, 1e-2)),
        "wave": often(0.4, rng.uniform(0.2, 1.5)),
        "ringing": often(0.3, rng.uniform(0.05, 0.3)),
        "creep": often(0.3, rng.uniform(0.02, 0.1)),
    }


def judged(seed):
    """How a random recording is read, as numbers by name; `flagged` where a check is not ok."""
    options = random_options(seed)
    truth = saw(seed, **options)
    result = measure_stick_slip(truth.trace())
    events = result.events
    true, read = matched(truth, events, 0.6 * (truth.end - truth.onset)[0] + 0.01)
    seen = truth.drop > result.smallest_drop
    missed = np.setdiff1d(np.flatnonzero(seen), true).size / max(seen.sum(), 1)
    false = 1 - np.unique(read).size / max(len(events), 1)
    drop, timing = events.drop[read] - truth.drop[true], events.onset[read] - truth.onset[true]
    beside = np.diff(true) == 1
    recurrence = np.diff(timing)[beside]
    doubt = np.hypot(events.timing_uncertainty[read][1:], events.timing_uncertainty[read][:-1])
    bias = float(np.mean(drop) / np.mean(truth.drop[true])) if true.size else np.nan
    return {
        "seed": seed,
        "events": truth.drop.size,
        "missed": missed,
        "false": false,
        "bias": bias,
        "drop": float(np.mean(np.abs(drop) < 1.96 * events.drop_uncertainty[read])),
        "recurrence": float(np.mean(np.abs(recurrence) < 1.96 * doubt[beside])),
        "flagged": any(c.verdict != "ok" for c in result.checks),
        "wrong": bool(missed > 0.05 or false > 0.02 or not abs(bias) < 0.05),
    }


def campaign_numbers(seed):
    """A, B and D0 of a campaign of random truth by the paper's steps, less truth, over se."""
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
            trace = Trace(motion.time, {"mu": Channel(friction, "dimensionless", "", "mu", "1")})
            machine = Machine(float(K), V, None, W0)
            rows.append(stick_slip_row(Path("made"), measure_stick_slip(trace, machine=machine)))
    ends = [end for end in thresholds(rows) if not end.reason]
    level = [row for row in rows if row["kind"] == "level"]
    columns = {n: [row[n] for row in level] for n in ("V", "K", "mean_friction", "epsilon")}
    columns["mean_friction_err"] = [row["mean_friction_uncertainty"] for row in level]
    if not ends:
        return dict.fromkeys((*truth, "K/W0", "frequency"), np.nan)
    bifurcations = {n: [getattr(end, n) for end in ends] for n in THRESHOLD_COLUMNS}
    result = paper_procedure(table_of(columns), Thresholds("made", **bifurcations))
    numbers = {n: (result.numbers[n].value - truth[n]) / result.numbers[n].se for n in truth}
    # Brackets have one error in common; frequencies at the velocities have their own.
    limit = critical / W0
    numbers["K/W0"] = np.mean([(end.K_over_W0 - limit) / end.K_over_W0_err for end in ends])
    root = np.sqrt((truth["B"] - A) / A) / (2 * np.pi * truth["D0"])
    numbers["frequency"] = [
        float((end.frequency - end.V * root) / end.frequency_err) for end in ends
    ]
    return numbers


def healing_interval(seed):
    """B - A over its truth: the ends of the 95 % interval, and why it cannot be told."""
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
        t = np.arange(0, 30 * cycle.period, max(cycle.slip_duration / 10, cycle.period / 5000))
        place = t + rng.uniform() * cycle.period
        size = 1 + spread * rng.standard_normal(32)
        force = (cycle.force(place) - cycle.lowest) * size[(place // cycle.period).astype(int)]
        force = force + cycle.lowest + noise * cycle.drop * rng.standard_normal(t.size)
        trace = Trace(t, {"mu": Channel(force, "dimensionless", "", "mu", "1")})
        machine = Machine(float(K), float(v), float(M), W0)
        rows.append(stick_slip_row(Path("made"), measure_stick_slip(trace, machine=machine)))
    if not rows:
        return np.nan, np.nan, "no limit cycle"
    (series,) = StickSlipCampaign.of(rows).series
    healing = series.healing()
    return *(end / difference for end in healing.b_minus_a), healing.reason


def main():
    """Print what became of the recordings and the campaigns."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--recordings", type=int, default=200)
    parser.add_argument("--campaigns", type=int, default=20)
    parser.add_argument("--healing", type=int, default=40)
    parser.add_argument("--seed", type=int, default=0)
    chosen = parser.parse_args()
    seeds = range(chosen.seed, chosen.seed + chosen.recordings)
    read = [judged(seed) for seed in seeds]
    events = sum(one["events"] for one in read)
    for name in ("missed", "false"):
        number = sum(one["events"] * one[name] for one in read)
        print(f"| {name} events | {number:.0f} of {events} |")
    for what, some in (("all", read), ("ok", [one for one in read if not one["flagged"]])):
        for name in ("drop", "recurrence"):
            share = np.nanmean([one[name] for one in some])
            print(f"| 95 % intervals of {name} that hold it, {what} ({len(some)}) | {share:.3f} |")
    wrong = [one for one in read if one["wrong"]]
    ok = [one for one in wrong if not one["flagged"]]
    print(
        f"| recordings wrong, and wrong without a word | {len(wrong)}, {len(ok)} of {len(read)} |"
    )
    for one in wrong:
        print(one, random_options(one["seed"]))
    for seed in range(chosen.seed, chosen.seed + chosen.campaigns):
        numbers = campaign_numbers(seed).items()
        words = (f"{n} {' '.join(f'{one:+.2f}' for one in np.atleast_1d(z))}" for n, z in numbers)
        print(f"| campaign {seed} | " + " | ".join(words), flush=True)
    for seed in range(chosen.seed, chosen.seed + chosen.healing):
        low, high, reason = healing_interval(seed)
        said = reason or f"{low:.2f} to {high:.2f} times the truth"
        print(f"| B - A {seed} | {said} |", flush=True)
    long = saw(0, events=1500, cycle=480, spread=0.2)
    start = clock.perf_counter()
    measure_stick_slip(long.trace())
    print(f"| {long.force.size} samples | {clock.perf_counter() - start:.2f} s |")


if __name__ == "__main__":
    main()
