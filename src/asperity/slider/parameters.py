"""Parameters of equations of motion by name: their list, their values, and replacing a value."""

from __future__ import annotations

from collections.abc import Mapping
from operator import attrgetter
from typing import Any

import equinox as eqx
import numpy as np

from asperity._version import __version__
from asperity.laws import Law
from asperity.loads import Harmonic, Modulation
from asperity.parameters import Parameter, law_parameters, point_parameters
from asperity.slider.motion import Motion
from asperity.slider.problem import Problem
from asperity.slider.slider import Slider


def equation_parameters(motion: Motion, load: Modulation | None = None) -> dict[str, Parameter]:
    """Parameters that the equations depend on, by name.

    Parameters
    ----------
    motion : Motion
    load : Modulation, optional
        Without one, amplitude, frequency and pulling velocity are left out: in a transient they
        belong to its programme.
    """
    absent: set[str] = set()
    if "inertial" not in motion.name:
        absent.add("M")
    if not hasattr(motion, "eta"):
        absent.add("eta")
    if not isinstance(load, Harmonic):
        absent.add("epsilon")
    if load is None:
        absent |= {"V", "frequency"}
    known = point_parameters(type(motion.slider.law))
    return {name: p for name, p in known.items() if p.path and name not in absent}


def value_of(problem: Problem, parameter: Parameter) -> Any:
    """Value of a parameter in SI, as the equations hold it: any shape."""
    return attrgetter(parameter.path)(problem) / parameter.scale


def with_value(problem: Problem, parameter: Parameter, value: Any) -> Problem:
    """The problem with another value of one parameter, unchecked."""
    changed = np.asarray(value) * parameter.scale
    return eqx.tree_at(attrgetter(parameter.path), problem, changed)


def equation_values(motion: Motion, load: Modulation | None = None) -> dict[str, Any]:
    """Values of `equation_parameters` by name."""
    problem = Problem(motion, load)
    return {name: value_of(problem, p) for name, p in equation_parameters(motion, load).items()}


def equations_as_text(motion: Motion, values: Mapping[str, Any]) -> dict[str, Any]:
    """Version, law with its source, equation of motion and parameters, as files keep them.

    Parameters
    ----------
    motion : Motion
    values : mapping of str to array
        Written as ``A = 0.013; K = 200000.0 N/m``, with a range for an array.
    """
    law = type(motion.slider.law)
    known = point_parameters(law)
    shown = [f"{name} = {_shown(v)} {known[name].unit}".rstrip() for name, v in values.items()]
    return {
        "asperity_version": __version__,
        "law": law.name,
        "source": law.source,
        "equation_of_motion": motion.name,
        "parameters": "; ".join(shown),
    }


def slider_values(slider: Slider) -> dict[str, Any]:
    """Parameters of the law, K, W0 and M by name, in SI and of any shape."""
    known = point_parameters(type(slider.law)).values()
    of_slider = (p for p in known if p.place in ("law", "slider"))
    return {p.name: attrgetter(p.path.removeprefix("system.slider."))(slider) for p in of_slider}


def law_from(law: type[Law], values: Any) -> Law:
    """The law with the values of a mapping from names of parameters to values."""
    names = law_parameters(law).items()
    return law(**{p.path.rsplit(".", 1)[-1]: values[name] for name, p in names})


def slider_from(law: type[Law], values: Any) -> Slider:
    """The slider with the values of a mapping from names of parameters to values.

    Parameters
    ----------
    law : type of Law
    values : mapping of str to number, array or str
        Parameters of the law, K, W0, and M unless it is 0.
    """
    numbers = law_from(law, values)
    return Slider(numbers, spring=values["K"], load=values["W0"], mass=values.get("M", 0.0))


def _shown(value: Any) -> str:
    value = np.asarray(value)
    low, high = float(value.min()), float(value.max())
    return f"{low!r}" if low == high else f"{low!r} to {high!r}"
