"""A persistent cache of compiled programs: XLA needs seconds to compile what runs in milliseconds."""

import contextlib
import os
from pathlib import Path

import jax

_MOST_BYTES = 500_000_000
#: Programs that are compiled faster are not kept.
_LEAST_SECONDS = 0.02


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
