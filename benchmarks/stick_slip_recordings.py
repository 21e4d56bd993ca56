"""Simulated stick-slip recordings, and the comparison of their measurement with the truth.

A motion is straight loading and slips of one shape (`chain`), or that of a slider with inertia, a
rate-and-state law and friction that varies along the track (`motion_of_a_law`). `recorded` adds the
effects of a recorder, with the filters of the virtual tribometer. `Recording` has the truth, and
`judged` defines a fault.
"""

from dataclasses import dataclass, field, replace

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.optimize import brentq
from scipy.signal import lfilter

from asperity import Slider, laws
from asperity.laws.uneven_track import on_uneven_track
from asperity.loads import Programme, Slide
from asperity.measurement.stick_slip.detection import turning_points
from asperity.measurement.stick_slip.measure import measure_stick_slip
from asperity.recording import Channel, Trace
from asperity.transients import transient
from asperity.tribometer.sensors import filtered, low_pass, resonant

RATE = 2000.0
#: Samples of a motion for one sample of the recorder.
FINE = 4


@dataclass(frozen=True)
class Recording:
    """A force and its true slips.

    Attributes
    ----------
    force : array, (n,)
        F/W, sampled at `rate`.
    onset, fast, end : array, (k,)
        Times (s) of the peak of the force, of the first tenth of its steepest fall, of its trough.
    drop : array, (k,)
        Drops of F/W.
    loading_slope : (float, float)
        Lowest and highest rate of F/W in the sticks (1/s): K V/W0, and that with creep.
    rate : float
        Samples per second.
    lag, tail : float
        Largest delay of onset and end (s), and the time constant of the gauge's exponential tail.
    options : dict
        Effects of the recorder.
    """

    force: np.ndarray
    onset: np.ndarray
    fast: np.ndarray
    end: np.ndarray
    drop: np.ndarray
    loading_slope: tuple[float, float]
    rate: float = RATE
    lag: float = 0.0
    tail: float = 0.0
    options: dict = field(default_factory=dict)

    @property
    def time(self):
        """Seconds."""
        return np.arange(self.force.size) / self.rate

    def trace(self):
        """The recording for `measure_stick_slip`."""
        return trace_of(self.time, self.force)


def trace_of(time, friction):
    """A recording of F/W alone."""
    return Trace(time, {"mu": Channel(friction, "dimensionless", "", "mu", "1")})


