"""A response or a map of the page as Python and as a command, for copying."""

from __future__ import annotations

import keyword
from collections.abc import Mapping

from asperity.app.api.operating_point import OperatingPoint
from asperity.laws import get_law
from asperity.materials import Material
from asperity.operating_point import lacking
from asperity.parameters import law_parameters, point_parameters
from asperity.questions.options import number_option
from asperity.study.map import Axis
from asperity.units import format_si, to_si


def exact_text(value: float, kind: str) -> str:
    """The shortest text with a unit that is read back as the same double."""
    texts = (format_si(value, kind, digits) for digits in range(1, 18))
    plain = (text for text in texts if "e" not in text.split(" ")[0])
    return next((t for t in plain if to_si(t, kind, "value") == value), format_si(value, kind, 17))


def explore(point: OperatingPoint, values: Mapping[str, float], epsilon: float) -> dict[str, str]:
    """Python and command of one operating point.

    Parameters
    ----------
    point : OperatingPoint
    values : mapping of str to float
        All numbers in SI.
    epsilon : float
        Amplitude on the contacts.
    """
    options = _command_of_point(point, {**values, "epsilon": epsilon})
    command = f"asperity response {' '.join(options)}"
    return {"python": _python(point, values), "command": command}


def plane(
    point: OperatingPoint, fixed: Mapping[str, float], x: Axis, y: Axis, show: str
) -> dict[str, str]:
    """Python and command of a map.

    Parameters
    ----------
    point : OperatingPoint
    fixed : mapping of str to float
        Numbers that do not vary, in SI.
    x, y : Axis
    show : str
        Quantity of the picture.
    """
    law = get_law(point.law)
    known = point_parameters(law)
    numbers = ", ".join(f'"{n}": {v!r}' for n, v in fixed.items() if v != known[n].default)
    axes, parts = [], _command_of_point(point, fixed)
    for side, a in (("x", x), ("y", y)):
        low, high, log = float(a.low), float(a.high), ", log=True" if a.log else ""
        axes.append(f'    {side}=Axis("{a.name}", {low!r}, {high!r}, {a.count}{log}),')
        ends = f"{low!r}:{high!r}:{a.count} {a.unit}".rstrip()
        parts.append(f'--{side} "{a.name}={ends}"' + (f" --log-{side}" if a.log else ""))
    python = [
        "import asperity as asp",
        "from asperity.study.map import Axis",
        "",
        f"numbers = {{{numbers}}}",
        "result = asp.map(",
        f'    "{point.law}",',
        "    numbers,",
        *axes,
        ")",
        f'print(result["{show}"])',
    ]
    parts += ["--out map.nc", "--plot map.png", f"--show {show}"]
    return {"python": "\n".join(python) + "\n", "command": f"asperity map {' '.join(parts)}"}


def _python(point: OperatingPoint, values: Mapping[str, float]) -> str:
    material = point.chosen_material()
    law = get_law(point.law)
    changed = [n for n in law_parameters(law) if _published(material, n) != values[n]]
    known = point_parameters(law)

    def text(name: str) -> str:
        value = exact_text(values[name], known[name].kind)
        return f'"{value}"' if known[name].unit else value

    law_numbers = "".join(f", {n}{'_' * keyword.iskeyword(n)}={text(n)}" for n in changed)
    lines = [
        "import asperity as asp",
        "",
        f'material = asp.materials.load("{material.name}")',
        f'law = material.law("{point.law}"{law_numbers})',
        f"slider = asp.Slider(law, spring={text('K')}, load={text('W0')}"
        + (f", mass={text('M')})" if "M" in values else ")"),
    ]
    amplitude = text("epsilon")
    if point.air is not None:
        air = point.air_values()
        lines += [
            "",
            f"layer = asp.air.AirLayer(P0={air['P0']!r}, h0={air['h0']!r}, "
            f"eta={air['eta_air']!r}, R={air['R']!r})",
            "share = asp.air.effective_modulation(",
            f"    {values['frequency']!r}, W0={values['W0']!r}, M={values.get('M', 0.0)!r}, "
            f"lambda_z={air['lambda_z']!r}, layer=layer",
            ")",
        ]
        amplitude = f"share * {values['epsilon']!r}"
    call = [f"velocity={text('V')}", f"epsilon={amplitude}", f"frequency={text('frequency')}"]
    if values.get("inertia"):
        call.append("inertia=True")
    if values.get("eta"):
        call.append(f"radiation_damping={text('eta')}")
    lines += [
        "",
        "response = asp.periodic_response(",
        f"    slider, {', '.join(call)}",
        ")",
        "print(response)",
    ]
    return "\n".join(lines) + "\n"


def _published(material: Material, name: str) -> float | None:
    """The number of a material in SI."""
    return material[name].si if name in material and material[name].value is not None else None


def _command_of_point(point: OperatingPoint, values: Mapping[str, float]) -> list[str]:
    """Options of the numbers that differ from those of the material."""
    material = point.chosen_material()
    known = point_parameters(get_law(point.law))
    parts = [f"--law {point.law} --material {material.name}"]
    for name, value in values.items():
        published = _published(material, name)
        default = known[name].default if published is None else published
        if value != default and not lacking(name, values):
            parts.append(number_option(name, exact_text(value, known[name].kind)))
    return parts
