"""What mined features hold: linear probes of word onsets and of the emotion, and the two headers of the audio encoder.

    python -m experiments.emotion_gesture.mining --corpus CORPUS [--budget MINUTES]

Runs are those of Table III, so that only rows with the authors' header are trained anew. Untrained rows have initial
weights.
"""

from dataclasses import replace
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float

from a2g_jax.data.batch import clip_shape, gather_clips, gather_from_disk
from a2g_jax.data.batches import BatchMaker, tiled_starts
from a2g_jax.data.corpus import Corpus
from a2g_jax.models.emotion_gesture.networks import Networks
from a2g_jax.training.run import Run
from experiments.emotion_gesture.page import show
from experiments.emotion_gesture.scores import cell
from experiments.emotion_gesture.settings import FULL, TINY, ours, paper, scaled
from experiments.emotion_gesture.table import Table, parser, setting_of
from experiments.emotion_gesture.table3 import WHOLE
from experiments.tables.claims import Claim
from experiments.tables.records import append, records
from experiments.tables.ruler import Ruler, measure
from experiments.tables.runs import run_table
from experiments.tables.setting import Setting
from experiments.tables.training import described

#: Clips of one call; training recordings that probes are fitted to; frames of them for onsets; steps of the solver.
_BATCH, _FITTED, _FRAMES, _STEPS = 16, 60, 12_000, 400

ALIGNED, CHANNELS = "the paper's parts", "the paper's parts with the authors' header"
OURS = "tiny"
UNTRAINED = "untrained"

VARIANTS = {
    ALIGNED: FULL,
    CHANNELS: paper(header="channels", vae_steps=TINY.vae_steps),
    OURS: replace(ours(), steps=WHOLE),
}

CLAIMS = (
    *(
        Claim(f"{what} is lower with time in place than with the authors' header", ALIGNED, CHANNELS, key, -1)
        for what, key in (("held-out reconstruction", "reconstruction"), ("the loss of beat alignment", "beat_loss"))
    ),
    Claim("onsets are found better in beat features with time in place", ALIGNED, CHANNELS, "onset_beat", 1),
)

TABLE = Table(
    "mining",
    "What emotion and beat features hold, and the header of the audio encoder",
    VARIANTS,
    ("reconstruction", "beat_loss", "own_accuracy", "onset_beat", "onset_emotion", "emotion_beat", "emotion_emotion"),
    CLAIMS,
    notes=(
        "Logistic regressions, fitted to features of training recordings and scored on test recordings: whether a word"
        " starts within a frame (area under the ROC curve; chance 0.5), and the emotion of a clip from the mean and the"
        " deviation of features, and that of their changes, over its frames (mean share over emotions). With `tiny`,"
        " emotion features are constant in a clip and beat features have mean 0 and standard deviation 1 in it, so that"
        " a part of the difference is by construction; with the paper's parts it is learned.",
    ),
)


class Probed(NamedTuple):
    """Features of clips, and what probes look for."""

    beat: Float[np.ndarray, "N T D"]
    emotion: Float[np.ndarray, "N T D"]
    onsets: Bool[np.ndarray, "N T"]
    labels: np.ndarray


def mined(name: str, run: Run, ruler: Ruler, seed: int) -> dict[str, Any]:
    """Scores of the probes and held-out losses."""
    del name
    corpus = ruler.corpus
    networks = Networks(run.config.model_config, run.config.data())
    encode = jax.jit(lambda params, audio: networks.encode_audio(params, audio))
    fit, test = (_features(run, corpus, split, encode) for split in ("train", "test"))
    found = {
        "onset_beat": onset_auc(fit.beat, fit.onsets, test.beat, test.onsets, seed),
        "onset_emotion": onset_auc(fit.emotion, fit.onsets, test.emotion, test.onsets, seed),
        "emotion_beat": emotion_share(fit.beat, fit.labels, test.beat, test.labels),
        "emotion_emotion": emotion_share(fit.emotion, fit.labels, test.emotion, test.labels),
        **held_out(run, corpus, seed),
    }
    return {"clips": len(test.beat), "scores": {key: cell(value) for key, value in found.items()}}


