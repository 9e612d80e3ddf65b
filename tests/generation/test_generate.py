"""Generation: exact lengths, seeds, windows, and planted roots."""

import jax
import numpy as np
import pytest

from a2g_jax.cli import main
from a2g_jax.errors import InputError
from a2g_jax.generation.formats import chosen_formats
from a2g_jax.generation.generator import Generator
from a2g_jax.geometry.euler import euler_matrices
from a2g_jax.geometry.ground import plant_feet
from a2g_jax.geometry.motion import Motion
from a2g_jax.io.audio import write_audio
from a2g_jax.talker.recordings import talk
from a2g_jax.talker.skeleton import TALKER_SKELETON
from a2g_jax.training.run import Run
from a2g_jax.training.validation import collect_summary

_SPEECH = talk(6.0, 21).audio


@pytest.fixture(scope="module")
def generator(toy_run_config, toy_corpus):
    """Windows of 128 frames, so that short audio already has several."""
    config = toy_run_config()
    config = config.with_sampling(redraw_frames=32)
    model = config.build()
    params = jax.jit(model.init)(jax.random.key(0))
    summary = collect_summary(model, params, toy_corpus, config)
    return Generator(Run(config, jax.device_get(params), summary, 0), window=128)


@pytest.mark.parametrize("samples", [1, 533, 16000, 70001])
def test_frames_are_seconds_times_fps(generator, samples):
    audio = np.resize(_SPEECH, samples).astype(np.float32)
    expected = round(samples / 16000 * 30)
    if expected == 0:
        with pytest.raises(InputError, match="less than a frame"):
            generator.generate(audio, 1)
    else:
        assert generator.generate(audio, 1)[0].frames == expected


def test_seeds(generator):
    first = generator.generate(_SPEECH, 4, seed=3)
    alone = generator.generate(_SPEECH, 1, seed=3)[0]
    np.testing.assert_array_equal(first[0].rotations, alone.rotations)
    np.testing.assert_array_equal(first[0].root, alone.root)
    assert np.abs(first[0].rotations - first[1].rotations).max() > 1e-3
    other = generator.generate(_SPEECH, 1, seed=4)[0]
    assert np.abs(other.rotations - alone.rotations).max() > 1e-3


def test_windows_leave_no_seam(generator):
    """The same motion comes out of one window over the whole audio."""
    windowed = generator.generate(_SPEECH, 1, seed=5)[0]
    whole = Generator(generator.run, window=256).generate(_SPEECH, 1, seed=5)[0]
    assert windowed.frames == 180 > 128
    np.testing.assert_allclose(windowed.rotations, whole.rotations, atol=1e-5)


def test_no_new_length_compiles_again(generator):
    generator.generate(_SPEECH, 1)
    compiled = generator.engine._sample._cache_size()
    for seconds in (1.0, 2.5, 5.9):
        generator.generate(_SPEECH[: int(seconds * 16000)], 1)
    assert generator.engine._sample._cache_size() == compiled == 1
    assert generator.engine._condition._cache_size() == 1


def test_rotations_are_rotations(generator):
    rotations = generator.generate(_SPEECH, 1)[0].rotations
    identity = rotations @ np.swapaxes(rotations, -1, -2)
    np.testing.assert_allclose(identity, np.broadcast_to(np.eye(3), identity.shape), atol=1e-5)
    np.testing.assert_allclose(np.linalg.det(rotations), 1.0, atol=1e-5)


def test_feet_stay_when_hips_sway():
    frames = 90
    tilt = 0.05 * np.sin(np.arange(frames) / 10)
    rotations = np.tile(np.eye(3, dtype=np.float32), (frames, 22, 1, 1))
    roll = euler_matrices(np.degrees(tilt)[:, None], "Z").astype(np.float32)
    rotations[:, 0] = roll
    rotations[:, [1, 2]] = np.swapaxes(roll, -1, -2)[:, None]
    motion = Motion(rotations, np.zeros((frames, 3), np.float32), TALKER_SKELETON, 30.0)
    mean_root = np.array([0.3, 0.9, -0.2], np.float32)
    planted = plant_feet(motion, mean_root, np.tile(np.eye(3, dtype=np.float32), (22, 1, 1)))
    ankles = planted.positions()[:, [7, 8]].mean(axis=1)
    assert np.abs(ankles - ankles.mean(axis=0)).max() < 2e-3
    # Under the mean pose: x and z of the mean root do not matter, its height does.
    assert planted.positions()[:, 0, 1].mean() == pytest.approx(0.9, abs=0.01)
    assert abs(planted.positions()[:, 0, 0].mean()) < 0.01


def test_skeletons_without_ankles_stand_still():
    from a2g_jax.geometry.skeleton import Skeleton

    skeleton = Skeleton(np.ones((2, 3), np.float32), ("tail", "tip"), (-1, 0))
    motion = Motion(np.tile(np.eye(3, dtype=np.float32), (5, 2, 1, 1)), np.zeros((5, 3), np.float32), skeleton, 30.0)
    root = plant_feet(motion, np.array([1.0, 2.0, 3.0], np.float32), np.asarray(motion.rotations)[0]).root
    np.testing.assert_array_equal(root, np.tile([0.0, 2.0, 0.0], (5, 1)))


def test_formats():
    assert chosen_formats("bvh, HTML", ("bvh", "npz", "html")) == ("bvh", "html")
    for text in ("", "fbx", "bvh;npz"):
        with pytest.raises(InputError, match="no format"):
            chosen_formats(text, ("bvh", "npz", "html"))


def test_edits_of_bands_from_the_command_line(tmp_path, capsys):
    """Flags change the motion as the setting does; an invalid edit is refused before anything is written."""
    write_audio(tmp_path / "speech.wav", talk(5.0, 3).audio, 16000)
    command = ["generate", "demo", "--audio", str(tmp_path / "speech.wav"), "--samples", "1", "--formats", "npz"]

    def places(name, *flags):
        assert main([*command, "--out", str(tmp_path / name), *flags]) == 0
        return np.load(tmp_path / name / "sample_00.npz")["positions"]

    plain, same = places("plain"), places("same", "--keep-shared", "128", "--edit", "specific scale 0:128 1")
    np.testing.assert_allclose(same, plain, atol=1e-3)
    still = places("still", "--keep-shared", "1", "--keep-specific", "1")
    assert np.abs(np.diff(still, axis=0)).mean() < 0.5 * np.abs(np.diff(plain, axis=0)).mean()
    capsys.readouterr()
    for flags, message in (
        (["--edit", "specific swap 0:4"], "from Python only"),
        (["--keep-shared", "300"], "there are 128 bands"),
        (["--edit", "louder"], "it begins with 'shared' or 'specific'"),
    ):
        assert main([*command, "--out", str(tmp_path / "none"), *flags]) == 2
        assert message in capsys.readouterr().err
    assert not (tmp_path / "none").exists()
