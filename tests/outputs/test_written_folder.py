"""Folders that are written completely or not at all."""

import subprocess
import sys

import pytest

from asperity.outputs import written_folder


def write_and_be_interrupted(folder):
    with written_folder(folder) as staging:
        (staging / "index.html").write_text("after")
        raise KeyboardInterrupt


def test_an_interruption_leaves_the_old_folder(tmp_path):
    old = tmp_path / "old"
    old.mkdir()
    (old / "index.html").write_text("before")
    for folder in (old, tmp_path / "new" / "deep"):
        with pytest.raises(KeyboardInterrupt):
            write_and_be_interrupted(folder)
    assert [p.name for p in tmp_path.iterdir()] == ["old"]
    assert [p.name for p in old.iterdir()] == ["index.html"]
    assert (old / "index.html").read_text() == "before"


def test_other_files_in_the_folder_are_kept(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    (tmp_path / "index.html").write_text("before")
    with written_folder(tmp_path) as staging:
        (staging / "data").mkdir()
        (staging / "data" / "x.csv").write_text("1")
        (staging / "index.html").write_text("after")
    assert (tmp_path / "notes.txt").read_text() == "mine"
    assert (tmp_path / "index.html").read_text() == "after"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["data", "index.html", "notes.txt"]


_HOLD = """
import sys, time
from pathlib import Path
from asperity.outputs import written_folder
with written_folder(Path(sys.argv[1])) as staging:
    (staging / "half").write_text("x")
    print("ready", flush=True)
    time.sleep(600)
"""


@pytest.fixture
def holder(tmp_path):
    """A process that is writing a folder, through a hidden temporary folder."""
    with subprocess.Popen(
        [sys.executable, "-c", _HOLD, str(tmp_path)], stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout.readline() == "ready\n"
        yield process
        process.kill()


@pytest.mark.skipif(sys.platform == "win32", reason="no locks on folders")
def test_the_next_run_removes_the_temporary_folder_of_a_killed_one(tmp_path, holder):
    (temporary,) = tmp_path.glob(".asperity-*")
    with written_folder(tmp_path) as staging:
        # The folder of the running process is kept.
        assert {p.name for p in tmp_path.glob(".asperity-*")} == {temporary.name, staging.name}
    holder.kill()
    holder.wait()
    assert (temporary / "half").exists()
    with written_folder(tmp_path) as staging:
        assert [p.name for p in tmp_path.glob(".asperity-*")] == [staging.name]
    assert list(tmp_path.iterdir()) == []
