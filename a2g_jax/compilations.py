"""Compiled programs: a persistent cache of them, since XLA needs seconds to compile what runs in milliseconds, and the
memory that compiling leaves behind."""

import contextlib
import ctypes
import os
from functools import cache
from pathlib import Path
from typing import Any

import jax

_MOST_BYTES = 500_000_000
#: Programs that are compiled faster are not kept.
_LEAST_SECONDS = 0.02
#: Compilations that are shorter leave little behind.
_LONG_SECONDS = 0.5
#: JAX's event at the end of a compilation, before the program runs for the first time.
_COMPILED = "/jax/core/compile/backend_compile_duration"


def keep_compilations() -> None:
    """Cache compiled programs in the user's cache folder, unless JAX is configured with another one."""
    if os.environ.get("JAX_COMPILATION_CACHE_DIR") is None:
        cache = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")  # noqa: PTH111 - it never raises
        folder = Path(cache) / "a2g_jax" / "xla"
        drop_unfinished(folder)
        jax.config.update("jax_compilation_cache_dir", str(folder))
        jax.config.update("jax_compilation_cache_max_size", _MOST_BYTES)
        # By default only what took a second; dozens of small programs together take as long.
        jax.config.update("jax_persistent_cache_min_compile_time_secs", _LEAST_SECONDS)


def drop_unfinished(folder: Path) -> None:
    """Remove programs without the file of their last use, left by a kill between the two writes.

    With one of them in the folder, JAX caches no further program.
    """
    for program in folder.glob("*-cache"):
        if not program.with_name(program.name.removesuffix("cache") + "atime").exists():
            with contextlib.suppress(OSError):
                program.unlink()


@cache
def release_after_compiling() -> None:
    """Give the memory that a long compilation has freed back to the system before the program first runs.

    The compiler's threads free hundreds of megabytes that the C library would keep, in pieces too small for the
    program's arrays. Only with the GNU C library; called again, it does nothing.
    """
    trim = _malloc_trim()
    if trim is None:
        return

    def release(event: str, duration_secs: float, **about: Any) -> None:
        del about
        if event == _COMPILED and duration_secs > _LONG_SECONDS:
            trim(0)

    jax.monitoring.register_event_duration_secs_listener(release)


def _malloc_trim() -> Any:
    """The function of the GNU C library; None with others."""
    with contextlib.suppress(OSError, TypeError, AttributeError):  # Windows has no library of no name
        return ctypes.CDLL(None).malloc_trim
    return None
