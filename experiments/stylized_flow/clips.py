"""Styles and seed poses of clips that a flow was not trained on: real takes, generated speakers, and absurd clips.

    python -m experiments.stylized_flow.clips demo-flow --corpus CORPUS [--pictures]

Every clip is adapted or refused. Those that are not refused give their style to three speeches, and motion continues
from their last poses. Measured: the distance of the clip from the training data (log-likelihood and size of latents
beside those of validation motion, speeds, z-scores), what was adapted, the way of the hands to the clip's height, speed
and radius, agreement, top speed, largest turn and jerk of the motion, and the step from the last pose of a seed clip to
the first of the motion. Real takes and the dog are left out where ``A2G_SHARED_DATA`` has none.
Writes ``results/clips.json``, a table, and with ``--pictures`` film strips.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from PIL import Image, ImageDraw, ImageFont

from a2g_jax.data.corpus import Corpus
from a2g_jax.errors import InputError
from a2g_jax.features.mel import log_mel
from a2g_jax.generation.generator import speech_features
from a2g_jax.generation.stylized_flow.fit import Fitted, fit
from a2g_jax.generation.stylized_flow.latent_space import FlowSpace
from a2g_jax.generation.stylized_flow.report import StyleTarget, Verdict, hands_of, report_style
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.pose_track import represent
from a2g_jax.geometry.retarget.poses import rotation_angle
from a2g_jax.io.audio import read_audio
from a2g_jax.io.files import atomic_path, write_json
from a2g_jax.metrics.hands import hand_jerk, hand_speeds, local_places
from a2g_jax.metrics.style import HandStyle
from a2g_jax.talker.recordings import talk
from a2g_jax.training.run import open_run
from experiments.motion.speeches import SAMPLE_RATE, shared_folder
from experiments.motion.strips import HEIGHT, WIDTH, strip
from experiments.stylized_flow.clip_set import CandidateClip, clips
from experiments.tables.records import results

#: Speeches, seconds; a real one of 11 s joins where the folder of recordings has it.
SPEECHES = (("ada", 777), ("david", 778), ("elif", 779))
SECONDS = 12.0
#: Quantiles of validation motion.
QUANTILES = (1.0, 50.0, 99.0)
_WORDS = (Verdict.FOLLOWED, Verdict.PARTLY, Verdict.NOT)
#: Ends of the names of leg joints, which seams leave out: legs of generated motion stand where the run's stand.
LEGS = ("Hip", "Knee", "Ankle", "Foot")


def speeches(shared: Path) -> dict[str, Float[np.ndarray, " N"]]:
    """Three speeches by name."""
    found = {name: talk(SECONDS, seed, speaker=name).audio for name, seed in SPEECHES}
    real = shared / "speech" / "jfk.wav"
    if real.is_file():
        found.pop("elif")
        found["a president"] = read_audio(real, SAMPLE_RATE)
    return found


def validation(space: FlowSpace, corpus: Corpus) -> dict[str, Any]:
    """Quantiles over validation frames of what clips are compared by, and the top speed of training hands."""
    likelihood, code = [], []
    for segment in corpus.segments("validation")[:12]:
        cut = slice(segment.start, min(segment.stop, segment.start + 600))
        rows, features = (np.asarray(part[cut], np.float32) for part in (corpus.pose, corpus.audio))
        likelihood.append(space.log_likelihood(rows, features))
        code.append(np.sqrt(np.square(space.encode_rows(rows, features)).mean(axis=1)))
    top = max(
        float(
            hand_speeds(
                corpus.space.positions(np.asarray(corpus.pose[s.start : s.stop], np.float32)),
                corpus.skeleton,
                corpus.fps,
            ).max()
        )
        for s in corpus.segments("train")
    )
    quantiles = lambda parts: np.percentile(np.concatenate(parts), QUANTILES).tolist()  # noqa: E731
    return {"quantiles": QUANTILES, "log_likelihood": quantiles(likelihood), "code": quantiles(code), "top_speed": top}


def body_figures(motion: Motion) -> dict[str, float]:
    """Top speed of the hands (m/s), largest turn of a joint in a frame (degrees), 99th percentile of jerk (m/s3)."""
    places, turns = local_places(motion), np.asarray(motion.rotations, np.float64)
    return {
        "top_speed": float(hand_speeds(places, motion.skeleton, motion.fps).max()),
        "largest_turn": float(rotation_angle(turns[1:], turns[:-1]).max()),
        "jerk_p99": float(np.percentile(hand_jerk(places, motion.skeleton, motion.fps), 99)),
    }


def distance(space: FlowSpace, clip: Fitted, audio: Float[np.ndarray, " N"] | None) -> dict[str, Any]:
    """Likelihood of a clip as it is and adapted, with the other figures."""
    config = space.run.config
    own = config.space.continuous(represent(clip.motion, config.space.kind, "it")[0], config.statistics["pose"].mean)
    features = None if audio is None else log_mel(audio, config.mel, config.fps, len(own))
    as_given, adapted = (float(np.median(space.log_likelihood(rows, features))) for rows in (own, clip.rows))
    return {"log_likelihood": as_given, "adapted_log_likelihood": adapted, **body_figures(clip.motion)}


def seam(motion: Motion, clip: Motion) -> dict[str, float]:
    """Step of trunk, head and arms from the last pose of a clip to the first of the motion that continues it, beside
    the last step within the clip; centimetres, relative to the pelvis."""
    upper = [number for number, name in enumerate(motion.skeleton.names) if not name.endswith(LEGS)]
    ends, begins = local_places(clip)[-2:, upper], local_places(motion)[0, upper]
    length = lambda step: float(100.0 * np.linalg.norm(step, axis=-1).max())  # noqa: E731
    return {"step": length(begins - ends[1]), "step_before": length(ends[1] - ends[0])}


def measure_clip(
    space: FlowSpace, candidate: CandidateClip, spoken: dict[str, Float[np.ndarray, " N"]], samples: int
) -> tuple[dict[str, Any], list[Motion]]:
    """Figures of a clip and of the motions with its style and after it, and the motions to be shown."""
    run, row = space.run, {"group": candidate.group, "name": candidate.name}
    try:
        clip = fit(candidate.read(), run, candidate.name)
    except InputError as error:
        return {**row, "refused": str(error)}, []
    style, clip = space.fitted_style(clip, candidate.audio, share=0.9, name=candidate.name)
    hands = hands_of(clip.motion)
    assert hands is not None
    row |= {"distance": distance(space, clip, candidate.audio), **clip.as_json(), "notes": list(clip.notes)}
    shown, rows = [clip.motion], []
    for name, audio in spoken.items():
        features = speech_features(run, audio)
        plain = [hands_of(run.config.space.motion(one, run.config.fps)) for one in space.plain(features)]
        without = [one for one in plain if one is not None]
        mean = HandStyle(*np.mean([one for one, _ in without], axis=0).tolist())
        target = StyleTarget(hands[0], mean, max(hands[1], *(top for _, top in without)))
        matched = space.match(style, features)
        for number, motion in enumerate(space.generate(audio, samples, 0, matched)):
            report = report_style(motion, audio, SAMPLE_RATE, target)
            rows.append({"speech": name, "sample": number, **report.to_json(), **body_figures(motion)})
            if number == 0:
                shown.append(motion)
    row["styled"], row["target"] = rows, target.clip._asdict()
    return {**row, **_seeded(space, candidate, next(iter(spoken.values())))}, shown[:3]


def _seeded(space: FlowSpace, candidate: CandidateClip, audio: Float[np.ndarray, " N"]) -> dict[str, Any]:
    motion = candidate.read()
    needed = round((space.history / space.run.config.fps + 1.0) * motion.fps)
    try:
        clip = fit(motion.clip(max(0, motion.frames - needed), motion.frames), space.run, candidate.name, whole=False)
    except InputError as error:
        return {"seeded_refused": str(error)}
    (made,) = space.generate(audio, 1, 0, None, clip)
    return {"seeded": {**seam(made, clip.motion), **body_figures(made)}}


def table(figures: dict[str, Any]) -> str:
    """The figures as Markdown."""
    known, top = figures["validation"], figures["validation"]["top_speed"]
    low, middle, _ = known["log_likelihood"]
    lines = [
        "# Styles and seed poses of clips that the flow was not trained on",
        "",
        f"`python -m experiments.stylized_flow.clips {figures['run']} --corpus CORPUS --samples {figures['samples']}`;"
        f" speeches: {', '.join(figures['speeches'])}. Log-likelihood of validation motion: median {middle:.0f} nats a"
        f" frame, 1st percentile {low:.0f}; size of its latents {known['code'][1]:.2f}, 99th percentile"
        f" {known['code'][2]:.2f}; the fastest hand of the training motion {top:.1f} m/s. Likelihoods and latents are"
        " medians over frames; styled motion: means over speeches and samples, the largest of top speed and turn.",
        "",
        "| clip | nats a frame, adapted | latents | its top speed | way | followed | agreement (shifted) | top speed |"
        " turn a frame | jerk p99 | seed step (clip's) |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    refused = []
    for row in figures["clips"]:
        if "refused" in row:
            refused.append(f"- {row['refused']}")
            continue
        rows, far = row["styled"], row["distance"]
        mean = lambda key, rows=rows: float(np.mean([one[key] for one in rows]))  # noqa: E731
        most = lambda key, rows=rows: max(one[key] for one in rows)  # noqa: E731
        verdicts = [one["verdict"] for one in rows]
        words = ", ".join(f"{verdicts.count(word)} {word}" for word in _WORDS if word in verdicts)
        seed = row.get("seeded")
        step = f"{seed['step']:.1f} ({seed['step_before']:.1f}) cm" if seed else "refused"
        lines.append(
            f"| {row['name']} | {far['log_likelihood']:.0f}, {far['adapted_log_likelihood']:.0f} | {row['code']:.2f} |"
            f" {far['top_speed']:.1f} m/s | {mean('way'):.0%} | {words} | {mean('agreement'):.2f}"
            f" ({mean('agreement_shifted'):.2f}) | {most('top_speed'):.1f} m/s | {most('largest_turn'):.0f}° |"
            f" {mean('jerk_p99'):.0f} | {step} |"
        )
    return "\n".join([*lines, "", "Refused:", "", *refused, ""])


def pictures(path: Path, shown: dict[str, dict[str, Motion]]) -> None:
    """Film strips of a motion in the style of each clip, under the clip where that is no recording of a person."""
    pictures, names = [], []
    for name, motions in shown.items():
        for what, motion in motions.items():
            times = np.linspace(3.0, min(9.0, motion.seconds - 0.2), 9)
            pictures.append(strip(motion, times))
            names.append(f"{name}: {what}")
    whole = Image.new("RGB", (WIDTH, HEIGHT * len(pictures)), "white")
    pen, font = ImageDraw.Draw(whole), ImageFont.load_default(17)
    for number, (name, picture) in enumerate(zip(names, pictures, strict=True)):
        whole.paste(picture, (0, HEIGHT * number))
        pen.text((10, HEIGHT * number + 8), name, fill="#1c2530", font=font)
    with atomic_path(path) as temporary:
        whole.quantize(128, dither=Image.Dither.NONE).save(temporary, format="png", optimize=True)


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure a run; write the figures, the table and the pictures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", help="a run folder, or 'demo-flow'")
    parser.add_argument("--corpus", type=Path, required=True, help="generated, as the run's own")
    parser.add_argument("--samples", type=int, default=2)
    parser.add_argument("--pictures", action="store_true", help="film strips of real and absurd clips")
    options = parser.parse_args(arguments)
    run, corpus, shared = open_run(options.run), Corpus.open(options.corpus), shared_folder()
    space, spoken = FlowSpace(run, window=512), speeches(shared)
    figures: dict[str, Any] = {
        "run": Path(options.run).name,
        "corpus": corpus.fingerprint[:16],
        "samples": options.samples,
        "speeches": list(spoken),
        "validation": validation(space, corpus),
        "clips": [],
    }
    shown: dict[str, dict[str, Motion]] = {}
    for candidate in clips(shared, run.config.fps):
        row, motions = measure_clip(space, candidate, spoken, options.samples)
        figures["clips"].append(row)
        if motions and candidate.group != "generated":
            own, styled = motions[:2]
            # Recordings of people are not pictured.
            above = {} if candidate.group == "real" else {"the clip": own}
            shown[candidate.name] = above | {"its style": styled}
        print(candidate.name, row.get("refused", "adapted"), flush=True)
    folder = results("stylized_flow")
    write_json(folder / "clips.json", figures)
    (folder / "clips.md").write_text(table(figures), encoding="utf-8")
    if options.pictures:
        pictures(folder / "clips.png", shown)


if __name__ == "__main__":
    main()
