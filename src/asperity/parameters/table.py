"""The table of parameters: every number that an operating point depends on, by its one name.

The parameters that only one law has are declared in the file of that law; `law_parameters` reads
them from the class, so that a law written elsewhere has its place in the table as well.

The table of outputs has every quantity of a periodic response, by its one name.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Mapping
from functools import cache
from types import MappingProxyType
from typing import Any

from asperity.errors import Argument, InputError, closest
from asperity.parameters.arguments import shown
from asperity.parameters.parameter import Output, Parameter

#: Every output. Convention: F/W0 = mean_friction + sum of mu_n cos(n w t + phase_n).
OUTPUTS: Mapping[str, Output] = MappingProxyType(
    {
        output.name: output
        for output in (
            Output("mean_friction", "1", "mean of F/W0", r"\bar F/W_0"),
            Output("delta_mu", "1", "change of the mean by the modulation", r"\Delta\bar\mu"),
            Output("mu_ss", "1", "friction coefficient of steady sliding", r"\bar\mu(V)"),
            Output("mu1", "1", "first harmonic of F/W0, peak", r"\mu_1"),
            Output("mu2", "1", "second harmonic of F/W0, peak", r"\mu_2"),
            Output("phase1", "rad", "phase of the first harmonic", r"\arg c_1"),
            Output("phase2", "rad", "phase of the second harmonic", r"\arg c_2"),
            Output("harmonics", "1", "complex amplitudes of F/W0", "c_n"),
            Output("multipliers", "1", "Floquet multipliers", "m", former=("floquet",)),
            Output(
                "log_multipliers",
                "1",
                "ln|m| + i arg m of the Floquet multipliers",
                r"\ln m",
            ),
            Output("floquet_max", "1", "largest modulus of the multipliers", r"\max\lvert m\rvert"),
            Output(
                "log_multiplier",
                "1",
                "logarithm of the largest modulus of the multipliers",
                r"\max\ln\lvert m\rvert",
            ),
            Output("mode", "1", "bifurcation of the leading multiplier"),
            Output("mode_frequency", "Hz", "frequency of the leading mode, modulo f"),
            Output("growth_rate", "1/s", "growth rate of the leading mode"),
            Output("stable", "1", "all multipliers inside the unit circle"),
            Output("converged", "1", "whether the point was solved"),
            Output("result", "1", "converged, or why not"),
        )
    }
)

#: Columns that a table of operating points gets.
RESULT_COLUMNS = (
    "mean_friction",
    "delta_mu",
    "mu1",
    "mu2",
    "phase1",
    "phase2",
    "floquet_max",
    "stable",
    "converged",
    "result",
)


def _by_name(*parameters: Parameter) -> Mapping[str, Parameter]:
    return MappingProxyType({p.name: p for p in parameters})


#: Parameters that several laws share.
INTERFACE = _by_name(
    Parameter(
        "mu0",
        "dimensionless",
        "positive",
        "friction coefficient of steady sliding at $V_0$",
        r"\mu_0",
        geophysics=r"$\mu_0$, $f_0$",
    ),
    Parameter(
        "A",
        "dimensionless",
        "positive",
        "rate coefficient (direct effect)",
        "A",
        geophysics="$a$",
    ),
    Parameter(
        "B",
        "dimensionless",
        "not negative",
        "state coefficient (evolution effect)",
        "B",
        geophysics="$b$",
    ),
    Parameter(
        "D0",
        "length",
        "positive",
        "memory length",
        "D_0",
        meant=("dc", "d_c"),
        geophysics="$D_c$, $d_c$, $L$",
    ),
    Parameter(
        "V0",
        "velocity",
        "positive",
        "reference velocity",
        "V_0",
        geophysics="$V_0$, $V_*$",
    ),
    Parameter(
        "lambda",
        "length",
        "not negative",
        "shear elastic length of the asperities",
        r"\lambda",
        aliases=("lambda_",),
    ),
)

#: The slider, and what of it counts in the equation of motion.
MACHINE = _by_name(
    Parameter(
        "K",
        "stiffness",
        "positive",
        "stiffness of the pulling spring",
        "K",
        "slider",
        "system.slider.K",
        label="slider.K",
        argument="spring",
        meant=("stiffness",),
        geophysics="$k$ (Pa/m, over the area)",
    ),
    Parameter(
        "W0",
        "force",
        "positive",
        "mean normal load",
        "W_0",
        "slider",
        "system.slider.W0",
        label="slider.W0",
        argument="load",
        meant=("load",),
        geophysics=r"$\bar\sigma_n$ (Pa, over the area)",
    ),
    Parameter(
        "M",
        "mass",
        "not negative",
        "mass of the slider",
        "M",
        "slider",
        "system.slider.M",
        default=0.0,
        label="slider.M",
        argument="mass",
        meant=("mass",),
    ),
    Parameter(
        "eta",
        "damping",
        "not negative",
        "radiation damping: force of radiated waves per velocity",
        r"\eta",
        "motion",
        "system.eta",
        default=0.0,
        label="radiation_damping",
        argument="radiation_damping",
        options=("--radiation-damping",),
        aliases=("radiation_damping",),
        geophysics=r"$\eta = G/(2 c_s)$ (Pa s/m, over the area)",
    ),
)

#: Pulling velocity and modulation.
DRIVE = _by_name(
    Parameter(
        "V",
        "velocity",
        "positive",
        "pulling velocity",
        "V",
        "drive",
        "system.V",
        label="velocity",
        argument="velocity",
        options=("-V", "--velocity"),
        aliases=("velocity",),
        geophysics=r"$V_{lp}$, $V_{pl}$ (load point, plate)",
    ),
    Parameter(
        "epsilon",
        "dimensionless",
        "amplitude",
        "relative amplitude of the load on the contacts",
        r"\varepsilon",
        "load",
        "load.epsilon",
        label="epsilon",
        argument="epsilon",
        options=("-e", "--epsilon"),
        aliases=("eps",),
        geophysics=r"$\Delta\sigma/\bar\sigma$",
    ),
    Parameter(
        "frequency",
        "frequency",
        "positive",
        "frequency of the modulation",
        "f",
        "drive",
        "system.omega",
        2 * math.pi,
        label="frequency",
        argument="frequency",
        options=("-f", "--frequency"),
        aliases=("f",),
        meant=("omega",),
        geophysics="$1/T$",
    ),
    Parameter(
        "inertia",
        "dimensionless",
        "switch",
        "include the inertia of the slider",
        "",
        "motion",
        default=0.0,
        label="inertia",
        argument="inertia",
        options=("--inertia",),
        words=MappingProxyType({"true": 1.0, "yes": 1.0, "false": 0.0, "no": 0.0}),
    ),
)


def _modulation(name: str, symbol: str, meaning: str, rule: str = "finite") -> Parameter:
    angle = name == "tilt" or name.endswith("_phase")
    return Parameter(
        name, "dimensionless", rule, meaning, symbol, "drive", default=0.0, label=name, angle=angle
    )


#: What else may be modulated, 0 where it is not: the arguments of `asperity.loads.modulated`.
#: Angles are in rad. Continuation and fits have a harmonic load and take none of them.
MODULATION = _by_name(
    _modulation("epsilon2", r"\varepsilon_2", "relative amplitude of the load's second harmonic"),
    _modulation("epsilon2_phase", r"\varphi_2", "phase of the load's second harmonic (rad)"),
    _modulation("epsilon3", r"\varepsilon_3", "relative amplitude of the load's third harmonic"),
    _modulation("epsilon3_phase", r"\varphi_3", "phase of the load's third harmonic (rad)"),
    _modulation("pull", "a", "amplitude of the pulling velocity over its mean"),
    _modulation("pull_phase", r"\varphi_V", "phase of the pulling velocity against the load (rad)"),
    _modulation(
        "tilt",
        r"\chi",
        "angle between the modulated force and the interface's normal (rad), positive where a "
        "growing load pushes the slider along",
        "below a right angle",
    ),
)

#: All that is no law's own.
EXPERIMENT: Mapping[str, Parameter] = MappingProxyType({**MACHINE, **DRIVE, **MODULATION})


def plain_name(name: str) -> str:
    """The name of a parameter without what Python or a message puts around it.

    ``lambda_`` is how Python has to write ``lambda``; ``law.D0`` is what messages call ``D0``.
    """
    return name.removeprefix("law.").rstrip("_")


@cache
def law_parameters(law: Any) -> Mapping[str, Parameter]:
    """The parameters of a friction law, as its fields declare them.

    Parameters
    ----------
    law : type of Law
        Registered or not.

    Raises
    ------
    InputError
        If a field has the name of a parameter of the experiment.
    """
    parameters = {}
    for declared in dataclasses.fields(law):
        name = plain_name(declared.name)
        if name in EXPERIMENT:
            raise InputError(
                f"law.{name}",
                "have a name that is free",
                f"'{name}', which is the {EXPERIMENT[name].meaning}",
                f"rename the field of {law.__name__}",
            )
        parameter = declared.metadata.get("parameter")
        # A field without declaration is a pure number.
        parameters[name] = parameter or Parameter(
            name, "dimensionless", "finite", label=f"law.{name}"
        )
        path = f"system.slider.law.{declared.name}"
        parameters[name] = dataclasses.replace(parameters[name], name=name, path=path)
    return MappingProxyType(parameters)


def point_parameters(law: Any) -> dict[str, Parameter]:
    """Every parameter of an operating point with this law, in the order of a table's columns."""
    return {**law_parameters(law), **EXPERIMENT}