def repeated(cycle, cycles, step, rng, spread=0.0):
    """Times and F/W of a repeated limit cycle, from a random instant of it.

    The height of a cycle varies by the relative standard deviation `spread`.
    """
    time = np.arange(0, cycles * cycle.period, step)
    place = time + rng.uniform() * cycle.period
    size = 1 + spread * rng.standard_normal(cycles + 2)
    height = cycle.force(place) - cycle.lowest
    return time, cycle.lowest + height * size[(place // cycle.period).astype(int)]


def free(u, loaded):
    """Force of a free slider at constant friction, a cosine from -a to pi + a.

    During the slip the drive loads the spring by the share `loaded` of the drop.
    """
    a = brentq(lambda a: (np.pi / 2 + a) * np.tan(a) - loaded, 0.0, 1.5)
    return (1 + np.cos((np.pi + 2 * a) * u - a) / np.cos(a)) / 2


def damped(u, damping):
    """Force of a damped oscillator from rest to rest."""
    pole = np.pi * damping / np.sqrt(1 - damping**2)
    swing = np.exp(-pole * u) * (np.cos(np.pi * u) + pole / np.pi * np.sin(np.pi * u))
    return (swing + np.exp(-pole)) / (1 + np.exp(-pole))


#: Shapes of a slip: force from 1 to 0 as u goes from 0 to 1; x, from 0 to 1, varies the shape.
SHAPES = {
    "free": lambda u, _: (1 + np.cos(np.pi * u)) / 2,
    "straight": lambda u, _: 1 - u,
    "exponential": lambda u, _: (np.exp(-4 * u) - np.exp(-4)) / (1 - np.exp(-4)),
    "damped": lambda u, x: damped(u, 0.1 + 0.5 * x),
    "parabola": lambda u, _: 1 - u * u * (3 - 2 * u),
    "ever faster": lambda u, x: 1 - u ** (1.3 + 1.2 * x),
    "ever slower": lambda u, x: (1 - u) ** (1.3 + 1.2 * x),
    "arrested": lambda u, x: np.where(
        u < 0.5 + 0.3 * x,
        1 - 0.5 * (u / (0.5 + 0.3 * x)) ** 2,
        0.5 * ((1 - u) / (0.5 - 0.3 * x)) ** 1.5,
    ),
}


def chain(drops, slips, sticks, slope, shape, *, first, creep=0.0):
    """Loading and slips, one after the other.

    Parameters
    ----------
    drops : array, (k,)
    slips, sticks : int array, (k,)
        Samples of each slip and of the stick after it.
    slope : float
        Slope of the loading per sample.
    shape : callable
        Force from 1 to 0 by u in (0, 1] and the number of the slip.
    first : int
        Samples before the first slip.
    creep : float
        Share of the drop by which the force lags before the next onset, over a tenth of the stick.

    Returns
    -------
    force : array
    onset, end : int array, (k,)
    """
    parts = [0.3 + slope * np.arange(first)]
    level = parts[0][-1]
    for k, (drop, slip, stick) in enumerate(zip(drops, slips, sticks, strict=True)):
        parts.append(level - drop * (1 - shape(np.arange(1, slip + 1) / slip, k)))
        j = np.arange(1, stick + 1)
        parts.append(level - drop + slope * j - creep * drop * np.exp((j - stick) / (0.1 * stick)))
        level = parts[-1][-1]
    end = first - 1 + np.cumsum(slips) + np.append(0, np.cumsum(sticks)[:-1])
    return np.concatenate(parts), end - slips, end


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
    """A recording with `events` slips of a free slider.

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
    slope, scatter = drop / cycle, rng.standard_normal((events, 2))
    drops = drop * np.maximum(1 + spread * scatter[:, 0], 0.25)
    drops[rng.random(events) < small] = small_size * drop
    # With creep the loading takes longer.
    sticks = (1 + creep) * drops / slope * (1 + 0.3 * spread * scatter[:, 1])
    sticks, slips = np.maximum(sticks.astype(int), 8), np.full(events, slip)
    clean, onset, end = chain(
        drops,
        slips,
        sticks,
        slope,
        lambda u, k: free(u, slope * slip / drops[k]),
        first=cycle // 2,
        creep=creep,
    )
    # An oscillation with a period of six samples that dies out within a hundred.
    swing = np.zeros(clean.size)
    swing[end] = -ringing * drops
    j = np.arange(200)
    swing = np.convolve(swing, np.exp(-j / 20) * np.sin(2 * np.pi * j / 6))[: clean.size]
    # The wave is part of the drop.
    clean = clean + wave * drop * np.sin(2 * np.pi * np.arange(clean.size) / (20.3 * cycle))
    force = clean + swing + noise * drop * _noise(rng, clean.size, correlation)
    force = force + 0.6 * drop * _impulses(rng, clean.size, impulses)
    at = onset / RATE
    return Recording(force, at, at, end / RATE, clean[onset] - clean[end], (slope * RATE,) * 2)


def _noise(rng, samples, correlation):
    white = rng.standard_normal(samples)
    if not correlation:
        return white
    return lfilter([np.sqrt(1 - correlation**2)], [1, -correlation], white)


def _impulses(rng, samples, share):
    return rng.standard_normal(samples) * (rng.random(samples) < share)


def often(rng, share, low, high):
    """A log-uniform number from a range with the probability `share`, otherwise zero."""
    number = 10 ** rng.uniform(np.log10(low), np.log10(high))
    return float(number) if rng.random() < share else 0.0


def random_saw(seed):
    """A `saw` with arguments drawn at random."""
    rng = np.random.default_rng([seed, 1])
    cycle = int(10 ** rng.uniform(2.2, 3.3))
    options = {
        "events": int(rng.integers(20, 200)),
        "cycle": cycle,
        "slip": max(int(cycle * often(rng, 1.0, 0.01, 0.2)), 4),
        "spread": often(rng, 0.6, 0.05, 0.3),
        "small": often(rng, 0.4, 0.1, 0.5),
        "small_size": rng.uniform(0.1, 0.5),
        "noise": often(rng, 1.0, 0.01, 0.3),
        "correlation": often(rng, 0.3, 0.3, 0.9),
        "impulses": often(rng, 0.7, 5e-4, 1e-2),
        "wave": often(rng, 0.4, 0.2, 1.5),
        "ringing": often(rng, 0.3, 0.05, 0.3),
        "creep": often(rng, 0.3, 0.02, 0.1),
    }
    return replace(saw(seed, **options), options=options)


def straight_lines(rng):
    """Force at `FINE` times the rate, onsets, fast parts, ends and slope per sample: a `chain`."""
    slip = FINE * 10 ** rng.uniform(0.7, 1.9)
    cycle = slip * 10 ** rng.uniform(0.6, 1.9)
    events = int(np.clip(rng.integers(25, 150), 10, FINE * 150_000 / cycle))
    spread, creep = rng.choice([0, 0.05, 0.2, 0.35]), rng.choice([0, 0, 0.03, 0.08])
    shape, form = SHAPES[rng.choice(list(SHAPES))], rng.random()
    slope, scatter = 0.1 / cycle, rng.standard_normal((events, 3)).T
    drops = np.maximum(0.1 * (1 + spread * scatter[0]), 0.02)
    slips = np.maximum(np.rint(slip * (1 + 0.05 * spread * scatter[1])).astype(int), FINE)
    sticks = (1 + creep) * drops / slope * (1 + 0.3 * spread * scatter[2])
    sticks = np.maximum(sticks.astype(int), 8 * FINE)
    force, onset, end = chain(
        drops, slips, sticks, slope, lambda u, _: shape(u, form), first=int(cycle / 2), creep=creep
    )
    return force, onset, onset, end, slope


def motion_of_a_law(rng):
    """As `straight_lines`, for a slider of random law and machine with developed stick-slip."""
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
        motion = transient(slider, drive, sampling=rate, inertia=True, rtol=1e-6)
        force = np.asarray(motion.force) / W0
        at = turning_points(force, 0.02 * np.ptp(force[force.size // 4 :]))
        peak = np.flatnonzero(np.diff(force[at]) < 0)
        onset, end = at[peak], at[peak + 1]
        inside = (onset > 0) & (end < force.size - 1)
        onset, end = onset[inside], end[inside]
        drop = force[onset] - force[end]
        # Motions that end in steady sliding or at rest are no stick-slip.
        lasts = onset.size >= 15 and force.size - end[-1] < 2.5 * np.median(np.diff(onset))
        if not lasts or np.median(drop[-5:]) < 0.3 * np.median(drop):
            continue
        cut = (end[1] + onset[2]) // 2
        force, onset, end = force[cut:], onset[2:] - cut, end[2:] - cut
        fall = [-np.diff(force[a : b + 1]) for a, b in zip(onset, end, strict=True)]
        fast = onset + [int(np.argmax(f >= 0.1 * f.max())) for f in fall]
        return force, onset, fast, end, K * V / W0 / rate


def recorded(seed):
    """A random motion at a random recorder; true times are in samples.

    Noise is 0.3 to 20 % of the drop, white or correlated. Some recordings have a gauge that rings
    with a period of 0.1 to 2 slips, an exponential tail of 0.05 to 0.8 of a slip, hum, 1/f noise,
    drift, a level that wanders, impulses, rounding, or clipping.
    """
    rng = np.random.default_rng([seed, 5])
    clean, onset, fast, end, slope = (motion_of_a_law if rng.random() < 0.6 else straight_lines)(
        rng
    )
    drop = clean[onset] - clean[end]
    D, slip = np.median(drop), float(np.median(end - onset))
    every = int(rng.choice([4, 4, 4, 8])) if slip >= 32 else FINE
    options, force = {}, clean

    def sometimes(share, name, low, high):
        number = often(rng, share, low, high)
        if number:
            options[name] = round(number, 4)
        return number

    if ring := sometimes(0.3, "ringing", 0.1, 2):
        damping = 10 ** rng.uniform(-1.7, -0.7)
        force = filtered(force, 1.0, *resonant(1 / max(ring * slip, 2.2), damping))
    if tail := sometimes(0.3, "tail", 0.05, 0.8):
        force = filtered(force, 1.0, *low_pass(1, 1 / (2 * np.pi * tail * slip)))
    force = force[::every]
    n, time = force.size, np.arange(force.size)
    white = rng.standard_normal(n)
    if correlation := sometimes(0.2, "correlation", 0.3, 0.9):
        white = lfilter([np.sqrt(1 - correlation**2)], [1, -correlation], white)
    force = force + sometimes(1.0, "noise", 10**-2.5, 10**-0.7) * D * white
    if size := sometimes(0.3, "hum", 10**-2.3, 0.1):
        period = slip * 10 ** rng.uniform(-0.5, 1.3)
        options["period"] = round(period / slip, 2)
        phase = 2 * np.pi * time * every / period + rng.uniform(0, 2 * np.pi)
        hum = size * D * (np.sin(phase) + 0.3 * (rng.random() < 0.5) * np.sin(3 * phase))
        force = force + hum
        # Hum slower than a quarter of a cycle is part of the force.
        if period > np.median(np.diff(onset)) / 4:
            begin, close = (np.minimum(at // every, n - 1) for at in (onset, end))
            drop = drop + hum[begin] - hum[close]
    if size := sometimes(0.25, "noise of 1/f", 10**-2.3, 0.1):
        spectrum = np.fft.rfft(rng.standard_normal(2 * n))
        spectrum[1:] /= np.sqrt(np.arange(1, spectrum.size))
        slow = np.fft.irfft(spectrum)[:n]
        force = force + size * D * (slow - slow.mean()) / slow.std()
    if size := sometimes(0.3, "drift", 0.1, 3):
        force = force + rng.choice([-1, 1]) * size * D * (time / n) ** rng.choice([1, 2])
    if size := sometimes(0.15, "wander", 0.3, 2):
        walk = np.cumsum(rng.standard_normal(n))
        force = force + size * D * gaussian_filter1d(walk / np.abs(walk).max(), 5 * n / drop.size)
    if share := sometimes(0.4, "impulses", 10**-3.5, 1e-2):
        force = force + D * rng.uniform(0.2, 1) * _impulses(rng, n, share)
    if share := sometimes(0.1, "limit", 0.005, 0.1):
        force = np.minimum(force, np.quantile(force, 1 - share))
    if size := sometimes(0.2, "step", 10**-2.3, 0.1):
        force = size * D * np.rint(force / (size * D))
    middles = (
        (e + (o - e) // 4, o - (o - e) // 4) for e, o in zip(end[:-1], onset[1:], strict=True)
    )
    slopes = [np.polyfit(np.arange(b - a), clean[a:b], 1)[0] for a, b in middles if b - a > 3]
    low, high = sorted([every * slope, every * float(np.median(slopes))])
    onset, fast, end = (at / every for at in (onset, fast, end))
    slip /= every
    lag = tail * slip + ring * slip / (2 * np.pi)
    return Recording(force, onset, fast, end, drop, (low, high), 1.0, lag, tail * slip, options)


def judged(truth):
    """Measurement of a recording compared with the truth: shares, flagged checks, and faults.

    Faults are: more than 1 % (and one) of the events are false; more than 2 % (and one) of those
    above the stated threshold are missed; the share of 95 % intervals of onset, end, drop or
    recurrence that contain the truth is three of its standard errors below 95 %; the loading slope
    is more than three standard uncertainties and 1 % off; the regime is another. The true onset is
    anywhere from the peak of the force to the first tenth of its steepest fall; onset and end may
    be later by the gauge's time constant and by the inverse of the angular frequency of its
    ringing. Ends are not compared if the gauge has a tail.
    """
    result = measure_stick_slip(truth.trace())
    events, slip = result.events, float(np.median(truth.end - truth.onset))
    flags = [check.name for check in result.checks if check.verdict != "ok"]
    answer = {"options": truth.options, "flags": flags, "events": truth.drop.size}
    if not len(events):
        return answer | {"faults": ["no event"]}
    true, measured = matched(truth, events)
    drop, last = truth.drop, truth.time[-1]
    inside = (truth.onset > 3 * slip) & (truth.end < last - 3 * slip)
    large = np.flatnonzero((drop > result.smallest_drop) & inside)
    missed, false = np.setdiff1d(large, true).size, len(events) - measured.size
    begin = np.clip(events.onset[measured], truth.onset[true], truth.fast[true] + truth.lag)
    finish = np.clip(events.end[measured], truth.end[true], truth.end[true] + truth.lag)
    timing = events.timing_uncertainty[measured]
    recurrence = np.diff(events.onset[measured] - begin)[np.diff(true) == 1]
    uncertainty = np.hypot(timing[1:], timing[:-1])[np.diff(true) == 1]
    scores = {
        "onset": (events.onset[measured] - begin) / timing,
        "end": (events.end[measured] - finish) / timing,
        "drop": (events.drop[measured] - drop[true]) / events.drop_uncertainty[measured],
        "recurrence": recurrence / uncertainty,
    }
    if truth.tail:
        del scores["end"]
    shares = {name: float(np.mean(np.abs(z) < 1.96)) for name, z in scores.items() if z.size}
    least = 0.95 - 3 * np.sqrt(0.95 * 0.05 / max(true.size, 1))
    faults = [f"{name} {share:.2f}" for name, share in shares.items() if not share >= least]
    error = result.loading_slope - np.clip(result.loading_slope, *truth.loading_slope)
    score = error / result.loading_slope_uncertainty
    if abs(score) > 3 and abs(error) > 0.01 * truth.loading_slope[1]:
        faults.append(f"slope {score:.1f}")
    if false > max(1, 0.01 * len(events)):
        faults.append(f"false {false}")
    if missed > max(1, 0.02 * drop.size):
        faults.append(f"missed {missed}")
    if not any(part.sticks for part in result.regimes if part.stop - part.first > 2):
        faults.append(result.kind)
    shares["slope"] = float(abs(score) < 1.96)
    return answer | {"held": shares, "false": false, "missed": missed, "faults": faults}


def matched(truth, events):
    """Indices of true events and of the measured events that match them, by their middles."""
    slip = truth.end - truth.onset
    reach = np.maximum(slip, np.median(slip)) + 2 / truth.rate + 2 * truth.lag
    distance = np.abs((events.onset + events.end)[:, None] - (truth.onset + truth.end)) / 2
    nearest = distance.argmin(0)
    true = np.flatnonzero(distance.min(0) < reach)
    # A measured event matches one true event only.
    true = true[np.unique(nearest[true], return_index=True)[1]]
    return true, nearest[true]


def tables(rows):
    """Lines with the results of a population of recordings, and its faulty recordings."""
    ok = [row for row in rows if not row["flags"]]
    faulty = [row for row in ok if row["faults"]]
    lines = [
        "| recordings, with a fault | all checks ok, with a fault |",
        f"| {len(rows)}, {sum(bool(row['faults']) for row in rows)} | {len(ok)}, {len(faulty)} |",
    ]
    for name in ("onset", "end", "drop", "recurrence", "slope"):
        shares = [
            np.mean([row["held"][name] for row in part if name in row.get("held", {})] or [np.nan])
            for part in (rows, ok)
        ]
        lines.append(f"| 95 % intervals of {name} with the truth, all and ok | {shares[0]:.3f}, "
                     f"{shares[1]:.3f} |")  # fmt: skip
    for name in ("false", "missed"):
        counts = [
            f"{sum(row.get(name, 0) for row in part)} of {sum(row['events'] for row in part)}"
            for part in (rows, ok)
        ]
        lines.append(f"| {name} events, all and ok | {', '.join(counts)} |")
    return lines + [f"{row['seed']} {row['faults']} {row['options']}" for row in faulty]
