"""Small flows, fitted and not trained, and the clips that they are fitted to."""

from dataclasses import replace
from functools import cache
from typing import NamedTuple

import jax
import numpy as np

from a2g_jax.data.batch import Batch
from a2g_jax.features.mel import MelConfig, log_mel
from a2g_jax.features.statistics import Statistics
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.geometry.pose_track import represent
from a2g_jax.models.stylized_flow.config import StylizedFlowConfig
from a2g_jax.models.stylized_flow.model import build
from a2g_jax.models.stylized_flow.sampling import StylizedFlowSampling
from a2g_jax.models.train_config import TrainConfig
from a2g_jax.talker.recordings import talk
from a2g_jax.training.run import Run, RunConfig

SMALL = StylizedFlowConfig(
    flow_steps=2,
    hidden=8,
    layers=1,
    history_frames=3,
    lookahead_frames=2,
    global_channels=4,
    encoder_channels=8,
    encoder_blocks=1,
    embedding_channels=4,
)
MEL = MelConfig(bands=8)
#: Another model for each kind of pose, as compiling is expensive.
MODELS = {
    "6d": SMALL,
    "exponential": replace(SMALL, cell="lstm", freedom=0.0, global_channels=0),
    "directions": replace(SMALL, freedom=0.0),
}


class Clip(NamedTuple):
    rows: np.ndarray
    features: np.ndarray
    motion: Motion
    audio: np.ndarray


def part(motion, first, stop):
    """Frames of a motion."""
    return replace(motion, rotations=motion.rotations[first:stop], root=motion.root[first:stop])


@cache
def clip(pose="6d", frames=90, seed=1):
    """A generated recording as rows of a corpus."""
    take = talk(6.0, seed)
    audio, motion = take.audio[: round(frames / 30 * 16000)], part(take.motion, 0, frames)
    return Clip(represent(motion, pose, "it")[0], log_mel(audio, MEL, 30.0, frames), motion, audio)


@cache
def run_of(pose="6d", controls=()):
    """A flow fitted to two clips, whose couplings are not the identity, as they are untrained."""
    clips = [clip(pose, 90, seed) for seed in (1, 2)]
    poses, audio = (np.stack([one[number] for one in clips]) for number in (0, 1))
    statistics = {
        "audio": Statistics(audio.mean((0, 1)), audio.std((0, 1)) + 1.0),
        "pose": Statistics(poses.mean((0, 1)), poses.std((0, 1)) + 0.01),
        "root": Statistics(np.array([0.0, 0.9, 0.0], np.float32), np.ones(3, np.float32)),
    }
    config = replace(MODELS[pose], style_controls=controls)
    sampling = StylizedFlowSampling(denoise=False, controls=("height=0.1",) if controls else ())
    body = represent(clips[0].motion, pose, "it")[1]
    corpus = {"fingerprint": "toy", "recipe": {}, "seconds": 6.0}
    space = PoseSpace(body, pose)
    about = RunConfig(
        "stylized_flow", "tiny", config, TrainConfig(), 30.0, MEL, space, statistics, corpus, sampling=sampling
    )
    model = build(config, about.data())
    batch = Batch(np.asarray(statistics["audio"].normalise(audio), np.float32), poses)
    params = jax.jit(model.stages[0].warm_start)(jax.jit(model.init)(jax.random.key(0)), batch)
    kernel = params["glow"]["coupling"]["out_kernel"]
    params["glow"]["coupling"]["out_kernel"] = 0.3 * jax.random.normal(jax.random.key(1), kernel.shape)
    summary = {"control_mean": np.linspace(0.1, 0.5, 5, dtype=np.float32)[:, None]} if controls else {}
    return Run(about, jax.device_get(params), summary, 0)
