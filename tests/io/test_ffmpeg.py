"""Files that need ffmpeg: decoded by it where it is installed, else the command is named; one line for every fault."""

import os
import shutil
import stat
import subprocess
import sys

import numpy as np
import pytest

from a2g_jax.errors import InputError
from a2g_jax.io.audio import audio_info, load_audio, read_audio
from a2g_jax.io.ffmpeg import ffmpeg_kind
from tests.io.wav_for_tests import tone, wav_bytes

M4A = b"\0\0\0\x20ftypM4A " + bytes(200)
#: First bytes of files of each kind.
HEADS = {
    "a.m4a": M4A,
    "a.mp4": b"\0\0\0\x20ftypisom" + bytes(200),
    "a.aac": b"\xff\xf1\x50\x80" + bytes(200),
    "a.webm": b"\x1a\x45\xdf\xa3" + bytes(200),
    "a.wma": b"\x30\x26\xb2\x75\x8e\x66\xcf\x11" + bytes(200),
    "a.amr": b"#!AMR\n" + bytes(200),
    "phone memo.wav": M4A,
    "download": M4A,
}
#: A program in place of ffmpeg: writes the output and the messages that a test sets.
PROGRAM = """#!{python}
import sys, time
from pathlib import Path
folder = Path({folder!r})
(folder / "arguments").write_text("\\n".join(sys.argv[1:]))
sys.stderr.write((folder / "says").read_text())
sys.stdout.buffer.write((folder / "output").read_bytes())
sys.stdout.flush()
time.sleep(float((folder / "sleeps").read_text()))
sys.exit(int((folder / "status").read_text()))
"""


@pytest.fixture
def ffmpeg(tmp_path, monkeypatch):
    """Sets what the program in place of ffmpeg writes, and returns its arguments."""
    folder = tmp_path / "bin"
    folder.mkdir()
    program = folder / "ffmpeg"
    program.write_text(PROGRAM.format(python=sys.executable, folder=str(folder)))
    program.chmod(program.stat().st_mode | stat.S_IEXEC)
    monkeypatch.setenv("PATH", f"{folder}{os.pathsep}{os.environ['PATH']}")

    def act(output=b"", says="", status=0, sleeps=0.0):
        for name, value in (("says", says), ("status", status), ("sleeps", sleeps)):
            (folder / name).write_text(str(value))
        (folder / "output").write_bytes(output)
        return folder / "arguments"

    return act


def float_wav(samples, channels=1, rate=48000):
    """What ffmpeg writes to a pipe: the size is not known."""
    listed = b"LIST\x1a\0\0\0INFOISFT\x0d\0\0\0Lavf60.0.100\0\0"
    return wav_bytes(
        samples.astype("<f4"), rate=rate, channels=channels, bits=32, form=3, size=2**32 - 1, before=listed
    )


