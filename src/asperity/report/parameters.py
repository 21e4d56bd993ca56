"""The numbers that the figures rest on, as the paper gives them."""

from __future__ import annotations

from asperity.materials import Number
from asperity.report.markup import cell, rich
from asperity.study.paper import paper

#: Numbers shown, by the name in the material file, with the symbol and what each is.
_SHOWN = {
    "mu0": ("μ₀", "friction coefficient at V₀"),
    "A": ("A", "rate coefficient"),
    "B": ("B", "state coefficient"),
    "D0": ("D₀", "memory length"),
    "V0": ("V₀", "reference velocity"),
    "lambda": ("λ", "shear elastic length of the asperities, fitted"),
    "lambda_quasi_static": ("λ", "the same, measured quasi-statically"),
    "alpha": ("α", "Linker–Dieterich coefficient proposed for granite"),
    "alpha_low": ("α", "the same, small enough for the drop of the mean"),
    "W0": ("W₀", "mean normal load"),
    "K": ("K", "spring stiffness"),
    "M": ("M", "mass of the slider"),
    "V_data": ("V", "pulling velocities of the figures"),
    "frequency": ("f", "frequency of the modulation"),
    "frequency_vacuum": ("f", "the same in the experiment in vacuum"),
    "epsilon_range": ("ε", "relative amplitude of the modulation"),
    "collapse_divisor_120Hz": ("ε/ε_eff", "at 120 Hz"),
    "collapse_divisor_200Hz": ("ε/ε_eff", "air against vacuum, at 200 Hz"),
    "lambda_z": ("λ_z", "normal elastic length"),
    "h0": ("h₀", "gap between the surfaces"),
    "R": ("R", "radius of the air layer"),
    "P0": ("P₀", "pressure of the air"),
    "eta_air": ("η", "viscosity of the air"),
}


def provenance_lines() -> list[str]:
    """Name, value, unit and kind of every number shown, for the heads of the CSV files."""
    return [f"  {name} = {paper()[name]} ({paper()[name].kind})" for name in _SHOWN]


def table() -> str:
    """The numbers with uncertainty, kind and place."""
    rows = "\n".join(_row(*shown, paper()[name]) for name, shown in _SHOWN.items())
    heads = ("Symbol", "What it is", "Value", "Kind", "Place", "Remark")
    head = "".join(f'<th scope="col" role="columnheader">{name}</th>' for name in heads)
    return (
        "<p>As the paper gives them. <em>Fitted</em> by its authors; <em>assumed</em> here, "
        "because the paper does not give it.</p>"
        '<table class="ledger numbers" role="table" aria-label="Parameters">'
        f'<thead role="rowgroup"><tr role="row">{head}</tr></thead>'
        f'<tbody role="rowgroup">\n{rows}\n</tbody></table>'
    )


def _row(symbol: str, meaning: str, number: Number) -> str:
    value = str(number).replace(" um", " µm")
    cells = (
        cell("Symbol", rich(symbol), "symbol"),
        cell("What it is", rich(meaning), "statement"),
        cell("Value", rich(value), "stated"),
        cell("Kind", number.kind, "kind"),
        cell("Place", rich(number.place), "place"),
        cell("Remark", rich(number.note) or "–", "note"),
    )
    return f'<tr role="row">{"".join(cells)}</tr>'
