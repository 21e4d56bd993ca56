"""Tables of operating points: same rows out, a reason for each that fails, nothing lost."""

import csv
import dataclasses
import json
import math
from pathlib import Path

import numpy as np
import pytest

import asperity as asp
from asperity.errors import InputError
from asperity.laws import get_law, registered
from asperity.loads import modulated
from asperity.operating_point import known_parameters, sourced_numbers
from asperity.outputs import Interrupted
from asperity.parameters import MODULATION, RESULT_COLUMNS, point_parameters, required
from asperity.slider import Slider
from asperity.study.table import run_table

NUMBERS = RESULT_COLUMNS[:7]
COLUMNS = [
    *("law", "A", "B", "D0", "mu0", "V0", "K", "M", "W0"),
    *("alpha", "lambda", "V", "epsilon", "frequency"),
]
POINT = dict(
    zip(
        COLUMNS[1:],
        (0.013, 0.026, 4e-7, 0.5, 1e-6, 2e5, 1.6, 7.0, 0.02, 7e-7, 1e-6, 0.24, 120.0),
        strict=True,
    )
)


#: Laws whose parameters are all among the columns.
LAWS = (
    *("amontons", "elasto-plastic", "elasto-plastic-age"),
    *("linker-dieterich", "rice-ruina", "strength-area"),
)


def write(path: Path, rows: list[dict], columns: list[str] = COLUMNS, delimiter: str = ",") -> Path:
    with path.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.DictWriter(stream, columns, delimiter=delimiter, restval="")
        writer.writeheader()
        writer.writerows(rows)
    return path


def read(path: Path, delimiter: str = ",") -> list[dict]:
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream, delimiter=delimiter, strict=True))


def points(count: int, **changed: object) -> list[dict]:
    """Rows whose law changes from one to the next, and whose numbers differ."""
    rng = np.random.default_rng(7)
    return [
        POINT
        | {"law": LAWS[i % len(LAWS)], "V": float(10 ** rng.uniform(-7, -5))}
        | {"epsilon": float(rng.uniform(0.01, 0.3)), "A": float(rng.uniform(0.012, 0.014))}
        | changed
        for i in range(count)
    ]


def direct(row: dict, modulation=None) -> asp.orbit.PeriodicResponse:
    """The response of one row, asked of the library without any table."""
    law = get_law(row["law"])
    fields = {f.name: row[f.name.rstrip("_")] for f in dataclasses.fields(law)}
    slider = Slider(law(**fields), spring=row["K"], load=row["W0"], mass=row["M"])
    load = {"epsilon": row["epsilon"]} if modulation is None else {"modulation": modulation}
    return asp.periodic_response(slider, velocity=row["V"], frequency=row["frequency"], **load)


@pytest.fixture
def here(tmp_path: Path):
    """Solve rows in a fresh folder; returns the output's rows and the summary."""

    def solve(rows: list[dict], columns: list[str] = COLUMNS, **options):
        source = write(tmp_path / "in.csv", rows, columns)
        summary = run_table(source, tmp_path / "out.csv", **options)
        assert {f.name for f in tmp_path.iterdir()} == {"in.csv", "out.csv"}
        return read(summary.out), summary

    return solve


def test_mixed_laws_equal_direct_calls_in_the_order_of_the_rows(here) -> None:
    rows = points(14)
    answers, summary = here(rows, block=5)
    assert (summary.rows, summary.failed) == (14, 0)
    for row, answer in zip(rows, answers, strict=True):
        assert {k: answer[k] for k in COLUMNS} == {k: str(row[k]) for k in COLUMNS}
        expected = direct(row)
        for name in NUMBERS:
            # Other points in the chunk may cost an iteration more: the last digits differ.
            assert float(answer[name]) == pytest.approx(
                float(getattr(expected, name)), rel=2e-9, abs=1e-13
            ), name
        assert answer["stable"] == str(bool(expected.stable))
        assert (answer["converged"], answer["result"]) == ("True", "converged")


