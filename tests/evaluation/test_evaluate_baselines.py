"""Baselines of the table: noise, the mean pose, neighbours in audio and other right motions."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest
from scores_for_tests import score

from a2g_jax.data.corpus_writer import prepare_recording, write_corpus
from a2g_jax.data.settings import Features
from a2g_jax.evaluation import baselines as candidates
from a2g_jax.evaluation.evaluate import evaluate
from a2g_jax.geometry.pose_rows import rotations_from_rows
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.geometry.rotation import axis_angle_from_matrix
from a2g_jax.talker.recordings import talk


def test_noise_is_the_same_in_every_representation_of_rotations(corpus):
    """Noise on exponential maps turns joints by the angles of noise on 6D."""
    pose = np.asarray(corpus.pose[:50])
    rotations = rotations_from_rows(pose, "6d")
    maps = np.asarray(axis_angle_from_matrix(jnp.asarray(rotations)))
    noisy = candidates.with_noise(corpus.space, pose, 5.0, np.random.default_rng(0))
    same = candidates.with_noise(PoseSpace(corpus.body, "exponential"), maps, 5.0, np.random.default_rng(0))
    assert same.shape == maps.shape
    np.testing.assert_allclose(rotations_from_rows(same, "exponential"), rotations_from_rows(noisy, "6d"), atol=1e-4)


def test_exponential_maps_have_their_noise_rows(corpus, tmp_path):
    features = Features(pose="exponential")
    roles = corpus.recipe["roles"][:2]
    rows = (prepare_recording(talk(**{**role, "seconds": 5.0}), features) for role in roles)
    maps = write_corpus(tmp_path / "corpus", rows, features=features, recipe={"reader": "folder"})
    table = evaluate({}, maps, split="train", samples=1)
    little, much = (score(table, f"truth, {name} of noise", "mpjre") for name in ("1 degree", "5 degrees"))
    assert little == pytest.approx(2 * np.sqrt(2 / np.pi), rel=0.05)
    assert much > 4 * little


def test_a_held_pose_does_not_move(corpus, result):
    """Its FGD is nearer to the truth than the mean pose's, so a table needs both rows."""
    held = "first pose held"
    for metric in ("diversity", "wrist_speed", "jerk"):
        assert score(result, held, metric) == 0.0 < score(result, "truth", metric)
    assert score(result, "another right motion", "wrist_speed") == pytest.approx(
        score(result, "truth", "wrist_speed"), rel=0.5
    )
    pose = np.asarray(corpus.pose[:50])
    np.testing.assert_array_equal(candidates.first_pose(pose)[[0, -1]], pose[[0, 0]])


def test_neighbours_are_training_motion_found_by_audio(corpus):
    normalised = corpus.statistics["audio"].normalise(np.asarray(corpus.audio))
    for segment in (corpus.segments("test")[0], corpus.segments("train")[2]):
        found = candidates.nearest_neighbour(corpus, segment)
        assert found.shape == (segment.frames, 22, 6)
        wanted = normalised[segment.start : segment.start + 120]
        distances = {
            row: np.square(normalised[row : row + 120] - wanted).sum()
            for one in corpus.segments("train")
            if one.start != segment.start  # nothing is its own neighbour
            for row in range(one.start, one.stop - 119, 15)
        }
        nearest = min(distances, key=distances.get)
        np.testing.assert_array_equal(found[:120], corpus.pose[nearest : nearest + 120])


def test_of_real_recordings_there_is_no_other_right_motion(corpus):
    real = dataclasses.replace(corpus, recipe={"reader": "folder"})
    assert candidates.right_motions(real, corpus.segments("test")[0], 2, 0) is None
