"""Response of runs to their controls: how far a request arrives, and what else changes.

    python -m experiments.controls                      # the shipped runs
    python -m experiments.controls RUN [RUN ...] --judge JUDGE
    python -m experiments.controls RUN --store          # first measure and store the gains of a new run

Each control is requested at five quantiles of people, and as a curve that rises and falls, for the same held-out
speeches and keys. JUDGE is a classifier of emotions in motion that was trained on a corpus of another seed:

    a2g prepare talker --out other --minutes 400 --seed 9
    a2g train emotion_classifier --input motion --corpus other --out judge --clip-frames 240 --steps 2000
        --batch-size 16 --dropout 0.5

Writes ``controls.json``, ``controls.md`` and ``controls.png`` into ``--out``, beside the figures of other runs that are
there. With ``--store``, the response without gains is measured first, and its inverse is written to the run as the
sampling setting ``control_gains``.
"""

import argparse
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from a2g_jax.data.corpus import Corpus
from a2g_jax.evaluation.emotion_judge import load_emotion_judge
from a2g_jax.features.hand_properties import PROPERTIES
from a2g_jax.generation.controls import controls_of
from a2g_jax.geometry.pose_track import represent
from a2g_jax.io.files import read_json, write_json
from a2g_jax.io.sealed import read_sealed, write_sealed
from a2g_jax.models.control_curves import parse_gain
from a2g_jax.progress import progress_bar
from a2g_jax.training.run import Run, open_run
from a2g_jax.training.run_file import RUN_FILE, run_folder
from experiments.controls.emotions import confusion, true_confusion
from experiments.controls.picture import draw
from experiments.controls.responses import QUANTILES, responses
from experiments.controls.subject import SECONDS, Ruler, Subject, column
from experiments.controls.table import render
from experiments.motion.speeches import SEED, Speech, Talk, held_out_talk

#: Kinds of intervals, of figures that are measured now and of those without an entry.
INTERVALS, OLD_INTERVALS = "Student's t", "the percentile bootstrap"
#: The control with a gain that is chosen on other speeches, with ``--talk-seed`` and ``--emotion-gain``.
EMOTION = "emotion"
#: Largest gain: beyond it, all requests but those near the median would be for the extreme clips.
MOST = 2.5