def test_the_output_has_the_columns_of_the_issue_in_order(here, tmp_path: Path) -> None:
    here(points(1))
    header = (tmp_path / "out.csv").read_text(encoding="utf-8").splitlines()[0]
    assert header.split(",") == [
        *COLUMNS,
        *("mean_friction", "delta_mu", "mu1", "mu2", "phase1", "phase2", "floquet_max"),
        *("stable", "converged", "result"),
    ]


def test_a_row_says_that_slip_would_reverse(here) -> None:
    """A law that slips forwards only, on a tilted exciter; no failure."""
    rows = [POINT | {"law": "rice-ruina", "epsilon": 0.5, "tilt": tilt} for tilt in (0.1, 0.8)]
    (forwards, both_ways), summary = here(rows, [*COLUMNS, "tilt"])
    assert summary.failed == 0
    assert forwards["result"] == "converged"
    assert both_ways["result"].startswith("converged, but slip would reverse")


BAD = [
    ({"A": -0.01}, "A must be positive, got -0.01"),
    ({"epsilon": 1}, "epsilon must be at least 0 and below 1"),
    ({"epsilon": -0.1}, "epsilon must be at least 0 and below 1"),
    ({"D0": "nan"}, "D0 must be a finite number in m, got 'nan'"),
    ({"B": "inf"}, "B must be a finite number, got 'inf'"),
    ({"V": "1 um/s"}, "V must be a finite number in m/s, got '1 um/s'"),
    ({"V": "1,5e-6"}, "V must be a finite number in m/s, got '1,5e-6'"),
    ({"V": 0}, "V must be positive, got 0 m/s"),
    ({"frequency": -120}, "frequency must be positive, got -120 Hz"),
    ({"K": 0}, "K must be positive, got 0 N/m"),
    ({"W0": -7}, "W0 must be positive, got -7 N"),
    ({"M": -1}, "M must not be negative, got -1 kg"),
    ({"M": "heavy"}, "M must be a finite number in kg, got 'heavy'"),
    ({"mu0": ""}, "rice-ruina must have mu0, got an empty cell"),
    ({"law": "rice-runia"}, "did you mean 'rice-ruina'?"),
    ({"law": ""}, "law must be a registered law, got ''"),
]


def test_a_bad_row_gets_its_reason_and_costs_no_other(here) -> None:
    good = POINT | {"law": "rice-ruina"}
    rows = [good, *(row for change, _ in BAD for row in (good | change, good))]
    answers, summary = here(rows)
    assert summary.failed == len(BAD)
    reference = answers[0]
    for i, (change, reason) in enumerate(BAD):
        bad, after = answers[1 + 2 * i], answers[2 + 2 * i]
        assert reason in bad["result"], change
        assert [bad[name] for name in NUMBERS] == [""] * len(NUMBERS)
        assert (bad["stable"], bad["converged"]) == ("False", "False")
        assert after == reference


def test_a_bad_share_of_epsilon_has_its_own_name(here) -> None:
    """It was reported as an epsilon that is not a number."""
    bad = {
        "half": "eps_ratio must be a finite number, got 'half'",
        0: "eps_ratio must be positive, got 0",
        -0.5: "eps_ratio must be positive, got -0.5",
        1.2 / POINT["epsilon"]: "epsilon times eps_ratio must be at least 0 and below 1, so",
        "": "converged",
        0.5: "converged",
    }
    row = POINT | {"law": "rice-ruina"}
    answers, summary = here([row | {"eps_ratio": r} for r in bad], [*COLUMNS, "eps_ratio"])
    assert summary.failed == 4
    for answer, reason in zip(answers, bad.values(), strict=True):
        assert answer["result"].startswith(reason)


def test_numbers_that_a_law_does_not_have_are_not_looked_at(here) -> None:
    row = POINT | {"law": "rice-ruina"}
    answers, summary = here([row, row | {"alpha": "n/a", "lambda": -1}])
    assert summary.failed == 0
    assert [answers[0][n] for n in NUMBERS] == [answers[1][n] for n in NUMBERS]


