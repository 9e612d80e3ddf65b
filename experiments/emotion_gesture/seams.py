"""Wrist jerk where chunks meet, on the real BEAT take: prepared, trained on for a short time, and generated in full.

    python -m experiments.emotion_gesture.seams [--data ../shared/data] [--run demo-emotion]

The take of 64 s (words, neutral) is prepared with ``--features emotion-gesture --labelled --random-split``, and the
preset ``tiny`` is trained on it for a few hundred steps (:data:`STEPS`; seed 0): enough to run every stage, not enough
for good motion. That run and the named one, for which the take is prepared with ``--for``, generate motion for the
take's whole audio: four samples (seed 0), without seed poses and with the take's first poses. Equal samples count once.

Jerk is the norm of the third difference of a wrist's position relative to the pelvis, times fps cubed. Every figure is
of *stretches*: the maximum over four jerks in succession, and both wrists. The stretch of the seam between frames
``s - 1`` and ``s`` has the jerks around frames ``s - 2`` to ``s + 1``, among them the three that the step over the seam
is part of. All stretches of recorded motion, one at each frame, give the 95th percentile; stretches of which no jerk
includes a seam are those away from seams. Recorded motion is the take on the run's body, and for runs of the generated
corpus that corpus's motion too. Writes ``results/seams.json``, ``seams.md`` and
``seams.png``: a few minutes of one core.
"""

import argparse
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from jaxtyping import Float, Int

from a2g_jax.cli import main as command_line
from a2g_jax.data.corpus import Corpus
from a2g_jax.data.corpus_layout import MANIFEST
from a2g_jax.errors import InputError
from a2g_jax.generation.generator import Generator
from a2g_jax.io.files import atomic_path, write_json
from a2g_jax.metrics.liveliness import body_of
from a2g_jax.metrics.physical import jerk, speeds
from a2g_jax.talker.recordings import talk
from a2g_jax.talker.speakers import SPEAKERS
from a2g_jax.training.run import Run, open_run
from a2g_jax.training.run_file import WEIGHTS_FILE
from experiments.motion.speeches import shared_folder

RESULTS = Path(__file__).parent / "results"
#: The short training: steps of each stage.
STEPS = {"mining-steps": 60, "steps": 150, "vae-steps": 60, "sampled-steps": 60}
#: Jerks of a stretch, and frames of one jerk.
STRETCH, JERK_FRAMES = 4, 4
SAMPLES, SEED = 4, 0
#: Percentile of recorded motion, and generated recordings of a minute, with the seed of the first.
PERCENTILE, MINUTES, TALK_SEED = 95.0, 8, 7700
#: Settings of generation that are measured; ``seam_frames`` 0 leaves seams as the decoder makes them.
SETTINGS = ({}, {"seam_frames": 0}, {"emotion": "neutral"})

_COLOURS = ("#2f6fde", "#d9822b", "#2a9d63", "#9aa5b4")

Wrists = Float[np.ndarray, "T w 3"]


