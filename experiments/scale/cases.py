"""The papers' presets, each on a small generated corpus of the poses and features that it takes."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Case:
    """A preset, and the corpus that it is measured on."""

    model: str
    preset: str
    features: str
    view: str = "body"
    changes: dict[str, Any] = field(default_factory=dict)
    """Settings of the model; a perceptual loss needs a trained network, and is left out."""

    @property
    def name(self) -> str:
        return f"{self.model} {self.preset}"


CASES = (
    Case("audio2gestures", "paper", "audio2gestures"),
    Case("speech2gesture", "paper", "audio2gestures"),
    Case("stylized_flow", "paper", "stylized-flow", changes={"perceptual_weight": 0.0}),
    Case("stylized_flow", "ted", "stylized-flow-ted", "ted", changes={"perceptual_weight": 0.0}),
    Case("stylized_flow", "moglow", "stylized-flow"),
    Case("emotion_gesture", "paper", "emotion-gesture", "beat"),
)


def corpus_of(case: Case, folder: Path) -> Any:
    """The corpus of a case; made where it is absent."""
    from a2g_jax.data.corpus import Corpus
    from a2g_jax.data.generated import TalkerOptions
    from a2g_jax.data.prepare import prepare_talker
    from a2g_jax.data.settings import find_features

    path, features = folder / f"{case.features}_{case.view}", find_features(case.features)
    if path.exists():
        return Corpus.open(path)
    # Fewer than five recordings are split in time, and every split has a part of each.
    options = TalkerOptions(minutes=2.0, view=case.view, fps=features.fps)
    return prepare_talker(path, options, features, workers=1)


def run_config(case: Case, corpus: Any, batch: int | None = None) -> Any:
    """The description of the training; with other batches than the preset's on request."""
    from a2g_jax.models import find_model
    from a2g_jax.training.run import RunConfig

    entry = find_model(case.model)
    settings = entry.training_preset(case.preset)
    settings = settings if batch is None else replace(settings, batch_size=batch)
    model = replace(entry.presets[case.preset], **case.changes)
    return RunConfig.of(case.model, case.preset, model, settings, corpus)


def steps_of(config: Any, corpus: Any) -> Any:
    """Stages of a training, its initial state (shapes), and a function from a stage to a whole step."""
    import jax

    from a2g_jax.data.batch import clip_shape
    from a2g_jax.data.on_demand import Part
    from a2g_jax.training.devices import Devices
    from a2g_jax.training.stages import stage_spans
    from a2g_jax.training.steps import Steps

    model, settings = config.build(), config.train_config
    shape = clip_shape(model.batch_fields, model.clip_frames, corpus.fps, corpus.mel.sample_rate)
    part = Part({name: corpus.array(name) for name in shape.arrays}, corpus.segments("train"))
    spans = stage_spans(model, settings)
    steps = Steps(config, shape, Devices(jax.devices()[:1]))
    return model, spans, lambda span: steps.of(span, part)
