"""Faults in the files of a finished store: repaired, or refused in one sentence."""

import json
import shutil
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray
from click.testing import CliRunner, Result

import asperity.study.run as run_module
from asperity.cli.main import main
from references.closed_form_sweep import ClosedForm, ThisProcess
from references.populations import draws

PLAN = """
law = "rice-ruina"
material = "bureau2000"
parameters.V = "1 um/s"
parameters.frequency = "120 Hz"
# A ratio, so that a coordinate along an axis is derived, and a list of rows.
[axes.stiffness_ratio]
values = [0.5, 1.5]
[axes.sample]
zip.epsilon = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.61, 0.62, 0.7, 0.8, 0.85, 0.9]
zip.M = ["1 g", "2 g", "3 g", "4 g", "5 g", "6 g", "7 g", "8 g", "9 g", "1 kg", "2 kg", "3 kg"]
"""
POINTS = 24


def call(*arguments: object) -> Result:
    result = CliRunner().invoke(main, [str(a) for a in arguments], prog_name="asperity")
    # A traceback is never an answer.
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exc_info
    if result.exit_code == 2:
        assert result.stdout == ""
        assert result.stderr.startswith("asperity: ")
        assert result.stderr.count("\n") == 1
        assert result.stderr.isprintable() or result.stderr[:-1].isprintable()
    else:
        assert result.exit_code == 0, result.stderr
    return result


def content_of(store: Path, consolidated: bool) -> dict[str, Any]:
    """Everything that xarray reads: kinds, values to the last bit, and attributes."""
    with xarray.open_zarr(store, consolidated=consolidated, chunks=None) as dataset:
        variables = {
            str(name): (v.dims, v.dtype.str, v.values.tolist() if v.dtype.kind in "OUT" else
                        v.values.tobytes(), repr(v.attrs))
            for name, v in dataset.variables.items()
        }  # fmt: skip
        of_runs = ("runs", "seal")
        return {**variables, "": {n: v for n, v in dataset.attrs.items() if n not in of_runs}}


class Whole:
    """A finished store, and what the commands answer about it."""

    def __init__(self, folder: Path) -> None:
        self.plan, self.store = folder / "plan.toml", folder / "whole.zarr"
        self.plan.write_text(PLAN, encoding="utf-8")
        made = json.loads(call("sweep", self.plan, "--out", self.store, "--json").stdout)
        assert [*made] == ["points", "failed", "solved", "seconds", "memory", "lost", "out"]
        assert made["points"] == made["solved"] == POINTS
        self.content = content_of(self.store, True)
        assert content_of(self.store, False) == self.content
        self.files = sorted(
            str(f.relative_to(self.store)) for f in self.store.rglob("*") if f.is_file()
        )
        self.summary = call("sweep", "summary", self.store, "--json").stdout
        self.export = self.exported(self.store)

    def exported(self, store: Path) -> str:
        table = store.with_suffix(".csv")
        call("sweep", "export", store, table)
        return table.read_text() if table.exists() else ""


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Whole]:
    """Made once; the closed form and this process stand for the solver and its workers."""
    from asperity.study import job
    from asperity.study.solve import SOLVES

    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(SOLVES, "periodic", ClosedForm())
        patch.setenv("NPROC", "1")
        patch.setattr(run_module, "local_processes", lambda count: nullcontext(ThisProcess()))
        job._opened.cache_clear()
        yield Whole(tmp_path_factory.mktemp("planted"))


Draw = np.random.Generator
Plant = Callable[[Path, Draw], None]


def deleted(file: Path, draw: Draw) -> None:
    file.unlink()


def emptied(file: Path, draw: Draw) -> None:
    file.write_bytes(b"")


def cut(file: Path, draw: Draw) -> None:
    content = file.read_bytes()
    file.write_bytes(content[: draw.integers(len(content))])


def turned(file: Path, draw: Draw) -> None:
    content = bytearray(file.read_bytes())
    content[draw.integers(len(content))] ^= 1 << int(draw.integers(8))
    file.write_bytes(content)


def noise(file: Path, draw: Draw) -> None:
    file.write_bytes(draw.bytes(int(draw.integers(1, 200))))


def folder(file: Path, draw: Draw) -> None:
    file.unlink()
    file.mkdir()
    (file / "0").write_bytes(b"0")


def without_folder(file: Path, draw: Draw) -> None:
    shutil.rmtree(file.parent)


def file_for_folder(file: Path, draw: Draw) -> None:
    shutil.rmtree(file.parent)
    file.parent.write_bytes(b"0")


def of_another(file: Path, draw: Draw) -> None:
    """The content of another file of the same kind: sound, and wrong there."""
    store = next(p for p in file.parents if p.suffix == ".zarr")
    others = [
        f for f in sorted(store.rglob("*"))
        if f.is_file() and (f.name == "zarr.json") == (file.name == "zarr.json")
    ]  # fmt: skip
    file.write_bytes(others[draw.integers(len(others))].read_bytes())


