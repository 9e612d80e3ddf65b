"""Whole steps of a training: clips are chosen, gathered, augmented and learned from."""

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Int, Key

from a2g_jax.compilations import release_after_compiling
from a2g_jax.data.batch import ClipShape, gather, gather_clips, gather_from_disk
from a2g_jax.data.batches import BatchMaker, Crops, crops_in, draw_others, draw_starts
from a2g_jax.data.on_demand import Part
from a2g_jax.geometry.mirror_poses import pose_mirror
from a2g_jax.training.devices import Devices
from a2g_jax.training.run_config import RunConfig
from a2g_jax.training.stages import StageSpan
from a2g_jax.training.state import Metrics, TrainState, advance, step_keys

#: A whole step of training.
Step = Callable[[TrainState], tuple[TrainState, Metrics]]


class Steps:
    """Steps on the parts of a corpus; parts with recordings of the same lengths share compiled programs."""

    def __init__(self, config: RunConfig, shape: ClipShape, devices: Devices) -> None:
        self._config, self._shape, self._devices = config, shape, devices
        self._programs: dict[tuple[Any, ...], Callable[[Part], Step]] = {}
        self._last: tuple[StageSpan, Part, Step] | None = None

    def of(self, span: StageSpan, part: Part) -> Step:
        """The step of a stage on a part; kept until another one is requested."""
        if self._last is None or self._last[0] is not span or self._last[1] is not part:
            crops = crops_in(part.segments, self._shape.frames, "the longest recording of a part")
            key = (span.stage.name, *(np.asarray(array).tobytes() for array in crops))
            if key not in self._programs:
                self._programs[key] = step_programs(span, self._shape, crops, self._config, self._devices)
            self._last = None  # frees the part before, before the next one is put on the device
            self._last = span, part, self._programs[key](part)
        return self._last[2]


def step_programs(
    span: StageSpan, shape: ClipShape, crops: Crops, config: RunConfig, devices: Devices | None = None
) -> Callable[[Part], Step]:
    """A function from parts to whole steps: choose clips, augment, compute, update; the same for data on disk.

    Args:
        devices: which share the clips of a batch; the first one alone if None.
    """
    release_after_compiling()
    settings = config.train_config
    devices = devices or Devices(jax.devices()[:1])
    mirror_pose = pose_mirror(config.space) if settings.mirror > 0 else None
    make_batch = BatchMaker(config.statistics["audio"], settings.augmentation, settings.mirror, mirror_pose)

    def finish(state: TrainState, clips: dict[str, Any]) -> tuple[TrainState, Metrics]:
        _, augment_key, model_key = step_keys(state.key, state.step)
        return advance(span, state, make_batch(augment_key, devices.divided(clips)), model_key)

    def starts(run_key: Key[Array, ""], step: Int[Array, ""]):
        key = step_keys(run_key, step)[0]
        chosen = draw_starts(key, crops, settings.batch_size)
        return chosen, draw_others(jax.random.fold_in(key, 0), crops, chosen) if shape.paired else None

    @partial(jax.jit, donate_argnums=0, **devices.jit_options())
    def on_device(state: TrainState, arrays: dict[str, Any]):
        chosen, others = starts(state.key, state.step)
        return finish(state, gather_clips(arrays, shape, chosen, gather, others))

    choose = jax.jit(starts)
    compute = jax.jit(finish, donate_argnums=0, **devices.jit_options())
    mine = devices.rows(settings.batch_size)

    def on(part: Part) -> Step:
        size = sum(array.nbytes for array in part.arrays.values()) / 1e6
        # Rows of the device are counted in 32 bits.
        if size <= settings.device_megabytes and max(len(array) for array in part.arrays.values()) < 2**31:
            arrays = {name: np.asarray(array) for name, array in part.arrays.items()}
            placed = jax.tree.map(jax.device_put, arrays) if devices.count == 1 else devices.copies(arrays)
            return lambda state: on_device(state, placed)

        def read(key: Key[Array, ""], step: int) -> dict[str, Any]:
            chosen, others = jax.tree.map(lambda rows: np.asarray(rows)[mine], choose(key, jnp.int32(step)))
            return gather_clips(part.arrays, shape, chosen, gather_from_disk, others)

        ahead = _Ahead(read, span.stop)
        return lambda state: compute(state, devices.shard(ahead(state), settings.batch_size))

    return on


class _Ahead:
    """Clips of one step after another; a thread reads those of the next step during the computation of this one.

    The clips of a step are a function of the run's key and the number of the step, so there is no position to store:
    a run that resumes at a step reads that step's clips.
    """

    def __init__(self, read: Callable[[Key[Array, ""], int], dict[str, Any]], stop: int) -> None:
        """
        Args:
            read: clips of a step, given the run's key.
            stop: step after the last one.
        """
        self._read, self._stop = read, stop
        self._reader = ThreadPoolExecutor(1, thread_name_prefix="clips")
        self._key: Key[Array, ""] | None = None
        self._step = 0
        self._next: Future[dict[str, Any]] | None = None

    def __call__(self, state: TrainState) -> dict[str, Any]:
        """The clips of the state's step.

        Args:
            state: at any step on the first call, one step further on each later one.
        """
        if self._key is None:
            # Of one device, also where the state is on several.
            self._key = jax.random.wrap_key_data(jnp.asarray(np.asarray(jax.random.key_data(state.key))))
            self._step = int(state.step)
        clips = self._read(self._key, self._step) if self._next is None else self._next.result()
        self._step += 1
        self._next = None
        if self._step < self._stop:
            self._next = self._reader.submit(self._read, self._key, self._step)
        return clips
