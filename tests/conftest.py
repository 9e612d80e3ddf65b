"""What every test shares: strict JAX, two devices, keys, and the real recordings where they are."""

import os

# Before JAX starts: two virtual devices find sharding mistakes, and one compilation cache serves the whole session.
os.environ.setdefault("XLA_FLAGS", "--xla_force_host_platform_device_count=2")
os.environ.setdefault("JAX_PLATFORMS", "cpu")

from pathlib import Path

import jax
import pytest
from jaxtyping import install_import_hook

jax.config.update("jax_numpy_rank_promotion", "raise")
_HOOK = install_import_hook("a2g_jax", "beartype.beartype")


@pytest.fixture
def getkey():
    """A function that gives a new key each time, the same ones in every run."""
    count = 0

    def get():
        nonlocal count
        count += 1
        return jax.random.fold_in(jax.random.key(7), count)

    return get


@pytest.fixture
def x64():
    """Double precision for one test."""
    with jax.enable_x64(True):
        yield


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of small real recordings; the test is skipped where it is absent."""
    folder = Path(os.environ.get("A2G_SHARED_DATA", Path(__file__).parents[2] / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"no real recordings at {folder} (set A2G_SHARED_DATA to a folder of them)")
    return folder
