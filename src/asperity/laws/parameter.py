"""Declaration of a law's parameters: kind of quantity, rule, symbol and meaning."""

from __future__ import annotations

from functools import partial
from typing import Any

import equinox as eqx
import jax.numpy as jnp

from asperity.parameters import INTERFACE, Parameter, obeying, plain_name
from asperity.parameters.arguments import typed


@typed
def parameter(
    name: str,
    kind: str,
    rule: str = "positive",
    *,
    symbol: str = "",
    meaning: str = "",
    geophysics: str = "",
) -> Any:
    """Declare a field of a law: texts become SI, values that break the rule are refused.

    The declaration is the entry of the parameter in the table of parameters.

    Parameters
    ----------
    name : str
        Name in messages, such as ``law.D0``.
    kind : str
        Kind of quantity, a key of `asperity.units.KINDS`.
    rule : {"positive", "not negative", "finite"}
    symbol : str
        In LaTeX; by default that of `asperity.parameters.INTERFACE` for the same quantity, else
        the name.
    meaning, geophysics : str
        In one line; by default that of the symbol.

    Returns
    -------
    dataclass field
        Its values are float64 arrays; its metadata hold the entry and the SI unit.
    """
    bare = plain_name(name)
    shared = INTERFACE.get(bare)
    if shared is None or shared.kind != kind:
        shared = Parameter(bare, kind, rule, symbol=bare)
    entry = Parameter(
        bare,
        kind,
        rule,
        meaning or shared.meaning,
        symbol or shared.symbol,
        label=name,
        aliases=shared.aliases,
        meant=shared.meant,
        geophysics=geophysics or shared.geophysics,
    )
    converter = partial(checked, name=name, kind=kind, rule=rule)
    return eqx.field(converter=converter, metadata={"parameter": entry, "unit": entry.unit})


def checked(value: Any, *, name: str, kind: str, rule: str) -> Any:
    """Convert `value` to SI and check its rule, as `asperity.parameters.obeying`.

    Returns
    -------
    JAX array of float64
    """
    return jnp.asarray(obeying(value, name, kind, rule))
