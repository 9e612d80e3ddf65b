"""Content of the two codes of a trained Audio2Gestures, measured by exchanging them between motions.

    python -m experiments.audio2gestures.codes --corpus CORPUS RUN [RUN ...]

Clips of the generated corpus's test split in which one wrist clearly moves more are paired so that the wrists differ.
Of two clips A and B, ``g(S_A, I_B)`` is decoded: the wrist that moves more should be B's (the hidden choice is in I),
and the moments at which a wrist is fast should be A's (the rhythm is in S). Chance is one half for the hand; for the
times the same is measured against the strokes of a third clip.

The same is measured with S_A of A's speech in place of S_M (``audio_``), and for runs with a mapping net with an I_R
that it makes of noise with the mean and standard deviation of I_B (``drawn_``). Writes ``results/codes.json``.
"""

import argparse
from pathlib import Path
from typing import Any

import jax
import numpy as np

from a2g_jax.data.corpus import Corpus
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.io.files import write_json
from a2g_jax.metrics.intervals import mean_interval
from a2g_jax.metrics.rhythm import agreement, speed_peaks
from a2g_jax.models.audio2gestures.codec import Codec
from a2g_jax.models.audio2gestures.objective import code_noise
from a2g_jax.training.run import Run, demo_run, load_run
from experiments.tables.records import results

FRAMES = 128
#: Minimum dominance of one wrist over the other.
CLEAR = 0.25
#: Width of the agreement of peaks, seconds.
SIGMA = 0.1
_FIGURES = ("hand_follows_specific", "strokes_follow_shared", "strokes_follow_specific", "strokes_of_a_stranger")


def clips_of(corpus: Corpus) -> tuple[np.ndarray, np.ndarray]:
    """Clips of the test split one after another: poses (N, 128, J, 6) and audio (N, 128, bands)."""
    rows = [
        start
        for segment in corpus.segments("test")
        for start in range(segment.start, segment.stop - FRAMES + 1, FRAMES)
    ]
    pose, audio = (np.stack([array[row : row + FRAMES] for row in rows]) for array in (corpus.pose, corpus.audio))
    return pose, np.asarray(corpus.statistics["audio"].normalise(audio), np.float32)


def dominance(speeds: np.ndarray) -> float:
    """Dominance from -1 (only the right wrist moves) to 1 (left); speeds are (T, 2), left first."""
    left, right = speeds.mean(axis=0)
    return float((left - right) / (left + right + 1e-9))


def wrist_speeds(space: PoseSpace, pose: np.ndarray, fps: float) -> np.ndarray:
    """Speeds of both wrists, m/s, (T, 2), smoothed over 0.05 s."""
    from scipy.ndimage import gaussian_filter1d

    places = gaussian_filter1d(space.wrists(space.positions(pose)), 0.05 * fps, axis=0)
    return np.linalg.norm(np.gradient(places, axis=0), axis=-1) * fps


def swap(run: Run, corpus: Corpus, seed: int = 0) -> dict[str, Any]:
    """Shares and agreements of exchanged codes with 95 % intervals over pairs."""
    space, fps = corpus.space, corpus.fps
    codec = Codec(run.config.model_config, run.config.data())
    clips, features = clips_of(corpus)
    speeds = [wrist_speeds(space, clip, fps) for clip in clips]
    sides = np.array([dominance(one) for one in speeds])
    clear = np.nonzero(np.abs(sides) > CLEAR)[0]
    rng = np.random.default_rng(seed)
    left, right = (rng.permutation(clear[sign * sides[clear] > 0]) for sign in (1, -1))
    count = min(len(left), len(right))
    pairs = [(a, b) for a, b in zip(left[:count], right[:count], strict=True)]
    pairs += [(b, a) for a, b in pairs]

    @jax.jit
    def decoded(params, shared, specific):
        return codec.decode(params, codec.to_frames(shared), codec.specific_to_frames(specific))

    @jax.jit
    def codes(params, pose, audio):
        shared, specific = codec.encode_motion(params, pose)
        return shared.mean, codec.encode_audio(params, audio).mean, specific.mean

    def drawn(params, specific):
        return codec.map_noise(params, code_noise(jax.random.key(seed), specific)).mean

    firsts, seconds = [a for a, _ in pairs], [b for _, b in pairs]
    peaks = [speed_peaks(one.max(axis=1), fps) for one in speeds]
    figures: dict[str, list[float]] = {}
    of_motion, of_audio, _ = codes(run.params, clips[firsts], features[firsts])
    specific = codes(run.params, clips[seconds], features[seconds])[2]
    decodings = {"": (of_motion, specific), "audio_": (of_audio, specific)}
    if "mapping_net" in run.params:
        decodings["drawn_"] = (of_audio, jax.jit(drawn)(run.params, specific))
    for prefix, pair in decodings.items():
        poses = np.asarray(decoded(run.params, *pair))
        rows: dict[str, list[float]] = {name: [] for name in _FIGURES}
        for (a, b), pose in zip(pairs, poses, strict=True):
            ours = wrist_speeds(space, pose, fps)
            rows["hand_follows_specific"].append(float(np.sign(dominance(ours)) == np.sign(sides[b])))
            found = speed_peaks(ours.max(axis=1), fps)
            for name, other in zip(_FIGURES[1:], (a, b, int(rng.integers(len(clips)))), strict=True):
                rows[name].append(agreement(found, peaks[other], SIGMA) if len(found) and len(peaks[other]) else 0.0)
        figures |= {prefix + name: values for name, values in rows.items()}
    return {"pairs": len(pairs), **{name: mean_interval(np.array(v)).to_json() for name, v in figures.items()}}


def main() -> None:
    """Measure runs and write the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="+", help="folders of runs, or 'demo'")
    parser.add_argument("--corpus", type=Path, required=True)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    corpus = Corpus.open(options.corpus)
    figures = {}
    for name in options.runs:
        run = demo_run() if name == "demo" else load_run(name)
        figures[Path(name).name] = swap(run, corpus, options.seed)
        print(Path(name).name, figures[Path(name).name])
    write_json(
        results("audio2gestures") / "codes.json",
        {"corpus": corpus.fingerprint[:16], "seed": options.seed, "runs": figures},
    )


if __name__ == "__main__":
    main()
