"""The paper's one figure."""

import numpy as np
import pandas as pd

from asperity.ledger import FigureNumbers, figure_words


def swing():
    t = np.linspace(0.0, 1.0, 11)
    data = pd.DataFrame({"curve": "block", "t": t, "x": np.cos(10.0 * t)})
    numbers = FigureNumbers("swing", data, {"frequency": 10.0 / (2 * np.pi)})
    tables = {"swing": (data, ("the block's motion",))}
    return figure_words(__package__).figure(numbers, tables)


FIGURES = (swing,)
