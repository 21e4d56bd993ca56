"""Requests that nobody means: random JSON, random protocols, and clients that do not go on."""

import copy
import importlib
import json
import os
import random
import signal
import socket
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from asperity.app import security
from asperity.app.api import TABS
from asperity.app.api.protocols import checked
from asperity.app.endpoints import Upload
from asperity.app.uploads import Uploads
from references.populations import population

ENDPOINTS = [
    endpoint.path
    for tab in TABS
    for endpoint in importlib.import_module(f"asperity.app.api.{tab}").ENDPOINTS
    if not isinstance(endpoint, Upload)
]

NUMBERS = {"V": 1e-6, "epsilon": 0.2, "frequency": 120.0}
POINT = {"law": "amontons", "numbers": NUMBERS, "laws": ["amontons"], "air": {"h0": "100 um"}}
MAP = {
    "law": "amontons", "numbers": NUMBERS, "air": {"h0": "100 um"}, "show": "mu1", "count": 4,
    "x": {"name": "frequency", "low": 10, "high": 100, "log": True},
    "y": {"name": "epsilon", "low": 0.01, "high": 0.4},
}  # fmt: skip
MEASURED = {
    "recording": "0" * 32,
    "source": {"columns": {"W": "a"}, "units": {"a": "N"}, "rate": "1 kHz"},
    "options": {"modulated": False, "window": [0, 1], "steps": [1.0], "harmonics": 4},
}
QUESTIONS = {"explore": POINT, "map/text": MAP, "data/measure": MEASURED}

WORDS = [
    *("", "\0", "²", "1² um/s", "١ um/s", "1e400 m", "9" * 55 + " Hz", "nan", "-1 um/s"),
    *("__class__", "1 um^99999", "1 um**9**9**9", "1 ((((um", "\x1b[31m", "a" * 61),
    *("\ud800", "x\udfff"),
]
NUMERALS = [10**400, -(10**4000), 10**30, 2**63, -1, 0, 1e308, -1e308, 5e-324]


def nested(depth):
    value = []
    for _ in range(depth):
        value = [value]
    return value


def spoiled(question, draw, values, names):
    """A question in which one or two things are others."""
    question = copy.deepcopy(question)
    for _ in range(draw.choice([1, 2])):
        node = question
        while True:
            key = draw.choice(list(node) if isinstance(node, dict) else range(len(node)))
            inner = node[key]
            if not (isinstance(inner, dict | list) and inner and draw.random() < 0.7):
                break
            node = inner
        if isinstance(node, dict) and draw.random() < 0.2:
            key = draw.choice(names)
        node[key] = draw.choice(values)
    return question


@pytest.mark.parametrize("seed", population(8, short=3))
def test_random_json_gets_an_answer_or_a_sentence(ask, seed):
    draw = random.Random(seed)
    values = [*WORDS, *NUMERALS, True, None, [], {}, nested(3), nested(500), {"\ud800": 1}]
    names = ["self", "x" * 70, "²", "\ud800"]
    for _ in range(30):
        path = draw.choice(list(QUESTIONS))
        asked = spoiled(QUESTIONS[path], draw, values, names)
        answer = ask(path, asked)
        assert answer.status in (200, 400), (path, asked, answer.body)
        if answer.status == 400:
            message = answer.json["error"]
            assert " must " in message, asked
            assert len(message) < 600


@pytest.mark.parametrize("path", ENDPOINTS)
def test_half_a_surrogate_pair_is_refused_wherever_json_is_read(ask, path):
    for half in ("\\ud800", "x\\udbff\\u0041", "\\udc00\\ud800"):
        for body in (f'{{"law": "{half}"}}', f'{{"{half}": 1}}', f'{{"a": [[{{"b": "{half}"}}]]}}'):
            answer = ask(path, body.encode())
            assert answer.status == 400
            assert "whole characters" in answer.json["error"]


#: Bodies that no endpoint takes.
BODIES = [
    *("", "[]", "null", '"x"', "{", '{"nix": 1}', '{"law": NaN}', '{"law": {"a": [1e999]}}'),
    '{"law": 5, "numbers": [], "text": 5, "paper": [], "figure": -1, "recording": {}, "laws": 7}',
]


