"""``asperity map``: the file, the picture, the record, and what is answered to mistakes."""

import json
from pathlib import Path

import numpy as np
import pytest
import xarray

from references.commands import refused

LAW = ("map", "--law", "rice-ruina", "--material", "bureau2000", "-V", "1 um/s", "-f", "120 Hz")
AXES = ("--x", "epsilon=0:0.4:5", "--y", "K=0.1:0.3:5 N/um")
KC = (0.026 - 0.013) * 7.0 / 0.4e-6


def test_a_map_as_file_picture_and_json(asperity, tmp_path: Path) -> None:
    out, plot = tmp_path / "map.nc", tmp_path / "map.png"
    result = asperity(*LAW, *AXES, "--out", out, "--plot", plot, "--show", "mu1", "--json")
    assert result.exit_code == 0, result.stderr
    record = json.loads(result.stdout)
    assert record["points"] == 25
    assert record["stable"] + record["unstable"] == 25
    assert record["failed"] == record["boundary_not_found"] == 0
    (line,) = record["boundaries"]
    unmodulated = line["K"][line["epsilon"].index(0.0)]
    assert unmodulated == pytest.approx(KC, rel=2e-6)
    assert set(line["kind"]) == {"Neimark-Sacker"}
    assert plot.read_bytes().startswith(b"\x89PNG")
    with xarray.open_dataset(out) as found:
        assert found["mu1"].dims == ("K", "epsilon")
        assert found["A"].attrs["origin"] == "bureau2000"
        assert found["V"].attrs["origin"] == "command line"
        assert int(found["stable"].sum()) == record["stable"]


def test_a_map_as_text_on_logarithmic_axes(asperity, tmp_path: Path) -> None:
    out = tmp_path / "map.nc"
    call = (*LAW, "--x", "epsilon=0.001:0.1:3", "--log-x", "--y", "K=0.1:0.4:3 N/um", "--log-y")
    result = asperity(*call, "--out", out)
    assert result.exit_code == 0, result.stderr
    assert result.stdout.split()[:2] == ["points", "9"]
    assert "boundary  Neimark-Sacker" in result.stdout
    with xarray.open_dataset(out) as found:
        np.testing.assert_allclose(found["epsilon"], [1e-3, 1e-2, 1e-1], rtol=1e-12)
        np.testing.assert_allclose(found["K"], [1e5, 2e5, 4e5], rtol=1e-12)


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        (("--x", "K"), ["axis must be NAME=LOW:HIGH:COUNT UNIT, got 'K'"]),
        (("--x", "K=1:2:5"), ["axis of K must carry a unit"]),
        (("--x", "epsilon=0:0.4:5", "--log-x"), ["must start above zero to be logarithmic"]),
        (("--x", "K=0.1:0.3:5 N/um"), ["axes must be two numbers, got 'K' on both"]),
        (("--x", "V=1:10:5 um/s"), ["V must be given once"]),
        (("--set", "K=0.2 N/um"), ["K must be given once"]),
        (("--show", "mu9"), ["--show must be one of mean_friction, delta_mu"]),
        (("--plot", "map.jpg"), ["--plot must be a PNG file"]),
        (("--plot", "no/map.png"), ["--plot must lie in a folder that exists"]),
        (("--out", "no/map.nc"), ["--out must lie in a folder that exists"]),
        (("--out", "."), ["--out must be the name of a file, got '.'"]),
    ],
)
def test_a_bad_question(asperity, tmp_path, monkeypatch, arguments, parts) -> None:
    monkeypatch.chdir(tmp_path)
    options = {"--x": "epsilon=0:0.4:5", "--y": "K=0.1:0.3:5 N/um", "--out": "map.nc"}
    given = dict(zip(arguments[::2], arguments[1::2], strict=False))
    call = [text for pair in options.items() if pair[0] not in given for text in pair]
    refused(asperity(*LAW, *call, *arguments), *parts)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("missing", ["--x", "--y", "--out"])
def test_a_missing_option(asperity, tmp_path, monkeypatch, missing) -> None:
    monkeypatch.chdir(tmp_path)
    options = {"--x": "epsilon=0:0.4:5", "--y": "K=0.1:0.3:5 N/um", "--out": "map.nc"}
    call = [text for pair in options.items() if pair[0] != missing for text in pair]
    refused(asperity(*LAW, *call), f"{missing} must be given, got nothing")
    refused(asperity("map", *call), "must be given, got nothing")


def test_a_point_without_numbers_is_told(asperity, tmp_path) -> None:
    call = ("map", "--law", "rice-ruina", *AXES, "-V", "1 um/s", "-f", "120 Hz")
    refused(asperity(*call, "--out", tmp_path / "m.nc"), "got none for mu0, A, B, D0, V0, W0")
