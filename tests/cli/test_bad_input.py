"""Bad input to any command: one sentence on stderr, exit code 2, nothing left behind."""

import math
import random
from functools import partial
from pathlib import Path

import click
import pytest

from asperity.cli.main import main
from asperity.cli.shell import _EXAMPLE_IN_HELP, _EXAMPLES
from asperity.cli.words import fields_as_options
from asperity.errors import Argument, InputError, MistakesError
from references.commands import refused
from references.populations import population

OF = ("response", "--material", "bureau2000")
POINT = {"--law": "rice-ruina", "-V": "1 um/s", "-e": "0.24", "-f": "120 Hz"}
HEADER = "law,V,epsilon,frequency"
ROW = "rice-ruina,1e-6,0.2,120"


@pytest.mark.parametrize(
    ("option", "value", "parts"),
    [
        ("-V", "1 um", ["-V must be a velocity (m/s), got '1 um'"]),
        ("-f", "754 rad/s", ["-f must be a frequency (Hz)", "angular", "120 Hz"]),
        ("-f", "120", ["-f must carry a unit, got '120'"]),
        ("-e", "1", ["-e must be at least 0 and below 1", "got 1;"]),
        ("-e", "0.2 N", ["-e must be a pure number, got '0.2 N'"]),
        ("--material", "none.toml", ["--material must be a file"]),
        ("--set", "D0=0 um", ["--set D0 must be positive, got 0 m;"]),
        ("--set", "inertia=2", ["--set inertia must be 1 or 0, got 2;"]),
        ("--set", "alpa=0.2", ["--set alpa must be a known name, got 'alpa'", "'alpha'"]),
        ("--set", "A", ["--set must be NAME=VALUE, got 'A'"]),
        ("--set", "=1", ["--set must be NAME=VALUE, got '=1'"]),
        ("--set", "V=2 um/s", ["V must be given once, got '2 um/s' and '1 um/s'"]),
        ("--out", "x.csv", ["--out and --resume must go with --table"]),
        ("--colour", "red", ["--colour must be an option of asperity response; "]),
    ],
)
def test_a_bad_option(asperity, option: str, value: str, parts: list[str]) -> None:
    """`tests/app/test_doors.py` sends other bad numbers of a point through this command."""
    options = {OF[1]: OF[2]} | POINT | {option: value}
    refused(asperity(OF[0], *(text for pair in options.items() for text in pair)), *parts)


def test_a_missing_option(asperity) -> None:
    refused(asperity("response"), "--law must be given", "rice-ruina")
    refused(asperity(*OF, "--law", "rice-ruina"), "got none for V, epsilon;", '-V "1 um/s"')
    point = (part for pair in POINT.items() for part in pair)
    refused(asperity("response", *point), "got none for mu0, A, B", "like --set mu0=")


def test_parameters_are_named_as_the_user_names_them(asperity, tmp_path):
    path = tmp_path / "steps.csv"
    rows = "".join(
        f"{t / 10},{max(t, 10 * t - 900) / 1e4},{0.6 + t % 7 / 1e3}\n" for t in range(200)
    )
    path.write_text("time (s),displacement (mm),friction\n" + rows)
    fit = partial(asperity, "fit", path, "--names", "geophysics")
    refused(fit("--free", "a,b"), "got none for D_c;")
    refused(fit("--free", "a,b,x"), "--free must be", "choose one of D_c, M, a, b, eps_ratio")
    refused(fit("--free", "a,b", "--fix", "Dc=-2 um"), "--fix D_c must be positive, got -2e-06 m")
    refused(fit("--free", "a,b,D_c", "--start", "sigma_n=7 N"), "got 'sigma_n'; free it")


def test_only_parameters_are_renamed(asperity, tmp_path):
    """Files, columns, units and options keep their names, though parameters have some of them."""
    path = tmp_path / "B.csv"
    path.write_text("time (s),A,B\n" + "".join(f"{t / 10},{t % 3},{t % 5}\n" for t in range(60)))
    geophysics = ("--names", "geophysics")
    refused(asperity("fit", path, *geophysics), "choose one of A, B, like --force A")
    point = [*OF, "--law", "rice-ruina", "-e", "0.2", "-f", "1 Hz", *geophysics]
    refused(asperity(*point, "-V", "0 um/s"), "-V must be positive")
    refused(asperity(*point, "-V", "1 K"), "got '1 K'")
    refused(asperity(*point), "got none for V_lp;", 'like -V "1 um/s"')
    path.write_text("")
    refused(asperity("measure", path, *geophysics), "got 'B.csv', which is empty")
    plan = tmp_path / "K.toml"
    plan.write_text("A = 1\n")
    refused(asperity("design", plan, *geophysics), "A must be a known field", f"(in '{plan}')")
    axes = ("--x", "D_c=1:2:2 um", "--y", "b=2:1:2", "--out", tmp_path / "map.nc")
    point = [*OF[1:], "--law", "rice-ruina", "-V", "1 um/s", "-f", "1 Hz", *geophysics]
    refused(asperity("map", *point, *axes), "--y must", "got 2 to 1")