@pytest.mark.parametrize("path", ENDPOINTS)
def test_every_endpoint_refuses_what_is_no_question(ask, path):
    for body in BODIES:
        answer = ask(path, body.encode())
        assert answer.status == 400, body
        assert " must " in answer.json["error"], body


@pytest.mark.parametrize("path", ENDPOINTS)
def test_a_key_twice_is_refused_wherever_json_is_read(ask, path):
    for body in (b'{"law": "amontons", "law": "rice-ruina"}', b'{"a": [{"V": 1e-6, "V": 1e-5}]}'):
        answer = ask(path, body)
        assert answer.status == 400
        assert "request.body must name every key once, got '" in answer.json["error"]


def test_a_long_text_is_named(ask):
    answer = ask("explore", json.dumps({"law": "x" * 301}).encode())
    assert "law must have at most 300 characters, got 301" in answer.json["error"]


def test_a_whole_surrogate_pair_is_a_character(ask):
    answer = ask("explore", b'{"law": "\\ud83d\\ude00"}')
    assert "got '\U0001f600'" in answer.json["error"]


PROTOCOL = {
    "law": "rice-ruina", "material": "bureau2000",
    "steps": ["slide for 1 s", "hold 2 s", "step load to 9 N"],
    "start": {"velocity": "1 um/s", "load": "7 N", "states": [0.4, 0.0]},
    "parameters": {"A": 0.01, "K": "0.2 N/um"},
    "solver": {"inertia": False, "sampling": "1 kHz", "rtol": 1e-9, "most_steps": 1e5},
    "tribometer": {
        "seed": 1, "rate": "100 Hz",
        "sensors": {
            "shear force": {
                "type": "spring gauge", "bandwidth": "200 Hz", "stiffness": "0.2 N/um"
            },
            "W": {"type": "load cell", "measures": "normal load", "bandwidth": "200 Hz"},
        },
    },
}  # fmt: skip


class Written(str):
    """TOML as it is."""


