"""``asperity measure`` on stick-slip: text, JSON, catalogue, picture, campaign, bad input."""

import csv
import json

import numpy as np
import pytest
from benchmarks.stick_slip import saw
from scipy.io import savemat


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    path = tmp_path_factory.mktemp("slips") / "slips.mat"
    truth = saw(0, events=40, noise=0.02)
    savemat(path, {"t": truth.time[:, None], "Fnorm": truth.force[:, None]})
    return path


SET = ("--set", "K=168 N/m", "--set", "M=30.7 g", "--set", "V=358 um/s")


def test_a_stick_slip_recording_is_read_as_such(asperity, recording, tmp_path) -> None:
    table, picture = tmp_path / "events.csv", tmp_path / "events.png"
    result = asperity("measure", recording, *SET, "--events", table, "--plot", picture)
    assert result.exit_code == 0, result.output
    assert "regular stick-slip" in result.stdout
    assert "regular stick-slip is read" in result.stderr
    assert picture.read_bytes().startswith(b"\x89PNG")
    with table.open(encoding="utf-8", newline="") as stream:
        assert len(list(csv.DictReader(stream))) == 40
    record = json.loads(asperity("measure", recording, *SET, "--json").stdout)
    assert record["mode"] == "stick-slip"
    assert record["drop"] == pytest.approx(0.1, rel=0.01)
    assert len(record["catalogue"]) == record["events"] == 40


def test_a_campaign_has_one_row_a_file(asperity, recording, tmp_path) -> None:
    out = tmp_path / "table.csv"
    result = asperity("measure", recording, recording, *SET, "--out", out, "--jobs", 1)
    assert result.exit_code == 0, result.output
    with out.open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [row["kind"] for row in rows] == ["stick-slip"] * 2
    assert float(rows[0]["recurrence"]) == pytest.approx(0.51, rel=0.01)
    assert rows[0]["regime"] == "regular stick-slip"
    assert float(rows[0]["K"]) == 168


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--set", "D0=1 um"], "--set must name one of K, V, M, W0"),
        (["--set", "K=168"], "must carry a unit"),
        (["--set", "K=-1 N/m"], "--set K must be positive"),
        (["--events", "events.txt"], "--events must be a CSV, NetCDF or JSON file"),
        (["--stick-slip", "--no-modulation"], "--stick-slip must go without"),
        (["--no-modulation", "--events", "e.csv"], "--events must go with a stick-slip recording"),
    ],
)
def test_bad_input_is_one_sentence(asperity, recording, options, message) -> None:
    result = asperity("measure", recording, *options)
    assert result.exit_code == 2
    assert message in result.stderr
    assert result.stderr.count("\n") == 1


def test_a_column_without_a_meaning_is_asked_for(asperity, tmp_path) -> None:
    truth = saw(0, events=10)
    path = tmp_path / "slips.csv"
    np.savetxt(path, np.stack([truth.time, truth.force], 1), "%.9g", ",", header="t (s),sensor",
               comments="")  # fmt: skip
    result = asperity("measure", path)
    assert result.exit_code == 2
    assert '--column "friction=sensor"' in result.stderr
    again = asperity("measure", path, "--column", "friction=sensor")
    assert "regular stick-slip" in again.stdout
