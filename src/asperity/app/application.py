"""The application: static files, the catalogue, and the endpoints of every tab."""

from __future__ import annotations

import asyncio
import contextlib
import importlib
import logging
import os
from collections.abc import AsyncIterator, Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request
from starlette.responses import FileResponse, Response, StreamingResponse
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles
from starlette.types import Receive, Scope, Send

from asperity.app.api import TABS, catalogue
from asperity.app.endpoints import Answer, Job, Upload, question_in
from asperity.app.jobs import Jobs
from asperity.app.preparation import Preparation, use
from asperity.app.security import BODY_LIMIT, Guard, body_too_slow, sentence
from asperity.app.uploads import Uploads
from asperity.app.words import in_labels
from asperity.errors import InputError, naming
from asperity.outputs.json import to_json

STATIC = Path(__file__).parent / "static"

_log = logging.getLogger("asperity.app")


def build(
    port: int, *, in_notebook: bool = False, prepare: bool = True, laws: Sequence[str] = ()
) -> Guard:
    """The application behind its guard.

    Parameters
    ----------
    port : int
        Port of the server, which is part of the host name that requests must have.
    in_notebook : bool
        Whether other pages of this machine may show the page in a frame.
    prepare : bool
        Whether to compile the functions of the first tab as soon as the server starts.
    laws : sequence of str
        Locations of laws outside the package, which worker processes import too.
    """
    modules = [importlib.import_module(f"asperity.app.api.{tab}") for tab in TABS]
    tasks: dict[str, Callable[[], Any]] = {}
    for module in modules:
        tasks |= getattr(module, "preparations", dict)()
    endpoints = _Endpoints([e for module in modules for e in module.ENDPOINTS], laws)
    preparation = Preparation(tasks)
    use(preparation)

    async def whole_catalogue(request: Request) -> Response:
        return _json(catalogue.as_json())

    async def page(request: Request) -> Response:
        return FileResponse(STATIC / "index.html")

    routes: list[Route | Mount] = [
        *endpoints.routes,
        Route("/", page),
        Route("/api/catalogue", whole_catalogue),
        Mount("/static", StaticFiles(directory=STATIC)),
    ]
    if catalogue.DOCS.is_dir():
        routes.append(Mount("/docs", StaticFiles(directory=catalogue.DOCS, html=True)))

    @contextlib.asynccontextmanager
    async def lifespan(app: Starlette) -> AsyncIterator[None]:
        if prepare:
            preparation.start([n for m in modules for n in getattr(m, "AT_START", ())])
            await endpoints.prepare()
        yield
        preparation.close()
        await endpoints.close()

    handlers: dict[Any, Any] = {
        InputError: _bad_input,
        HTTPException: _http_error,
        ClientDisconnect: _disconnected,
        Exception: _fault,
    }
    app = Starlette(routes=routes, lifespan=lifespan, exception_handlers=handlers)
    app.router.redirect_slashes = False

    async def with_labels(scope: Scope, receive: Receive, send: Send) -> None:
        with naming(in_labels):
            await app(scope, receive, send)

    return Guard(with_labels, port, in_notebook, endpoints.limits)


