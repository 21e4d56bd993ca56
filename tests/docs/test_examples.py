"""What `help` shows of a public function has an example, and the example runs."""

import doctest
import inspect

import matplotlib as mpl
import pytest

import asperity as asp

#: What starts a server, which `tests/app/test_notebook.py` calls, and what no one calls.
OTHERS = {"InputError", "explore"}
FUNCTIONS = [n for n in asp.__all__ if callable(getattr(asp, n)) and n not in OTHERS]


@pytest.mark.long
@pytest.mark.parametrize("name", FUNCTIONS)
def test_the_example_runs(name, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    mpl.use("agg")
    examples = doctest.DocTestParser().get_examples(inspect.getdoc(getattr(asp, name)) or "")
    assert examples
    namespace: dict[str, object] = {}
    for example in examples:
        exec(compile(example.source, f"help({name})", "single"), namespace)
