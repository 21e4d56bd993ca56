"""Channels made by expressions: their numbers, their units, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from asperity.errors import InputError
from asperity.questions.recording import ReadingRecipe
from asperity.recording import Channel, Trace, check, derive, read

TIME = np.arange(50) / 10


@pytest.fixture
def rig():
    """A triaxial cell: names with dots and blanks, volts of a gauge and plain numbers."""
    rng = np.random.default_rng(0)
    channels = {
        "Conf.Press.": Channel(4e7 + 1e5 * rng.normal(size=50), "pressure", "Pa", "Conf.Press."),
        "Up.Pore.Press.": Channel(1e7 + 1e5 * rng.normal(size=50), "pressure", "Pa"),
        "Dwn Pore": Channel(1.1e7 + 1e5 * rng.normal(size=50), "pressure", "Pa"),
        "Axial force": Channel(2e4 + 1e3 * rng.normal(size=50), "force", "N"),
        "Gauge": Channel(rng.normal(size=50), None, "", "Gauge (V)", "V"),
        "count": Channel(np.ones(50), None, "", "count", ""),
        "slip": Channel(1e-6 * TIME**2, "length", "m"),
    }
    return Trace(TIME, channels, check(Trace(TIME, channels)))


def values(trace, name):
    return trace.channels[name].values


CASES = {
    "Conf.Press - (Up.Pore.Press + 'Dwn Pore')/2": (
        lambda c: c["Conf.Press."] - (c["Up.Pore.Press."] + c["Dwn Pore"]) / 2,
        "Pa",
    ),
    "'Axial force' / (20 mm * 36 mm)": (lambda c: c["Axial force"] / 7.2e-4, "Pa"),
    "'Axial force'/(20 mm*36 mm)": (lambda c: c["Axial force"] / 7.2e-4, "Pa"),
    "2.4 N/V * Gauge": (lambda c: 2.4 * c["Gauge"], "N"),
    "Gauge * 2.4[N/V] - 3 N": (lambda c: 2.4 * c["Gauge"] - 3, "N"),
    "1 kN * count * 25 %": (lambda c: 250 * c["count"], "N"),
    "zero('Axial force', 0 s, 1 s)": (
        lambda c: c["Axial force"] - c["Axial force"][TIME <= 1].mean(),
        "N",
    ),
    "'Axial force' - median('Axial force')": (
        lambda c: c["Axial force"] - np.median(c["Axial force"]),
        "N",
    ),
    "-'Axial force'^2 / 1 N": (lambda c: -(c["Axial force"] ** 2), "N"),
    "sqrt(abs('Axial force')^2)": (lambda c: np.abs(c["Axial force"]), "N"),
    "derivative(slip)": (lambda c: np.gradient(c["slip"], TIME), "m/s"),
    "2 - 3 - 4": (lambda c: np.full(50, -5.0), ""),
    "2^3^2 / 2 * 3": (lambda c: np.full(50, 768.0), ""),
    "time / 2": (lambda c: TIME / 2, "s"),
}


@pytest.mark.parametrize("text", CASES)
def test_expressions_give_the_numbers_and_units_of_their_formula(rig, text):
    truth, unit = CASES[text]
    derived = derive(rig, {"new": text})
    expected = truth({name: c.values for name, c in rig.channels.items()})
    assert np.allclose(values(derived, "new"), expected, rtol=1e-13, atol=0)
    assert derived.channels["new"].unit == unit
    assert derived.provenance["derived channels"] == {"new": text}


def test_a_channel_with_the_name_of_a_unit_is_the_channel():
    volts = np.linspace(1, 2, 50)
    trace = Trace(TIME, {"G": Channel(volts, None, "", "G", "V")})
    assert np.allclose(values(derive(trace, {"force": "2 N/V*G"}), "force"), 2 * volts)


def test_a_role_with_the_name_of_a_unit_is_its_channel():
    """2 m*F is no constant of two metres times a farad, where there is a shear force."""
    trace = Trace(TIME, {"Shear": Channel(TIME, "force", "N", "Shear", "N")})
    for text in ("2 m*F", "2 m * F", "2 m*Shear"):
        assert np.array_equal(values(derive(trace, {"work": text}), "work"), 2 * TIME)
    with pytest.raises(InputError, match="name a channel, got no column named like a friction"):
        derive(trace, {"x": "2 kg*mu"})


def test_an_expression_may_be_a_long_sum(rig):
    derived = derive(rig, {"new": "+".join(["slip"] * 390)})
    assert np.allclose(values(derived, "new"), 390 * values(rig, "slip"), rtol=1e-12, atol=0)


def test_the_integral_of_a_derivative_is_the_change(rig):
    derived = derive(rig, {"change": "integral(derivative(slip))"})
    # The trapezoidal rule is exact for a linear slope; the end slopes are one-sided differences.
    assert np.allclose(values(derived, "change"), values(rig, "slip"), atol=2e-8)
    assert derived.channels["change"].unit == "m"


def test_a_derived_channel_named_as_a_role_takes_the_role(rig):
    derived = derive(rig, {"load": "Conf.Press - Up.Pore.Press", "force": "'Axial force'/(5 cm^2)"})
    assert derived.channel("W") is derived.channels["load"]
    assert derived.channel("shear stress") is derived.channels["force"]
    with_friction = derive(derived, {"friction": "force / load"})
    ratio = values(derived, "force") / values(derived, "load")
    assert np.array_equal(with_friction.channel("mu").values, ratio)


def test_a_recorded_channel_of_the_same_name_is_kept(rig):
    derived = derive(rig, {"Axial force": "2 * 'Axial force'"})
    assert np.array_equal(values(derived, "Axial force"), 2 * values(rig, "Axial force"))
    assert np.array_equal(values(derived, "Axial force (recorded)"), values(rig, "Axial force"))


def test_time_is_derived_from_a_column_of_intervals():
    steps = np.full(20, 0.25)
    trace = Trace(
        np.arange(20.0), {"dt": Channel(steps, "time", "s"), "F": Channel(steps, "force")}
    )
    derived = derive(trace, {"time": "cumulative(dt) - 0.25 s"})
    assert np.allclose(derived.time, 0.25 * np.arange(20))
    assert derived.sample_rate == pytest.approx(4.0)


def test_a_derived_channel_inherits_the_findings_of_its_sources(rig):
    flat = np.clip(np.cumsum(np.random.default_rng(1).normal(size=50)), -1.5, 1.5)
    channels = {**rig.channels, "Gauge": Channel(flat, None, "", "Gauge", "V")}
    trace = Trace(TIME, channels, check(Trace(TIME, channels)))
    assert "saturation" in {f.name for f in trace.findings}
    # The noise of the other channel hides the flat top.
    derived = derive(trace, {"force": "1 N/V * Gauge + 'Axial force' / 1000"})
    names = {f.name for f in derived.findings if f.where.startswith("force")}
    assert names == {"source saturation"}
    assert "source saturation" in {f.name for f in derived.slice("1 s", "4 s").findings}


@pytest.mark.parametrize(
    ("text", "rule"),
    [
        ("Conf.Press + 3 N", "must add like to like"),
        ("Conf.Pres", "did you mean 'Conf.Press.'"),
        ("2 *", "must be an expression"),
        ("(2 * slip", "must be an expression"),
        ("2 slip slip", "must have units that are known"),
        ("slip; import os", "must be an expression"),
        ("mean", "must be made of channels that are there"),
        ("slip (2)", "must be an expression"),
        ("2) * (3", "must be an expression"),
        ("2 * * 3", "must be an expression"),
        ("__import__('os')", "must be made of channels that are there"),
        ("slip.__class__", "must be made of channels that are there"),
        ("slip^slip", "must have plain numbers as exponents"),
        ("2^9999", "must have exponents up to 16"),
        ("(" * 5000 + "1" + ")" * 5000, "must have at most 2000 characters"),
        ("mean(slip, 1 s)", "must give mean 1 or 3 values"),
        ("zero(slip, 60 s, 70 s)", "must have stretches that hold samples"),
        ("zero(slip, 0 mm, 7 mm)", "must have stretches in time"),
        ("3 degC * count", "must have units that are known"),
        ("", "must be an expression"),
    ],
)
def test_a_wrong_expression_is_refused_in_one_line(rig, text, rule):
    with pytest.raises(InputError, match=rule) as refused:
        derive(rig, {"new": text})
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("role", ["load", "force", "velocity", "friction", "time"])
def test_a_derived_channel_named_as_a_role_must_have_its_dimension(rig, role):
    with pytest.raises(InputError, match=rf"channels\['{role}'\] must be a .*, got one in"):
        derive(rig, {role: "slip * slip"})


def recording(tmp_path):
    rows = "".join(f"{t:.3f};{7 + t % 0.3:.4f};{0.1 * t:.4f}\n".replace(".", ",") for t in TIME)
    path = tmp_path / "run1.csv"
    path.write_text("Zeit (s);Druck (MPa);Kanal 3\n" + rows)
    return path


def test_a_recipe_gives_layout_units_channels_and_columns(tmp_path):
    recipe = tmp_path / "lab.toml"
    recipe.write_text(
        'title = "rig 3"\ndelimiter = ";"\ndecimal = ","\n[units]\n"Kanal 3" = "2 kN"\n'
        '[channels]\nforce = "\'Kanal 3\' / (20 cm^2)"\n[columns]\nW = "Druck"\n'
    )
    trace = read(recording(tmp_path), recipe=recipe)
    assert np.allclose(trace.channel("F").values, np.round(0.1 * TIME, 4) * 2000 / 20e-4)
    assert trace.channel("W").unit == "Pa"
    assert trace.provenance["recipe"]["channels"] == {"force": "'Kanal 3' / (20 cm^2)"}
    # Arguments take precedence over the recipe.
    overridden = read(recording(tmp_path), recipe=recipe, channels={"force": "'Kanal 3' / (1 m^2)"})
    assert np.allclose(overridden.channel("F").values * 500, trace.channel("F").values)
    from_object = read(recording(tmp_path), recipe=ReadingRecipe.from_file(recipe))
    assert from_object.provenance == trace.provenance


@pytest.mark.parametrize(
    ("text", "rule"),
    [
        ("[chanels]\nx = '1'", "recipe.chanels must be a known field.*did you mean 'channels'"),
        ("[channels]\nx = 3", "recipe.channels.x must be a text, got 3 .in '.*lab.toml'."),
        ("x = [", "recipe must be valid TOML"),
    ],
)
def test_a_recipe_with_a_mistake_is_refused(tmp_path, text, rule):
    recipe = tmp_path / "lab.toml"
    recipe.write_text(text)
    with pytest.raises(InputError, match=rule):
        read(recording(tmp_path), recipe=recipe)


def test_roles_and_times_of_the_user_go_before_expressions_of_a_recipe(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text("Tick (s),Gauge (N),Shear (N)\n0,1,5\n2,2,6\n4,3,7\n")
    recipe = ReadingRecipe(channels={"time": "Tick * 10", "force": "Gauge * 2"}, rate=None)
    assert read(path, recipe=recipe).time.tolist() == [0, 20, 40]
    assert read(path, recipe=recipe).channel("F").values.tolist() == [2, 4, 6]
    assert read(path, recipe=recipe, rate="1 Hz").time.tolist() == [0, 1, 2]
    trace = read(path, {"time": "Tick", "F": "Shear"}, recipe=recipe)
    assert trace.time.tolist() == [0, 2, 4]
    assert trace.channel("F").values.tolist() == [5, 6, 7]
    by_rate = ReadingRecipe(rate="1 kHz")
    assert read(path, {"time": "Tick"}, recipe=by_rate).time.tolist() == [0, 2, 4]


@pytest.mark.parametrize(
    ("options", "rule"),
    [
        ({"columns": {"F": "Gauge", "force": "Shear"}}, "F.* must be one column.* 'F' and 'force'"),
        ({"columns": {"time": "Tick"}, "rate": "1 Hz"}, "left out next to a sampling rate"),
        ({"channels": {"time": "Tick * 10"}, "rate": "1 Hz"}, "left out next to a sampling rate"),
        ({"columns": {"F": "Shear"}, "channels": {"force": "Gauge"}}, "'F' and 'force'"),
        ({"channels": {"load": "Gauge", "W": "Shear"}}, "be one .*, got 'load' and 'W'"),
        ({"columns": {"F": 1}, "units": {"F": "N", "Gauge": "kN"}}, "once, got 'N' and 'kN'"),
    ],
)
def test_two_columns_for_one_role_are_refused(tmp_path, options, rule):
    path = tmp_path / "run.csv"
    path.write_text("Tick (s),Gauge (N),Shear (N)\n0,1,5\n2,2,6\n4,3,7\n")
    with pytest.raises(InputError, match=rule):
        read(path, **options)
    with pytest.raises(InputError, match=rule):
        read(path, recipe=ReadingRecipe(**options))


def test_a_unit_of_the_user_goes_before_that_of_a_recipe(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text("time (s),Gauge,Shear (N)\n0,1,5\n2,2,6\n4,3,7\n")
    recipe = ReadingRecipe(units={"Gauge": "kN"})
    trace = read(path, {"F": "Gauge"}, {"F": "N"}, recipe=recipe)
    assert trace.channel("F").values.tolist() == [1, 2, 3]


def test_a_missing_recipe_is_refused(tmp_path):
    with pytest.raises(InputError, match="recipe must be a file"):
        read(recording(tmp_path), recipe=tmp_path / "none.toml")


def test_a_derived_clock_needs_no_column_of_times(tmp_path):
    path = tmp_path / "steps.csv"
    path.write_text("dt (ms),F (N)\n" + "".join(f"{1 + i % 2},{i}.5\n" for i in range(30)))
    trace = read(path, channels={"time": "cumulative(dt)"})
    assert np.allclose(np.diff(trace.time[:5]), [2e-3, 1e-3, 2e-3, 1e-3])
    assert trace.provenance["time"] == "derived: cumulative(dt)"


@pytest.mark.parametrize(
    ("channels", "message"),
    [
        ({"force": "zero(F, 0 s, 5 s)", "time": "cumulative(dt)"}, "write the expression for time"),
        ({"rate": "derivative(F)", "time": "cumulative(dt)"}, r"channels\['rate'\] .* no finite"),
        ({"time": "2*time"}, r"channels\['time'\] must give numbers, got no finite one"),
    ],
)
def test_there_are_no_times_before_the_expression_for_time(tmp_path, channels, message):
    path = tmp_path / "steps.csv"
    path.write_text("dt (ms),F (N)\n" + "".join(f"{1 + i % 2},{i}.5\n" for i in range(30)))
    with pytest.raises(InputError, match=message):
        read(path, channels=channels)
