"""Records of a paper's claims.toml."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.resources import as_file
from importlib.resources.abc import Traversable
from inspect import signature
from typing import Literal, TypeAlias, TypeVar, get_args

from pydantic import Field

from asperity.errors import InputError, closest, require
from asperity.ledger import rules
from asperity.ledger.sentences import names_in
from asperity.questions.record import Question, Record

Kind: TypeAlias = Literal["test", "fit", "arithmetic", "identity"]
KINDS: tuple[Kind, ...] = get_args(Kind)


class RuleWords(Record):
    """A rule as claims.toml writes it: its name, its subject, and its numbers.

    A number may be a word of `asperity.ledger.rules.WORDS` or the name of one of the paper's
    numbers.
    """

    accept: str
    what: str = "the value"
    stated: float | str | None = None
    last_digit: float | None = None
    limit: float | str | None = None
    low: float | str | None = None
    high: float | str | None = None
    tolerance: float | None = None

    def build(self, numbers: Mapping[str, float], claim: str) -> rules.AcceptanceRule:
        """The rule with its numbers.

        Raises
        ------
        InputError
            If the rule is unknown, or one of its numbers is missing or unknown.
        """
        if self.accept not in rules.RULES:
            rule = "be a rule of the ledger"
            advice = closest(self.accept, (*rules.RULES, "formula", "undecided"))
            raise InputError(f"{claim}.rule.accept", rule, f"'{self.accept}'", advice)
        make = rules.RULES[self.accept]
        *names, _ = signature(make).parameters
        values = []
        for name in names:
            value, place = getattr(self, name), f"{claim}.rule.{name}"
            require(value is not None, place, f"be given for '{self.accept}'", "nothing", "add it")
            values.append(rules.number(value, numbers, place))
        return make(*values, self.what)


class Entry(Record):
    """A claim in claims.toml; see `Claim` for the common fields.

    Attributes
    ----------
    rule : RuleWords
    computed : str
        Sentence with the numbers of the check, see `asperity.ledger.sentences`.
    values : mapping of str to str
        Formulas of the paper's printed numbers and of the ``terms`` of its model, by the names of
        their results, in place of a check; see `asperity.ledger.rules.formula_value`.
    judged : tuple of str
        Names of the numbers that the rule judges; ``*`` stands for any text, and every number has
        to pass. By default all numbers. A rule on a formula judges ``printed``, ``independent``
        and, where a corrected formula exists, ``derived``.
    """

    id: str
    place: str
    statement: str
    stated: str
    computed: str
    how: str
    why: str
    kind: Kind
    rule: RuleWords
    values: Mapping[str, str] = Field(default_factory=dict)
    judged: tuple[str, ...] = ()
    depends_on: tuple[str, ...] = ()


class About(Record):
    """The paper itself.

    Attributes
    ----------
    title, authors, journal : str
    short : str
        Authors and year, as in a citation.
    source : str
        Key of the paper in the bibliography of `asperity.materials`; may be empty.
    numbers : str
        A material of the package by name, or a material file of the paper's folder.
    citations : tuple of str
        Keys of further works that the report cites.
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


class Uncertainty(Record):
    """The ends of the published uncertainty of a quantity.

    Attributes
    ----------
    quantity : str
    low, high : mapping of str to float
        The paper's numbers that differ at this end, in the units of the material file.
    note : str
        Source of the ends.
    """

    quantity: str
    low: Mapping[str, float]
    high: Mapping[str, float]
    note: str


class HeadlineWords(Record):
    """A conclusion of the paper, and the claims that decide it.

    Attributes
    ----------
    statement : str
    result : str
        Result; ``{id}`` stands for the computed text of that claim.
    claims : tuple of str
        Ids of the claims whose verdicts decide.
    """

    statement: str
    result: str
    claims: tuple[str, ...]


class SummaryWords(Record):
    """A paragraph at the head of the report.

    Attributes
    ----------
    title : str
    sentences : tuple of str
        ``{id}`` stands for the computed text of that claim.
    verdict : str
        Verdict whose claims are listed below the paragraph, with links; none by default.
    figures : tuple of str
        Names of figures that are shown in a row above the paragraph, with links; none by default.
    """

    title: str
    sentences: tuple[str, ...]
    verdict: str = ""
    figures: tuple[str, ...] = ()


class Contents(Question):
    """All of claims.toml: the paper, its uncertainties, summary, conclusions and claims."""

    subject = "claims.toml"

    paper: About
    summary: tuple[SummaryWords, ...] = ()
    uncertainty: tuple[Uncertainty, ...] = ()
    headline: tuple[HeadlineWords, ...] = ()
    claim: tuple[Entry, ...] = ()


Words = TypeVar("Words", bound=Question)


def read_words(file: Traversable, kind: type[Words]) -> Words:
    """Read a TOML file of a paper's folder as a record.

    Raises
    ------
    InputError
        If the file cannot be read, is not TOML, or has unknown or missing fields.
    """
    with as_file(file) as path:
        return kind.from_file(path)


def read_contents(file: Traversable) -> Contents:
    """Read and check a claims.toml.

    Raises
    ------
    InputError
        If the file is not TOML, has unknown or missing fields or two claims with the same id, or
        refers to a claim or an uncertainty that it does not have.
    """
    contents = read_words(file, Contents)
    _check_names(contents, str(file))
    return contents


def _check_names(contents: Contents, file: str) -> None:
    ids = [entry.id for entry in contents.claim]
    for name in ids:
        got = f"'{name}' twice"
        require(ids.count(name) <= 1, f"{file}: claim.id", "be unique", got, "rename one")
    quantities = {u.quantity for u in contents.uncertainty}
    references = [
        *((f"{e.id}.depends_on", "an uncertainty", e.depends_on, quantities)
          for e in contents.claim),
        *(("summary.sentences", "claims", names_in(sentence), ids)
          for words in contents.summary for sentence in words.sentences),
        *(("headline.claims", "claims", h.claims, ids) for h in contents.headline),
        *(("headline.result", "claims", names_in(h.result), ids) for h in contents.headline),
    ]  # fmt: skip
    for where, what, names, known in references:
        for name in (name for name in names if name not in known):
            rule = f"name {what} of the file"
            raise InputError(f"{file}: {where}", rule, f"'{name}'", closest(name, known))
