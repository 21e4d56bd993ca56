"""Draw the pictures of the page on sweeps: ``python docs/images/sweeps.py tides.zarr study.zarr``.

The stores are those of ``examples/tides.toml`` and ``examples/drop_and_stability.toml``. Only the
slices that are drawn are read.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import xarray
from cmcrameri import cm
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from PIL import Image

from asperity.figures.style import (
    ELASTO_PLASTIC,
    GREY,
    LINKER_DIETERICH,
    RICE_RUINA,
    new_figure,
    style,
)

HERE = Path(__file__).parent


def save(figure: Figure, name: str) -> None:
    """Write a PNG with a palette of 64 colours: a third of the size, and no visible loss."""
    target = HERE / name
    figure.savefig(target, dpi=130, metadata={"Software": None})
    with Image.open(target) as picture:
        small = picture.convert("RGB").quantize(64, dither=Image.Dither.NONE)
    small.save(target, optimize=True)


def tides(store: str) -> Figure:
    """Gain of the force and stability around the critical period."""
    found = xarray.open_zarr(store, chunks=None)
    turns, ratio = found["slip_ratio"].values, found["stiffness_ratio"].values
    gain = (found["mu1"] / found["mu_ss"] / 0.002).values
    critical = 2 * np.pi * np.sqrt(float(found["A"] / (found["B"] - found["A"])))
    figure = new_figure(7.2, 3.2)
    left, right = figure.subplots(1, 2, width_ratios=(1.25, 1))
    norm = LogNorm(gain.min(), gain.max())
    mesh = left.pcolormesh(turns, ratio, gain, cmap=cm.batlow, norm=norm, rasterized=True)
    unstable = np.ma.masked_less(1 - found["stable"].values, 0.5)
    left.contourf(turns, ratio, unstable.filled(0), levels=[0.5, 1.5], colors="none",
                  hatches=["////"])  # fmt: skip
    left.contour(turns, ratio, found["log_multiplier"].values, levels=[0], colors="white")
    figure.colorbar(mesh, ax=left, label=r"gain $\mu_1/(\mu_{ss}\varepsilon)$", format="%g")
    left.set_xlabel(r"$V T/D_0$")
    left.set_ylabel(r"$K/K_c$")
    left.text(4.9, 1.03, "unstable", color="white", ha="left")
    cuts = ((1.05, RICE_RUINA), (1.2, LINKER_DIETERICH), (1.5, ELASTO_PLASTIC))
    for value, colour in cuts:
        row = int(np.abs(ratio - value).argmin())
        steady = found["stable"].values[row] == 1
        right.plot(turns, gain[row], color=colour, linestyle="dotted")
        line = np.where(steady, gain[row], np.nan)
        right.plot(turns, line, color=colour, label=rf"$K = {ratio[row]:.3g}\,K_c$")
    for period, text in ((critical / 2, r"$T_c/2$"), (critical, r"$T_c$")):
        right.axvline(period, color=GREY, linewidth=0.6)
        right.text(period + 0.1, 0.55, text, color=GREY)
    right.set_yscale("log")
    right.set_ylim(0.5, None)
    right.set_xlabel(r"$V T/D_0$")
    right.set_ylabel("gain")
    right.legend(loc="upper left", fontsize="small")
    return figure


def study(store: str) -> Figure:
    """Drop and stability of all laws over amplitude and stiffness, and mu1 over the slip ratio."""
    found = xarray.open_zarr(store, chunks=None)
    law = np.asarray(found["law"].values, dtype=object)
    alpha, lambda_ = found["alpha"].values, found["lambda"].values
    rows = [
        (int(np.flatnonzero(law == "rice-ruina")[0]), "Rice-Ruina"),
        (int(np.flatnonzero(law == "ruina-slip")[0]), "Ruina's slip law"),
        (int(np.flatnonzero(law == "strength-area")[0]), "strength times area"),
        *(
            (int(np.nanargmin(np.abs(alpha - value))), rf"Linker-Dieterich, $\alpha$ = {value:g}")
            for value in (0.02, 0.4)
        ),
        (
            int(np.nanargmin(np.abs(lambda_ - 0.4e-6))),
            r"elasto-plastic, $\lambda$ = 0.4 µm",
        ),
    ]
    epsilon, ratio = found["epsilon"].values, found["stiffness_ratio"].values
    slip = int(np.abs(found["slip_ratio"].values - 0.02).argmin())
    parts = {
        name: [found[name][row, slip].values for row, _ in rows]
        for name in ("delta_mu", "log_multiplier")
    }
    drop = [-part for part in parts["delta_mu"]]
    figure = new_figure(7.2, 4.6)
    axes = figure.subplots(2, 3, sharex=True, sharey=True)
    top = float(np.nanmax(drop))
    for axis, (_, title), values, logs in zip(
        axes.flat, rows, drop, parts["log_multiplier"], strict=True
    ):
        mesh = axis.pcolormesh(epsilon, ratio, values, cmap=cm.batlow, vmin=0, vmax=top,
                               rasterized=True)  # fmt: skip
        axis.contour(epsilon, ratio, logs, levels=[0], colors="white", linewidths=1.2)
        axis.set_yscale("log")
        axis.set_yticks([0.5, 1, 2, 5], ["0.5", "1", "2", "5"])
        axis.minorticks_off()
        axis.set_title(title, fontsize="small")
    for axis in axes[-1]:
        axis.set_xlabel(r"$\varepsilon$")
    for axis in axes[:, 0]:
        axis.set_ylabel(r"$K/K_c$")
    figure.colorbar(mesh, ax=axes, label=r"drop of the mean $-\Delta\mu$")
    return figure


def main(tides_store: str, study_store: str = "") -> None:
    """Draw what there is a store for."""
    with style():
        save(tides(tides_store), "sweep-tides.png")
        if study_store:
            save(study(study_store), "sweep-study.png")


if __name__ == "__main__":
    main(*sys.argv[1:])
