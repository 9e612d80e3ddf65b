"""The few objects that a pickle may build, each by a function of this package that checks its arguments."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from a2g_jax.errors import InputError
from a2g_jax.io.untrusted.arrays import check_shape, object_array, plain_array, plain_type
from a2g_jax.io.untrusted.budget import CONVERT, Budget, clip
from a2g_jax.io.untrusted.refused import first_refused
from a2g_jax.io.untrusted.values import check_key

_MODULES = {"__builtin__": "builtins", "copy_reg": "copyreg"}
_HINTS = {
    "torch": "it holds PyTorch tensors: load it with torch.load(..., weights_only=True) and save NumPy arrays",
    "joblib": "it was written by joblib: load it where you trust it and save its arrays with numpy.savez",
    "pandas": "it holds pandas tables: load it where you trust it and save them as CSV or NumPy arrays",
    "scipy": "it holds SciPy objects: load it where you trust it and save plain arrays with numpy.savez",
}


@dataclass(frozen=True, eq=False)
class Global:
    """A global that a pickle refers to and may only call or pass to a reducer; never a value."""

    name: str


@dataclass(eq=False)
class Unfinished:
    """An array or a type whose content a later ``BUILD`` sets; ``value`` is None until then."""

    kind: str
    value: Any = None
    done: bool = False


def find_global(module: str, name: str, budget: Budget, at: int) -> Global:
    """The marker for an allowed global.

    Raises:
        RefusedError: any other global, with its name.
    """
    root, _, rest = module.partition(".")
    root = _MODULES.get(root, root)
    if root == "numpy" and rest.startswith("_core"):
        rest = rest[1:]
    full = ".".join(part for part in (root, rest, name) if part)
    if full in _REDUCERS or full in ("numpy.ndarray", "copyreg._reconstructor", "builtins.object"):
        return Global(full)
    hint = _HINTS.get(root, CONVERT)
    raise budget.refused(
        at, f"refers to {clip(f'{module}.{name}', 120)}, which is refused, and nothing was run; {hint}."
    )


def reduce(function: Any, arguments: Any, budget: Budget, at: int) -> Any:
    """The result of ``REDUCE``: the object that ``function`` would build from ``arguments``.

    Raises:
        RefusedError: the function or its arguments are not allowed.
        InputError: damaged, or beyond the limits.
    """
    if (refused := first_refused((function, arguments))) is not None:
        raise refused.error
    if not isinstance(function, Global) or function.name not in _REDUCERS:
        name = function.name if isinstance(function, Global) else clip(function)
        raise budget.refused(at, f"calls {name}, which is refused, and nothing was run; {CONVERT}.")
    if type(arguments) is not tuple:
        raise budget.damage(at, f"{function.name} without a tuple of arguments")
    return _REDUCERS[function.name](arguments, budget, at)


def finish(thing: Any, state: Any, budget: Budget, at: int) -> Any:
    """The result of ``BUILD``: the completed array or type.

    Raises:
        RefusedError: any other object, or an invalid state.
        InputError: damaged, or beyond the limits.
    """
    if (refused := first_refused((thing, state))) is not None:
        raise refused.error
    if not isinstance(thing, Unfinished) or thing.done:
        raise budget.refused(at, f"sets the state of {_named(thing)}, which is refused; {CONVERT}.")
    if thing.kind == "array":
        thing.value = _content(state, budget, at)
    else:
        thing.value = _byte_order(thing.value, state, budget, at)
    thing.done = True
    return thing.value


def _named(thing: Any) -> str:
    return thing.name if isinstance(thing, Global) else f"a {type(thing).__name__}"


def _wrong(name: str, budget: Budget, at: int) -> InputError:
    return budget.refused(at, f"gives {name} arguments that NumPy and Python never write; {CONVERT}.")


def _array(arguments: tuple, budget: Budget, at: int) -> Unfinished:
    match arguments:
        case (Global(name="numpy.ndarray"), (0,), b"b" | "b"):
            return Unfinished("array")
    if arguments and isinstance(arguments[0], Global):
        raise budget.refused(at, f"rebuilds an array of class {arguments[0].name}, which is refused; {CONVERT}.")
    raise _wrong("an array", budget, at)


def _content(state: Any, budget: Budget, at: int) -> np.ndarray:
    match state:
        case (1, tuple(shape), np.dtype() as dtype, bool() | int() as fortran, content):
            shape = check_shape(shape, budget, at)
            order = "F" if fortran else "C"
            if dtype.hasobject and type(content) is list:
                return object_array(content, shape, order, budget, at)
            return plain_array(_bytes(content, budget, at), dtype, shape, order, budget, at)
    raise _wrong("an array", budget, at)


def _type(arguments: tuple, budget: Budget, at: int) -> Unfinished:
    match arguments:
        case (str() as text, *flags) if all(flag in (0, 1) for flag in flags) and len(flags) <= 2:
            return Unfinished("type", plain_type(text, budget, at, objects=True))
    raise _wrong("numpy.dtype", budget, at)


def _byte_order(dtype: np.dtype, state: Any, budget: Budget, at: int) -> np.dtype:
    match state:
        case (3 | 4, "<" | ">" | "=" | "|" as order, None, None, None, int() as size, *_):
            if size in (-1, dtype.itemsize) and len(state) <= 9:
                return dtype if order == "|" else dtype.newbyteorder(order)
    raise budget.refused(at, f"has an array of records or dates; expected plain numbers or text; {CONVERT}.")


def _scalar(arguments: tuple, budget: Budget, at: int) -> Any:
    match arguments:
        case (np.dtype() as dtype, content) if not dtype.hasobject:
            return plain_array(_bytes(content, budget, at), dtype, (), "C", budget, at)[()]
    raise _wrong("numpy.core.multiarray.scalar", budget, at)


def _from_buffer(arguments: tuple, budget: Budget, at: int) -> np.ndarray:
    match arguments:
        case (bytes() | bytearray() as content, np.dtype() as dtype, shape, "C" | "F" as order):
            return plain_array(content, dtype, check_shape(shape, budget, at), order, budget, at)
    raise _wrong("numpy.core.numeric._frombuffer", budget, at)


def _bytes(content: Any, budget: Budget, at: int) -> bytes | bytearray:
    # Python 2 wrote bytes as its str, which is decoded as text where it is ASCII.
    if type(content) is str and content.isascii():
        return content.encode("ascii")
    if type(content) not in (bytes, bytearray):
        raise budget.damage(at, f"an array's content is a {type(content).__name__}, not bytes")
    return content


def _encode(arguments: tuple, budget: Budget, at: int) -> bytes:
    match arguments:
        case (str() as text, "latin1" | "latin-1"):
            budget.charge(len(text), at)
            try:
                return text.encode("latin-1")
            except UnicodeEncodeError:
                raise budget.damage(at, "bytes beyond 255") from None
    raise _wrong("_codecs.encode", budget, at)


def _byte_string(arguments: tuple, budget: Budget, at: int) -> bytes:
    if arguments:
        raise _wrong("bytes", budget, at)
    return b""


def _byte_array(arguments: tuple, budget: Budget, at: int) -> bytearray:
    match arguments:
        case ():
            return bytearray()
        case (bytes() as content,):
            budget.charge(len(content), at)
            return bytearray(content)
        case (str(), "latin-1"):
            return bytearray(_encode(arguments, budget, at))
    raise _wrong("bytearray", budget, at)


def _complex(arguments: tuple, budget: Budget, at: int) -> complex:
    match arguments:
        case (float() as real, float() as imaginary):
            return complex(real, imaginary)
    raise _wrong("complex", budget, at)


def _set(kind: Callable) -> Callable:
    def build(arguments: tuple, budget: Budget, at: int) -> Any:
        match arguments:
            case ([*members],) if type(arguments[0]) is list:
                budget.charge(64 * len(members), at)
                budget.work(len(members), at)
                for member in members:
                    check_key(member, members, budget, at)
                return kind(members)
        raise _wrong(kind.__name__, budget, at)

    return build


def _ordered(arguments: tuple, budget: Budget, at: int) -> dict:
    result: dict[Any, Any] = {}
    pairs = arguments[0] if len(arguments) == 1 else []
    if len(arguments) > 1 or type(pairs) is not list:
        raise _wrong("collections.OrderedDict", budget, at)
    budget.work(2 * len(pairs), at)
    for pair in pairs:
        if type(pair) not in (list, tuple) or len(pair) != 2:
            raise _wrong("collections.OrderedDict", budget, at)
        check_key(pair[0], result, budget, at)
        budget.charge(64, at)
        result[pair[0]] = pair[1]
    return result


_REDUCERS: dict[str, Callable[[tuple, Budget, int], Any]] = {
    "numpy.core.multiarray._reconstruct": _array,
    "numpy.core.multiarray.scalar": _scalar,
    "numpy.core.numeric._frombuffer": _from_buffer,
    "numpy.dtype": _type,
    "_codecs.encode": _encode,
    "builtins.bytes": _byte_string,
    "builtins.bytearray": _byte_array,
    "builtins.complex": _complex,
    "builtins.set": _set(set),
    "builtins.frozenset": _set(frozenset),
    "collections.OrderedDict": _ordered,
}
