"""Fits to recordings with defects: how many answers are right, flagged, or wrong without a warning.

    python -m benchmarks.dirty_recordings [--sets 50] [--kind spikes] [--out rows.jsonl]
    python -m benchmarks.dirty_recordings --kind jump --without jumps

The recordings are those of `benchmarks.coverage` with one kind of defect each, of a size drawn over
a decade or more. An answer is wrong if a parameter is more than four standard errors from the
truth, and flagged if the fit has a warning. ``--without`` leaves out one step of the cleaning.
``--rate`` samples faster: recordings of more than 20,000 samples are averaged, and lines are
subtracted only from these.
"""

from __future__ import annotations

import argparse
import json
import time as clock
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from asperity.errors import InputError
from asperity.inference import fit, recorded_run
from asperity.inference.fitting import fit as fitting
from asperity.inference.runs import blocks, cleaning
from asperity.recording import Trace
from benchmarks.coverage import (
    CASES,
    LOAD,
    LOAD_NOISE,
    NOISE,
    Case,
    coloured,
    friction,
    trace_of,
    wander,
)
from benchmarks.populations import inside, log_uniform

Float = np.ndarray
#: An answer is wrong if it is more than this many standard errors from the truth.
WRONG = 4.0


def _sizes(random: np.random.Generator, low: float, high: float, n: int) -> Float:
    size = log_uniform(random, low, high, n)
    return np.asarray(NOISE * size * random.choice([-1.0, 1.0], n))


def spikes(random: np.random.Generator, case: Case, time: Float, x: Float) -> Float:
    """One to ten single samples, 4 to 100 times the noise off."""
    at = random.choice(x.size, random.integers(1, 11), replace=False)
    x[at] += _sizes(random, 4, 100, at.size)
    return x


def spike_at_change(random: np.random.Generator, case: Case, time: Float, x: Float) -> Float:
    """One sample within five of a change of the drive, 4 to 100 times the noise off."""
    changes = [*case.changes, *(t for t, _ in case.loads if t > 0)]
    at = int(np.searchsorted(time, random.choice(changes))) + random.integers(-5, 6)
    x[at] += _sizes(random, 4, 100, 1)[0]
    return x


def jump(random: np.random.Generator, case: Case, time: Float, x: Float) -> Float:
    """A jump of the level by 1 to 30 times the noise."""
    x[random.integers(20, x.size - 20) :] += _sizes(random, 1, 30, 1)[0]
    return x


def hum(random: np.random.Generator, case: Case, time: Float, x: Float) -> Float:
    """A line of 0.5 to 10 times the noise at 0.05 to 0.45 of the sampling rate, wandering."""
    hertz = case.rate * random.uniform(0.05, 0.45)
    phase = np.cumsum(2 * np.pi * hertz / case.rate + 1e-3 * random.normal(size=x.size))
    return x + abs(_sizes(random, 0.5, 10, 1)[0]) * np.cos(phase + 6.3 * random.random())


def line(random: np.random.Generator, case: Case, time: Float, x: Float) -> Float:
    """A steady line of 0.5 to 10 times the noise at 0.003 to 0.05 of the sampling rate."""
    hertz = case.rate * log_uniform(random, 0.003, 0.05)
    size = abs(_sizes(random, 0.5, 10, 1)[0])
    return np.asarray(x + size * np.cos(2 * np.pi * hertz * time + 6.3 * random.random()))


def clipped(random: np.random.Generator, case: Case, time: Float, x: Float) -> Float:
    """Friction clipped at one end of its range, by 5 to 50 % of the range."""
    low, high = x.min(), x.max()
    share = random.uniform(0.05, 0.5) * (high - low)
    return (
        np.clip(x, low + share, None) if random.random() < 0.5 else np.clip(x, None, high - share)
    )


def slow(random: np.random.Generator, case: Case, time: Float, x: Float) -> Float:
    """More noise, of half the size, correlated over 10 to 300 samples."""
    steps = log_uniform(random, 10, 300)
    # The noise does not depend on its start after 2,000 samples.
    noise = wander(random.normal(size=x.size + 2000), 0.0, steps)
    return np.asarray(x + 0.5 * NOISE * noise[2000:])


def heavy(random: np.random.Generator, case: Case, time: Float, x: Float) -> Float:
    """White noise with tails: Student's t of three degrees of freedom."""
    return np.asarray(x + 0.6 * NOISE * random.standard_t(3, x.size))


def burst(random: np.random.Generator, case: Case, time: Float, x: Float) -> Float:
    """Three to ten times the noise in 2 to 10 % of the recording."""
    n = int(random.uniform(0.02, 0.1) * x.size)
    at = random.integers(0, x.size - n)
    x[at : at + n] += random.uniform(3, 10) * NOISE * random.normal(size=n)
    return x


def missing(random: np.random.Generator, case: Case, time: Float, x: Float) -> Float:
    """Up to five stretches of 1 to 30 samples without a number."""
    for _ in range(random.integers(1, 6)):
        at = random.integers(20, x.size - 50)
        x[at : at + random.integers(1, 31)] = np.nan
    return x


def clean(random: np.random.Generator, case: Case, time: Float, x: Float) -> Float:
    """No defect."""
    return x