def test_a_row_without_orbit_says_so_and_gives_no_number(here) -> None:
    rows = [POINT | {"law": "rice-ruina", "V": 1e300}, POINT | {"law": "rice-ruina"}]
    answers, summary = here(rows)
    assert summary.failed == 1
    assert answers[0]["result"] not in ("", "converged")
    assert (answers[0]["mean_friction"], answers[0]["converged"]) == ("", "False")
    assert answers[1]["converged"] == "True"


def test_missing_columns_and_empty_cells_are_filled(here) -> None:
    filled = {k: v for k, v in POINT.items() if k not in ("V", "epsilon")}
    rows = [
        {"V": 1e-6, "epsilon": 0.24},
        {"V": 1e-6, "epsilon": 0.24, "A": 0.02},
        {"V": 1e-6, "epsilon": 0.24, "law": "linker-dieterich"},
    ]
    answers, summary = here(rows, ["law", "A", "V", "epsilon"], law="rice-ruina", filled=filled)
    assert summary.failed == 0
    full = [POINT | {"law": "rice-ruina"} | row for row in rows]
    for row, answer in zip(full, answers, strict=True):
        assert float(answer["mu1"]) == pytest.approx(float(direct(row).mu1), rel=1e-9)
    assert answers[0]["A"] == ""
    assert answers[0]["law"] == ""


def test_the_mass_may_be_absent(here) -> None:
    rows = [POINT | {"law": "rice-ruina", "M": ""}, POINT | {"law": "rice-ruina"}]
    answers, summary = here(rows)
    assert summary.failed == 0
    assert answers[0]["mu1"] == answers[1]["mu1"]


def test_cells_are_kept_as_they_were_written(tmp_path: Path) -> None:
    source = tmp_path / "in.csv"
    lines = [
        'law,V,epsilon,frequency,"my, note",',
        'rice-ruina,1.000E-06, 0.240 ,120.,"a ""quoted"", line",',
        "rice-ruina,0.000001,.24,+120,Größe ½,x",
    ]
    source.write_text("\ufeff" + "\r\n".join(lines) + "\r\n\r\n", encoding="utf-8")
    summary = run_table(source, tmp_path / "out.csv", filled=POINT)
    assert (summary.rows, summary.failed) == (2, 0)
    with summary.out.open(encoding="utf-8", newline="") as stream:
        header, first, second = csv.reader(stream)
    assert header[:6] == ["law", "V", "epsilon", "frequency", "my, note", ""]
    assert first[:6] == ["rice-ruina", "1.000E-06", " 0.240 ", "120.", 'a "quoted", line', ""]
    assert second[:6] == ["rice-ruina", "0.000001", ".24", "+120", "Größe ½", "x"]
    assert first[6:] == second[6:]


@pytest.mark.parametrize("delimiter", [";", "\t"])
def test_other_delimiters(tmp_path: Path, delimiter: str) -> None:
    source = write(tmp_path / "in.csv", points(2), delimiter=delimiter)
    summary = run_table(source, tmp_path / "out.csv")
    assert summary.failed == 0
    assert [r["result"] for r in read(summary.out, delimiter)] == ["converged"] * 2


def test_a_row_of_another_width_is_a_bad_row(tmp_path: Path) -> None:
    source = tmp_path / "in.csv"
    rows = ["rice-ruina,1e-6,0.2,120", "rice-ruina,1e-6,0.2", "rice-ruina,1e-6,0.2,120,7", ""]
    rows.append("rice-ruina,1e-6,0.2,120,,")
    source.write_text("\n".join(["law,V,epsilon,frequency", *rows]), encoding="utf-8")
    summary = run_table(source, tmp_path / "out.csv", filled=POINT)
    answers = read(summary.out)
    assert [r["converged"] for r in answers] == ["True", "False", "False", "True"]
    assert "got 3 instead of 4" in answers[1]["result"]
    assert "got 5 instead of 4" in answers[2]["result"]


