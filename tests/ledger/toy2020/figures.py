"""The paper's one figure."""

import numpy as np
import pandas as pd

from asperity.ledger import FigureNumbers, FigureTable, figure_words

COLUMNS = {"curve": "name of the curve", "t": "s; time", "x": "m; position"}


def swing():
    t = np.linspace(0.0, 1.0, 11)
    data = pd.DataFrame({"curve": "block", "t": t, "x": np.cos(10.0 * t)})
    numbers = FigureNumbers("swing", data, COLUMNS, {"frequency": 10.0 / (2 * np.pi)})
    table = FigureTable("swing", data, ("the block's motion",), COLUMNS)
    return figure_words(__package__).figures["swing"].figure(numbers, (table,))


FIGURES = (swing,)
