"""Stick-slip in commands: measured, a campaign of recordings, and the numbers of a law from it."""

import csv
import json

import numpy as np
import pytest
from benchmarks.stick_slip_recordings import saw
from scipy.io import savemat

from asperity import Slider, laws
from asperity.loads import Programme, Slide
from asperity.transients import transient
from references.commands import refused


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    path = tmp_path_factory.mktemp("slips") / "slips.mat"
    truth = saw(0, events=40, noise=0.02)
    savemat(path, {"t": truth.time[:, None], "Fnorm": truth.force[:, None]})
    return path


SET = ("--set", "K=168 N/m", "--set", "M=30.7 g", "--set", "V=358 um/s")


def test_a_stick_slip_recording_is_read_as_such(asperity, recording, tmp_path) -> None:
    table, picture = tmp_path / "events.csv", tmp_path / "events.png"
    outputs = ("--events", table, "--plot", picture, "--json")
    result = asperity("measure", recording, *SET, *outputs)
    assert result.exit_code == 0, result.output
    assert "regular stick-slip is read" in result.stderr
    assert picture.read_bytes().startswith(b"\x89PNG")
    with table.open(encoding="utf-8", newline="") as stream:
        assert len(list(csv.DictReader(stream))) == 40
    record = json.loads(result.stdout)
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
    refused(asperity("measure", recording, *options), message)


def test_a_force_alone_is_read_with_the_load_that_is_given(asperity, tmp_path) -> None:
    truth = saw(0, events=20)
    path = tmp_path / "slips.csv"
    np.savetxt(path, np.stack([truth.time, 5 * truth.force], 1), "%.9g", ";",
               header="time (s);friction force (N)", comments="")  # fmt: skip
    result = asperity("measure", path, "--set", "W0=5 N", "--json")
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout)["drop"] == pytest.approx(0.1, rel=0.01)
    refused(asperity("measure", path), "--column friction=NAME must name the friction")


def test_a_column_without_a_meaning_is_asked_for(asperity, tmp_path) -> None:
    truth = saw(0, events=10)
    path = tmp_path / "slips.csv"
    np.savetxt(path, np.stack([truth.time, truth.force], 1), "%.9g", ",", header="t (s),sensor",
               comments="")  # fmt: skip
    refused(asperity("measure", path), '--column "friction=sensor"')
    again = asperity("measure", path, "--column", "friction=sensor")
    assert "regular stick-slip" in again.stdout


TRUTH = {"A": 0.015, "B": 0.027, "D0": 0.5e-6}
W0 = 5.0
#: Stiffnesses over the critical one (Bureau et al., 2000, Eq. 18), not centred on it.
RATIOS = (0.75, 0.91, 1.06, 1.4)
CRITICAL = (TRUTH["B"] - TRUTH["A"]) * W0 / TRUTH["D0"]


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    """Recordings of F/W that begin off steady sliding, named after their conditions."""
    folder = tmp_path_factory.mktemp("campaign")
    law = laws.RiceRuina(mu0=0.4, V0=1e-6, **TRUTH)
    rng = np.random.default_rng(5)
    for V in (1e-6, 1e-5):
        for ratio in RATIOS:
            slider = Slider(law, spring=ratio * CRITICAL, load=W0, mass=0.01)
            seconds = 250e-6 / V
            drive = Programme(Slide(duration=seconds, velocity=V), load=W0, velocity=V / 2)
            motion = transient(slider, drive, sampling=2e4 / seconds, inertia=True, rtol=1e-6)
            force = motion.force / W0 + 5e-4 * rng.standard_normal(motion.force.size)
            name = f"run_k{ratio * CRITICAL:.6g}_v{1e6 * V:g}.csv"
            np.savetxt(
                folder / name, np.stack([motion.time, force], 1), "%.9g", ",",
                header="t (s),Fnorm", comments="",
            )  # fmt: skip
    return folder