KINDS: dict[str, Callable[[np.random.Generator, Case, Float, Float], Float]] = {
    f.__name__: f
    for f in (
        clean,
        slow,
        spikes,
        spike_at_change,
        jump,
        hum,
        line,
        clipped,
        heavy,
        burst,
        missing,
    )
}


def dirty_trace(kind: str, case: Case, exact: Float, seed: int) -> Trace:
    """A recording with a defect."""
    random = np.random.default_rng([seed, len(kind), ord(kind[-1])])
    time = np.arange(exact.size) / case.rate
    noisy = KINDS[kind](random, case, time, exact + coloured(random, time.size, case.rate))
    load = LOAD * case.load(time)
    if len(case.loads) > 1:
        load += LOAD_NOISE * LOAD * random.normal(size=time.size)
    moving = case.slip(time) + 2e-8 * random.normal(size=time.size)
    return trace_of(time, noisy, moving, load)


def answer(kind: str, name: str, case: Case, exact: Float, seed: int) -> dict[str, Any]:
    """Result of a fit to one recording."""
    row: dict[str, Any] = {"kind": kind, "case": name, "seed": seed}
    true = case.true
    begun = clock.process_time()
    try:
        run = recorded_run(dirty_trace(kind, case, exact, seed), name="run")
        free = [n for n in true if n != "K"]
        result = fit(run, case.law, free, start=true, starts=1)
    except InputError as error:
        return {**row, "refused": str(error)}
    row["seconds"] = clock.process_time() - begun
    if not result.converged:
        return {**row, "refused": "not converged"}
    parameters = {n: result.parameters[n] for n in true}
    distances = {}
    for n, p in parameters.items():
        low, high = p.interval_95
        side = (high - p.value if true[n] > p.value else p.value - low) / 1.96
        distances[n] = float((p.value - true[n]) / max(side, 1e-300))
    row["distances"] = distances
    row["covered"] = {n: within for n, (_, within) in inside(parameters, true).items()}
    row["se"] = {n: float(p.se / true[n]) for n, p in parameters.items()}
    row["warnings"] = list(result.warnings)
    row["noise"] = {k: v for k, v in result.objective.terms[0].noise.items() if k != "samples"}
    return row


#: Steps of the cleaning that ``--without`` leaves out: module, function, and its replacement.
STEPS: dict[str, tuple[Any, str, Any]] = {
    "spikes": (cleaning, "spikes", lambda values: np.empty(0, np.intp)),
    "jumps": (cleaning, "find_jumps", lambda values, stretches: []),
    "wrong": (fitting, "_without_wrong_samples", lambda objective, u, recordings: recordings),
    "lines": (blocks, "find_lines", lambda values, step, lowest: []),
}


def line_of(kind: str, rows: list[dict[str, Any]]) -> str:
    """A row of the table."""
    refused = sum("refused" in r for r in rows)
    done = [r for r in rows if "refused" not in r]
    flagged = [bool(r["warnings"]) for r in done]
    wrong = [max(map(abs, r["distances"].values())) > WRONG for r in done]
    silent = sum(w and not f for w, f in zip(wrong, flagged, strict=True))
    ok = [r for r, f in zip(done, flagged, strict=True) if not f]

    def cover(these: list[dict[str, Any]]) -> str:
        inside = [v for r in these for v in r["covered"].values()]
        return f"{100 * np.mean(inside):.1f}" if inside else ""

    width = f"{100 * np.median([v for r in done for v in r['se'].values()]):.1f}" if done else ""
    cells = (len(rows), refused, sum(flagged), sum(wrong), silent, cover(done), cover(ok), width)
    return f"| {kind} | " + " | ".join(map(str, cells)) + " |"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.dirty_recordings")
    parser.add_argument("--sets", type=int, default=50, help="recordings of a kind")
    parser.add_argument("--kind", choices=list(KINDS), action="append")
    parser.add_argument("--case", choices=list(CASES), action="append")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--rate", type=float, default=10.0, help="samples a second")
    parser.add_argument("--without", choices=list(STEPS), help="a step of the cleaning")
    parser.add_argument("--out", type=Path, help="file for a line of JSON for each recording")
    chosen = parser.parse_args()
    names = chosen.case or list(CASES)
    cases = {name: replace(CASES[name], rate=chosen.rate) for name in names}
    if chosen.without:
        module, function, replacement = STEPS[chosen.without]
        setattr(module, function, replacement)
    exact = {n: friction(c, np.arange(int(c.end * c.rate)) / c.rate) for n, c in cases.items()}
    columns = ("kind", "recordings", "refused", "flagged", "wrong", "wrong, no warning")
    columns += ("95 %", "of those ok", "SE, %")
    print("| " + " | ".join(columns) + " |\n" + "|---" * len(columns) + "|")
    for kind in chosen.kind or list(KINDS):
        rows = []
        for k in range(chosen.sets):
            name = names[k % len(names)]
            rows.append(answer(kind, name, cases[name], exact[name], chosen.seed + k))
            if chosen.out:
                with chosen.out.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(rows[-1]) + "\n")
        print(line_of(kind, rows), flush=True)


if __name__ == "__main__":
    main()
