"""Arguments of public functions: their annotations are the check (`typed`).

Physical quantities, numbers in SI or texts with units, are checked where they are converted, by
`asperity.parameters.Parameter.check` and `asperity.parameters.obeying`.
"""

from __future__ import annotations

import collections.abc
import contextlib
import inspect
import os
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from functools import cache, wraps
from pathlib import Path
from types import GenericAlias, NoneType, UnionType
from typing import Annotated, Any, Literal, ParamSpec, TypeVar, Union, get_args, get_origin

import numpy as np
from numpy.typing import ArrayLike

from asperity.errors import InputError, InputTypeError, closest, one_of_types, require
from asperity.parameters.rules import obeying
from asperity.units.kinds import shown as shown, with_article

P = ParamSpec("P")
R = TypeVar("R")


def rising(span: tuple[float, float], label: str, advice: str = "write it like 10:60") -> None:
    """Refuse a stretch of time (s) that does not end after it begins.

    Raises
    ------
    InputError
    """
    first, last = span
    if not first < last:
        got = f"{first:g} s to {last:g} s"
        raise InputError(label, "end after it begins", got, advice)


def broadcast_shape(label: str, *values: Any) -> tuple[int, ...]:
    """Common shape of arrays.

    Raises
    ------
    InputError
        If their shapes do not broadcast.
    """
    shapes = [np.shape(value) for value in values]
    try:
        return np.broadcast_shapes(*shapes)
    except ValueError:
        got = ", ".join(sorted({str(shape) for shape in shapes if shape}))
        advice = "give arrays of one shape, or add axes of length 1"
        raise InputError(label, "have shapes that broadcast", got, advice) from None


def typed(function: Callable[P, R]) -> Callable[P, R]:
    """Check the arguments of a function, or of a class, by their annotations.

    NumPy numbers are passed on as Python numbers, and lists as tuples. The second part of an
    `Annotated` type is a rule for the value: a function of value and name such as `file_path` or
    ``at_least(2)``.

    Raises
    ------
    InputTypeError
        By the decorated function, for an argument of another type.
    InputError
        By the decorated function, for a value that breaks the rule of its annotation.
    """
    if isinstance(function, type):
        function.__init__ = typed(function.__init__)  # type: ignore[misc]
        return function
    kinds = cache(lambda: annotations_of(function))
    parameters = inspect.signature(function).parameters.values()
    positional = [
        p.name for p in parameters if p.kind in (p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD)
    ]
    several = next((p.name for p in parameters if p.kind is p.VAR_POSITIONAL), None)

    @wraps(function)
    def call(*args: P.args, **keywords: P.kwargs) -> R:
        known, count = kinds(), len(positional)
        checked: Any = [
            of_type(value, known[name], name) if name in known else value
            for name, value in zip(positional, args, strict=False)
        ]
        further: Any = args[count:]
        if further and several in known:
            further = of_type(further, known[several], several)
        for name, kind in known.items():
            if name in keywords:
                keywords[name] = of_type(keywords[name], kind, name)
        return function(*checked, *further, **keywords)

    return call


def annotations_of(function: Callable[..., Any]) -> dict[str, Any]:
    """Types of a function's arguments by name, from its annotations."""
    kinds = {}
    for name, one in inspect.signature(function).parameters.items():
        if one.annotation is not one.empty:
            # Postponed annotations are texts.
            kind = eval(one.annotation, inspect.unwrap(function).__globals__)
            several = one.kind is one.VAR_POSITIONAL
            kinds[name] = GenericAlias(Sequence, kind) if several else kind
    return kinds


def of_type(value: Any, kind: Any, name: str) -> Any:
    """A value as an annotation allows it, converted as in `typed`.

    Raises
    ------
    InputTypeError, InputError
        As for `typed`.
    """
    try:
        return _converted(value, kind, name)
    except _OtherTypeError:
        raise InputTypeError(name, f"be {_words(kind)}", shown(value)) from None


class _OtherTypeError(Exception):
    """A value that an annotation does not allow."""


@cache
def _origin_and_parts(kind: Any) -> tuple[Any, tuple[Any, ...]]:
    # NumPy's NDArray and ArrayLike are named aliases on Python 3.12 and later.
    kind = getattr(get_origin(kind) or kind, "__value__", kind)
    return get_origin(kind) or kind, get_args(kind)