def main() -> None:
    """Measure; write the figures, the page and the picture."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="*", default=["demo", "demo-flow"], help="run folders or names of shipped runs")
    parser.add_argument("--speeches", type=int, default=12, help="at most (default: %(default)s)")
    parser.add_argument("--draws", type=int, default=3, help="motions for each speech (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="of the motions (default: %(default)s)")
    parser.add_argument("--judge", help="a run of emotion_classifier; without it, emotions are not measured")
    parser.add_argument("--judge-corpus", type=Path, help="the corpus of the judge (needed with --judge)")
    parser.add_argument("--talk-seed", type=int, default=SEED, help="of the speeches (default: %(default)s)")
    parser.add_argument(
        "--emotion-gain", type=float, metavar="G", help="another gain of the control emotion; give --out"
    )
    parser.add_argument("--only-emotions", action="store_true", help="keep the other figures that are there")
    parser.add_argument("--store", action="store_true", help="measure gains and store them in the runs first")
    parser.add_argument("--out", type=Path, default=Path(__file__).parent / "results")
    options = parser.parse_args()
    opened = {name: open_run(name) for name in options.runs}
    talk = held_out_talk(24.0, options.talk_seed, next(iter(opened.values())).config.fps)
    speeches = Talk(talk.roles[: options.speeches], talk.fps).speeches
    if options.emotion_gain is not None:
        opened = {name: _with_gain(run, options.emotion_gain) for name, run in opened.items()}
    if options.store:
        opened = {name: _stored(name, run, speeches, options) for name, run in opened.items()}
    judge = None if options.judge is None else load_emotion_judge(options.judge, Corpus.open(options.judge_corpus))
    place = options.out / "controls.json"
    figures: dict[str, Any] = read_json(place) if place.is_file() else {"runs": {}}
    options.out.mkdir(parents=True, exist_ok=True)
    for name, run in opened.items():
        talk.refuse_trained(name, run)
        subject = Subject(run, speeches, options.draws, options.seed)
        emotions = run.config.data().emotions if judge is not None and _has_emotion(run) else ()
        if judge is not None and emotions:
            figures |= {"emotions": list(emotions), "true_emotions": true_confusion(judge, emotions)}
        before = figures["runs"].get(_named(name)) if options.only_emotions else None
        total = len(emotions) + (1 + len(subject.names) * (len(QUANTILES) + 1) if before is None else 0)
        with progress_bar(total, f"measuring {_named(name)}", "request") as bar:
            found = before or responses(subject, _spread(run, speeches), lambda: bar.update(1))
            if judge is not None and emotions:
                found["emotions"] = confusion(subject, judge, emotions, lambda: bar.update(1))
        # Kept figures keep their kind of interval.
        intervals = INTERVALS if before is None else before["about"].get("intervals", OLD_INTERVALS)
        found["about"] = {
            "command": " ".join(["python -m experiments.controls", _named(name), *_given(options)]),
            "speeches": len(speeches),
            "talk_seed": options.talk_seed,
            "seconds": SECONDS,
            "draws": options.draws,
            "seed": options.seed,
            "intervals": intervals,
            **({"emotion_intervals": INTERVALS} if "emotions" in found else {}),
            "gains": list(getattr(run.config.sampling_settings, "control_gains", ())),
            "judge": judge.fingerprint if judge is not None and emotions else None,
        }
        figures["runs"][_named(name)] = found
        write_json(place, figures)
    (options.out / "controls.md").write_text(render(figures), encoding="utf-8")
    draw(figures, options.out / "controls.png")
    sys.stdout.write((options.out / "controls.md").read_text(encoding="utf-8"))


def _with_gain(run: Run, gain: float) -> Run:
    """The run with another gain of the control ``emotion``."""
    others = [line for line in run.config.sampling_settings.control_gains if parse_gain(line)[0] != EMOTION]
    return replace(run, config=run.config.with_sampling(control_gains=(*others, f"{EMOTION}={gain:g}")))


def _stored(name: str, run: Run, speeches: list[Speech], options: argparse.Namespace) -> Run:
    """The run with gains that are the inverse of its response without them; they are written to its folder."""
    plain = replace(run, config=run.config.with_sampling(control_gains=()))
    subject = Subject(plain, speeches, options.draws, options.seed)
    lines = []
    for control in subject.names:
        ends = (QUANTILES[0], QUANTILES[-1])
        low, high = (subject.measure([f"{control}={quantile:g}"]) for quantile in ends)
        requested = np.subtract(*np.quantile(subject.training[control], ends[::-1]))
        slope = float(np.mean(column(high, control) - column(low, control)) / requested)
        gain = min(max(1.0 / max(slope, 1e-6), 1.0), MOST)
        print(f"{name}: {control} responds by {slope:.2f}; gain {gain:.2f}")
        if gain > 1.0:
            lines.append(f"{control}={gain:.2f}")
    categories = controls_of(run).categories
    lines += [line for line in run.config.sampling_settings.control_gains if parse_gain(line)[0] in categories]
    about = run_folder(name) / RUN_FILE
    values = read_sealed(about)
    values["sampling"] |= {"control_gains": lines}
    write_sealed(about, values)
    return replace(run, config=run.config.with_sampling(control_gains=tuple(lines)))


def _spread(run: Run, speeches: list[Speech]) -> Float[np.ndarray, " 5"]:
    """Distance between the 10th and the 90th percentile of each property, over parts of the speakers' own motion."""
    ruler, kind = Ruler(run.config.space, run.config.fps), run.config.space.kind
    parts = [ruler.parts(represent(one.truth, kind, one.name)[0]) for one in speeches if one.truth is not None]
    low, high = np.quantile(np.concatenate(parts), [0.1, 0.9], axis=0)
    found: Float[np.ndarray, " 5"] = high - low
    assert len(found) == len(PROPERTIES)
    return found


def _has_emotion(run: Run) -> bool:
    controls = run.config.build().controls
    return controls is not None and EMOTION in controls.categories


def _named(name: str) -> str:
    return Path(name).name


def _given(options: argparse.Namespace) -> list[str]:
    judge = [] if options.judge is None else ["--judge JUDGE --judge-corpus CORPUS"]
    return [f"--speeches {options.speeches} --draws {options.draws} --seed {options.seed}", *judge]


if __name__ == "__main__":
    main()
