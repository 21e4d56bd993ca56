"""Protocols as files and as objects, what is wrong with one, and beginnings that are unstable."""

from pathlib import Path

import numpy as np
import pytest
import xarray

import asperity as asp
from asperity import materials
from asperity.errors import InputError
from asperity.loads import CyclicLoading, Follow, Hold, Programme, Slide, StepLoad, modulated
from asperity.protocol import Protocol, ProtocolError, Repeat, load_protocol, run_protocol
from asperity.protocol.run import stability_statement

FILE = """
title = "one of everything"
law = "elasto-plastic"
material = "bureau2000"
steps = [
  "slide for 0.5 s",
  { repeat = 2, steps = ["hold 0.2 s", { repeat = 2, steps = ["slide at 5 um/s for 0.1 s"] }] },
  "step load to 9 N",
  "ramp velocity to 20 um/s in 0.5 s",
]

[parameters]
K = "0.5 N/um"
lambda = "0.62 um"

[start]
velocity = "10 um/s"

[solver]
sampling = "1 kHz"
rtol = 1e-8
"""


@pytest.fixture
def write(tmp_path):
    def written(text: str):
        path = tmp_path / "protocol.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return written


def test_a_file_is_what_it_says(write) -> None:
    protocol = load_protocol(write(FILE))
    pmma = materials.load("bureau2000")
    assert float(protocol.slider.K) == 5e5
    assert float(protocol.slider.law.lambda_) == 0.62e-6
    assert float(protocol.slider.law.A) == pmma.A
    assert float(protocol.slider.W0) == pmma.W0
    assert protocol.numbers["K"].origin == "protocol"
    assert protocol.numbers["A"].origin == "bureau2000"
    programme = protocol.programme
    assert programme.duration == pytest.approx(0.5 + 2 * (0.2 + 2 * 0.1) + 0.5, rel=1e-14)
    assert programme.load(1.4) == 9.0
    assert programme.velocity(0.6) == 0.0
    assert programme.velocity(0.75) == 5e-6
    assert programme.last.velocity == 2e-5
    assert protocol.integration["rtol"] == 1e-8
    assert protocol.integration["sampling"] == 1e3


def test_the_same_in_python(write) -> None:
    inner = Repeat(repeat=2, steps=("slide at 5 um/s for 0.1 s",))
    protocol = Protocol(
        law="elasto-plastic",
        material="bureau2000",
        parameters={"K": 5e5, "lambda": "0.62 um"},
        start={"velocity": 1e-5},
        solver={"sampling": 1e3, "rtol": 1e-8},
        steps=(
            Slide("0.5 s"),
            Repeat(repeat=2, steps=(Hold(0.2), inner)),
            StepLoad(9.0),
            "ramp velocity to 20 um/s in 0.5 s",
        ),
    )
    there = load_protocol(write(FILE)).programme
    time = np.linspace(0, there.duration, 331)
    np.testing.assert_array_equal(protocol.programme.load(time), there.load(time))
    np.testing.assert_array_equal(protocol.programme.velocity(time), there.velocity(time))


def test_all_mistakes_are_told_at_once(write) -> None:
    text = (
        FILE.replace("slide for 0.5 s", "slyde for 0.5 s")
        .replace("hold 0.2 s", "hold 0.2")
        .replace("to 9 N", "to 9 kg")
        .replace('K = "0.5 N/um"', "K = 0.5")
    )
    path = write(text)
    with pytest.raises(ProtocolError) as caught:
        load_protocol(path)
    mistakes = caught.value.mistakes
    assert len(mistakes) == 4
    assert mistakes[0].startswith("parameters.K must carry a unit, got 0.5")
    assert mistakes[1].startswith("step 1 must be a step, got 'slyde for 0.5 s'")
    assert mistakes[2].startswith("step 2.1.duration must carry a unit, got '0.2'")
    assert mistakes[3].startswith("step 3.load must be a force")
    assert f"got 4 (in '{path}')" in str(caught.value)
    assert all(mistake in str(caught.value) for mistake in mistakes)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("hold 0.2 s", "hold -0.2 s", "step 2.1.duration must be positive, got -0.2 s"),
        ("title", "titel", "titel must be a known field, got 'one of everything'; did you mean"),
        ("rtol", "tolerance", "solver.tolerance must be a known field"),
        ('velocity = "10 um/s"', 'velocty = "1 um/s"', "start.velocity must be given"),
        ("elasto-plastic", "elastoplastic", "did you mean 'elasto-plastic'"),
        ("bureau2000", "bureau", "did you mean 'bureau2000'"),
        ("lambda =", "alpha =", "belongs to linker-dieterich"),
        ("lambda =", "lamda =", "did you mean 'lambda'"),
        ('K = "0.5 N/um"', 'K = "-0.5 N/um"', "parameters.K must be positive"),
        ('material = "bureau2000"', "", "got none for"),
        ("[solver]", "[solver]\ninertia = 3", "solver.inertia must be"),
        ('"step load to 9 N"', "9", "step 3 must be a text, or a table"),
        ('repeat = 2, steps = ["hold', 'repet = 2, steps = ["hold', "step 2 must be a text, or"),
        ("rtol = 1e-8", "rtol = 1e-8\nrtol = 1e-9", "must be valid TOML"),
        ("repeat = 2", "repeat = 0", "step 2.repeat must be a whole number above zero, got 0"),
        (
            "[solver]",
            "[track]\namplitude = -1.0\nlength = '1 um'\n[solver]",
            "track.amplitude must",
        ),
    ],
)
def test_one_mistake_is_one_sentence(write, old, new, message) -> None:
    assert old in FILE
    with pytest.raises(InputError) as caught:
        load_protocol(write(FILE.replace(old, new, 1)))
    assert message in str(caught.value)


