"""A tree as SHOW lies on disk after TalkSHOW's split, of made-up numbers."""

import pickle

import numpy as np

from a2g_jax.io.audio import write_audio


def made_up_fit(frames, seed=0):
    """A pickle's content, with keys and shapes of SHOW's README; the pelvis looks at the camera, y down."""
    rng = np.random.default_rng(seed)
    turn = np.array([3.0747, -0.0158, -0.0152]) + 0.05 * rng.normal(size=(frames, 1, 3))
    return {
        "width": 1280, "height": 720, "center": np.array([[640.0, 360.0]]), "batch_size": frames,
        "camera_transl": rng.normal(size=(1, 3)), "focal_length": np.float32(5000.0),
        "body_pose_axis": rng.uniform(-1, 1, (frames, 63)).astype(np.float32),
        "expression": rng.normal(size=(frames, 100)).astype(np.float32),
        "jaw_pose": rng.normal(size=(frames, 3)), "betas": rng.normal(size=(1, 300)),
        "global_orient": turn.astype(np.float32), "transl": rng.normal(size=(frames, 3)),
        "left_hand_pose": rng.normal(size=(frames, 12)), "right_hand_pose": rng.normal(size=(frames, 12)),
        "leye_pose": np.zeros((frames, 3)), "reye_pose": np.zeros((frames, 3)),
        "pose_embedding": rng.normal(size=(frames, 32)),
    }  # fmt: skip


def write_take(folder, fit, protocol=4, rate=22050):
    """``<folder>/<name of the folder>.{pkl,wav}``; returns the samples, which 16 bits hold exactly."""
    folder.mkdir(parents=True)
    (folder / f"{folder.name}.pkl").write_bytes(pickle.dumps(fit, protocol))
    count = round(len(fit["body_pose_axis"]) / 30 * rate) if isinstance(fit, dict) else rate
    samples = np.random.default_rng(count).integers(-9000, 9000, count).astype(np.float32) / 32768
    write_audio(folder / f"{folder.name}.wav", samples, rate)
    return samples
