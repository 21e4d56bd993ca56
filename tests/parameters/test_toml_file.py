"""Texts that no reader of TOML may choke on, in every kind of file that is TOML."""

import os
import random
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from asperity import materials
from asperity.app.api.protocols import checked
from asperity.errors import InputError
from asperity.inference import read_plan, read_table
from asperity.ledger.contents import read_contents
from asperity.parameters import toml_file
from asperity.parameters.toml_file import parsed_toml
from asperity.protocol import load_protocol
from asperity.questions.recording import ReadingRecipe
from asperity.study import load_plan

READERS: tuple[Callable[[Path], Any], ...] = (
    *(load_plan, load_protocol, ReadingRecipe.from_file, read_plan, materials.load, read_contents),
)


def nested(depth: int, draw: random.Random) -> str:
    """Lists, tables, keys and headings in each other, in all mixtures."""
    key = draw.choice(["a", '"a b"', "'c.d'"])
    kind = draw.randrange(5)
    if kind == 0:
        return f"title = {'[' * depth}{']' * depth}"
    if kind == 1:
        return f"title = {'{a=' * depth}1{'}' * depth}"
    if kind == 2:
        return f"title = {'[{a=' * (depth // 2)}1{'}]' * (depth // 2)}"
    if kind == 3:
        return ".".join([key] * depth) + " = 1"
    return f"[{' . '.join([key] * depth)}]"


def large_integer(digits: int, draw: random.Random) -> str:
    number = draw.choice("123456789") + "".join(draw.choices("0123456789", k=digits - 1))
    text = draw.choice([number, f"-{number}", f"0x{number}", f"+{number}"])
    return draw.choice([f"chunk = {text}", f"a.b = [1, {{c = {text}}}]", f"[x]\ny = {text}"])


@pytest.mark.parametrize("reader", READERS, ids=lambda r: r.__module__)
def test_deep_texts_and_large_integers_are_a_sentence(
    tmp_path: Path, reader: Callable[[Path], Any]
) -> None:
    draw = random.Random(7)
    file = tmp_path / "file.toml"
    for depth in (150, 400, 5000, 100_000, *(draw.randrange(210, 50_000) for _ in range(6))):
        file.write_text(nested(depth, draw), encoding="utf-8")
        with pytest.raises(InputError, match="tables and lists in each other, got more"):
            reader(file)
    for digits in (20, 400, 5000, *(draw.randrange(20, 30_000) for _ in range(6))):
        file.write_text(large_integer(digits, draw), encoding="utf-8")
        with pytest.raises(InputError, match="integers of at most 64 bits"):
            reader(file)


def test_the_page_says_so_too() -> None:
    draw = random.Random(8)
    for text in (nested(3000, draw), large_integer(5000, draw), "steps = ["):
        protocol, mistakes = checked(f"law = 'rice-ruina'\n{text}")
        assert protocol is None
        assert "protocol must " in mistakes[0]["sentence"]
    assert mistakes[0]["line"] == 2


@pytest.mark.parametrize("seed", range(5))
def test_what_a_person_writes_is_read_as_it_is(seed: int) -> None:
    """Numbers up to 64 bits, depths up to a dozen, long texts with dots and brackets."""
    draw = random.Random(seed)
    text = "\n".join(
        [
            f"big = {draw.choice([2**63 - 1, -(2**63), 10**18])}",
            f'title = "{"See Fig. 3 [12]. " * 200}"',
            f"path = '{'folder.d/' * 200}'",
            f"deep = {'[' * 12}1.5{']' * 12}",
            ".".join("abcdefghij") + " = 'x'",
        ]
    )
    assert parsed_toml(text, "plan") == tomllib.loads(text)


@pytest.mark.skipif(os.name != "posix", reason="no such device")
def test_files_without_an_end_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for reader in (load_plan, load_protocol, ReadingRecipe.from_file, read_plan, materials.load):
        with pytest.raises(InputError, match="must be a readable TOML file, got '/dev/zero'"):
            reader(Path("/dev/zero"))
    with pytest.raises(InputError, match="must be a regular file, got '/dev/zero', a device"):
        read_table("/dev/zero")
    monkeypatch.setattr(toml_file, "LARGEST", 1000)
    (tmp_path / "long.toml").write_text("title = 'x'\n" + "#" * 1000)
    with pytest.raises(InputError, match="it has more than 1,000 bytes"):
        load_plan(tmp_path / "long.toml")