def other_json(file: Path, draw: Draw) -> None:
    texts = ["null", "3", '"x"', "[]", "{}", "[" * 100_000, "9" * 5000, '{"attributes": []}', "NaN"]
    file.write_text(texts[draw.integers(len(texts))])


def _somewhere(content: Any, draw: Draw) -> tuple[Any, Any]:
    """A container in a tree, and one of its keys."""
    places: list[tuple[Any, Any]] = []
    level = [content]
    while level:
        one = level.pop()
        keys = list(one) if isinstance(one, dict) else range(len(one))
        places += [(one, key) for key in keys]
        level += [one[key] for key in keys if isinstance(one[key], dict | list)]
    # Shallow ones as often as the many deep ones.
    return places[int(len(places) ** draw.random()) - 1]


def key_removed(file: Path, draw: Draw) -> None:
    content = json.loads(file.read_text())
    container, key = _somewhere(content, draw)
    del container[key]
    file.write_text(json.dumps(content))


def value_changed(file: Path, draw: Draw) -> None:
    content = json.loads(file.read_text())
    container, key = _somewhere(content, draw)
    others = [None, True, -1, 7, 10**30, 0.5, "x", "", "\ud800", [], [1, 1], {}, {"a": 1}]
    container[key] = others[draw.integers(len(others))]
    file.write_text(json.dumps(content))


def dtype_changed(file: Path, draw: Draw) -> None:
    content = json.loads(file.read_text())
    kinds = ["float32", "int64", "int16", "complex64", "bool", "string", "no such type"]
    content["data_type"] = kinds[draw.integers(len(kinds))]
    file.write_text(json.dumps(content))


def attribute_removed(file: Path, draw: Draw) -> None:
    content = json.loads(file.read_text())
    names = sorted(content["attributes"])
    if names:
        del content["attributes"][names[draw.integers(len(names))]]
    file.write_text(json.dumps(content))


def attribute_changed(file: Path, draw: Draw) -> None:
    content = json.loads(file.read_text())
    names = sorted(content["attributes"])
    others = [None, 3, "x", "", [], ["x"], {}, 0.5, "{}", "[1]", "null"]
    if names:
        content["attributes"][names[draw.integers(len(names))]] = others[draw.integers(len(others))]
    file.write_text(json.dumps(content))


ANY = (deleted, emptied, cut, turned, noise, folder, without_folder, file_for_folder, of_another)
DESCRIPTION = (
    *(other_json, key_removed, value_changed, dtype_changed, attribute_removed, attribute_changed),
)


def check(whole: Whole, out: Path, file: str, plant: Plant, seed: int) -> None:
    """Plant a fault, and see what every command makes of it before and after a sweep."""
    shutil.copytree(whole.store, out)
    plant(out / file, np.random.default_rng(seed))
    status = call("sweep", "status", out, "--json")
    done = json.loads(status.stdout)["done"] if status.exit_code == 0 else 0
    if done == POINTS:
        assert content_of(out, False) == content_of(out, True) == whole.content
    # What is answered is the truth; where the status of a chunk is lost, about fewer points.
    summary, exported = call("sweep", "summary", out, "--json").stdout, whole.exported(out)
    assert summary in ("", whole.summary) or 0 < done < POINTS
    assert set(exported.splitlines()) <= set(whole.export.splitlines())
    assert exported in ("", whole.export) or 0 < done < POINTS
    out.with_suffix(".csv").unlink(missing_ok=True)
    swept = call("sweep", whole.plan, "--out", out)
    if swept.exit_code == 0:
        assert content_of(out, False) == content_of(out, True) == whole.content
        assert json.loads(call("sweep", "status", out, "--json").stdout)["done"] == POINTS
        assert call("sweep", "summary", out, "--json").stdout == whole.summary
        assert whole.exported(out) == whole.export
    else:
        # Only a store without its plan is not repaired.
        assert "must be the folder of a sweep" in swept.stderr
    shutil.rmtree(out)


def kind_of(file: str) -> str:
    """Files of one kind are treated alike."""
    name = file.split("/")[0]
    known = ("zarr.json", "attributes", "status", "checksum", "outcome", "mu1", "law", "K")
    return f"{name if name in known else 'other'} {file.endswith('zarr.json')}"


def can_have(plant: Plant, file: str) -> bool:
    """Whether a fault can be planted in a file."""
    if plant in (without_folder, file_for_folder):
        return file != "zarr.json"
    return plant not in DESCRIPTION or file.endswith("zarr.json")


@pytest.mark.parametrize("plant", [*ANY, *DESCRIPTION])
@draws(1, 4)
def test_a_planted_fault_is_repaired_or_refused(
    whole: Whole, tmp_path: Path, plant: Plant, draws: int
) -> None:
    seed = [*ANY, *DESCRIPTION].index(plant)
    draw = np.random.default_rng(seed)
    kinds: dict[str, list[str]] = {}
    for file in whole.files:
        if can_have(plant, file):
            kinds.setdefault(kind_of(file), []).append(file)
    for kind in draw.permutation(sorted(kinds))[:draws]:
        file = kinds[kind][draw.integers(len(kinds[kind]))]
        check(whole, tmp_path / "s.zarr", file, plant, seed)
