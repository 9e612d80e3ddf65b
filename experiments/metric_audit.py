"""Sensitivity of every metric: the truth with controlled corruptions of growing dose.

    python -m experiments.metric_audit [--features RUN] [--clips 12] [--seconds 30] [--seed 0]
                                       [--out experiments/results/metric_audit]

Generated recordings; the target is the recording's own motion. A dose of 0 is the truth itself. With a feature network
(a run of motion_autoencoder on a 22-joint corpus at 30 fps) LPIPS is included, and FGD where there are two vectors or
more for each feature. Writes metric_audit.json and .png.
"""

import argparse
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from scipy import ndimage
from scipy.spatial.transform import Rotation

from a2g_jax.data.featurise import prepare_recording
from a2g_jax.data.settings import Features
from a2g_jax.evaluation.baselines import with_noise
from a2g_jax.evaluation.feature_network import FeatureNetwork
from a2g_jax.evaluation.scores import METRICS, PER_SAMPLE, Scorer, Target
from a2g_jax.geometry.mirror import mirror
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.geometry.retarget import find_rig
from a2g_jax.geometry.rotation import matrix_from_6d
from a2g_jax.io.files import atomic_path, make_folder, sha256_file, write_json
from a2g_jax.metrics.beats import mel_onsets
from a2g_jax.metrics.distribution import enough_vectors, frechet_distance
from a2g_jax.talker.recordings import cast, talk
from a2g_jax.talker.skeleton import TALKER_SKELETON
from a2g_jax.training.run import WEIGHTS_FILE, load_run

FPS = 30.0
Pose = np.ndarray


def _rows(rotations: np.ndarray) -> Pose:
    return np.swapaxes(rotations[..., :2], -1, -2).reshape(*rotations.shape[:2], 6)


def noise(pose: Pose, degrees: float, rng: np.random.Generator) -> Pose:
    """White noise on every joint."""
    return with_noise(PoseSpace(TALKER_SKELETON), pose, degrees, rng) if degrees else pose


def wobble(pose: Pose, degrees: float, rng: np.random.Generator) -> Pose:
    """Slow noise on every joint, with a time scale of about a second: another pose, as smooth as the truth."""
    if not degrees:
        return pose
    rotations = np.asarray(matrix_from_6d(pose))
    slow = ndimage.gaussian_filter1d(rng.normal(size=(*pose.shape[:2], 3)), 0.4 * FPS, axis=0)
    slow *= np.deg2rad(degrees) / slow.std()
    turns = Rotation.from_rotvec(slow.reshape(-1, 3)).as_matrix().reshape(*pose.shape[:2], 3, 3)
    return _rows((rotations @ turns).astype(np.float32))


def late(pose: Pose, seconds: float, _rng: np.random.Generator) -> Pose:
    """Circular shift in time."""
    return np.roll(pose, round(seconds * FPS), axis=0)


def slower(pose: Pose, share: float, _rng: np.random.Generator) -> Pose:
    """Stretched in time by 1 + share; the end is cut off."""
    rows = np.minimum(np.rint(np.arange(len(pose)) / (1.0 + share)).astype(int), len(pose) - 1)
    return ndimage.gaussian_filter1d(pose[rows], 1.0, axis=0) if share else pose


def smoother(pose: Pose, seconds: float, _rng: np.random.Generator) -> Pose:
    """Averaged over a Gaussian window."""
    return ndimage.gaussian_filter1d(pose, seconds * FPS, axis=0) if seconds else pose


def frozen(pose: Pose, share: float, _rng: np.random.Generator) -> Pose:
    """Frozen for that share of every four seconds."""
    rows = np.arange(len(pose))
    period = round(4.0 * FPS)
    start = rows - rows % period
    still = rows % period < share * period
    return pose[np.where(still, start, rows)]


