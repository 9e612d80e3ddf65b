"""Messages of ``/live``: the first one of a client, audio, and frames; docs/live.md describes them.

Nothing here waits or computes motion. What a client can get wrong is a :class:`Refusal`.
"""

import json
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from a2g_jax.errors import InputError
from a2g_jax.generation.live.rates import check_rate
from a2g_jax.geometry.motion import Motion

#: Version of the protocol, in the first message of the server.
VERSION = 1
#: Types of samples by the name of their encoding.
ENCODINGS: dict[str, np.dtype[Any]] = {"s16le": np.dtype("<i2"), "f32le": np.dtype("<f4")}
#: What frames are sent as.
REPLIES = ("json", "binary", "points")
#: Most characters of the text messages of a client.
TEXT_LIMIT = 16 * 1024
#: Close codes: a message that is not of the protocol, a limit, an unexpected error, too many clients.
MALFORMED, LIMITED, BROKEN, BUSY = 1007, 1008, 1011, 1013
#: Bytes of a reason in a close frame.
_REASON = 123
#: Header of binary frames: number of the first one, and how many there are.
_HEADER = np.dtype("<u4")


class Refusal(Exception):
    """A client's message that ends its connection."""

    def __init__(self, code: int, reason: str) -> None:
        super().__init__(reason)
        self.code, self.reason = code, " ".join(reason.split())

    @property
    def short(self) -> str:
        """The reason as it fits into a close frame."""
        raw = self.reason.encode()
        return raw.decode() if len(raw) <= _REASON else raw[: _REASON - 3].decode(errors="ignore") + "..."


@dataclass(frozen=True)
class Hello:
    """The first message of a client."""

    sample_rate: int
    """Of the samples that follow, Hz."""
    encoding: str = "s16le"
    """``s16le`` or ``f32le``."""
    channels: int = 1
    """Only 1."""
    reply: str = "json"
    """``json``, ``binary`` or ``points``."""
    seed: int = 0
    """Of everything random."""
    lookahead: float | None = None
    """Seconds of speech after its own that a frame waits for; None for the server's."""
    sampling: dict[str, Any] = field(default_factory=dict)
    """Sampling settings of the model, such as ``{"temperature": 0.8}``."""


def parse_hello(text: str) -> Hello:
    """The first message, checked.

    Raises:
        Refusal: not a JSON object, unknown fields, or a value out of range.
    """
    given = parse_object(text, "the first message")
    if given.pop("type", "hello") != "hello":
        raise Refusal(MALFORMED, 'the first message: expected {"type": "hello", ...}.')
    known = [one.name for one in fields(Hello)]
    for name in given:
        if name not in known:
            raise Refusal(MALFORMED, f"hello: unknown field {name[:40]!r}; it may have {', '.join(known)}.")
    if "sample_rate" not in given:
        raise Refusal(MALFORMED, "hello: sample_rate is missing, the samples per second, such as 48000.")
    rate, ahead = given["sample_rate"], given.get("lookahead")
    _check(type(rate) in (int, float), "sample_rate", "a number", rate)
    try:
        rate = check_rate(rate)
    except InputError as error:
        raise Refusal(MALFORMED, f"hello: {error}") from None
    encoding, channels = given.get("encoding", "s16le"), given.get("channels", 1)
    _check(isinstance(encoding, str) and encoding in ENCODINGS, "encoding", " or ".join(ENCODINGS), encoding)
    _check(type(channels) is int and channels == 1, "channels", "1; average yours", channels)
    reply, seed = given.get("reply", "json"), given.get("seed", 0)
    _check(isinstance(reply, str) and reply in REPLIES, "reply", " or ".join(REPLIES), reply)
    _check(type(seed) is int and 0 <= seed < 2**32, "seed", f"0 to {2**32 - 1}", seed)
    valid = ahead is None or (type(ahead) in (int, float) and 0 <= ahead <= 60)
    _check(valid, "lookahead", "0 to 60 seconds, or null", ahead)
    sampling = given.get("sampling", {})
    _check(isinstance(sampling, dict), "sampling", "an object of settings", sampling)
    return Hello(rate, encoding, 1, reply, seed, None if ahead is None else float(ahead), sampling)


def parse_object(text: str, what: str) -> dict[str, Any]:
    """A JSON object of a text message.

    Raises:
        Refusal: something else.
    """
    if len(text) > TEXT_LIMIT:
        raise Refusal(MALFORMED, f"{what}: more than {TEXT_LIMIT} characters.")
    try:
        value = json.loads(text, parse_constant=_no_constant)
    except (ValueError, RecursionError):
        raise Refusal(MALFORMED, f"{what}: expected a JSON object.") from None
    if not isinstance(value, dict):
        raise Refusal(MALFORMED, f"{what}: expected a JSON object; got a {type(value).__name__}.")
    return value


