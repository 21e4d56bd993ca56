"""Fits to tables with random true values: missed minima, and coverage of the intervals.

    python -m benchmarks.random_truths [--law elasto-plastic] [--tables 40] [--seed 0] [--slow]
        [--few] [--compare] [--out FILE]

Each table has 25 to 60 rows at two to four velocities of 0.1 to 100 um/s and one to three
frequencies of 1 Hz to 1 kHz, with mu0, A, B, D0, eps_ratio (and lambda or alpha) drawn over a
decade or two, 1 % noise in both parts of the harmonics and 0.3 % in the mean; every second table
has no phases. All these parameters are free. A minimum is missed if a minimisation from the truth
ends lower by 0.01. With --slow, each row has another velocity of 0.3 to 10 um/s and another
frequency of 0.1 to 10 Hz, amplitudes are below 0.25 and the spring is 1.1 to 4 times as stiff as
stable sliding needs. With --few, tables have 8 to 13 rows with the mean, mu1, or both, which often
leave parameters undetermined; estimates whose response is unstable are counted. With --compare,
each table is compared with three laws, and the verdicts on the true law are counted.
"""

from __future__ import annotations

import argparse
import json
import time
from functools import partial

import numpy as np

from asperity.inference import compare, fit, table_of
from asperity.laws import get_law
from asperity.orbit import Outcome, response_function
from benchmarks.populations import inside, log_uniform

#: Rows that are computed together, so that all tables share one compiled program.
ROWS = 64

#: Free parameters of a comparison, if the law has them.
FREE = ("mu0", "A", "B", "D0", "eps_ratio", "alpha", "lambda")


def drawn_truth(rng, law):
    """Free parameters in SI."""
    truth = {
        "mu0": rng.uniform(0.3, 0.8),
        "A": log_uniform(rng, 0.004, 0.03),
        "B": log_uniform(rng, 0.004, 0.05),
        "D0": log_uniform(rng, 1e-7, 2e-5),
        "eps_ratio": rng.uniform(0.25, 0.95),
    }
    if law == "elasto-plastic":
        truth["lambda"] = log_uniform(rng, 1e-7, 3e-6)
    if law == "linker-dieterich":
        truth["alpha"] = rng.uniform(0.05, 0.5)
    return truth


def fast_point(rng, law):
    """True values, fixed numbers and operating points that the fast method solves."""
    truth = drawn_truth(rng, law)
    K, W0 = log_uniform(rng, 2e4, 2e6), log_uniform(rng, 3, 16)
    rows = int(rng.integers(30, 61))
    velocities = log_uniform(rng, 1e-7, 1e-4, int(rng.integers(2, 5)))
    frequencies = log_uniform(rng, 1, 1000, int(rng.integers(1, 4)))
    point = {"V": rng.choice(velocities, rows), "frequency": rng.choice(frequencies, rows)}
    point["epsilon"] = rng.uniform(0.02, 0.6, rows)
    return truth, {"V0": 1e-6, "K": K, "W0": W0}, point


def slow_point(rng, law):
    """As `fast_point`, under slow modulation with a spring that makes steady sliding stable."""
    truth = drawn_truth(rng, law)
    while truth["B"] <= truth["A"]:
        truth = drawn_truth(rng, law)
    truth["D0"] = log_uniform(rng, 2e-7, 5e-6)
    truth["eps_ratio"] = rng.uniform(0.5, 0.95)
    W0 = log_uniform(rng, 3, 16)
    K = (truth["B"] - truth["A"]) * W0 / truth["D0"] * log_uniform(rng, 1.1, 4)
    rows = int(rng.integers(30, 61))
    point = {"V": log_uniform(rng, 3e-7, 1e-5, rows), "frequency": log_uniform(rng, 0.1, 10, rows)}
    point["epsilon"] = rng.uniform(0.02, 0.25, rows)
    return truth, {"V0": 1e-6, "K": K, "W0": W0}, point


def drawn_table(seed, law, response, drawn=fast_point):
    """Random true values, fixed numbers, and a table of their stable responses with noise."""
    rng = np.random.default_rng([seed, len(law)])
    while True:
        truth, fixed, point = drawn(rng, law)
        rows = point["V"].size
        padded = {n: np.pad(v, (0, ROWS - rows), mode="edge") for n, v in point.items()}
        padded["epsilon"] = truth["eps_ratio"] * padded["epsilon"]
        numbers = {n: v for n, v in truth.items() if n != "eps_ratio"} | fixed
        everything = padded | {n: np.full(ROWS, v) for n, v in numbers.items()}
        exact = response(everything)
        # An unstable response is never read.
        converged = (np.asarray(exact.outcome) == Outcome.CONVERGED) & (
            response.growth(everything) < 0
        )
        converged = converged[:rows]
        if converged.sum() >= 25:
            break
    mean, harmonics = np.asarray(exact.mean_friction)[:rows], np.asarray(exact.harmonics)[:rows]
    error = 3e-3 * np.abs(mean)
    columns = {**point, "mean_friction": mean + error * rng.normal(size=rows)}
    columns["mean_friction_err"] = error
    for n in (1, 2):
        c = harmonics[:, n - 1]
        error = 1e-2 * np.abs(c) + 1e-7
        c = c + error * (rng.normal(size=rows) + 1j * rng.normal(size=rows))
        columns |= {f"mu{n}": np.abs(c), f"mu{n}_err": error}
        if seed % 2 == 0:
            columns |= {f"phase{n}": np.angle(c), f"phase{n}_err": error / np.abs(c)}
    return truth, fixed, table_of({name: column[converged] for name, column in columns.items()})


