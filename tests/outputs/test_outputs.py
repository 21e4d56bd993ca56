"""Where results go: checked first, complete or absent at the end, resumed when interrupted."""

import contextlib
import json
import os
import random
import socket
from pathlib import Path

import pytest

from asperity.errors import InputError
from asperity.outputs import (
    Interrupted,
    UnfinishedText,
    output_file,
    output_files,
    undisturbed,
    written_file,
)
from asperity.outputs.json import json_content, parsed_json
from asperity.outputs.sections import aligned, rounded


def a_folder(path: Path) -> None:
    path.mkdir()


def a_pipe(path: Path) -> None:
    os.mkfifo(path)


def a_socket(path: Path) -> None:
    server = socket.socket(socket.AF_UNIX)
    here = Path.cwd()
    os.chdir(path.parent)  # the address of a socket has at most 107 characters
    try:
        server.bind(path.name)
    finally:
        os.chdir(here)
        server.close()


def a_dangling_link_nowhere(path: Path) -> None:
    path.symlink_to(path.parent / "nowhere" / "file")


def a_circle_of_links(path: Path) -> None:
    path.symlink_to(path)


@pytest.mark.parametrize(
    "made", [a_folder, a_pipe, a_socket, a_dangling_link_nowhere, a_circle_of_links]
)
def test_what_is_no_file_is_refused(tmp_path: Path, made) -> None:
    made(tmp_path / "out.csv")
    with pytest.raises(InputError, match=r"^--out must") as error:
        output_file(tmp_path / "out.csv", "--out")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("made", [a_folder, a_pipe])
@pytest.mark.parametrize("beside", ["out.csv.partial", "out.csv.partial.json", "out.new.csv"])
def test_what_is_in_the_way_beside_it_is_refused(tmp_path: Path, made, beside: str) -> None:
    made(tmp_path / beside)
    with pytest.raises(InputError, match=f"leave room for '{beside}'"):
        output_file(tmp_path / "out.csv", "--out")


@pytest.mark.parametrize(
    "path", ["", ".", "..", "/", "a\0b", "x" * 300, "no/out.csv", "file/out.csv", "out/", "\ud800"]
)
def test_paths_that_are_no_file_names(tmp_path: Path, monkeypatch, path: str) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text("", encoding="utf-8")
    (tmp_path / "out").mkdir()
    with pytest.raises(InputError, match=r"^out must"):
        output_file(path)


def test_an_input_is_not_overwritten(tmp_path: Path) -> None:
    source = tmp_path / "in.csv"
    source.write_text("mine", encoding="utf-8")
    (tmp_path / "link.csv").symlink_to(source)
    (tmp_path / "hard.csv").hardlink_to(source)
    for name in ("in.csv", "link.csv", "hard.csv"):
        with pytest.raises(InputError, match="another file than the table"):
            output_file(tmp_path / name, inputs={"table": source})


def test_two_outputs_are_two_files(tmp_path: Path) -> None:
    (tmp_path / "link.csv").symlink_to(tmp_path / "run.csv")
    paths = {"--out": tmp_path / "run.csv", "--csv": None, "--record": tmp_path / "link.csv"}
    with pytest.raises(InputError, match="--record must be another file than --out"):
        output_files(paths)
    assert output_files({"--out": tmp_path / "run.csv"}) == {"--out": tmp_path / "run.csv"}


def write_half(target: Path) -> None:
    with written_file(target, "--plot") as file:
        file.write_text("half", encoding="utf-8")
        raise KeyboardInterrupt


def test_a_file_is_complete_or_absent(tmp_path: Path) -> None:
    target = tmp_path / "a.png"
    with pytest.raises(KeyboardInterrupt):
        write_half(target)
    assert list(tmp_path.iterdir()) == []
    with written_file(target) as file:
        assert file.suffix == ".png"
        file.write_text("whole", encoding="utf-8")
        assert not target.exists()
    with pytest.raises(KeyboardInterrupt):
        write_half(target)
    assert target.read_text(encoding="utf-8") == "whole"
    assert list(tmp_path.iterdir()) == [target]


