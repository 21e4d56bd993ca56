"""Stick-slip recordings with everything that goes wrong, read: faults where all checks are ok.

    python -m benchmarks.hostile_stick_slip [--recordings 100] [--seed 0]

Motions are those of a slider with inertia, a rate-and-state law and friction that varies along the
track, or straight loading and slips of eight shapes. The recorder has noise of 0.3 to 20 % of the
drop, white or correlated, and each of these in some: a gauge that rings with a period of 0.1 to
twice a slip, an exponential tail of 0.05 to 0.8 of a slip, hum, noise of 1/f, drift, a level that
wanders, impulses, steps and a limit. A fault is: more than 1 % (and one) of the events are false,
more than 2 % (and one) of those above the stated threshold are missed, the 95 % intervals of
onset, end or drop hold less than 95 % by three standard errors of that share, the loading slope is
off by more than three standard uncertainties and 1 %, or the regime is another. The truth of an
onset is anywhere from the peak of the force to where its fall reaches a tenth of the steepest;
onset and end may be later by the gauge's time constant and by the inverse of the angular frequency
with which it rings. Ends are not judged where the gauge has a tail, and hum slower than a quarter
of a cycle is part of the force.
"""

import argparse
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.signal import lfilter

from asperity import Slider, laws
from asperity.laws.uneven_track import on_uneven_track
from asperity.loads import Programme, Slide
from asperity.measurement.stick_slip.detection import turning_points
from asperity.measurement.stick_slip.measure import measure_stick_slip
from asperity.recording import Channel, Trace
from asperity.transients import transient
from asperity.tribometer.sensors import filtered, low_pass, resonant

#: Samples of the motion to one of the recorder.
FINE = 4
SHAPES = {
    "free": lambda u, _: (1 + np.cos(np.pi * u)) / 2,
    "straight": lambda u, _: 1 - u,
    "exponential": lambda u, _: (np.exp(-4 * u) - np.exp(-4)) / (1 - np.exp(-4)),
    "damped": lambda u, x: _damped(u, 0.1 + 0.5 * x),
    "parabola": lambda u, _: 1 - u * u * (3 - 2 * u),
    "ever faster": lambda u, x: 1 - u ** (1.3 + 1.2 * x),
    "ever slower": lambda u, x: (1 - u) ** (1.3 + 1.2 * x),
    "arrested": lambda u, x: np.where(
        u < 0.5 + 0.3 * x,
        1 - 0.5 * (u / (0.5 + 0.3 * x)) ** 2,
        0.5 * ((1 - u) / (0.5 - 0.3 * x)) ** 1.5,
    ),
}


def _damped(u, damping):
    """From rest to rest of an oscillator."""
    pole = np.pi * damping / np.sqrt(1 - damping**2)
    swing = np.exp(-pole * u) * (np.cos(np.pi * u) + pole / np.pi * np.sin(np.pi * u))
    return (swing + np.exp(-pole)) / (1 + np.exp(-pole))


@dataclass
class Motion:
    """Force F/W at `FINE` times the rate of the recorder, and its slips.

    Attributes
    ----------
    force : array, (n,)
    onset, fast, end : int array, (k,)
        Samples: peak of the force, where its fall is a tenth of the steepest, trough.
    slope : float
        K V/W0 per sample.
    """

    force: np.ndarray
    onset: np.ndarray
    fast: np.ndarray
    end: np.ndarray
    slope: float


