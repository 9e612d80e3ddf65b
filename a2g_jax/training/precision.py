"""Mixed precision: matrix products and convolutions of networks in bfloat16, everything else in float32.

A transformation of programs, so that no model has to know of it: parameters, optimisers, losses, normalisations,
densities and kinematics stay in float32, and products are accumulated in it.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

import jax
import jax.numpy as jnp
from jax.extend import core

#: Products over fewer terms stay as they are: 3 x 3 rotations along a skeleton add up their errors, and cost little.
_FEWEST_TERMS = 16


def half_products(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function with operands of its large products rounded to bfloat16.

    Args:
        function: of pytrees of arrays. If it has gradients in it, their products are rounded, too.
    """

    def rounded(*arguments: Any) -> Any:
        program, shapes = jax.make_jaxpr(function, return_shape=True)(*arguments)
        results = _evaluate(program.jaxpr, program.consts, jax.tree.leaves(arguments))
        return jax.tree.unflatten(jax.tree.structure(shapes), results)

    return rounded


def _evaluate(program: core.Jaxpr, constants: Sequence[Any], inputs: Sequence[Any]) -> list[Any]:
    """Results of a program with rounded products."""
    values: dict[Any, Any] = dict(zip(program.constvars, constants, strict=True))
    values |= dict(zip(program.invars, inputs, strict=True))
    read = lambda atom: atom.val if isinstance(atom, core.Literal) else values[atom]  # noqa: E731
    for equation in program.eqns:
        operands = [read(atom) for atom in equation.invars]
        called = equation.params.get("call_jaxpr") or equation.params.get("fun_jaxpr")
        if isinstance(called, core.ClosedJaxpr):
            # A function with derivatives of its own; they have been taken.
            found = _evaluate(called.jaxpr, called.consts, operands)
            values |= dict(zip(equation.outvars, found, strict=True))
            continue
        params = {name: _rounded_part(part) for name, part in equation.params.items()}
        if _is_large(equation):
            operands = [_half(operand) for operand in operands]
            params["preferred_element_type"] = jnp.dtype(jnp.float32)
        found = equation.primitive.bind(*operands, **params)
        results = found if equation.primitive.multiple_results else [found]
        values |= dict(zip(equation.outvars, results, strict=True))
    return [read(atom) for atom in program.outvars]


def _half(operand: Any) -> Any:
    """An operand in bfloat16; on CPUs, where XLA lacks such products with float32 results, rounded to it."""
    if jax.default_backend() == "cpu":
        return jax.lax.reduce_precision(operand, exponent_bits=8, mantissa_bits=7)
    return operand.astype(jnp.bfloat16)


def _is_large(equation: Any) -> bool:
    """Whether an operation is a product over many terms of float32 arrays."""
    if any(getattr(atom.aval, "dtype", None) != jnp.float32 for atom in equation.invars):
        return False
    if equation.primitive.name == "dot_general":
        (contracted, _), _ = equation.params["dimension_numbers"]
        return math.prod(equation.invars[0].aval.shape[axis] for axis in contracted) >= _FEWEST_TERMS
    if equation.primitive.name == "conv_general_dilated":
        kernel, places = equation.invars[1].aval.shape, equation.params["dimension_numbers"].rhs_spec
        return math.prod(kernel) // kernel[places[0]] >= _FEWEST_TERMS
    return False


def _rounded_part(part: Any) -> Any:
    """A parameter of an operation; programs within it, such as the body of a loop, with rounded products."""
    if isinstance(part, tuple) and any(isinstance(one, core.ClosedJaxpr | core.Jaxpr) for one in part):
        return tuple(_rounded_part(one) for one in part)
    if isinstance(part, core.ClosedJaxpr):
        return _rounded_program(part.jaxpr, part.consts)
    if isinstance(part, core.Jaxpr):
        closed = _rounded_program(part, ())
        return part if closed.consts else closed.jaxpr
    return part


def _rounded_program(program: core.Jaxpr, constants: Sequence[Any]) -> core.ClosedJaxpr:
    kinds: list[Any] = [atom.aval for atom in program.invars]
    shapes = [jax.ShapeDtypeStruct(kind.shape, kind.dtype) for kind in kinds]
    return jax.make_jaxpr(lambda *inputs: _evaluate(program, constants, inputs))(*shapes)