def test_a_command_passes_the_parts_of_an_error_on():
    fixed = InputError(Argument("fixed", "A"), "be positive", "-1", "correct it")
    with pytest.raises(MistakesError) as refused, fields_as_options({"fixed": "--fix"}):
        raise MistakesError([fixed, fixed], "K.toml")
    assert [error.got for error in refused.value.errors] == ["-1", "-1"]
    assert refused.value.mistakes[0] == "--fix A must be positive, got -1; correct it"


@pytest.mark.parametrize(
    ("command", "header", "advice"),
    [
        (
            "measure",
            "time (s),displacement (um),shear force (N)",
            [
                "no column named like a normal load; give a constant one, like",
                '--channel "load = 1200 N", or name the column of F/W, like --column "friction=mu"',
            ],
        ),
        (
            "measure",
            "time (s),a,shear force (kN),cell (MPa),b,temp2300",
            ["choose one of cell, a, b, temp2300, like --load cell,", '"friction=mu"'],
        ),
        (
            "measure",
            "time (s),horiz. load (N),vert. load (N)",
            ['a shear force; choose one of horiz. load, vert. load, like --force "horiz'],
        ),
        (
            "measure",
            "time (s),Normal load (kg),Friction (kg)",
            ["got 'Friction', a mass; say what its unit is, like --unit \"Friction=kgf\""],
        ),
        (
            "measure",
            "time (s),shear stress (MPa),normal force (N)",
            [
                "got 'Pa' for 'shear stress (MPa)' and 'N' for 'normal force (N)'; give the area",
                'like --area "25 cm^2"',
            ],
        ),
        (
            "measure",
            "time (s),shear force,normal force (N)",
            ["got no known unit for 'shear force'", 'like --unit "shear force=N"'],
        ),
        (
            "fit",
            "time (s),temperature (degC),friction",
            ['like --column "displacement=x"', "or give --steps and --velocities"],
        ),
    ],
)
def test_what_a_recording_lacks_is_named_with_its_option(
    asperity, tmp_path: Path, command: str, header: str, advice: list[str]
) -> None:
    path = tmp_path / "recording.csv"
    draw = random.Random(1)
    rows = [f"{i / 50:g},{20 + i / 50:g},{0.6 + draw.gauss(0, 1e-3):.5f}" for i in range(600)]
    rows = [row + ",1" * (header.count(",") - 2) for row in rows]
    path.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    refused(asperity(command, path), *advice)


def test_friction_without_motion_says_which_options_give_it(asperity, tmp_path: Path) -> None:
    path = tmp_path / "recording.csv"
    draw = random.Random(1)
    after = [0.0207 - 0.0276 * (1 - math.exp(-i / 40)) for i in range(2500)]
    rows = [
        f"{i / 50:g},{i / 50:g},{0.62 + change + draw.gauss(0, 2e-4):.5f}"
        for i, change in enumerate([0.0] * 2500 + after)
    ]
    path.write_text("\n".join(["time (s),position,friction", *rows]) + "\n", encoding="utf-8")
    advice = ('like --column "displacement=x"', 'like --unit "position=um"', "or give --steps")
    refused(asperity("measure", path), *advice)


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("", ["got an empty file"]),
        ("\n\n", ["got an empty file"]),
        (f"{HEADER}\n", ["must have rows of data, got only column names"]),
        (f"{HEADER},V\n{ROW},1\n", ["must have each column once, got 'V' twice"]),
        (f"{HEADER},lamda\n{ROW},1\n", ["got 'lamda'; did you mean 'lambda'?"]),
        ("law,V,epsilon,freq\n" + ROW, ["got 'freq'; did you mean 'frequency'?"]),
        ("law,V (N),epsilon,frequency\n" + ROW, [".V must be a velocity (m/s), got '1 N'"]),
        ("law,v,epsilon,frequency\n" + ROW, ["got 'v'; did you mean 'V'?"]),
        (f"{HEADER},Dc\n{ROW},1\n", ["got 'Dc'; did you mean 'D0'?"]),
        (f"{HEADER},result\n{ROW},1\n", ["named like a result, got 'result'"]),
        ("law,epsilon,frequency\nrice-ruina,0.2,120\n", ["got none for V;"]),
        ("V,epsilon,frequency\n1e-6,0.2,120\n", ["got no column 'law'; add it or give --law"]),
        (f"{HEADER}\nrice-runia,1e-6,0.2,120\n", ["did you mean 'rice-ruina'?"]),
        (f"{HEADER}\nrice-ruina,quick,0.2,120\n", ["in column 'V', got 'quick' in row 1"]),
        (
            f"{HEADER}\nrice-ruina,{'x' * 70_000},0.2,120\n",
            ["in column 'V', got a text of 70000 characters in row 1"],
        ),
        (f"{HEADER}\nrice-ruina,nan,0.2,120\n", ["in column 'V', got 'nan' in row 1"]),
        (f"{HEADER}\nrice-ruina,,0.2,120\n", ["got none for V;"]),
        (
            f'{HEADER}\nrice-ruina,"1e-6,0.2,120\n',
            ["must be a CSV that can be read", "check the quotation marks"],
        ),
        ("no table at all", ["must have rows of data, got only column names"]),
        ("no table\nat all\n", ["got no column 'law'"]),
    ],
)
def test_a_bad_table(asperity, tmp_path: Path, text: str, parts: list[str]) -> None:
    table = tmp_path / "in.csv"
    table.write_text(text, encoding="utf-8")
    refused(asperity(*OF, "--table", table, "--out", tmp_path / "out.csv"), *parts)
    assert list(tmp_path.iterdir()) == [table]