def straight_lines(rng):
    """Straight loading, with creep, and slips of one shape."""
    slip = FINE * 10 ** rng.uniform(0.7, 1.9)
    cycle = slip * 10 ** rng.uniform(0.6, 1.9)
    events = int(np.clip(rng.integers(25, 150), 10, FINE * 150_000 / cycle))
    spread, creep = rng.choice([0, 0.05, 0.2, 0.35]), rng.choice([0, 0, 0.03, 0.08])
    shape, form = SHAPES[rng.choice(list(SHAPES))], rng.random()
    slope = 0.1 / cycle
    parts, onset, end = [0.3 + slope * np.arange(int(cycle / 2))], [], []
    at, level = parts[0].size, parts[0][-1]
    for _ in range(events):
        drop = max(0.1 * (1 + spread * rng.standard_normal()), 0.02)
        long = max(round(slip * (1 + 0.05 * spread * rng.standard_normal())), FINE)
        parts.append(level - drop * (1 - shape(np.arange(1, long + 1) / long, form)))
        onset.append(at - 1)
        end.append(at - 1 + long)
        wait = (1 + creep) * drop / slope * (1 + 0.3 * spread * rng.standard_normal())
        j = np.arange(1, max(int(wait), 8 * FINE) + 1)
        lag = creep * drop * np.exp((j - j.size) / (0.1 * j.size))
        parts.append(level - drop + slope * j - lag)
        at, level = at + long + j.size, parts[-1][-1]
    force, onset, end = np.concatenate(parts), np.array(onset), np.array(end)
    return Motion(force, onset, onset, end, slope)


