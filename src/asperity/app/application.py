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
    # Threads for short computations; the page requests one computation at a time.
    threads = ThreadPoolExecutor(min(2, os.cpu_count() or 1), "asperity-answers")
    lanes: dict[str, Jobs] = {}
    uploads = Uploads()
    tasks: dict[str, Callable[[], Any]] = {}
    routes: list[Route | Mount] = []
    limits: dict[str, int] = {}
    warm: dict[str, str | None] = {}
    for module in modules:
        tasks |= getattr(module, "preparations", dict)()
        for endpoint in module.ENDPOINTS:
            path = f"/api/{endpoint.path}"
            if isinstance(endpoint, Upload):
                handler = _upload(endpoint, uploads)
                limits[path] = endpoint.largest
            elif isinstance(endpoint, Job):
                # A process with limits runs a single job, which solves no orbits.
                preload = endpoint.job.partition(":")[0] if endpoint.limits else "asperity.orbit"
                jobs = lanes.setdefault(
                    endpoint.lane, Jobs(preload=preload, laws=laws, folder=uploads.folder)
                )
                warm[endpoint.lane] = warm.get(endpoint.lane) or endpoint.warm
                handler = _job(endpoint, jobs, uploads)
                limits[path] = endpoint.largest or BODY_LIMIT
            else:
                handler = _answer(endpoint, threads)
            routes.append(Route(path, handler, methods=["POST"]))
    preparation = Preparation(tasks)
    use(preparation)

    async def whole_catalogue(request: Request) -> Response:
        return _json(catalogue.as_json())

    async def page(request: Request) -> Response:
        return FileResponse(STATIC / "index.html")

    routes += [
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
            for name, first in warm.items():
                await lanes[name].prepare(first)
        yield
        preparation.close()
        threads.shutdown(wait=False, cancel_futures=True)
        for jobs in lanes.values():
            await jobs.close()
        uploads.close()

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

    return Guard(with_labels, port, in_notebook, limits)


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
