"""What a paper's claims.toml holds."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.resources.abc import Traversable
from string import Formatter

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from asperity.errors import InputError
from asperity.papers.ledger.claim import Entry
from asperity.parameters.toml_file import parsed_toml


class _Table(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class About(_Table):
    """The paper itself.

    Attributes
    ----------
    title, authors, journal : str
    short : str
        Authors and year, as one would cite it.
    source : str
        Key of the paper in the bibliography of `asperity.materials`; may be empty.
    numbers : str
        A material of the package by name, or a material file of the paper's folder.
    citations : tuple of str
        Keys of what else the report cites.
    method : str
        How the numbers were computed, for the end of the report.
    parameters : mapping of str to (str, str)
        Symbol and meaning of each number that the report lists.
    """

    title: str
    authors: str
    journal: str
    short: str
    source: str = ""
    numbers: str
    citations: tuple[str, ...] = ()
    method: str = ""
    parameters: Mapping[str, tuple[str, str]] = Field(default_factory=dict)


class Uncertainty(_Table):
    """The ends of the published uncertainty of a quantity.

    Attributes
    ----------
    quantity : str
    low, high : mapping of str to float
        The paper's numbers that differ there, in the units of the material file.
    note : str
        Where the ends come from.
    """

    quantity: str
    low: Mapping[str, float]
    high: Mapping[str, float]
    note: str


class HeadlineWords(_Table):
    """A conclusion of the paper, and the claims that decide it.

    Attributes
    ----------
    statement : str
    found : str
        What was found; ``{id}`` stands for what was computed for that claim.
    claims : tuple of str
        Ids of the claims whose verdicts decide.
    """

    statement: str
    found: str
    claims: tuple[str, ...]


class SummaryWords(_Table):
    """A paragraph at the head of the report.

    Attributes
    ----------
    title : str
    sentences : tuple of str
        ``{id}`` stands for what was computed for that claim.
    verdict : str
        All claims of this verdict are listed below, with links; none by default.
    """

    title: str
    sentences: tuple[str, ...]
    verdict: str = ""

    def claims_of(self, sentence: str) -> tuple[str, ...]:
        """Ids of the claims that a sentence quotes."""
        return tuple(name for _, name, _, _ in Formatter().parse(sentence) if name)


class Contents(_Table):
    """All of claims.toml: the paper, its uncertainties, summary, conclusions and claims."""

    paper: About
    summary: tuple[SummaryWords, ...] = ()
    uncertainty: tuple[Uncertainty, ...] = ()
    headline: tuple[HeadlineWords, ...] = ()
    claim: tuple[Entry, ...] = ()


def read_contents(file: Traversable) -> Contents:
    """Read and check a claims.toml.

    Raises
    ------
    InputError
        If the file is not TOML, has unknown or missing fields, two claims of one id, or refers to
        a claim or an uncertainty that it does not have.
    """
    try:
        text = file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(
            f"{file} must be a readable text, got {type(error).__name__}; write the claims there"
        ) from None
    try:
        content = parsed_toml(text, "claims")
    except InputError as error:
        raise InputError(f"{file} must be TOML, got: {error}") from None
    try:
        contents = Contents.model_validate(content)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise InputError(
            f"{file}: {where} must be valid, got: {first['msg'].lower()}; see the page on papers"
        ) from None
    _check_names(contents, str(file))
    return contents


def _check_names(contents: Contents, file: str) -> None:
    ids = [entry.id for entry in contents.claim]
    for name in ids:
        if ids.count(name) > 1:
            raise InputError(f"{file}: claim.id must be unique, got '{name}' twice; rename one")
    quantities = {u.quantity for u in contents.uncertainty}
    for entry in contents.claim:
        for quantity in set(entry.depends_on) - quantities:
            raise InputError(
                f"{file}: {entry.id}.depends_on must name an uncertainty of the file, got "
                f"'{quantity}'; add [[uncertainty]] with that quantity"
            )
    for words in contents.summary:
        for name in {n for own in words.sentences for n in words.claims_of(own)} - set(ids):
            raise InputError(
                f"{file}: summary.sentences must quote claims of the file, got '{{{name}}}'; "
                "correct it"
            )
    for headline in contents.headline:
        quoted = {name for _, name, _, _ in Formatter().parse(headline.found) if name is not None}
        for field, names in (("claims", set(headline.claims)), ("found", quoted)):
            for name in sorted(names - set(ids)):
                raise InputError(
                    f"{file}: headline.{field} must name claims of the file, got '{name}'; "
                    "correct it"
                )