def shuffled(pose: Pose, share: float, rng: np.random.Generator) -> Pose:
    """That share of the seconds permuted."""
    blocks = np.arange(len(pose) // round(FPS))
    chosen = rng.permutation(len(blocks))[: round(share * len(blocks))]
    order = blocks.copy()
    order[np.sort(chosen)] = chosen
    return pose[(order[:, None] * round(FPS) + np.arange(round(FPS))).ravel()]


DOSES: dict[str, tuple[Callable[[Pose, float, np.random.Generator], Pose], str, tuple[float, ...]]] = {
    "white noise": (noise, "degrees", (0, 0.25, 0.5, 1, 2, 4)),
    "slow noise": (wobble, "degrees", (0, 2, 4, 8, 16, 32)),
    "late": (late, "seconds", (0, 0.1, 0.2, 0.5, 1, 2)),
    "slower": (slower, "share", (0, 0.05, 0.1, 0.25, 0.5, 1)),
    "smoothed": (smoother, "seconds", (0, 0.05, 0.1, 0.2, 0.5, 1)),
    "frozen": (frozen, "share of time", (0, 0.1, 0.25, 0.5, 0.75, 1)),
    "seconds shuffled": (shuffled, "share", (0, 0.1, 0.25, 0.5, 0.75, 1)),
}


def measure(options: argparse.Namespace) -> dict[str, Any]:
    """Means over clips for every corruption and dose, and for mirrored motion."""
    roles = [{**role, "seconds": options.seconds} for role in cast(options.clips, options.seed)[: options.clips]]
    rows = [prepare_recording(talk(**role, fps=FPS), Features()) for role in roles]
    network = None
    if options.features is not None:
        network = FeatureNetwork(load_run(options.features), sha256_file(options.features / WEIGHTS_FILE))
    scorer = Scorer(PoseSpace(rows[0].body), FPS, network)
    targets = [Target(row.pose, scorer.space.positions(row.pose), mel_onsets(row.audio, FPS)) for row in rows]
    reference = np.concatenate([scorer.features(target.pose) for target in targets])

    def score(spoil: Callable[[Pose, np.random.Generator], Pose]) -> dict[str, float]:
        scores, features = [], []
        for number, target in enumerate(targets):
            pose = np.asarray(spoil(target.pose, np.random.default_rng([options.seed, number])), np.float32)
            target = Target(target.pose[: len(pose)], target.places[: len(pose)], target.onsets)
            scores.append(scorer.sample(pose, target))
            features.append(scorer.features(pose))
        means = {name: float(np.nanmean([each[name] for each in scores])) for name in scores[0]}
        if enough_vectors(*reference.shape):
            means["fgd"] = frechet_distance(np.concatenate(features), reference).value
        return means

    result: dict[str, Any] = {}
    for name, (spoil, unit, doses) in DOSES.items():
        print(f"{name} ...", flush=True)
        curve = [score(lambda pose, rng, dose=dose, spoil=spoil: spoil(pose, dose, rng)) for dose in doses]
        result[name] = {"unit": unit, "doses": list(doses), "scores": curve}
    rig = find_rig(rows[0].body)

    def mirrored(pose: Pose, _rng: np.random.Generator) -> Pose:
        motion = Motion(np.asarray(matrix_from_6d(pose)), np.zeros((len(pose), 3), np.float32), rows[0].body, FPS)
        return _rows(np.asarray(mirror(motion, rig).rotations))

    truth = result["late"]["scores"][0]
    result["mirrored"] = {"unit": "yes or no", "doses": [0, 1], "scores": [truth, score(mirrored)]}
    about = {"clips": len(rows), "seconds": options.seconds, "seed": options.seed, "feature_vectors": len(reference)}
    return {**about, "corruptions": result}


def picture(result: dict[str, Any], path: Path) -> None:
    """Metrics down, corruptions across: the truth's score dashed, each curve by dose, red where a metric is blind."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    corruptions = result["corruptions"]
    there = next(iter(corruptions.values()))["scores"][0]
    names = [name for name in METRICS if name in there and name in (*PER_SAMPLE, "fgd")]
    figure, axes = pyplot.subplots(
        len(names), len(corruptions), figsize=(15, 1.05 * len(names)), sharex="col", sharey="row", layout="constrained"
    )
    for line, name in enumerate(names):
        values = [row[name] for each in corruptions.values() for row in each["scores"]]
        moves = {
            corruption: np.nanmax([abs(row[name] - each["scores"][0][name]) for row in each["scores"]])
            for corruption, each in corruptions.items()
        }
        for column, (corruption, curves) in enumerate(corruptions.items()):
            panel = axes[line, column]
            heights = [row[name] for row in curves["scores"]]
            # Blind: changed by less than a tenth of the median change over the corruptions.
            sensitive = moves[corruption] > 0.1 * np.median(list(moves.values()))
            places = range(len(heights))
            panel.axhline(heights[0], color="#b7c0cc", linewidth=1, linestyle="--")
            panel.plot(places, heights, color="#2f6fde" if sensitive else "#c2554d", marker="o", markersize=3)
            panel.set_facecolor("white" if sensitive else "#fbeeec")
            panel.tick_params(labelsize=6)
            panel.spines[["top", "right"]].set_visible(False)
            if max(values) > 20 * max(np.nanmedian(values), 1e-9):
                panel.set_yscale("symlog", linthresh=max(float(np.nanmedian(values)), 1e-3))
            if line == 0:
                panel.set_title(corruption, fontsize=9)
            if column == 0:
                unit = f", {METRICS[name].unit}" if METRICS[name].unit else ""
                panel.set_ylabel(
                    f"{METRICS[name].title}{unit}".replace(", ", ",\n"), fontsize=6.5, rotation=0, ha="right"
                )
            if line == len(names) - 1:
                panel.set_xticks(list(places), [f"{dose:g}" for dose in curves["doses"]])
                panel.set_xlabel(curves["unit"], fontsize=7)
    with atomic_path(path) as temporary:
        figure.savefig(temporary, dpi=100, format="png")
    pyplot.close(figure)


def main() -> None:
    """Measure and draw."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--features", type=Path, help="a run of motion_autoencoder")
    parser.add_argument("--clips", type=int, default=12)
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path("experiments/results/metric_audit"))
    options = parser.parse_args()
    result = measure(options)
    make_folder(options.out)
    write_json(options.out / "metric_audit.json", result)
    picture(result, options.out / "metric_audit.png")
    print(json.dumps({name: each["scores"][-1] for name, each in result["corruptions"].items()}, indent=1)[:400])


if __name__ == "__main__":
    main()
