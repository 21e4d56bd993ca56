"""The page, served from a thread of this process; fixtures that send requests or open it."""

import http.client
import json
import socket
import threading
import time

import pytest

for name in ("starlette", "uvicorn", "latex2mathml"):
    pytest.importorskip(name, reason="the extra app is not installed")


@pytest.fixture(scope="session")
def server():
    """A running server at `server.port`."""
    from asperity.app.server import listen, server_on

    listening = listen(0)
    running = server_on(listening, prepare=False)
    running.port = listening.getsockname()[1]
    thread = threading.Thread(target=running.run, kwargs={"sockets": [listening]})
    thread.start()
    while not running.started:
        time.sleep(0.01)
    yield running
    running.should_exit = True
    thread.join()
    listening.close()


class Answer:
    """An answer of the server."""

    def __init__(self, response):
        self.status = response.status
        self.headers = {name.lower(): value for name, value in response.getheaders()}
        self.body = response.read()

    @property
    def json(self):
        return json.loads(self.body)

    @property
    def lines(self):
        return [json.loads(line) for line in self.body.splitlines()]


@pytest.fixture
def ask(server):
    """Send a request: ``ask("explore", {...})`` is a POST of JSON to ``/api/explore``."""

    def send(path, body=None, *, method=None, headers=None, host=None):
        connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=300)
        sent = {"Host": host or f"127.0.0.1:{server.port}"}
        content = body
        if body is not None and not isinstance(body, bytes):
            content = json.dumps(body).encode()
        if body is not None:
            sent["Content-Type"] = "application/json"
        sent |= headers or {}
        target = path if path.startswith("/") else f"/api/{path}"
        try:
            connection.request(method or ("GET" if body is None else "POST"), target, content, sent)
            return Answer(connection.getresponse())
        finally:
            connection.close()

    return send


@pytest.fixture
def explored(ask):
    """Ask Explore until the programs that it needs are compiled; the JSON of the answer."""

    def send(question):
        while "preparing" in (answer := ask("explore", question).json):
            time.sleep(0.2)
        return answer

    return send


@pytest.fixture
def raw(server):
    """Send bytes, and return the first line of the answer."""

    def send(content):
        with socket.create_connection(("127.0.0.1", server.port), timeout=30) as connection:
            connection.sendall(content)
            with connection.makefile("rb") as answer:
                return answer.readline().decode().strip()

    return send


@pytest.fixture
def barriers():
    """Barriers to access that axe finds on a page, opened with ``bypass_csp`` to let axe run."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright")

    def of(page):
        violations = axe.Axe().run(page).response["violations"]
        return [(v["help"], [node["html"] for node in v["nodes"]]) for v in violations]

    return of


@pytest.fixture(scope="session")
def pages(chromium):
    """Blank pages, which are used again, by whether they bypass the policy on content."""
    return {False: [], True: []}


@pytest.fixture
def visit(chromium, server, pages):
    """Open a view of the page; a request to another host or a failing script is an error."""
    opened, fetched, failed = [], [], []
    origin = f"http://127.0.0.1:{server.port}"
    listeners = {
        "request": lambda request: fetched.append(request.url),
        "pageerror": lambda error: failed.append(str(error)),
        "console": lambda m: failed.append(m.text) if m.type == "error" else None,
    }

    def open_page(fragment="", width=1280, height=900, *, bypass_csp=False, **media):
        blank = pages[bypass_csp]
        page = blank.pop() if blank else chromium.new_page(bypass_csp=bypass_csp)
        page.set_default_timeout(300_000)
        page.set_viewport_size({"width": width, "height": height})
        usual = {"media": "screen", "color_scheme": "light", "reduced_motion": "no-preference"}
        page.emulate_media(**usual | media)
        for event, listener in listeners.items():
            page.on(event, listener)
        opened.append((page, blank))
        page.goto(f"{origin}/{fragment}")
        return page

    yield open_page
    for page, blank in opened:
        page.evaluate("localStorage.clear()")
        page.goto("about:blank")
        for event, listener in listeners.items():
            page.remove_listener(event, listener)
        blank.append(page)
    allowed = (f"{origin}/", "data:image/", f"blob:{origin}/", "about:blank")
    assert [url for url in fetched if not url.startswith(allowed)] == []
    # The page itself shows why a request is refused; Chromium reports it as well.
    assert [text for text in failed if "status of 400" not in text] == []
