"""The error that a user's input can cause.

Every message is a single sentence of the form
``<object>.<field> must <rule>, got <value> <unit>; <what to do>``. The four parts are data: Python,
the command line and the page each write them with their own name of the field (`naming`).
A solve that fails is not an error: it is reported in the result.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import ClassVar, NamedTuple


class Argument(NamedTuple):
    """An argument of the library, which the command line and the page call by other names.

    Its text depends on the interface in use: ``columns['W']`` or ``columns={'W': 'Fn'}`` in Python,
    ``--load`` or ``--load Fn`` on the command line.

    Attributes
    ----------
    name : str
    key : str
        Key of an argument that is a mapping.
    value : str
        Value that the sentence advises to give; empty where it only names the argument.
    """

    name: str
    key: str = ""
    value: str = ""

    @property
    def whole(self) -> str:
        """The name without trailing indices of lists: ``data`` for ``data.0``."""
        name = self.name
        while name.rpartition(".")[2].isdigit():
            name = name.rpartition(".")[0]
        return name

    def __str__(self) -> str:
        return _naming.get().words(self)

    def __format__(self, spec: str) -> str:
        return format(str(self), spec)


#: Arguments of `asperity.measure` that have another name in a `questions.Measurement`.
_IN_PYTHON = {
    "measure.exact_frequency": "measure.refine",
    "measure.whole_periods": "measure.only_whole_periods",
}


def in_python(argument: Argument) -> str:
    """An argument as Python writes it."""
    name, key, value = argument
    name = _IN_PYTHON.get(name, name)
    if not value:
        if key and "." in name:  # a method
            return f"{name}('{key}')"
        return f"{name}['{key}']" if key else name
    if name == "numbers" and key:
        return f"'{key}={value}'"
    shown = value if value.isdigit() or value in ("...", "True", "False") else f"'{value}'"
    return f"{name}={{'{key}': {shown}}}" if key else f"{name}={shown}"


def in_files(argument: Argument) -> str:
    """An argument as a TOML file writes it: ``fixed.D0``, ``fixed.D0 = '0.4 um'``."""
    place = ".".join(filter(None, argument[:2]))
    value = {"True": "true", "False": "false"}.get(argument.value, argument.value)
    plain = value in ("true", "false") or value.replace(".", "", 1).isdigit()
    return f"{place} = {value if plain else repr(value)}" if value else place


class Key(Argument):
    """A key of a file, which every interface calls by the same name."""

    def __str__(self) -> str:
        return in_python(self)


Words = Callable[[Argument], str]
Symbols = Callable[[str], str]


class Naming(NamedTuple):
    """The names that an interface uses for arguments, parameters and files."""

    words: Words = in_python
    symbols: Symbols = str
    files: Mapping[Path, str] = {}


_OF_PYTHON = Naming()
_naming: ContextVar[Naming] = ContextVar("naming", default=_OF_PYTHON)


def name_by(
    words: Words | None = None,
    symbols: Symbols | None = None,
    files: Mapping[Path, str] | None = None,
) -> Naming:
    """Set the naming until the next call, as `naming`; returns the naming before."""
    earlier = _naming.get()
    now = words or earlier.words, symbols or earlier.symbols
    _naming.set(Naming(*now, earlier.files if files is None else files))
    return earlier


@contextmanager
def naming(
    words: Words | None = None,
    symbols: Symbols | None = None,
    files: Mapping[Path, str] | None = None,
) -> Iterator[None]:
    """Set the names that messages use within a block; an argument left out keeps its naming.

    Parameters
    ----------
    words : callable, optional
        Maps an `Argument` to a text.
    symbols : callable, optional
        Maps the name of a parameter to its name in the user's set of names.
    files : mapping of Path to str, optional
        The user's name of a file that is stored under another name.
    """
    earlier = name_by(words, symbols, files)
    try:
        yield
    finally:
        _naming.set(earlier)


@contextmanager
def keys_of_file(keys: Mapping[str, str]) -> Iterator[None]:
    """Name the keys of a file in messages about arguments.

    Parameters
    ----------
    keys : mapping of str to str
        Keys by the names of the arguments; other arguments are keys of the same name.
    """
    with naming(lambda found: in_files(found._replace(name=keys.get(found.name, found.name)))):
        try:
            yield
        except InputError as error:
            raise error.worded() from None


def symbol(name: str) -> str:
    """The name of a parameter in the user's set of names, for a message."""
    return _naming.get().symbols(name)


