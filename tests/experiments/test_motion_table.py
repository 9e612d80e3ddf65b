"""The table of lively motion: targets, the rule of the default, resampling, records, and the page."""

import json

import numpy as np
import pytest

from a2g_jax.errors import InputError
from a2g_jax.geometry.motion import Motion
from a2g_jax.metrics.rhythm import agreement_with_null
from a2g_jax.talker.recordings import talk
from experiments.motion.measure import Bench
from experiments.motion.real import on_take
from experiments.motion.resampling import smooth_resample
from experiments.motion.rows import Row, feature_network, held, reference_rows
from experiments.motion.speeches import Speech, Talk, held_out_talk
from experiments.motion.statistics import STATISTICS, statistics
from experiments.motion.table import real_section, render
from experiments.motion.targets import LISTENS, RIGHT, TARGETS, TRUTH, check, choose_default


def row(value: float = 1.0, **changes: float):
    """Statistics of a run that all have one value."""
    made = {key: {"value": changes.get(key, value), "low": None, "high": None} for key in TARGETS}
    return {**made, "listening": {"verdicts": LISTENS}}


ROWS = {TRUTH: row(), RIGHT: row()}


def test_the_truth_meets_every_target():
    met = check(row(), ROWS)
    assert set(met) == {*TARGETS, "listening"}
    assert all(met.values())


@pytest.mark.parametrize("key", TARGETS)
def test_ends_of_each_target(key):
    target = TARGETS[key]
    assert check(row(**{key: 0.999 * target.high if target.high < 1e9 else 9.0}), ROWS)[key]
    if target.high < 1e9:
        assert not check(row(**{key: 1.001 * target.high}), ROWS)[key]
    if target.low > 0:
        assert check(row(**{key: 1.001 * target.low}), ROWS)[key]
        assert not check(row(**{key: 0.999 * target.low}), ROWS)[key]


def test_missing_statistics_are_not_judged():
    met = check({"fgd": {"value": None}, "rest": {"value": 1.0}}, ROWS)
    assert met == {"rest": True}


def test_a_deaf_run_misses_the_audit():
    assert not check({**row(), "listening": {"verdicts": ["deaf: no audio changes its motion"]}}, ROWS)["listening"]
    assert "listening" not in check({**row(), "listening": {"skipped": "waveforms"}}, ROWS)


def test_the_default_has_the_must_haves_first():
    far = {**row(), "fgd": {"value": 9.0}}
    tired = row(speed_p50=0.1, jerk_p50=9.0, rest=9.0)
    assert choose_default({"far": far, "tired": tired}, ROWS) == "tired"
    assert choose_default({"tired": tired, "all but one": row(speed_p50=0.1)}, ROWS) == "all but one"
    close = {**row(), "fgd": {"value": 0.5}}
    assert choose_default({"a": row(), "b": close}, ROWS) == "b"
    with pytest.raises(ValueError, match="runs"):
        choose_default({}, ROWS)


def test_resampling_has_no_kinks():
    fps, seconds = 20.0, 5.0
    times = np.arange(round(fps * seconds)) / fps
    recording = talk(2.0, 0)
    skeleton, joints = recording.motion.skeleton, recording.motion.skeleton.joints

    def swing(at: np.ndarray) -> np.ndarray:
        angle = 0.8 * np.sin(2 * np.pi * at)
        rotations = np.tile(np.eye(3, dtype=np.float32), (len(at), joints, 1, 1))
        rotations[:, 16, 0, 0] = rotations[:, 16, 1, 1] = np.cos(angle)
        rotations[:, 16, 0, 1], rotations[:, 16, 1, 0] = -np.sin(angle), np.sin(angle)
        return rotations

    slow = Motion(swing(times), np.zeros((len(times), 3), np.float32), skeleton, fps)
    fast = smooth_resample(slow, 30.0)
    expected = swing(np.arange(150) / 30.0)
    assert fast.fps == 30.0
    assert fast.frames == 150
    np.testing.assert_allclose(fast.rotations[2:-4], expected[2:-4], atol=2e-3)
    assert smooth_resample(slow, fps) is slow


@pytest.fixture(scope="module")
def speech() -> Speech:
    take = talk(12.0, 3)
    return Speech(take.name, take.audio, take.speaker, take.motion, take)


def test_statistics_of_talk(speech):
    assert speech.truth is not None
    still = held(speech.truth.clip(0, 1), speech.truth.frames)
    values = statistics([speech, speech], [[speech.truth, *speech.right_motions(1, 0)]] * 2)
    assert set(values) == set(STATISTICS) - {"fgd", "listening"}
    assert 0.1 < values["speed_p50"]["value"] < values["speed_p90"]["value"] < values["speed_p99"]["value"]
    assert values["agreement_excess"]["value"] > 0.05
    assert values["between_joints"]["value"] > 1.0
    found = agreement_with_null(speech.truth, speech.audio, 16000, sigma=0.1, lead=0.15)
    assert speech.agreement(speech.truth) == found
    frozen = statistics([speech], [[still]])
    assert frozen["rest"]["value"] == 100.0
    assert frozen["speed_p99"]["value"] == 0.0
    assert "between_joints" not in frozen
    assert frozen["rest"]["low"] is None


def test_real_takes_without_a_person(speech):
    found = on_take(speech, [speech.truth, *speech.right_motions(2, 1)])
    assert found["above_null"]["above"]
    assert found["above_null"]["samples"] == 3
    still = held(speech.truth.clip(0, 1), speech.truth.frames)
    assert not on_take(speech, [still])["above_null"]["above"]
    text = real_section({"take": {"seconds": 12.0, "rows": {"demo": found}}}, "")
    assert "### take, 12 s" in text
    assert "3 of 3" in text
    assert "no recordings" in real_section({}, "no recordings")


def test_rows_are_measured_once(tmp_path):
    made = []
    bench = Bench(Talk(held_out_talk(0.5, 5, 30.0).roles, 30.0), feature_network("demo"), 2, 0, tmp_path)
    rows = {one.name: one for one in reference_rows(lambda: bench.speeches, bench.network, 2, 0)}
    counted = Row(RIGHT, lambda number: made.append(number) or rows[RIGHT].draw(number))
    assert bench.work([counted]) == 1
    first = bench.measure(counted, lambda: None)
    assert bench.measure(counted, lambda: None) == json.loads(json.dumps(first))
    assert made == [0]
    assert bench.work([counted]) == 0
    assert first["fgd"]["vectors"] == 7
    other = Bench(bench.talk, bench.network, 2, 1, tmp_path)
    assert other.found(counted) is None


def test_talk_of_the_training_is_refused():
    run = feature_network("demo").run
    seed = run.config.corpus["recipe"]["roles"][0]["seed"]
    with pytest.raises(InputError, match="trained on these speeches"):
        Talk(({"seconds": 60.0, "seed": seed},), 30.0).refuse_trained("demo", run)
    held_out_talk(1.0, 77, 30.0).refuse_trained("demo", run)


def test_the_page():
    rows = {**ROWS, "ours": row(slide=9.0)}
    about = {
        "speeches": 1,
        "minutes": 1.0,
        "source": "talk",
        "fps": 30.0,
        "samples": 2,
        "vectors": 14,
        "network": "abc",
        "command": "python -m experiments.motion",
        "seconds": 9.0,
        "cores": "1 core",
        "default": "ours",
    }
    text = render(about, rows, {"ours": rows})
    assert "| standing feet slide, mm/s | <= 5 | 1.0 | 1.0 | 9.0 ✗ |" in text
    assert "- ours: misses standing feet slide" in text
    assert "**ours**" in text
