"""Rows of the pages' tables of parameters and outputs, as Markdown, from `asperity.parameters`."""

from __future__ import annotations

WHICH = ("interface", "experiment", "outputs")


def table(which: str) -> list[list[str]]:
    """Rows of Markdown cells, the head first."""
    from asperity.laws import registered
    from asperity.parameters import EXPERIMENT, OUTPUTS, law_parameters

    if which == "outputs":
        rows = [[_formula(o.symbol), f"`{o.name}`", o.meaning, o.unit] for o in OUTPUTS.values()]
        return [["symbol", "name", "meaning", "unit"], *rows]
    head = ["symbol", "name", "meaning", "unit", "values", "geophysics"]
    if which == "experiment":
        named = [(p, []) for p in EXPERIMENT.values()]
    else:
        head.insert(5, "laws")
        laws = registered()
        owners: dict[tuple[str, str], list[str]] = {}
        entries = {}
        for name, law in laws.items():
            for p in law_parameters(law).values():
                owners.setdefault((p.name, p.kind), []).append(name)
                entries.setdefault((p.name, p.kind), p)
        # Of all laws but the null model: the list would be longer than the table.
        named = [
            (p, [] if len(owners[key]) > len(laws) / 2 else owners[key])
            for key, p in entries.items()
        ]
    rows = []
    for p, laws_of in named:
        names = [f"`{p.name}`"] + [f"`{n}`" for n in (p.argument, *p.aliases) if n and n != p.name]
        row = [_formula(p.symbol), ", ".join(dict.fromkeys(names)), p.meaning, p.unit]
        row += [p.rule if p.default is None else f"{p.rule}; {p.default:g} by default"]
        row += [", ".join(f"`{n}`" for n in laws_of) or "several"] if which == "interface" else []
        rows.append([*row, p.geophysics])
    return [head, *rows]


def _formula(symbol: str) -> str:
    return f"${symbol}$" if symbol else ""
