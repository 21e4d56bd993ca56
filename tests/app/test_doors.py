"""A bad value is one sentence at every door, but for the name that the door has for the field."""

import re

import pytest
from click.testing import CliRunner

import asperity as asp
from asperity.cli.main import main
from asperity.errors import InputError
from asperity.laws import RiceRuina
from asperity.parameters import DRIVE, MACHINE, law_parameters
from asperity.protocol import load_protocol
from asperity.study import load_plan, run_sweep
from asperity.units import KINDS

POINT = {"V": "1 um/s", "epsilon": "0.2", "frequency": "120 Hz"}
NAMES = ("V", "epsilon", "frequency", "K", "W0", "M", "A", "B", "D0", "V0")
KNOWN = {**law_parameters(RiceRuina), **MACHINE, **DRIVE}
RIGHT = {
    n: f"{asp.materials.load('bureau2000')[n].si!r} {KNOWN[n].unit}" for n in NAMES[3:]
} | POINT


def wrong_numbers():
    """A value that breaks the rule of each number; of some another unit, no number, and no unit."""
    for name in NAMES:
        unit = KINDS[KNOWN[name].kind].si
        wrong = [f"-2 {unit}"]
        if name in ("V", "K", "A"):  # of the drive, the machine and the law
            wrong += ["2 s", "fast", f"nan {unit}", "1e400", *(["2"] if unit else [])]
        for value in wrong:
            yield name, value.strip()


def python(name, value):
    numbers = {**RIGHT, name: value}
    law = RiceRuina(mu0=0.5, **{n: numbers[n] for n in ("A", "B", "D0", "V0")})
    slider = asp.Slider(law, spring=numbers["K"], load=numbers["W0"], mass=numbers["M"])
    asp.periodic_response(
        slider,
        velocity=numbers["V"],
        epsilon=numbers["epsilon"],
        frequency=numbers["frequency"],
        inertia=True,
    )


def command(*arguments):
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code == 2
    assert result.stderr.count("\n") == 1
    return result.stderr.removeprefix("asperity: ").strip()


def response_command(name, value):
    short = {"V": "-V", "epsilon": "-e", "frequency": "-f"}
    numbers = {**POINT, name: value}
    options = [
        o
        for n, v in numbers.items()
        for o in ((short[n], v) if n in short else ("--set", f"{n}={v}"))
    ]
    return command("response", "--law", "rice-ruina", "--material", "bureau2000", *options)


def sweep(name, value, folder):
    numbers = {**POINT, name: value}
    lines = [f'{n} = "{v}"' for n, v in numbers.items()]
    plan = folder / "plan.toml"
    plan.write_text(
        'law = "rice-ruina"\nmaterial = "bureau2000"\n[axes]\nmu0 = { values = ["0.5"] }\n'
        "[parameters]\n" + "\n".join(lines), encoding="utf-8",
    )  # fmt: skip
    run_sweep(load_plan(plan), folder / "sweep.zarr", workers=1)


def sentence(call, *arguments):
    with pytest.raises(InputError) as caught:
        call(*arguments)
    return re.sub(r" \(in '.*'\)$", "", str(caught.value))


@pytest.mark.parametrize(("name", "value"), list(wrong_numbers()))
def test_a_number_of_a_point(ask, tmp_path, name, value):
    label, options = KNOWN[name].label, KNOWN[name].options
    numbers = {**POINT, name: value}
    page = ask("explore", {"law": "rice-ruina", "numbers": numbers, "laws": []})
    said = {
        options[0] if options else f"--set {name}": response_command(name, value),
        f"parameters.{name}": sentence(sweep, name, value, tmp_path),
        name: page.json["error"],
    }
    if value != "2":  # SI in Python
        said[label] = sentence(python, name, value)
    ends = {text.removeprefix(f"{field} must ") for field, text in said.items()}
    assert all(text.startswith(f"{field} must ") for field, text in said.items()), said
    assert len(ends) == 1, said


@pytest.mark.parametrize(
    ("field", "name"), [("law", "rice"), ("law", "a b"), ("material", "bureau1999")]
)
def test_an_unknown_name(ask, tmp_path, field, name):
    point = {"law": "rice-ruina", "material": "bureau2000", field: name}
    options = [text for n, value in point.items() for text in (f"--{n}", value)]
    axes = ("--x", "V=1:2:3 m/s", "--y", "K=1:2:3 N/m", "--out", str(tmp_path / "map.nc"))
    path = tmp_path / "protocol.toml"
    fields = "".join(f"{n} = '{value}'\n" for n, value in point.items())
    path.write_text(fields + "steps = ['slide for 1 s']\n[start]\nvelocity = '1 um/s'\n")
    said = [
        command("response", *options).removeprefix("--"),
        command("map", *options, *axes).removeprefix("--"),
        sentence(load_protocol, path),
    ]
    if field == "law":
        page = ask("explore", {"law": name, "numbers": POINT, "laws": []})
        said += [page.json["error"], sentence(asp.laws.get_law, name)]
    else:  # the page has the materials of the package only
        said.append(sentence(asp.materials.load, name))
    assert set(said) == {said[0]}
    assert said[0].startswith(f"{field} must be a ")