#: A parameter in a text: its name between control characters, which no file or user can write.
_NAMED = re.compile("\x0e(.*?)\x0f")


def named(name: str) -> str:
    """A parameter in a text that is worded later, by `worded`."""
    return f"\x0e{name}\x0f"


def worded(text: str) -> str:
    """A text in which each parameter has its name in the user's set of names."""
    return _NAMED.sub(lambda parameter: symbol(parameter[1]), text)


def symbols(names: Iterable[str]) -> str:
    """Names of parameters in the user's set of names, with commas between them."""
    return ", ".join(map(symbol, names))


def known_as(path: Path) -> Path:
    """A path as the user knows it, for a message."""
    return Path(_naming.get().files.get(path, path))


class InputError(ValueError):
    """Input that cannot be used; the message names field, rule, value and the way out.

    Parameters
    ----------
    field : str or Argument
        Name of the field, or the whole sentence if no rule follows.
    rule : str
        Text after "must".
    got : str
        The value in words.
    advice : str
        Advice.
    """

    def __init__(
        self, field: str | Argument = "", rule: str = "", got: object = "", advice: str = ""
    ) -> None:
        super().__init__(field, rule, got, advice)
        self.field = field if isinstance(field, Argument) else Argument(field)
        self.rule, self.got, self.advice = rule, str(got), advice

    def __str__(self) -> str:
        if not self.rule:
            return self.field.name
        got = f", got {self.got}" if self.got else ""
        advice = f"; {self.advice}" if self.advice else ""
        return f"{self.field} must {self.rule}{got}{advice}"

    def about(self, field: str | Argument) -> InputError:
        """The same mistake of another field; a whole sentence is unchanged."""
        if not self.rule:
            return self
        return type(self)(field, self.rule, self.got, self.advice)

    def shortened(self) -> InputError:
        """The same mistake with each part as one line that a terminal can show."""
        parts = map(printable, (self.rule, self.got, self.advice))
        return type(self)(self.field._replace(name=printable(self.field.name)), *parts)

    def worded(self) -> InputError:
        """The same mistake with the name of its field fixed as the present interface has it."""
        return self.about(Key(str(self.field)))

    def in_file(self, name: str) -> InputError:
        """The same mistake with the name of the file that has it."""
        return self.noting(f" (in '{name}')")

    def noting(self, addition: str) -> InputError:
        """The same mistake with an addition at its end."""
        if not self.rule:
            return type(self)(f"{self}{addition}")
        parts = [self.got, self.advice + addition] if self.advice else [self.got + addition, ""]
        return type(self)(self.field, self.rule, *parts)


def require(
    holds: object, field: str | Argument, rule: str, got: object = "", advice: str = ""
) -> None:
    """Raise an `InputError` of these parts unless a condition holds.

    Parameters
    ----------
    holds : bool, or an object that is true
    field, rule, got, advice
        As in `InputError`.
    """
    if not holds:
        raise InputError(field, rule, got, advice)


def require_known(name: str, known: Iterable[str], field: str | Argument, rule: str) -> None:
    """Raise an `InputError` about a name that is none of the known ones, with the nearest of them.

    Parameters
    ----------
    name : str
    known : iterable of str
    field, rule : str
        As in `InputError`.
    """
    # Fits call this in every evaluation; the search for the nearest name is slow.
    if name not in known:
        got = printable(str(name), 80)
        raise InputError(field, rule, f"'{got}'", closest(str(name), known))


class InputTypeError(InputError, TypeError):
    """An argument of another type than its annotation says."""


class ConstantLoadError(InputError):
    """A recording that is to have a modulated load has a constant one."""


#: Mistakes that a message lists: a wrong file may hold one a row.
MISTAKES_SHOWN = 20


