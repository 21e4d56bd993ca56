"""Arguments of public functions that are no physical quantities: counts, switches, names, objects.

One check each, with one sentence for what does not fit. Physical quantities are checked by
`asperity.parameters.Parameter.check` and `asperity.parameters.obeying`.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from asperity.errors import InputError, closest
from asperity.parameters.parameter import obeying

T = TypeVar("T")


def shown(value: Any) -> str:
    """A value of any kind in a few words for a message."""
    if value is None or isinstance(value, bool | int | float | np.generic):
        if isinstance(value, int) and abs(value) > 10**30:
            return "a huge integer"
        return repr(value.item() if isinstance(value, np.generic) else value)
    if isinstance(value, str):
        return f"'{value}'" if len(value) < 60 else f"a text of {len(value)} characters"
    if isinstance(value, type):
        return f"the class {value.__name__}"
    if isinstance(getattr(value, "shape", None), tuple):
        return f"an array of shape {value.shape}"
    if isinstance(value, list | tuple):
        return f"a {type(value).__name__} of {len(value)}"
    if callable(value):
        return f"the function {getattr(value, '__name__', type(value).__name__)}"
    name = type(value).__name__
    return f"{'an' if name[0].lower() in 'aeiou' else 'a'} {name}"


#: The largest count: as many numbers as a gigabyte holds.
_MOST = 100_000_000


def whole_number(value: Any, label: str, least: int = 0) -> int:
    """A count from `least` to a hundred million.

    Raises
    ------
    InputError
        For anything that is no whole number; 2.0 is none either.
    """
    whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
    if whole and least <= value <= _MOST:
        return int(value)
    raise InputError(
        label,
        f"be a whole number of at least {least} and at most {_MOST:,}",
        shown(value),
        f"give one such as {max(least, 8)}",
    )


def switch(value: Any, label: str) -> bool:
    """True or False, of Python or of NumPy; no array.

    Raises
    ------
    InputError
        For anything else.
    """
    if isinstance(value, bool | np.bool_):
        return bool(value)
    raise InputError(
        label,
        "be True or False",
        shown(value),
        "for points of both kinds call the function once for each",
    )


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


def instance(value: Any, kinds: type[T] | tuple[type[T], ...], label: str, advice: str) -> T:
    """An object of a class.

    Raises
    ------
    InputError
        For anything else; an object's class in its place too.
    """
    if isinstance(value, kinds):
        return value
    names = [k.__name__ for k in (kinds if isinstance(kinds, tuple) else (kinds,))]
    wanted = f"{'an' if names[0][0] in 'AEIOU' else 'a'} {' or '.join(names)}"
    raise InputError(label, f"be {wanted}", shown(value), advice)


def one_of(value: Any, known: Iterable[str], label: str) -> str:
    """One of several texts.

    Raises
    ------
    InputError
        For anything else; the message suggests the nearest one.
    """
    known = list(known)
    if isinstance(value, str) and value in known:
        return value
    advice = closest(value, known) if isinstance(value, str) else f"choose {' or '.join(known)}"
    raise InputError(label, f"be one of {', '.join(known)}", shown(value), advice)


def some_of(value: Any, known: Sequence[str], label: str) -> tuple[str, ...]:
    """Several of some texts, at least one.

    Raises
    ------
    InputError
        For anything else, a single text among it.
    """
    if isinstance(value, list | tuple) and value:
        return tuple(one_of(item, known, label) for item in value)
    raise InputError(
        label,
        f"be a tuple of some of {', '.join(known)}",
        shown(value),
        "leave it out for all",
    )


def pair(value: Any, label: str) -> tuple[Any, Any]:
    """Two values.

    Raises
    ------
    InputError
        For anything that is not two values, a text among it.
    """
    if isinstance(value, list | tuple | np.ndarray) and len(value) == 2:
        return value[0], value[1]
    raise InputError(label, "be two values", shown(value), "give (start, end)")


def function(value: Any, label: str) -> Callable[..., Any] | None:
    """A function, or None.

    Raises
    ------
    InputError
        For anything else.
    """
    if value is None or callable(value):
        return value
    raise InputError(label, "be a function", shown(value), "leave it out for none")


def counted(progress: Callable[[int, int], None] | None, total: int) -> Callable[[int], None]:
    """A function that takes the parts finished since its last call and reports their sum.

    Parameters
    ----------
    progress : callable or None
        As public functions take it: called with the work done so far and all work.
    total : int
        All parts.
    """
    done = 0

    def advance(count: int) -> None:
        nonlocal done
        done += count
        if progress is not None:
            progress(done, total)

    return advance


def increments(advance: Callable[[int], None] | None) -> Callable[[int, int], None] | None:
    """The reverse of `counted`: what a public function takes, from a function of increments."""
    if advance is None:
        return None
    last = 0

    def progress(done: int, _total: int) -> None:
        nonlocal last
        advance(done - last)
        last = done

    return progress


def file_path(value: Any, label: str) -> Path:
    """A path that an operating system can be asked for.

    Raises
    ------
    InputError
        For anything that is no path, and for a text with a NUL in it.
    """
    if isinstance(value, str | os.PathLike):
        text = os.fspath(value)
        # File systems have a longest name, and answer a longer one with an error of their own.
        if isinstance(text, str) and text and "\0" not in text and len(text) < 4000:
            path = Path(text)
            if all(len(os.fsencode(part)) < 256 for part in path.parts):
                return path
        value = text
    short = isinstance(value, str | bytes) and len(value) < 60
    what = repr(value) if short else shown(value)
    raise InputError(label, "be the path of a file", what, "give it as a text")