def test_a_mass_without_inertia_is_refused(write) -> None:
    light = FILE.replace("[parameters]\n", "[parameters]\nM = '2 kg'\n")
    with pytest.raises(InputError, match=r"parameters\.M must go with inertia"):
        load_protocol(write(light))


def test_steps_that_take_no_time_are_refused(write) -> None:
    start = FILE.index("steps = [")
    text = FILE[:start] + 'steps = ["step load to 9 N"]' + FILE[FILE.index("\n[parameters]") :]
    with pytest.raises(InputError, match="must take time"):
        load_protocol(write(text))


def test_a_file_that_is_not_there(tmp_path) -> None:
    with pytest.raises(InputError, match="there is none"):
        load_protocol(tmp_path / "none.toml")
    with pytest.raises(InputError, match="readable TOML file"):
        load_protocol(tmp_path)


def test_steps_of_every_kind_are_taken_as_they_are(write) -> None:
    protocol = load_protocol(write(FILE))
    time = np.linspace(0, 1, 11)
    cycle = CyclicLoading("0.5 s", modulated(0.2, load={2: (0.05, 0.0)}), "40 Hz")
    steps = (Follow(time, load=7 + time), cycle)
    changed = protocol.model_copy(update={"steps": steps})
    assert changed.programme.duration == 1.5
    assert changed.programme.load(0.3) == pytest.approx(7.3, rel=1e-12)
    assert changed.programme.load(1.0) == pytest.approx(8 * (1 + 0.2 + 0.05), rel=1e-12)
    with pytest.raises(InputError, match=r"step 1\.duration must be positive"):
        protocol.model_copy(update={"steps": (Hold(-1.0),)})


def test_a_repetition_in_python_needs_a_number_above_zero() -> None:
    with pytest.raises(ValueError, match=r"Repeat\.repeat must be above 0, got 0"):
        Repeat(repeat=0, steps=("hold 1 s",))


def test_the_inputs_are_what_changes_the_motion(write) -> None:
    def of(text: str) -> str:
        return load_protocol(write(text)).inputs

    first = of(FILE)
    assert of(FILE.replace("one of everything", "another title")) == first
    assert of(FILE.replace("0.2 s", "200 ms")) == first
    for old, new in (
        ("hold 0.2 s", "hold 0.3 s"),
        ("0.62 um", "0.63 um"),
        ("1e-8", "1e-9"),
        ("1 kHz", "2 kHz"),
        ('velocity = "10', 'velocity = "11'),
        ("[start]", "[start]\nload = '6 N'"),
    ):
        assert of(FILE.replace(old, new)) != first


def test_the_motion_is_that_of_the_solver(write) -> None:
    protocol = load_protocol(write(FILE))

    pmma = materials.load("bureau2000")
    slider = asp.Slider(
        pmma.law("elasto-plastic", lambda_="0.62 um"), spring="0.5 N/um", mass=pmma.M, load=pmma.W0
    )
    again = ["slide at 5 um/s for 0.1 s"] * 2
    assert list(protocol.lines[1:4]) == ["hold 0.2 s", *again]
    steps = [Slide(0.5), *[Hold(0.2), Slide(0.1, 5e-6), Slide(0.1, 5e-6)] * 2]
    programme = Programme(*steps, load=7.0, velocity=1e-5)
    direct = asp.transient(slider, programme, sampling=1e3, rtol=1e-8)
    mine = protocol.trajectory()
    rows = int(1e3 * programme.duration)
    np.testing.assert_allclose(mine.force[:rows], direct.force[:rows], rtol=1e-7)


