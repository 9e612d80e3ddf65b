"""Contenders of one benchmark in turns: wall time, processor time, memory, and the rates of the machine in between.

Other work on the machine affects neighbouring turns alike, so that ratios of medians mean more than the times. With one
thread, processor time is that of a quiet machine but for cold caches; with several, only wall time counts, and only
where other processes took little.
"""

import math
import statistics
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from types import MappingProxyType
from typing import Any, NamedTuple

from experiments.benchmarks.measure import Stopwatch, keep_to_cores, others_share, peak_megabytes, usable_cores

#: A call that waits for its results.
Call = Callable[[], Any]
#: Side of the matrices whose product gives the GEMM rate.
_SIDE = 2048
#: Bytes that are copied.
_COPIED = 2**27
#: Bytes that are read: about those of a published flow's weights, which a cache of many cores may hold.
_READ = 2**28
#: Length of a turn at least, seconds: shorter calls are made several times, since the system counts processor time of
#: other processes in ticks of 10 ms.
_LEAST_SECONDS = 0.3


class Case(NamedTuple):
    """What is measured, and the work that it needs at least."""

    contenders: dict[str, Callable[[], Call]]
    """By name, a function that builds a contender's call; the first one is ours."""
    flop: float = 0.0
    """Floating-point operations of all matrix products and convolutions."""
    moved: float = 0.0
    """Bytes that have to be read and written."""
    read: float = 0.0
    """Bytes that have to be read alone, such as weights."""
    about: Mapping[str, Any] = MappingProxyType({})
    """Further figures for the record, such as parameters."""


class Rates:
    """Rates of the machine, measured between the turns."""

    def __init__(self) -> None:
        import jax
        import jax.numpy as jnp
        import numpy as np

        matrix = jnp.ones((_SIDE, _SIDE))
        product = jax.jit(lambda a, b: a @ b)
        array = jnp.ones(_COPIED // 4)
        copy = jax.jit(lambda a: a + 1.0)
        self._calls = {
            "gemm": lambda: jax.block_until_ready(product(matrix, matrix)),
            "copy": lambda: jax.block_until_ready(copy(array)),
        }
        parts = np.array_split(np.ones(_READ // 4, np.float32), usable_cores())
        self._calls["read"] = lambda: list(self._readers.map(np.max, parts))
        self._readers = ThreadPoolExecutor(len(parts))
        self._work = {"gemm": 2.0 * _SIDE**3, "copy": 2.0 * _COPIED, "read": float(_READ)}
        self._turns: dict[str, list[dict[str, float]]] = {name: [] for name in self._calls}
        for call in self._calls.values():
            call()

    def turn(self) -> None:
        """Measure all of them once."""
        for name, call in self._calls.items():
            if name == "read":
                # The contenders before have displaced the array from the cache. Sampling reads its weights again at
                # every frame, so its floor is the rate of reading again.
                call()
            self._turns[name].append(_turn(call))

    def rates(self, clock: str) -> dict[str, float]:
        """FLOP and bytes a second, of the median turns."""
        return {name: self._work[name] / _median(turns, clock) for name, turns in self._turns.items()}


def clock(threads: int) -> str:
    """Which time ratios are of: with one thread the processor's, otherwise the wall's."""
    return "cpu_s" if threads == 1 else "wall_s"


def take_turns(case: Case, names: list[str], rounds: int) -> dict[str, Any]:
    """Figures of every contender, and its ratio to ours: how many times as long it took."""
    threads, rates, calls, rows = usable_cores(), Rates(), {}, {}
    for name in names:
        try:
            call = case.contenders[name]()
            first, second = _turn(call), _turn(call)
        except (
            RuntimeError,
            ImportError,
            OSError,
        ) as error:  # a compiler that is missing, or does not know an operation
            message = (str(error).splitlines() or ["no message"])[0]
            rows[name] = {"contender": name, "failed": f"{type(error).__name__}: {message}"}
            continue
        calls[name] = call, max(1, math.ceil(_LEAST_SECONDS / second["wall_s"]))
        rows[name] = {"contender": name, "first_wall_s": first["wall_s"], "first_cpu_s": first["cpu_s"]}
    taken: dict[str, list[dict[str, float]]] = {name: [] for name in calls}
    for _ in range(rounds):
        for name, (call, times) in calls.items():
            taken[name].append(_turn(call, times))
        rates.turn()
    which, ours = clock(threads), next(iter(case.contenders))
    for name, turns in taken.items():
        rows[name] |= {field: _median(turns, field) for field in ("wall_s", "cpu_s")}
        rows[name] |= {"least_cpu_s": min(turn["cpu_s"] for turn in turns), "rounds": rounds}
        rows[name]["others_share"] = others_share(turns)
        if ours in taken:
            pairs = zip(turns, taken[ours], strict=True)
            rows[name]["ratio"] = statistics.median(turn[which] / own[which] for turn, own in pairs)
    speeds = rates.rates(which)
    floor = {"flop": case.flop, "bytes": case.moved, "bytes_read": case.read}
    floor |= {f"{name}_per_s": rate for name, rate in speeds.items()}
    transfer = case.moved / speeds["copy"] + case.read / speeds["read"]
    floor["seconds"] = max(case.flop / speeds["gemm"], transfer)
    return {"rows": list(rows.values()), "floor": floor, "about": dict(case.about)}


def take_memory(case: Case, name: str) -> dict[str, Any]:
    """Peak memory of a process that has one contender, before and after two calls."""
    call = case.contenders[name]()
    before = peak_megabytes()
    call()
    call()
    return {"before_mb": before, "peak_mb": peak_megabytes()}


def product_flop(function: Callable[..., Any], *arguments: Any) -> float:
    """Floating-point operations of all matrix products and convolutions of a JAX function."""
    import jax

    return _flop(jax.make_jaxpr(function)(*arguments).jaxpr)


def _flop(program: Any) -> float:
    from jax.extend import core

    total = 0.0
    for equation in program.eqns:
        name, operands = equation.primitive.name, [getattr(atom.aval, "shape", ()) for atom in equation.invars]
        size = math.prod(equation.outvars[0].aval.shape) if equation.outvars else 0
        if name == "dot_general":
            (contracted, _), _ = equation.params["dimension_numbers"]
            total += 2.0 * size * math.prod(operands[0][axis] for axis in contracted)
        elif name == "conv_general_dilated":
            features = operands[1][equation.params["dimension_numbers"].rhs_spec[0]]
            total += 2.0 * size * math.prod(operands[1]) / features
        times = equation.params.get("length", 1) if name == "scan" else 1
        for part in equation.params.values():
            for one in part if isinstance(part, tuple | list) else (part,):
                if isinstance(one, core.ClosedJaxpr):
                    total += times * _flop(one.jaxpr)
                elif isinstance(one, core.Jaxpr):
                    total += times * _flop(one)
    return total


def _turn(call: Call, times: int = 1) -> dict[str, Any]:
    """Seconds of a call, of several in a row."""
    keep_to_cores()
    watch, wall, used = Stopwatch(), time.perf_counter(), time.process_time()
    for _ in range(times):
        call()
    took = {"wall_s": (time.perf_counter() - wall) / times, "cpu_s": (time.process_time() - used) / times}
    return {**took, "others": watch.signed_others()}


def _median(turns: list[dict[str, float]], field: str) -> float:
    return statistics.median(turn[field] for turn in turns)
