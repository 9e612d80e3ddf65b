"""Jerk at seams: which stretches are of a seam, and that a step there is found there alone."""

import numpy as np
import pytest

from a2g_jax.errors import InputError
from experiments.emotion_gesture import seams
from experiments.emotion_gesture.seams import around, distinct, figures, picture, places, stretches

STRIDE, FRAMES = 20, 107


def walk(jump=0.0, at=STRIDE):
    """Two wrists on smooth paths, the right one with a step of place at a frame."""
    time = np.arange(FRAMES)[:, None, None] / 15.0
    wrists = 0.1 * np.sin(time + np.arange(6).reshape(1, 2, 3))
    wrists[at:, 1] += jump
    return wrists


@pytest.mark.parametrize("at", [STRIDE, 3 * STRIDE])
def test_a_step_at_a_seam_is_in_its_stretch_and_in_none_away_from_seams(at):
    smooth, stepped = stretches(walk(), 15.0), stretches(walk(0.1, at), 15.0)
    seam_rows, away = places(len(smooth), STRIDE)
    assert len(seam_rows) == (FRAMES - 1) // STRIDE
    assert seam_rows[at // STRIDE - 1] + 3 == at
    changed = stepped - smooth > 10
    assert changed[seam_rows].nonzero()[0].tolist() == [at // STRIDE - 1]
    assert not changed[away].any()
    # Every stretch that the step is part of, and only those, is neither.
    others = np.setdiff1d(np.arange(len(smooth)), away)
    assert changed.nonzero()[0].tolist() == [row for row in others if abs(row - (at - 3)) <= 3]


def test_stretches_are_maxima_of_four_third_differences():
    wrists = np.random.default_rng(0).normal(size=(30, 2, 3))
    found = stretches(wrists, 15.0)
    size = np.linalg.norm(wrists[3:] - 3 * wrists[2:-1] + 3 * wrists[1:-2] - wrists[:-3], axis=-1) * 15.0**3
    assert len(found) == 24
    np.testing.assert_allclose(found, [size[row : row + 4].max() for row in range(24)], rtol=1e-5)


def test_figures_and_their_picture(tmp_path):
    motions = [walk(0.1, at) for at in range(STRIDE, FRAMES, STRIDE)]
    found = figures(distinct([*motions, motions[0]]), 15.0, STRIDE, {"the take": 50.0})
    assert found["motions"] == 5
    assert found["seams"] == 25
    assert found["limits"]["the take"] == {"value": 50.0, "seams_above": 0.2, "away_above": 0.0}
    # Each step is in one of five chunks, so that medians do not show it; in every chunk they do, around 0.
    every = walk()
    for at in range(STRIDE, FRAMES, STRIDE):
        every[at:, 0] += 0.1
    profile = np.array(around([stretches(every, 15.0)], STRIDE))
    assert (profile > 50).nonzero()[0].tolist() == list(range(STRIDE // 2 - 3, STRIDE // 2 + 3))
    rows = [{"run": "one", "setting": {}, "seed_poses": False, "fps": 15.0, **found}]
    picture(tmp_path / "seams.png", rows)
    assert (tmp_path / "seams.png").stat().st_size > 5000


def test_a_folder_without_the_take(tmp_path, monkeypatch):
    monkeypatch.setattr("sys.argv", ["seams", "--data", str(tmp_path)])
    with pytest.raises(InputError, match="beat: does not exist; name a folder with a beat/ in it with --data"):
        seams.main()
