"""Names that tables, figures and sentences are written in: those of the paper, or of geophysics.

Keys of JSON, columns of files and coordinates keep the one name of each parameter.
"""

from __future__ import annotations

import re
from functools import cache
from typing import Any

from asperity.parameters.parameter import Names, Parameter
from asperity.parameters.table import EXPERIMENT, INTERFACE, law_parameters, plain_name

#: Decorations of a formula that a plain name goes without.
_DECORATIONS = re.compile(r"\\bar|[\\{}]")
#: Words of a sentence. What an option takes keeps its name, unless it is a parameter's, and "A"
#: before a noun is the article.
_WORDS = re.compile(
    r"(?P<kept>--(?!fix|set|start|prior)[\w-]+ \S+"
    r"|(?:^|(?<=[.:;] ))A(?= [a-z]{2})(?! (?:is|and|at|has|of|lies)\b))"
    r"|(?<!\w)[A-Za-z]\w*"
)


def symbol_of(parameter: Parameter, names: Names = "friction") -> str:
    """LaTeX symbol of a parameter in a set of names.

    Parameters
    ----------
    parameter : Parameter
        In geophysics the first of its usual names there; its symbol where it has none.
    names : {"friction", "geophysics"}
    """
    usual = re.match(r"\$([^$=]+)", parameter.geophysics)
    if names == "friction" or usual is None or usual[1].startswith("1/"):
        return parameter.symbol
    return usual[1].strip()


def display_name(name: str, names: Names = "friction", law: Any = None) -> str:
    """A name, or a quotient or difference of names, as plain text in a set of names.

    Parameters
    ----------
    name : str
        As ``D0``, ``K/W0`` or ``A - B``; words that are no parameter stay as they are.
    names : {"friction", "geophysics"}
    law : type of Law, optional
        Whose parameters have names too, in addition to those that several laws share.
    """
    if names == "friction":
        return name
    known = plain_names(law)
    return re.sub(r"[A-Za-z]\w*", lambda word: known.get(plain_name(word[0]), word[0]), name)


def in_names(text: str, names: Names = "friction", law: Any = None) -> str:
    """A sentence with the names of parameters in it written in a set of names."""
    if names == "friction":
        return text
    known = plain_names(law)

    def renamed(word: re.Match[str]) -> str:
        return word[0] if word["kept"] else known.get(word[0], word[0])

    return _WORDS.sub(renamed, text)


def parameter_named(name: str, law: Any = None) -> str:
    """The name of the parameter that geophysics calls so: D0 for ``D_c`` or ``Dc``."""
    known = {_folded(usual): parameter for parameter, usual in plain_names(law).items()}
    return known.get(_folded(name), name)


def _folded(name: str) -> str:
    return name.replace("_", "").casefold()


#: Symbols of figures in geophysics, in addition to those of `INTERFACE`.
_SYMBOLS = {"F": r"\tau", "W": r"\sigma_n", "W_0": r"\bar\sigma_n", "K": "k", r"\Phi": r"\theta"}


def in_symbols(text: str) -> str:
    """A label of a figure with the symbols of its formulas as geophysics writes them."""
    known = {p.symbol: symbol_of(p, "geophysics") for p in INTERFACE.values()} | _SYMBOLS
    word = re.compile(r"(?<![\\\w{])(?:[A-Z](?:_0)?|\\Phi)(?![\w}])")

    def formula(match: re.Match[str]) -> str:
        return word.sub(lambda symbol: known.get(symbol[0], symbol[0]), match[0])

    return re.sub(r"\$[^$]*\$", formula, text)


@cache
def plain_names(law: Any) -> dict[str, str]:
    """Plain names of geophysics by the names of the parameters, where they differ."""
    parameters = {**INTERFACE, **EXPERIMENT, **(law_parameters(law) if law is not None else {})}
    return {
        name: _DECORATIONS.sub("", symbol_of(parameter, "geophysics"))
        for name, parameter in parameters.items()
        if symbol_of(parameter, "geophysics") != parameter.symbol and len(name) < 3
    }
