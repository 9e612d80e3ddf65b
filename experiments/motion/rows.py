"""Rows of the table: how each draws its motions, and what identifies its figures."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from a2g_jax.errors import InputError
from a2g_jax.evaluation.feature_network import FeatureNetwork
from a2g_jax.generation.generator import Generator
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.io.files import json_text, sha256_file
from a2g_jax.talker.skeleton import TALKER_SKELETON
from a2g_jax.training.run import Run, demo_feature_run, load_run, open_run
from a2g_jax.training.run_file import SHIPPED, WEIGHTS_FILE, read_description, run_folder
from a2g_jax.training.run_hashes import LOG, WEIGHTS_HASH
from experiments.motion.resampling import smooth_resample
from experiments.motion.speeches import Speech, digest, source_digest
from experiments.motion.targets import RIGHT, TRUTH

HALVES, MEAN, FIRST, OTHER = "half-split floor", "mean pose", "first pose held", "another clip's motion"
#: Code that generated motion depends on.
_GENERATION = ("models", "nn", "features", "generation")

Draw = Callable[[int], list[Motion]]
"""The motions for the speech of a number, at the rate of the table."""


@dataclass(frozen=True)
class Row:
    """A candidate of the table."""

    name: str
    draw: Draw | None
    """None for a row without motions of its own."""
    identity: str = ""
    """Digest of what its motions depend on besides the speeches."""
    run: Run | None = None


def reference_rows(speeches: Callable[[], list[Speech]], network: FeatureNetwork, samples: int, seed: int) -> list[Row]:
    """Truth, other right motions, the floor and motions that do not depend on the audio.

    Args:
        speeches: makes the speeches, or returns those that it has made.
    """
    pose = network.run.config.statistics["pose"].mean
    root = np.asarray(network.run.config.statistics["root"].mean, np.float32)

    def truth(number: int) -> Motion:
        motion = speeches()[number].truth
        assert motion is not None
        return motion

    def mean(number: int) -> list[Motion]:
        rotations = network.run.config.space.mean_rotations(pose)
        still = replace(truth(number), rotations=rotations[None], root=root[None])
        return [held(still, truth(number).frames)]

    def other(number: int) -> list[Motion]:
        motion = truth((number + 1) % len(speeches()))
        rows = np.arange(truth(number).frames) % motion.frames
        return [replace(motion, rotations=np.asarray(motion.rotations)[rows], root=np.asarray(motion.root)[rows])]

    return [
        Row(TRUTH, lambda number: [truth(number)]),
        Row(RIGHT, lambda number: speeches()[number].right_motions(samples, seed)),
        Row(HALVES, None),
        Row(MEAN, mean),
        Row(FIRST, lambda number: [held(truth(number).clip(0, 1), truth(number).frames)]),
        Row(OTHER, other),
    ]


def held(motion: Motion, frames: int) -> Motion:
    """The first pose for a number of frames."""
    rotations, root = np.asarray(motion.rotations)[:1], np.asarray(motion.root)[:1]
    return replace(motion, rotations=np.repeat(rotations, frames, axis=0), root=np.repeat(root, frames, axis=0))


def run_row(name: str, speeches: Callable[[], list[Speech]], fps: float, samples: int, seed: int) -> Row:
    """A run as `a2g generate` plays it: unseeded, its root planted; resampled to the rate of the table.

    Args:
        name: a folder, or the name of a shipped run.

    Raises:
        InputError: not a run, or one that moves no body of 22 joints.
    """
    run, folder = open_run(name), run_folder(name)
    check_body(name, run.config.space)
    generator: list[Generator] = []

    def draw(number: int) -> list[Motion]:
        if not generator:
            generator.append(Generator(run))
        # A seed of its own for every speech, so that speeches are independent draws.
        made = generator[0].generate(speeches()[number].audio, samples, (seed + 7919 * (number + 1)) % 2**31)
        return [smooth_resample(motion, fps) for motion in made]

    label = name if name in SHIPPED else Path(name).resolve().name
    return Row(label, draw, digest(weights_of(folder), source_digest(*_GENERATION)), run)


def weights_of(folder: Path) -> str:
    """Digest of a run's weights and settings."""
    values = read_description(folder)
    # Text without the hashes, which say nothing new.
    about = json_text({name: value for name, value in values.items() if name not in (WEIGHTS_HASH, LOG)})
    return digest(sha256_file(folder / WEIGHTS_FILE), about)


def feature_network(name: str) -> FeatureNetwork:
    """The network of FGD: its frame rate is that of the table.

    Args:
        name: a folder, or ``demo`` for the shipped one.

    Raises:
        InputError: not a run of a model with features, or one for another body.
    """
    if name == "demo":
        run, fingerprint = demo_feature_run()
    else:
        run, fingerprint = load_run(name), sha256_file(Path(name) / WEIGHTS_FILE)
    if run.config.build().features is None:
        raise InputError(f"{name}: is a run of {run.config.model}; a feature network is one of motion_autoencoder.")
    check_body(name, run.config.space)
    return FeatureNetwork(run, fingerprint)


def check_body(name: str, space: PoseSpace) -> None:
    """Refuse poses that are no rotations of the talker's 22 joints.

    Raises:
        InputError: they are not.
    """
    if not isinstance(space.body, Skeleton) or not space.body.same_tree(TALKER_SKELETON):
        raise InputError(f"{name}: moves {space.rows} {space.noun}; the table compares rotations of the talker's 22.")
