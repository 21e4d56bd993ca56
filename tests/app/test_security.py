"""Who is answered, and what happens to what is no question."""

import socket

import pytest

POINT = {"law": "amontons", "numbers": {"V": 1e-6, "epsilon": 0.2, "frequency": 120.0}}


@pytest.mark.parametrize(
    "host", ["evil.example", "127.0.0.1.evil.example", "127.0.0.1:1", "localhost", "", "127.1"]
)
def test_a_name_that_is_not_this_machines_is_refused(ask, server, host):
    answer = ask("/", headers={"Host": host})
    assert answer.status in (400, 421)
    assert b"<html" not in answer.body


def test_this_machines_names_are_answered(ask, server):
    for name in ("127.0.0.1", "localhost", "LOCALHOST", "[::1]"):
        assert ask("/", host=f"{name}:{server.port}").status == 200


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "https://127.0.0.1", "file://"])
def test_a_request_of_another_site_is_refused(ask, origin):
    answer = ask("explore", POINT, headers={"Origin": origin})
    assert answer.status == 403
    assert "access-control-allow-origin" not in answer.headers


def test_a_request_that_the_browser_calls_foreign_is_refused(ask):
    assert ask("explore", POINT, headers={"Sec-Fetch-Site": "cross-site"}).status == 403
    assert ask("explore", POINT, headers={"Sec-Fetch-Site": "same-origin"}).status == 200


def test_a_form_of_another_site_cannot_ask(ask):
    """A form sends its text without a preflight request, but never as JSON."""
    answer = ask("explore", POINT, headers={"Content-Type": "text/plain"})
    assert answer.status == 400


def test_no_answer_may_be_framed_or_run_inline_code(ask):
    for path in ("/", "/static/main.js", "/api/catalogue", "/nowhere"):
        headers = ask(path).headers
        policy = dict(
            p.strip().split(" ", 1) for p in headers["content-security-policy"].split(";")
        )
        assert policy["default-src"] == "'none'"
        assert policy["script-src"] == policy["style-src"] == policy["connect-src"] == "'self'"
        assert policy["frame-ancestors"] == "'none'"
        assert headers["x-content-type-options"] == "nosniff"
        assert "server" not in headers


@pytest.mark.parametrize(
    "path",
    [
        "/static/../application.py",
        "/static/..%2fapplication.py",
        "/static/%2e%2e/application.py",
        "/static/....//application.py",
        "/static//etc/passwd",
        "/static/%00",
        "/static/..\\application.py",
        "/static/" + "a" * 5000,
        "/etc/passwd",
        "/static",
        "/static/lib",
    ],
)
def test_no_path_leads_out_of_the_static_files(ask, path):
    answer = ask(path)
    assert answer.status in (400, 404)
    assert b"import" not in answer.body
    assert b"root:" not in answer.body


@pytest.mark.parametrize("material", ["../secret.toml", "/etc/passwd", "bureau2000.toml", "x" * 61])
def test_no_parameter_names_a_file(ask, tmp_path, material):
    answer = ask("explore", {**POINT, "material": material})
    assert answer.status == 400
    assert answer.json["error"].startswith("material must ")


