"""What ``a2g inspect`` says of speech, and what is printed before motion is generated."""

import numpy as np
import pytest
import soundfile

from a2g_jax.cli.inspect import add_arguments, run
from a2g_jax.cli.speech import read_speech
from a2g_jax.inspection.inspect import inspect
from a2g_jax.io.audio import write_audio
from a2g_jax.io.textgrid import write_words
from a2g_jax.io.words import Word
from a2g_jax.talker.recordings import talk
from tests.inspection.recordings_for_tests import codes
from tests.io.wav_for_tests import tone, wav_bytes

RATE = 16000


@pytest.fixture(scope="module")
def voices():
    return tuple(talk(8.0, seed, speaker=name).audio for seed, name in ((5, "ada"), (6, "bruno")))


def written(path, samples):
    soundfile.write(path, samples, RATE, subtype="FLOAT")
    return path


def faulty(name, voices):
    """Samples with a fault, and the code of the warning."""
    voice, other = (audio / np.abs(audio).max() for audio in voices)
    return {
        "tone": (tone(4.0), "no-speech"),
        "noise": (0.1 * np.random.default_rng(0).normal(size=4 * RATE), "no-speech"),
        "two speakers": (np.stack([voice, other], axis=1), "channels"),
        "a dead channel": (np.stack([voice, 0 * voice], axis=1), "dead-channel"),
        "clipped": (np.clip(4 * voice, -1, 1), "clipping"),
        "hot": (6.26 * voice, "full-scale"),
        "very hot": (50 * voice, "full-scale"),
        "very quiet": (1e-4 * voice, "faint"),
        "sound": (0.9 * voice, None),
        "with an offset": (0.5 * voice + 0.02, None),
    }[name]


NAMES = ("tone", "noise", "two speakers", "a dead channel", "clipped", "hot", "very hot", "very quiet", "sound",
         "with an offset")  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
def test_each_fault_is_named_by_itself(name, voices, tmp_path, capsys):
    samples, code = faulty(name, voices)
    path = written(tmp_path / "a.wav", samples)
    report = inspect(path)
    assert codes(report.findings) == ({code} if code else set()), report.text()
    read_speech(str(path), None)
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == (code is not None), lines
    if code:
        (message,) = (one.message for one in report.findings if one.code == code)
        assert lines[0].startswith(f"warning: {path}: {message}")


def test_pauses_are_no_reason_for_a_warning_before_generation(voices, tmp_path, capsys):
    quiet = np.concatenate([voices[0], 1e-5 * np.random.default_rng(0).normal(size=8 * RATE), voices[0]])
    path = written(tmp_path / "a.wav", quiet)
    assert codes(inspect(path).findings) == {"silence"}
    read_speech(str(path), None)
    assert capsys.readouterr().err == ""


def test_an_offset_does_not_hide_silence(voices, tmp_path):
    quiet = np.concatenate([voices[0], np.zeros(8 * RATE), voices[0]]) + 0.05
    quiet += 1e-5 * np.random.default_rng(0).normal(size=len(quiet))
    report = inspect(written(tmp_path / "a.wav", quiet))
    assert codes(report.findings) == {"silence"}
    assert "removed when they are read" in report.text()


def test_a_header_that_was_not_finished(voices, tmp_path):
    data = np.rint(30000 * voices[0]).astype("<i2")
    (tmp_path / "a.wav").write_bytes(wav_bytes(data, size=0))
    report = inspect(tmp_path / "a.wav")
    assert codes(report.findings) == {"header"}
    assert report.facts["audio"]["seconds"] == 8.0


def run_inspect(*arguments):
    import argparse

    parser = argparse.ArgumentParser()
    add_arguments(parser)
    return run(parser.parse_args([str(one) for one in arguments]), [])


def test_flags(voices, tmp_path, capsys):
    path = written(tmp_path / "a.wav", np.stack([0.9 * voices[0], 0.9 * voices[1]], axis=1))
    assert run_inspect(path, "--strict") == 1
    assert "--channel left" in capsys.readouterr().out
    assert run_inspect(path, "--strict", "--channel", "right") == 0
    assert "no warnings" in capsys.readouterr().out
    with pytest.raises(SystemExit):
        run_inspect(path, "--channel", "middle")
    write_words(
        tmp_path / "a.TextGrid", (Word("hi", 0.1, 0.4),), 8.0, tiers={"guest - words": (Word("yes", 1.0, 1.2),)}
    )
    assert run_inspect(tmp_path / "a.TextGrid", "--strict", "--audio", path, "--channel", "1") == 1
    assert "'guest - words' left out" in capsys.readouterr().out
    assert run_inspect(tmp_path / "a.TextGrid", "--strict", "--tier", "guest") == 0


def test_a_folder_with_other_formats(voices, tmp_path, monkeypatch):
    """A video beside its WAV is left aside; alone it is the audio, and the message names the command."""
    from a2g_jax.data.folder import find_pairs
    from a2g_jax.io.bvh import write_bvh

    monkeypatch.setenv("PATH", str(tmp_path / "nothing"))
    write_bvh(tmp_path / "a.bvh", talk(8.0, 5).motion)
    (tmp_path / "a.mp4").write_bytes(b"\0\0\0\x20ftypisom" + bytes(200))
    assert find_pairs(tmp_path)[0][0].name == "a.mp4"
    assert "ffmpeg -i" in inspect(tmp_path).text()
    write_audio(tmp_path / "a.wav", 0.9 * voices[0], RATE)
    assert find_pairs(tmp_path)[0][0].name == "a.wav"
    assert codes(inspect(tmp_path).findings) == set()


def test_the_speech_of_a_style_is_checked_as_well(tmp_path, capsys):
    from a2g_jax.cli.clips import _clip

    path = tmp_path / "tone.wav"
    write_audio(path, tone(4.0), RATE)
    assert _clip("--style", "clip.bvh", str(path)).audio == path
    assert capsys.readouterr().err.startswith(f"warning: {path}: no speech is found")
    assert _clip("--style", "clip.bvh", None).audio is None
    assert capsys.readouterr().err == ""
