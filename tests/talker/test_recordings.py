"""Whole generated recordings: deterministic, consistent, and with many right motions for one audio."""

import jax
import numpy as np
import pytest

from a2g_jax.errors import InputError
from a2g_jax.talker.emotions import VOICE_EMOTIONS
from a2g_jax.talker.recordings import cast, resample_motion, talk
from a2g_jax.talker.speech import plan_from_json


@pytest.mark.smoke
def test_the_same_arguments_give_the_same_recording():
    first, second = talk(5.0, 11), talk(5.0, 11)
    np.testing.assert_array_equal(first.audio, second.audio)
    np.testing.assert_array_equal(first.motion.rotations, second.motion.rotations)
    assert first.annotations == second.annotations
    other = talk(5.0, 12)
    assert np.abs(first.audio - other.audio).max() > 0.01


def test_lengths_agree_at_any_rate():
    for fps in (15.0, 30.0, 60.0):
        take = talk(4.3, 5, fps=fps)
        assert take.motion.frames == round(4.3 * fps)
        assert len(take.audio) == round(4.3 * 16000)


def test_another_motion_keeps_the_rhythm_and_changes_the_choices():
    take = talk(30.0, 7, speaker="chiara")
    strokes = take.annotations["gestures"]["strokes"]
    hands = []
    for key in (1, 2, 3, jax.random.key(4)):
        motion, truth = resample_motion(take, key)
        assert motion.frames == take.motion.frames
        assert [stroke.syllable for stroke in truth.strokes] == [stroke["syllable"] for stroke in strokes]
        assert [stroke.size for stroke in truth.strokes] == [stroke["size"] for stroke in strokes]
        lead = [abs(stroke.apex - before["apex"]) for stroke, before in zip(truth.strokes, strokes, strict=True)]
        assert max(lead) < 0.25
        assert np.isfinite(truth.log_probability)
        hands.append(tuple((stroke.hand, stroke.family) for stroke in truth.strokes))
    assert len(set(hands)) == 4
    again, _ = resample_motion(take, 2)
    np.testing.assert_array_equal(again.rotations, resample_motion(take, 2)[0].rotations)


def test_annotations_hold_the_plan():
    take = talk(6.0, 9)
    plan = plan_from_json(take.annotations["speech"])
    assert plan.seconds == 6.0
    assert [word.text for word in plan.words] == [word.text for word in take.words]


def test_cast_is_deterministic_and_varied():
    roles = cast(12.0, 0)
    assert roles == cast(12.0, 0)
    assert len(roles) == 12
    assert sum(role["seconds"] for role in roles) == pytest.approx(720.0)
    assert len({role["speaker"] for role in roles}) == 6
    assert len({role["seed"] for role in roles}) == 12
    assert {role["speaker"] for role in cast(2.0, 0, speakers=("elif",))} == {"elif"}


def test_emotions_take_turns_and_leave_the_rest_of_the_cast_as_it_is():
    plain, equal = cast(32.0, 5), cast(32.0, 5, equal_emotions=True)
    without = [
        [{key: value for key, value in role.items() if key != "emotion"} for role in roles] for roles in (plain, equal)
    ]
    assert without[0] == without[1]
    for block in range(0, 32, 8):
        assert {role["emotion"] for role in equal[block : block + 8]} == set(VOICE_EMOTIONS)


def test_bad_arguments():
    with pytest.raises(InputError, match="no speaker 'bob'; there are: ada"):
        talk(5.0, 0, speaker="bob")
    with pytest.raises(InputError, match="no emotion 'bored'"):
        talk(5.0, 0, emotion="bored")
    with pytest.raises(InputError, match="too few"):
        cast(0.01, 0)