def test_a_table_that_is_no_text(asperity, tmp_path: Path) -> None:
    table = tmp_path / "in.csv"
    table.write_bytes(f"{HEADER}\n{ROW}\n".encode("utf-16-le"))
    refused(asperity(*OF, "--table", table, "--out", tmp_path / "o.csv"), "it is no text")
    assert list(tmp_path.iterdir()) == [table]


def test_a_table_that_is_not_there(asperity, tmp_path: Path) -> None:
    out = ("--out", tmp_path / "out.csv")
    refused(
        asperity(*OF, "--table", tmp_path / "in.csv", *out),
        "must be a CSV that can be read",
        "no such file",
    )
    refused(asperity(*OF, "--table", tmp_path, *out), "must be a CSV that can be read", "directory")
    assert list(tmp_path.iterdir()) == []


def test_an_output_that_cannot_be_written(asperity, tmp_path: Path) -> None:
    table = tmp_path / "in.csv"
    table.write_text(f"{HEADER}\n{ROW}\n", encoding="utf-8")
    call = (*OF, "--table", table)
    refused(asperity(*call), "--out must be given with --table")
    refused(asperity(*call, "--out", tmp_path), "must be the name of a file")
    refused(asperity(*call, "--out", "/dev/null"), "must be the name of a file")
    refused(asperity(*call, "--out", table), "must be another file than the table")
    refused(asperity(*call, "--out", tmp_path / "no" / "o.csv"), "must lie in a folder that exists")
    refused(asperity(*call, "--out", table / "o.csv"), "out must")
    assert list(tmp_path.iterdir()) == [table]


def test_bad_options_beside_a_table(asperity, tmp_path: Path) -> None:
    table = tmp_path / "in.csv"
    table.write_text(f"{HEADER}\n{ROW}\n", encoding="utf-8")
    call = (*OF, "--table", table, "--out", tmp_path / "o.csv")
    refused(asperity(*call, "--set", "A=-1"), "--set A must be positive, got -1;")
    refused(asperity(*call, "--set", "lamda=1 um"), "'lambda'")
    refused(asperity(*call, "--law", "rice"), "rice-ruina")
    refused(asperity(*call, "-f", "10 rad/s"), "Hz")
    assert list(tmp_path.iterdir()) == [table]


AIR = ("air", "--material", "bureau2000", "-f", "120 Hz")


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        (
            ("air", "--material", "bureau2000"),
            ['--frequency must be given, got nothing; add it, like --frequency "120 Hz"'],
        ),
        (("air", "-f", "120 Hz"), ["got none for P0, h0, R, eta, W0, M, lambda_z;"]),
        (("air", "-f", "120 Hz", "--vacuum"), ["got none for W0, M, lambda_z;"]),
        ((*AIR, "-f", "10 rad/s"), ["--frequency must be a frequency (Hz)"]),
        ((*AIR, "--set", "h0=-1 um"), ["--set h0 must be positive"]),
        ((*AIR, "--set", "h=1 um"), ["got 'h'"]),
        ((*AIR, "--set", "P0=1000"), ["--set P0 must carry a unit"]),
        ((*AIR, "--set", "R=1 cm", "--vacuum"), ["R must not be given with --vacuum"]),
        ((*AIR, "--inverse", "0.48"), ["--inverse and --for must be given together"]),
        ((*AIR, "--for", "gap"), ["--inverse and --for must be given together"]),
        ((*AIR, "--inverse", "0.48", "--for", "mass"), ["--for must be one of radius, gap"]),
        ((*AIR, "--inverse", "0 %", "--for", "gap"), ["--inverse must be positive"]),
        ((*AIR, "--inverse", "0.4", "--for", "gap", "--vacuum"), ["must have an air layer"]),
        ((*AIR, "-f", "2 Hz", "--inverse", "0.4", "--for", "gap"), ["must have one frequency"]),
        (("materials", "bureau"), ["did you mean 'bureau2000'?"]),
        (("materials", "no.toml", "--cite"), ["must be a file"]),
        (("reproduce",), ["--out must be given, got nothing; add it, like --out folder"]),
        (("run", "p.toml"), ["--out must be given, got nothing; add it, like --out motion.nc"]),
    ],
)
def test_the_other_commands(asperity, arguments: tuple[str, ...], parts: list[str]) -> None:
    refused(asperity(*arguments), *parts)


