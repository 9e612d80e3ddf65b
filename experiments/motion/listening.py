"""The listening audit of a run on speeches of the table."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from a2g_jax.evaluation.audit import AudioCondition, listening_audit
from a2g_jax.generation.generator import Generator, speech_features
from a2g_jax.training.run import Run
from experiments.motion.speeches import SAMPLE_RATE, Speech

#: Number of speeches, their length in seconds, and the number of seeds.
CLIPS, SECONDS, SEEDS = 8, 30.0, 4


def audit(run: Run, speeches: Sequence[Speech], seed: int, report: Callable[[], None] = lambda: None) -> dict[str, Any]:
    """Verdicts, and the changes of the motion in cm under each condition.

    Args:
        report: called after each condition of a speech.
    """
    generator, space = Generator(run), run.config.space
    if "waveform" in generator.engine.model.condition_fields:
        return {"skipped": "takes waveforms, but the audit alters audio features"}
    chosen = speeches[:CLIPS]
    clips = [speech_features(run, speech.audio[: round(SECONDS * SAMPLE_RATE)]) for speech in chosen]
    latest: dict[int, Any] = {}

    def generate(audio: AudioCondition, number: int) -> np.ndarray:
        # Seeds follow one another for one condition: they are the samples of one call, which serves all of them.
        if id(audio) not in latest:
            latest.clear()
            rows = generator.rows(np.asarray(audio.features, np.float32), SEEDS, seed)
            latest[id(audio)] = (audio, [space.wrists(space.positions(row)) for row in rows])
            report()
        made: np.ndarray = latest[id(audio)][1][number]
        return made

    found = listening_audit(generate, clips, [speech.speaker for speech in chosen], run.config.fps, SEEDS)
    changes = {name: row["change_cm"] for name, row in found["conditions"].items()}
    return {"verdicts": found["verdicts"], "sampling_cm": found["sampling_cm"], "changes_cm": changes}
