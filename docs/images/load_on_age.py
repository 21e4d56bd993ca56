"""Draw the figure of docs/design.md from the record of the plan.

asperity design examples/load_on_age.toml --json > record.json
python docs/images/load_on_age.py record.json
"""

import json
import math
import sys
from pathlib import Path

from matplotlib.figure import Figure

from asperity import materials
from asperity.figures.style import GREY, LINKER_DIETERICH, STATED, style

TARGET = Path(__file__).with_name("load-on-age.png")


def main(record: str) -> None:
    """Readings that one frequency alone takes, beside the design and an even grid."""
    found = json.loads(Path(record).read_text(encoding="utf-8"))
    levels = [x for x in found["alone"]["frequency"] if x["times_more"] is not None]
    frequency = [x["level"] for x in levels]
    number = [found["readings"] * x["times_more"] for x in levels]
    pmma = materials.load("bureau2000")
    contrast = math.sqrt((pmma.B - pmma.A) / pmma.A)
    with style():
        figure = Figure(figsize=(5.2, 3.4), layout="constrained")
        axes = figure.subplots()
        axes.loglog(frequency, number, "o-", color=LINKER_DIETERICH, label="one frequency alone")
        grid = found["readings"] * found["even_grid"]["times_fewer"]
        axes.axhline(grid, color=GREY, linestyle="dashed", label="even grid")
        axes.axhline(found["readings"], color=GREY, label="design")
        for V in (1e-6, 1e-5):
            critical = contrast * V / pmma.D0 / (2 * math.pi)
            axes.axvline(critical, color=STATED, linestyle="dotted")
            axes.annotate(
                f"stick-slip,\n{V * 1e6:g} µm/s",
                (critical, 1.02),
                color=STATED,
                ha="center",
                xycoords=("data", "axes fraction"),
                fontsize="small",
            )
        axes.set(
            xlabel="frequency of the modulation (Hz)", ylabel="readings for the same error of α"
        )
        axes.legend()
        figure.savefig(TARGET, dpi=130, metadata={"Software": None})


if __name__ == "__main__":
    main(sys.argv[1])