def all_parameters(laws: Iterable[Any]) -> dict[str, Parameter]:
    """`point_parameters` of several laws together.

    Where two laws have parameters of the same name, that of the first law stands.
    """
    parameters: dict[str, Parameter] = {}
    for law in laws:
        parameters = {**law_parameters(law), **parameters}
    return {**parameters, **EXPERIMENT}


def required(law: Any) -> tuple[str, ...]:
    """Names of the parameters without which a point with this law cannot be solved."""
    return tuple(name for name, p in point_parameters(law).items() if p.default is None)


def canonical_name(name: str, known: Mapping[str, Parameter]) -> str | None:
    """The one name of a parameter of `known`, by that name or an alias; None if it has none."""
    if name in known:
        return name
    bare = plain_name(name)
    if bare in known:
        return bare
    return next((p.name for p in known.values() if name in p.aliases), None)


def known_name(
    name: str, known: Mapping[str, Parameter], label: str | Argument = "parameter"
) -> str:
    """As `canonical_name`.

    Raises
    ------
    InputError
        If no parameter has that name; the message suggests the nearest one.
    """
    canonical = canonical_name(name, known)
    if canonical is None:
        raise InputError(label, "be a known name", shown(name), suggestion(name, known))
    return canonical


def suggestion(name: str, known: Mapping[str, Parameter]) -> str:
    """``did you mean 'x'?``, or the names there are."""
    meant = [p.name for p in known.values() if name.lower() in p.meant]
    return f"did you mean '{meant[0]}'?" if meant else closest(name, known)