def test_every_option_that_must_be_given_has_an_example() -> None:
    def options(command: click.Command) -> list[click.Parameter]:
        if isinstance(command, click.Group):
            context = click.Context(command)
            known = (command.get_command(context, n) for n in command.list_commands(context))
            return [o for one in known if one for o in options(one)]
        return [o for o in command.params if o.required and isinstance(o, click.Option)]

    assert {o.metavar for o in options(main) if not _EXAMPLE_IN_HELP.search(o.help)} == {*_EXAMPLES}


def test_a_report_folder_that_cannot_be_written(asperity, tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("", encoding="utf-8")
    refused(asperity("reproduce", "--out", blocked), "must be a folder that can be written")
    refused(asperity("reproduce", "--out", blocked / "below"), "must be a folder that can be")
    assert list(tmp_path.iterdir()) == [blocked]


@pytest.mark.parametrize("command", [("fit", "--law", "rice-ruina"), ("compare",)])
def test_a_report_folder_is_tried_before_data_are_read(asperity, tmp_path, command) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("", encoding="utf-8")
    shown = asperity(*command, tmp_path / "none.csv", "--free", "A", "--report", blocked)
    refused(shown, "--report must be a folder that can be written")
    assert list(tmp_path.iterdir()) == [blocked]


READINGS = "V,epsilon,frequency,mu1,mu1_err\n1e-6,0.1,120,1e-3,1e-5\n1e-6,0.2,120,2e-3,1e-5\n"


@pytest.mark.parametrize(
    ("command", "parts"),
    [
        (
            ("fit", "t.csv", "t.csv", "--law", "rice-ruina", "--free", "A"),
            ["row 1 of t.csv (table 2) equal to row 1 of t.csv (table 1)"],
        ),
        (("compare", "t.csv", "t.csv", "--free", "A"), ["it would count twice"]),
        (
            ("compare", "t.csv", "--free", "A", "--windows", "auto"),
            ["--windows must go with asperity fit", "--window START:END"],
        ),
        (("fit", "t.csv", "--law", "rice-ruina", "--free", "M"), ["add --inertia"]),
    ],
)
def test_questions_to_tables_that_have_no_answer(asperity, tmp_path, monkeypatch, command, parts):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "t.csv").write_text(READINGS, encoding="utf-8")
    refused(asperity(*command, "--material", "bureau2000"), *parts)


UNITS = {
    "R": "cm", "h0": "um", "P0": "Pa", "eta": "Pa s", "W0": "N", "M": "kg", "lambda_z": "um",
}  # fmt: skip
WORDS = [
    *("0", "-0", ".", "1e", "+", "nan", "inf", "²", "1²", "٣", "9" * 5000, "1e-400"),
    *("1e9999999", "1e" + "9" * 30, "1e-" + "9" * 30, "\ud800", "1_0", "0x1"),
]


def any_number(draw: random.Random) -> str:
    """A number of any size, or a word that is none."""
    kind = draw.random()
    if kind < 0.4:
        return f"{10 ** draw.uniform(-3, 3):.3g}"
    if kind < 0.8:
        return f"{draw.choice([1, 1, 1, -1]) * draw.uniform(1, 9):.3g}e{draw.randint(-330, 330)}"
    return draw.choice(WORDS)


@pytest.mark.parametrize("seed", population(6, short=2))
def test_numbers_of_any_size_get_an_answer_or_a_sentence(asperity, seed: int) -> None:
    draw = random.Random(seed)
    answered = 0
    for _ in range(50):
        options = ["-f", f"{any_number(draw)} Hz"]
        for name, unit in UNITS.items():
            if draw.random() < 0.2:
                options += ["--set", f"{name}={any_number(draw)} {unit}"]
        options += ["--vacuum"] * (draw.random() < 0.2)
        if draw.random() < 0.3:
            options += ["--inverse", any_number(draw), "--for", draw.choice(["radius", "gap"])]
        result = asperity("air", "--material", "bureau2000", *options)
        if result.exit_code == 2:
            refused(result, "must")
            continue
        answered += 1
        assert "nan" not in result.stdout
        assert "inf" not in result.stdout
    assert answered > 5


def recording(path: Path, load: list[float], force: list[float]) -> Path:
    rows = zip(range(len(load)), load, force, strict=True)
    lines = [f"{k / 1000:.3f},{w!r},{f!r}" for k, w, f in rows]
    path.write_text("\n".join(["time (s),load (N),force (N)", *lines, ""]), encoding="utf-8")
    return path


@pytest.mark.parametrize("word", ["²", "1²", "٣", "³⁰", "9" * 5000, "-1", "3", "12345678901234567"])
def test_a_column_of_no_number(asperity, tmp_path: Path, word: str) -> None:
    file = recording(tmp_path / "a.csv", [7.0] * 100, [3.5] * 100)
    for option in ("--load", "--force", "--time"):
        refused(asperity("measure", file, option, word), "must be a column, got")


