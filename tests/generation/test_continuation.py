"""Clips continued from their first poses: conditioned on these, and independent of the other clips."""

from dataclasses import replace

import numpy as np
import pytest
from flows_for_tests import clip, run_of

from a2g_jax.generation.continuation import continue_clips
from a2g_jax.generation.stylized_flow.latent_space import FlowSpace

FIRST, LAST, FRAMES = 6, 36, 40


def clips(count=3):
    own = clip("exponential")
    starts = range(0, 10 * count, 10)
    audio = np.stack([own.features[start : start + FRAMES] for start in starts])
    return audio, np.stack([own.rows[start : start + FRAMES] for start in starts])


def test_shapes_and_that_a_clip_does_not_depend_on_the_others():
    audio, pose = clips()
    run = run_of("exponential")
    made = continue_clips(run, audio, pose, FIRST, LAST, samples=2, seed=3)
    assert made.shape == (3, 2, LAST - FIRST, *pose.shape[2:])
    alone = continue_clips(run, audio[:1], pose[:1], FIRST, LAST, samples=2, seed=3)
    np.testing.assert_allclose(alone, made[:1], atol=1e-5)
    assert np.abs(made[0, 0] - made[0, 1]).max() > 1e-2
    assert np.abs(made[0, 0] - made[1, 0]).max() > 1e-2


def test_it_depends_on_the_poses_before_and_not_on_those_after():
    audio, pose = clips(1)
    run = run_of("exponential")
    made = continue_clips(run, audio, pose, FIRST, LAST, samples=1)
    behind, before, early = pose.copy(), pose.copy(), pose.copy()
    behind[:, FIRST:] += 1.0
    before[:, FIRST - 1] += 0.2
    early[:, : FIRST - 3] += 1.0
    np.testing.assert_array_equal(continue_clips(run, audio, behind, FIRST, LAST, 1), made)
    np.testing.assert_array_equal(continue_clips(run, audio, early, FIRST, LAST, 1), made)
    assert np.abs(continue_clips(run, audio, before, FIRST, LAST, 1)[:, :, 0] - made[:, :, 0]).max() > 1e-3


def test_it_follows_the_controls_of_the_sampling_settings():
    """They were left out of the condition: runs with style controls moved as those without."""
    audio, pose = clips(1)
    run = run_of("exponential", controls=("height",))
    assert run.config.sampling_settings.controls == ("height=0.1",)
    high = replace(run, config=run.config.with_sampling(controls=("height=0.1@0.5,0.9@0.6",)))
    low, made = (continue_clips(each, audio, pose, FIRST, LAST, samples=1, seed=3)[0, 0] for each in (run, high))
    # Conditioning looks ahead by two frames and averages over a window; long before the change nothing differs.
    np.testing.assert_allclose(made[:5], low[:5], atol=1e-5)
    assert np.abs(made[-10:] - low[-10:]).max() > 1e-3


def test_frames_without_history_or_lookahead_are_refused():
    audio, pose = clips(1)
    for first, last in ((2, 30), (6, 39)):
        with pytest.raises(ValueError, match="expected frames from 3 to 38"):
            continue_clips(run_of("exponential"), audio, pose, first, last, 1)
    assert FlowSpace(run_of("exponential"), 128).history == 3
