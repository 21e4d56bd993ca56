"""Draws docs/theory/stabilisation.png: python docs/theory/draw_stabilisation.py (two minutes)."""

from pathlib import Path

import numpy as np

from asperity.figures.style import style
from asperity.study.map import Axis
from asperity.study.threshold import natural_scales
from asperity_papers.bureau2000.machine import Machine
from asperity_papers.bureau2000.stability import (
    draw_stabilisation,
    resonance_map,
    stabilisation_diagram,
)

_, f_c = natural_scales(Machine().slider("elasto-plastic"), 1e-6)
frequencies = f_c * np.concatenate([np.geomspace(1.0, 4.2, 22), np.geomspace(5.0, 300.0, 9)])
cuts = stabilisation_diagram(np.linspace(0.005, 0.3, 25), frequencies)
plane = resonance_map(Axis("frequency", 600.0, 1100.0, 51), Axis("epsilon", 0.02, 0.3, 29))
with style():
    figure = draw_stabilisation(cuts, f_c, plane)
    target = Path(__file__).with_name("stabilisation.png")
    figure.savefig(target, dpi=110, metadata={"Software": None})