def test_two_commands_give_the_numbers_of_the_law(asperity, campaign, tmp_path) -> None:
    table, ends = tmp_path / "campaign.csv", tmp_path / "ends.csv"
    files = sorted(campaign.glob("run_*.csv"))
    result = asperity(
        "measure", *files, "--stick-slip", "--set", f"W0={W0} N", "--conditions",
        "run_k{K N/m}_v{V um/s}", "--out", table, "--thresholds", ends, "--jobs", 1,
    )  # fmt: skip
    assert result.exit_code == 0, result.stderr
    with ends.open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [float(row["V"]) for row in rows] == [1e-6, 1e-5]
    for row in rows:
        bracket = float(row["sticks_at"]), float(row["slides_at"])
        expected = [RATIOS[1] * CRITICAL / W0, RATIOS[2] * CRITICAL / W0]
        assert bracket == pytest.approx(expected, rel=1e-5)
        # One bracket at two velocities is one error: their mean is no surer than either.
        width = (bracket[1] - bracket[0]) / np.sqrt(12)
        assert float(row["K_over_W0_err"]) == pytest.approx(width * np.sqrt(2), rel=1e-5)
        # Eq. (19), at the threshold.
        omega = np.sqrt((TRUTH["B"] - TRUTH["A"]) / TRUTH["A"]) * float(row["V"]) / TRUTH["D0"]
        off = float(row["frequency"]) - omega / (2 * np.pi)
        assert abs(off) < 2.5 * float(row["frequency_err"]) < 0.25 * omega
    result = asperity("recipe", "bureau2000", table, "--thresholds", ends, "--json")
    assert result.exit_code == 0, result.stderr
    record = json.loads(result.stdout)
    for name, value in TRUTH.items():
        number = record["numbers"][name]
        assert abs(number["value"] - value) < 2.5 * number["se"] < 0.5 * value, name
    assert "steps 3 to 5 are left out" in record["warnings"][0]


def test_no_threshold_where_one_side_is_missing(asperity, campaign, tmp_path) -> None:
    ends = tmp_path / "ends.csv"
    files = sorted(campaign.glob("run_*.csv"), key=lambda f: float(f.stem[5:].split("_")[0]))[:4]
    conditions = tmp_path / "conditions.csv"
    lines = [f"{f.name},{f.stem[5:].split('_')[0]},{f.stem.split('_v')[1]}" for f in files]
    conditions.write_text("\n".join(["file,K (N/m),V (um/s)", *lines]), encoding="utf-8")
    result = asperity(
        "measure", *files, "--stick-slip", "--set", f"W0={W0} N", "--conditions", conditions,
        "--out", tmp_path / "c.csv", "--thresholds", ends, "--jobs", 1,
    )  # fmt: skip
    assert result.exit_code == 1
    assert result.stderr.count("cannot tell where stick-slip ends: no recording at") == 2
    assert result.stderr.count("shows steady sliding") == 2
    assert ends.read_text(encoding="utf-8").splitlines()[-1].startswith("V,K_over_W0")
    refused(asperity("recipe", "bureau2000", tmp_path / "c.csv", "--thresholds", ends))


def test_a_campaign_is_drawn_with_the_cycles_of_a_law(asperity, campaign, tmp_path) -> None:
    out, picture = tmp_path / "c.csv", tmp_path / "c.png"
    files = sorted(campaign.glob("run_*.csv"), key=lambda f: float(f.stem[5:].split("_")[0]))[:2]
    law = [f"{name}={value}" for name, value in (TRUTH | {"D0": "0.5 um", "V0": "1 um/s"}).items()]
    result = asperity(
        "measure", *files, "--stick-slip", "--conditions", "run_k{K N/m}_v{V um/s}", "--out", out,
        "--plot", picture, "--law", "rice-ruina", "--jobs", 1, "--json",
        *(x for one in (f"W0={W0} N", "M=10 g", "mu0=0.4", *law) for x in ("--set", one)),
    )  # fmt: skip
    assert result.exit_code == 0, result.stderr
    assert picture.read_bytes().startswith(b"\x89PNG")
    (series,) = json.loads(result.stdout)["healing"]
    assert series["K"] == pytest.approx(RATIOS[0] * CRITICAL, rel=1e-5)
    assert series["reason"] == "2 recordings are too few; at least 3 are needed"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--conditions", "run_k{K N/m}"], "--conditions must fit the names of all recordings"),
        (["--conditions", "run_k{D0 um}_v{V um/s}"], "--conditions must name each of K, V, M, W0"),
        (["--conditions", "run_k{K Hz}_v{V um/s}"], "--set K must"),
        (["--conditions", "absent.csv"], "--conditions must be a CSV that can be read"),
        (["--set", "V=1 um/s", "--conditions", "run_k{K N/m}_v{V um/s}"], "V must be given once"),
        (["--thresholds", "t.csv"], "--thresholds must go with --stick-slip"),
        (["--law", "rice-ruina"], "--law and --material must go with --out, --stick-slip and"),
        (["--plot", "c.png"], "--plot, --events, --steps and --holds must go with one recording"),
        (["--stick-slip", "--plot", "c.png", "--material", "bureau2000"], "--law must be given"),
        (
            ["--stick-slip", "--plot", "c.png", "--law", "rice-ruina"],
            "rice-ruina must have all its numbers",
        ),
    ],
)
def test_bad_conditions_are_one_sentence(asperity, campaign, tmp_path, options, message) -> None:
    files = sorted(campaign.glob("run_*.csv"))[:2]
    refused(asperity("measure", *files, "--out", tmp_path / "c.csv", *options), message)
    assert not any(tmp_path.iterdir())