def main() -> None:
    """Prepare, train, generate, measure, and write both files."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=shared_folder(), help="folder with BEAT's take in beat/")
    parser.add_argument("--run", default="demo-emotion", help="a run folder, or 'demo-emotion'")
    parser.add_argument("--work", type=Path, help="folder that keeps the corpora and the run, to resume")
    parser.add_argument("--out", type=Path, default=RESULTS)
    options = parser.parse_args()
    source = options.data / "beat"
    if not source.is_dir():
        raise InputError(f"{source}: does not exist; name a folder with a beat/ in it with --data.")
    with tempfile.TemporaryDirectory() as temporary:
        work = options.work or Path(temporary)
        own = prepared(work / "beat", source, "--features", "emotion-gesture")
        given = prepared(work / "beat-on-run", source, "--for", options.run)
        rows = [*measured("the take's run", open_run(trained(work / "run", own)), own)]
        rows += measured(Path(options.run).name, open_run(options.run), given)
    found = {"steps": STEPS, "samples": SAMPLES, "seed": SEED, "percentile": PERCENTILE, "rows": rows}
    options.out.mkdir(parents=True, exist_ok=True)
    write_json(options.out / "seams.json", found)
    with atomic_path(options.out / "seams.md") as path:
        path.write_text(page(found), encoding="utf-8")
    picture(options.out / "seams.png", rows)
    print(page(found))


def prepared(out: Path, source: Path, *flags: str) -> Corpus:
    """The take as a corpus of a neutral recording."""
    if not (out / MANIFEST).is_file():
        _run("prepare", "beat", source, "--labelled", "--random-split", "--workers", 1, *flags, "--out", out)
    return Corpus.open(out)


def trained(out: Path, corpus: Corpus) -> Path:
    """A run of the preset, trained on the take for a short time."""
    steps = [part for name, value in STEPS.items() for part in (f"--{name}", value)]
    if not (out / WEIGHTS_FILE).is_file():
        _run("train", "emotion_gesture", "--corpus", corpus.path, "--out", out, "--resume", "--seed", SEED, *steps)
    return out


def _run(*command: object) -> None:
    if command_line([str(part) for part in command]) != 0:
        raise InputError(f"a2g {command[0]}: failed; its message is above.")


def measured(name: str, run: Run, corpus: Corpus) -> Iterator[dict[str, Any]]:
    """Figures of a run for each setting, without and with seed poses, and of recorded motion at the same frames."""
    model = run.config.build()
    fps, stride = run.config.fps, run.config.model_config.stride
    audio, pose = np.asarray(corpus.audio[:]), np.asarray(corpus.pose[:], np.float32)
    wrists = lambda rows: run.config.space.wrists(run.config.space.positions(rows))  # noqa: E731
    take = stretches(wrists(pose), fps)
    rulers = {"the take": take}
    if run.config.corpus.get("recipe", {}).get("reader") == "talker":
        rulers["generated talk"] = generated_talk(fps)
    limits = {ruler: float(np.percentile(values, PERCENTILE)) for ruler, values in rulers.items()}
    for setting in SETTINGS:
        generator = Generator(replace(run, config=run.config.with_sampling(**setting)))
        for seeds in (None, pose[: model.seed_frames]):
            motions = generator.rows(audio, SAMPLES, SEED, seed_poses=seeds)
            found = distinct([wrists(np.asarray(rows, np.float32)) for rows in motions])
            about = {"run": name, "setting": setting, "seed_poses": seeds is not None, "fps": fps}
            yield about | figures(found, fps, stride, limits)
    about = {"run": name, "setting": None, "seed_poses": None, "fps": fps}
    yield about | figures([wrists(pose)], fps, stride, limits)


def generated_talk(fps: float) -> Float[np.ndarray, " n"]:
    """Stretches of generated recordings of a minute, of all speakers in turn."""
    motions = (
        talk(60.0, TALK_SEED + minute, speaker=tuple(SPEAKERS)[minute % len(SPEAKERS)], fps=fps).motion
        for minute in range(MINUTES)
    )
    return np.concatenate([stretches(body_of(motion).wrists, fps) for motion in motions])


def distinct(motions: list[Wrists]) -> list[Wrists]:
    """The motions without repetitions: without drawn emotions, samples differ by their first poses alone."""
    found: list[Wrists] = []
    for motion in motions:
        if not any(np.allclose(motion, other, atol=1e-4) for other in found):
            found.append(motion)
    return found


def stretches(wrists: Wrists, fps: float) -> Float[np.ndarray, " n"]:
    """Maximum over ``STRETCH`` jerks in succession and all wrists, m/s3, for every first frame."""
    largest = np.asarray(jerk(wrists, fps)).max(axis=1)
    return np.lib.stride_tricks.sliding_window_view(largest, STRETCH).max(axis=1)


def places(count: int, stride: int) -> tuple[Int[np.ndarray, " s"], Int[np.ndarray, " a"]]:
    """Rows of the stretches of seams, and rows of those away from seams.

    Args:
        count: number of stretches of the motion.
        stride: frames from seam to seam; the first seam is at frame ``stride``.
    """
    rows = np.arange(count)
    length = STRETCH + JERK_FRAMES - 1
    # A stretch has the frames from its row on; one step of it may be that from ``s - 1`` to ``s``.
    crosses = (rows + length - 1) // stride > rows // stride
    seams = np.arange(stride, count + JERK_FRAMES - 1, stride) - (JERK_FRAMES - 1)
    return seams, rows[~crosses]


def figures(motions: list[Wrists], fps: float, stride: int, limits: dict[str, float]) -> dict[str, Any]:
    """Medians at seams and away from them, and shares above the percentile of each recorded motion.

    ``speed`` is that of the faster wrist in the step over a seam, m/s, beside all other steps.
    """
    found = [stretches(one, fps) for one in motions]
    at, away = (np.concatenate([one[places(len(one), stride)[part]] for one in found]) for part in (0, 1))
    steps = np.stack([np.asarray(speeds(one, fps)).max(axis=1) for one in motions])
    over = np.arange(1, steps.shape[1] + 1) % stride == 0
    above = lambda limit: {  # noqa: E731
        "value": limit,
        "seams_above": float(np.mean(at > limit)),
        "away_above": float(np.mean(away > limit)),
    }
    return {
        "motions": len(motions),
        "seams": len(at),
        "median": float(np.median(at)),
        "median_away": float(np.median(away)),
        "speed": float(np.median(steps[:, over])),
        "speed_away": float(np.median(steps[:, ~over])),
        "around": around(found, stride),
        "limits": {name: above(limit) for name, limit in limits.items()},
    }


def around(motions: list[Float[np.ndarray, " n"]], stride: int) -> list[float]:
    """Median over chunks and motions by the frames from the nearest seam, from ``-(stride // 2)`` on."""
    first = -(stride // 2)
    after = [(np.arange(len(one)) + JERK_FRAMES - 1 - first) % stride for one in motions]
    rows, places_of = np.concatenate(motions), np.concatenate(after)
    return [float(np.median(rows[places_of == place])) for place in range(stride)]


def page(found: dict[str, Any]) -> str:
    """The table as Markdown."""
    steps = " ".join(f"--{name} {value}" for name, value in found["steps"].items())
    lines = [
        "# Seams between chunks on a real take",
        "",
        f"Made by `python -m experiments.emotion_gesture.seams`. The take's run is `{steps} --seed {found['seed']}`;"
        f" {found['samples']} samples, equal ones once. Wrist jerk, m/s3, maximum over {STRETCH} frames;"
        " p95 is that of recorded motion, and the last two columns are shares above it.",
        "",
        "| run | generation | seed poses | seams | speed at seams, m/s | away | jerk at seams | away | recorded motion"
        " | p95 | above it at seams | away |",
        f"|{' --- |' * 12}",
    ]
    for row in found["rows"]:
        kind = _kind(row["setting"])
        seeds = "" if row["seed_poses"] is None else "the take's" if row["seed_poses"] else "none"
        for name, limit in row["limits"].items():
            lines.append(
                f"| {row['run']} | {kind} | {seeds} | {row['seams']} | {row['speed']:.2f}"
                f" | {row['speed_away']:.2f} | {row['median']:.0f} | {row['median_away']:.0f}"
                f" | {name} | {limit['value']:.0f} | {limit['seams_above']:.0%} | {limit['away_above']:.0%} |"
            )
    return "\n".join([*lines, "", "![Jerk by the time from the nearest seam](seams.png)", ""])


def picture(path: Path, rows: list[dict[str, Any]]) -> None:
    """Draw jerk around the seams: a panel for each run, with the percentiles of recorded motion as lines."""
    names = list(dict.fromkeys(row["run"] for row in rows))
    figure, panels = plt.subplots(1, len(names), figsize=(5.2 * len(names), 3.6), layout="constrained", squeeze=False)
    for axes, name in zip(panels[0], names, strict=True):
        own = [row for row in rows if row["run"] == name and not row["seed_poses"]]
        for row, colour in zip(own, _COLOURS, strict=False):
            time = (np.arange(len(row["around"])) - len(row["around"]) // 2) / row["fps"]
            axes.plot(time, row["around"], color=colour, label=_kind(row["setting"]))
        for (ruler, limit), style in zip(own[-1]["limits"].items(), ("--", ":"), strict=False):
            axes.axhline(limit["value"], color="#5b6675", linestyle=style, label=f"95th percentile, {ruler}")
        axes.axvline(0.0, color="#5b6675", linewidth=0.8)
        axes.set(title=name, xlabel="seconds from the nearest seam", ylabel="wrist jerk, m/s3, median", yscale="log")
        axes.legend(fontsize=7)
    with atomic_path(path) as made:
        figure.savefig(made, dpi=110, format="png")
    plt.close(figure)


def _kind(setting: dict[str, Any] | None) -> str:
    if setting is None:
        return "the take itself"
    return " ".join(f"--{name.replace('_', '-')} {value}" for name, value in setting.items()) or "default"


if __name__ == "__main__":
    main()
