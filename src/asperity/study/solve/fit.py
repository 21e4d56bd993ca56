"""Fits: a law fitted at every point to a table of readings, or to simulated readings."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from asperity.errors import InputError, require
from asperity.laws import Law, get_law, registered
from asperity.operating_point import respond
from asperity.parameters import (
    MODULATION,
    Output,
    Parameter,
    all_parameters,
    canonical_name,
    known_name,
    point_parameters,
)
from asperity.parameters.arguments import file_path
from asperity.parameters.columns import readable
from asperity.parameters.toml_file import file_content
from asperity.questions.sweep import FitTable, Sweep
from asperity.study.points import Answers, Points, SweepOutcome
from asperity.study.solve.kind import SolveKind

if TYPE_CHECKING:
    from asperity.inference import Fit, LockInTable

#: Outputs of a fit as a whole.
_QUALITY = (
    Output("chi2", "1", "chi-squared of data and priors"),
    Output("dof", "1", "degrees of freedom"),
    Output(
        "p_value", "1", "probability of a larger chi-squared if law and uncertainties are right"
    ),
    Output("log_likelihood", "1", "logarithm of the likelihood"),
    Output("aicc", "1", "Akaike's criterion, corrected"),
    Output("undetermined", "1", "free parameters of which the data say nothing"),
    Output("other_minima", "1", "further minima of chi-squared that the data do not exclude"),
    Output("warnings", "1", "warnings of the fit"),
)
#: Outputs of each free parameter, by the suffix of their name.
_ESTIMATE = {
    "fit": "estimate",
    "se": "standard error",
    "low": "lower end of the 95 % interval",
    "high": "upper end of the 95 % interval",
}
#: Quantities that are a column of a table or a number of the plan. The values are placeholders,
#: with which a table is read for the names of its columns.
_OPERATING = {"V": 1e-6, "epsilon": 0.1, "frequency": 1.0}
NOISE_SEED = Parameter(
    "noise_seed",
    "dimensionless",
    "count",
    "seed of the noise of simulated readings",
    place="drive",
    label="noise_seed",
)


class FitSolve(SolveKind):
    """`asperity.inference.fit` at every point.

    A number of a point is the start value of a free parameter, and the fixed value of any other
    parameter. If a point has a ``noise_seed``, its numbers are true values: the fit is to readings
    simulated at these values, with noise according to the uncertainties of the table.
    """

    name = "fit"

    def parameters(self) -> dict[str, Parameter]:
        """As in `SolveKind`."""
        from asperity.inference.unknowns import EPS_RATIO

        return {parameter.name: parameter for parameter in (EPS_RATIO, NOISE_SEED)}

    def settings(self, plan: Sweep) -> dict[str, Any]:
        """As in `SolveKind`."""
        table = _table(plan)
        free = _free(table)
        for name in (*plan.parameters, *plan.columns):
            rule, advice = "be a parameter of a harmonic load", "leave it out: fits take no other"
            require(not canonical_name(name, MODULATION), name, rule, advice=advice)
        inertia = plan.columns.get("inertia") or [plan.parameters.get("inertia", False)]
        holds = "M" not in free or all(value in (True, "true", "yes", 1) for value in inertia)
        rule, got = "be parameters of the model", "'M', which has no influence without inertia"
        require(holds, "fit.free", rule, got, "add inertia = true to parameters or fix M")
        return {
            "free": free,
            "prior": _priors(plan, table, free),
            "profile": table.profile,
            "starts": table.starts,
            "seed": table.seed,
            "data": list(table.data or ()),
            "files": {name: _digest(plan.folder / name) for name in data_files(plan)},
        }

    def supplied(self, plan: Sweep) -> tuple[str, ...]:
        """Columns that all tables have, and the free parameters if no readings are simulated."""
        table = _table(plan)
        columns = [set(_read(str(plan.folder / n), "", ()).points) for n in data_files(plan)]
        common = set.intersection(*columns) if columns else set()
        simulated = "noise_seed" in {*plan.parameters, *plan.columns}
        # A fit chooses missing start values; a simulation needs the true value of every parameter.
        return tuple(sorted(common | (set() if simulated else set(_free(table)))))

    def known_outputs(self, laws: Sequence[str], settings: Mapping[str, Any]) -> dict[str, Output]:
        """As in `SolveKind`."""
        known = {**all_parameters(map(get_law, laws)), **self.parameters()}
        estimates = [
            Output(f"{name}_{what}", known[name].unit or "1" if name in known else "1",
                   f"{words} of {name}")
            for name in settings["free"]
            for what, words in _ESTIMATE.items()
        ]  # fmt: skip
        return {output.name: output for output in (*estimates, *_QUALITY)}

    def solve_law(self, law: type[Law], points: Points, record: Mapping[str, Any]) -> Answers:
        """As in `SolveKind`."""
        answers = Answers.empty(record["outputs"], len(points))
        for row in range(len(points)):
            point = {n: float(v[row]) for n, v in points.values.items() if np.isfinite(v[row])}
            files = [] if points.data is None else [str(points.data[row])]
            _fit_point(law, point, files, row, record, answers)
        return answers


def data_files(plan: Sweep) -> list[str]:
    """Files of data that a plan names, without repetition.

    Raises
    ------
    InputError
        If there is none, or both an axis and the table ``fit`` name files.
    """
    axis = [str(name) for name in plan.columns.get("data", ())]
    table = _table(plan)
    rule = "be left out where an axis has data"
    require(not axis or not table.data, "fit.data", rule, "both", "leave one of them out")
    files = list(dict.fromkeys([*(table.data or ()), *axis]))
    for file in files:
        file_path(file, "fit.data")
    if not files:
        raise InputError(
            "fit.data must name a table of readings, got nothing; write it like "
            "data = ['readings.csv'], or add an axis of files: [axes.data] values = [...]"
        )
    return files


def _table(plan: Sweep) -> FitTable:
    assert plan.fit is not None  # a plan has the settings of its solve
    return plan.fit


def _known() -> dict[str, Parameter]:
    """Parameters of which a plan may free one or give a prior."""
    from asperity.inference.unknowns import EPS_RATIO

    return {**all_parameters(registered().values()), EPS_RATIO.name: EPS_RATIO}


def _free(table: FitTable) -> list[str]:
    """Canonical names of the free parameters."""
    known = _known()
    names = [known_name(name, known, "fit.free") for name in table.free or ()]
    require(names, "fit.free", "name parameters", "none", "write it like ['A', 'B']")
    return list(dict.fromkeys(names))


def _priors(plan: Sweep, table: FitTable, free: Sequence[str]) -> dict[str, list[Any]]:
    """Mean, standard deviation (SI), source and SI unit of each prior."""
    from asperity.inference.fitting.inputs import priors_of

    known = _known()
    written: dict[str, Any] = {}
    for name, prior in table.prior.items():
        canonical = canonical_name(name, known)
        if prior is None:
            written[str(plan.folder / name) if name.endswith(".toml") else name] = prior
        elif canonical is None or canonical not in free:
            rule = "be of free parameters"
            raise InputError("fit.prior", rule, f"'{name}'", "free it or leave it out")
        else:
            written[canonical] = prior
    priors = priors_of(written, free)
    return {name: [p.mean, p.sd, p.source, p.unit] for name, p in priors.items()}


def _digest(path: Path) -> str:
    with readable(path, "data"):
        return hashlib.sha256(file_content(path)).hexdigest()


@lru_cache(maxsize=256)
def _read(path: str, digest: str, for_all: tuple[tuple[str, float], ...]) -> LockInTable:
    """A table; its file must not have changed since the plan was checked."""
    from asperity.inference import read_table

    rule, advice = "not change while a sweep runs", "restore the file, or choose another store"
    got = f"'{path}', which has changed since the sweep began"
    require(not digest or _digest(Path(path)) == digest, "data", rule, got, advice)
    # Without a digest only the names of the columns are needed.
    return read_table(path, dict(for_all) if digest else _OPERATING)


def _fit_point(
    law: type[Law],
    values: dict[str, float],
    files: Sequence[str],
    row: int,
    record: Mapping[str, Any],
    answers: Answers,
) -> None:
    from asperity.inference import Prior, fit

    settings = record["settings"]
    known = {**point_parameters(law), **FitSolve().parameters()}
    # A free parameter of another law of the sweep does not concern this law.
    elsewhere = set(all_parameters(map(get_law, record["laws"])))
    free = [n for n in settings["free"] if n in known or n not in elsewhere]
    for_all = tuple((n, values[n]) for n in _OPERATING if n in values)
    tables = [
        _read(str(Path(record["folder"], name)), settings["files"][name], for_all)
        for name in files or settings["data"]
    ]
    fixed = _fixed(values, [n for n in known if n not in free], record["origins"], tables)
    truth = {name: values[name] for name in free if name in values}
    inertia, damped = values.get("inertia", 0.0) > 0, values.get("eta", 0.0) > 0 or "eta" in free
    # A material may have a mass although the fit is without inertia.
    without = {name for name, counts in (("M", inertia), ("eta", damped)) if not counts}
    fixed = {name: value for name, value in fixed.items() if name not in without}
    if "noise_seed" in values:
        noise = np.random.default_rng(round(values["noise_seed"]))
        simulated = [_simulated(t, law, {**fixed, **truth}, inertia, noise) for t in tables]
        tables = [table for table in simulated if table is not None]
        if len(tables) < len(simulated):
            answers.fail(row, SweepOutcome.NO_READINGS)
            return
    priors = {n: Prior(*p) for n, p in settings["prior"].items() if n in free}
    fitted = fit(
        tables, law, free, fixed=fixed, start=truth, prior=priors or None,
        inertia=inertia, radiation_damping=damped,
        profile=settings["profile"], starts=settings["starts"], seed=settings["seed"],
        # This check costs a second fit; a sweep keeps the number of warnings only.
        check_stiffness=False,
    )  # fmt: skip
    if not fitted.converged:
        answers.fail(row, SweepOutcome.FIT_FAILED)
        return
    numbers = _numbers(fitted)
    for name in answers.numbers:
        answers.numbers[name][row] = numbers.get(name, np.nan)
    answers.outcome[row] = SweepOutcome.CONVERGED


def _fixed(
    values: Mapping[str, float],
    names: Sequence[str],
    origins: Mapping[str, str],
    tables: Sequence[LockInTable],
) -> dict[str, float]:
    """Fixed numbers of a fit.

    A number of the plan has priority over a column of the data, and a column over a number of the
    material.
    """
    columns = set().union(*(table.points for table in tables))
    return {
        name: value
        for name, value in values.items()
        if name in names
        and name not in ("inertia", "noise_seed")
        and (origins.get(name, "plan") == "plan" or name not in columns)
    }


def _numbers(fitted: Fit) -> dict[str, float]:
    numbers: dict[str, float] = {}
    for name, p in fitted.parameters.items():
        ends = p.interval_95
        numbers |= {f"{name}_fit": p.value, f"{name}_se": p.se}
        numbers |= {f"{name}_low": ends[0], f"{name}_high": ends[1]}
    whole = ("chi2", "dof", "p_value", "log_likelihood", "aicc")
    counted = {"undetermined": "undetermined", "other_minima": "optima", "warnings": "warnings"}
    numbers |= {name: getattr(fitted, name) for name in whole}
    return numbers | {name: len(getattr(fitted, field)) for name, field in counted.items()}


def _simulated(
    table: LockInTable,
    law: type[Law],
    truth: Mapping[str, float],
    inertia: bool,
    noise: np.random.Generator,
) -> LockInTable | None:
    """The table with simulated readings: responses of the law at `truth`, plus noise.

    Errors of the observables of a row are normal, with the uncertainties and correlations of the
    table. The error of a harmonic with a phase is added in the complex plane. None is returned if
    a row has no periodic response.
    """
    at = {}
    for name, parameter in point_parameters(law).items():
        value = truth.get(name, table.points.get(name, parameter.default))
        at[name] = np.broadcast_to(np.asarray(value, dtype=float), (table.rows,)).copy()
    at["epsilon"] *= truth.get("eps_ratio", 1.0)
    at["inertia"][:] = inertia
    response = respond(law, at, workers=1)
    if not np.all(response.converged):
        return None
    root = np.linalg.cholesky(table.correlations())
    normal = np.einsum("rij,rj->ri", root, noise.standard_normal(root.shape[:2]))
    return table.disturbed({n: np.asarray(getattr(response, n)) for n in table.values}, normal)
