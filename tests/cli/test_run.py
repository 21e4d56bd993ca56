"""`asperity run`: files, exit codes, and Ctrl-C in a real process."""

import json
import math
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import xarray

from asperity.outputs import Interrupted
from asperity.protocol import load_protocol, run_protocol
from asperity.recording import read
from asperity.recording.writers import WRITERS
from references.commands import refused

PROTOCOL = """
title = "modulation"
law = "elasto-plastic"
material = "bureau2000"
steps = ["slide for 0.2 s", "modulate 24 % at 120 Hz for 0.3 s"]

[parameters]
K = "0.5 N/um"

[start]
velocity = "10 um/s"

[solver]
sampling = "2 kHz"
"""


@pytest.fixture
def protocol(tmp_path) -> Path:
    path = tmp_path / "protocol.toml"
    path.write_text(PROTOCOL, encoding="utf-8")
    return path


def test_a_run_with_text_and_picture(asperity, protocol, tmp_path, monkeypatch) -> None:
    # No lines of progress, however slow the machine is.
    monkeypatch.setattr("asperity.cli.progress._IN_LOG", math.inf)
    out = tmp_path / "run.nc"
    result = asperity(
        "run", protocol, "--out", out, "--csv", "--plot", out.with_suffix(".png"), "--json"
    )
    assert result.exit_code == 0, result.output
    assert result.stderr.startswith("asperity: writing 1001 rows, about 232 kB, to ")
    assert result.stderr.count("\n") == 1
    summary = json.loads(result.stdout)
    assert summary == {
        "rows": 1001,
        "events": summary["events"],
        "time": 0.5,
        "duration": 0.5,
        "stopped": None,
        "stability": None,
        "files": [str(tmp_path / name) for name in ("run.nc", "run.csv", "run.png")],
    }
    with xarray.open_dataset(out) as run:
        assert run.sizes["time"] == 1001
        trace = read(tmp_path / "run.csv")
        np.testing.assert_allclose(trace.channel("F").values, run.force, rtol=1e-11)
        np.testing.assert_allclose(trace.channel("W").values, run["load"], rtol=1e-11)
    assert (tmp_path / "run.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "run.png").stat().st_size > 10_000


_TRIBOMETER = """
[tribometer]
rate = "1 kHz"

[tribometer.sensors."shear force"]
type = "spring gauge"
stiffness = "0.5 N/um"
bandwidth = "1 kHz"

[tribometer.sensors."normal force"]
type = "load cell"
bandwidth = "1 kHz"
"""


def test_a_run_is_recorded(asperity, protocol, tmp_path) -> None:
    protocol.write_text(PROTOCOL + _TRIBOMETER)
    recording = tmp_path / "recording.csv"
    result = asperity("run", protocol, "--out", tmp_path / "run.nc", "--record", recording)
    assert result.exit_code == 0, result.output
    assert "recording.csv" in result.stdout
    trace = read(recording)
    assert trace.sample_rate == pytest.approx(1000)
    # Of the amplitude a first-order sensor leaves 1/sqrt(1 + (120/1000)^2).
    modulated = trace.slice(0.4, 0.5).channel("W").values
    amplitude = np.ptp(modulated) / 2
    assert amplitude == pytest.approx(0.24 * 7 / np.hypot(1, 0.12), rel=0.01)


def test_an_interrupted_recording_leaves_the_motion_and_says_so(
    asperity, protocol, tmp_path, monkeypatch
) -> None:
    def interrupted(trace, columns, path):
        path.write_text("half a recording")
        raise KeyboardInterrupt

    monkeypatch.setitem(WRITERS, ".csv", interrupted)
    protocol.write_text(PROTOCOL + _TRIBOMETER)
    out, record = tmp_path / "run.nc", tmp_path / "recording.csv"
    left = asperity("run", protocol, "--out", out, "--record", record)
    assert left.exit_code == 130
    assert "interrupted after the motion was finished" in left.stderr
    assert f"'{out}' is whole" in " ".join(left.stderr.split())
    assert out.is_file()
    assert not record.exists()


def test_a_recording_without_tribometer_or_format_costs_no_work(
    asperity, protocol, tmp_path
) -> None:
    refused(
        asperity("run", protocol, "--out", tmp_path / "run.nc", "--record", "x.csv"),
        "--record must go with a [tribometer]",
    )
    protocol.write_text(PROTOCOL + _TRIBOMETER)
    refused(
        asperity("run", protocol, "--out", tmp_path / "run.nc", "--record", "x.xlsx"),
        "must end in the name of a format",
    )
    assert list(tmp_path.iterdir()) == [protocol]


def test_text_of_a_run(asperity, protocol, tmp_path) -> None:
    result = asperity("run", protocol, "--out", tmp_path / "run.nc")
    assert result.exit_code == 0
    assert result.stdout.splitlines()[0] == "elasto-plastic"
    assert "0.5 s" in result.stdout
    assert "run.nc" in result.stdout


def test_a_motion_that_ends_early_is_exit_code_1(asperity, protocol, tmp_path) -> None:
    protocol.write_text(PROTOCOL.replace("24 %", "120 %"))
    result = asperity("run", protocol, "--out", tmp_path / "run.nc")
    assert result.exit_code == 1
    assert result.stderr.splitlines()[1].startswith("asperity: contact was lost at t = 0.2")


def test_all_mistakes_are_exit_code_2_and_in_one_sentence(asperity, protocol, tmp_path) -> None:
    text = PROTOCOL.replace("slide for 0.2 s", "slid for 0.2 s").replace("120 Hz", "120")
    protocol.write_text(text)
    result = asperity("run", protocol, "--out", tmp_path / "run.nc")
    assert result.exit_code == 2
    assert result.stdout == ""
    (line,) = result.stderr.splitlines()
    assert f"got 2 (in '{protocol}'): (1) step 1 must be a step, got 'slid for 0.2 s'" in line
    assert "'slide at 10 um/s for 60 s'" in line
    assert "(2) step 2.frequency must carry a unit" in line
    assert list(tmp_path.iterdir()) == [protocol]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["none.toml", "--out", "run.nc"], "protocol must be a file"),
        (["protocol.toml"], "--out"),
        (["protocol.toml", "--out", "../{}/protocol.toml"], "another file than the protocol"),
        (["protocol.toml", "--out", "run.csv", "--csv"], "must be another file"),
        (["protocol.toml", "--out", "nowhere/run.nc"], "folder that exists"),
    ],
)
def test_bad_input_is_one_sentence(asperity, protocol, monkeypatch, arguments, message) -> None:
    monkeypatch.chdir(protocol.parent)
    refused(asperity("run", *(a.format(protocol.parent.name) for a in arguments)), message)


