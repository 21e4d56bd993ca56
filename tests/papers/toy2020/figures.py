"""The paper's one figure."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from asperity.papers.report import FigureTable, PaperFigure


def swing():
    t = np.linspace(0.0, 1.0, 11)
    data = pd.DataFrame({"t": t, "x": np.cos(10.0 * t)})

    def draw():
        figure = Figure()
        figure.subplots().plot(data["t"], data["x"])
        return figure

    table = FigureTable(
        "swing", data, ("the block's motion",), {"t": "s; time", "x": "m; position"}
    )
    return PaperFigure(
        "swing", "Figure 1", "It swings", "Position.", "A cosine.", draw, (table,), 11
    )


FIGURES = (swing,)