@pytest.mark.parametrize(
    "size", ["0", "-0", "0e5", "1e9999999", "-1e9999999", "1e-9999999", "1e400", "1e" + "9" * 30]
)
def test_a_unit_of_no_size(asperity, tmp_path: Path, size: str) -> None:
    file = recording(tmp_path / "a.csv", [7.0] * 100, [3.5] * 100)
    for name, unit in (("load", "N"), ("force", "kN"), ("time", "s")):
        refused(
            asperity("measure", file, "--unit", f"{name}={size} {unit}"),
            "must be a size between",
        )


@pytest.mark.parametrize("seed", population(8, short=3))
def test_recordings_of_any_size_are_measured_or_refused(asperity, tmp_path, seed: int) -> None:
    draw = random.Random(seed)
    swing = draw.choice([0.0, 0.2])
    load = [7 * (1 + swing * math.cos(0.12 * k)) for k in range(600)]
    force = [0.5 * w * (1 + 1e-3 * draw.gauss(0, 1)) for w in load]
    for channel in draw.sample([load, force], draw.choice([1, 2])):
        scale = 10.0 ** draw.choice([draw.uniform(-320, -40), draw.uniform(40, 300)])
        bad = draw.choice([0.0, 0.02, 0.5])
        word = draw.choice([math.inf, -math.inf, math.nan, 1e308, 5e-324])
        channel[:] = [word if draw.random() < bad else v * scale for v in channel]
    file = recording(tmp_path / "a.csv", load, force)
    for options in ((), ("--no-modulation",)):
        refused(asperity("measure", file, *options), "must ")


@pytest.mark.parametrize("exponent", [-300, -160, -20, 20, 300])
def test_uncertainties_that_no_reading_has(asperity, tmp_path: Path, exponent: int) -> None:
    (tmp_path / "t.csv").write_text(READINGS.replace("1e-5", f"1e{exponent}"), encoding="utf-8")
    call = ("fit", tmp_path / "t.csv", "--law", "rice-ruina", "--free", "A")
    refused(asperity(*call, "--material", "bureau2000"), "mu1_err must be from 1e-15 to 1e+15")


PROTOCOL = """
law = "rice-ruina"
material = "bureau2000"
steps = ["slide for 1 s"]
"""


SENSOR = '[tribometer]\nrate = "1 Hz"\n[tribometer.sensors.F]\n'


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        (f'self = 5\n{PROTOCOL}[start]\nvelocity = "1 um/s"', ["self must be a known field"]),
        (
            f'{PROTOCOL}[start]\nvelocity = "1 um/s"\n{SENSOR}type = ["x"]',
            ["tribometer.sensors.F.type must be a sensor, got a list of 1;"],
        ),
        (
            f'{PROTOCOL}[start]\nvelocity = "1 um/s"\nstates = [1e300, -1e300]',
            ["start.states must be states whose rates are numbers", "begin nearer to steady"],
        ),
        (
            f'{PROTOCOL}[start]\nvelocity = "1 um/s"\nstates = [-1.0, 0.0]',
            ["start.states must leave an interface force that is not negative"],
        ),
    ],
)
def test_a_protocol_that_cannot_be_run(asperity, tmp_path: Path, text: str, parts) -> None:
    file = tmp_path / "a.toml"
    file.write_text(text, encoding="utf-8")
    result = asperity("run", file, "--out", tmp_path / "a.nc")
    assert result.exit_code == 2
    assert result.stdout == ""
    for part in parts:
        assert part in result.stderr.splitlines()[-1]
    assert list(tmp_path.iterdir()) == [file]


@pytest.mark.parametrize("fill", ["x", "9", "\\u001b", "hold 1 s; "])
@pytest.mark.parametrize(
    ("command", "place"),
    [
        ("run", 'steps = ["FILL"]'),
        ("run", 'steps = ["hold FILL s"]'),
        ("run", 'steps = ["repeat FILL"]'),
        ("run", 'steps = ["step load to 3 FILL"]'),
        ("run", 'steps = ["slide for 1 s"]\n"FILL" = 1'),
        ("run", 'steps = ["slide for 1 s"]\nparameters."FILL" = 1'),
        ("design", 'values."FILL" = 1'),
        ("design", 'noise."FILL" = 1'),
        ("sweep", 'axes."FILL".values = [1]'),
        ("sweep", 'axes.epsilon.values = [1, "FILL"]'),
    ],
)
def test_a_long_text_of_a_file_is_cut_in_the_message(asperity, tmp_path, command, place, fill):
    file = tmp_path / "a.toml"
    of_command = {
        "run": 'start.velocity = "1 um/s"',
        "design": 'free = ["A"]\nmeasure = "A"\npoints = 9\nranges = { V = 1 }\nnoise.mu1 = 1e-3',
        "sweep": "",
    }[command]
    text = place.replace("FILL", fill * 4000)
    file.write_text(f'law = "rice-ruina"\nmaterial = "bureau2000"\n{text}\n{of_command}')
    out = {"run": ("--out", tmp_path / "a.nc"), "sweep": ("--dry-run",)}.get(command, ())
    result = asperity(command, file, *out)
    assert result.exit_code == 2
    for line in result.stderr.splitlines():
        assert line.isprintable()
        # Field, rule, value and advice have up to 600 characters each.
        assert len(line) < 2500


