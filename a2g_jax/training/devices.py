"""The devices of a training: parameters are the same on each, and the clips of a batch are shared among them.

One mesh with one axis, over the devices of all processes. The program is that of one device: losses are means over the
whole batch and random numbers are drawn for it, and XLA divides the work (GSPMD), so results differ by rounding only.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import jax
import numpy as np
from jax.sharding import Mesh, NamedSharding, PartitionSpec
from jaxtyping import Int

from a2g_jax.errors import InputError
from a2g_jax.training.processes import arrays_of_first

_AXIS = "clips"


class Devices:
    """The devices of a training, of all processes."""

    def __init__(self, devices: Sequence[jax.Device]) -> None:
        self.count = len(devices)
        # One device has no mesh, and the program that it has always had.
        self._mesh = None if self.count == 1 else Mesh(np.array(devices), (_AXIS,))

    def jit_options(self) -> dict[str, Any]:
        """Arguments of ``jax.jit`` for a function whose results are the same on every device."""
        return {} if self._mesh is None else {"out_shardings": self._everywhere}

    @property
    def _everywhere(self) -> NamedSharding:
        assert self._mesh is not None
        return NamedSharding(self._mesh, PartitionSpec())

    @property
    def _shared(self) -> NamedSharding:
        assert self._mesh is not None
        return NamedSharding(self._mesh, PartitionSpec(_AXIS))

    def copies(self, tree: Any) -> Any:
        """Arrays that every process has, on every device."""
        if self._mesh is None:
            return tree
        return jax.tree.map(self._copy, tree)

    def first_copies(self, tree: Any) -> Any:
        """The arrays of the first process, on every device of every process."""
        if self._mesh is None:
            return tree
        plain = jax.tree.map(lambda array: jax.random.key_data(array) if _is_key(array) else array, tree)
        copied = self.copies(arrays_of_first(jax.device_get(plain)))
        wrap = jax.jit(jax.random.wrap_key_data, out_shardings=self._everywhere)
        return jax.tree.map(lambda before, array: wrap(array) if _is_key(before) else array, tree, copied)

    def _copy(self, array: Any) -> jax.Array:
        host = np.asarray(array)
        return jax.make_array_from_callback(host.shape, self._everywhere, lambda index: host[index])

    def divided(self, clips: Mapping[str, Any]) -> dict[str, Any]:
        """Within a jitted function: arrays of a batch, each device with its own clips."""
        if self._mesh is None:
            return dict(clips)
        return {name: jax.lax.with_sharding_constraint(clip, self._shared) for name, clip in clips.items()}

    def rows(self, batch: int) -> Int[np.ndarray, " rows"]:
        """The clips of a batch that belong to the devices of this process."""
        if self._mesh is None:
            return np.arange(batch)
        slices = self._shared.addressable_devices_indices_map((batch,)).values()
        return np.sort(np.concatenate([np.arange(batch)[index] for index in slices]))

    def shard(self, clips: Mapping[str, Any], batch: int) -> dict[str, Any]:
        """Arrays of a batch from the clips of this process (:meth:`rows`), each device with its own."""
        if self._mesh is None:
            return dict(clips)
        return {
            name: jax.make_array_from_process_local_data(self._shared, clip, (batch, *clip.shape[1:]))
            for name, clip in clips.items()
        }

    def host(self, tree: Any) -> Any:
        """Arrays that are the same on every device, as those of one."""
        return tree if self._mesh is None else jax.device_get(tree)


def _is_key(array: Any) -> bool:
    return isinstance(array, jax.Array) and jax.dtypes.issubdtype(array.dtype, jax.dtypes.prng_key)


def find_devices(request: int | str | None, batch: int) -> Devices:
    """The devices of a training.

    Args:
        request: their number, ``"all"``, or None for one in a single process and all in several.
        batch: clips in a batch.

    Raises:
        InputError: there are fewer, several processes have others, or the batch cannot be divided among them.
    """
    present = jax.devices()
    count = len(present) if request == "all" or (request is None and jax.process_count() > 1) else int(request or 1)
    if count > len(present):
        kind = present[0].platform.upper()
        raise InputError(
            f"--devices {count}: there {'is' if len(present) == 1 else 'are'} {len(present)} ({kind}); name fewer, or"
            " 'all'."
        )
    if jax.process_count() > 1 and count != len(present):
        raise InputError(
            f"--devices {count}: the {jax.process_count()} processes have {len(present)} together, and use all; leave"
            " it out."
        )
    if batch % count:
        fitting = [str(number) for number in range(1, count) if batch % number == 0]
        raise InputError(
            f"--batch-size {batch}: cannot be divided among {count} devices; choose a multiple of {count}, such as"
            f" {-(-batch // count) * count}, or --devices {' or '.join(fitting)}."
        )
    return Devices(present[:count])
