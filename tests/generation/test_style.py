"""Styles and seed poses of the flow: encoding inverts generation; statistics of shares and blends; no seams."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from flows_for_tests import clip, part, run_of
from hypothesis import given
from hypothesis import strategies as st

from a2g_jax.cli import main
from a2g_jax.errors import InputError
from a2g_jax.generation.engine import LANES
from a2g_jax.generation.generator import Generator
from a2g_jax.generation.stylized_flow.latent_space import FlowSpace
from a2g_jax.generation.stylized_flow.style import Style, blend, drive, there_and_back
from a2g_jax.io.audio import write_audio
from a2g_jax.io.bvh import write_bvh
from a2g_jax.talker.recordings import talk
from a2g_jax.training.run import demo_run, save_run


@cache
def space_of(pose="6d", window=128):
    return FlowSpace(run_of(pose), window)


def repeated(rows, frames=3):
    """The first pose, repeated for the length of the history."""
    return np.repeat(rows[:1], frames, axis=0)


@pytest.mark.parametrize("pose", ["6d", "exponential", "directions"])
def test_a_clip_comes_back_from_its_latents(pose):
    space, own = space_of(pose), clip(pose)
    style = Style(space.encode_rows(own.rows, own.features))
    assert style.latents.shape == (90, own.rows[0].size)
    (made,) = space.rows(own.features, 1, seed=4, style=style, seed_rows=repeated(own.rows))
    np.testing.assert_allclose(made, own.rows, atol=1e-3)
    # Another history or other speech does not reproduce it: both are conditions.
    (elsewhere,) = space.rows(own.features, 1, seed=4, style=style)
    assert np.abs(elsewhere[:5] - own.rows[:5]).max() > 1e-2
    (other,) = space.rows(clip(pose, seed=2).features, 1, seed=4, style=style, seed_rows=repeated(own.rows))
    assert np.abs(other - own.rows).max() > 1e-2


def test_a_motion_comes_back_and_one_of_another_rate_is_brought_to_the_runs():
    space, own = space_of(), clip()
    style = Style(space.encode(own.motion, own.audio))
    (made,) = space.rows(own.features, 1, style=style, seed_rows=repeated(own.rows))
    np.testing.assert_allclose(space.run.config.space.read(made), own.motion.rotations, atol=1e-2)
    doubled = replace(own.motion, rotations=own.motion.rotations.repeat(2, 0), root=own.motion.root.repeat(2, 0))
    np.testing.assert_allclose(space.encode(replace(doubled, fps=60.0), own.audio), style.latents, atol=2e-2)
    fingers = talk(3.0, 4, fps=60.0, fingers=True).motion
    assert space.encode(fingers).shape == (90, 132)


def test_seeds_are_the_history():
    """Encoding recovers the draws of a sample with its seed poses, and with no others."""
    # Not of 6D poses, which are made valid after they are drawn.
    space, own, longer = (of("exponential") for of in (space_of, clip, lambda pose: clip(pose, 120, 2)))
    (plain,) = space.rows(own.features, 1, seed=9)
    (made,) = space.rows(own.features, 1, seed=9, seed_rows=longer.rows)
    mean = np.asarray(space.run.config.statistics["pose"].mean)[None]
    drawn = space.encode_rows(plain, own.features, before=repeated(mean))
    np.testing.assert_allclose(space.encode_rows(made, own.features, before=longer.rows[-3:]), drawn, atol=2e-2)
    for wrong in (repeated(mean), longer.rows[-4:-1], longer.rows[-3:][::-1]):
        assert np.abs(space.encode_rows(made, own.features, before=wrong) - drawn)[:3].max() > 5e-2


@pytest.mark.parametrize("mode", ["repeat", "statistics"])
def test_without_style_it_is_plain_generation(mode):
    space, own = space_of(), clip()
    style = Style(space.encode_rows(own.rows), mode, share=0.0)
    made = list(space.rows(own.features, 2, seed=3, style=style))
    for ours, theirs in zip(made, Generator(space.run).rows(own.features, 2, seed=3), strict=True):
        np.testing.assert_allclose(ours, theirs, atol=1e-4)


def test_windows_leave_no_seam_and_no_length_compiles_anew():
    small, large = space_of(), space_of(window=256)
    own, long = clip(), clip(frames=180, seed=3)
    style = Style(small.encode_rows(own.rows, own.features), share=0.5)
    np.testing.assert_allclose(small.encode_rows(long.rows), large.encode_rows(long.rows), atol=1e-3)
    (ours,), (theirs,) = (list(space.rows(long.features, 1, 5, style)) for space in (small, large))
    np.testing.assert_allclose(ours, theirs, atol=1e-3)
    program = small.generator.engine._advance
    compiled = program._cache_size()
    for frames in (20, 100):
        shorter = Style(small.encode_rows(own.rows[:frames], own.features[:frames]), "statistics", 0.9)
        assert next(small.rows(long.features[: 2 * frames - 20], 1, 5, shorter)).shape == (2 * frames - 20, 22, 6)
    assert program._cache_size() == compiled == 1
    assert small._encoder._encode._cache_size() == 2  # one window, and two for the long clip


def test_a_sample_is_the_same_however_many_there_are():
    space, own = space_of(), clip()
    style = Style(space.encode_rows(own.rows, own.features), "statistics")
    many = list(space.rows(own.features, LANES + 2, 7, style))
    np.testing.assert_array_equal(many[0], next(space.rows(own.features, 1, 7, style)))
    np.testing.assert_array_equal(many[LANES], list(space.rows(own.features, LANES + 1, 7, style))[LANES])
    for number in range(1, len(many)):
        assert np.abs(many[number] - many[0]).max() > 1e-2
    assert np.abs(next(space.rows(own.features, 1, 8, style)) - many[0]).max() > 1e-2


def test_controls_are_the_clips_own_in_encoding_and_the_requested_ones_in_generation():
    own, plain = clip("exponential"), space_of("exponential")
    space = FlowSpace(run_of("exponential", ("height",)), 128)
    moved = own.rows.copy()
    moved[60:] = moved[60:61]
    change = space.encode_rows(moved, own.features) - space.encode_rows(own.rows, own.features)
    # An average over seconds also changes for the frames before those that changed; the pose history does not.
    assert np.abs(change)[20:50].max() > 1e-4
    change = plain.encode_rows(moved, own.features) - plain.encode_rows(own.rows, own.features)
    assert np.abs(change)[:60].max() < 1e-5
    (plainly,) = Generator(space.run).rows(own.features, 1, seed=2)
    np.testing.assert_allclose(next(space.rows(own.features, 1, seed=2)), plainly, atol=1e-4)


@given(st.integers(1, 60), st.integers(1, 12))
def test_there_and_back(frames, length):
    at = there_and_back(frames, length)
    assert at[0] == 0
    assert np.all((at >= 0) & (at < length))
    if length > 1:
        assert np.all(np.abs(np.diff(at)) == 1)
        np.testing.assert_array_equal(at[:length], np.arange(length)[:frames])


def latents(seed, frames=50, channels=6):
    """Latents of a clip with a style of its own: a mean and a standard deviation for every channel."""
    rng = np.random.default_rng(seed)
    normal = rng.normal(size=(frames, channels)) * rng.uniform(0.3, 1.5, channels) + rng.normal(size=channels)
    return normal.astype(np.float32)


@given(st.floats(0.0, 1.0), st.sampled_from(["repeat", "statistics"]), st.integers(0, 9))
def test_a_share_keeps_the_power(share, mode, seed):
    """The rest of the power is the noise's: clips of average power 1 give latents of power 1."""
    style = Style(latents(seed), mode, share)
    base, gain = drive(style, 50, 6)
    power = np.square(base).mean(axis=0) + np.square(gain).mean(axis=0)
    np.testing.assert_allclose(power - 1.0, share**2 * (np.square(style.latents).mean(axis=0) - 1.0), atol=1e-5)


