"""A server for a benchmark, a browser that shows its page, and the load of the machine."""

from __future__ import annotations

import contextlib
import http.client
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from typing import Any, NamedTuple
from urllib.parse import urlsplit

#: The browser draws into memory, and the processor rasterises the picture.
_OPTIONS = ["--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"]


class Serving(NamedTuple):
    """A running server.

    Attributes
    ----------
    port, process : int
    """

    port: int
    process: int


@contextlib.contextmanager
def serving() -> Iterator[Serving]:
    """``asperity serve`` on a free port."""
    command = [sys.executable, "-m", "asperity", "serve", "--port", "0"]
    server = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    try:
        assert server.stderr is not None
        words = server.stderr.readline().split()
        port = urlsplit(next(word for word in words if word.startswith("http"))).port
        assert port is not None
        yield Serving(port, server.pid)
    finally:
        server.terminate()
        server.wait()


def ask(port: int, path: str, question: dict[str, Any]) -> bytes:
    """The answer to a question."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=600)
    headers = {"Content-Type": "application/json"}
    connection.request("POST", f"/api/{path}", json.dumps(question), headers)
    answer = connection.getresponse().read()
    connection.close()
    return answer


@contextlib.contextmanager
def chromium() -> Iterator[Any]:
    """The system's Chromium without a window."""
    from playwright.sync_api import sync_playwright

    program = next(filter(None, map(shutil.which, ("chromium", "chromium-browser"))), None)
    if program is None:
        raise SystemExit("no Chromium here: install the system's package")
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=program, args=_OPTIONS)
        try:
            yield browser
        finally:
            browser.close()


def load() -> str:
    """Load of the machine over the last minute, and its cores."""
    return f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"


def quantile(values: list[float], share: float) -> float:
    """The value below which a share of the values lies."""
    return sorted(values)[min(len(values) - 1, int(share * len(values)))]
