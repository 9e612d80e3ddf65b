"""A batch of clips, and the table of corpus arrays that its fields are gathered from."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import jax
import numpy as np
from jaxtyping import Array, Bool, Float, Int, Shaped

from a2g_jax.io.stored_array import StoredArray


class Batch(NamedTuple):
    """B clips of T frames; the fields that a model does not declare are None, audio and poses are always there."""

    audio: Float[Array, "B T bands"]
    """Normalised audio features."""
    pose: Float[Array, "B T R D"]
    """Poses in the corpus's pose space, not normalised; in 6D the first two columns of each local rotation."""
    emotion: Int[Array, " B"] | None = None
    """Index into :attr:`a2g_jax.models.base.Data.emotions`."""
    speaker: Int[Array, " B"] | None = None
    """Index into :attr:`a2g_jax.models.base.Data.speakers`."""
    words: Int[Array, "B T"] | None = None
    """Id of the word that is spoken at each frame (:func:`a2g_jax.io.words.word_id`); 0 where there is none."""
    word_starts: Bool[Array, "B T"] | None = None
    """Whether a word starts within each frame."""
    waveform: Float[Array, "B samples"] | None = None
    """The audio itself, from -1 to 1: ``round(T * sample_rate / fps)`` samples."""
    other_pose: Float[Array, "B T R D"] | None = None
    """Poses of another clip of the same recording: of the same speaker, at another place."""
    mirrored: Bool[Array, " B"] | None = None
    """Whether left and right of a clip's poses are exchanged; None without that augmentation."""


#: Arrays of a corpus or a part by name: a row a frame, and ``waveform`` with a row a sample.
Arrays = Mapping[str, Any]
#: A slice of each clip: :func:`gather` or :func:`gather_from_disk`.
Gather = Callable[[Any, Any, int], Any]


class Field(NamedTuple):
    """How a field of a batch is gathered from the arrays of a corpus."""

    kind: str
    """``frames``: a slice of the clip's frames; ``others``: the same of another clip of the recording; ``label``: the
    value at the clip's first frame; ``samples``: a slice of samples, which begins where the second array says."""
    arrays: tuple[str, ...]
    """Names of :meth:`a2g_jax.data.corpus.Corpus.array`."""


#: Where each field of a batch comes from.
FIELDS: dict[str, Field] = {
    "audio": Field("frames", ("audio",)),
    "pose": Field("frames", ("pose",)),
    "emotion": Field("label", ("emotion",)),
    "speaker": Field("label", ("speaker",)),
    "words": Field("frames", ("words",)),
    "word_starts": Field("frames", ("word_starts",)),
    "waveform": Field("samples", ("waveform", "waveform_start")),
    "other_pose": Field("others", ("pose",)),
}


class ClipShape(NamedTuple):
    """Which fields clips have, and how long they are; static under jit."""

    fields: tuple[str, ...]
    frames: int
    samples: int = 0
    """Of a waveform."""

    @property
    def arrays(self) -> tuple[str, ...]:
        """Names of the corpus arrays that these fields are gathered from."""
        return tuple(dict.fromkeys(name for field in self.fields for name in FIELDS[field].arrays))

    @property
    def paired(self) -> bool:
        """Whether any field is of another clip of the same recording."""
        return any(FIELDS[field].kind == "others" for field in self.fields)


def clip_shape(fields: tuple[str, ...], frames: int, fps: float, sample_rate: int) -> ClipShape:
    """The shape of a model's clips.

    Raises:
        ValueError: a field that does not exist.
    """
    unknown = set(fields) - set(FIELDS)
    if unknown:
        raise ValueError(f"expected fields among {', '.join(FIELDS)}; got {', '.join(sorted(unknown))}")
    # Audio and poses are always there, first.
    ordered = ("audio", "pose", *(name for name in fields if name not in ("audio", "pose")))
    return ClipShape(ordered, frames, round(frames * sample_rate / fps))


def gather_clips(
    arrays: Arrays, shape: ClipShape, starts: Int[Any, " B"], take: Gather, others: Int[Any, " B"] | None = None
) -> dict[str, Any]:
    """Raw fields of the clips that begin at the given rows.

    Args:
        arrays: those that ``shape.arrays`` names.
        take: :func:`gather` for arrays on the device, :func:`gather_from_disk` for others.
        others: first rows of other clips of the same recordings; needed where ``shape.paired``.
    """
    clips: dict[str, Any] = {}
    for name in shape.fields:
        field = FIELDS[name]
        first, *rest = (arrays[array] for array in field.arrays)
        if field.kind == "frames":
            clips[name] = take(first, starts, shape.frames)
        elif field.kind == "others":
            clips[name] = take(first, others, shape.frames)
        elif field.kind == "label":
            clips[name] = first[starts]
        else:
            clips[name] = take(first, rest[0][starts], shape.samples)
    return clips


def gather(
    array: Shaped[Array | np.ndarray, "N *rest"], starts: Int[Array | np.ndarray, " B"], frames: int
) -> Shaped[Array, "B T *rest"]:
    """Clips of an array that lies on the device."""
    return jax.vmap(lambda start: jax.lax.dynamic_slice_in_dim(array, start, frames))(starts)


def gather_from_disk(
    array: Shaped[np.ndarray | StoredArray, "N *rest"], starts: Int[np.ndarray, " B"], frames: int
) -> Shaped[np.ndarray, "B T *rest"]:
    """Clips of an array that is too large for the device; the last ones of an array begin early enough to fit."""
    last = len(array) - frames
    return np.stack([array[min(int(start), last) : min(int(start), last) + frames] for start in starts])