def test_many_mistakes_of_a_protocol_are_counted(asperity, tmp_path) -> None:
    file = tmp_path / "a.toml"
    steps = ", ".join(["'wait'"] * 100)
    file.write_text(f'law = "rice-ruina"\nsteps = [{steps}]\nstart.velocity = "1 um/s"')
    result = asperity("run", file, "--out", tmp_path / "a.nc")
    assert result.exit_code == 2
    # In the form of all commands.
    begin = f"asperity: protocol must be free of mistakes, got 101 (in '{file}'): (1) step 1 "
    (line,) = result.stderr.splitlines()
    assert line.startswith(begin)
    assert "(20)" in line
    assert line.endswith("; and 81 more")


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ('velocity = "-1 um/s"', "start.velocity must be positive for a start in steady sliding"),
        ('velocity = "1 um/s"\n[solver]\nrtol = 0.0', "solver.rtol must be positive, got 0"),
        ('velocity = "1 um/s"\n[solver]\nmost_steps = 0', "solver.most_steps must be positive"),
        ('velocity = "1 um/s"\nstates = [1.0]', "start.states must be 2 finite states"),
    ],
)
def test_a_protocol_is_refused_before_anything_is_written(asperity, tmp_path, text, sentence):
    file = tmp_path / "a.toml"
    file.write_text(f"{PROTOCOL}[start]\n{text}", encoding="utf-8")
    refused(asperity("run", file, "--out", tmp_path / "a.nc"), sentence)
    assert list(tmp_path.iterdir()) == [file]


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (("-V", "1 um/s", "-V", "2 um/s"), "-V must be given once, got '1 um/s' and '2 um/s'"),
        (("--law", "nagata", "--law", "amontons"), "--law must be given once"),
        (("--material", "bureau2000", "--material", "x.toml"), "--material must be given once"),
    ],
)
def test_an_option_with_one_value_is_given_once(asperity, options, sentence) -> None:
    refused(asperity("response", *options), sentence)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (("--window", "0:1", "--window", "1:2"), "--window must be given once"),
        (("--window", "1:2 min"), "--window must carry a unit at each time, got '1' before"),
        (("--steps", "1,2 min"), "--steps must carry a unit at each time, got '1' before '2 min'"),
        (("--holds", "1:2 h"), "--holds must carry a unit at each time, got '1' before '2 h'"),
        (("--unit", "load=N", "--unit", "load=kN"), "--unit load must be given once, got 'N'"),
        (("--column", "W=load", "--load", "force"), "--column W must be given once"),
        (("--steps", "none.txt"), "--steps must be times or a file that can be read"),
        (("--amplitudes", "--events", "e.csv"), "--amplitudes must go without --events"),
        (("--holds", "0.1:0.2,0.15:0.3"), "--holds must not overlap, got 0.1 to 0.2 s and 0.15"),
        (("--holds", "0.1:0.5", "--steps", "0.2"), "--steps must lie outside --holds, got 0.2 s"),
        (("--steps", "0.2", "--stick-slip"), "--stick-slip must go without --steps, got both"),
        (("--holds", "0.1:0.2", "--harmonics", "3"), "--harmonics must go without --holds, got 3"),
        (("--delimiter", ""), "--delimiter must be one character or 'blank', got ''"),
        (("--decimal", ""), "--decimal must be '.' or ',', got ''"),
        (("--format", ""), "--format must be a format, got ''"),
        (("--channel", "load = 0 N"), "--load must be above zero, got 0 in 100 of 100 samples of"),
        (("--area", "5 cm^2"), "--area must go with a stress, got a recording without"),
        (("--channel", "x = 1/0"), "--channel x must give numbers, got no finite one"),
    ],
)
def test_options_of_a_recording_that_exclude_each_other(
    asperity, tmp_path, options, sentence
) -> None:
    file = recording(tmp_path / "a.csv", [7.0] * 100, [3.5] * 100)
    refused(asperity("measure", file, *options), sentence)


def test_a_prior_is_given_once(asperity, tmp_path) -> None:
    (tmp_path / "t.csv").write_text(READINGS, encoding="utf-8")
    priors = ("--prior", "A=0.01+-0.1", "--prior", "A=0.02+-0.1")
    shown = asperity("fit", tmp_path / "t.csv", "--free", "A", *priors)
    refused(shown, "--prior must be given once each, got 'A' twice")