@pytest.mark.parametrize("name", HEADS)
def test_the_command_is_named_without_ffmpeg(name, tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    path = tmp_path / name
    path.write_bytes(HEADS[name])
    for read in (read_audio, audio_info):
        with pytest.raises(InputError) as caught:
            read(path)
        target = tmp_path / ("phone memo_converted.wav" if " " in name else f"{path.stem}.wav")
        quoted = [f"'{x}'" if " " in str(x) else str(x) for x in (path, target)]
        assert str(caught.value).endswith(f"install it, or convert the file: ffmpeg -i {quoted[0]} {quoted[1]}")
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", HEADS)
def test_it_is_decoded(name, tmp_path, ffmpeg):
    path, samples = tmp_path / name, tone(1.2, 48000)
    path.write_bytes(HEADS[name])
    arguments = ffmpeg(float_wav(samples))
    sound = load_audio(path)
    np.testing.assert_array_equal(sound.samples, samples)
    assert (sound.info.sample_rate, sound.info.frames, sound.info.channels) == (48000, 57600, 1)
    assert sound.notes() == []
    assert audio_info(path).seconds == pytest.approx(1.2)
    assert len(read_audio(path)) == 19200
    given = arguments.read_text().split("\n")
    # No list of other files or addresses is followed; the path cannot be taken for an option.
    assert given[given.index("-protocol_whitelist") + 1] == "file,pipe"
    assert given[given.index("-i") + 1] == f"file:{path.resolve()}"


def test_two_channels(tmp_path, ffmpeg):
    path, both = tmp_path / "a.m4a", np.stack([tone(1.0, 48000), tone(1.0, 48000, hertz=300)], axis=1)
    path.write_bytes(M4A)
    ffmpeg(float_wav(both, channels=2))
    np.testing.assert_array_equal(load_audio(path, channel=2).samples, both[:, 1])


def test_its_remarks_are_passed_on(tmp_path, ffmpeg):
    (tmp_path / "a.m4a").write_bytes(M4A)
    ffmpeg(float_wav(tone(1.0, 48000)), says="[aac @ 0x55d0c0] Invalid frame\nmore\n")
    assert [str(note) for note in load_audio(tmp_path / "a.m4a").notes()] == [
        "ffmpeg reports: Invalid frame. Check that its end is there."
    ]


@pytest.mark.parametrize(
    ("act", "named"),
    [
        ({"says": "[mov @ 0x1f] moov atom not found\nError opening\n", "status": 1}, "by ffmpeg (moov atom not found)"),
        ({"says": "Stream map '0:a:0' matches no streams.\n", "status": 1}, "holds no sound, only other streams"),
        ({"status": 3}, "by ffmpeg (exit status 3)"),
        ({}, "holds no sound that ffmpeg can decode"),
        ({"output": b"not a wav" * 100}, "holds no sound that ffmpeg can decode"),
        ({"output": float_wav(tone(1.0, 48000))[:-1000], "says": "killed\n", "status": 137}, "by ffmpeg (killed)"),
        ({"output": float_wav(np.zeros(0))}, "contains no samples"),
        ({"output": float_wav(np.full(4800, np.nan))}, "contains NaN or infinity at 0.000 s"),
        ({"output": float_wav(tone(4.0, 48000)), "sleeps": 1}, "is 4 s long, and the limit is 2 s"),
    ],
)
def test_faults_are_one_line(act, named, tmp_path, ffmpeg):
    path = tmp_path / "a.m4a"
    path.write_bytes(M4A)
    ffmpeg(**act)
    limit = 2.5 if "sleeps" in act else 100.0
    with pytest.raises(InputError) as caught:
        load_audio(path, max_seconds=limit)
    assert named in str(caught.value)
    assert "\n" not in str(caught.value)


def test_one_that_does_not_end_is_stopped(tmp_path, ffmpeg, monkeypatch):
    monkeypatch.setattr("a2g_jax.io.ffmpeg._TIMEOUT", 0.3)
    (tmp_path / "a.m4a").write_bytes(M4A)
    ffmpeg(float_wav(tone(1.0, 48000)), sleeps=60)
    with pytest.raises(InputError, match="ffmpeg did not finish within"):
        load_audio(tmp_path / "a.m4a")


def test_text_and_ordinary_files_do_not_need_it(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    (tmp_path / "a.m4a").write_bytes(b"no sound, a note\n" * 20)
    with pytest.raises(InputError, match="is text, not audio"):
        read_audio(tmp_path / "a.m4a")
    assert ffmpeg_kind(tmp_path / "a.mp3", b"\xff\xfb\x90\x00" + bytes(100)) == ""
    (tmp_path / "a.wav").write_bytes(wav_bytes((tone() * 32767).astype("<i2")))
    assert len(read_audio(tmp_path / "a.wav")) == 8000


@pytest.mark.parametrize("suffix", ["m4a", "aac", "mp4", "webm", "wma", "mka"])
def test_the_real_program(suffix, tmp_path):
    if shutil.which("ffmpeg") is None:
        pytest.skip("ffmpeg is not installed")
    wav, other = tmp_path / "a.wav", tmp_path / f"b.{suffix}"
    wav.write_bytes(wav_bytes((tone(2.0) * 32767).astype("<i2")))
    subprocess.run(["ffmpeg", "-v", "error", "-i", str(wav), str(other)], check=True)
    result = read_audio(other)
    assert len(result) == pytest.approx(32000, abs=3200)
    assert np.abs(np.fft.rfft(result[8000:24000])).argmax() == pytest.approx(440, abs=2)
