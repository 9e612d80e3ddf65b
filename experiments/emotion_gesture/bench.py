"""Test clips continued from their own first poses, as EmotionGesture is trained: 10 given poses, 50 generated ones.

Only generated frames are scored, all rows on the same ones. Models without seed poses generate the whole clip.
"""

from dataclasses import dataclass
from functools import cached_property

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from a2g_jax.data.corpus import Corpus
from a2g_jax.errors import InputError
from a2g_jax.evaluation.baselines import right_motions
from a2g_jax.evaluation.emotion_judge import EmotionJudge
from a2g_jax.generation.continuation import continue_clips
from a2g_jax.metrics import beats
from a2g_jax.training.run import Run
from experiments.tables.ruler import Ruler

#: Frames of a clip, as the paper cuts them, and the first generated one.
CLIP, FIRST = 60, 10
MADE = CLIP - FIRST
#: Frames of audio of a clip: autoregressive models read ahead.
_READ = CLIP + MADE
#: Maximum number of scored clips, evenly spread over the test split. FGD needs more than features.
MOST = 420

#: Rows without training.
TRUTH, RIGHT, OTHER = "truth", "another right motion", "another clip's motion"
HELD, MEAN = "first pose held", "mean pose"
NULLS = (TRUTH, RIGHT, OTHER, HELD, MEAN)

Made = Float[np.ndarray, "N samples frames R D"]


@dataclass(frozen=True, eq=False)
class Bench:
    """The clips of a test split with what they are scored against."""

    ruler: Ruler
    most: int = MOST

    def __post_init__(self) -> None:
        """Refuse networks whose clips do not tile the generated frames."""
        for option, network in (("--features", self.ruler.network), ("--judge", self.ruler.judge)):
            frames = MADE if network is None else network.run.config.model_config.clip_frames
            if MADE % frames:
                raise InputError(
                    f"{option}: is of clips of {frames} frames, which do not tile the {MADE} generated ones; train it"
                    f" with --clip-frames {MADE}."
                )
        if self.ruler.judge is not None:
            check_independent(self.ruler.judge, self.corpus)

    @property
    def corpus(self) -> Corpus:
        """The corpus."""
        return self.ruler.corpus

    @cached_property
    def starts(self) -> Int[np.ndarray, " N"]:
        """First rows of the clips."""
        rows = [
            row
            for segment in self.corpus.segments("test")
            for row in range(segment.start, segment.stop - _READ + 1, CLIP)
        ]
        if not rows:
            raise InputError(f"{self.corpus.path}: its test split has no stretch of {_READ} frames.")
        return np.array(rows)[np.unique(np.linspace(0, len(rows) - 1, min(self.most, len(rows))).round().astype(int))]

    @cached_property
    def recordings(self) -> Int[np.ndarray, " N"]:
        """Number of each clip's recording."""
        firsts = np.array([entry.first for entry in self.corpus.recordings])
        return np.searchsorted(firsts, self.starts, side="right") - 1

    @cached_property
    def emotions(self) -> list[str]:
        """Emotion of each clip."""
        return [self.corpus.recordings[number].emotion for number in self.recordings]

    def audio(self, starts: Int[np.ndarray, " N"]) -> Float[np.ndarray, "N T bands"]:
        """Audio features from these rows on."""
        return np.stack([self.corpus.audio[start : start + _READ] for start in starts])

    @cached_property
    def pose(self) -> Float[np.ndarray, "N T R D"]:
        """Recorded poses, the given ones included."""
        return np.stack([self.corpus.pose[start : start + CLIP] for start in self.starts])

    @cached_property
    def places(self) -> Float[np.ndarray, "N T P _"]:
        """Recorded positions, the given poses' included."""
        return positions(self.corpus, self.pose)

    @cached_property
    def onsets(self) -> list[Float[np.ndarray, " n"]]:
        """Onsets of the speech within the scored frames, seconds."""
        audio = self.audio(self.starts)
        return [beats.mel_onsets(one[FIRST:CLIP], self.corpus.fps) for one in audio]

    def generate(self, run: Run, samples: int, seed: int, shuffled: bool = False) -> Made:
        """Motions of a run for every clip.

        Args:
            shuffled: whether clips have the audio and the emotion of a clip of another recording, but their own poses.
        """
        starts = np.roll(self.starts, len(self.starts) // 2) if shuffled else self.starts
        pose = np.concatenate([self.pose, np.repeat(self.pose[:, -1:], _READ - CLIP, axis=1)], axis=1)
        labels = own_emotions(run, self.corpus, starts)
        return continue_clips(run, self.audio(starts), pose, FIRST, CLIP, samples, seed, labels)

    def null(self, name: str, seed: int) -> Made | None:
        """Motions that no model made; None where the corpus has no such ones."""
        inner = self.pose[:, FIRST:]
        if name == TRUTH:
            return inner[:, None]
        if name == RIGHT:
            return self._right(seed)
        if name == OTHER:
            return np.roll(inner, len(inner) // 2, axis=0)[:, None]
        if name == HELD:
            return np.broadcast_to(self.pose[:, FIRST - 1 : FIRST], inner.shape)[:, None]
        mean = np.asarray(self.corpus.space.valid(jnp.asarray(self.corpus.statistics["pose"].mean)))
        return np.broadcast_to(mean, inner.shape)[:, None]

    def _right(self, seed: int) -> Made | None:
        """Other right motions, drawn from the talker; they do not continue the clips' own poses."""
        found = {}
        for segment in self.corpus.segments("test"):
            inside = [int(start) for start in self.starts if segment.start <= start < segment.stop]
            motions = right_motions(self.corpus, segment, self.ruler.samples, seed) if inside else []
            if motions is None:
                return None
            for start in inside:
                rows = slice(start - segment.start + FIRST, start - segment.start + CLIP)
                found[start] = np.stack([motion[rows] for motion in motions])
        return np.stack([found[int(start)] for start in self.starts])


def own_emotions(run: Run, corpus: Corpus, starts: Int[np.ndarray, " N"]) -> Float[np.ndarray, "N T E"] | None:
    """Weights of the clips' emotions for models that take them; None for others."""
    if "emotion" not in run.config.build().condition_fields:
        return None
    names = list(run.config.corpus["emotions"])
    own = [names.index(corpus.emotions[number]) for number in corpus.labels[starts, 0]]
    return np.repeat(np.eye(len(names), dtype=np.float32)[own][:, None], _READ, axis=1)


def positions(corpus: Corpus, pose: Float[np.ndarray, "*batch T R D"]) -> Float[np.ndarray, "*batch T P _"]:
    """Positions of clips."""
    flat = corpus.space.positions(np.ascontiguousarray(pose, np.float32).reshape(-1, *pose.shape[-2:]))
    return flat.reshape(*pose.shape[:-2], *flat.shape[-2:])


def check_independent(judge: EmotionJudge, corpus: Corpus) -> None:
    """Refuse a judge that was trained on recordings of the corpus.

    Raises:
        InputError: it was.
    """
    about = judge.run.config.corpus
    theirs = {role["seed"] for role in about.get("recipe", {}).get("roles", ())}
    own = {role["seed"] for role in corpus.recipe.get("roles", ())}
    if about.get("fingerprint") == corpus.fingerprint or theirs & own:
        raise InputError(
            f"--judge: was trained on recordings of {corpus.path}; train it on a corpus of another --seed, so that it"
            " is independent."
        )
