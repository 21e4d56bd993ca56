"""Random points over the whole range: their outcomes, and the residuals of the answers.

    python -m benchmarks.whole_range --points 100000 --out whole_range

Every answer that claims convergence is tested in the equations (`benchmarks.residual`). Points are
solved in slices, each of which is written when it is done; another call continues after the last
one. Two calls with `--part 1/2` and `--part 2/2` share the work between two cores.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from pathlib import Path

import numpy as np

from asperity.orbit import Outcome, PeriodicResponse
from benchmarks.residual import LAWS, Numbers, answer, draw, faults, faults_marched

SLICE = 2000
#: Samples of the waveform; those for narrow pulses, and how many such points are solved together;
#: and those for pulses between two samples, within which round-off grows a thousandfold.
SAMPLES, FINE_SAMPLES, _FEW, FINEST_SAMPLES = 2**12, 2**20, 32, 2**24


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.whole_range", description=__doc__)
    parser.add_argument("--law", choices=LAWS, default="rice-ruina")
    parser.add_argument("--points", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, required=True, help="folder for finished slices")
    parser.add_argument("--part", type=_part, default="1/1", help="k/n: every n-th slice from k")
    return parser.parse_args()


def _part(text: str) -> tuple[int, int]:
    try:
        k, n = (int(number) for number in text.split("/"))
    except ValueError:
        k, n = 0, 0
    if not 1 <= k <= n:
        raise argparse.ArgumentTypeError(f"must be k/n with 1 <= k <= n, such as 1/2, got {text!r}")
    return k, n


def _solved(law: str, numbers: Numbers) -> dict[str, np.ndarray]:
    """Outcome, detail and verdict of the points of a slice, and the processor time."""
    begun = time.process_time()
    response = answer(law, numbers, SAMPLES)
    seconds = time.process_time() - begun
    converged = np.flatnonzero(response.converged)
    wrong, resolved = np.zeros((2, len(response.outcome)), dtype=bool)
    wrong[converged], resolved[converged] = faults(
        _rows(numbers, converged),
        response.waveform[:, converged],
        response.mean_friction[converged],
        response.harmonics[converged],
    )
    unresolved = converged[~resolved[converged]]
    marched = np.zeros_like(resolved)
    for rows in np.array_split(unresolved, -(-len(unresolved) // _FEW)) if len(unresolved) else ():
        _test_finer(law, numbers, response, rows, FINE_SAMPLES, (wrong, resolved, marched))
    for row in np.flatnonzero(wrong & marched):
        _test_finer(
            law, numbers, response, np.array([row]), FINEST_SAMPLES, (wrong, resolved, marched)
        )
    resolved |= marched
    return {
        "outcome": response.outcome,
        "detail": response.detail,
        "wrong": wrong,
        "checked": resolved,
        "marched": marched,
        "seconds": np.array(seconds),
    }


def _test_finer(
    law: str,
    numbers: Numbers,
    response: PeriodicResponse,
    rows: np.ndarray,
    samples: int,
    verdict: tuple[np.ndarray, np.ndarray, np.ndarray],
) -> None:
    """Test points with more samples, and by integration if these do not resolve the pulses either.

    Mean and harmonics are those of the answer, the waveform that of methods for narrow pulses.
    """
    wrong, resolved, marched = verdict
    finer = answer(law, _rows(numbers, rows), samples, ("series", "collocation"))
    rows, waveform = rows[finer.converged], finer.waveform[:, finer.converged]
    part, mean, harmonics = (
        _rows(numbers, rows),
        response.mean_friction[rows],
        response.harmonics[rows],
    )
    wrong[rows], resolved[rows] = faults(part, waveform, mean, harmonics)
    narrow = ~resolved[rows]
    marched[rows] = narrow
    wrong[rows[narrow]] = faults_marched(
        _rows(part, narrow), waveform[:, narrow], mean[narrow], harmonics[narrow]
    )


def _rows(numbers: Numbers, rows: np.ndarray) -> Numbers:
    return {name: a[rows] for name, a in numbers.items()}


def _report(files: list[Path], of: int) -> str:
    slices = [dict(np.load(file)) for file in files]
    whole = {name: np.hstack([s[name] for s in slices]) for name in slices[0]}
    counts = Counter(Outcome(k).name for k in whole["outcome"])
    lines = [f"{len(whole['outcome'])} points in {len(files)} of {of} slices"]
    lines += [f"  {name:26s} {count:7d}" for name, count in counts.most_common()]
    converged = whole["outcome"] == Outcome.CONVERGED
    right = converged & whole["checked"] & ~whole["wrong"]
    lines += [
        f"obey the equations         {right.sum():9d}",
        f"  of them by integration   {(right & whole['marched']).sum():9d}",
        f"not checked                {(converged & ~whole['checked']).sum():9d}",
        f"contradict them            {whole['wrong'].sum():9d}",
        f"processor time             {whole['seconds'].sum():9.0f} s",
    ]
    return "\n".join(lines)


def main() -> None:
    arguments = _arguments()
    arguments.out.mkdir(parents=True, exist_ok=True)
    numbers = draw(arguments.law, arguments.points, arguments.seed)
    slices = range(0, arguments.points, SLICE)
    first, step = arguments.part
    name = f"{arguments.law}-{arguments.seed}-{arguments.points}-{{}}.npz".format
    for start in slices[first - 1 :: step]:
        file = arguments.out / name(start)
        if not file.exists():
            rows = np.arange(start, min(start + SLICE, arguments.points))
            unfinished = file.with_suffix(".part")
            with unfinished.open("wb") as stream:
                np.savez(stream, **_solved(arguments.law, _rows(numbers, rows)))
            unfinished.replace(file)
            print(f"{start} done", flush=True)
    done = [file for start in slices if (file := arguments.out / name(start)).exists()]
    print(_report(done, len(slices)))


if __name__ == "__main__":
    main()