def plan_with(folder, **changed):
    """The mistakes of a plan in which some lines are replaced; None leaves a line out."""
    parts = {
        "law": "'rice-ruina'", "material": "'bureau2000'", "axes": "{ K = { values = ['1 N/m'] } }",
        "parameters": "{ V = '1 um/s', epsilon = 0.2 }",
    }  # fmt: skip
    lines = [f"{n} = {text}" for n, text in (parts | changed).items() if text is not None]
    plan = folder / "plan.toml"
    plan.write_text("\n".join(lines), encoding="utf-8")
    return sentence(lambda: run_sweep(load_plan(plan), folder / "sweep.zarr", workers=1))


def test_missing_numbers(ask, tmp_path):
    options = ("--law", "rice-ruina", "--material", "bureau2000", "-e", "0.2", "-f", "120 Hz")
    page = ask("explore", {"law": "rice-ruina", "numbers": {"epsilon": 0.2}, "laws": []})
    said = {
        '-V "1 um/s"': command("response", *options),
        "parameters.V = '1 um/s'": plan_with(tmp_path, parameters="{ epsilon = 0.2 }"),
        "V: 1 um/s": page.json["error"],
    }
    beginnings = {text.removesuffix(like) for like, text in said.items()}
    assert beginnings == {
        "rice-ruina must have all its numbers, got none for V; name a material that has them or "
        "give each one, like "
    }


def test_a_number_of_another_law(tmp_path):
    options = ("--law", "rice-ruina", "--material", "bureau2000", "--set", "alpha=0.2")
    said = [
        command("response", *options, "-V", "1 um/s", "-e", "0.2", "-f", "120 Hz"),
        plan_with(tmp_path, parameters="{ V = '1 um/s', epsilon = 0.2, alpha = 0.2 }"),
        plan_with(tmp_path, axes="{ alpha = { values = [0.1, 0.2] } }"),
    ]
    assert set(said) == {
        "rice-ruina must be given its own parameters, got 'alpha', which belongs to "
        "linker-dieterich; leave it out or choose another law"
    }


@pytest.mark.parametrize(
    ("changed", "mistake"),
    [
        # An unknown law has no parameters, which is no second mistake.
        ({"law": "'rice'"}, "law must be a registered law, got 'rice'; did you mean 'rice-ruina'?"),
        ({"axes": "{ Kk = { values = [1] } }"}, "axes.Kk must be a parameter, a ratio or 'law', "),
        ({"axes": "{ K = { from = '1 N/m', values = [1] } }"}, "axes.K must have one of from-"),
        ({"axes": "{ law = { from = 1, to = 2, count = 2 } }"}, "axes.law must be listed, "),
    ],
)
def test_an_axis_is_named_once(tmp_path, changed, mistake):
    assert plan_with(tmp_path, **changed).startswith(mistake)


#: By field of a measurement: the option, the label of the page, and values that it may not have.
MEASURED = {
    "harmonics": ("--harmonics", "Harmonics", [0, 65, -1, "some"]),
    "detrend": ("--detrend", "Drift", ["cubic", ""]),
    "frequency": ("--frequency", "Frequency", ["-1 Hz", "0 Hz", "2 kg", "fast", "120 rad/s"]),
    "window": ("--window", "Window", ["5", "a:9", "1:2 kg", "9:1"]),
}


#: By field of a modulated load: the argument, the option, the label, and a value.
MODULATED = {
    "frequency": ("frequency", "--frequency", "Frequency", "120 Hz"),
    "harmonics": ("harmonics", "--harmonics", "Harmonics", 8),
    "whole_periods": ("only_whole_periods", "--whole-periods", "Whole periods only", True),
}
UNMODULATED = {
    "modulated": (False, "modulated=False", "--no-modulation", "velocity steps and holds"),
    "stick_slip": (True, "measure.stick_slip", "--stick-slip", "stick-slip"),
}


@pytest.mark.parametrize("name", MODULATED)
@pytest.mark.parametrize("kind", UNMODULATED)
def test_a_field_of_a_modulation_goes_with_one(ask, tmp_path, name, kind):
    argument, option, label, value = MODULATED[name]
    chosen, python, switch, shown = UNMODULATED[kind]
    recording = tmp_path / "recording.csv"
    recording.write_text("time (s),normal force (N)\n0,1\n1,1\n", encoding="utf-8")
    given = () if value is True else (str(value),)
    options = {name: value, kind: chosen}
    said = [
        sentence(lambda: asp.measure(recording, **{argument: value, kind: chosen})),
        command("measure", str(recording), option, *given, switch),
        ask("data/measure", {"recording": "0" * 32, "options": options}).json["error"],
    ]
    names = ((f"measure.{argument}", python), (option, switch), (label, f"What it is: {shown}"))
    got = {"frequency": "120.0"}.get(name, value)
    assert said == [
        f"{field} must go without {other}, got {got}; leave one out" for field, other in names
    ]


@pytest.mark.parametrize(
    ("name", "value"),
    [(name, value) for name, (*_, values) in MEASURED.items() for value in values],
)
def test_a_field_of_a_measurement(ask, tmp_path, name, value):
    option, label, _ = MEASURED[name]
    recording = tmp_path / "recording.csv"
    recording.write_text("time (s),normal force (N)\n0,1\n1,1\n", encoding="utf-8")
    page = ask("data/measure", {"recording": "0" * 32, "options": {name: value}})
    said = {
        option: command("measure", str(recording), option, str(value)),
        label: page.json["error"],
    }
    if value != "some":  # a `TypeError` in Python
        said[f"measure.{name}"] = sentence(lambda: asp.measure(recording, **{name: value}))
    assert all(text.startswith(f"{field} must ") for field, text in said.items()), said
    assert len({text.removeprefix(f"{field} must ") for field, text in said.items()}) == 1, said
