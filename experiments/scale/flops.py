"""Floating-point operations of a program: those of its matrix products and convolutions, loops included.

XLA's cost analysis of a compiled program counts the body of a loop once, which for a recurrent network is a
hundredth of its work; here bodies of ``scan`` count as often as they run. Element-wise operations are left out.
"""

import math
from collections.abc import Iterator
from typing import Any


def product_flops(jaxpr: Any) -> float:
    """Multiplications and additions in a jaxpr; of branches the most expensive one, of ``while`` loops one pass."""
    total = 0.0
    for equation in jaxpr.eqns:
        name, params = equation.primitive.name, equation.params
        if name == "dot_general":
            (contracted, _), _ = params["dimension_numbers"]
            left = equation.invars[0].aval.shape
            total += 2.0 * math.prod(equation.outvars[0].aval.shape) * math.prod(left[axis] for axis in contracted)
        elif name == "conv_general_dilated":
            kernel = equation.invars[1].aval.shape
            features = kernel[params["dimension_numbers"].rhs_spec[0]]
            total += 2.0 * math.prod(equation.outvars[0].aval.shape) * math.prod(kernel) / features
        elif name == "cond":
            total += max(product_flops(branch.jaxpr) for branch in params["branches"])
        else:
            times = params.get("length", 1) if name == "scan" else 1
            total += times * sum(product_flops(inner) for inner in inner_programs(params))
    return total


def loop_flops(jaxpr: Any) -> float:
    """Those of :func:`product_flops` that are within loops, one pass after another."""
    total = 0.0
    for equation in jaxpr.eqns:
        programs = list(inner_programs(equation.params))
        if equation.primitive.name == "scan":
            total += equation.params["length"] * sum(product_flops(inner) for inner in programs)
        else:
            total += max((loop_flops(inner) for inner in programs), default=0.0)
    return total


def inner_programs(params: dict[str, Any]) -> Iterator[Any]:
    """Programs within an operation."""
    for value in params.values():
        for part in value if isinstance(value, tuple | list) else (value,):
            if hasattr(part, "eqns"):
                yield part
            elif hasattr(part, "jaxpr") and hasattr(part.jaxpr, "eqns"):
                yield part.jaxpr