@pytest.mark.parametrize("load", ["0 N", "-1 N", "-0.0 N", "1e-9 N", "1e-300 N"])
def test_a_start_without_contact_is_one_sentence(asperity, protocol, tmp_path, load) -> None:
    protocol.write_text(PROTOCOL.replace("[start]", f"[start]\nload = '{load}'"))
    refused(asperity("run", protocol, "--out", tmp_path / "run.nc"), "load must")
    assert list(tmp_path.iterdir()) == [protocol]


#: Rows that no disk and no memory holds, drawn over the whole range of doubles.
_RATES = 10.0 ** np.random.default_rng(17).uniform(16, 306, 2)


@pytest.mark.parametrize("rate", [1e16, *_RATES])
def test_more_rows_than_anything_holds(asperity, protocol, tmp_path, rate) -> None:
    text = PROTOCOL + _TRIBOMETER
    protocol.write_text(text.replace("2 kHz", f"{rate:.3e} Hz"))
    options = ("--csv",), ("--record", tmp_path / "rec.csv"), ()
    for option in options:
        refused(asperity("run", protocol, "--out", tmp_path / "run.nc", *option), "rows")
        assert list(tmp_path.iterdir()) == [protocol]
    protocol.write_text(text.replace("slide for 0.2 s", f"slide for {rate:.3e} s"))
    refused(asperity("run", protocol, "--out", tmp_path / "run.nc"), "rows")


@pytest.mark.parametrize("blocked", ["run.nc", "run.csv", "run.png", "rec.csv", "run.nc.partial"])
@pytest.mark.parametrize("make", [os.mkdir, os.mkfifo])
def test_every_output_is_checked_before_the_run(
    asperity, protocol, tmp_path, blocked, make
) -> None:
    protocol.write_text(PROTOCOL + _TRIBOMETER)
    make(tmp_path / blocked)
    outputs = (
        "--out",
        tmp_path / "run.nc",
        "--csv",
        "--plot",
        tmp_path / "run.png",
        "--record",
        tmp_path / "rec.csv",
    )
    refused(asperity("run", protocol, *outputs))
    assert {p.name for p in tmp_path.iterdir()} == {"protocol.toml", blocked}


def test_resume_goes_on_to_the_same_file(asperity, protocol, tmp_path) -> None:
    def stop(reached: float, end: float) -> None:
        if reached > 0.3:
            raise KeyboardInterrupt

    protocol.write_text(PROTOCOL.replace("2 kHz", "100 kHz"))
    out, whole = tmp_path / "run.nc", tmp_path / "whole.nc"
    with pytest.raises(Interrupted):
        run_protocol(load_protocol(protocol), out, progress=stop)
    again = asperity("run", protocol, "--out", out)
    assert again.exit_code == 2
    assert "go on with --resume" in again.stderr
    assert asperity("run", protocol, "--out", out, "--resume").exit_code == 0
    assert asperity("run", protocol, "--out", whole).exit_code == 0
    assert out.read_bytes() == whole.read_bytes()


# A shell hands SIGINT on as ignored to what it runs in the background: not what is tested here.
_START = """
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
import asperity.protocol.run as module
module._ROWS, module.run_protocol.__wrapped__.__kwdefaults__["rows"] = 500, 500
from asperity.cli.main import main
main(sys.argv[1:], prog_name="asperity")
"""


def test_ctrl_c_keeps_what_is_done(protocol, tmp_path) -> None:
    protocol.write_text(PROTOCOL.replace("0.3 s", "60 s"))
    out = tmp_path / "run.nc"
    command = [sys.executable, "-c", _START, "run", str(protocol), "--out", str(out)]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=os.environ) as process:
        note = tmp_path / "run.nc.partial.json"
        for _ in range(4000):
            if note.exists() or process.poll() is not None:
                break
            time.sleep(0.05)
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=60)
    assert process.returncode == 130, said
    assert "interrupted with" in said
    assert "Traceback" not in said
    with xarray.open_dataset(tmp_path / "run.nc.partial") as partial:
        assert partial.sizes["time"] >= 500
        assert np.isfinite(partial.force).all()
