"""Ctrl-C behind a finished motion: what is whole is said, and no half recording is left."""

import pytest

from asperity.cli.main import main

PROTOCOL = """
law = "rice-ruina"
material = "bureau2000"
steps = ["slide for 0.1 s"]
[parameters]
K = "0.5 N/um"
[start]
velocity = "10 um/s"
[solver]
sampling = "4 kHz"
[tribometer]
rate = "1 kHz"
[tribometer.sensors."cell"]
type = "load cell"
bandwidth = "1 kHz"
"""


def test_an_interrupted_recording_leaves_the_motion_and_says_so(
    tmp_path, monkeypatch, capsys
) -> None:
    from asperity.recording.writers import WRITERS

    def interrupted(trace, columns, path):
        path.write_text("half a recording")
        raise KeyboardInterrupt

    monkeypatch.setitem(WRITERS, ".csv", interrupted)
    protocol, out, record = (tmp_path / n for n in ("p.toml", "run.nc", "recording.csv"))
    protocol.write_text(PROTOCOL)
    with pytest.raises(SystemExit) as left:
        main(["run", str(protocol), "--out", str(out), "--record", str(record)])
    said = capsys.readouterr().err
    assert left.value.code == 130
    assert "interrupted after the motion was finished" in said
    assert f"'{out}' is whole" in " ".join(said.split())
    assert out.is_file()
    assert not record.exists()
