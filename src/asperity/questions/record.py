"""The parts of all questions: a frozen record, its types, and sentences about its mistakes.

Keywords of Python, options of the command line, TOML files and the JSON of the page fill the same
record. A quantity is a number in SI or a text with its unit; in a file it must carry its unit.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from itertools import pairwise
from typing import Annotated, Any, ClassVar, Literal, Self, TypeVar, get_args, get_origin

import numpy as np
from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    ValidationError,
    ValidationInfo,
    WithJsonSchema,
    WrapValidator,
)

from asperity.errors import InputError, Key, MistakesError, closest, one_of_types, require
from asperity.parameters.arguments import number, one_of, rising, shown as shown_value, typed
from asperity.parameters.toml_file import toml_content
from asperity.units import KINDS

T = TypeVar("T")

#: A number in SI, a text with its unit, or a switch.
Given = bool | float | str
#: Largest number of characters of each part of a field's path in messages.
_LONGEST = 60
#: Names of types that pydantic adds to the path of a field with several types. It also adds names
#: of records, and texts with brackets.
_TYPES = frozenset({"bool", "float", "int", "str", "constrained-str", "nullable"})

#: Words for the rule that a value breaks, by the beginning of pydantic's error type.
_WORDS = {
    "bool_": "true or false",
    "int_": "a whole number",
    "float_": "a number",
    "string_type": "a text",
    "tuple_": "a list",
    "list_": "a list",
    "dict_": "a table",
    "mapping_": "a table",
    "model_": "a table",
}

#: Words for a limit, and for numbers within it.
_LIMITS = {
    "greater_than_equal": ("at least", "larger"),
    "greater_than": ("above", "larger"),
    "less_than_equal": ("at most", "smaller"),
    "less_than": ("below", "smaller"),
}

_units_required: ContextVar[bool] = ContextVar("units_required", default=False)


class Record(BaseModel):
    """A part of a question: frozen; unknown fields are refused.

    All mistakes of a record are in one `MistakesError`.

    Attributes
    ----------
    subject : str
        Name of the record in messages without a field; the name of its class by default.
    prefix : str, optional
        Text before the name of a field in messages; by default the name of the class and a point.
    mistakes_error : type of MistakesError
    """

    model_config = ConfigDict(
        frozen=True, extra="forbid", populate_by_name=True, arbitrary_types_allowed=True
    )
    subject: ClassVar[str] = ""
    prefix: ClassVar[str | None] = None
    mistakes_error: ClassVar[type[MistakesError]] = MistakesError

    def __init__(self, /, **fields: Any) -> None:
        try:
            super().__init__(**fields)
        except ValidationError as error:
            raise self.mistakes_error(mistakes_in(error, type(self))) from None

    # With this mark pydantic validates nested records itself, with the path of each mistake.
    __init__.__pydantic_base_init__ = True  # type: ignore[attr-defined]

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """A record with some fields replaced; the new record is validated."""
        fields = {name: getattr(self, name) for name in type(self).model_fields}
        return type(self)(**{**fields, **(update or {})})


class Question(Record):
    """A question, which can be read from a file."""

    subject: ClassVar[str] = "question"
    prefix: ClassVar[str | None] = ""

    def __init__(self, /, **fields: Any) -> None:
        super().__init__(**fields)

    @classmethod
    def from_file(cls, path: str | os.PathLike[str], **fields: Any) -> Self:
        """Read a question from a TOML file, in which every quantity carries its unit.

        Paths in the file are relative to its folder.

        Parameters
        ----------
        path : str or path
        **fields
            Values of fields that the file does not have.

        Raises
        ------
        InputError
            If the file cannot be read or is not TOML.
        MistakesError
            An `InputError` with all mistakes.
        """
        file, content = toml_content(path, cls.subject)
        if "folder" in cls.model_fields:
            fields = {"folder": file.parent, **fields}
        return cls.of_content({**fields, **content}, str(path))

    @classmethod
    @typed
    def of_content(cls, content: Mapping[str, Any], source: str = "") -> Self:
        """The question with the content of a file, in which every quantity carries its unit."""
        with units_required():
            try:
                return cls(**content)
            except MistakesError as error:
                mistakes = [
                    mistake.about(Key(*mistake.field)).shortened() for mistake in error.errors
                ]
                raise cls.mistakes_error(mistakes, source) from None


@contextmanager
def units_required() -> Iterator[None]:
    """Refuse quantities without a unit within the block, as in files."""
    token = _units_required.set(True)
    try:
        yield
    finally:
        _units_required.reset(token)


def require_unit(value: Any, kind: str, field: str = "") -> Any:
    """The quantity unchanged.

    Raises
    ------
    InputError
        If it is a number without a unit, and units are required.
    """
    for mistake in without_unit([(field, kind, value)]):
        raise mistake
    return value


def without_unit(numbers: Iterable[tuple[str, str, Any]]) -> list[InputError]:
    """Mistakes about numbers without a unit, if units are required; else none.

    Parameters
    ----------
    numbers : iterable of (str, str, object)
        Path of the field, kind of quantity and value of each.
    """
    mistakes: dict[str, InputError] = {}
    for place, kind, value in numbers if _units_required.get() else ():
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if number and abs(value) < np.inf and KINDS[kind].si:
            advice = f"write it like '{KINDS[kind].example}'"
            mistake = InputError(place, "carry a unit", shown(value), advice)
            mistakes.setdefault(str(mistake), mistake)
    return list(mistakes.values())


def quantity(kind: str, rule: str = "finite") -> Any:
    """The type of a quantity: a float in SI, from a number in SI or a text with its unit.

    Parameters
    ----------
    kind : str
        A key of `asperity.units.KINDS`.
    rule : str
        A key of `asperity.parameters.RULES`.
    """
    spec = KINDS[kind]

    def in_si(value: Any, info: ValidationInfo) -> float:
        return number(require_unit(value, kind), "", kind, rule)

    schema = {
        "type": ["number", "string"],
        "description": f"{spec.noun}: a number in SI ({spec.si or '1'}), or a text with its unit",
        "examples": [spec.example],
    }
    return Annotated[float, BeforeValidator(in_si), WithJsonSchema(schema)]


def _plain_integer(value: Any) -> Any:
    return int(value) if isinstance(value, np.integer) else value


#: Mark of a whole number, ``Annotated[StrictInt, Field(ge=1), WHOLE]``, that takes those of NumPy.
#: It stands behind the limits, which the JSON schema does not have otherwise.
WHOLE = BeforeValidator(_plain_integer)


def parts_of(value: Any) -> Any:
    """The parts of a text with commas or semicolons; any other value unchanged."""
    if isinstance(value, str):
        return tuple(part.strip() for part in re.split("[,;]", value) if part.strip())
    return value


#: Names; a text has commas between them.
Names = Annotated[tuple[str, ...], BeforeValidator(parts_of)]


def _seconds(value: Any) -> float:
    """A time; a text without a unit is in seconds."""
    if isinstance(value, str) and not value.strip()[-1:].isalpha():
        value = f"{value} s"
    return number(value, "", "time")


def _units_clear(times: Iterable[Any], like: str) -> None:
    """Refuse texts of times like "1:2 min", whose unit may be meant for the first one too."""
    texts = [time.strip() for time in times if isinstance(time, str) and time.strip("+-.0 ")]
    for time, following in pairwise(texts):
        unit = following.lstrip("+-.0123456789 ")
        holds = time[-1].isalpha() or not unit.isalpha() or unit == "s"
        got = f"'{time}' before '{following}'"
        require(holds, "", "carry a unit at each time", got, f"write it like {like}")


def _times(value: Any, converted: Callable[[Any], Any]) -> Any:
    times = parts_of(value)
    seconds = converted(times)
    _units_clear(times, "1 min, 2 min")
    return seconds


def _span(value: Any) -> tuple[float, float]:
    """Both ends of a span; an end that a text leaves open is infinite."""
    if isinstance(value, str):
        start, colon, end = (part.strip() for part in value.partition(":"))
        require(colon, "", "be START:END", f"'{value}'", "write it like 10:60")
        value = (start or -np.inf, end or np.inf)
    if not isinstance(value, list | tuple | np.ndarray) or len(value) != 2:
        raise InputError("", "be two times", shown(value), "give (start, end)")
    first, last = (end if end in (-np.inf, np.inf) else _seconds(end) for end in value)
    _units_clear(value, "1 min:2 min")
    rising((first, last), "")
    return first, last


Seconds = Annotated[float, BeforeValidator(_seconds)]
#: Times (s); a text has commas between them.
Times = Annotated[tuple[Seconds, ...], WrapValidator(_times)]
#: Start and end of a stretch of time (s), or a text such as ``"10:60"``.
Span = Annotated[tuple[float, float], BeforeValidator(_span)]


def shown(value: Any) -> str:
    """A value of a record in a few words for a message."""
    if isinstance(value, Mapping):
        return f"a table of {len(value)} field{'s' * (len(value) != 1)}"
    return shown_value(value)


def mistakes_in(error: ValidationError, model: type[Record]) -> list[InputError]:
    """The mistakes that pydantic reports in a record, each once."""
    # pydantic reports a value that fits none of several types once for each type.
    alike: dict[tuple[str, ...], list[InputError]] = {}
    for reported in error.errors(include_url=False):
        for mistake in _mistakes(reported, model):
            alike.setdefault((*mistake.field, mistake.got, mistake.advice), []).append(mistake)
    return [_any_of(several) for several in alike.values()]


def _any_of(alike: Sequence[InputError]) -> InputError:
    """One mistake for several mistakes that differ only in their rules."""
    first = alike[0]
    be = "be " if first.rule.startswith("be ") else ""
    rule = be + one_of_types(mistake.rule.removeprefix("be ") for mistake in alike)
    return first if len(alike) == 1 else InputError(first.field, rule, first.got, first.advice)


def _mistakes(reported: Mapping[str, Any], model: type[Record]) -> tuple[InputError, ...]:
    raised = reported.get("ctx", {}).get("error")
    if isinstance(raised, MistakesError):
        return raised.errors
    records = {kind.__name__ for kind in _models_in(model)}
    place = [
        str(part)[:_LONGEST]
        for i, part in enumerate(reported["loc"])
        if not (i and isinstance(part, str) and ("[" in part or part in _TYPES | records))
    ]
    prefix = f"{model.__name__}." if model.prefix is None else model.prefix
    field = prefix + ".".join(place) if place else model.subject or model.__name__
    if isinstance(raised, InputError):
        # The validator of a type does not know the field.
        return (raised if raised.field.name else raised.about(field),)
    if reported["type"] == "missing":
        *around, name = reported["loc"]
        kind: Any = _types_at(model, tuple(around)).get(name)
        inside = _types_at(kind, ()) if _is_model(kind) else ()
        advice = f"add it, a table of {', '.join(inside)}" if inside else "add it"
        return (InputError(field, "be given", "nothing", advice),)
    value = shown(reported["input"])
    if reported["type"] == "extra_forbidden":
        known = list(_types_at(model, reported["loc"][:-1]))
        # If the value is a choice of a single field, as in scale = "log", that field is meant.
        word = reported["input"] if isinstance(reported["input"], str) else None
        meant = [n for n in known if word in _choices(model, reported["loc"], n)]
        near = f"did you mean '{meant[0]}'?" if len(meant) == 1 else closest(place[-1], known)
        advice = near if known else "leave it out"
        return (InputError(field, "be a known field", value, advice),)
    if reported["type"] == "literal_error":
        try:
            one_of(reported["input"], re.findall("'([^']*)'", reported["ctx"]["expected"]), field)
        except InputError as mistake:
            return (mistake,)
    if reported["type"].endswith(("too_short", "too_long")):
        edge, what = reported["ctx"], "character" if "string" in reported["type"] else "part"
        rule = f"have {'at least' if 'min_length' in edge else 'at most'} "
        limit = edge.get("min_length", edge.get("max_length"))
        rule += f"{limit} {what}{'s' * (limit != 1)}"
        return (InputError(field, rule, edge.get("actual_length", value), "correct it"),)
    if reported["type"] in _LIMITS:
        (limit,) = reported["ctx"].values()
        words, other = _LIMITS[reported["type"]]
        return (InputError(field, f"be {words} {limit:,}", value, f"give a {other} one"),)
    text = " ".join(reported["msg"].split()).removeprefix("Input should be ")
    rule = next(
        (words for kind, words in _WORDS.items() if reported["type"].startswith(kind)), text
    )
    return (InputError(field, f"be {rule}", value),)


def _choices(model: type[BaseModel], place: tuple[Any, ...], name: str) -> list[Any]:
    """Words that the field `name` accepts, next to the unknown field at `place`."""
    kind = _types_at(model, place[:-1])[name]
    kinds = [kind, *get_args(kind)]
    return [word for one in kinds if get_origin(one) is Literal for word in get_args(one)]


def _types_at(model: type[BaseModel], place: tuple[Any, ...]) -> dict[str, Any]:
    """Types of the fields of the table at a path, by their names in a file."""
    at: Any = model
    for part in place:
        fields = at.model_fields if _is_model(at) else {}
        kind = next((f.annotation for n, f in fields.items() if part in (n, f.alias)), at)
        at = next(iter(_models_in(kind)), None)
        if at is None:
            return {}
    return {f.alias or name: f.annotation for name, f in at.model_fields.items()}


def _is_model(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, BaseModel)


def _models_in(kind: Any, known: tuple[Any, ...] = ()) -> Iterator[type[BaseModel]]:
    """Models within a type such as ``Mapping[str, Model] | None``, the outermost first."""
    if kind in known:
        return
    if _is_model(kind):
        yield kind
        for field in kind.model_fields.values():
            yield from _models_in(field.annotation, (*known, kind))
    for part in getattr(kind, "__args__", ()):
        yield from _models_in(part, known)
