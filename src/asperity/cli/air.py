"""``asperity air``: the fraction of the load modulation that the contacts bear."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import click

from asperity.cli.options import (
    json_option,
    material_named,
    material_option,
    set_option,
    settings_of,
)
from asperity.errors import InputError, closest

if TYPE_CHECKING:
    from asperity.air import AirLayer
    from asperity.materials import Material

#: Kind of each parameter, and the name of the material's number where it is another.
_LAYER = {
    "R": ("length", "R"),
    "h0": ("length", "h0"),
    "P0": ("pressure", "P0"),
    "eta": ("viscosity", "eta_air"),
}
_CONTACT = {
    "W0": ("force", "W0"),
    "M": ("mass", "M"),
    "lambda_z": ("length", "lambda_z"),
}

_EPILOG = """\b
Examples:
  asperity air --material bureau2000 -f "120 Hz" -f "200 Hz"
  asperity air --material bureau2000 -f "200 Hz" --vacuum
  asperity air --material bureau2000 -f "120 Hz" --inverse 0.48 --for radius

\b
Parameters: R, h0, P0, eta of the layer; W0, M, lambda_z of the slider.
"""


@click.command(epilog=_EPILOG)
@click.option(
    "-f",
    "--frequency",
    "frequencies",
    metavar="VALUE",
    multiple=True,
    required=True,
    help='Modulation frequency, like "120 Hz"; repeatable.',
)
@material_option()
@set_option('--set "R=2.5 cm"')
@click.option("--vacuum", is_flag=True, help="Without air between the surfaces.")
@click.option("--inverse", metavar="RATIO", help="Find what gives this eps_eff/eps.")
@click.option("--for", "sought", metavar="radius|gap", help="What --inverse looks for.")
@json_option()
def air(
    frequencies: tuple[str, ...],
    material: str | None,
    settings: tuple[str, ...],
    vacuum: bool,
    inverse: str | None,
    sought: str | None,
    as_json: bool,
) -> int:
    """Effective modulation under a squeezed air layer.

    The fraction eps_eff/eps of the normal-load modulation that the micro-contacts bear, its phase
    against the load, |gamma R| of the layer and its stiffness.
    """
    from asperity.units import to_si

    _check_question(frequencies, vacuum, inverse, sought)
    chosen = _CONTACT if vacuum else _LAYER | _CONTACT
    numbers = _numbers(chosen, settings_of(settings), material_named(material), vacuum, sought)
    hertz = [to_si(text, "frequency", "frequency") for text in frequencies]
    if inverse is not None:
        ratio = to_si(inverse, "dimensionless", "--inverse")
        return _invert(ratio, str(sought), hertz[0], numbers, as_json)
    _forward(hertz, numbers, vacuum, as_json)
    return 0


def _check_question(
    frequencies: tuple[str, ...], vacuum: bool, inverse: str | None, sought: str | None
) -> None:
    if (inverse is None) != (sought is None):
        raise InputError(
            "--inverse and --for must be given together, got only one; "
            "write them like --inverse 0.48 --for radius"
        )
    if sought is None:
        return
    if sought not in ("radius", "gap"):
        raise InputError(f"--for must be radius or gap, got '{sought}'; choose one of them")
    if vacuum:
        raise InputError("--inverse must have an air layer, got --vacuum; leave one of them out")
    if len(frequencies) > 1:
        raise InputError(
            f"--inverse must have one frequency, got {len(frequencies)}; call once for each"
        )


def _numbers(
    chosen: Mapping[str, tuple[str, str]],
    given: Mapping[str, str],
    material: Material | None,
    vacuum: bool,
    sought: str | None,
) -> dict[str, float]:
    """SI values of the parameters; the one that is sought need not be known."""
    from asperity.units import KINDS, to_si

    for name in given:
        if name in _LAYER and vacuum:
            raise InputError(
                f"{name} must not be given with --vacuum, got '{given[name]}'; leave one out"
            )
        if name not in chosen:
            raise InputError(
                f"parameter must be a known name, got '{name}'; {closest(name, chosen)}"
            )
    numbers = {n: to_si(text, chosen[n][0], f"air.{n}") for n, text in given.items()}
    for name, (_, published) in chosen.items():
        if name not in numbers and material is not None and published in material:
            numbers[name] = material[published].si
    unknown = {"radius": "R", "gap": "h0"}.get(sought or "")
    missing = [name for name in chosen if name not in numbers and name != unknown]
    if missing:
        example = f"{missing[0]}={KINDS[chosen[missing[0]][0]].example}"
        raise InputError(
            f"air must have all its numbers, got none for {', '.join(missing)}; "
            f'name a material that has them or give each one, like --set "{example}"'
        )
    return numbers


def _layer(numbers: Mapping[str, float]) -> AirLayer:
    from asperity.air import AirLayer

    R, h0, P0, eta = (numbers[name] for name in _LAYER)
    return AirLayer(P0=P0, h0=h0, eta=eta, R=R)


def _forward(hertz: list[float], numbers: Mapping[str, float], vacuum: bool, as_json: bool) -> None:
    from asperity.cli.report import to_json

    layer = None if vacuum else _layer(numbers)
    contact = {name: numbers[name] for name in _CONTACT}
    points = [_point(f, contact, layer) for f in hertz]
    if as_json:
        stiffness = {} if layer is None else {"air_stiffness": layer.stiffness}
        click.echo(to_json({"points": points, **stiffness, "parameters": dict(numbers)}))
    else:
        click.echo(_text(points))


def _point(f: float, contact: Mapping[str, float], layer: AirLayer | None) -> dict[str, Any]:
    from math import pi

    from asperity.air import effective_modulation, modulation_phase

    point = {
        "frequency": f,
        "ratio": float(effective_modulation(f, layer=layer, **contact)),
        "phase": float(modulation_phase(f, layer=layer, **contact)),
    }
    if layer is None:
        return point
    stiffness = layer.dynamic_stiffness(2 * pi * f)
    return point | {
        "squeeze": float(layer.squeeze(2 * pi * f)),
        "layer_stiffness": [float(stiffness.real), float(stiffness.imag)],
    }


def _text(points: list[dict[str, Any]]) -> str:
    from asperity.outputs.tables import aligned
    from asperity.units import format_si

    head = ["frequency", "eps_eff/eps", "phase (rad)"]
    if "squeeze" in points[0]:
        head += ["|gamma R|", "spring (N/m)", "damping (N/m)"]
    rows = [head]
    for point in points:
        row = [format_si(point["frequency"], "frequency", 6)]
        row += [f"{point[key]:.6g}" for key in ("ratio", "phase")]
        if "squeeze" in point:
            row += [f"{v:.6g}" for v in (point["squeeze"], *point["layer_stiffness"])]
        rows.append(row)
    return aligned(rows)


def _invert(
    ratio: float, sought: str, hertz: float, numbers: Mapping[str, float], as_json: bool
) -> int:
    from asperity.air import gap, patch_radius
    from asperity.cli.report import to_json
    from asperity.units import format_si

    name, solve = ("R", patch_radius) if sought == "radius" else ("h0", gap)
    # The layer must be complete, though the value of the sought quantity is not used.
    layer = _layer({**numbers, name: 1.0})
    W0, M, lambda_z = (numbers[n] for n in _CONTACT)
    result = solve(ratio, hertz, W0=W0, M=M, lambda_z=lambda_z, layer=layer)
    if as_json:
        record = {
            "for": sought,
            "ratio": ratio,
            "frequency": hertz,
            "solutions": list(result.solutions),
            "reachable": [result.reachable_min, result.reachable_max],
            "result": result.result,
            "parameters": {n: v for n, v in numbers.items() if n != name},
        }
        click.echo(to_json(record))
    else:
        for length in result.solutions:
            click.echo(f"{name} = {format_si(length, 'length', 6)}")
    if not result.found:
        click.echo(f"asperity: {result.result}", err=True)
    return 0 if result.found else 1
