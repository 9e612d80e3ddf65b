"""The window loop: every field of a condition reaches the windows, cut to their frames."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from a2g_jax.errors import Interrupted
from a2g_jax.features.dynamics import EDGES, Dynamics
from a2g_jax.generation import engine as engine_module
from a2g_jax.generation.engine import Engine
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.models.base import Condition, Model, Stage, Update
from a2g_jax.progress import watched
from a2g_jax.training.run_config import Run, RunConfig

FRAMES, RATE = 300, 16000 / 30


def recorder(space):
    """A model whose pose has the fields of its condition, one in each value of the first joint."""
    rows, width = space.shape

    def condition(params, summary, given):
        frames = given.audio.shape[0]
        # 16000 / 30 is no whole number, so the sample in the middle of a frame is only nearly the frame's.
        middle = jnp.arange(frames) * RATE + RATE / 2
        sound = jnp.interp(middle, jnp.arange(len(given.waveform)), given.waveform)
        columns = [given.emotion[:, 1], given.words, sound, jnp.full(frames, given.speaker)]
        columns.append(jnp.full(frames, given.seed_poses[-1, 0, 0]))
        return jnp.stack([*columns, jnp.arange(frames) * 1.0], axis=-1)

    def sample(params, summary, key, given, start):
        return jnp.zeros((len(given), rows, width)).at[:, 0, :6].set(given)

    return Model(
        "recorder",
        None,
        clip_frames=16,
        halo=3,
        init=lambda key: {},
        stages=(Stage((Update(lambda *_: (jnp.zeros(()), {})),)),),
        summarise=lambda *_: {},
        condition=condition,
        condition_fields=("audio", "waveform", "emotion", "speaker", "words", "seed_poses"),
        sample=sample,
        seed_frames=2,
    )


@pytest.mark.parametrize("window", [128, 512])
def test_windows_hold_their_frames(toy_run_config, window, monkeypatch):
    monkeypatch.setattr(RunConfig, "build", lambda config: recorder(config.space))
    monkeypatch.setattr(PoseSpace, "valid", lambda space, pose: pose)
    config = toy_run_config()
    engine = Engine(Run(config, {}, {}, 0), window)
    rng = np.random.default_rng(0)
    ramp = np.linspace(0.0, 1.0, FRAMES, dtype=np.float32)
    given = Condition(
        audio=rng.normal(size=(FRAMES, config.mel.width)).astype(np.float32),
        waveform=np.repeat(ramp, 534)[: round(FRAMES * RATE)],
        emotion=np.stack([1.0 - ramp, ramp], axis=-1),
        speaker=np.int32(3),
        words=np.arange(FRAMES, dtype=np.int32),
        seed_poses=np.full((5, *config.space.shape), 7.0, np.float32),
    )
    (rows,) = engine.rows(given, 1)
    np.testing.assert_allclose(rows[:, 0, 0], ramp, atol=1e-6)
    np.testing.assert_array_equal(rows[:, 0, 1], np.arange(FRAMES))
    np.testing.assert_allclose(rows[:, 0, 2], ramp, atol=0.01)
    assert set(rows[:, 0, 3]) == {3.0}
    assert set(rows[:, 0, 4]) == {7.0}


def test_generation_ends_between_windows_where_a_watcher_raises(toy_run_config, monkeypatch):
    monkeypatch.setattr(RunConfig, "build", lambda config: recorder(config.space)._replace(seed_frames=0))
    config = toy_run_config()
    engine, drawn = Engine(Run(config, {}, {}, 0), 128), []
    monkeypatch.setattr(engine, "_condition", lambda *_: None)
    monkeypatch.setattr(engine, "_sample", lambda *arguments: drawn.append(1) or np.zeros((128, *config.space.shape)))

    def watcher(done, total, unit):
        if len(drawn) == 2:
            raise Interrupted("enough")

    given = Condition(audio=np.zeros((FRAMES, config.mel.width), np.float32))
    with watched(watcher), pytest.raises(Interrupted, match="enough"):
        list(engine.rows(given, 5))
    assert len(drawn) == 2
    assert len(list(engine.rows(given, 1))) == 1


def test_samples_are_the_same_whatever_their_number_and_few_windows_are_ahead(toy_run_config, monkeypatch):
    monkeypatch.setattr(RunConfig, "build", lambda config: recorder(config.space)._replace(seed_frames=0))
    config = toy_run_config()
    engine, drawn = Engine(Run(config, {}, {}, 0), 128), []

    def sample(params, summary, key, given, start):
        drawn.append(int(start))
        number = float(jax.random.uniform(key)) + int(start)
        return np.full((128, *config.space.shape), number, np.float32)

    monkeypatch.setattr(engine, "_condition", lambda *_: None)
    monkeypatch.setattr(engine, "_sample", sample)
    given = Condition(audio=np.zeros((FRAMES, config.mel.width), np.float32))
    stream = engine.rows(given, 4)
    first = next(stream)
    assert 3 <= len(drawn) <= 3 + engine_module._AHEAD
    rest = list(stream)
    # Three windows of each of four samples, each drawn once.
    starts = [start - drawn[0] for start in drawn]
    assert starts == [0, 128, 256] * 4
    assert len({float(rows[0, 0, 0]) for rows in (first, *rest)}) == 4
    for rows in (first, *rest):
        np.testing.assert_allclose(rows[128::128, 0, 0] - rows[:-128:128, 0, 0], 128.0, atol=1e-3)
    np.testing.assert_array_equal(next(engine.rows(given, 1)), first)
    np.testing.assert_array_equal(list(engine.rows(given, 3))[2], rest[1])


def test_gains_of_a_run_act_on_the_whole_motion(toy_run_config, monkeypatch):
    """Whatever the windows, they are those of the motion in one piece, and another sample does not matter."""

    def build(config):
        model = recorder(config.space)
        # The last value counts the frames of a window.
        return model._replace(sample=lambda *given: model.sample(*given).at[:, 0, 5].set(1.0))

    monkeypatch.setattr(RunConfig, "build", build)
    monkeypatch.setattr(PoseSpace, "valid", lambda space, pose: pose)
    config = toy_run_config()
    rows, width = config.space.shape
    levels = np.broadcast_to(np.linspace(-3.0, 3.0, 4), (len(EDGES), rows, 4))
    ones = np.ones((rows, width))
    gains = Dynamics(
        mean=0.1 * ones,
        shift=0.02 * ones,
        std=ones,
        weight=np.ones(rows),
        slow=np.full(rows, 0.2),
        levels=levels,
        gains=levels * 0.2,
        speed_levels=levels[0, 0],
        speed_gains=np.array([-1.0, -0.5, 0.0, 0.0]),
    )
    ramp = np.linspace(0.2, 1.0, FRAMES, dtype=np.float32)
    given = Condition(
        audio=np.zeros((FRAMES, config.mel.width), np.float32),
        waveform=np.zeros(round(FRAMES * RATE), np.float32),
        emotion=np.stack([1.0 - ramp, ramp + 0.3 * np.sin(ramp * 60.0)], axis=-1),
        speaker=np.int32(1),
        words=np.ones(FRAMES, np.int32),
        seed_poses=np.full((5, *config.space.shape), 0.5, np.float32),
    )
    plain = Run(config, {}, {}, 0)
    run = dataclasses.replace(plain, dynamics=gains)
    (whole,) = Engine(run, 512).rows(given, 1)
    parts = list(Engine(run, 128).rows(given, 2))
    np.testing.assert_allclose(parts[0], whole, atol=1e-5)
    (before,) = Engine(plain, 512).rows(given, 1)
    assert before.shape == whole.shape
    np.testing.assert_allclose(whole, run.finished(before), atol=1e-5)
    assert np.abs(whole - before).max() > 0.1