class MistakesError(InputError):
    """Several mistakes in one file or object, in one message.

    Parameters
    ----------
    mistakes : sequence of str or InputError
        One sentence each.
    source : str
        The file, if there is one.
    """

    #: What the message calls the object with the mistakes.
    subject: ClassVar[str] = "input"

    def __init__(self, mistakes: Sequence[str | InputError], source: str = "") -> None:
        super().__init__(self.subject)
        self.errors = tuple(m if isinstance(m, InputError) else InputError(m) for m in mistakes)
        self.source = source
        # Arguments of the constructor, from which pickle makes a copy in another process.
        self.args = (self.errors, source)

    def shortened(self) -> InputError:
        """As `InputError.shortened`, for every mistake."""
        return type(self)([error.shortened() for error in self.errors], self.source)

    def worded(self) -> InputError:
        """As `InputError.worded`, for every mistake."""
        return type(self)([error.worded() for error in self.errors], self.source)

    def in_file(self, name: str) -> InputError:
        """As `InputError.in_file`, for all mistakes."""
        return type(self)(self.errors, name)

    def noting(self, addition: str) -> InputError:
        """As `InputError.noting`, for the last mistake."""
        return type(self)([*self.errors[:-1], self.errors[-1].noting(addition)], self.source)

    @property
    def mistakes(self) -> tuple[str, ...]:
        """One sentence for each mistake."""
        return tuple(map(str, self.errors))

    def __str__(self) -> str:
        where = f" (in '{self.source}')" if self.source else ""
        if len(self.errors) == 1:
            return f"{self.errors[0]}{where}"
        first = self.errors[:MISTAKES_SHOWN]
        numbered = "; ".join(f"({i}) {m}" for i, m in enumerate(first, start=1))
        more = len(self.errors) - len(first)
        rest = f"; and {more} more" if more else ""
        count = f"{len(self.errors)}{where}"
        return f"{self.subject} must be free of mistakes, got {count}: {numbered}{rest}"


@contextmanager
def code_of_others(
    field: str, rule: str = "be code that runs", advice: str = "correct it", where: str = ""
) -> Iterator[None]:
    """Run code of a user or of another package, which may raise any exception.

    Parameters
    ----------
    field, rule, advice : str
        As in `InputError`.
    where : str
        Place of the code, where `field` does not name it.

    Raises
    ------
    InputError
        In the place of any other exception, with its type and text.
    """
    try:
        yield
    except InputError:
        raise
    except (Exception, SystemExit) as error:  # a script may end with sys.exit()
        text = printable(" ".join(str(error).split()), 200)
        got = f"{type(error).__name__} ({text})" + (f" from {where}" if where else "")
        raise InputError(field, rule, got, advice) from error


def closest(name: str, known: Iterable[str]) -> str:
    """Return ``did you mean 'x'?`` for the nearest known name, or the list of known names.

    Parameters
    ----------
    name : str
        What the user wrote.
    known : iterable of str
        The valid names; of a long list the first ones are shown.
    """
    known = sorted(known)
    lowered = {k.lower(): k for k in known}
    near = difflib.get_close_matches(name.lower(), lowered, n=1, cutoff=0.5)
    if near:
        return f"did you mean '{lowered[near[0]]}'?"
    return "choose one of " + listed(known)


def listed(names: Iterable[str], most: int = 40) -> str:
    """The first `most` names in one text, and the number of further ones."""
    every = list(names)
    further = len(every) - most
    return ", ".join(every[:most]) + (f" and {further} more" if further > 0 else "")


def enumerated(names: Sequence[str], word: str = "and") -> str:
    """Names in a sentence: "a", "a and b", "a, b and c"."""
    return f" {word} ".join(filter(None, (", ".join(names[:-1]), *names[-1:])))


def one_of_types(types: Iterable[str]) -> str:
    """Types in a sentence, each once: "a text, a list or a number".

    "a whole number" is left out next to "a number".
    """
    known = dict.fromkeys(types)
    if "a number" in known:
        known.pop("a whole number", None)
    return enumerated(list(known), "or")


def printable(text: str, most: int = 600) -> str:
    """A text as one line that a terminal can show: control characters escaped, its end cut.

    Parameters
    ----------
    text : str
        Any text, such as the content of a damaged file.
    most : int
        Largest number of characters.
    """
    plain = text
    if not text.isprintable():
        plain = "".join(
            c
            if c.isprintable()
            else " "
            if c.isspace()
            else c.encode("unicode_escape").decode("ascii")
            for c in text[: 2 * most]
        )
    return plain if len(plain) <= most else plain[: most - 3] + "..."
