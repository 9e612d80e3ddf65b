"""What every test shares: strict JAX, two devices, keys, and the real recordings where they are."""

import contextlib
import ctypes
import gc
import os
from importlib.metadata import version
from pathlib import Path

# Before JAX starts. Two virtual devices find sharding mistakes. Compilation is most of the time of the suite: compiled
# quickly rather than well, programs take a tenth of it. XLA aborts on unknown flags, and JAX 0.12 lacks the last one.
_FLAGS = ["--xla_force_host_platform_device_count=2", "--xla_backend_optimization_level=0"]
if version("jaxlib").startswith("0.10."):
    _FLAGS += ["--xla_cpu_parallel_codegen_split_count=1", "--xla_cpu_use_fusion_emitters=false"]
os.environ.setdefault("XLA_FLAGS", " ".join(_FLAGS))
os.environ.setdefault("JAX_PLATFORMS", "cpu")
# One compilation cache serves the session: each training is a new function to JAX though the program is the same.
_CACHE = Path(__file__).parents[1] / ".cache" / "jax"
os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", str(_CACHE))
os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0.2")

import jax
import pytest
from jaxtyping import install_import_hook

jax.config.update("jax_numpy_rank_promotion", "raise")
# Annotations are checked in every call of what computes arrays in compiled programs. Everywhere, with
# A2G_CHECKED=a2g_jax, these checks take a fifth of the suite's time, most of it in small functions of files and names.
_GEOMETRY = ("kinematics", "pose_space", "rotation", "smooth")
_CHECKED = [f"a2g_jax.{name}" for name in ("features", "generation", "metrics", "models", "nn", "training")]
_CHECKED += [f"a2g_jax.geometry.{name}" for name in _GEOMETRY]
_HOOK = install_import_hook(os.environ.get("A2G_CHECKED", "").split() or _CHECKED, "beartype.beartype")

# Tracing makes many small objects beside a large heap: at Python's thresholds, a third of it is the search for cycles.
gc.set_threshold(20_000, 10, 10)

#: Memory of a worker, bytes, up to which compiled programs are always kept, and from which they are always dropped; in
#: between, where it is more than the worker's part of half of what was free.
_KEPT, _DROPPED = 2.5e9, 6e9
#: What it may grow by until they are dropped again, where the allocator keeps the memory of dropped programs.
_GROWTH = 0.5e9
#: Mapped regions from which they are dropped as well: programs have several each, and Linux allows 65 530.
_MOST_REGIONS = 50_000


def _resident() -> float:
    """Memory of this process, bytes; zero where the system does not state it."""
    statm = Path("/proc/self/statm")
    return int(statm.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") if statm.exists() else 0.0


def _regions() -> int:
    """Mapped regions of this process; zero where the system does not list them."""
    maps = Path("/proc/self/maps")
    return len(maps.read_bytes().splitlines()) if maps.exists() else 0


@pytest.fixture(scope="session")
def memory_limit():
    """Memory at which programs are dropped next; one number in a list, as it rises."""
    free = 0.0
    if (info := Path("/proc/meminfo")).exists():
        free = 1024.0 * int(info.read_text().split("MemAvailable:")[1].split()[0])
    workers = int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", 1))
    return [min(max(_KEPT, free / (2 * workers)), _DROPPED)]


@pytest.fixture(autouse=True, scope="module")
def bounded_memory(memory_limit):
    """Drops compiled programs between modules where memory has grown much; the cache on disk has the large ones.

    To drop them is dear: the modules after it compile anew what they share, and the search for cycles takes a second.
    """
    yield
    if _resident() > memory_limit[0] or (_resident() > _KEPT and _regions() > _MOST_REGIONS):
        jax.clear_caches()
        gc.collect()
        with contextlib.suppress(OSError, AttributeError):  # not glibc
            ctypes.CDLL(None).malloc_trim(0)
        memory_limit[0] = max(memory_limit[0], _resident() + _GROWTH)


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


@pytest.fixture(scope="session")
def toy_corpus(tmp_path_factory):
    """Six generated recordings of ten seconds at 30 fps."""
    from a2g_jax.data.corpus import Corpus
    from a2g_jax.data.corpus_writer import prepare_recording, write_corpus
    from a2g_jax.data.settings import Features
    from a2g_jax.talker.recordings import talk

    features = Features()
    rows = (prepare_recording(talk(10.0, seed, name=f"take{seed}"), features) for seed in range(6))
    path = tmp_path_factory.mktemp("toy") / "corpus"
    write_corpus(path, rows, features=features, recipe={"reader": "talker"})
    return Corpus.open(path)


@pytest.fixture(scope="session")
def shared_programs(toy_corpus):
    """Trainings of Audio2Gestures on the toy corpus with one description share their compiled programs."""
    from tests.shared_programs_for_tests import share_programs

    with pytest.MonkeyPatch.context() as patch:
        share_programs(patch, toy_corpus.fingerprint)
        yield


@pytest.fixture(scope="session")
def toy_run_config(toy_corpus, shared_programs):
    """A run of a very small Audio2Gestures on the toy corpus; keyword arguments change its training settings.

    Its learning rate is constant, so that trainings of any number of steps have one program.
    """
    import dataclasses

    from a2g_jax.models import find_model
    from a2g_jax.models.train_config import TRAIN_PRESETS
    from a2g_jax.training.run import RunConfig
    from tests.toy_model_for_tests import TOY_MODEL

    def make(**changes):
        model = dataclasses.replace(find_model("audio2gestures").presets["tiny"], **TOY_MODEL)
        settings = {"steps": 30, "batch_size": 4, "checkpoint_every": 10, "validate_every": 15, "log_every": 5}
        settings |= {"schedule": "constant", "warmup_steps": 2, "learning_rate": 3e-3, **changes}
        training = dataclasses.replace(TRAIN_PRESETS["tiny"], **settings)
        return RunConfig.of("audio2gestures", "tiny", model, training, toy_corpus)

    return make


@pytest.fixture(scope="session")
def toy_run(toy_corpus, toy_run_config, tmp_path_factory):
    """The folder of a run with the settings of ``toy_run_config()``; tests that change it copy it."""
    from a2g_jax.training.loop import train

    folder = tmp_path_factory.mktemp("toy_run") / "run"
    train(toy_run_config(), toy_corpus, folder, resume=False, progress=False)
    return folder