@pytest.mark.parametrize(
    "body",
    [
        b"", b"{", b"[]", b"null", b"1", b'"x"', b"\xff\xfe", b"[" * 60_000, b'{"law": NaN}',
        b'{"law": Infinity}', b'{"law": 1}', b'{"law": {}}', b'{"law": "amontons", "extra": 1}',
        b"{}", b'{"law": "\\u0000"}', b'{"law": "__class__"}',
        b'{"law": "amontons", "numbers": {"V": 1e999}}',
        b'{"law": "amontons", "numbers": {"V": true}}',
        b'{"law": "amontons", "numbers": {"V": null}}',
        b'{"law": "amontons", "numbers": {"V": [1]}}',
        b'{"law": "amontons", "numbers": {"V": -1}}',
        b'{"law": "amontons", "numbers": {"V": "1 kg"}}',
        b'{"law": "amontons", "numbers": {"V": "__import__(\'os\')"}}',
        b'{"law": "amontons", "numbers": {"V": 1e-6, "epsilon": 1.0, "frequency": 1}}',
        b'{"law": "amontons", "numbers": {"V": 1e-6, "epsilon": 0.1, "frequency": "120 rad/s"}}',
        b'{"law": "amontons", "numbers": {"V": 1e-6, "velocity": 1e-6, "epsilon": 0.1}}',
        b'{"law": "amontons", "numbers": {"nonsense": 1}}',
        b'{"law": "no-such-law"}', b'{"law": "file.py:Law"}',
        b'{"law": "amontons", "laws": ["no-such-law"], "numbers": {"V": 1, "epsilon": 0.1}}',
        b'{"law": "amontons", "air": {"P0": 0}, "numbers": {"V": 1, "epsilon": 0.1}}',
        b'{"law": "amontons", "laws": 1}',
        b'{"law": "amontons", "air": {"h0": 1e-308}, "numbers": {"V": 1, "epsilon": 0.1}}',
        b'{"law": "amontons", "air": {"R": 1e308}, "numbers": {"V": 1, "epsilon": 0.1}}',
    ],
)  # fmt: skip
def test_what_is_no_question_gets_a_sentence(ask, body):
    answer = ask("explore", body)
    assert answer.status == 400, answer.body
    message = answer.json["error"]
    assert " must " in message
    # A wrong type says what is right, and has no further advice.
    assert ", got " in message
    assert "Traceback" not in message
    assert len(message) < 600


FIELDS = ("V", "frequency", "K", "W0", "M", "A", "B", "D0", "V0", "lambda", "mu0", "eta")


@pytest.mark.parametrize(
    ("name", "value"),
    [
        *(("K", value) for value in (-1, 1e308, "NaN", "inf", "", "1,5", "1 nonsense")),
        *((name, value) for name in FIELDS if name != "K" for value in (-1, 1e308)),
    ],
)
def test_a_number_that_is_none_or_out_of_reach_gets_a_sentence(ask, name, value):
    """At once, and not after programs were compiled or a search came to nothing."""
    numbers = {"V": 1e-6, "epsilon": 0.1, "frequency": 120.0, name: value}
    answer = ask("explore", {"law": "elasto-plastic", "numbers": numbers})
    assert answer.status == 400
    assert " must " in answer.json["error"]
    edge = {"x": {"name": name, "low": value, "high": value}}
    edge["y"] = {"name": "epsilon", "low": 0.01, "high": 0.4}
    del numbers[name]
    answer = ask("map/text", {"law": "elasto-plastic", "numbers": numbers, **edge})
    assert answer.status == 400


def test_a_body_that_is_too_large_is_refused(ask, raw, server):
    assert ask("explore", b'{"law": "' + b"x" * 70_000 + b'"}').status == 413
    host = f"Host: 127.0.0.1:{server.port}\r\n"
    head = f"POST /api/explore HTTP/1.1\r\n{host}Content-Type: application/json\r\n"
    # Without a length: the bytes are counted while they come.
    chunk = b"10000\r\n" + b"x" * 0x10000 + b"\r\n"
    whole = head.encode() + b"Transfer-Encoding: chunked\r\n\r\n" + 2 * chunk + b"0\r\n\r\n"
    assert "413" in raw(whole)
    for length in ("-1", "1e9", "99999999999999999999"):
        reply = raw(f"{head}Content-Length: {length}\r\n\r\n".encode())
        assert reply.split()[1] in ("400", "413")


@pytest.mark.parametrize("method", ["PUT", "DELETE", "PATCH", "OPTIONS", "TRACE", "GET"])
def test_other_methods_are_refused(ask, method):
    answer = ask("explore", method=method)
    assert answer.status == 405
    assert "access-control-allow-origin" not in answer.headers


def test_the_server_listens_on_this_machine_only(server):
    outside = {info[4][0] for info in socket.getaddrinfo(socket.gethostname(), None)}
    for address in outside - {"127.0.0.1", "::1"}:
        if address.startswith("127."):
            continue
        with pytest.raises(OSError):  # noqa: PT011
            socket.create_connection((address, server.port), timeout=2).close()