class _Endpoints:
    """Endpoints of all tabs, with the threads, processes and files that they share.

    Attributes
    ----------
    routes : list of Route
    limits : dict of str to int
        Largest request (bytes) of each path.
    """

    def __init__(self, endpoints: Sequence[Answer | Job | Upload], laws: Sequence[str]) -> None:
        # Threads for short computations; the page requests one computation at a time.
        self._threads = ThreadPoolExecutor(min(2, os.cpu_count() or 1), "asperity-answers")
        self._uploads, self._laws = Uploads(), laws
        self._lanes: dict[str, Jobs] = {}
        self._warm: dict[str, str | None] = {}
        self.limits: dict[str, int] = {}
        self.routes = [
            Route(f"/api/{e.path}", self._handler(e, f"/api/{e.path}"), methods=["POST"])
            for e in endpoints
        ]

    def _handler(self, endpoint: Answer | Job | Upload, path: str) -> Callable[[Request], Any]:
        if isinstance(endpoint, Upload):
            self.limits[path] = endpoint.largest
            return _upload(endpoint, self._uploads)
        if isinstance(endpoint, Answer):
            return _answer(endpoint, self._threads)
        self.limits[path] = endpoint.largest or BODY_LIMIT
        # A process with limits runs a single job, which solves no orbits.
        preload = endpoint.job.partition(":")[0] if endpoint.limits else "asperity.orbit"
        name, folder = endpoint.lane, self._uploads.folder
        jobs = self._lanes.setdefault(name, Jobs(preload=preload, laws=self._laws, folder=folder))
        self._warm[name] = self._warm.get(name) or endpoint.warm
        return _job(endpoint, jobs, self._uploads)

    async def prepare(self) -> None:
        """Start the processes, with the first job that each runs."""
        for name, first in self._warm.items():
            await self._lanes[name].prepare(first)

    async def close(self) -> None:
        """End threads and processes, and remove uploaded files."""
        self._threads.shutdown(wait=False, cancel_futures=True)
        for jobs in self._lanes.values():
            await jobs.close()
        self._uploads.close()


def _answer(endpoint: Answer, threads: ThreadPoolExecutor) -> Callable[[Request], Any]:
    async def handle(request: Request) -> Response:
        question = await question_in(request, endpoint.question)
        run = asyncio.get_running_loop().run_in_executor
        here = copy_context()
        return _json(await run(threads, here.run, lambda: to_json(endpoint.answer(question))))

    return handle


def _upload(endpoint: Upload, uploads: Uploads) -> Callable[[Request], Any]:
    async def handle(request: Request) -> Response:
        # A form of another site cannot send this type without a preflight request.
        if request.headers.get("content-type", "") != "application/octet-stream":
            advice = "send application/octet-stream"
            raise InputError("request.body", "be a file", "another type", advice)
        upload = uploads.begin(unquote(request.headers.get("x-file-name", "recording")))
        whole, size = False, 0
        try:
            async with asyncio.timeout(endpoint.seconds):
                with upload.path.open("wb") as file:
                    async for piece in request.stream():
                        size += len(piece)
                        file.write(piece)
            whole = True
        except TimeoutError:
            raise body_too_slow() from None
        finally:
            if not whole:
                uploads.remove(upload.key)
        return _json(to_json({"id": upload.key, "name": upload.name, "size": size}))

    return handle


def _job(endpoint: Job, jobs: Jobs, uploads: Uploads) -> Callable[[Request], Any]:
    async def handle(request: Request) -> Response:
        question = await question_in(request, endpoint.question)
        if endpoint.check is not None:
            endpoint.check(question)
        argument = question.model_dump()
        if endpoint.argument is not None:
            argument = endpoint.argument(question, uploads)
        messages = jobs.run(
            endpoint.job, argument, limits=endpoint.limits, seconds=endpoint.seconds
        )

        async def lines() -> AsyncIterator[str]:
            async with contextlib.aclosing(messages):
                async for message in messages:
                    yield to_json(message) + "\n"

        return StreamingResponse(lines(), media_type="application/x-ndjson")

    return handle


def _json(text: str) -> Response:
    return Response(text, media_type="application/json")


async def _bad_input(request: Request, error: InputError) -> Response:
    return sentence(HTTPException(400, str(error)))


async def _http_error(request: Request, error: HTTPException) -> Response:
    texts = {404: "there is no such page", 405: "this address takes another method"}
    error.detail = texts.get(error.status_code, error.detail)
    return sentence(error)


async def _disconnected(request: Request, error: ClientDisconnect) -> Response:
    return Response(status_code=499)


async def _fault(request: Request, error: Exception) -> Response:
    _log.error("%s failed", request.url.path, exc_info=error)
    text = "the server failed by a defect of the program; its console says more"
    return sentence(HTTPException(500, text))
