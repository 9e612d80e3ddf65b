"""eSpeak NG through ctypes: flat speech of a clause with the times of its phonemes and words."""

import ctypes
import shutil
import sys
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError

_SYNCHRONOUS = 2
_PHONEME_EVENTS, _IPA, _RETURN_ERRORS = 0x1, 0x2, 0x8000
_RATE, _VOLUME, _PITCH, _RANGE = 1, 2, 3, 4  # numbers of the parameters
_NO_CLIPPING = 50  # of the usual volume, 100
_UTF8, _BY_CHARACTER = 1, 1
_END, _WORD, _PHONEME = 0, 1, 7  # kinds of events
_SLOWEST, _FASTEST = 80, 350  # words a minute: outside, the durations no longer follow

_LOCK = threading.Lock()


class _Name(ctypes.Union):
    _fields_ = [("number", ctypes.c_int), ("name", ctypes.c_char_p), ("text", ctypes.c_char * 8)]


class _Event(ctypes.Structure):
    _fields_ = [
        ("kind", ctypes.c_int),
        ("identifier", ctypes.c_uint),
        ("character", ctypes.c_int),
        ("length", ctypes.c_int),
        ("milliseconds", ctypes.c_int),
        ("sample", ctypes.c_int),
        ("user", ctypes.c_void_p),
        ("value", _Name),
    ]


_Callback = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.POINTER(ctypes.c_short), ctypes.c_int, ctypes.POINTER(_Event))


@dataclass(frozen=True)
class Phoneme:
    """One phoneme of an utterance."""

    ipa: str
    """Symbol, without marks of stress."""
    stress: int
    """0 none, 1 secondary, 2 primary."""
    start: float
    """Seconds; it ends where the next one starts."""
    character: int
    """Where in the text its word starts."""


@dataclass(frozen=True)
class Utterance:
    """A clause as the library speaks it."""

    audio: Float[np.ndarray, " N"]
    """Full scale 1."""
    sample_rate: int
    phonemes: tuple[Phoneme, ...]
    end: float
    """Where the last phoneme ends, seconds."""
    words: tuple[tuple[int, float], ...]
    """Of each word: its first character, and where it starts in seconds (stops: with their closure)."""


def library_version() -> str:
    """Version of the installed library, such as ``"eSpeak NG 1.52.0"``.

    Raises:
        InputError: the extra ``voices`` is missing, or its library cannot be loaded.
    """
    with espeak() as library:
        return library.version


class Espeak:
    """A freshly loaded library; see :func:`espeak`."""

    def __init__(self, library: Any, data: str) -> None:
        self._library = library
        self._samples: list[np.ndarray] = []
        self._events: list[tuple[int, int, int, bytes]] = []
        self._callback = _Callback(self._receive)
        options = _PHONEME_EVENTS | _IPA | _RETURN_ERRORS
        self.sample_rate: int = library.espeak_Initialize(_SYNCHRONOUS, 0, data.encode(), options)
        if self.sample_rate <= 0:
            raise InputError(f"eSpeak NG cannot read its data in {data}; reinstall: {_INSTALL}")
        library.espeak_SetSynthCallback(self._callback)
        library.espeak_Info.restype = ctypes.c_char_p
        self.version = "eSpeak NG " + library.espeak_Info(None).decode()

    def _receive(self, samples: Any, count: int, events: Any) -> int:
        if samples and count > 0:
            self._samples.append(np.ctypeslib.as_array(samples, (count,)).copy())
        index = 0
        while events[index].kind != _END:
            event = events[index]
            if event.kind in (_WORD, _PHONEME):
                name = bytes(event.value.text) if event.kind == _PHONEME else b""
                self._events.append((event.kind, event.character - 1, event.sample, name))
            index += 1
        return 0

    def speak(self, text: str, voice: str, rate: float, pitch: int = 50) -> Utterance:
        """One clause on one pitch, without intonation.

        Args:
            text: a clause, with its punctuation.
            voice: a language and a variant, such as ``"en-gb+m3"``.
            rate: words a minute, as the library counts them.
            pitch: 0 to 100 between the lowest and the highest pitch of the voice.

        Raises:
            InputError: the library lacks the voice.
        """
        library = self._library
        self._samples, self._events = [], []
        if library.espeak_SetVoiceByName(voice.encode()) != 0:
            raise InputError(f"{self.version} has no voice {voice!r}; update it: {_INSTALL}")
        library.espeak_SetParameter(_RATE, int(np.clip(round(rate), _SLOWEST, _FASTEST)), 0)
        library.espeak_SetParameter(_PITCH, pitch, 0)
        library.espeak_SetParameter(_RANGE, 0, 0)
        library.espeak_SetParameter(_VOLUME, _NO_CLIPPING, 0)
        encoded = text.encode()
        library.espeak_Synth(encoded, len(encoded) + 1, 0, _BY_CHARACTER, 0, _UTF8, None, None)
        audio = np.concatenate(self._samples or [np.zeros(0, np.int16)]).astype(np.float32) / 32768.0
        return _utterance(audio, self.sample_rate, self._events)


def _utterance(
    audio: Float[np.ndarray, " N"], sample_rate: int, events: list[tuple[int, int, int, bytes]]
) -> Utterance:
    """Events in seconds; unnamed phonemes are pauses, of which those at the end are left out."""
    phonemes: list[Phoneme] = []
    words: list[tuple[int, float]] = []
    character, end = 0, None
    for kind, position, sample, name in events:
        moment = sample / sample_rate
        if kind == _WORD:
            character = position
            words.append((position, moment))
            continue
        symbol = name.split(b"\0")[0].decode("utf-8", "ignore")
        ipa = symbol.strip("ˈˌ-").replace(":", "ː")
        if ipa:
            stress = 2 if "ˈ" in symbol else 1 if "ˌ" in symbol else 0
            phonemes.append(Phoneme(ipa, stress, moment, character))
            end = None
        elif end is None:
            end = moment
    end = len(audio) / sample_rate if end is None else end
    return Utterance(audio, sample_rate, tuple(phonemes), end, tuple(words))


_INSTALL = "pip install 'a2g_jax[voices]'"


def _locate() -> tuple[Path, str]:
    try:
        loader = import_module("espeakng_loader")
    except ImportError as error:
        raise InputError(f"real languages need eSpeak NG: {_INSTALL}") from error
    return Path(loader.get_library_path()), loader.get_data_path()


@contextmanager
def espeak() -> Iterator[Espeak]:
    """A library whose state is that of a new process; other threads wait.

    Its noise, the phase of its pitch and its parameters depend on everything it has spoken, and initialising it again
    does not reset them. So a copy of its file is loaded, which shares nothing with one that is loaded already, here or
    by another package.

    Raises:
        InputError: the extra ``voices`` is missing, or its library cannot be loaded.
    """
    source, data = _locate()
    with _LOCK, tempfile.TemporaryDirectory(prefix="a2g_voices_", ignore_cleanup_errors=True) as folder:
        copy = shutil.copy(source, Path(folder) / source.name)
        try:
            library = ctypes.CDLL(str(copy))
        except OSError as error:
            raise InputError(f"{source}: cannot be loaded ({error}); reinstall: {_INSTALL}") from error
        try:
            yield Espeak(library, data)
        finally:
            _unload(library)


def _unload(library: Any) -> None:
    library.espeak_Terminate()
    system = import_module("_ctypes")
    if sys.platform == "win32":
        system.FreeLibrary(library._handle)
    else:
        system.dlclose(library._handle)
