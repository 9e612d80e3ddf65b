"""Real languages beside the invented one: tempo, accents in the sound, emotions, speakers; and a picture of sentences.

    python -m experiments.talker.voices [--seconds 10] [--shuffles 200] [--seed 0]

Needs the extra ``voices``. Levels and pitches are of syllables' planned peaks, less the mean of their recording.
"""

import argparse
import time
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

from a2g_jax.talker.emotions import VOICE_EMOTIONS
from a2g_jax.talker.languages import INVENTED, LANGUAGE_NAMES, LANGUAGES
from a2g_jax.talker.recordings import talk
from a2g_jax.talker.speakers import SPEAKERS
from a2g_jax.talker.speech import SpeechPlan, plan_from_json
from experiments.talker import sound
from experiments.talker.common import Part, cast_evenly, parallel, run_part, table
from experiments.talker.emotions import judge

SHOWN = ("en", "de")
"""Languages of the picture."""
_NEAR = 0.03  # seconds around a peak in which the pitch is looked for


def measure(role: dict[str, Any]) -> dict[str, Any]:
    """Figures of one recording, its syllables' accents with level and pitch, and its statistics."""
    start = time.process_time()
    take = talk(**role)
    seconds = time.process_time() - start
    plan = plan_from_json(take.annotations["speech"])
    voice = sound.analyse(take.audio, take.sample_rate, quick=True)
    spoken = sum(phrase.end - phrase.start for phrase in plan.phrases)
    f0 = 12.0 * np.log2(voice.f0)
    rows = []
    for syllable in plan.syllables:
        frames = slice(*(int((syllable.peak + side) * sound.RATE) for side in (-_NEAR, _NEAR)))
        near = f0[frames][np.isfinite(f0[frames])]
        if syllable.stress and len(near):
            rows.append((syllable.accent, voice.level[frames].max(), float(np.median(near))))
    accents = np.array(rows).reshape(-1, 3)
    if len(rows):
        accents[:, 1:] -= accents[:, 1:].mean(axis=0)
    active = np.concatenate([take.audio[int(p.start * 16000) : int(p.end * 16000)] for p in plan.phrases])
    return {
        "accents": accents,
        "statistics": sound.statistics(voice),
        "rate": len(plan.syllables) / spoken,
        "pitch": float(np.nanmedian(f0)),
        "range": float(np.subtract(*np.nanpercentile(f0, [84, 16])) / 2),
        "level": 10 * np.log10(float(np.mean(np.square(active)))),
        "speech": spoken / plan.seconds,
        "strong": sum(s.accent >= 0.5 for s in plan.syllables) / spoken,
        "strokes": 60 * len(take.annotations["gestures"]["strokes"]) / plan.seconds,
        "cost": 60 * seconds / plan.seconds,
    }


def correlations(takes: list[np.ndarray], shuffles: int, seed: int) -> dict[str, Any]:
    """Correlation of accent with level and pitch over stressed syllables; null: accents shuffled within recordings."""
    rng = np.random.default_rng([seed, 71])
    pooled = np.concatenate(takes)
    nulls = []
    for _ in range(shuffles):
        accent = np.concatenate([rng.permutation(take[:, 0]) for take in takes])
        nulls.append([np.corrcoef(accent, pooled[:, column])[0, 1] for column in (1, 2)])
    strong, none = pooled[:, 0] >= 0.5, pooled[:, 0] == 0.0
    result: dict[str, Any] = {"syllables": len(pooled)}
    for column, name in ((1, "level"), (2, "pitch")):
        result[name] = {
            "correlation": float(np.corrcoef(pooled[:, 0], pooled[:, column])[0, 1]),
            "null": [float(x) for x in np.percentile(np.array(nulls)[:, column - 1], [2.5, 97.5])],
            "strong_less_none": float(pooled[strong, column].mean() - pooled[none, column].mean()),
        }
    return result


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the length of recordings and the number of shuffles."""
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--shuffles", type=int, default=200)


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Every speaker in every emotion and language, once, without rooms."""
    cast = cast_evenly(1, options.seconds, options.seed, rooms=False)
    roles = [{**role, "language": language} for language in LANGUAGE_NAMES for role in cast]
    # The first call of each process loads libraries; the cost is the median.
    found = parallel(measure, roles, options.workers)
    languages, emotions = {}, {}
    for language in LANGUAGE_NAMES:
        rows = [row for role, row in zip(roles, found, strict=True) if role["language"] == language]
        languages[language] = {
            **correlations([row["accents"] for row in rows], options.shuffles, options.seed),
            **{name: float(np.mean([row[name] for row in rows])) for name in ("rate", "speech", "strong", "strokes")},
            "cost": float(np.median([row["cost"] for row in rows])),
        }
    kinds = {INVENTED: (INVENTED,), "real": tuple(LANGUAGES)}
    judged = {}
    for kind, names in kinds.items():
        part = [(role, row) for role, row in zip(roles, found, strict=True) if role["language"] in names]
        emotions[kind] = _changes(part)
        features = np.stack([row["statistics"] for _, row in part])
        for what, classes in (("speaker", tuple(SPEAKERS)), ("emotion", tuple(VOICE_EMOTIONS))):
            truth = np.array([role[what] for role, _ in part])
            judged[f"{what}/{kind}"] = judge(features, truth, classes, "logistic", options.seed)
    return {
        "recordings": len(roles),
        "seconds": options.seconds,
        "shuffles": options.shuffles,
        "languages": languages,
        "emotions": emotions,
        "judged": judged,
        "sentences": [_sentence(name, options.seed) for name in SHOWN],
    }