def motion_of_a_law(rng):
    """A slider with inertia, of random law and machine, until its stick-slip has developed."""
    while True:
        A, D0, W0 = rng.uniform(0.008, 0.02), 10 ** rng.uniform(-6.7, -5.3), rng.uniform(1, 20)
        B = A * rng.uniform(1.4, 3)
        numbers = {"mu0": rng.uniform(0.3, 0.6), "V0": 1e-6, "A": A, "B": B, "D0": D0}
        kind = rng.choice(["ageing", "slip", "elastic"])
        if kind == "elastic":
            law = laws.ElastoPlastic(**numbers, lambda_=D0 * rng.uniform(0.3, 1.5))
        else:
            law = (laws.RiceRuina if kind == "ageing" else laws.RuinaSlip)(**numbers)
        K, V = (B - A) * W0 / D0 * 10 ** rng.uniform(-1.4, -0.5), 10 ** rng.uniform(-5, -3.5)
        cycle = 4 * (B - A) * W0 / (K * V)
        slip = cycle / 10 ** rng.uniform(0.8, 1.8)
        if rng.random() < 0.6:
            size, length = 10 ** rng.uniform(-1.3, -0.2), V * cycle * 10 ** rng.uniform(-0.7, 1)
            law = on_uneven_track(
                law, amplitude=size * (B - A), length=length, origin=rng.uniform(0, 1e-2)
            )
        rate = FINE * 10 ** rng.uniform(0.8, 1.8) / slip
        duration = min(rng.integers(45, 180) * cycle, 240_000 / rate)
        slider = Slider(law, spring=K, load=W0, mass=K * (slip / np.pi) ** 2)
        drive = Programme(Slide(duration=duration, velocity=V), load=W0, velocity=V / 2)
        moved = transient(slider, drive, sampling=rate, inertia=True, rtol=1e-6)
        force = np.asarray(moved.force) / W0
        at = turning_points(force, 0.02 * np.ptp(force[force.size // 4 :]))
        peak = np.flatnonzero(np.diff(force[at]) < 0)
        onset, end = at[peak], at[peak + 1]
        inside = (onset > 0) & (end < force.size - 1)
        onset, end = onset[inside], end[inside]
        drop = force[onset] - force[end]
        # Those that come to slide steadily, or stop, are no stick-slip.
        lasts = onset.size >= 15 and force.size - end[-1] < 2.5 * np.median(np.diff(onset))
        if not lasts or np.median(drop[-5:]) < 0.3 * np.median(drop):
            continue
        cut = (end[1] + onset[2]) // 2
        force, onset, end = force[cut:], onset[2:] - cut, end[2:] - cut
        fall = [-np.diff(force[a : b + 1]) for a, b in zip(onset, end, strict=True)]
        fast = onset + [int(np.argmax(f >= 0.1 * f.max())) for f in fall]
        return Motion(force, onset, fast, end, K * V / W0 / rate)


def recorded(motion, rng):
    """The force at the recorder, drops with what is slow in it, what was done, samples apart."""
    drop = motion.force[motion.onset] - motion.force[motion.end]
    D, slip = np.median(drop), float(np.median(motion.end - motion.onset))
    every = int(rng.choice([4, 4, 4, 8])) if slip >= 32 else FINE
    options, force = {}, motion.force

    def often(share, name, low, high):
        """A number from a range, log-uniform, or zero."""
        number = 10 ** rng.uniform(np.log10(low), np.log10(high))
        if rng.random() >= share:
            return 0.0
        options[name] = round(float(number), 4)
        return number

    if ring := often(0.3, "ringing", 0.1, 2):
        damping = 10 ** rng.uniform(-1.7, -0.7)
        force = filtered(force, 1.0, *resonant(1 / max(ring * slip, 2.2), damping))
    if tail := often(0.3, "tail", 0.05, 0.8):
        force = filtered(force, 1.0, *low_pass(1, 1 / (2 * np.pi * tail * slip)))
    force = force[::every]
    n, time = force.size, np.arange(force.size)
    white = rng.standard_normal(n)
    if memory := often(0.2, "correlation", 0.3, 0.9):
        white = lfilter([np.sqrt(1 - memory**2)], [1, -memory], white)
    force = force + often(1.0, "noise", 10**-2.5, 10**-0.7) * D * white
    if size := often(0.3, "hum", 10**-2.3, 0.1):
        period = slip * 10 ** rng.uniform(-0.5, 1.3)
        options["period"] = round(period / slip, 2)
        phase = 2 * np.pi * time * every / period + rng.uniform(0, 2 * np.pi)
        hum = size * D * (np.sin(phase) + 0.3 * (rng.random() < 0.5) * np.sin(3 * phase))
        force = force + hum
        if period > np.median(np.diff(motion.onset)) / 4:
            last = n - 1
            drop = drop + hum[np.minimum(motion.onset // every, last)]
            drop = drop - hum[np.minimum(motion.end // every, last)]
    if size := often(0.25, "noise of 1/f", 10**-2.3, 0.1):
        spectrum = np.fft.rfft(rng.standard_normal(2 * n))
        spectrum[1:] /= np.sqrt(np.arange(1, spectrum.size))
        slow = np.fft.irfft(spectrum)[:n]
        force = force + size * D * (slow - slow.mean()) / slow.std()
    if size := often(0.3, "drift", 0.1, 3):
        force = force + rng.choice([-1, 1]) * size * D * (time / n) ** rng.choice([1, 2])
    if size := often(0.15, "wander", 0.3, 2):
        walk = np.cumsum(rng.standard_normal(n))
        force = force + size * D * gaussian_filter1d(walk / np.abs(walk).max(), 5 * n / drop.size)
    if share := often(0.4, "impulses", 10**-3.5, 1e-2):
        size = D * rng.uniform(0.2, 1) * rng.standard_normal(n)
        force = force + size * (rng.random(n) < share)
    if share := often(0.1, "limit", 0.005, 0.1):
        force = np.minimum(force, np.quantile(force, 1 - share))
    if size := often(0.2, "step", 10**-2.3, 0.1):
        force = size * D * np.rint(force / (size * D))
    return force, drop, options, every


def judged(seed):
    """How a random recording is read: its options, what is flagged, and faults, with numbers."""
    rng = np.random.default_rng([seed, 5])
    motion = (motion_of_a_law if rng.random() < 0.6 else straight_lines)(rng)
    force, drop, options, every = recorded(motion, rng)
    onset, fast, end = (at / every for at in (motion.onset, motion.fast, motion.end))
    time, slip = np.arange(force.size, dtype=float), float(np.median(end - onset))
    result = measure_stick_slip(Trace(time, {"mu": Channel(force, "dimensionless", "", "mu", "1")}))
    events, tail = result.events, options.get("tail", 0.0) * slip
    lag = tail + options.get("ringing", 0.0) * slip / (2 * np.pi)
    flags = [check.name for check in result.checks if check.verdict != "ok"]
    answer = {"seed": seed, "options": options, "flags": flags, "events": drop.size, "faults": []}
    if not len(events):
        return answer | {"faults": ["no event"]}
    reach = np.maximum(end - onset, slip) + 2 + 2 * lag
    away = np.abs((events.onset + events.end)[:, None] - (onset + end)) / 2
    read = away.argmin(0)
    true = np.flatnonzero(away.min(0) < reach)
    true = true[np.unique(read[true], return_index=True)[1]]
    read = read[true]
    inside = (onset > 3 * slip) & (end < time[-1] - 3 * slip)
    seen = np.flatnonzero((drop > result.smallest_drop) & inside)
    missed, false = np.setdiff1d(seen, true).size, len(events) - read.size
    begin = np.clip(events.onset[read], onset[true], fast[true] + lag)
    finish = np.clip(events.end[read], end[true], end[true] + lag)
    scores = {
        "onset": (events.onset[read] - begin) / events.timing_uncertainty[read],
        "end": (events.end[read] - finish) / events.timing_uncertainty[read],
        "drop": (events.drop[read] - drop[true]) / events.drop_uncertainty[read],
    }
    if tail:
        del scores["end"]
    held = {name: float(np.mean(np.abs(z) < 1.96)) for name, z in scores.items()}
    least = 0.95 - 3 * np.sqrt(0.95 * 0.05 / max(true.size, 1))
    faults = [f"{name} {share:.2f}" for name, share in held.items() if not share >= least]
    slopes = [
        np.polyfit(np.arange(b - a), motion.force[a:b], 1)[0]
        for a, b in (
            (e + (o - e) // 4, o - (o - e) // 4)
            for e, o in zip(motion.end[:-1], motion.onset[1:], strict=True)
        )
        if b - a > 3
    ]
    # Creep throughout a stick is part of its slope.
    low, high = sorted([every * motion.slope, every * float(np.median(slopes))])
    off = result.loading_slope - np.clip(result.loading_slope, low, high)
    score = off / result.loading_slope_uncertainty
    if abs(score) > 3 and abs(off) > 0.01 * high:
        faults.append(f"slope {score:.1f}")
    if false > max(1, 0.01 * len(events)):
        faults.append(f"false {false}")
    if missed > max(1, 0.02 * drop.size):
        faults.append(f"missed {missed}")
    if not any(part.sticks for part in result.regimes if part.stop - part.first > 2):
        faults.append(result.kind)
    held["slope"] = float(abs(score) < 1.96)
    return answer | {"held": held, "false": false, "missed": missed, "faults": faults}


def main():
    """Print faults, and shares of intervals that hold the truth."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--recordings", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    chosen = parser.parse_args()
    read = [judged(chosen.seed + k) for k in range(chosen.recordings)]
    ok = [one for one in read if not one["flags"]]
    faulty = [one for one in ok if one["faults"]]
    print(
        f"| recordings, all checks ok, of these with a fault | {len(read)}, {len(ok)}, "
        f"{len(faulty)} |"
    )
    for name in ("onset", "end", "drop", "slope"):
        shares = [one["held"][name] for one in ok if name in one.get("held", {})]
        print(f"| 95 % intervals of {name} that hold it | {np.mean(shares):.3f} |")
    for name in ("false", "missed"):
        number = sum(one.get(name, 0) for one in ok)
        print(f"| {name} events | {number} of {sum(one['events'] for one in ok)} |")
    for one in faulty:
        print(one["seed"], one["faults"], one["options"])


if __name__ == "__main__":
    main()