def _converted(value: Any, kind: Any, name: str) -> Any:
    origin, parts = _origin_and_parts(kind)
    # The conversion to SI checks an ArrayLike, alone or in a union.
    if kind is Any or kind is ArrayLike or complex in parts:
        return value
    if origin in (Union, UnionType):
        for part in parts:
            try:
                return _converted(value, part, name)
            except _OtherTypeError:
                continue
    elif origin is Annotated:
        return parts[1](_converted(value, parts[0], name), name)
    elif origin is Literal:
        if isinstance(value, type(parts[0])):
            return one_of(value, parts, name)
    elif origin in _NUMBERS:
        if origin is float and _is_one_number(value):
            return value
        plain = value.item() if isinstance(value, np.generic) else value
        if isinstance(plain, _NUMBERS[origin]) and isinstance(plain, bool) == (origin is bool):
            return plain
    elif origin in (tuple, Sequence):
        alike = origin is Sequence or parts[-1] is ...
        listed = isinstance(value, Collection) and not isinstance(value, str | bytes | Mapping)
        several = listed and getattr(value, "shape", None) != ()
        if several and (alike or len(value) == len(parts)):
            kinds = parts[:1] * len(value) if alike else parts
            each = enumerate(zip(value, kinds, strict=True))
            return tuple(of_type(part, kind, f"{name}[{i}]") for i, (part, kind) in each)
    elif origin is Mapping:
        if isinstance(value, Mapping):
            for key, part in value.items() if parts else ():
                of_type(key, parts[0], f"a key of {name}")
                of_type(part, parts[1], f"{name}[{key!r}]")
            return value
    elif origin is type:
        if isinstance(value, type) and issubclass(value, parts or object):
            return value
    elif isinstance(value, NoneType if origin is None else origin):
        return value
    raise _OtherTypeError


def _is_one_number(value: Any) -> bool:
    """Whether a value is an array of one number, which is accepted as that number."""
    shape, kind = getattr(value, "shape", None), getattr(getattr(value, "dtype", None), "kind", "")
    return shape in ((), (1,)) and kind in "iuf"


#: For each type of number, the types of the values that it accepts.
_NUMBERS: Mapping[Any, Any] = {
    bool: bool,
    int: int,
    float: int | float,
    complex: int | float | complex,
}

#: Words for types in a message.
_WORDS: Mapping[Any, str] = {
    bool: "True or False",
    int: "a whole number",
    float: "a number",
    complex: "a number",
    str: "a text",
    NoneType: "None",
    os.PathLike: "a path",
    type: "a class",
    Literal: "a text",
    tuple: "a tuple",
    Sequence: "a list",
    Iterable: "a list",
    Mapping: "a dictionary",
    collections.abc.Callable: "a function",
}


def _words(kind: Any) -> str:
    origin, parts = _origin_and_parts(kind)
    if origin in (Union, UnionType):
        return one_of_types(map(_words, parts))
    if origin is Annotated:
        return _words(parts[0])
    return _WORDS.get(origin) or with_article(origin.__name__)


def at_least(least: int) -> Callable[[int, str], int]:
    """The rule of a count, as in ``Annotated[int, at_least(2)]``."""
    most = 100_000_000  # a gigabyte of numbers

    def within(value: int, name: str) -> int:
        require(value >= least, name, f"be at least {least}", shown(value), "give a larger one")
        require(value <= most, name, f"be at most {most:,}", shown(value), "give a smaller one")
        return value

    return within


def number(value: Any, label: str, kind: str, rule: str = "finite") -> float:
    """One physical number in SI, from a number or a text with its unit.

    Raises
    ------
    InputError
        For an array, another unit, or a value that breaks the rule.
    """
    checked = obeying(value, label, kind, rule)
    if np.size(checked) != 1 or np.ndim(checked) > 1:
        raise InputError(label, "be one number", shown(checked), "give a single value")
    return float(np.ravel(checked)[0])


def one_of(value: Any, known: Iterable[str], label: str) -> str:
    """One of several texts.

    Raises
    ------
    InputError
        For any other text; the message suggests the nearest one.
    """
    known = list(known)
    if not isinstance(value, str) or value not in known:
        near = closest(str(value), known)
        advice = near if near.startswith("did you mean") else "choose one"
        raise InputError(label, f"be one of {', '.join(known)}", shown(value), advice)
    return value


def counted(
    progress: Callable[[int, int], None] | None, total: int, done: int = 0
) -> Callable[[int], None]:
    """A function of the parts finished since its last call, which reports their sum.

    Parameters
    ----------
    progress : callable or None
        Called with the number of parts finished so far and of all parts.
    total, done : int
        Number of all parts, and of those that an earlier run has finished.
    """

    def advance(count: int) -> None:
        nonlocal done
        done += count
        if progress is not None:
            progress(done, total)

    return advance


def increments(advance: Callable[[int], None] | None) -> Callable[[int, int], None] | None:
    """The inverse of `counted`: a `progress` argument that calls a function of increments."""
    if advance is None:
        return None
    last = 0

    def progress(done: int, _total: int) -> None:
        nonlocal last
        advance(done - last)
        last = done

    return progress


def file_path(value: Any, label: str) -> Path:
    """A path that an operating system accepts.

    Raises
    ------
    InputError
        For anything that is no path, and for a text with a NUL or half a surrogate pair in it.
    """
    text = os.fspath(value) if isinstance(value, str | os.PathLike) else None
    # File systems refuse long names with errors that differ between systems.
    if isinstance(text, str) and text and "\0" not in text and len(text) < 4000:
        path = Path(text)
        # Half a surrogate pair names no file.
        with contextlib.suppress(UnicodeEncodeError):
            if all(len(os.fsencode(part)) < 256 for part in path.parts):
                return path
    value = value if text is None else text
    short = isinstance(value, str | bytes) and len(value) < 60
    what = repr(value) if short else shown(value)
    wrong = InputTypeError if text is None else InputError
    raise wrong(label, "be the path of a file", what, "give it as a text")


#: The path of a file, as an annotation.
FilePath = Annotated[str | os.PathLike[str], file_path]
