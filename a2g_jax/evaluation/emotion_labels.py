"""Emotions of a data set's recordings by a classifier of audio, window by window (EmotionGesture, Sec. IV-A2)."""

import json
import os
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from a2g_jax.data.batch import Batch
from a2g_jax.data.datasets import Take, find_data_set
from a2g_jax.data.emotion_table import COLUMNS, WindowLabel, table_lines
from a2g_jax.data.featurise import Skipped
from a2g_jax.data.prepare import make_rows, read_take
from a2g_jax.errors import InputError, Interrupted
from a2g_jax.features.mel import MelConfig, log_mel
from a2g_jax.io.files import atomic_path, sha256_file
from a2g_jax.progress import say
from a2g_jax.training.run import Run, load_run
from a2g_jax.training.run_file import WEIGHTS_FILE

#: Windows that are classified at once.
_BATCH = 64


@dataclass(frozen=True, eq=False)
class AudioClassifier:
    """A trained classifier of emotions in audio."""

    run: Run
    fingerprint: str
    """SHA-256 of its weights."""

    @property
    def emotions(self) -> tuple[str, ...]:
        """Its classes."""
        return tuple(self.run.config.corpus["emotions"])

    @property
    def window(self) -> int:
        """Frames of a window."""
        frames: int = self.run.config.model_config.clip_frames
        return frames

    @cached_property
    def _probabilities(self) -> Any:
        config = self.run.config
        classifier = config.build().classifier
        assert classifier is not None

        def probabilities(params: Any, audio: Any) -> Any:
            pose = jnp.zeros((*audio.shape[:2], *config.space.shape))
            rows = config.statistics["audio"].normalise(audio)
            return jax.nn.softmax(classifier.logits(params, Batch(rows, pose)))

        return jax.jit(probabilities)

    def probabilities(self, audio: Float[np.ndarray, "N T bands"]) -> Float[np.ndarray, "N K"]:
        """Probability of each emotion in windows of log-mel rows, in batches of one shape."""
        count = len(audio)
        padded = np.zeros((-(-count // _BATCH) * _BATCH, *audio.shape[1:]), np.float32)
        padded[:count] = audio
        parts = [
            np.asarray(self._probabilities(self.run.params, padded[start : start + _BATCH]))
            for start in range(0, len(padded), _BATCH)
        ]
        rows: Float[np.ndarray, "N K"] = np.concatenate([np.zeros((0, len(self.emotions)), np.float32), *parts])[:count]
        return rows


def load_audio_classifier(folder: str | os.PathLike[str]) -> AudioClassifier:
    """Load a run of ``emotion_classifier`` that takes audio.

    Raises:
        InputError: another model, or one that takes motion.
    """
    run = load_run(folder)
    classifier = run.config.build().classifier
    if classifier is None or classifier.input != "audio":
        raise InputError(
            f"{folder}: is no classifier of emotions in audio; train one with 'a2g train emotion_classifier --input"
            " audio'."
        )
    return AudioClassifier(run, sha256_file(Path(folder) / WEIGHTS_FILE))


def window_labels(
    classifier: AudioClassifier, name: str, audio: Float[np.ndarray, "T bands"], stride: int
) -> list[WindowLabel]:
    """The most probable emotion of each window of a recording; none where it is shorter than a window.

    Args:
        name: of the recording.
        audio: its log-mel rows, as the classifier's corpus has them.
        stride: frames from one window to the next.
    """
    frames, fps = classifier.window, classifier.run.config.fps
    starts = np.arange(0, len(audio) - frames + 1, stride)
    if len(starts) == 0:
        return []
    rows = classifier.probabilities(audio[starts[:, None] + np.arange(frames)[None]])
    return [
        WindowLabel(
            name,
            float(start / fps),
            float((start + frames) / fps),
            classifier.emotions[int(np.argmax(row))],
            float(np.max(row)),
        )
        for start, row in zip(starts, rows, strict=True)
    ]


def label_data_set(
    name: str,
    source: str | os.PathLike[str],
    classifier: AudioClassifier,
    out: str | os.PathLike[str],
    *,
    stride: int | None = None,
    skip_broken: bool = False,
    limit: int | None = None,
    workers: int | None = None,
    report: Callable[[str], None] = say,
) -> Counter[str]:
    """Write a table of emotions (:mod:`a2g_jax.data.emotion_table`) of a data set's recordings; windows by emotion.

    Interruptible: the recordings done so far are in a hidden file beside the table, and the same call resumes.

    Args:
        name: of the data set, as for :func:`~a2g_jax.data.datasets.find_data_set`.
        source: its folder.
        stride: frames from one window to the next; half a window if None.
        skip_broken: leave out recordings that cannot be read.
        limit: largest number of recordings, spread evenly over all.
        workers: processes that read; one for every core if None.
        report: called with a line for the user about anything noteworthy.

    Raises:
        InputError: the table exists, the source has another layout, or a recording cannot be read.
        Interrupted: by Ctrl-C; the same call resumes.
    """
    out, folder, config = Path(out), Path(source), classifier.run.config
    if out.exists():
        raise InputError(f"{out}: exists already; choose another name or remove it.")
    if not out.parent.is_dir():
        raise InputError(f"{out.parent}: there is no such folder; make it, or choose another name for the table.")
    takes = find_data_set(name).find(folder)
    if limit is not None and limit < len(takes):
        takes = [takes[number * len(takes) // limit] for number in range(limit)]
    stride = stride or max(1, classifier.window // 2)
    settings = {"data set": name, "source": os.fspath(source), "classifier": classifier.fingerprint, "stride": stride}
    settings |= {"limit": limit, "skip broken": skip_broken}
    unfinished = out.with_name(f".{out.name}.unfinished")
    lines = _finished(unfinished, settings, takes)
    if lines:
        report(f"{out}: resuming after {len(lines)} of {len(takes)} recordings")
    read = partial(_audio_rows, name=name, mel=config.mel, fps=config.fps, skip_broken=skip_broken)
    done = len(lines)
    try:
        with atomic_path(unfinished) as temporary:
            temporary.write_text("".join(json.dumps(line) + "\n" for line in (settings, *lines)), encoding="utf-8")
        with (
            unfinished.open("a", encoding="utf-8") as file,
            closing(make_rows("labelling", read, takes, workers, done)) as rows,
        ):
            for take, audio in zip(takes[done:], rows, strict=True):
                labels: list[WindowLabel] = []
                if isinstance(audio, Skipped):
                    report(f"skipped: {audio.reason}")
                else:
                    labels = window_labels(classifier, take.name, audio, stride)
                line = {"name": take.name, "labels": labels}
                file.write(json.dumps(line) + "\n")
                file.flush()
                lines.append(line)
    except KeyboardInterrupt:
        raise Interrupted(
            f"{out}: stopped after {len(lines)} of {len(takes)} recordings; run the same command to resume."
        ) from None
    found = [WindowLabel(*label) for line in lines for label in line["labels"]]
    if not found:
        seconds = classifier.window / config.fps
        raise InputError(f"{folder}: no recording is as long as a window of {seconds:g} s; nothing to label.")
    _write(out, found)
    unfinished.unlink()
    return Counter(label.emotion for label in found)


def _write(out: Path, labels: Sequence[WindowLabel]) -> None:
    with atomic_path(out) as temporary:
        temporary.write_text(",".join(COLUMNS) + "\n" + table_lines(labels), encoding="utf-8")


def _finished(path: Path, settings: dict[str, Any], takes: Sequence[Take]) -> list[dict[str, Any]]:
    """Lines of unfinished work with the same settings, in the order of the takes, up to the first damaged one."""
    if not path.is_file():
        return []
    found: list[Any] = []
    for text in path.read_text(encoding="utf-8", errors="replace").splitlines():
        try:
            found.append(json.loads(text))
        except ValueError:  # killed while it was written
            break
    if not found or found[0] != settings:
        return []
    lines = []
    for line, take in zip(found[1:], takes, strict=False):
        if not isinstance(line, dict) or line.get("name") != take.name or not isinstance(line.get("labels"), list):
            break
        lines.append(line)
    return lines


def _audio_rows(
    take: Take, name: str, mel: MelConfig, fps: float, skip_broken: bool
) -> Float[np.ndarray, "T bands"] | Skipped:
    """Log-mel rows of a recording."""
    try:
        recording = read_take(take, name, mel.sample_rate)
    except InputError as error:
        if not skip_broken:
            raise
        return Skipped(take.name, take.sources, str(error))
    # As many rows as a corpus of the recording has.
    seconds = min(len(recording.audio) / mel.sample_rate, recording.motion.seconds)
    return log_mel(recording.audio, mel, fps, round(seconds * fps))
