"""The example of a reader of one's own."""

import runpy
from pathlib import Path

SCRIPT = Path(__file__).parents[2] / "examples" / "lab_reader.py"


def test_script_recognises_and_reads_its_own_file(capsys):
    runpy.run_path(str(SCRIPT))["main"]()
    lines = capsys.readouterr().out.splitlines()
    assert lines[:2] == ["recognised: True", "columns: load cell (N), shear gauge (N)"]
