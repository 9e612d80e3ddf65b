"""Motions as NumPy archives, readable in Python without this package."""

import lzma
import math
import os
import struct
import tokenize
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from a2g_jax.errors import InputError
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.io.files import atomic_path, check_readable

#: Most bytes that are unpacked, those that any small file may unpack to, and how many for each byte of a larger one:
#: motion packs to half, zeros to a thousandth.
_LARGEST, _LEAST, _TIMES = 2 * 2**30, 2**28, 50
_LONGEST_HEADER = 65_536
#: Rows checked at once.
_ROWS = 65_536
# Exceptions of zipfile, its decompressors and numpy.lib.format for damaged bytes.
_DAMAGE = (
    zipfile.BadZipFile, zlib.error, lzma.LZMAError, tokenize.TokenError, struct.error, ArithmeticError, EOFError,
    IndexError, KeyError, MemoryError, OSError, RuntimeError, SyntaxError, TypeError, ValueError,
)  # fmt: skip


def write_motion_npz(path: str | os.PathLike[str], motion: Motion) -> None:
    """Write a motion as a compressed ``.npz`` archive, atomically.

    ======================  ============  ==================================================
    key                     shape         what
    ======================  ============  ==================================================
    ``rotations``           (T, J, 3, 3)  local rotation matrices, parent from joint
    ``root``                (T, 3)        world position of joint 0, metres
    ``positions``           (T, J, 3)     world positions of all joints, metres; not read back
    ``fps``                 ()            frames per second
    ``joint_names``         (J,)          text
    ``parents``             (J,)          index of each joint's parent, -1 for the root
    ``offsets``             (J, 3)        bones at rest in the parent's frame, metres
    ``end_joints``          (E,)          joints with an end site
    ``end_offsets``         (E, 3)        end sites in their joint's frame, metres
    ======================  ============  ==================================================

    Example:
        >>> import a2g_jax, numpy as np
        >>> a2g_jax.write_motion_npz("gesture.npz", a2g_jax.talk(2.0, seed=1).motion)
        >>> np.load("gesture.npz")["positions"].shape
        (60, 22, 3)

    Raises:
        InputError: another suffix, or a motion with NaN or infinities.
    """
    path = Path(path)
    if path.suffix.lower() != ".npz":
        raise InputError(f"{path}: not written: the suffix must be .npz.")
    skeleton = motion.skeleton
    arrays: dict[str, Any] = {
        "rotations": np.asarray(motion.rotations, np.float32),
        "root": np.asarray(motion.root, np.float32),
        "positions": np.asarray(motion.positions(), np.float32),
        "fps": np.asarray(motion.fps, np.float64),
        "joint_names": np.array(skeleton.names, np.str_),
        "parents": np.array(skeleton.parents, np.int32),
        "offsets": np.asarray(skeleton.offsets, np.float32),
        "end_joints": np.array([joint for joint, _ in skeleton.ends], np.int32),
        "end_offsets": np.array([end for _, end in skeleton.ends], np.float64).reshape(-1, 3),
    }
    for key, array in arrays.items():
        if array.dtype.kind == "f" and not np.all(np.isfinite(array)):
            raise InputError(f"{path}: not written: NaN or infinity in {key}.")
    with atomic_path(path) as temporary:
        np.savez_compressed(temporary, **arrays)


def read_motion_npz(path: str | os.PathLike[str]) -> Motion:
    """Read an archive of :func:`write_motion_npz`; ``end_joints`` and ``end_offsets`` may be missing.

    Raises:
        InputError: no such file, not an archive, damaged, or an array is missing or of the wrong shape or type.
    """
    path = check_readable(path, "an .npz motion")
    try:
        archive = zipfile.ZipFile(path)
    except _DAMAGE:
        raise InputError(f"{path}: is not an .npz archive, or is damaged; write it again.") from None
    with archive:
        # All headers are compared before any array is unpacked.
        claims = _Claims(path, archive)
        frames, joints = claims.shape("rotations", "f", (None, None, 3, 3))[:2]
        claims.shape("root", "f", (frames, 3))
        claims.shape("offsets", "f", (joints, 3))
        claims.shape("joint_names", "U", (joints,))
        claims.shape("parents", "iu", (joints,))
        claims.shape("fps", "fiu", ())
        tipped = "end_joints.npy" in archive.namelist()
        if tipped:
            (count,) = claims.shape("end_joints", "iu", (None,))
            claims.shape("end_offsets", "f", (count, 3))
        claims.check_total()
        rotations, root, offsets = (_floats(path, archive, key) for key in ("rotations", "root", "offsets"))
        names, parents = _array(path, archive, "joint_names"), _array(path, archive, "parents")
        fps = float(_array(path, archive, "fps"))
        ends: tuple[tuple[int, tuple[float, float, float]], ...] = ()
        if tipped:
            owners = _array(path, archive, "end_joints").tolist()
            tips = _floats(path, archive, "end_offsets", np.float64).tolist()
            ends = tuple((owner, (x, y, z)) for owner, (x, y, z) in zip(owners, tips, strict=True))
            if any(not 0 <= owner < joints for owner in owners):
                raise InputError(f"{path}: end_joints: expected numbers from 0 to {joints - 1}; write it again.")
    if frames == 0:
        raise InputError(f"{path}: rotations: expected at least one frame; got none.")
    if not (math.isfinite(fps) and fps > 0):
        raise InputError(f"{path}: fps: expected a positive number; got {fps}.")
    try:
        skeleton = Skeleton(
            offsets=offsets,
            names=tuple(str(name) for name in names),
            parents=tuple(int(parent) for parent in parents),
            ends=ends,
        )
    except ValueError as error:
        raise InputError(f"{path}: joint_names, parents: {' '.join(str(error).split())}") from None
    return Motion(rotations=rotations, root=root, skeleton=skeleton, fps=fps)