def checked_sampling(settings: Any, changes: dict[str, Any]) -> dict[str, Any]:
    """Sampling settings of a client with the types that the model's have.

    Args:
        settings: the run's own sampling settings, a dataclass.

    Raises:
        Refusal: an unknown name or another type.
    """
    own = {one.name: one for one in fields(settings)}
    found = {}
    for name, value in changes.items():
        if name not in own or own[name].metadata.get("measured"):
            allowed = [other for other in own if not own[other].metadata.get("measured")]
            raise Refusal(MALFORMED, f"sampling: no setting {name[:40]!r}; the run has {', '.join(allowed) or 'none'}.")
        found[name] = _typed(name, value, own[name].default)
    return found


def decode_audio(data: bytes, encoding: str) -> Float[np.ndarray, " N"]:
    """Samples from -1 to 1 of a binary message.

    Raises:
        Refusal: not whole samples, or NaN and infinities.
    """
    kind = ENCODINGS[encoding]
    if len(data) % kind.itemsize:
        raise Refusal(MALFORMED, f"audio: {len(data)} bytes are no whole number of {encoding} samples.")
    samples = np.frombuffer(data, kind)
    if kind.kind == "i":
        return samples.astype(np.float32) / np.float32(32768)
    if not np.isfinite(samples).all():
        raise Refusal(MALFORMED, f"audio: sample {int(np.argmin(np.isfinite(samples)))} is NaN or infinite.")
    # Far beyond full scale nothing is speech, and squares would overflow.
    return np.clip(samples, -8.0, 8.0).astype(np.float32)


def quaternions(motion: Motion) -> Float[np.ndarray, "T J 4"]:
    """Local rotations as unit quaternions x, y, z, w, with w not negative."""
    rotations = np.asarray(motion.rotations, np.float64)
    if not len(rotations):
        return np.zeros((*rotations.shape[:2], 4), np.float32)
    found = Rotation.from_matrix(rotations.reshape(-1, 3, 3)).as_quat(canonical=True)
    return found.reshape(*rotations.shape[:2], 4).astype(np.float32)


def frames_json(motion: Motion, first: int) -> str:
    """Frames as a JSON message."""
    roots, turns = np.asarray(motion.root), quaternions(motion)
    frames = [
        {
            "index": first + number,
            "time": round((first + number) / motion.fps, 6),
            "root": [round(float(value), 5) for value in root],
            "rotations": [[round(float(value), 6) for value in turn] for turn in rows],
        }
        for number, (root, rows) in enumerate(zip(roots, turns, strict=True))
    ]
    return json.dumps({"type": "frames", "frames": frames}, separators=(",", ":"))


def frames_binary(motion: Motion, first: int) -> bytes:
    """Frames as a binary message: the header, then for each frame root and rotations, float32, little-endian."""
    rows = np.concatenate(
        [np.asarray(motion.root), quaternions(motion).reshape(motion.frames, 4 * motion.skeleton.joints)], axis=1
    )
    return with_header(rows, first)


def with_header(rows: Float[np.ndarray, "T width"], first: int) -> bytes:
    """Rows of float32 after the number of the first frame and the number of frames, each an unsigned 32-bit number."""
    return np.array([first, len(rows)], _HEADER).tobytes() + rows.astype("<f4").tobytes()


def read_binary(data: bytes, width: int) -> tuple[int, Float[np.ndarray, "T width"]]:
    """The number of the first frame and the rows of a binary message."""
    first, frames = np.frombuffer(data[:8], _HEADER)
    return int(first), np.frombuffer(data[8:], "<f4").reshape(int(frames), width)


def _check(valid: bool, name: str, expected: str, value: Any) -> None:
    if not valid:
        raise Refusal(MALFORMED, f"hello: {name}: expected {expected}; got {str(value)[:40]!r}.")


def _typed(name: str, value: Any, default: Any) -> Any:
    if isinstance(default, tuple):
        if isinstance(value, list) and all(isinstance(one, str) for one in value):
            return tuple(value)
        raise Refusal(MALFORMED, f"sampling: {name}: expected a list of texts.")
    kinds: tuple[type, ...] = {bool: (bool,), str: (str,), float: (int, float)}.get(type(default), (int,))
    # NaN is not below anything; whole numbers beyond 32 bits fit no array.
    if type(value) not in kinds or not (isinstance(value, str) or abs(value) < 2**31):
        raise Refusal(MALFORMED, f"sampling: {name}: expected {' or '.join(kind.__name__ for kind in kinds)}.")
    return float(value) if isinstance(default, float) else value


def _no_constant(name: str) -> None:
    raise ValueError(name)
