"""``asperity air``: the fraction of the load modulation that the contacts bear."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, get_args

import click

from asperity.cli.options import (
    material_option,
    option,
    output_options,
    set_option,
    settings_of,
    switch,
)
from asperity.cli.report import Output, say
from asperity.cli.words import POINT_OPTIONS, fields_as_options
from asperity.errors import require, symbol
from asperity.parameters.arguments import number, one_of

if TYPE_CHECKING:
    from asperity.air import AirLayer
    from asperity.materials import Material

_EPILOG = """\b
Examples:
  asperity air --material bureau2000 -f "120 Hz" -f "200 Hz"
  asperity air --material bureau2000 -f "200 Hz" --vacuum
  asperity air --material bureau2000 -f "120 Hz" --inverse 0.48 --for radius

\b
Parameters: R, h0, P0, eta of the layer; W0, M, lambda_z of the slider.
"""


@click.command(epilog=_EPILOG)
@option(
    "-f --frequency frequencies", "VALUE", 'Modulation frequency, like "120 Hz"; repeatable.',
    multiple=True, required=True,
)  # fmt: skip
@material_option()
@set_option('--set "R=2.5 cm"')
@switch("--vacuum", "Without air between the surfaces.")
@option("--gas-flow", "MODEL", "Leak at low pressure: continuum, slip or free-molecular.")
@option("--inverse", "RATIO", "Find what gives this eps_eff/eps.")
@option("--for sought", "radius|gap", "What --inverse looks for.")
@output_options()
def air(
    frequencies: tuple[str, ...],
    material: str | None,
    settings: tuple[str, ...],
    vacuum: bool,
    gas_flow: str | None,
    inverse: str | None,
    sought: str | None,
    output: Output,
) -> int:
    """Effective modulation under a squeezed air layer.

    The fraction eps_eff/eps of the normal-load modulation that the micro-contacts bear, its phase
    against the load, |gamma R| of the layer and its stiffness.
    """
    from asperity import materials
    from asperity.air import AirLayer
    from asperity.air.layer import GasFlow

    flow: Any = one_of(gas_flow or "continuum", get_args(GasFlow), "--gas-flow")
    flows = gas_flow is None or not vacuum
    require(flows, "--gas-flow", "have an air layer", "--vacuum", "leave one of them out")
    if sought is not None:
        one_of(sought, ("radius", "gap"), "--for")
    together = (inverse is None) == (sought is None)
    advice = "write them like --inverse 0.48 --for radius"
    require(together, "--inverse and --for", "be given together", "only one", advice)
    layered = not (inverse and vacuum)
    require(layered, "--inverse", "have an air layer", "--vacuum", "leave one of them out")
    one, count = inverse is None or len(frequencies) == 1, len(frequencies)
    require(one, "--inverse", "have one frequency", count, "call once for each")
    unknown, given = {"radius": "R", "gap": "h0"}.get(sought or "", ""), settings_of(settings)
    field, got = f"--set {symbol(unknown)}", f"'{given.get(unknown)}'"
    require(unknown not in given, field, f"be left out with --for {sought}", got, "it is sought")
    with fields_as_options(POINT_OPTIONS):
        published = None if material is None else materials.load(material)
    numbers = _numbers(given, published, vacuum, unknown)
    hertz = [number(text, "--frequency", "frequency", "positive") for text in frequencies]
    layer = None
    if not vacuum:
        # The layer must be complete, although the value of the sought parameter is not used.
        P0, h0, R, eta = (numbers.get(name, 1.0) for name in ("P0", "h0", "R", "eta"))
        layer = AirLayer(P0=P0, h0=h0, eta=eta, R=R, gas_flow=flow)
    if inverse is None or layer is None:
        return _forward(hertz, layer, numbers, output)
    ratio = number(inverse, "--inverse", "dimensionless", "positive")
    return _invert(ratio, unknown, hertz[0], layer, numbers, output)


def _numbers(
    given: dict[str, str], material: Material | None, vacuum: bool, unknown: str
) -> dict[str, float]:
    """SI values of the parameters; the sought parameter need not be known."""
    from asperity.air.layer import LAYER
    from asperity.air.normal_contact import LAMBDA_Z
    from asperity.operating_point import without_numbers
    from asperity.parameters import MACHINE

    layer = {p.argument: p for p in LAYER.values()}
    contact = {n: MACHINE[n] for n in ("W0", "M")} | {"lambda_z": LAMBDA_Z}
    known = contact if vacuum else layer | contact
    numbers = {}
    for name, text in given.items():
        field, apart = f"--set {symbol(name)}", not (vacuum and name in layer)
        require(apart, field, "not be given with --vacuum", f"'{text}'", "leave one out")
        one_of(symbol(name), map(symbol, known), "--set")
        numbers[name] = number(text, field, known[name].kind, "positive")
    for name, parameter in known.items():
        published = material[parameter.name] if material and parameter.name in material else None
        # As for operating points, a number of another kind of quantity is not the parameter.
        if name not in (*numbers, unknown) and published and published.dimension == parameter.kind:
            numbers[name] = published.si
    missing = [name for name in known if name not in (*numbers, unknown)]
    if missing:
        raise without_numbers("air", missing, known)
    return numbers


def _contact(numbers: dict[str, float]) -> dict[str, float]:
    return {name: numbers[name] for name in ("W0", "M", "lambda_z")}


def _forward(
    hertz: list[float], layer: AirLayer | None, numbers: dict[str, float], output: Output
) -> int:
    import numpy as np

    from asperity.air import effective_modulation, modulation_phase
    from asperity.outputs.sections import Section
    from asperity.units import format_si

    contact = _contact(numbers)
    head = ["frequency", "eps_eff/eps", "phase (rad)"]
    columns = {
        "ratio": effective_modulation(hertz, layer=layer, **contact),
        "phase": modulation_phase(hertz, layer=layer, **contact),
    }
    # Without a layer its numbers are null: JSON has the same keys.
    absent: dict[str, Any] = {"squeeze": None, "layer_stiffness": None}
    stiffness: dict[str, Any] = {"air_stiffness": None, "gas_flow": None}
    if layer is not None:
        omega = 2 * np.pi * np.array(hertz)
        dynamic = layer.dynamic_stiffness(omega)
        columns["squeeze"] = layer.squeeze(omega)
        columns["layer_stiffness"] = np.stack([dynamic.real, dynamic.imag], axis=1)
        head += ["|gamma R|", "spring (N/m)", "damping (N/m)"]
        stiffness = {"air_stiffness": layer.stiffness, "gas_flow": layer.gas_flow}
    points = [
        {"frequency": f, **absent, **{n: np.asarray(c)[i].tolist() for n, c in columns.items()}}
        for i, f in enumerate(hertz)
    ]
    table = np.column_stack(list(columns.values()))
    rows = tuple(
        (format_si(f, "frequency", 6), *(f"{value:.6g}" for value in row))
        for f, row in zip(hertz, table, strict=True)
    )
    output.answer(
        lambda: {"points": points, **stiffness, "parameters": numbers},
        lambda: [Section("", head=tuple(head), rows=rows)],
        indent="",
    )
    return 0


def _invert(
    ratio: float,
    unknown: str,
    hertz: float,
    layer: AirLayer,
    numbers: dict[str, float],
    output: Output,
) -> int:
    from asperity.air import gap, patch_radius
    from asperity.outputs.sections import Section
    from asperity.units import format_si

    solve: Any
    sought, solve = {"R": ("radius", patch_radius), "h0": ("gap", gap)}[unknown]
    result = solve(ratio, hertz, layer=layer, **_contact(numbers))
    lengths = tuple(f"{symbol(unknown)} = {format_si(v, 'length', 6)}" for v in result.solutions)
    if output.as_json or lengths:
        output.answer(
            lambda: {
                "for": sought,
                "ratio": ratio,
                "frequency": hertz,
                "solutions": list(result.solutions),
                "reachable": [result.reachable_min, result.reachable_max],
                "result": result.result,
                "gas_flow": layer.gas_flow,
                "parameters": {n: v for n, v in numbers.items() if n != unknown},
            },
            lambda: [Section("", lengths)],
        )
    if result.result != "found":
        say(result.result)
    return 0 if result.found else 1
