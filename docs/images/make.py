"""Draw the pictures of the README and the tutorials again: ``python docs/images/make.py``.

Figure 11 is that of the report that ``asperity reproduce`` writes.
"""

from pathlib import Path

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.figure import Figure
from PIL import Image

import asperity as asp
from asperity.figures.stick_slip import draw_stick_slip
from asperity.figures.style import style
from asperity_papers.bureau2000.curves import WORDS
from asperity_papers.bureau2000.machine import Machine
from asperity_papers.bureau2000.response_figures import figure_11

FOLDER = Path(__file__).parent


def vibration() -> Figure:
    """Drop of the mean friction against amplitude and frequency (docs/tutorials/vibration.md)."""
    pmma = asp.materials.load("bureau2000")
    slider = asp.Slider(pmma.law("elasto-plastic"), spring="0.5 N/um", mass=pmma.M, load=pmma.W0)
    velocities = {1e-6: "1 µm/s", 1e-5: "10 µm/s", 1e-4: "100 µm/s"}
    epsilon, frequency = np.linspace(0.0, 0.4, 41), np.geomspace(0.05, 1000.0, 61)
    figure, (left, right) = plt.subplots(
        1, 2, figsize=(6.4, 2.6), sharey=True, layout="constrained"
    )
    for velocity, label in velocities.items():
        r = asp.periodic_response(slider, velocity=velocity, epsilon=epsilon, frequency=120.0)
        left.plot(100 * epsilon, -100 * r.delta_mu / r.mu_ss, label=label)
        r = asp.periodic_response(slider, velocity=velocity, epsilon=0.24, frequency=frequency)
        right.plot(frequency, -100 * r.delta_mu / r.mu_ss, label=label)
    left.set(xlabel="modulation of the load (%), at 120 Hz", ylabel="friction falls by (%)")
    right.set(xlabel="frequency (Hz), at 24 %", xscale="log")
    left.legend(title="sliding at")
    return figure


def velocity_step() -> Figure:
    """A fit of the sample recording, and what it leaves (docs/tutorials/velocity_step.md)."""
    run = asp.inference.recorded_run(asp.samples.velocity_steps())
    return asp.inference.fit(run, "rice-ruina", ["A", "B", "D0"]).plot()


def of_python() -> dict[str, Figure]:
    """Pictures of docs/tutorials/python.md."""
    law = asp.laws.get_law("rice-ruina")(mu0=0.6, A=0.009, B=0.0125, D0="8 um", V0="1 um/s")
    slider = asp.Slider(law, spring="20 N/um", load="10 kN")
    epsilon = np.linspace(0.05, 0.4, 8)
    soft = asp.Slider(law, spring="2 N/um", load="10 kN", mass="10 kg")
    response = asp.periodic_response(slider, velocity="1 um/s", epsilon=epsilon, frequency="1 Hz")
    return {
        "measured-steps.png": asp.measure(asp.samples.velocity_steps()).plot(),
        "periodic-response.png": response.plot(),
        "stick-slip-response.png": asp.experiment.stick_slip_response(
            soft, velocity=np.geomspace(1e-6, 1e-2, 5)
        ).plot(),
    }


def stick_slip() -> Figure:
    """Slip events of the sample recording (docs/stick_slip.md)."""
    result = asp.measure(asp.samples.stick_slip(), stiffness="0.05 N/um", velocity="100 um/s")
    return draw_stick_slip(result)


def save(figure: Figure, name: str) -> None:
    """Write a PNG with a palette of 64 colours: a third of the size, and no visible loss."""
    target = FOLDER / name
    figure.savefig(target, dpi=150, metadata={"Software": None})
    with Image.open(target) as picture:
        small = picture.convert("RGB").quantize(64, dither=Image.Dither.NONE)
    small.save(target, optimize=True)


def main() -> None:
    """Write all of them."""
    with style():
        save(WORDS.figures["figure-11"].draw(figure_11(Machine())), "figure-11.png")
        save(vibration(), "vibration.png")
        save(stick_slip(), "stick-slip.png")
        save(velocity_step(), "velocity-step.png")
        for name, figure in of_python().items():
            save(figure, name)


if __name__ == "__main__":
    main()
