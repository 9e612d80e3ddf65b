"""Films with sound."""

import subprocess
from contextlib import nullcontext

import numpy as np
import pytest

from a2g_jax.errors import InputError, Interrupted
from a2g_jax.geometry.motion import Motion
from a2g_jax.progress import watched
from a2g_jax.talker.skeleton import TALKER_SKELETON
from a2g_jax.viz.player import video


def standing(frames=8, fps=10.0):
    """A figure that raises an arm."""
    rotations = np.tile(np.eye(3, dtype=np.float32), (frames, 22, 1, 1))
    for frame in range(frames):
        angle = 1.2 * (frame / (frames - 1) - 0.5)
        cosine, sine = np.cos(angle), np.sin(angle)
        rotations[frame, TALKER_SKELETON.index("L_Shoulder")] = [[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]]
    root = np.tile(np.array([0, 0.93, 0], np.float32), (frames, 1))
    return Motion(rotations, root, TALKER_SKELETON, fps)


@pytest.fixture
def tools():
    try:
        video.check_video()
    except InputError as error:
        pytest.skip(str(error))


@pytest.mark.slow
@pytest.mark.browser
def test_a_film_has_every_frame_and_the_sound(tools, tmp_path):
    tone = 0.3 * np.sin(2 * np.pi * 440 * np.arange(12_800) / 16_000).astype(np.float32)
    path = tmp_path / "film.mp4"
    video.write_video(path, standing(), tone, 16_000)
    ffmpeg = video.find_ffmpeg()
    size = video.SIZE
    command = [ffmpeg, "-v", "error", "-i", path, "-f", "rawvideo", "-pix_fmt", "rgb24", "pipe:1"]
    raw = subprocess.run(command, capture_output=True, check=True).stdout
    frames = np.frombuffer(raw, np.uint8).reshape(-1, size, size, 3).astype(int)
    assert len(frames) == 8
    assert frames[0].std() > 20  # a figure on a floor
    changes = np.abs(np.diff(frames, axis=0)).mean(axis=(1, 2, 3))
    assert np.all(changes > 0.1)
    sound = subprocess.run(
        [ffmpeg, "-v", "error", "-i", path, "-f", "f32le", "-ac", "1", "pipe:1"], capture_output=True, check=True
    ).stdout
    samples = np.frombuffer(sound, np.float32)
    assert 0.75 <= len(samples) / 16_000 <= 0.95
    assert 0.15 < samples[4000:8000].std() < 0.25


@pytest.mark.parametrize("program", ["ffmpeg", "browser"])
def test_a_missing_program_is_named_with_the_remedy(program, tmp_path, monkeypatch):
    pytest.importorskip("playwright")
    monkeypatch.setattr(video, "find_browser", lambda: None if program == "browser" else __file__)
    monkeypatch.setattr(video, "find_ffmpeg", lambda: None)
    with pytest.raises(InputError, match="A2G_CHROMIUM" if program == "browser" else r"a2g_jax\[video\]"):
        video.write_video(tmp_path / "film.mp4", standing(), (), 16_000)
    assert list(tmp_path.iterdir()) == []


def test_an_encoder_that_fails_is_an_error_and_leaves_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr(video, "check_video", lambda: None)
    monkeypatch.setattr(video, "find_ffmpeg", lambda: "false")
    monkeypatch.setattr(video, "page_pictures", lambda page, times, script: (b"x" * 100_000 for _ in times))
    with pytest.raises(InputError, match="ffmpeg could not encode"):
        video.write_video(tmp_path / "film.mp4", standing(), (), 16_000)
    assert list(tmp_path.iterdir()) == []


def test_films_of_hours_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(video, "check_video", lambda: None)
    monkeypatch.setattr(video, "MOST_FRAMES", 5)
    with pytest.raises(InputError, match="5 at most"):
        video.write_video(tmp_path / "film.mp4", standing(), (), 16_000)


def drawn_until(frame, error):
    """A replacement of ``page_pictures`` that fails at a frame."""

    def pictures(page, times, script):
        for number in range(len(times)):
            if number == frame:
                raise error
            yield b"x" * 1000

    return pictures


@pytest.mark.parametrize("interruption", [KeyboardInterrupt(), Interrupted("cancelled")])
def test_an_interrupted_film_leaves_nothing(tmp_path, monkeypatch, interruption):
    monkeypatch.setattr(video, "check_video", lambda: None)
    monkeypatch.setattr(video, "find_ffmpeg", lambda: "cat")
    monkeypatch.setattr(video, "page_pictures", drawn_until(3, interruption))
    with pytest.raises(type(interruption)):
        video.write_video(tmp_path / "film.mp4", standing(), (), 16_000)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("server", [False, True])
def test_frames_are_counted_on_a_bar_or_by_the_server_that_watches(tmp_path, monkeypatch, capsys, server):
    monkeypatch.setattr(video, "check_video", lambda: None)
    monkeypatch.setattr(video, "page_pictures", drawn_until(8, None))
    monkeypatch.setattr(video, "_encoder", lambda path, fps, speech: path.open("wb"))
    steps = []
    with watched(lambda *step: steps.append(step)) if server else nullcontext():
        video.write_video(tmp_path / "film.mp4", standing(), (), 16_000)
    shown = capsys.readouterr().err
    if server:
        assert steps == [(done, 8, "frame") for done in range(1, 9)]
        assert shown == ""
    else:
        assert "drawing film.mp4" in shown
        assert "8/8" in shown
