"""Lines of a protocol: each form, and each mistake with where it is and a valid example."""

from pathlib import Path

import numpy as np
import pytest

from asperity.errors import InputError
from asperity.loads import Follow, Hold, Modulate, RampLoad, RampVelocity, Slide, StepLoad
from asperity.protocol.steps import FORMS, parse_step, plan

HERE = Path()


@pytest.mark.parametrize(
    ("text", "step"),
    [
        ("hold 10 s", Hold(10.0)),
        ("hold for 2 min", Hold(120.0)),
        ("slide at 10 um/s for 60 s", Slide(60.0, 1e-5)),
        ("slide for 500 ms", Slide(0.5)),
        ("modulate 24 % at 120 Hz for 20 s", Modulate(20.0, 0.24, 120.0)),
        ("modulate 0.24 at 0.12 kHz for 20 s", Modulate(20.0, 0.24, 120.0)),
        (
            "modulate 5 % at 80 Hz for 3 s, rising in 0.5 s",
            Modulate(3.0, 0.05, 80.0, rise=0.5),
        ),
        (
            "modulate 5 % at 80 Hz for 3 s rising in 0.5 s, falling in 200 ms",
            Modulate(3.0, 0.05, 80.0, rise=0.5, fall=0.2),
        ),
        ("modulate 5 % at 80 Hz for 3 s, falling in 1 s", Modulate(3.0, 0.05, 80.0, fall=1.0)),
        ("step load to 9 N", StepLoad(9.0)),
        ("ramp load to 0.009 kN in 5 s", RampLoad(9.0, 5.0)),
        ("ramp velocity to 100 um/s in 5 s", RampVelocity(1e-4, 5.0)),
        ("  Ramp  VELOCITY to 0 um/s   in 5 s ", RampVelocity(0.0, 5.0)),
    ],
)
def test_a_line_is_the_step_it_says(text, step) -> None:
    assert parse_step(text, "step 1", HERE) == step


@pytest.mark.parametrize("form", FORMS[:-1], ids=lambda form: form.verb)
def test_every_example_is_valid(form) -> None:
    parse_step(form.example, "step 1", HERE)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("hodl 10 s", ["step 4 must be a step", "'hodl 10 s'", "'hold 10 s'"]),
        ("repaet 3 times: hold 1 s", ["'repeat 3 times: hold 10 s; slide for 60 s'"]),
        ("modulat 5 % at 8 Hz for 1 s", ["'modulate 24 % at 120 Hz for 20 s'"]),
        ("ramp 5 N", ["'ramp load to 9 N in 5 s' or 'ramp velocity to 100 um/s in 5 s'"]),
        ("step velocity to 1 um/s", ["'step load to 9 N'"]),
        ("slide 10 s", ["complete step", "'slide at 10 um/s for 60 s'"]),
        ("modulate 24 % for 20 s", ["'modulate 24 % at 120 Hz for 20 s'"]),
        ("hold 10", ["step 4.duration", "unit", "'10'", "'hold 10 s'"]),
        ("slide at 10 um for 1 s", ["step 4.velocity", "'10 um'", "'slide at 10 um/s for 60 s'"]),
        ("modulate 24 % at 120 rad/s for 1 s", ["step 4.frequency", "rad/s"]),
        ("step load to heavy", ["step 4.load", "'heavy'", "'step load to 9 N'"]),
        ("follow force from x.csv", ["step 4.channels", "'force'", "choose one of load, velocity"]),
        ("follow load from nowhere.csv", ["step 4.file", "'nowhere.csv'", "check the name"]),
        ("", ["step 4 must be a step", "'hold 10 s'", "'ramp load to 9 N in 5 s'"]),
        ("fly to the moon", ["'fly to the moon'", "'hold 10 s'"]),
    ],
)
def test_a_mistake_says_where_and_gives_an_example(text, message) -> None:
    with pytest.raises(InputError) as caught:
        parse_step(text, "step 4", HERE)
    for part in message:
        assert part in str(caught.value)


def test_a_line_that_repeats() -> None:
    planned, mistakes = plan(["repeat 3 times: hold 1 s; slide for 2 s;", "hold 5 s"], HERE)
    assert mistakes == []
    assert [p.step for p in planned] == [Hold(1.0), Slide(2.0)] * 3 + [Hold(5.0)]
    assert [p.place for p in planned] == ["step 1.1", "step 1.2"] * 3 + ["step 2"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("repeat hold 1 s", "how often"),
        ("repeat 0 times: hold 1 s", "how often"),
        ("repeat x times: hold 1 s", "how often"),
        ("repeat 2 times: repeat 2 times: hold 1 s", "as a table"),
        ("repeat 2 times: hodl 1 s", "step 1.1 must be a step"),
        ("repeat 2 times:", "step 1.1 must be a step"),
        ("repeat 1000000 times: hold 1 s", "at most 100000 steps"),
        (f"repeat {10**30} times: hodl 1 s", "step 1.1 must be a step"),
    ],
)
def test_a_repetition_that_is_none(text, message) -> None:
    planned, mistakes = plan([text], HERE)
    assert len(mistakes) == 1
    assert message in str(mistakes[0])
    assert planned == []


def test_a_recorded_load_and_velocity_are_followed(tmp_path) -> None:
    time = np.linspace(0, 2, 201)
    load, velocity = 7 + np.sin(time), 1e-5 * (1 + 0.1 * time)
    rows = np.c_[time, load * 1e-3, velocity * 1e6]
    path = tmp_path / "rec.csv"
    header = "time (s),normal load (kN),velocity (um/s)"
    np.savetxt(path, rows, "%.15g", ",", header=header, comments="")
    step = parse_step("follow load and velocity from rec.csv", "step 1", tmp_path)
    assert isinstance(step, Follow)
    np.testing.assert_allclose(step.time, time, rtol=1e-14)
    np.testing.assert_allclose(step.load, load, rtol=1e-14)
    np.testing.assert_allclose(step.velocity, velocity, rtol=1e-14)
    alone = parse_step(f'follow load from "{path}"', "step 1", HERE)
    assert alone.velocity is None


@pytest.mark.parametrize(
    ("header", "cell", "message"),
    [
        ("time (s),load", "7", "write the unit into its heading"),
        ("time,load (N)", "7", "state the unit of its time, got none of .time. in .rec.csv"),
        ("time (s),load (N)", "nan", "got none in row 1"),
        ("time (s),load (N)", "7\n5.0,8", "without 'backward time'"),
        ("time (s),x (mm)", "7", r"step 1\.file must name a channel, .*save it as CSV"),
    ],
)
def test_a_recording_that_cannot_be_followed(tmp_path, header, cell, message) -> None:
    rows = [f"{0.1 * i:.1f},{cell if i == 1 else 7.5 + i}" for i in range(8)]
    (tmp_path / "rec.csv").write_text("\n".join([header, *rows, ""]), encoding="utf-8")
    with pytest.raises(InputError, match=message):
        parse_step("follow load from rec.csv", "step 1", tmp_path)
