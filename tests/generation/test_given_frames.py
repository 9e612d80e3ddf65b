"""Frames that are given, such as pinned clips and the beginning after a seed clip: not eased, and right remedies."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from a2g_jax.errors import InputError
from a2g_jax.generation.checked import REDRAWS, Checked
from a2g_jax.generation.drafts import Draft, recorded
from a2g_jax.generation.pins.pinned import PinnedClips
from a2g_jax.generation.pins.request import pin_of
from a2g_jax.generation.seed_bounds import REMEDY, seed_stretches
from a2g_jax.metrics.body.check import Stretch, check_motion
from a2g_jax.talker.recordings import talk
from a2g_jax.training.body_extremes import corpus_extremes
from a2g_jax.training.run import Run, demo_run

SPEECH = talk(6.0, 21)
#: An elbow that flips would be bridged; legs are not eased.
ELBOW, KNEE = (SPEECH.motion.skeleton.names.index(name) for name in ("L_Elbow", "L_Knee"))


@pytest.fixture(scope="module")
def run(toy_run_config, toy_corpus):
    return Run(replace(toy_run_config(), body_extremes=corpus_extremes(toy_corpus, toy_run_config())), {}, {}, 0)


def turned(motion, degrees, joint=ELBOW):
    """The motion with a joint turned about the vertical at every frame by an angle of that frame."""
    rotations = np.array(motion.rotations)
    turn = Rotation.from_rotvec(np.radians(degrees)[:, None] * [0.0, 1.0, 0.0]).as_matrix()
    rotations[:, joint] = turn @ rotations[:, joint]
    return replace(motion, rotations=rotations.astype(np.float32))


class Given:
    """A sampler whose motion is always the same bad one."""

    def __init__(self, motion, stretches=(), transitions=(), remedy="", varies=True):
        self.motion, self.stretches, self.transitions = motion, stretches, transitions
        self.remedy, self.varies, self.draws = remedy, varies, 0

    def stream(self, audio, samples, seed=0):
        return recorded(self.drafts(audio, samples, seed))

    def drafts(self, audio, samples, seed=0):
        self.draws += 1
        root = self.motion.root + np.float32(1e-4 * self.draws)
        yield Draft(replace(self.motion, root=root), transitions=self.transitions)


def error(run, sampler):
    with pytest.raises(InputError) as caught:
        list(Checked(run, sampler, strict=True).stream(SPEECH.audio, 1))
    return str(caught.value)


def test_the_remedy_is_one_that_helps(run):
    """Another seed changes no pinned clip; it may change what is around one."""
    flip = np.zeros(SPEECH.motion.frames)
    flip[60] = 180.0
    bad, bounds = turned(SPEECH.motion, flip, KNEE), run.config.body_bounds
    pinned = error(run, Given(bad, (Stretch(55, 70, bounds),), remedy="pin another clip"))
    assert pinned.endswith("; pin another clip, or leave --strict out.")
    around = error(run, Given(bad, (Stretch(70, 90, bounds),), ((55, 70),), remedy="pin another clip"))
    assert around.endswith("; pin another clip; or use another --seed, or leave --strict out.")
    assert error(run, Given(bad)).endswith("; use another --seed or speech, or leave --strict out.")
    assert "--seed" not in error(run, Given(bad, varies=False))


def test_frames_that_are_not_fixed_are_drawn_again(run):
    flip = np.zeros(SPEECH.motion.frames)
    flip[60] = 180.0
    bad, bounds = turned(SPEECH.motion, flip, KNEE), run.config.body_bounds
    for fixed, draws in ((True, 1), (False, 1 + REDRAWS)):
        sampler = Given(bad, (Stretch(55, 70, bounds, fixed),))
        list(Checked(run, sampler).stream(SPEECH.audio, 1))
        assert sampler.draws == draws


def test_an_extreme_seed_pose_is_not_eased():
    """The first frame follows from the seed clip; its posture may pass slowly, and what comes later is checked."""
    run = demo_run()
    bounds, frames = run.config.body_bounds, SPEECH.motion.frames
    passing = np.linspace(1.0, 0.0, 40) ** 2
    angle = np.zeros(frames)
    angle[:40] = -60.0 * passing
    begun = turned(SPEECH.motion, angle)
    assert check_motion(begun, bounds)[0].first == 0
    (plain,) = Checked(run, Given(begun)).stream(SPEECH.audio, 1)
    assert np.abs(plain.rotations[0] - begun.rotations[0]).max() > 0.05
    clip = turned(SPEECH.motion.clip(0, 30), np.full(30, -60.0))
    sampler = Given(begun, seed_stretches(run, clip), remedy=REMEDY)
    checked = Checked(run, sampler)
    (kept,) = checked.stream(SPEECH.audio, 1)
    np.testing.assert_array_equal(kept.rotations, begun.rotations)
    assert checked.reports[0].findings == ()
    late = np.roll(angle, 120)
    (eased,) = Checked(run, Given(turned(SPEECH.motion, late), sampler.stretches)).stream(SPEECH.audio, 1)
    assert np.abs(eased.rotations[120] - turned(SPEECH.motion, late).rotations[120]).max() > 0.05


def test_pins_keep_what_is_given_below_them():
    run = demo_run()
    pin = pin_of(talk(20.0, 77, speaker="felix").motion.clip(100, 130), run, "clips/wave.bvh", 3.0)
    below = Given(SPEECH.motion, seed_stretches(run, SPEECH.motion.clip(0, 30)), remedy=REMEDY)
    pinned = PinnedClips(run, below, (pin,), limit=860.0)
    assert [(one.first, one.stop) for one in pinned.stretches] == [(0, 1), (1, 45), (90, 120)]
    assert pinned.remedy.endswith(REMEDY)
    assert pinned.caption == "pinned wave.bvh at 3 s"
    (draft,) = pinned.drafts(SPEECH.audio, 1)
    (before, after) = draft.transitions
    assert before[1] == 90
    assert after[0] == 120
    same = np.all(np.asarray(draft.motion.rotations) == np.asarray(below.motion.rotations), axis=(1, 2, 3))
    assert not same[before[0] : after[1]].any()
    assert same[: before[0]].all()
    assert same[after[1] :].all()