def test_a_column_that_only_some_laws_lack_concerns_only_their_rows(here) -> None:
    columns = [c for c in COLUMNS if c != "lambda"]
    rows = [{k: v for k, v in row.items() if k in columns} for row in points(6)]
    answers, summary = here(rows, columns)
    assert summary.failed == 2
    for row in answers:
        assert (row["converged"] == "True") == ("plastic" not in row["law"])
        if "plastic" in row["law"]:
            assert "must have lambda" in row["result"]


def test_columns_of_the_users_own_are_kept(here) -> None:
    mine = dict.fromkeys(("note", "sample", "operator", "temperature", "run", "mean"), "mine")
    answers, _ = here([POINT | {"law": "amontons"} | mine], [*COLUMNS, *mine])
    assert {name: answers[0][name] for name in mine} == mine


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        *(("freq", "frequency"), ("Frequency", "frequency"), ("freq (Hz)", "frequency")),
        *(("lamda", "lambda"), ("lambda_", "lambda"), ("eps", "epsilon"), ("velocity", "V")),
        *(("mu", "mu0"), ("d0", "D0"), ("D_c", "D0"), ("alhpa", "alpha"), ("k", "K"), ("W", "W0")),
    ],
)
def test_a_misspelt_column_is_refused(tmp_path: Path, name: str, meant: str) -> None:
    source = write(tmp_path / "in.csv", [POINT | {"law": "amontons"}], [*COLUMNS, name])
    with pytest.raises(InputError, match=rf"did you mean '{meant}'\?"):
        run_table(source, tmp_path / "out.csv")


def test_units_stand_in_headings(here) -> None:
    row = POINT | {"law": "rice-ruina", "V": 2e-6, "epsilon": 0.24}
    (plain,), _ = here([row])
    other = {n: v for n, v in row.items() if n not in ("V", "epsilon")}
    other |= {"V (um/s)": 2, "epsilon [%]": 24, "note (a)": 1, "note (b)": 2}
    (answers,), _ = here([other], list(other))
    for name in NUMBERS:
        assert float(answers[name]) == pytest.approx(float(plain[name]), rel=1e-12)


class Stop:
    """A user who presses Ctrl-C as soon as `rows` rows are done."""

    def __init__(self, rows: float = math.inf) -> None:
        self.rows = rows
        self.seen: list[tuple[int, int]] = []

    def __call__(self, done: int, total: int) -> None:
        self.seen.append((done, total))
        if done >= self.rows:
            raise KeyboardInterrupt


def test_progress_reaches_every_row(here) -> None:
    watch = Stop()
    here([*points(7), POINT | {"law": "rice-ruina", "A": -1}], block=3, progress=watch)
    done = [d for d, _ in watch.seen]
    assert done == sorted(done)
    assert watch.seen[0] == (0, 8)
    assert watch.seen[-1] == (8, 8)


@pytest.mark.parametrize("rubbish", [b"", b"half a li"])
def test_an_interrupted_table_is_resumed_to_the_same_output(tmp_path: Path, rubbish: bytes) -> None:
    rows = [*points(8), POINT | {"law": "rice-ruina", "A": -1}, *points(3)]
    source = write(tmp_path / "in.csv", rows)
    whole = run_table(source, tmp_path / "whole.csv", block=4)
    out = tmp_path / "out.csv"
    with pytest.raises(Interrupted, match=r"with 8 of 12 rows finished; .* --resume"):
        run_table(source, out, block=4, progress=Stop(9))
    partial = tmp_path / "out.csv.partial"
    assert not out.exists()
    with partial.open("ab") as stream:
        stream.write(rubbish)
    watch = Stop()
    resumed = run_table(source, out, block=4, resume=True, progress=watch)
    assert watch.seen[0] == (8, 12)
    assert out.read_bytes() == (tmp_path / "whole.csv").read_bytes()
    assert (resumed.rows, resumed.failed) == (whole.rows, whole.failed) == (12, 1)
    assert {f.name for f in tmp_path.iterdir()} == {"in.csv", "whole.csv", "out.csv"}