class _Claims:
    """What the headers of an archive's arrays say; numpy.load would allocate as much."""

    def __init__(self, path: Path, archive: zipfile.ZipFile) -> None:
        self._path, self._archive, self._total = path, archive, 0

    def shape(self, key: str, kinds: str, shape: tuple[int | None, ...]) -> tuple[int, ...]:
        """The shape in a header.

        Args:
            kinds: of numbers or text, as NumPy's ``dtype.kind``.
            shape: what it must be; None for any size.

        Raises:
            InputError: another shape or kind, or it differs from the size of the data.
        """
        path, archive = self._path, self._archive
        try:
            member = archive.getinfo(f"{key}.npy")
        except KeyError:
            raise InputError(f"{path}: has no array {key!r}; expected an archive as write_motion_npz makes.") from None
        try:
            with archive.open(member) as file:
                found, dtype = _header(file)
                claimed = math.prod(found) * dtype.itemsize
                fits = claimed >= 0 and file.tell() + claimed == member.file_size
        except _DAMAGE as error:
            raise InputError(f"{path}: {key}: is damaged ({_reason(error)}); write it again.") from None
        matches = len(found) == len(shape) and all(w is None or w == f for w, f in zip(shape, found, strict=True))
        if dtype.kind not in kinds or not matches:
            sizes = ", ".join("any" if size is None else str(size) for size in shape)
            kind = {"f": "floating-point numbers", "U": "text", "iu": "integers", "fiu": "a number"}[kinds]
            raise InputError(f"{path}: {key}: expected {kind} of shape ({sizes}); got {dtype} of shape {tuple(found)}.")
        if not fits:
            raise InputError(f"{path}: {key}: is damaged (its size differs from its header); write it again.")
        self._total += claimed
        return found

    def check_total(self) -> None:
        """Refuse more than :data:`_LARGEST` bytes, and small files that unpack to very many.

        Raises:
            InputError: they do.
        """
        size = self._path.stat().st_size
        most = min(_LARGEST, max(_LEAST, _TIMES * size))
        if self._total > most:
            raise InputError(
                f"{self._path}: its {size} bytes unpack to {self._total}; expected {most} at most. Cut the motion into"
                " shorter ones."
            )


def _floats(path: Path, archive: zipfile.ZipFile, key: str, dtype: type = np.float32) -> np.ndarray:
    array = _array(path, archive, key)
    with np.errstate(over="ignore"):  # values beyond float32 are found below
        array = array.astype(dtype, copy=False)
    for at in range(0, len(array), _ROWS):
        bad = np.argwhere(~np.isfinite(array[at : at + _ROWS]))
        if len(bad):
            place = ", ".join(str(int(index)) for index in (at + bad[0][0], *bad[0][1:]))
            raise InputError(f"{path}: {key}: expected finite numbers; got NaN or infinity at [{place}].")
    return array


def _array(path: Path, archive: zipfile.ZipFile, key: str) -> np.ndarray:
    try:
        with archive.open(f"{key}.npy") as file:
            return np.lib.format.read_array(file, allow_pickle=False, max_header_size=_LONGEST_HEADER)
    except _DAMAGE as error:
        raise InputError(f"{path}: {key}: is damaged ({_reason(error)}); write it again.") from None


def _header(file) -> tuple[tuple[int, ...], np.dtype]:
    version = np.lib.format.read_magic(file)
    if version not in ((1, 0), (2, 0)):
        raise ValueError(f"array format {version[0]}.{version[1]}")
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, _, dtype = read(file, max_header_size=_LONGEST_HEADER)
    if dtype.hasobject:
        raise ValueError("it contains Python objects")
    return shape, dtype


def _reason(error: BaseException) -> str:
    return " ".join(str(error).split())[:120] or type(error).__name__