def test_full_shares():
    style = Style(latents(1))
    base, gain = drive(style, 120, 6)
    np.testing.assert_array_equal(base[:50], style.latents)
    np.testing.assert_array_equal(base[50:99], style.latents[-2::-1])
    np.testing.assert_array_equal(gain, 0.0)
    base, gain = drive(replace(style, mode="statistics"), 120, 6)
    np.testing.assert_allclose(base, np.tile(style.mean, (120, 1)), atol=1e-6)
    np.testing.assert_allclose(gain, np.tile(style.std, (120, 1)), atol=1e-6)


def test_blends_end_at_their_styles():
    first, second = Style(latents(1), "statistics", 0.6), Style(latents(2, 80))
    for share, end in ((0.0, first), (1.0, second)):
        mixed = blend(first, second, share)
        np.testing.assert_array_equal(mixed.latents, end.latents)
        assert (mixed.mode, mixed.share) == ("statistics", 0.6)
    # And converge to them, up to the repetitions of the shorter one.
    near = blend(first, second, 1e-4)
    np.testing.assert_allclose(near.latents[:50], first.latents, atol=0.3)
    np.testing.assert_allclose(blend(first, second, 1 - 1e-4).latents, second.latents, atol=1e-2)


@given(st.floats(0.0, 1.0), st.integers(0, 9))
def test_a_style_blended_with_itself_stays(share, seed):
    style = Style(latents(seed))
    np.testing.assert_allclose(blend(style, style, share).latents, style.latents, atol=1e-4)


