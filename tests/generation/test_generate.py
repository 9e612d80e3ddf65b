"""Generation: exact lengths, seeds, windows, and planted roots."""

import jax
import numpy as np
import pytest

from a2g_jax.cli import main
from a2g_jax.errors import InputError
from a2g_jax.generation.export import export
from a2g_jax.generation.formats import chosen_formats
from a2g_jax.generation.generator import Generator
from a2g_jax.geometry.euler import euler_matrices
from a2g_jax.geometry.ground import plant_feet
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget.poses import rotation_angle
from a2g_jax.io.audio import resampled, write_audio
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


def test_short_speech_has_the_same_motion_in_a_short_window(generator):
    """Bit for bit, whether the window has 256 frames or 1024."""
    speech, (short, long) = _SPEECH[: 3 * 16000], (Generator(generator.run) for _ in range(2))
    long.engine.model = long.engine.model._replace(fixed_window=True)
    assert [one.engine.window_of(90) for one in (short, long)] == [256, 1024]
    ours, expected = (one.generate(speech, 2, seed=5) for one in (short, long))
    for motion, other in zip(ours, expected, strict=True):
        np.testing.assert_array_equal(motion.rotations, other.rotations)
        np.testing.assert_array_equal(motion.root, other.root)


def test_short_speech_is_made_in_a_short_window(generator):
    engine = Generator(generator.run).engine
    assert [engine.window_of(frames) for frames in (1, 90, 256, 257, 1024, 5000)] == [256, 256, 256, 512, 1024, 1024]
    assert generator.engine.window_of(5000) == generator.engine.window_of(1) == 128
    fixed = Generator(generator.run).engine
    fixed.model = fixed.model._replace(fixed_window=True)
    assert fixed.window_of(1) == 1024


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


def angles(first, second):
    """Largest angle between the joints of two motions, degrees."""
    return float(rotation_angle(np.asarray(first.rotations), np.asarray(second.rotations)).max())


def test_audio_of_another_rate_is_resampled(generator):
    high = resampled(_SPEECH, 16000, 48000)
    expected = generator.generate(resampled(high, 48000, 16000), 1, seed=3)[0]
    motion = generator.generate(high, 1, seed=3, sample_rate=48000)[0]
    assert motion.frames == generator.frames(high, 48000) == 180
    np.testing.assert_array_equal(motion.rotations, expected.rotations)
    assert angles(motion, generator.generate(_SPEECH, 1, seed=3)[0]) < 5.0
    for rate in (0, -16000, 10):
        with pytest.raises(InputError, match="expected 1000 to 1000000 Hz"):
            generator.generate(high, 1, sample_rate=rate)


def test_integers_are_scaled(generator):
    whole = np.rint(32767 * _SPEECH).astype(np.int16)
    assert angles(generator.generate(whole, 1)[0], generator.generate(_SPEECH, 1)[0]) < 0.1


@pytest.mark.parametrize("shape", [(96000, 2), (2, 96000)])
def test_several_channels_are_one_clear_error(generator, shape, tmp_path):
    both = np.resize(_SPEECH, 192000).reshape(shape)
    for call in (
        lambda: generator.generate(both, 1),
        lambda: generator.generate(both, 1, sample_rate=48000),
        lambda: next(generator.stream(both, 1)),
        lambda: generator.frames(both),
        lambda: export(generator.run, generator, both, tmp_path, samples=1, seed=0, formats=("bvh",), title="a"),
    ):
        with pytest.raises(InputError, match="2 channels, and one is expected; average them"):
            call()


@pytest.mark.parametrize("offset", [0.02, -0.2])
def test_an_offset_and_the_level_change_nothing(generator, offset):
    plain = generator.generate(_SPEECH, 1, seed=3)[0]
    for gain in (1.0, 0.001):
        moved = (gain * (_SPEECH + offset)).astype(np.float32)
        assert angles(generator.generate(moved, 1, seed=3)[0], plain) < 0.2


def test_the_commands_warn_before_they_generate(tmp_path, capsys):
    """Of noise, and of two channels, one of which can be chosen; the motion is written nevertheless."""
    import soundfile

    noise = 0.1 * np.random.default_rng(0).normal(size=3 * 16000)
    soundfile.write(tmp_path / "noise.wav", noise, 16000)
    flags = ["--samples", "1", "--formats", "bvh", "--out", str(tmp_path / "out")]
    assert main(["generate", "demo", "--audio", str(tmp_path / "noise.wav"), *flags]) == 0
    assert "warning:" in (said := capsys.readouterr().err)
    assert "no speech is found" in said
    both = np.stack([_SPEECH, talk(6.0, 22, speaker="bruno").audio], axis=1)
    soundfile.write(tmp_path / "both.wav", both, 16000, subtype="FLOAT")
    for channel, warned in ((None, True), ("right", False)):
        given = [] if channel is None else ["--channel", channel]
        assert main(["generate", "demo", "--audio", str(tmp_path / "both.wav"), *given, *flags]) == 0
        assert ("left and right differ" in capsys.readouterr().err) == warned
    assert main(["generate", "demo", "--audio", str(tmp_path / "both.wav"), "--channel", "3", *flags]) == 2
    assert "channel 3 was chosen" in capsys.readouterr().err