def missed_by(result, truth):
    """Difference of chi-squared from the minimum next to the truth.

    0 if a response is unstable at that minimum alone: a fit passes it over.
    """
    objective = result.objective
    end = objective.minimise(objective.coordinates(truth))
    here = objective.coordinates(result.values)
    passed_over = objective.instability(end.u) and not objective.instability(here)
    return 0.0 if passed_over else result.chi2 - end.chi2


def few_readings(table, rng):
    """Some rows of a table, with one or two observables."""
    rows = rng.choice(table.rows, int(rng.integers(8, 14)), replace=False)
    columns = {name: column[rows] for name, column in table.points.items()}
    for name in [("mean_friction",), ("mu1",), ("mean_friction", "mu1")][rng.integers(3)]:
        columns |= {name: table.values[name][rows], f"{name}_err": table.errors[name][rows]}
    return table_of(columns)


def fitted(seed, law, response, drawn=fast_point, *, few=False):
    """Result of a fit to one table, compared with the truth."""
    truth, fixed, table = drawn_table(seed, law, response, drawn)
    if few:
        table = few_readings(table, np.random.default_rng(seed))
    began = time.process_time()
    result = fit(table, law, list(truth), fixed=fixed)
    seconds = time.process_time() - began
    return {
        "seed": seed,
        "p_value": result.p_value,
        "missed_by": missed_by(result, truth),
        "inside": inside(result.parameters, truth),
        "undetermined": result.undetermined,
        "unstable": any("is unstable" in warning for warning in result.warnings),
        "minima": 1 + len(result.optima),
        "seconds": seconds,
    }


def compared(seed, law, response, drawn=fast_point):
    """Verdict on the true law in a comparison of three laws."""
    truth, fixed, table = drawn_table(seed, law, response, drawn)
    laws = ["rice-ruina", "linker-dieterich", "elasto-plastic"]
    began, wall = time.process_time(), time.perf_counter()
    result = compare(table, laws, list(FREE), fixed=fixed, evidence=False)
    seconds, waited = time.process_time() - began, time.perf_counter() - wall
    true = result.laws[law]
    return {
        "seed": seed,
        "left_out": list(result.left_out),
        "excluded": true.excluded,
        "p_value": true.fit.p_value,
        "missed_by": missed_by(true.fit, truth),
        "chi2": {name: judged.fit.chi2 for name, judged in result.laws.items()},
        "verdict": result.verdict,
        "seconds": seconds,
        "wall": waited,
    }


def main():
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.random_truths", description=__doc__.splitlines()[0]
    )
    parser.add_argument("--law", default="elasto-plastic")
    parser.add_argument("--tables", type=int, default=40)
    parser.add_argument("--seed", type=int, default=0, help="of the first table")
    parser.add_argument("--slow", action="store_true", help="modulation of 0.1 to 10 Hz")
    parser.add_argument("--few", action="store_true", help="8 to 13 rows, one or two observables")
    parser.add_argument("--compare", action="store_true", help="compare three laws")
    parser.add_argument("--out", help="file for a line of JSON for each table")
    chosen = parser.parse_args()
    response = response_function(get_law(chosen.law), search="direct" if chosen.slow else False)
    drawn = slow_point if chosen.slow else fast_point
    rows = []
    for seed in range(chosen.seed, chosen.seed + chosen.tables):
        each = compared if chosen.compare else partial(fitted, few=chosen.few)
        rows.append(each(seed, chosen.law, response, drawn))
        if chosen.out:
            with open(chosen.out, "a", encoding="utf-8") as file:
                file.write(json.dumps(rows[-1]) + "\n")
    missed = sum(row["missed_by"] > 0.01 for row in rows)
    seconds = np.array([row["seconds"] for row in rows])
    unlikely = sum(row["p_value"] < 0.05 for row in rows)
    print(f"{chosen.law}: {len(rows)} tables, {missed} minima missed, {unlikely} with p < 0.05")
    print(
        f"processor time: {np.median(seconds):.2f} s each (median), {seconds.max():.1f} s at most"
    )
    if chosen.compare:
        excluded, left = (sum(map(bool, (r[n] for r in rows))) for n in ("excluded", "left_out"))
        print(f"true law excluded: {excluded}; rows left out of tables without outliers: {left}")
        return
    unstable = [row for row in rows if row["unstable"]]
    known = sum(not row["undetermined"] for row in unstable)
    print(f"unstable estimates: {len(unstable)}, of these {known} with all parameters determined")
    print("| parameter | 68.3 % | 95 % |\n|---|---|---|")
    for name in rows[0]["inside"]:
        share = 100 * np.mean([row["inside"][name] for row in rows], axis=0)
        print(f"| {name} | {share[0]:.0f} | {share[1]:.0f} |")


if __name__ == "__main__":
    main()