def toml(value):
    if isinstance(value, Written):
        return value
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(k)} = {toml(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return f"[{', '.join(map(toml, value))}]"
    return json.dumps(value)


#: Values as a file may hold them, in TOML.
IN_A_FILE = [
    *("5", "-5", "1e308", "1e-320", "nan", "inf", "9" * 5000, "9" * 4000, "0x" + "f" * 5000),
    *('"²"', '"1e9999999 um/s"', '["x"]', '[["x"]]', "{a = 1}", "[]", "{}", "true", "1979-05-27"),
    *("[" * 500 + "]" * 500, f'"{"a" * 3000}"', '"repeat ² times: hold 1 s"', '"hold 1e400 s"'),
    f'"repeat {"9" * 5000} times: hold 1 s"',
    f'{{repeat = {"9" * 4000}, steps = ["hold 1 s"]}}',
    '"modulate load by 0.2 at 1e300 Hz for 1e300 s"',
]


@pytest.mark.parametrize("seed", population(8, short=3))
def test_a_random_protocol_is_one_or_has_sentences(seed):
    assert checked("\n".join(f"{name} = {toml(v)}" for name, v in PROTOCOL.items()))[1] == []
    draw = random.Random(seed)
    names = ["self", "type", "measures", "ranges", "x²", "model_fields", "steps"]
    for _ in range(60):
        asked = spoiled(PROTOCOL, draw, [Written(v) for v in IN_A_FILE], names)
        text = "\n".join(f"{json.dumps(name)} = {toml(v)}" for name, v in asked.items())
        protocol, mistakes = checked(text)
        assert (protocol is None) == bool(mistakes)
        for mistake in mistakes:
            assert " must " in mistake["sentence"], text[:2000]


# --- Clients that do not go on -------------------------------------------------------------------


def post(server, path, kind, *more):
    head = [f"POST /api/{path} HTTP/1.1", f"Host: 127.0.0.1:{server.port}", f"Content-Type: {kind}"]
    return "\r\n".join([*head, *more, "", ""]).encode()


def beginnings(server):
    """What a client sends first, and what it sends on without end."""
    length, pieces = "Content-Length: 60000", "Transfer-Encoding: chunked"
    json_, file = "application/json", "application/octet-stream"
    return {
        "nothing": (b"", b""),
        "a blank line": (b"", b"\r\n"),
        "half a head": (b"GET / HTTP/1.1\r\n", b"X-Y: z\r\n"),
        "half a body": (post(server, "explore", json_, length), b""),
        "a slow body": (post(server, "explore", json_, length), b"1"),
        "slow pieces": (post(server, "explore", json_, pieces), b"1\r\n1\r\n"),
        "a slow file": (post(server, "data/upload", file, length), b"1"),
        "a body for nobody": (post(server, "nothing", json_, length), b"1"),
        "a refused body": (post(server, "explore", "text/plain", pieces), b"1\r\n1\r\n"),
    }


def opened(server):
    return socket.create_connection(("127.0.0.1", server.port), timeout=60)


def is_ended(connection, again, times=600):
    """Whether the server ends a connection on which `again` is sent again and again."""
    connection.settimeout(0.1)
    for _ in range(times):
        try:
            if again:
                connection.sendall(again)
            if not connection.recv(4096):
                return True
        except TimeoutError:
            continue
        except OSError:  # ended while something was under way
            return True
    return False


@pytest.mark.parametrize("kind", beginnings(type("", (), {"port": 0})))
def test_a_client_that_does_not_go_on_is_ended(server, ask, monkeypatch, kind):
    monkeypatch.setattr(security, "HEAD_PAUSE", 0.2)
    monkeypatch.setattr(security, "BODY_PAUSE", 0.2)
    first, again = beginnings(server)[kind]
    with opened(server) as connection:
        connection.sendall(first)
        assert is_ended(connection, again)
    assert ask("/").status == 200


def test_a_body_that_comes_as_a_file_is_read_may_take_longer_than_a_pause(server, monkeypatch):
    monkeypatch.setattr(security, "BODY_PAUSE", 1.0)
    content = b"1,2\n" * 8192
    head = f"Content-Length: {8 * len(content)}", "Connection: close"
    with opened(server) as connection:
        connection.sendall(post(server, "data/upload", "application/octet-stream", *head))
        for _ in range(8):
            connection.settimeout(0.25)
            with pytest.raises(TimeoutError):
                connection.recv(1)
            connection.sendall(content)
        connection.settimeout(60)
        with connection.makefile("rb") as answer:
            assert b"200" in answer.readline()


@pytest.mark.parametrize("kind", ["nothing", "half a body"])
def test_connections_that_are_held_leave_room(server, ask, monkeypatch, kind):
    monkeypatch.setattr(security, "MOST_CONNECTIONS", 20)
    first, _ = beginnings(server)[kind]
    held = []
    try:
        for _ in range(300):
            held.append(opened(server))
            held[-1].sendall(first)
        for _ in range(3):
            assert ask("/").status == 200
    finally:
        for connection in held:
            connection.close()


KILLED = """
import os, signal, sys
from asperity.app.uploads import Uploads
uploads = Uploads()
upload = uploads.begin("secret.csv")
upload.path.write_bytes(b"1,2")
print(upload.path.parent, flush=True)
os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="this system does not kill so")
def test_files_of_a_killed_server_go_with_the_next_and_those_of_a_living_one_stay(
    tmp_path, monkeypatch
):
    pytest.importorskip("fcntl", reason="this system has no such locks")
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    living = Uploads()
    kept = living.begin("kept.csv").path
    kept.write_bytes(b"1")
    stranger = tmp_path / "asperity-page-of-somebody"
    stranger.mkdir()
    killed = subprocess.run(
        [sys.executable, "-c", KILLED], env={**os.environ, "TMPDIR": str(tmp_path)},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    left = Path(killed.stdout.strip())
    assert killed.returncode == -signal.SIGKILL
    assert [p.read_bytes() for p in left.iterdir()] == [b"1,2"]
    following = Uploads()
    assert not left.exists()
    assert kept.read_bytes() == b"1"
    assert stranger.exists()
    following.close()
    living.close()
    assert list(tmp_path.iterdir()) == [stranger]
