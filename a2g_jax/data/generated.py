"""Recordings of the generated corpus as rows; the same arguments give the same rows in any process."""

from dataclasses import asdict, dataclass, replace
from typing import Any, TypeAlias

import numpy as np

from a2g_jax.data.featurise import Prepared, prepare_recording
from a2g_jax.data.settings import Features
from a2g_jax.errors import InputError
from a2g_jax.talker.emotions import VOICE_EMOTIONS
from a2g_jax.talker.languages import INVENTED, LANGUAGE_NAMES
from a2g_jax.talker.recordings import cast, talk
from a2g_jax.talker.speakers import SPEAKERS
from a2g_jax.talker.views.capture import add_jitter
from a2g_jax.talker.views.catalogue import find_view
from a2g_jax.talker.voices.library import library_version

#: Arguments of :func:`~a2g_jax.talker.recordings.talk` for one recording.
Role: TypeAlias = dict[str, Any]

# Beside the streams that talk() splits a recording's seed into.
_JITTER = 1000


@dataclass(frozen=True)
class TalkerOptions:
    """Settings of a generated corpus."""

    minutes: float = 30.0
    seed: int = 0
    fps: float = 30.0
    speakers: tuple[str, ...] = ()
    """Some of :data:`~a2g_jax.talker.speakers.SPEAKERS`; empty for all."""
    emotions: tuple[str, ...] = ()
    """Some of :data:`~a2g_jax.talker.emotions.VOICE_EMOTIONS`; empty for all."""
    jitter: float = 0.0
    """Degrees of capture noise: see :func:`~a2g_jax.talker.views.capture.add_jitter`."""
    fingers: bool = False
    """The 52 joints with fingers instead of the 22 body joints."""
    view: str = "body"
    """Data set whose format the recordings have: see :data:`~a2g_jax.talker.views.catalogue.VIEWS`."""
    languages: tuple[str, ...] = ()
    """Some of :data:`~a2g_jax.talker.languages.LANGUAGE_NAMES`, in equal shares; empty for the invented one."""
    equal_emotions: bool = False
    """Emotions in equal shares; otherwise half of the recordings are neutral, as in BEAT."""

    def __post_init__(self) -> None:
        find_view(self.view)
        for flag, names, known in (
            ("speakers", self.speakers, SPEAKERS),
            ("emotions", self.emotions, VOICE_EMOTIONS),
            ("languages", self.languages, LANGUAGE_NAMES),
        ):
            unknown = [name for name in names if name not in known]
            if unknown:
                raise InputError(f"--{flag}: there is no {', '.join(unknown)}; there are: {', '.join(known)}.")
            if len(set(names)) < len(names):
                raise InputError(f"--{flag}: a name is repeated in {','.join(names)}; name each once.")
        if not 0.0 <= self.jitter <= 45.0:
            raise InputError(f"--jitter: expected degrees from 0 to 45; got {self.jitter:g}.")

    def recipe(self) -> dict[str, Any]:
        """Settings for the manifest; speakers and emotions by name even if all of them take part.

        Raises:
            InputError: the extra ``voices`` is missing, which real languages need.
        """
        recipe = {
            "reader": "talker",
            **asdict(self),
            "speakers": list(self.speakers or SPEAKERS),
            "emotions": list(self.emotions or VOICE_EMOTIONS),
        }
        # Recipes without languages and equal shares are those of versions that had none.
        del recipe["languages"]
        if not self.equal_emotions:
            del recipe["equal_emotions"]
        if self.languages:
            recipe["languages"] = list(self.languages)
        if set(self.languages) - {INVENTED}:
            recipe["synthesizer"] = library_version()
        return recipe

    def roles(self) -> list[Role]:
        """Arguments of each recording."""
        return cast(self.minutes, self.seed, self.speakers, self.emotions, self.languages, self.equal_emotions)


def check_synthesizer(recipe: dict[str, Any], path: Any) -> None:
    """Compare the installed library of real languages with the one that a corpus was made with.

    Args:
        recipe: of the corpus.
        path: of the corpus, for the message.

    Raises:
        InputError: another version, which would speak differently, or none.
    """
    made = recipe.get("synthesizer")
    if made is not None and (here := library_version()) != made:
        raise InputError(f"{path}: was spoken by {made}, here is {here}; install that version or prepare it again.")


def generate_rows(role: Role, jitter: float, fingers: bool, view: str, features: Features) -> Prepared:
    """One generated recording as rows."""
    chosen = find_view(view)
    recording = talk(**role, fps=features.fps, sample_rate=features.mel.sample_rate, fingers=fingers or chosen.fingers)
    if jitter > 0.0:
        rng = np.random.default_rng([role["seed"], _JITTER])
        recording = replace(recording, motion=add_jitter(recording.motion, jitter, rng))
    return prepare_recording(chosen.convert(recording, features.fps), replace(features, joints="all"))