@given(st.floats(0.01, 0.99), st.integers(0, 9))
def test_blends_do_not_shrink(share, seed):
    first, second = Style(latents(seed, 80)), Style(latents(100 + seed, 80))
    mixed, length = blend(first, second, share), np.linalg.norm
    assert length(mixed.mean) == pytest.approx((1 - share) * length(first.mean) + share * length(second.mean), rel=1e-3)
    angle = 0.5 * np.pi * share
    expected = np.square(np.cos(angle) * first.std) + np.square(np.sin(angle) * second.std)
    np.testing.assert_allclose(np.square(mixed.std), expected, rtol=1e-3)


def test_opposite_means_meet_in_the_middle():
    style = Style(latents(3))
    np.testing.assert_allclose(blend(style, replace(style, latents=-style.latents), 0.5).mean, 0.0, atol=1e-5)


def test_refusals():
    space, own = space_of(), clip()
    with pytest.raises(InputError, match="run of audio2gestures has no latents of frames"):
        FlowSpace(demo_run())
    with pytest.raises(InputError, match="no style mode 'loop'"):
        Style(latents(1), "loop")
    with pytest.raises(InputError, match=r"expected 0 to 1; got 1\.5"):
        Style(latents(1), share=1.5)
    with pytest.raises(InputError, match=r"in a blend: expected 0 to 1; got -0\.1"):
        blend(Style(latents(1)), Style(latents(2)), -0.1)
    with pytest.raises(InputError, match="6 and 7 channels"):
        blend(Style(latents(1)), Style(latents(2, channels=7)), 0.5)
    with pytest.raises(InputError, match="6 channels, the run 132"):
        next(space.rows(own.features, 1, style=Style(latents(1))))
    with pytest.raises(InputError, match="are 2 frames; the run needs 3"):
        next(space.rows(own.features, 1, seed_rows=own.rows[:2]))
    with pytest.raises(InputError, match="90 poses and 80 rows of audio"):
        space.encode_rows(own.rows, own.features[:80])
    with pytest.raises(InputError, match=r"audio lasts 1\.00 s and its motion 3\.00 s"):
        space.encode(own.motion, own.audio[:16000])
    with pytest.raises(InputError, match="less than a frame"):
        space.generate(own.audio[:10], 1)
    with pytest.raises(InputError, match="directions, which have no skeleton"):
        space_of("directions").encode(own.motion)


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A run, speech, and clips."""
    folder = tmp_path_factory.mktemp("styled")
    save_run(folder / "run", run_of())
    write_audio(folder / "speech.wav", talk(3.0, 8).audio, 16000)
    write_audio(folder / "clip.wav", clip().audio, 16000)
    write_bvh(folder / "clip.bvh", clip().motion)
    write_bvh(folder / "other.bvh", clip(seed=2).motion)
    write_bvh(folder / "blink.bvh", part(clip().motion, 0, 2))
    return folder


def test_from_the_command_line(files, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(files)
    command = ["generate", "run", "--audio", "speech.wav", "--samples", "2", "--out", str(tmp_path / "out")]
    style = ["--style", "clip.bvh", "--style-audio", "clip.wav", "--style-share", "0.9"]
    blended = ["--style-with", "other.bvh", "--style-mix", "0.3", "--style-mode", "statistics"]
    assert main([*command, *style, *blended, "--seed-clip", "other.bvh"]) == 0
    output = capsys.readouterr().out
    assert "other.bvh: encoded with silence; give its speech with --style-with-audio" in output
    assert "clip.bvh: encoded" not in output
    page = (tmp_path / "out" / "index.html").read_text()
    assert "style of clip.bvh and other.bvh (0.3), share 0.9, statistics, continuing other.bvh" in page
    first, second = (np.load(tmp_path / "out" / f"sample_0{number}.npz")["rotations"] for number in (0, 1))
    assert first.shape == (90, 22, 3, 3)
    assert np.abs(first - second).max() > 1e-2
    assert (tmp_path / "out" / "sample_01.bvh").exists()
    # The flags give the same motion as the modules with the same numbers.
    space, own = FlowSpace(run_of()), clip()
    ours = space.style(own.motion, own.audio, "statistics", 0.9)
    mixed = blend(ours, space.style(clip(seed=2).motion), 0.3)
    made = space.generate(talk(3.0, 8).audio, 2, style=mixed, seed_poses=clip(seed=2).motion)
    # BVH has six decimals, and the check smooths what is too fast.
    differences = np.abs(made[1].rotations - second)
    print(
        "DEBUG",
        np.median(differences),
        differences.mean(),
        np.mean(differences > 1e-3),
        np.median(np.abs(first - second)),
    )
    assert np.median(differences) < 1e-3 < np.median(np.abs(first - second))


@pytest.mark.parametrize(
    ("flags", "message"),
    [
        (["--style-share", "0.5"], "--style-share is for --style; name a clip."),
        (["--style", "clip.bvh", "--style-mix", "0.5"], "--style-mix is for --style-with; name a second clip."),
        (["--style", "nowhere.bvh"], "nowhere.bvh"),
        (["--style", "clip.bvh", "--style-audio", "nowhere.wav"], "nowhere.wav"),
        (["--style", "blink.bvh"], "--style blink.bvh: lasts 0.07 s; give a clip of 1 s or more."),
        (["--seed-clip", "blink.bvh"], "--seed-clip blink.bvh: has 2 frames at the run's 30 fps; give a clip of 3"),
        (
            ["--style", "clip.bvh", "--pin", "clip.bvh@0", "--pin-mode", "latent"],
            "--pin-mode latent is for runs of audio",
        ),
    ],
)
def test_bad_usage_from_the_command_line(files, tmp_path, capsys, monkeypatch, flags, message):
    monkeypatch.chdir(files)
    assert main(["generate", "run", "--audio", "speech.wav", "--out", str(tmp_path / "out"), *flags]) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_run_of_another_model_has_no_style(files, tmp_path, capsys):
    command = ["generate", "demo", "--audio", str(files / "speech.wav"), "--out", str(tmp_path / "out")]
    assert main([*command, "--style", str(files / "clip.bvh")]) == 2
    assert "use a run of stylized_flow" in capsys.readouterr().err
