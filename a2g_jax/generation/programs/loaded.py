"""Exported programs of a run, loaded and run without the code of its model."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jax
import numpy as np
from jax import export as jax_export
from jaxtyping import Float
from safetensors.numpy import load_file

from a2g_jax.errors import InputError
from a2g_jax.features.dynamics import Dynamics, rows_with_dynamics
from a2g_jax.features.mel import log_mel
from a2g_jax.features.samples import mono_samples
from a2g_jax.features.statistics import Statistics
from a2g_jax.generation.planting import planted
from a2g_jax.generation.programs import manifest as files
from a2g_jax.generation.programs.manifest import Manifest, check_flatbuffers
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.pose_rows import rotations_from_rows

#: Inputs that may be left out, and their value then.
_FREE = {"controls": np.nan}


class Programs:
    """The programs of a folder, ready to run; samples and seeds are those of the run."""

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        """
        Raises:
            InputError: a folder without programs, or with damaged ones.
        """
        check_flatbuffers()
        folder = Path(folder)
        self.manifest = Manifest.read(folder)
        self.manifest.check_files(folder)
        arrays = load_file(folder / files.WEIGHTS)
        named = (files.STATISTICS, files.DYNAMICS)
        self._weights = jax.device_put({name: part for name, part in arrays.items() if not name.startswith(named)})
        self._statistics = {
            name: Statistics(arrays[f"{files.STATISTICS}{name}/mean"], arrays[f"{files.STATISTICS}{name}/std"])
            for name in ("audio", "pose", "root")
        }
        gains = {
            name.removeprefix(files.DYNAMICS): part for name, part in arrays.items() if name.startswith(files.DYNAMICS)
        }
        self._dynamics = Dynamics.of(gains) if gains else None
        self._programs = {name: _program(folder / name) for name in self.manifest.programs}

    def generate(self, audio: Any, samples: int, seed: int = 0, **given: Any) -> Iterator[Motion]:
        """Yield motions for mono samples at ``manifest.mel.sample_rate``.

        Args:
            audio: (N,), from -1 to 1.
            given: further inputs of the window program, such as ``emotion``: with a row for each frame of the motion.

        Raises:
            InputError: audio with NaN, of several channels or shorter than a frame, a seed outside 0 to 2**32 - 1, or
                inputs that are missing or that the programs do not have.
        """
        about, audio = self.manifest, mono_samples(audio)
        frames = round(len(audio) / about.mel.sample_rate * about.fps)
        if frames == 0:
            raise InputError(f"the audio is {len(audio)} samples long, less than a frame; give a longer one.")
        mean_pose = about.space.mean_rotations(self._statistics["pose"].mean)
        for rows in self.rows(log_mel(audio, about.mel, about.fps, frames), samples, seed, **given):
            rotations = rotations_from_rows(rows, about.space.kind)
            yield planted(rotations, about.space.skeleton, about.fps, self._statistics["root"].mean, mean_pose)

    def rows(self, features: Any, samples: int, seed: int = 0, **given: Any) -> Iterator[Float[np.ndarray, "T R D"]]:
        """Yield motions in the run's pose space, for log-mel features, one row a frame, not normalised.

        Raises:
            InputError: as :meth:`generate`.
        """
        if not 0 <= seed < 2**32:
            raise InputError(f"seed: expected 0 to {2**32 - 1}; got {seed}.")
        frames, lanes = len(features), self.manifest.lanes
        windows = list(self._windows(features, given))
        for first in range(0, samples, lanes):
            common = {"seed": np.uint32(seed), "numbers": first + np.arange(lanes, dtype=np.uint32)}
            state: dict[str, Any] = {}
            if files.BEGIN in self._programs:
                seeds = {name: given[name] for name in ("seed_poses",) if name in given}
                state = self._programs[files.BEGIN](self._weights, common | seeds)
            parts = []
            for window in windows:
                state = dict(self._programs[files.WINDOW](self._weights, common | window | state))
                parts.append(np.asarray(state.pop("pose")))
            for rows in np.concatenate(parts, axis=1)[: samples - first, :frames]:
                if self._dynamics is not None:
                    rows = rows_with_dynamics(self.manifest.space, rows, self._dynamics, self.manifest.fps)
                yield rows

    def _windows(self, features: Any, given: dict[str, Any]) -> Iterator[dict[str, Any]]:
        """Inputs of each window: features with context, silent before and after the audio; others with their ends
        repeated."""
        about = self.manifest
        inputs = about.programs[files.WINDOW]["inputs"]
        own = {"audio", "seed", "numbers", "start"}
        expected = {name for name in inputs if name not in own and not name.startswith(files.STATE)}
        for name in expected & _FREE.keys() - given.keys():
            given = {**given, name: np.full((len(features), *inputs[name].shape[1:]), _FREE[name])}
        if set(given) != expected:
            raise InputError(
                f"expected {', '.join(sorted(expected)) or 'nothing'} besides the audio; got"
                f" {', '.join(sorted(given)) or 'nothing'}."
            )
        frames, long = len(features), about.window + 2 * about.halo
        count = -(-frames // about.window)
        around = (about.halo, count * about.window - frames + about.halo)
        padded = np.pad(features, (around, (0, 0)), constant_values=float(np.min(features)))
        by_frame = {"audio": np.asarray(self._statistics["audio"].normalise(padded), np.float32)}
        constant: dict[str, Any] = {}
        for name, value in given.items():
            port = inputs[name]
            value = np.asarray(value, port.dtype)
            if port.shape[:1] != (long,):
                constant[name] = value
            elif len(value) != frames:
                raise InputError(f"{name}: expected a row for each of {frames} frames; got {len(value)}.")
            else:
                rest = [(0, 0)] * (value.ndim - 1)
                by_frame[name] = np.pad(value, [around, *rest], mode="constant" if name == "words" else "edge")
        for start in range(0, count * about.window, about.window):
            yield {
                "start": np.int32(start - about.halo),
                **constant,
                **{name: value[start : start + long] for name, value in by_frame.items()},
            }


def _program(path: Path) -> Any:
    """A program, compiled on first use.

    Raises:
        InputError: a program that this version of JAX does not read, or for other devices.
    """
    try:
        exported = jax_export.deserialize(bytearray(path.read_bytes()))
    except Exception as error:  # noqa: BLE001 - of any kind, from native code
        raise InputError(f"{path}: cannot be read by JAX {jax.__version__} ({error}); export the run again.") from None
    own = jax.devices()[0].client.platform
    if not {own, jax.default_backend()} & set(exported.platforms):
        raise InputError(f"{path}: runs on {', '.join(exported.platforms)}; this machine has {own}.")
    return jax.jit(exported.call)