def _changes(part: list[tuple[dict[str, Any], dict[str, Any]]]) -> dict[str, dict[str, float]]:
    """Means of each emotion less neutral, over the same speakers and languages."""
    means = {
        emotion: {
            name: float(np.mean([row[name] for role, row in part if role["emotion"] == emotion]))
            for name in ("rate", "pitch", "range", "level")
        }
        for emotion in VOICE_EMOTIONS
    }
    neutral = means.pop("neutral")
    return {
        emotion: {name: value - neutral[name] for name, value in values.items()} for emotion, values in means.items()
    }


def _sentence(language: str, seed: int) -> dict[str, Any]:
    """What the picture shows of a recording: its first two phrases."""
    take = talk(12.0, seed, speaker="chiara", language=language)
    plan = plan_from_json(take.annotations["speech"])
    return {"language": language, "seed": seed, "end": plan.phrases[1].end + 0.2}


def tables(result: dict[str, Any]) -> str:
    """Languages, then emotions, then speakers."""
    rows = []
    for name, part in result["languages"].items():
        cells = [part[key] for key in ("rate", "speech", "strong", "strokes", "syllables")]
        for what in ("level", "pitch"):
            cells += [part[what]["correlation"], part[what]["null"], part[what]["strong_less_none"]]
        rows.append([name, *cells, part["cost"]])
    headings = ["language", "syllables a second of speech", "share of speech", "strong accents a second of speech"]
    headings += ["strokes a minute", "stressed syllables"]
    for what, unit in (("level", "dB"), ("pitch", "semitones")):
        headings += [f"accent and {what}: r", "shuffled, 95 % band", f"strong less none, {unit}"]
    text = f"{result['recordings']} recordings of {result['seconds']:g} s, every speaker in every emotion and language;"
    text += f" {result['shuffles']} shuffles.\n\n"
    text += table(rows, [*headings, "processor seconds a minute"])
    text += "\nChange by emotion, invented / real languages:\n\n"
    units = {"rate": "syllables a second", "pitch": "semitones", "range": "semitones", "level": "dB"}
    rows = [
        [emotion, *(f"{values[name]:+.2f} / {result['emotions']['real'][emotion][name]:+.2f}" for name in units)]
        for emotion, values in result["emotions"][INVENTED].items()
    ]
    text += table(rows, ["emotion", *(f"{name}, {unit}" for name, unit in units.items())])
    rows = []
    for name, score in result["judged"].items():
        what, kind = name.split("/")
        cells = [score[key] for key in ("n", "accuracy", "interval", "chance", "shuffled_labels")]
        rows.append([f"{what}, {kind}", *cells])
    text += "\nFrom the audio at one level, logistic regression, 5 folds by recording:\n\n"
    return text + table(rows, ["", "recordings", "accuracy", "95 % interval", "chance", "labels shuffled"])


def picture(result: dict[str, Any], path: Path) -> None:
    """Spectrogram, words, syllables and accents of a sentence of each shown language."""
    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(
        2 * len(result["sentences"]),
        1,
        figsize=(13, 4.2 * len(result["sentences"])),
        height_ratios=[3, 1.3] * len(result["sentences"]),
        layout="constrained",
    )
    for sentence, top, bottom in zip(result["sentences"], axes[::2], axes[1::2], strict=True):
        take = talk(12.0, sentence["seed"], speaker="chiara", language=sentence["language"])
        plan = plan_from_json(take.annotations["speech"])
        voice = sound.analyse(take.audio, take.sample_rate)
        top.specgram(take.audio + 1e-7, NFFT=400, Fs=take.sample_rate, noverlap=320, cmap="Greys", vmin=-130, vmax=-45)
        clock = np.arange(len(voice.f0)) / sound.RATE
        pitch = top.twinx()
        pitch.plot(clock, voice.f0, color="tab:blue", lw=1.5)
        pitch.set(ylim=(100, 900), ylabel="pitch, Hz")
        pitch.set_yticks([100, 200, 300, 400])
        top.set(ylim=(0, 8000), ylabel="Hz", title=f"{LANGUAGES[sentence['language']].title} ({plan.synthesizer})")
        _marks(bottom, plan, sentence["end"])
        for panel in (top, bottom):
            panel.set_xlim(plan.phrases[0].start - 0.1, sentence["end"])
    axes[-1].set_xlabel("seconds; bars: accents, ticks: energy peaks of the syllables")
    figure.savefig(path, dpi=80)
    plt.close(figure)


def _marks(panel: Any, plan: SpeechPlan, end: float) -> None:
    for word in plan.words:
        if word.end < end:
            panel.axvline(word.start, color="0.8", lw=0.8)
            panel.text(word.start + 0.01, 1.75, word.text, fontsize=10, clip_on=True)
    for syllable in plan.syllables:
        if syllable.end < end:
            panel.bar(syllable.onset, syllable.accent, syllable.end - syllable.onset, align="edge", color="tab:orange")
            panel.plot([syllable.peak, syllable.peak], [0, 0.15], color="black", lw=1)
            text = "ˈ" * syllable.stress + "".join(syllable.phones)
            panel.text(syllable.onset + 0.005, 1.2, text, fontsize=8, clip_on=True)
    panel.set(ylim=(0, 2.2), yticks=[0, 0.5, 1], ylabel="accent")


PART = Part("voices", "Voices of real languages", add_arguments, run, tables, picture)

if __name__ == "__main__":
    run_part(PART)