def test_a_table_with_headings_of_its_own(asperity, tmp_path) -> None:
    """It is read as a recording, and the sentence says how a table would be known."""
    (tmp_path / "t.csv").write_text("Haltezeit;Reibung\n1;0,01\n10;0,02\n", encoding="utf-8")
    shown = asperity("fit", tmp_path / "t.csv")
    refused(shown, "--time must be a column, got none among 'Haltezeit', 'Reibung'")
    assert "in a table of readings name one of the columns mean_friction, " in shown.stderr
    assert shown.stderr.endswith("in a table of holds healing\n")


HOLDS = "hold_time,healing,V,K\n1,0.01,1e-6,1e4\n10,0.02,1e-6,1e4\n"


@pytest.mark.parametrize(
    ("text", "options", "sentence"),
    [
        (READINGS, ("--fix", "V=2 um/s"), "--fix V must agree with the column of the data, got 2"),
        (READINGS, ("--fix", "frequency=100 Hz"), "--fix frequency must agree with the column"),
        (HOLDS, ("--fix", "V=2 um/s"), "--fix V must be given once, got a column of the data too"),
        (READINGS, ("--prior", "A=0.01+-0"), "--prior A must have a positive deviation, got 0"),
        (READINGS, ("--prior", "A=0.01+-0.1 m"), "--prior A must be a pure number"),
        (READINGS, ("--gauge-order", "2"), "--gauge-order must go with --gauge, got 2; give its"),
        (READINGS, ("--rate", "1 Hz"), "--rate must go with a recording, got a table"),
        (READINGS, ("--load", "1"), "--load must go with a recording, got a table"),
        (READINGS, ("--recipe", "nix.toml"), "--recipe must go with a recording, got a table"),
        (READINGS, ("--draws", "7"), "--draws must come with --posterior, got 7 alone"),
        (READINGS, ("--gauge", "40 Hz"), "--gauge must go with a recording, got 40 Hz with a"),
    ],
)
def test_what_the_data_already_say(asperity, tmp_path, text, options, sentence) -> None:
    (tmp_path / "t.csv").write_text(text, encoding="utf-8")
    law = ("--law", "rice-ruina", "--material", "bureau2000", "--free", "A")
    refused(asperity("fit", tmp_path / "t.csv", *law, *options), sentence)


PLAN = 'law = "rice-ruina"\nmaterial = "bureau2000"\n'
AXIS = '[parameters]\nV = "1 um/s"\nfrequency = "120 Hz"\n[axes.epsilon]\n'


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (f"seed = -1\n{PLAN}{AXIS}values = [0.1]", "asperity: seed must be at least 0"),
        (f"rate = 1\n{PLAN}{AXIS}values = [0.1]", "asperity: rate must be a known field"),
        (f"{PLAN}{AXIS}values = [0.1]\n[threshold]\nscan = 3", "threshold must be left out"),
        (f"{PLAN}{AXIS}from = 0.1\nto = 0.2\ncount = 1", "axes.epsilon.count must be at least 2"),
        (
            f"{PLAN}{AXIS}values = [0.1]\n[axes.M]\nvalues = ['1 kg', '2 kg']",
            "axes.M must have an influence, which it has with inertia, got inertia = 0; add param",
        ),
    ],
)
def test_a_plan_names_its_own_keys(asperity, tmp_path, text: str, sentence: str) -> None:
    """Not the options that other commands have for fields of these names."""
    plan = tmp_path / "plan.toml"
    plan.write_text(text, encoding="utf-8")
    refused(asperity("sweep", plan, "--out", tmp_path / "s.zarr"), sentence)
    assert list(tmp_path.iterdir()) == [plan]


def test_a_material_names_its_own_keys(asperity, tmp_path) -> None:
    file = tmp_path / "m.toml"
    file.write_text("title = 'none'\n", encoding="utf-8")
    refused(asperity("materials", file), "asperity: numbers must be given")


def test_a_law_whose_file_ends_the_program(asperity, tmp_path) -> None:
    file = tmp_path / "law.py"
    file.write_text("raise SystemExit(0)\n", encoding="utf-8")
    refused(asperity("response", "--law", f"{file}:Law"), "--law must be code that runs")


def test_a_sample_without_a_name(asperity, tmp_path) -> None:
    refused(asperity("samples", "--out", tmp_path / "a.csv"), "NAME must be given with --out")
    refused(asperity("samples", "--seed", "3"), "NAME must be given with --seed")


@pytest.mark.parametrize(
    ("axis", "sentence"),
    [
        ("epsilon=0:1:3", "asperity: --x must be at least 0 and below 1"),
        ("epsilom=0:0.5:3", "asperity: --x must be a number of an operating point, got 'epsilom'"),
        ("epsilon=0.1:0.5:99999999999", "asperity: --x must have 2 to 100,000,000 points"),
        ("tilt=0:100:3 deg", "asperity: --x must be less than a right angle"),
    ],
)
def test_an_axis_of_a_map_is_named_by_its_option(asperity, tmp_path, axis, sentence) -> None:
    call = ("map", *OF[1:], "--law", "rice-ruina", "--out", tmp_path / "m.nc")
    refused(asperity(*call, "--x", axis, "--y", "K=1:2:3 N/um"), sentence)


