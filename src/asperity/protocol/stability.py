"""Whether the steady sliding that a run begins with is stable."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from asperity.theory import closed_forms as cf

if TYPE_CHECKING:
    from asperity.protocol.protocol import Protocol

#: Laws whose steady sliding loses stability at a stiffness known in closed form.
_RIGID = ("rice-ruina", "linker-dieterich", "ruina-slip")
_ELASTIC = {"elasto-plastic": "slider", "elasto-plastic-age": "plastic"}
#: Growth per slipped metre (1/m) that counts as zero: far below that of any interface.
_ROUND_OFF = 1e-3


def stability_statement(protocol: Protocol) -> str:
    """A sentence where the run begins with steady sliding that is unstable; empty where not.

    Without a perturbation such sliding goes on until rounding errors have grown: what the run
    shows before is no stable state.

    Parameters
    ----------
    protocol : Protocol

    Notes
    -----
    Where no closed form of the critical stiffness exists (other laws, radiation damping, elastic
    asperities with inertia), the rate comes from the equations linearised at steady sliding.
    """
    numbers: dict[str, Any] = {name: number.value for name, number in protocol.numbers.items()}
    level, heavy = protocol.programme.level, protocol.solver.inertia
    if protocol.start.states is not None or not level.velocity > 0:
        return ""
    lambda_ = numbers.get("lambda", 0.0)
    rigid = protocol.law in _RIGID or (protocol.law in _ELASTIC and lambda_ == 0)
    if numbers.get("eta", 0.0) > 0 or (not rigid and (heavy or protocol.law not in _ELASTIC)):
        return _linearised(protocol, numbers)
    fields: dict[str, Any] = {name: numbers[name] for name in ("A", "B", "D0", "K")}
    fields |= {"mu": numbers["mu0"], "W0": level.load, "V": level.velocity, "omega": 1.0}
    point = cf.SmallModulation(**fields, M=numbers.get("M", 0.0), lambda_=lambda_)
    if not rigid:
        critical = cf.critical_stiffness_elastic(point, _ELASTIC[protocol.law])
    else:
        critical = cf.critical_stiffness_inertial(point) if heavy else cf.critical_stiffness(point)
    ratio = float(numbers["K"] / critical)
    if not 0 < ratio < 1:
        return ""
    return (
        f"steady sliding at {level.velocity:g} m/s is unstable at the start: K is {ratio:.3g} of "
        "the critical stiffness; without a perturbation, such as a step of the load, the run stays "
        "on it until rounding errors have grown"
    )


def _linearised(protocol: Protocol, numbers: dict[str, Any]) -> str:
    """The sentence from the growth rate of a small disturbance of steady sliding."""
    import jax
    import numpy as np

    from asperity.slider import Slider
    from asperity.slider.problem import checked_problem, flatten

    law, level = protocol.slider.law, protocol.programme.level
    if not law.rate_dependent:
        return ""
    eta = numbers.get("eta", 0.0)
    problem = checked_problem(
        Slider(law, spring=numbers["K"], load=level.load, mass=numbers.get("M", 0.0)),
        velocity=[level.velocity],
        epsilon=0.0,
        frequency=1 / (2 * math.pi),
        inertia=protocol.solver.inertia,
        radiation_damping=eta if eta > 0 else None,
    )
    system, load = flatten(problem)[0]
    at = load.at(np.zeros(1))
    # At 1 rad/s a radian is a second.
    J = jax.jacfwd(lambda y: system.rates(y[:, None], at)[:, 0])(system.steady()[:, 0])
    rate = float(np.linalg.eigvals(np.asarray(J)).real.max())
    if not rate > _ROUND_OFF * level.velocity:
        return ""
    return (
        f"steady sliding at {level.velocity:g} m/s is unstable at the start: a disturbance grows "
        f"by a factor e in {1 / rate:.3g} s; without a perturbation, such as a step of the load, "
        "the run stays on it until rounding errors have grown"
    )