def test_an_error_of_the_file_system_is_a_sentence(tmp_path: Path) -> None:
    with (
        pytest.raises(InputError, match=r"^--plot must be a file that can be written"),
        written_file(tmp_path / "no" / "a.png", "--plot") as file,
    ):
        file.write_text("", encoding="utf-8")


INPUTS = {"law": "rice-ruina", "numbers": {"A": 0.01, "K": 1e5}}


def test_blocks_go_on_where_they_ended(tmp_path: Path) -> None:
    target = tmp_path / "out.csv"
    first = UnfinishedText(target, INPUTS)
    assert first.start(resume=False) == {}
    first.append("a\nb\n", 2, failed=1)
    first.append("c\n", 1, failed=0)
    with first.data.open("ab") as stream:
        stream.write(b"half a li")
    second = UnfinishedText(target, INPUTS)
    second.start(resume=True)
    assert (second.rows, second.progress["failed"], second.text()) == (3, 1, "a\nb\nc\n")
    second.append("d\n", 1, failed=1)
    second.finish()
    assert target.read_text(encoding="utf-8") == "a\nb\nc\nd\n"
    assert list(tmp_path.iterdir()) == [target]


@pytest.mark.parametrize(
    ("inputs", "message"),
    [
        ({**INPUTS, "law": "amontons"}, 'law = "rice-ruina" there and "amontons" here'),
        ({**INPUTS, "numbers": {"A": 0.01, "K": 2e5}}, "numbers.K = 100000.0 there and 200000.0"),
        ({**INPUTS, "numbers": {"A": 0.01}}, "numbers.K = 100000.0 there and nothing here"),
        ({**INPUTS, **dict.fromkeys("abcde", 1)}, "2 other differences"),
    ],
)
def test_blocks_of_other_inputs_are_refused_with_the_difference(
    tmp_path: Path, inputs, message: str
) -> None:
    first = UnfinishedText(tmp_path / "out.csv", INPUTS)
    first.start(resume=False)
    first.append("a\n", 1)
    with pytest.raises(InputError, match="must belong to the same inputs") as error:
        UnfinishedText(tmp_path / "out.csv", inputs).start(resume=True)
    assert message in str(error.value)
    with pytest.raises(InputError, match="go on with --resume"):
        UnfinishedText(tmp_path / "out.csv", INPUTS).start(resume=False)
    assert first.text() == "a\n"


def test_blocks_of_another_version_are_refused(tmp_path: Path) -> None:
    first = UnfinishedText(tmp_path / "out.csv", INPUTS)
    first.start(resume=False)
    first.append("a\n", 1)
    record = json.loads(first.record.read_text())
    record["inputs"]["version"] = "0.0.1"
    first.record.write_text(json.dumps(record))
    with pytest.raises(InputError, match=r'version = "0\.0\.1" there'):
        UnfinishedText(tmp_path / "out.csv", INPUTS).start(resume=True)


@pytest.mark.parametrize("text", ["", "{", "[]", '{"inputs": {}}', '{"inputs": 3, "progress": 4}'])
def test_a_damaged_record_is_not_trusted(tmp_path: Path, text: str) -> None:
    first = UnfinishedText(tmp_path / "out.csv", INPUTS)
    first.start(resume=False)
    first.append("a\n", 1)
    first.record.write_text(text)
    with pytest.raises(InputError, match="got a damaged one"):
        UnfinishedText(tmp_path / "out.csv", INPUTS).start(resume=True)


def test_blocks_shorter_than_their_record_are_not_trusted(tmp_path: Path) -> None:
    first = UnfinishedText(tmp_path / "out.csv", INPUTS)
    first.start(resume=False)
    first.append("abc\n", 1)
    first.data.write_text("ab")
    with pytest.raises(InputError, match="got a damaged one"):
        UnfinishedText(tmp_path / "out.csv", INPUTS).start(resume=True)


