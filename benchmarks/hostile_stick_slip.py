"""Measurements of faulty stick-slip recordings: wrong numbers although all checks are ok.

    python -m benchmarks.hostile_stick_slip [--recordings 100] [--seed 0]

`benchmarks.stick_slip_recordings` has the motions, the recorder and the definition of a fault.
"""

from benchmarks.populations import seeds
from benchmarks.stick_slip_recordings import judged, recorded, tables


def main():
    """Print faults, and shares of intervals that contain the truth."""
    rows = [{"seed": k} | judged(recorded(k)) for k in seeds(__doc__, 100)]
    print("\n".join(tables(rows)))


if __name__ == "__main__":
    main()
