"""Speed and accuracy of the periodic response, compared with other integrators: `make bench`."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterator
from pathlib import Path

from benchmarks.clock import pin_to_one_core

LAWS = ("rice-ruina", "elasto-plastic")


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("--points", type=int, default=100_000, help="points of the batch")
    parser.add_argument(
        "--repeats", type=int, default=5, help="repetitions, of which the median is shown"
    )
    parser.add_argument(
        "--million", type=int, default=1_000_000, help="points of the largest call; 0 for none"
    )
    parser.add_argument("--out", type=Path, help="also write the rows to this JSON file")
    parser.add_argument("--law", choices=LAWS, help="only this law")
    return parser.parse_args()


def _rows(
    laws: tuple[str, ...], points: int, repeats: int, million: int, cores: set[int]
) -> Iterator:
    # Imported here, as libraries count the cores at import: the process is on one core by now.
    from benchmarks import ours, peers, processes, transient

    def at_most(most: int) -> int:
        return min(points, most)

    for law in laws:
        yield ours.response_row(law, points, repeats, "asperity")
        yield peers.heyoka_row(law, at_most(8192), repeats)
        yield ours.response_row(
            law, at_most(512), 1, "asperity, collocation only", methods=("collocation",)
        )
        yield peers.scipy_shooting_row(law, at_most(64))
        yield peers.scipy_marching_row(law, min(2, -(-points // 8)))
        yield peers.diffrax_marching_row(law, at_most(4))
        yield ours.rates_row(law, points, repeats)
        yield from ours.gradient_rows(law, at_most(60), 20 * repeats)
        yield ours.sensitivities_row(law, at_most(64))
        yield from processes.whole_batch_rows(law, points, repeats, cores)
    if million:
        yield from processes.whole_batch_rows(laws[-1], million, 0, cores)
    yield from processes.start_up_rows(repeats)
    yield from transient.transient_rows(min(8.0, max(0.05, points / 1000)), repeats)


def _ratios(rows: list) -> str:
    """Ratios of times on one core."""
    time = {row.what: row.microseconds for row in rows}
    lines = []
    for law in LAWS:
        ours = time.get(f"asperity, {law}")
        for peer in ("heyoka shooting", "SciPy shooting", "SciPy LSODA marching"):
            if ours and f"{peer}, {law}" in time:
                lines.append(f"{law}: {time[f'{peer}, {law}'] / ours:,.3g} x {peer}")
        rates = time.get(f"right-hand side on 32 nodes, {law}")
        if ours and rates:
            lines.append(f"{law}: {ours / rates:.3g} evaluations of the right-hand side")
    return "\n".join(lines)


def main() -> None:
    arguments = _arguments()
    cores = set(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else set()
    if not pin_to_one_core():
        print("This system cannot keep a process on one core.", file=sys.stderr)
    from benchmarks import table

    rows = []
    laws = (arguments.law,) if arguments.law else LAWS
    for row in _rows(laws, arguments.points, arguments.repeats, arguments.million, cores):
        if row is None:
            print("A peer is left out, as it is not installed.", file=sys.stderr)
            continue
        print(row.markdown(), file=sys.stderr)
        rows.append(row)
    print(table.markdown(rows))
    print("\nPer core:\n" + _ratios([row for row in rows if row.cores == 1]))
    if arguments.out:
        table.write(rows, arguments.out)


if __name__ == "__main__":
    main()