def test_no_damage_of_finished_blocks_is_taken_for_them(tmp_path: Path) -> None:
    """Of the blocks and of their record: any turned bit, any other text, nested deep as well."""
    target = tmp_path / "out.csv"
    first = UnfinishedText(target, INPUTS)
    first.start(resume=False)
    blocks = [f"{i},{i / 7!r}\n" for i in range(20)]
    for block in blocks:
        first.append(block, 1, failed=0)
    whole = {file: file.read_bytes() for file in (first.data, first.record)}
    draw = random.Random(3)
    accepted = 0
    for i in range(150):
        for file, content in whole.items():
            file.write_bytes(content)
        file = draw.choice(list(whole))
        damaged = bytearray(whole[file])
        if i % 5:
            damaged[draw.randrange(len(damaged))] ^= 1 << draw.randrange(8)
        else:
            deep = draw.choice([b"[", b'{"inputs": ', b'{"progress": {"length": '])
            damaged = bytearray(deep * draw.randrange(1, 100_000))
        file.write_bytes(damaged)
        again = UnfinishedText(target, INPUTS)
        # Blanks and the case of an exponent may change nothing.
        with contextlib.suppress(InputError):
            again.start(resume=True)
            assert (again.rows, again.text()) == (20, "".join(blocks))
            accepted += 1
    assert accepted < 15


def test_names_that_leave_no_room_for_those_beside_them_are_refused(tmp_path: Path) -> None:
    """Whatever is accepted can be written, with all files beside it."""
    for letter in "aé":
        for length in range(225, 256, 2):
            name = letter * ((length - 4) // len(letter.encode())) + ".csv"
            if len(name.encode()) + len(".partial.new.json") > 255:
                with pytest.raises(InputError, match="must have a name of at most 238 bytes"):
                    output_file(tmp_path / name)
                continue
            target = output_file(tmp_path / name)
            output = UnfinishedText(target, INPUTS)
            output.start(resume=False)
            output.append("x", 1)
            with written_file(target) as file:
                file.write_text("x")
            output.finish()
    assert any(len(f.name) > 230 for f in tmp_path.iterdir())


def test_nothing_finished_leaves_nothing(tmp_path: Path) -> None:
    output = UnfinishedText(tmp_path / "out.csv", INPUTS)
    output.start(resume=True)
    with output.interruptible(str):
        pass
    assert list(tmp_path.iterdir()) == []


def test_an_interruption_says_how_to_go_on() -> None:
    assert "with 8 of 12 rows finished; repeat the command with --resume" in str(
        Interrupted("8 of 12 rows")
    )
    assert "nothing was written" in str(Interrupted())


def test_undisturbed_work_hands_back_results_and_errors() -> None:
    assert undisturbed(lambda: 3) == 3
    with pytest.raises(ZeroDivisionError):
        undisturbed(lambda: 1 / 0)


@pytest.mark.parametrize(
    ("value", "doubt", "shown"),
    [
        (12.2, 0.1, ("12.20", "+- 0.10")),
        (701.0, 120.0, ("701", "+- 120")),
        (0.6, 0.0104, ("0.600", "+- 0.010")),
        (-3.3e-4, 1.9e-4, ("-3.3e-04", "+- 1.9e-04")),
        (1.0, 0.0, ("1", "")),
        (10.000018082865530, 1.5e-31, ("10.0000181", "")),
    ],
)
def test_an_uncertainty_has_two_digits_and_its_number_as_many(value, doubt, shown) -> None:
    assert rounded(value, doubt) == shown


def test_a_json_key_twice_is_refused_and_a_file_with_one_damaged(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="request must name every key once, got 'b' twice"):
        parsed_json('{"a": [{"b": 1, "c": 2, "b": 1}]}', "request")
    file = tmp_path / "record.json"
    file.write_text('{"a": 1, "b": {"a": 2}}', encoding="utf-8")
    assert json_content(file) == {"a": 1, "b": {"a": 2}}
    file.write_text('{"a": 1, "a": 2}', encoding="utf-8")
    assert json_content(file) is None


def test_cells_of_a_table_change_no_terminal() -> None:
    assert aligned([("title", "a\x1b[31m\nb"), ("µ", "2")]) == "title  a\\x1b[31m b\nµ      2"
