"""Uploads of the studio: names, limits, readers, and nothing left behind."""

import numpy as np
import pytest

from a2g_jax.errors import InputError
from a2g_jax.io.audio import write_audio
from a2g_jax.serving.studio.readers import KINDS, peaks
from a2g_jax.serving.studio.uploads import Kind, Upload, Uploads, display_name


def _read(path):
    if path.read_bytes().startswith(b"bad"):
        raise InputError(f"{path}: is bad at byte 3; export {path.name} again.")
    return {"seconds": 2.0, "warnings": [f"{path}: is doubtful."]}


def small(folder, files=2, **options):
    kinds = {"speech": Kind("speech", (".wav", ".mp4"), 1000, _read)}
    return Uploads(folder, kinds, files=files, most_bytes=500, **options)


@pytest.fixture
def uploads(tmp_path):
    return small(tmp_path)


def send(uploads, data=b"sound", name="talk.wav", kind="speech"):
    with uploads.incoming(kind, name) as incoming:
        incoming.write(data)
        return incoming.finish()


def test_a_file_is_kept_under_a_name_of_the_servers_own(uploads, tmp_path):
    upload = send(uploads, name="../../etc/Täl\nk.WAV")
    assert upload.name == "Tälk.WAV"
    assert upload.path.parent == tmp_path
    assert upload.path.name == f"upload-{upload.id}.wav"
    assert upload.path.read_bytes() == b"sound"
    assert upload.about["warnings"] == ["Tälk.WAV: is doubtful."]
    assert uploads.find(upload.id, "speech") is upload


@pytest.mark.parametrize("id", ["nothing", "", None, 3, ["a"]])
def test_an_unknown_file_is_refused(uploads, id):
    with pytest.raises(InputError, match="no longer kept"):
        uploads.find(id, "speech")


@pytest.mark.parametrize(
    ("name", "data", "message"),
    [
        ("talk.wav", b"bad", r"^talk\.wav: is bad at byte 3; export talk\.wav again\.$"),
        ("talk.wav", b"", "talk.wav: is empty"),
        ("talk.wav", b"x" * 1001, "is larger than 0 MB"),
        ("talk.wav", b"x" * 501, "too many files arrive"),
        ("talk.exe", b"x", r"talk\.exe: is not a file for speech; choose WAV, MP4\."),
        ("", b"x", "file: is not a file for speech"),
        ("wav", b"x", "is not a file for speech"),
    ],
)
def test_what_cannot_be_used_leaves_nothing(uploads, tmp_path, name, data, message):
    with pytest.raises(InputError, match=message):
        send(uploads, data, name)
    assert list(tmp_path.iterdir()) == []
    assert uploads.all() == []


def test_an_upload_that_breaks_off_leaves_nothing(uploads, tmp_path):
    def broken():
        with uploads.incoming("speech", "talk.wav") as incoming:
            incoming.write(b"half")
            raise ConnectionError

    with pytest.raises(ConnectionError):
        broken()
    assert list(tmp_path.iterdir()) == []


def test_unknown_kinds_are_refused(uploads):
    with pytest.raises(InputError, match="no uploads of the kind 'weights'"):
        uploads.incoming("weights", "a.wav")


def test_the_oldest_files_make_room_unless_they_are_used(tmp_path):
    used = []
    uploads = small(tmp_path, in_use=lambda: used)
    uploads.add(Upload("demo", "speech", "demo", tmp_path / "elsewhere.flac", keep=True))
    kept = [send(uploads, name="0.wav")]
    used.append(kept[0].path)
    kept += [send(uploads, name=f"{number}.wav") for number in range(1, 4)]
    assert [upload.name for upload in uploads.all()] == ["demo", "0.wav", "3.wav"]
    assert [one.path.exists() for one in kept] == [True, False, False, True]


def test_many_bytes_make_room_as_well(uploads):
    first, second = send(uploads, b"x" * 300), send(uploads, b"x" * 300)
    assert (first.path.exists(), second.path.exists()) == (False, True)


def test_a_file_without_room_removes_none(tmp_path):
    used = []
    uploads = small(tmp_path, files=3, in_use=lambda: used)
    old, new = send(uploads, b"x" * 100), send(uploads, b"x" * 300)
    used.append(new.path)
    with pytest.raises(InputError, match="too many files arrive"), uploads.incoming("speech", "large.wav") as large:
        large.write(b"x" * 300)
    assert [one.path.exists() for one in (old, new)] == [True, True]
    assert uploads.all() == [old, new]


def test_files_that_arrive_count_and_give_their_room_back(uploads, tmp_path):
    with uploads.incoming("speech", "one.wav") as one:
        one.write(b"x" * 300)
        with uploads.incoming("speech", "two.wav") as two:
            two.write(b"x" * 150)
            with pytest.raises(InputError, match="too many files arrive"):
                two.write(b"x" * 150)
        third = send(uploads, b"x" * 150, name="three.wav")
        one.write(b"x" * 90)
        assert not third.path.exists()  # an older file makes room for what arrives
        one.finish()
    with uploads.incoming("speech", "four.wav") as four:
        four.write(b"x" * 350)
        assert list(tmp_path.iterdir()) == [four.path]


def test_long_names_keep_their_suffix():
    name = display_name("a" * 500 + ".wav")
    assert len(name) < 130
    assert name.endswith(".wav")
    assert display_name("C:\\talks\\one.wav") == "one.wav"


def test_speech_is_read_with_its_waveform_and_warnings(tmp_path):
    time = np.arange(64000) / 16000
    write_audio(tmp_path / "tone.wav", np.float32(0.5 * np.sin(2000 * time)), 16000)
    about = KINDS["speech"].read(tmp_path / "tone.wav")
    assert about["seconds"] == 4.0
    assert any("no speech is found" in line for line in about["warnings"])
    assert max(about["peaks"]) == 1.0


@pytest.mark.parametrize("kind", ["speech", "clip", "character"])
@pytest.mark.parametrize(
    "data", [b"\0" * 300, b"HIERARCHY\nROOT a\n{", b"glTF\x02\0\0\0", b"PK\x03\x04" + b"\xff" * 90]
)
def test_garbage_is_an_error_in_one_line_for_every_reader_and_suffix(tmp_path, kind, data):
    uploads = Uploads(tmp_path, KINDS)
    for suffix in KINDS[kind].suffixes:
        with pytest.raises(InputError) as caught:
            send(uploads, data, f"junk{suffix}", kind)
        assert f"junk{suffix}" in str(caught.value)
        assert "upload-" not in str(caught.value)
        assert "\n" not in str(caught.value)
    assert list(tmp_path.iterdir()) == []


def test_peaks_of_short_and_silent_sounds():
    assert peaks(np.array([0.5, -1.0, 0.25]), 2) == [1.0, 0.25]
    assert peaks(np.zeros(4), 2) == [0.0, 0.0]
