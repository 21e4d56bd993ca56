"""A, B, D0 and K of real velocity steps by four laws, with the uncertainty of the window.

``python -m benchmarks.real_recordings FOLDER``

Each law is fitted in three windows by `asperity.inference.fit_windows`: an estimate is the mean
over the windows, weighted by precision (of logarithms, as all parameters are positive); its
uncertainty adds the spread over the windows to that of noise. Columns: law, parameter, value, 95 %
interval, standard errors by noise and by the window, standard error of least squares with white
noise in the first window, and the value in each window.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from asperity.inference import RunOptions, fit, fit_windows

#: File and windows (s), the middle one first.
RECORDINGS = {
    "basalt, 3 to 10 um/s": (
        "velstep4_BRAVA_expb819_basalt.txt",
        ((11640, 11700), (11655, 11690), (11620, 11720)),
    ),
    "sepiolite, 0.2 to 2 um/s": (
        "velstep1_TR2_exp013_sepiolite.txt",
        ((10150, 10600), (10200, 10500), (10000, 10800)),
    ),
}
LAWS = {"rice-ruina": {}, "ruina-slip": {}, "perrin-rice-zheng": {}, "nagata": {"c": 2.0}}
FREE = ["A", "B", "D0"]


def main() -> None:
    """Print a line for each recording, law and parameter."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    folder = parser.parse_args().folder
    for title, (file, windows) in RECORDINGS.items():
        if not (folder / file).is_file():
            print(f"{title}: no {file} in {folder}")
            continue
        for law, fixed in LAWS.items():
            result = fit_windows(
                folder / file, law, FREE, windows, reading={"name": file}, fixed=fixed
            )
            first = result.fits[0]
            (term,) = first.objective.terms
            run = term.run
            start = {n: first.values[n] for n in FREE}
            options = RunOptions(order=0)
            white = fit(run, law, FREE, fixed=fixed, starts=4, start=start, runs=options)
            for name in (*FREE, "K"):
                p = result.parameters[name]
                scale = 1 / run.W0 if name == "K" else 1.0
                unit = "1/m" if name == "K" else p.unit
                column = ("K/W0" if name == "K" else name) + (f" ({unit})" if unit else "")
                low, high = (scale * end for end in p.interval_95)
                each = ", ".join(f"{scale * value:.4g}" for value in p.values)
                print(
                    f"| {law} | {column} | {scale * p.value:.4g} | {low:.3g} to {high:.3g} | "
                    f"{scale * p.se_noise:.2g} | {scale * p.se_window:.2g} | "
                    f"{scale * white.parameters[name].se:.2g} | {each} |"
                    + (" undetermined" if name in result.undetermined else ""),
                    flush=True,
                )
            noise = term.noise
            print(
                f"{title}, {law}: AICc {first.aicc:.2f}, {noise['model']}, "
                f"{noise['effective_samples']:.0f} of {noise['samples']}, p "
                f"{noise['whiteness_p']:.2g}",
                flush=True,
            )


if __name__ == "__main__":
    main()