@pytest.mark.parametrize(
    ("axis", "switch"), [("M=1:2:3 kg", "--inertia"), ("pull_phase=0:1:3", "--set pull=0.1")]
)
def test_an_axis_along_which_nothing_changes(asperity, tmp_path, axis, switch) -> None:
    call = ("map", *OF[1:], "--law", "rice-ruina", "-V", "1 um/s", "-f", "120 Hz", "--y", axis)
    result = asperity(*call, "--x", "epsilon=0.1:0.2:3", "--out", tmp_path / "m.nc")
    refused(result, f"axis of {axis.partition('=')[0]} must have an influence", f"add {switch},")


def test_inertia_without_a_mass(asperity) -> None:
    point = [part for pair in POINT.items() for part in pair]
    call = (*OF, *point, "--set", "M=0 kg", "--inertia")
    refused(asperity(*call), "--set M must be positive with inertia, got 0 kg", '--set "M=1.6 kg"')


SLIDING = ("--material", "bureau2000", "--law", "rice-ruina", "-V", "1 um/s")
POINT_OPTIONS = (*SLIDING, "-e", "0.24", "-f", "120 Hz")
PLANE = (
    *(*SLIDING, "-f", "120 Hz", "--x", "epsilon=0.1:0.2:3"),
    *("--y", "K=0.2:0.3:3 N/um", "--out", "m.nc"),
)
LAYER = ("--material", "bureau2000", "-f", "120 Hz", "--inverse", "0.48", "--for", "radius")
#: Options that are accepted elsewhere, and have no influence here.
WITHOUT_INFLUENCE = [
    (("response", *POINT_OPTIONS, "--set", "M=2 kg"), "--set M must have an influence"),
    (("response", *POINT_OPTIONS, "--set", "pull_phase=1"), "--set pull_phase must have an"),
    (
        ("response", *SLIDING, "--stick-slip", "--set", "epsilon2=0.1"),
        "--stick-slip must come without a modulation, got epsilon2 = 0.1",
    ),
    (
        ("response", *SLIDING, "--stick-slip", "--set", "eps=0.1"),
        "--stick-slip must come without a modulation, got eps = 0.1",
    ),
    (("response", *SLIDING, "--stick-slip", "--set", "M=2 kg"), "--set M must have an influence"),
    (("map", *PLANE, "--set", "M=2 kg"), "--set M must have an influence"),
    (("map", *PLANE, "--show", "mu1"), "--show must go with --plot"),
    (("air", *LAYER, "--set", "R=1 cm"), "--set R must be left out with --for radius"),
    (("sweep", "p.toml", "--dry-run", "--extend"), "--extend must go without --dry-run"),
    (("sweep", "p.toml", "--dry-run", "--retry-failed"), "--retry-failed must go without"),
    (("sweep", "p.toml", "--dry-run", "--scheduler", "a:1"), "--scheduler must go without --dry"),
    (
        ("sweep", "p.toml", "--dry-run", "--workers", "2", "--cluster", "2"),
        "--workers and --cluster must be given alone, got both",
    ),
    (("serve", "--law", "rice"), "law must be a registered law, got 'rice'"),
]


@pytest.mark.parametrize(("call", "sentence"), WITHOUT_INFLUENCE)
def test_an_option_without_influence_is_refused(
    asperity, tmp_path, monkeypatch, call, sentence
) -> None:
    monkeypatch.chdir(tmp_path)
    refused(asperity(*call), sentence)
    assert not any(tmp_path.iterdir())


def test_a_phase_counts_with_an_axis_of_its_amplitude(asperity, tmp_path, monkeypatch) -> None:
    class MappedError(Exception):
        pass

    def mapped(out, law, numbers, **_):
        raise MappedError(numbers["epsilon2_phase"].value)

    monkeypatch.setattr("asperity.study.map.write_map", mapped)
    axes = ("--x", "epsilon=0.05:0.1:2", "--y", "epsilon2=0.05:0.1:2")
    call = ("map", *SLIDING, "-f", "120 Hz", *axes, "--set", "epsilon2_phase=1")
    with pytest.raises(MappedError, match=r"^1\.0$"):
        main([*call, "--out", str(tmp_path / "m.nc")], standalone_mode=False)


def test_a_decimal_comma_is_named(asperity) -> None:
    refused(asperity("response", *SLIDING[:-1], "0,1 mm/s"), "-V must have a decimal point")


@pytest.mark.parametrize("option", ["--workers", "--cluster"])
def test_more_processes_than_any_machine_runs(asperity, tmp_path, option) -> None:
    plan = tmp_path / "p.toml"
    plan.write_text(
        'law = "rice-ruina"\nmaterial = "bureau2000"\n'
        'parameters = { V = "1 um/s", frequency = "120 Hz" }\naxes.epsilon.values = [0.1]\n'
    )
    call = ("sweep", plan, "--out", tmp_path / "s.zarr", option)
    for count in ("1000000", "0"):
        refused(asperity(*call, count), f"{option} must be from 1 to")
