"""The second implementation of the bounds agrees with the package's, and sees what is not reported."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from a2g_jax.io.npz import write_motion_npz
from a2g_jax.metrics.body.check import check_motion
from a2g_jax.talker.recordings import talk
from a2g_jax.training.run import open_run
from experiments.bodies.clips import ABSURD
from experiments.bodies.judge import Judge, unreported
from experiments.bodies.table import render

MOTION = talk(8.0, 5).motion


@pytest.fixture(scope="module")
def run():
    return open_run("demo")


def shaken(motion):
    """Turns of every joint and steps of the root that grow from frame to frame: every figure leaves its bounds."""
    rng = np.random.default_rng(0)
    frames, joints = np.asarray(motion.rotations).shape[:2]
    size = np.linspace(0.0, 1.2, frames)[:, None, None]
    noise = Rotation.from_rotvec((size * rng.normal(size=(frames, joints, 3))).reshape(-1, 3)).as_matrix()
    rotations = np.asarray(motion.rotations) @ noise.reshape(frames, joints, 3, 3)
    root = np.asarray(motion.root) + size[:, 0] * 0.3 * rng.normal(size=(frames, 3))
    return replace(motion, rotations=rotations.astype(np.float32), root=root.astype(np.float32))


def written(folder, run, motion, findings):
    bounds = run.config.body_bounds
    write_motion_npz(folder / "sample_00.npz", motion)
    report = {"findings": [one.to_json() for one in findings]}
    checks = {"fps": motion.fps, "bounds": bounds.to_json(), "samples": [report]}
    (folder / "checks.json").write_text(json.dumps(checks))


@pytest.mark.parametrize("make", [shaken, *ABSURD.values()], ids=["shaken", *ABSURD])
def test_both_implementations_agree(run, make):
    motion = make(MOTION)
    bounds = run.config.body_bounds
    rotations, root = np.asarray(motion.rotations, np.float64), np.asarray(motion.root, np.float64)
    figures = bounds.reference.figures(motion)
    second = Judge(run).figures(rotations, root, motion.fps)
    for name, values in figures.items():
        for joint, column in zip(bounds.reference.parts[name], values.T, strict=True):
            if (name, joint) not in second:
                assert (name, column.max()) == ("range", 0.0)  # the root's
                continue
            defined = np.isfinite(second[name, joint])
            np.testing.assert_allclose(
                column[defined],
                second[name, joint][defined],
                rtol=2e-3,
                atol={"wrist_jerk": 5.0, "turn": 3.0}.get(name, 0.05),
            )


def test_what_is_not_reported(run, tmp_path):
    motion = shaken(MOTION)
    findings = check_motion(motion, run.config.body_bounds)
    assert len({one.figure for one in findings}) >= 8
    written(tmp_path, run, motion, findings)
    outside, missing = unreported(tmp_path, Judge(run))
    assert outside > 100
    assert missing == 0
    kept = [one for one in findings if (one.figure, one.joint) != ("turn", "L_Elbow")]
    assert len(kept) < len(findings)
    written(tmp_path, run, motion, kept)
    assert unreported(tmp_path, Judge(run))[1] > 0
    written(tmp_path, run, MOTION, ())
    assert unreported(tmp_path, Judge(run)) == (0, 0)


def test_the_table():
    done = {"case": "a", "run": "demo", "group": "plain", "status": 0, "samples": 3, "at_once": 1, "eased": 1}
    done |= {"drawn_again": 1, "reported": 1, "outside": 9, "unreported": 2, "before": {"turn Head": 2}, "lines": ["x"]}
    refused = {"case": "b", "run": "demo", "group": "plain", "status": 2, "refused": "no"}
    people = {"demo": {"BEAT, run": {"frames": 5, "outside": 2, "findings": {"turn Head": 1}}}}
    text = render(
        {
            "runs": {"demo": ""},
            "cases": [done, refused],
            "truth": {"demo": {"frames": 10, "findings": []}},
            "people": people,
            "cost": {"demo": {"generate": 0.1, "check": 0.005}},
        }
    )
    assert "**2 frames outside the bounds were not reported.**" in text
    assert "| demo | plain | 1 | 3 | 1 | 1 | 1 | 1 | 9 | 2 |" in text
    assert "- b: no" in text
    assert "(5 %)" in text
