"""Measurements of faulty stick-slip recordings: wrong numbers although all checks are ok.

    python -m benchmarks.hostile_stick_slip [--recordings 100] [--seed 0]

`benchmarks.stick_slip_recordings` has the motions, the recorder and the definition of a fault.
"""

import argparse

from benchmarks.stick_slip_recordings import judged, recorded, tables


def main():
    """Print faults, and shares of intervals that contain the truth."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--recordings", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    chosen = parser.parse_args()
    seeds = range(chosen.seed, chosen.seed + chosen.recordings)
    print("\n".join(tables([{"seed": k} | judged(recorded(k)) for k in seeds])))


if __name__ == "__main__":
    main()
