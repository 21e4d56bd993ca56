"""Endpoints: a path, what a request must contain, and the function that answers it.

A tab's module in `asperity.app.api` lists its endpoints as ``ENDPOINTS``; `asperity.app.api.TABS`
lists the modules.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from starlette.requests import Request

from asperity.app.uploads import Uploads
from asperity.errors import InputError, MistakesError, require
from asperity.outputs.json import parsed_json
from asperity.questions import record as questions


class Question(questions.Question):
    """The fields of a request; other fields are refused."""

    subject = "request"


@dataclass(frozen=True)
class Answer:
    """A computation that takes milliseconds; its answer is JSON.

    Attributes
    ----------
    path : str
        Below ``/api/``.
    question : type of Question
    answer : callable
        From the question to anything that `asperity.outputs.json` knows; called in a thread.
    """

    path: str
    question: type[Question]
    answer: Callable[[Any], Any]


@dataclass(frozen=True)
class Job:
    """A computation of any duration in a worker process; each message is a line of JSON.

    The job ends when the page closes the connection.

    Attributes
    ----------
    path : str
        Below ``/api/``.
    question : type of Question
    job : str
        ``module:function``, called with the question's fields and a function that reports; see
        `asperity.app.worker`.
    lane : str
        Jobs of one lane share a worker process; a long job delays only the jobs of its lane.
    check : callable, optional
        Raises `InputError` for what cannot be computed, before a process is started.
    limits : mapping of str to int, optional
        See `asperity.app.jobs.Jobs.run`.
    seconds : float
        Time after which the job is ended.
    argument : callable, optional
        From the question and the uploaded files to the argument of the job; by default the
        argument is the question's fields.
    largest : int, optional
        Largest body (bytes), if it may be larger than that of other requests.
    warm : str, optional
        ``module:function`` that a worker runs when the server starts, to compile the programs that
        the first question needs.
    """

    path: str
    question: type[Question]
    job: str
    lane: str
    check: Callable[[Any], None] | None = None
    limits: Mapping[str, int] | None = None
    seconds: float = 600.0
    argument: Callable[[Any, Uploads], Any] | None = None
    largest: int | None = None
    warm: str | None = None


@dataclass(frozen=True)
class Upload:
    """A file that is stored for later requests; the body is the file itself.

    The header ``X-File-Name`` is the user's name of the file, percent-encoded. The answer is
    ``{"id", "name", "size"}``.

    Attributes
    ----------
    path : str
        Below ``/api/``.
    largest : int
        Largest size of the file (bytes).
    seconds : float
        Time after which the upload is refused.
    """

    path: str
    largest: int
    seconds: float = 900.0


async def question_in(request: Request, kind: type[Question]) -> Any:
    """The question in the body of a request.

    Raises
    ------
    InputError
        If the body is no JSON, or is no question of this kind.
    """
    if request.headers.get("content-type", "").split(";")[0].strip() != "application/json":
        raise InputError("request.body", "be JSON", "another type", "send application/json")
    body = await request.body()
    try:
        value = parsed_json(body, "request.body", parse_constant=_no_constant)
        _require_short(value)
        # Half a surrogate pair is valid JSON, but it cannot be encoded again.
        json.dumps(value, ensure_ascii=False).encode()
    except UnicodeEncodeError:
        rule, got = "hold texts of whole characters", "half a surrogate pair"
        raise InputError("request.body", rule, got, "leave it out") from None
    except InputError:
        raise
    except (ValueError, RecursionError):
        raise InputError("request.body", "be JSON", "something else", "send JSON") from None
    holds = isinstance(value, dict)
    require(holds, "request.body", "be a JSON object", "another value", "send an object")
    try:
        return kind(**value)
    except MistakesError as error:
        raise error.errors[0] from None
    except RecursionError:
        raise InputError("request.body", "not be nested so deep", "more", "send less") from None


#: Most characters of a text, except in fields ``text``, and most parts of a list or table.
_LONGEST_TEXT, _MOST_PARTS = 300, 1000


def _require_short(value: Any, field: str = "request") -> None:
    """Refuse texts, lists and tables that are longer than those of the page."""
    if isinstance(value, str) and field != "text":
        rule = f"have at most {_LONGEST_TEXT} characters"
        require(len(value) <= _LONGEST_TEXT, field, rule, len(value), "send fewer")
    if isinstance(value, list | dict):
        rule = f"have at most {_MOST_PARTS} parts"
        require(len(value) <= _MOST_PARTS, field, rule, len(value), "send fewer")
        named = value.items() if isinstance(value, dict) else ((field, part) for part in value)
        for name, part in named:
            _require_short(name, "a name")
            _require_short(part, name)


def _no_constant(name: str) -> float:
    raise ValueError(name)
