"""Cross-validation of fine-tuning: nothing of a held-out part enters training; tables compare what they name."""

from dataclasses import replace

import numpy as np
import pytest

from a2g_jax.io.audio import write_audio
from a2g_jax.io.bvh import write_bvh
from a2g_jax.talker.recordings import talk
from a2g_jax.training.run import demo_run
from experiments.fine_tuning.records import HELD_OUT, OTHERS
from experiments.fine_tuning.table import interval, render
from experiments.fine_tuning.takes import FOLDS, bounds, prepare_folds


def test_parts_tile_a_take():
    for frames in (956, 2065, 101):
        edges = [bounds(frames, number) for number in range(FOLDS)]
        assert edges[0][0] == 0
        assert edges[-1][1] == frames
        assert all(before[1] == after[0] for before, after in zip(edges, edges[1:], strict=False))


@pytest.fixture(scope="module")
def take():
    return talk(15.0, 4)


def folds_of(folder, take, change=None):
    """The folds of a take, with what ``change`` does to its rotations and audio."""
    rotations, audio = np.array(take.motion.rotations), np.array(take.audio)
    if change is not None:
        change(rotations, audio)
    folder.mkdir()
    write_bvh(folder / "take.bvh", replace(take.motion, rotations=rotations))
    write_audio(folder / "take.wav", audio, 16000)
    return prepare_folds("take", folder / "take.bvh", demo_run().config, folder / "cache")


@pytest.mark.slow
def test_nothing_of_a_held_out_part_enters_the_others(tmp_path, take):
    """Another motion and louder speech in one part change no number of the corpus without it."""
    first, last = bounds(take.motion.frames, 2)

    def change(rotations, audio):
        rotations[first:last] = rotations[first:last][::-1]
        audio[round(first / 30 * 16000) : round(last / 30 * 16000)] *= 0.2

    before, after = folds_of(tmp_path / "a", take), folds_of(tmp_path / "b", take, change)
    for number, (one, other) in enumerate(zip(before, after, strict=True)):
        same = [
            np.array_equal(getattr(one.corpus, name), getattr(other.corpus, name)) for name in ("pose", "audio", "root")
        ]
        for name, statistics in one.corpus.statistics.items():
            same += [np.array_equal(statistics.std, other.corpus.statistics[name].std)]
        assert all(same) == (number == 2)
    fold = before[2]
    assert [segment.frames for segment in fold.corpus.segments("train")] == [first, take.motion.frames - last]
    assert fold.corpus.frames + last - first == take.motion.frames
    assert fold.held_out.truth.frames == last - first
    assert len(fold.others) == 2
    assert not np.array_equal(fold.held_out.truth.rotations, after[2].held_out.truth.rotations)
    # Audio of equal times.
    assert len(fold.held_out.audio) == pytest.approx((last - first) / 30 * 16000, abs=1)


def values(speed):
    names = ("speed_p50", "speed_p90", "speed_p99", "jerk_p50", "jerk_p90", "height_spread", "radius")
    return {**dict.fromkeys(names, speed), "rest": 0.0, "height": 10.0, "agreement": 0.1, "posture": 0.0}


def record(method, speed, seed=None):
    folds = [{"values": values(speed), "steps": 5, "cpu_minutes": 0.5 * (seed is not None)} for _ in range(FOLDS)]
    pooled = None if method == OTHERS else values(speed)
    return {"take": "it", "method": method, "seed": seed, "folds": folds, "pooled": pooled}


def test_the_tables():
    rows = [record(HELD_OUT, 1.0), record(OTHERS, 1.0)]
    for seed in (0, 1, 2):
        rows += [record("shipped", 4.0, seed), record("from scratch", 2.0, seed), record("fine-tuned", 1.0, seed)]
    page = render("demo", rows, 2)
    # Seven of ten statistics are two octaves away.
    assert "| shipped | 1.40 (1.40 to 1.40) | 2.00 (2.00 to 2.00) |" in page
    assert "| the person's other 80 % | 0.00 | 0.00 |" in page
    assert "| from scratch | **-0.70 [-0.70, -0.70]** | **-1.00 [-1.00, -1.00]** |" in page


def test_intervals_are_of_few_seeds():
    assert interval([-1.0, -2.0, -3.0]) == "-2.00 [-4.48, +0.48]"
    assert interval([-2.0, -2.1, -1.9]).startswith("**-2.00 [")
    assert interval([0.5]) == "+0.50"