def test_finished_blocks_are_neither_overwritten_nor_mixed(tmp_path: Path) -> None:
    source, out = write(tmp_path / "in.csv", points(6)), tmp_path / "out.csv"
    with pytest.raises(Interrupted):
        run_table(source, out, block=2, progress=Stop(3))
    record = tmp_path / "out.csv.partial.json"
    left = record.read_bytes(), (tmp_path / "out.csv.partial").read_bytes()
    with pytest.raises(InputError, match="must not have an unfinished run"):
        run_table(source, out)
    with pytest.raises(
        InputError,
        match=r"inputs, got filled\.A = nothing there and 0\.02 here",
    ):
        run_table(source, out, resume=True, filled={"A": 0.02})
    write(source, points(7))
    with pytest.raises(InputError, match="must belong to the same inputs, got table = "):
        run_table(source, out, resume=True)
    assert (record.read_bytes(), (tmp_path / "out.csv.partial").read_bytes()) == left


def test_resume_without_an_earlier_run_starts(here) -> None:
    _, summary = here(points(2), resume=True)
    assert (summary.rows, summary.failed) == (2, 0)


def test_the_command_runs_a_table(tmp_path: Path) -> None:
    from click.testing import CliRunner

    from asperity.cli.main import main

    rows = [{"V": 1e-6, "epsilon": 0.24}, {"V": 1e-6, "epsilon": 2}]
    source = write(tmp_path / "in.csv", rows, ["V", "epsilon"])
    call = ["response", "--table", str(source), "--out", str(tmp_path / "out.csv")]
    call += ["--material", "bureau2000", "--law", "rice-ruina", "--set", "A=0.02", "--json"]
    shown = CliRunner().invoke(main, call)
    assert shown.exit_code == 1
    assert json.loads(shown.stdout) == {"rows": 2, "failed": 1, "out": str(tmp_path / "out.csv")}
    assert shown.stderr.startswith("asperity: 1 of 2 rows have no response; the column 'result'")
    expected = direct(POINT | {"law": "rice-ruina", "A": 0.02})
    assert float(read(tmp_path / "out.csv")[0]["mu1"]) == pytest.approx(float(expected.mu1))


@pytest.mark.parametrize("column", ["inertia", "eta"])
def test_a_law_without_dynamics_costs_its_own_row(tmp_path: Path, column: str) -> None:
    # The other row is without: either would need programs of its own.
    rows = [POINT | {"law": "amontons", column: 1}, POINT | {"law": "rice-ruina", column: 0}]
    source = write(tmp_path / "in.csv", rows, [*COLUMNS, column])
    run_table(source, tmp_path / "out.csv")
    null, sliding = read(tmp_path / "out.csv")
    assert null["result"].startswith("law must depend on the velocity where inertia or eta counts")
    assert null["mu1"] == ""
    assert sliding["result"] == "converged"


# --- Other modulations than a harmonic load -----------------------------------------------------

OTHER = {
    "even": ({"epsilon2": 0.03, "pull": 0.2, "tilt": 0.05},
             modulated(0.24, load={2: (0.03, 0.0)}, pull=0.2, tilt=0.05)),
    "odd": ({"epsilon2": 0.02, "epsilon2_phase": 0.5, "epsilon3": 0.01, "epsilon3_phase": -1.0,
             "pull": 0.1, "pull_phase": 0.3},
            modulated(0.24, load={2: (0.02, 0.5), 3: (0.01, -1.0)}, pull=0.1, pull_phase=0.3)),
}  # fmt: skip