def test_the_example_runs_to_its_end(tmp_path) -> None:
    example = Path(__file__).resolve().parents[2] / "examples" / "hold_step_modulate.toml"
    protocol = load_protocol(example)
    out = tmp_path / "run.nc"
    done = run_protocol(protocol, out)
    assert done.stopped is None
    assert done.time == pytest.approx(protocol.programme.duration, rel=1e-12)
    with xarray.open_dataset(out) as run:
        force = run.force.sel(time=slice(3, 5)), run.force.sel(time=slice(15, 17))
        peaks = [float(part.max()) for part in force]
        steady = float(run.force.sel(time=1.9, method="nearest"))
        # Static ageing: B ln(ten times the hold), less what creep and the finite velocity take.
        law = protocol.slider.law
        assert 0.6 < (peaks[1] - peaks[0]) / (7 * float(law.B) * np.log(10)) < 1.1
        assert steady == pytest.approx(7 * float(law.mu_ss(1e-5)), rel=1e-6)
        # Ninety periods.
        modulated = run.force.sel(time=slice(22.0, 22.7499)).mean()
        truth = asp.periodic_response(
            protocol.slider, velocity=1e-5, epsilon=0.24, frequency=120.0
        ).mean_friction
        assert float(modulated) == pytest.approx(7 * float(truth), rel=1e-4)


def protocol(ratio, law="rice-ruina", **more):
    # Kc = (B - A) W0/D0 of rigid asperities; 1 + A lambda/D0 less of elastic ones.
    critical = 0.013 * 7 / 4e-7
    return Protocol(
        law=law,
        material="bureau2000",
        steps=("slide for 300 s",),
        start={"velocity": "10 um/s"},
        parameters={"K": ratio * critical, **more.pop("parameters", {})},
        **more,
    )


def test_a_tenth_of_the_critical_stiffness_is_said_to_be_unstable() -> None:
    statement = stability_statement(protocol(0.1))
    assert "K is 0.1 of the critical stiffness" in statement


@pytest.mark.parametrize("ratio", [1.01, 3.0])
def test_nothing_is_said_of_stable_sliding(ratio) -> None:
    assert stability_statement(protocol(ratio)) == ""


@pytest.mark.parametrize(
    ("law", "more"),
    [
        # At 10 um/s, far from rest, regularised friction is Rice-Ruina friction.
        ("regularised", {}),
        ("elasto-plastic", {"solver": {"inertia": True}, "parameters": {"M": 1.6}}),
        ("rice-ruina", {"parameters": {"eta": 500.0}}),
        # Asperities softer than (B - A) W0/D0: no spring is stiff enough.
        ("elasto-plastic-age", {"parameters": {"lambda": 4e-5}}),
    ],
)
def test_unstable_sliding_without_a_closed_form_is_said_too(law, more) -> None:
    parameters = more.pop("parameters", {})
    unstable = protocol(0.1, law, parameters=dict(parameters), **more)
    steadier = {"B": 0.012} if "lambda" in parameters else {}
    stable = protocol(3.0, law, parameters=parameters | steadier, **more)
    assert "a disturbance doubles in" in stability_statement(unstable)
    assert stability_statement(stable) == ""


def test_the_rate_of_growth_is_that_of_the_linearised_equations() -> None:
    # Rice-Ruina at K = 0.1 Kc: rates in units of V/D0 are roots of A s^2 + (k + A - B) s + k = 0,
    # k = K D0/W0, from the force's and the age's small changes.
    A, B, D0, V = 0.013, 0.026, 4e-7, 1e-5
    k = 0.1 * (B - A)
    rate = max((-b + s) / (2 * A) for b in [k + A - B] for s in [(b**2 - 4 * A * k) ** 0.5])
    said = stability_statement(protocol(0.1, "regularised"))
    seconds = float(said.split("doubles in ")[1].split(" s")[0])
    assert seconds == pytest.approx(np.log(2) * D0 / (V * rate), rel=0.01)


def test_inertia_raises_the_critical_stiffness() -> None:
    # 1 + M V^2/(A W0 D0) with M = 1.6 kg at 1 cm/s.
    heavy = {"solver": {"inertia": True}, "parameters": {"M": 1.6}}
    fast = protocol(1.5, **heavy)
    fast = fast.model_copy(update={"start": {"velocity": "1 cm/s"}})
    assert "is unstable" in stability_statement(fast)
    assert stability_statement(protocol(1.5)) == ""


def test_a_step_to_a_load_below_zero_is_refused() -> None:
    for load in ("-1 N", "0 N"):
        with pytest.raises(InputError, match=r"step 2\.to must be positive"):
            Protocol(
                law="rice-ruina",
                material="bureau2000",
                steps=("slide for 1 s", f"step load to {load}", "slide for 1 s"),
                start={"velocity": "10 um/s"},
                parameters={"K": "0.5 N/um"},
            )