def _features(run: Run, corpus: Corpus, split: str, encode: Any) -> Probed:
    frames = run.config.model_config.clip_frames
    starts = tiled_starts(corpus, split, frames)
    chosen = np.unique(np.searchsorted([entry.first for entry in corpus.recordings], starts, side="right"))
    kept = chosen[:: max(1, len(chosen) // _FITTED)] if split == "train" else chosen
    own = np.searchsorted([entry.first for entry in corpus.recordings], starts, side="right")
    starts = starts[np.isin(own, kept)]
    parts: dict[str, list[np.ndarray]] = {"beat": [], "emotion": []}
    for first in range(0, len(starts), _BATCH):
        rows = starts[np.minimum(np.arange(first, first + _BATCH), len(starts) - 1)]
        audio = np.stack([corpus.audio[row : row + frames] for row in rows])
        features = encode(run.params, jnp.asarray(run.config.statistics["audio"].normalise(audio), jnp.float32))
        kept_rows = len(starts) - first
        parts["beat"].append(np.asarray(features.beat)[:kept_rows])
        parts["emotion"].append(np.asarray(features.emotion)[:kept_rows])
    onsets = np.stack([np.asarray(corpus.array("word_starts")[row : row + frames]) for row in starts])
    return Probed(np.concatenate(parts["beat"]), np.concatenate(parts["emotion"]), onsets, corpus.labels[starts, 0])


def onset_auc(fit, fit_onsets, test, test_onsets, seed: int) -> float:
    """Area under the ROC curve of a linear probe of word onsets, frame by frame."""
    from sklearn.metrics import roc_auc_score

    width = fit.shape[-1]
    rows, wanted = fit.reshape(-1, width), fit_onsets.reshape(-1)
    chosen = np.random.default_rng(seed).permutation(len(rows))[:_FRAMES]
    probe, scale = _probe(rows[chosen], wanted[chosen])
    return float(roc_auc_score(test_onsets.reshape(-1), probe.decision_function(scale(test.reshape(-1, width)))))


def emotion_share(fit, fit_labels, test, test_labels) -> float:
    """Mean over emotions of the share of clips whose emotion a linear probe finds."""
    from sklearn.metrics import balanced_accuracy_score

    probe, scale = _probe(_over_clip(fit), fit_labels)
    return float(balanced_accuracy_score(test_labels, probe.predict(scale(_over_clip(test)))))


def _over_clip(features: Float[np.ndarray, "N T D"]) -> Float[np.ndarray, "N _"]:
    """Mean and standard deviation of features and standard deviation of their changes over a clip's frames."""
    return np.concatenate([features.mean(axis=1), features.std(axis=1), np.diff(features, axis=1).std(axis=1)], axis=-1)


def _probe(rows: Float[np.ndarray, "n D"], labels: np.ndarray) -> tuple[Any, Any]:
    """A logistic regression on standardised features with equally weighted classes."""
    from sklearn.linear_model import LogisticRegression

    mean, deviation = rows.mean(axis=0), rows.std(axis=0) + 1e-6
    scale = lambda values: (values - mean) / deviation  # noqa: E731
    return LogisticRegression(C=0.1, max_iter=_STEPS, class_weight="balanced").fit(scale(rows), labels), scale


def held_out(run: Run, corpus: Corpus, seed: int) -> dict[str, float]:
    """Losses on test clips, and the share of them whose emotion the model's own classifier finds."""
    config, model = run.config, run.config.build()
    loss = next(stage for stage in model.stages if stage.name == "main").validation_loss
    assert loss is not None
    shape = clip_shape(model.batch_fields, model.clip_frames, corpus.fps, corpus.mel.sample_rate)
    arrays = {name: corpus.array(name) for name in shape.arrays}
    maker, measured = BatchMaker(config.statistics["audio"], 0.0), jax.jit(loss)
    starts, found = tiled_starts(corpus, "test", model.clip_frames), []
    for first in range(0, len(starts) - _BATCH + 1, _BATCH):
        clips = gather_clips(arrays, shape, starts[first : first + _BATCH], gather_from_disk)
        _, terms = measured(run.params, jax.random.key(seed), maker(None, clips), jnp.int32(0))
        found.append({name: float(value) for name, value in terms.items()})
    names = {"reconstruction": "reconstruction", "beat": "beat_loss", "emotion_accuracy": "own_accuracy"}
    return {
        to: float(np.mean([one[name] for one in found])) for name, to in names.items() if found and name in found[0]
    }


def untrained(where: Setting) -> None:
    """Score the initial weights of the rows' networks, once for each seed."""
    ruler, measured = measure(TABLE.name, where)
    for seed in where.seeds:
        for name in (ALIGNED, OURS):
            fields = {"variant": f"{name}, {UNTRAINED}", "seed": seed, **measured, "steps": 0}
            if any(all(record.get(key) == value for key, value in fields.items()) for record in records(TABLE.name)):
                continue
            _, config = described(name, VARIANTS[name], VARIANTS, seed, ruler.corpus, where)
            params = config.build().init(jax.random.key(seed))
            append(TABLE.name, {**fields, **mined(name, Run(config, params, {}, 0), ruler, seed)})


def main() -> None:
    """Train and score what is missing, and render the table."""
    options = parser(TABLE.title).parse_args()
    if options.corpus is not None:
        where = replace(setting_of(options), judge=None, features=None)
        untrained(where)
        only = options.only.split(",") if options.only else None
        run_table(TABLE.name, scaled(VARIANTS, where.steps), where, only, mined, "probes")
    show(TABLE)


if __name__ == "__main__":
    main()
