"""Compilation of a loop over small arrays to one kernel.

Loops over small arrays are compiled as one kernel of the processor. XLA runs every operation of the
body of a loop as a separate kernel. For arrays of a few numbers, calling the kernels takes several
times as long as their computation. A call with the attributes below is compiled to a single kernel
with its control flow; compilers without these attributes ignore them.

XLA cannot compile every program to one kernel, and may abort the process (jaxlib 0.10.2). Only
programs of element-wise operations on scalar parameters are compiled this way: every law with a
closed form for its velocity, under any load except a table.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache, wraps
from typing import Any

import jax
import numpy as np
from jax.experimental.xla_metadata import set_xla_metadata

from asperity.transients.equations import SegmentEquations

_ATTRIBUTES = {"xla_cpu_small_call": "true", "inlineable": "false"}
_NO_ATTRIBUTES = dict.fromkeys(_ATTRIBUTES)

#: Primitives known to compile; rates and excitation must use no others.
# fmt: off
_ALLOWED = frozenset((
    "abs", "add", "add_any", "and", "asinh", "broadcast_in_dim", "clamp", "concatenate",
    "convert_element_type", "copy", "cos", "cosh", "div", "eq", "exp", "exp2", "expm1", "floor",
    "ge", "gt", "integer_pow", "is_finite", "le", "log", "log1p", "lt", "max", "min", "mul", "ne",
    "neg", "not", "or", "pow", "reduce_sum", "rem", "reshape", "round", "select_n", "sign", "sin",
    "sinh", "slice", "sqrt", "square", "squeeze", "stack", "stop_gradient", "sub", "tan", "tanh",
    "unstack", "xor",
))
# fmt: on


def one_kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile as `jax.jit` does, to one kernel where XLA can.

    Parameters
    ----------
    function : callable
        Function of a `SegmentEquations` and other arguments.
    """
    many, single = jax.jit(function), jax.jit(_as_one_kernel(function))

    @wraps(function)
    def call(system: SegmentEquations, *arguments: Any) -> Any:
        run = single if _compiles_to_one(system) else many
        return run(system, *arguments)

    return call


def _as_one_kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    def within(*arguments: Any) -> Any:
        with set_xla_metadata(**_NO_ATTRIBUTES):
            return function(*arguments)

    @wraps(function)
    def call(*arguments: Any) -> Any:
        with set_xla_metadata(**_ATTRIBUTES):
            return jax.jit(within)(*arguments)

    return call


def _compiles_to_one(system: SegmentEquations) -> bool:
    leaves, structure = jax.tree.flatten(system)
    return all(np.ndim(leaf) == 0 for leaf in leaves) and _elementwise(structure)


@cache
def _elementwise(structure: Any) -> bool:
    """Whether rates and excitation of a system of scalars are element-wise."""
    system = jax.tree.unflatten(structure, [np.ones(())] * structure.num_leaves)

    def evaluate(system: SegmentEquations, t: jax.Array, Y: jax.Array) -> tuple:
        return system.rates(system.at(t), Y), system.segment.next_kink(t)

    with set_xla_metadata(**_NO_ATTRIBUTES):
        jaxpr = jax.make_jaxpr(evaluate)(system, np.ones(()), np.ones(system.motion.size + 1))
    return _ALLOWED.issuperset(_primitives(jaxpr.jaxpr))


def _primitives(jaxpr: Any) -> Iterator[str]:
    """Names of the primitives of a program and of the functions that it calls."""
    for equation in jaxpr.eqns:
        inner = [getattr(p, "jaxpr", p) for p in equation.params.values()]
        called = [p for p in inner if hasattr(p, "eqns")]
        if equation.primitive.name in ("jit", "pjit", "custom_jvp_call"):
            for part in called:
                yield from _primitives(part)
        else:
            yield equation.primitive.name
