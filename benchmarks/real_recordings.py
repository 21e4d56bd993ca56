"""A, B, D0 and K of real velocity steps by four laws, with the choice of the window.

``python -m benchmarks.real_recordings FOLDER``

Each law is fitted in three windows. An estimate is the mean over the windows, weighted by
precision; its uncertainty adds the spread over the windows to that of noise, as
`asperity.measurement` does for velocity steps. The last column is the standard error that least
squares with white noise gives in the middle window.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from asperity.inference import RunOptions, fit, recorded_run

#: File, windows (s), the middle one first, and the channel of the load where it has no usual name.
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
        runs = [recorded_run(folder / file, window=w, name=file) for w in windows]
        for law, fixed in LAWS.items():
            fits = [fit(run, law, FREE, fixed=fixed, starts=16) for run in runs]
            start = {n: fits[0].values[n] for n in FREE}
            options = RunOptions(order=0)
            white = fit(runs[0], law, FREE, fixed=fixed, starts=4, start=start, runs=options)
            for name in (*FREE, "K"):
                scale = np.array([1 / run.W0 if name == "K" else 1.0 for run in runs])
                value = scale * [f.parameters[name].value for f in fits]
                noise = scale * [f.parameters[name].se for f in fits]
                weight = noise**-2.0 / np.sum(noise**-2.0)
                mean = float(weight @ value)
                spread = float(np.sqrt(weight @ (value - mean) ** 2))
                total = float(np.hypot(weight @ noise, spread))
                print(
                    f"{title} | {law} | {'K/W0' if name == 'K' else name} | {mean:.4g} | "
                    f"{total:.2g} | {weight @ noise:.2g} | {spread:.2g} | "
                    f"{scale[0] * white.parameters[name].se:.2g}",
                    flush=True,
                )
            noise_model = fits[0].objective.terms[0].noise
            print(
                f"{title} | {law} | AICc {fits[0].aicc:.2f}, {noise_model['model']}, "
                f"{noise_model['effective_samples']:.0f} of {noise_model['samples']}, p "
                f"{noise_model['whiteness_p']:.2g}",
                flush=True,
            )


if __name__ == "__main__":
    main()