def test_other_modulations_are_those_of_the_library_and_cost_no_other_row(here) -> None:
    own = {"law": "rice-ruina"} | POINT
    rows = [own, *(own | columns for columns, _ in OTHER.values())]
    rows += [own | {"epsilon": 0.7, "epsilon2": 0.4, "epsilon2_phase": math.pi}]
    rows += [own | {"tilt": 1.6}, own | {"pull": "much"}]
    answers, summary = here(rows, [*COLUMNS, *MODULATION])
    assert summary.failed == 3
    wanted = [direct(own), *(direct(own, load) for _, load in OTHER.values())]
    for answer, expected in zip(answers[:3], wanted, strict=True):
        assert answer["result"] == "converged"
        for name in NUMBERS:
            assert float(answer[name]) == pytest.approx(
                float(getattr(expected, name)), rel=2e-9, abs=1e-13
            ), name
    drops = [float(answer["delta_mu"]) for answer in answers[:3]]
    assert min(np.diff(np.sort(drops))) > 1e-4  # three different loads
    lost, steep, text = (answer["result"] for answer in answers[3:])
    # w = 1 + 0.7 cos t - 0.4 cos 2t is lowest at t = pi.
    assert lost.startswith("load must stay positive over the period")
    assert "lowest W/W0 of -0.1;" in lost
    assert steep.startswith("tilt must be less than a right angle")
    assert text.startswith("pull must be a finite number, got 'much'")
    assert {answer["mu1"] for answer in answers[3:]} == {""}


def test_a_material_does_not_say_how_the_drive_is_modulated(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(
        "title = 'T'\n[numbers.pull]\nvalue = 0.2\nunit = ''\ndimension = 'dimensionless'\n"
        "kind = 'assumed'\nplace = 'nowhere'\n",
        encoding="utf-8",
    )
    mine = asp.materials.load(path)
    assert mine["pull"].si == 0.2
    assert sourced_numbers({}, mine) == {}
    assert sourced_numbers({"pull": "0.1"}, mine)["pull"].value == 0.1


def test_columns_of_other_modulations_that_are_zero_change_nothing(here) -> None:
    rows = [{"law": "rice-ruina"} | POINT | {"V": V} for V in (1e-6, 3e-6)]
    plain, _ = here(rows)
    zero, _ = here([row | dict.fromkeys(MODULATION, 0) for row in rows], [*COLUMNS, *MODULATION])
    for before, after in zip(plain, zero, strict=True):
        assert before == {name: after[name] for name in before}


# --- Names and rules, which stand in the laws and in the slider --------------------------------


@pytest.mark.parametrize("name", sorted(registered()))
def test_every_law_parameter_is_a_column(name: str) -> None:
    law = get_law(name)
    assert [*point_parameters(law)][-15:] == [
        *("K", "W0", "M", "eta"),
        *("V", "epsilon", "frequency", "inertia"),
        *MODULATION,
    ]
    assert set(point_parameters(law)) <= set(known_parameters())
    assert "M" not in required(law)


@pytest.mark.parametrize(("name", "keyword"), [("K", "spring"), ("W0", "load"), ("M", "mass")])
@pytest.mark.parametrize("value", [-1.0, 0.0, 1.0, math.nan])
def test_the_rules_for_the_machine_are_those_of_the_slider(
    name: str, keyword: str, value: float
) -> None:
    def verdict(call) -> str:
        try:
            call()
        except InputError as error:
            return str(error)
        return ""

    law = get_law("amontons")(mu0=0.5)
    given = {"spring": 1.0, "load": 1.0, "mass": 1.0} | {keyword: value}
    assert verdict(lambda: point_parameters(type(law))[name].check(value)) == verdict(
        lambda: Slider(law, **given)
    )


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"alpha": 0.2}, "alpha.*must be a number of a law of"),
        ({"V": 2e-6}, "V.*must fill a cell of"),
        ({"M": 2.0}, "M.*must have an influence"),
    ],
)
def test_a_given_number_that_no_row_uses_is_refused(tmp_path: Path, given, message) -> None:
    columns = ["V", "epsilon"]
    source = write(tmp_path / "in.csv", [{"V": 1e-6, "epsilon": 0.2}, {"V": 1e-5}], columns)
    filled = {n: v for n, v in POINT.items() if n not in ("M", "V")} | given
    with pytest.raises(InputError, match=message):
        run_table(source, tmp_path / "out.csv", law="rice-ruina", filled=filled, given=given)
    run_table(source, tmp_path / "out.csv", law="rice-ruina", filled=filled, given=["epsilon"])
