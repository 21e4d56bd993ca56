"""Readers of other packages, registered by entry points."""

from __future__ import annotations

import json
import runpy
import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from asperity.cli.main import main
from asperity.errors import InputError
from asperity.recording import read
from asperity.recording.readers.from_file import reader_points

ROOT = Path(__file__).parents[3]
EXAMPLE = ROOT / "examples" / "lab_reader.py"


def installed(folder: Path, points: str) -> None:
    """Write the metadata that an installer writes for a package with entry points."""
    about = folder / "lab_reader-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: lab-reader\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(f"[asperity.readers]\n{points}\n")


@pytest.fixture
def package(tmp_path, monkeypatch):
    """Function that installs modules of given text with entry points, for one test."""

    def make(points: str, **modules: str) -> None:
        folder = tmp_path / "installed"
        folder.mkdir()
        installed(folder, points)
        for name, text in modules.items():
            (folder / f"{name}.py").write_text(text)
        monkeypatch.syspath_prepend(str(folder))
        reader_points.cache_clear()

    yield make
    for name in ("lab_reader", "broken_reader"):
        sys.modules.pop(name, None)
    reader_points.cache_clear()


@pytest.fixture
def recording(tmp_path):
    path = tmp_path / "run1.gbx"
    runpy.run_path(str(EXAMPLE))["write_example"](path)
    return path


def test_a_file_of_another_package_is_recognised_and_read(package, recording):
    package("gaugebox = lab_reader", lab_reader=EXAMPLE.read_text())
    for trace in (read(recording), read(recording, format="gaugebox")):
        assert trace.sample_rate == pytest.approx(1000)
        assert trace.channel("W").unit == "N"
        assert trace.channel("W").recorded_name == "load cell"
        assert trace.channel("F").values.mean() == pytest.approx(2.8, abs=1e-3)
        assert trace.provenance["format"] == "gaugebox"


def test_the_command_line_takes_the_format(package, recording):
    package("gaugebox = lab_reader", lab_reader=EXAMPLE.read_text())
    arguments = ["measure", str(recording), "--format", "gaugebox", "--json"]
    done = CliRunner().invoke(main, arguments, catch_exceptions=False)
    assert done.exit_code == 0, done.stderr
    record = json.loads(done.stdout)
    assert record["mu1"] == pytest.approx(0.05 / 7, rel=1e-2)
    assert record["provenance"]["format"] == "gaugebox"


def test_files_of_known_formats_are_read_next_to_a_plugin(package, tmp_path):
    package("gaugebox = lab_reader", lab_reader=EXAMPLE.read_text())
    path = tmp_path / "a.csv"
    path.write_text("time (s),F (N)\n" + "".join(f"{i / 10},{i}.5\n" for i in range(20)))
    assert np.array_equal(read(path).channel("F").values, np.arange(20) + 0.5)


RAISES = "def is_format(path):\n    return True\ndef read(path):\n    raise RuntimeError('no')\n"
NOTHING = "def is_format(path):\n    return True\ndef read(path):\n    return [1, 2]\n"
UNEQUAL = (
    "import numpy as np\nfrom asperity.recording.readers import RawColumn, RawRecording\n"
    "def is_format(path):\n    return True\n"
    "def read(path):\n"
    "    return RawRecording([RawColumn('t', np.arange(3.0)), RawColumn('F', np.arange(4.0))])\n"
)
LISTS = UNEQUAL.replace("np.arange(4.0)", "[0, 1, 2]")
NUMBER_UNIT = UNEQUAL.replace("np.arange(4.0))]", "np.arange(3.0), 3)]")
NO_COLUMN = UNEQUAL.replace("RawColumn('F', np.arange(4.0))", "np.arange(3.0)")
TEXT_START = UNEQUAL.replace("np.arange(4.0))]", "np.arange(3.0))], start='now'")
TEXT_FINDING = UNEQUAL.replace("np.arange(4.0))]", "np.arange(3.0))], findings=['odd']")
TEXT_STEP = UNEQUAL.replace("np.arange(4.0))]", "np.arange(3.0))], step='1 ms'")


@pytest.mark.parametrize(
    ("module", "rule"),
    [
        (RAISES, "could not read it .RuntimeError: no."),
        (NOTHING, "must be a reader that returns a RawRecording"),
        (UNEQUAL, "RawRecording.columns must be of one length, got .3, 4. rows"),
        (LISTS, "values must be a ndarray, got a list"),
        (TEXT_STEP, "step must be a number or None, got '1 ms'"),
        (NUMBER_UNIT, "unit must be a text or None, got 3"),
        (NO_COLUMN, r"columns\[1\] must be a RawColumn, got an array"),
        (TEXT_START, "start must be a number, got 'now'"),
        (TEXT_FINDING, r"findings\[0\] must be a Finding, got 'odd'"),
        ("def read(path): ...\n", "must be a reader with is_format"),
        ("import nothing_of_this_name\n", "must be a reader that can be loaded"),
    ],
)
def test_a_reader_with_a_mistake_is_refused(package, recording, module, rule):
    package("broken = broken_reader", broken_reader=module)
    with pytest.raises(InputError, match=rule):
        read(recording, format="broken")


LAYOUT = TEXT_START.replace("def read(path)", "def read(path, *, delimiter=None)").replace(
    "start='now'", "provenance={'delimiter': delimiter}"
)


def test_a_reader_gets_the_layout_options_that_it_names(package, recording, tmp_path):
    package("broken = broken_reader", broken_reader=LAYOUT)
    options = {"columns": {"time": "t"}, "format": "broken"}
    assert read(recording, **options, delimiter="|").provenance["delimiter"] == "|"
    with pytest.raises(InputError, match=r"read\.group must be left out for format 'broken'"):
        read(recording, **options, group="run 1")
    # Of the layout in a recipe, which is for any format, a reader takes the options that it names.
    recipe = tmp_path / "lab.toml"
    recipe.write_text('group = "run 1"\ndelimiter = ";"\n')
    assert read(recording, **options, recipe=recipe).provenance["delimiter"] == ";"


def test_a_reader_with_the_name_of_a_format_is_refused(package, recording):
    package("text = lab_reader", lab_reader=EXAMPLE.read_text())
    with pytest.raises(InputError, match="a name of its own, got 'text'"):
        read(recording)


def test_an_unknown_format_is_refused(recording):
    with pytest.raises(InputError, match=r"read.format must be a format, got 'gaugebox'"):
        read(recording, format="gaugebox")
