"""Memory that compiling leaves behind."""

import sys

import jax
import jax.monitoring
import pytest

from a2g_jax import compilations
from a2g_jax.compilations import release_after_compiling


def test_memory_is_released_after_long_compilations_only(monkeypatch):
    released = []
    release_after_compiling.cache_clear()
    monkeypatch.setattr(compilations, "_malloc_trim", lambda: released.append)
    release_after_compiling()
    release_after_compiling()
    for event, seconds in (("/jax/other", 9.0), ("/jax/core/compile/backend_compile_duration", 0.1)):
        jax.monitoring.record_event_duration_secs(event, seconds)
    assert released == []
    jax.monitoring.record_event_duration_secs("/jax/core/compile/backend_compile_duration", 9.0)
    assert released == [0]


def test_jax_still_reports_compilations(monkeypatch):
    """The event is JAX's own; by another name nothing would be released."""
    released = []
    release_after_compiling.cache_clear()
    monkeypatch.setattr(compilations, "_malloc_trim", lambda: released.append)
    monkeypatch.setattr(compilations, "_LONG_SECONDS", -1.0)
    release_after_compiling()
    jax.jit(lambda x: x + 31)(1.0)
    assert released


@pytest.mark.skipif(sys.platform != "linux", reason="of the GNU C library")
def test_the_c_library_has_the_function():
    assert compilations._malloc_trim()(0) in (0, 1)
