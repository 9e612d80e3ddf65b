"""Files that are something else than what was expected are named as what they are, by every reader."""

import bz2
import gzip
import lzma

import pytest

from a2g_jax.errors import InputError
from a2g_jax.io.audio import read_audio
from a2g_jax.io.bvh import read_bvh, write_bvh
from a2g_jax.io.files import check_readable, read_json
from a2g_jax.io.hdf5 import read_hdf5
from a2g_jax.io.npz import read_motion_npz
from a2g_jax.io.transcripts import read_transcript
from a2g_jax.io.untrusted import LmdbFile, read_pickle
from a2g_jax.talker.recordings import talk
from tests.io.wav_for_tests import tone, wav_bytes

READERS = {
    "a.wav": read_audio,
    "a.bvh": read_bvh,
    "a.npz": read_motion_npz,
    "a.pkl": read_pickle,
    "a.json": read_json,
    "a.TextGrid": read_transcript,
    "data.mdb": LmdbFile,
    "a.h5": lambda path: read_hdf5(path, ["a"]),
}
OTHERS = {
    "is a Git LFS pointer": b"version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n",
    "is a web page": b"\n<!DOCTYPE html>\n<html><body>Sign in</body></html>",
    "is a gzip archive": gzip.compress(b"content" * 9),
    "is a bzip2 archive": bz2.compress(b"content" * 9),
    "is an xz archive": lzma.compress(b"content" * 9),
}


@pytest.mark.parametrize("name", READERS)
@pytest.mark.parametrize("words", OTHERS)
def test_what_no_reader_expects(tmp_path, name, words):
    path = tmp_path / name
    path.write_bytes(OTHERS[words])
    with pytest.raises(InputError, match=f"{name}: {words}") as error:
        READERS[name](path)
    assert "\n" not in str(error.value)


def test_a_page_is_right_where_one_is_expected(tmp_path):
    path = tmp_path / "a.html"
    path.write_text("<!doctype html><html></html>")
    assert check_readable(path, "an HTML page") == path


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"PK\x03\x04\x14\0" + bytes(60) + b"a", "is a ZIP archive"),
        (b"Kaydara FBX Binary  \0\x1a\0" + b"\1" * 90, "is an FBX file; export the motion as BVH"),
        (b"glTF\2\0\0\0" + b"\1" * 90, "is a glTF file"),
    ],
)
def test_models_and_archives_named_bvh(tmp_path, data, words):
    (tmp_path / "a.bvh").write_bytes(data)
    with pytest.raises(InputError, match=words):
        read_bvh(tmp_path / "a.bvh")


def test_a_file_that_ends_in_zeros_was_not_written_completely(tmp_path):
    path = tmp_path / "a.bvh"
    write_bvh(path, talk(2.0, 1).motion.clip(0, 10))
    path.write_bytes(path.read_bytes()[:-300] + bytes(300))
    with pytest.raises(InputError, match="its last 300 bytes are zeros: it was not written completely"):
        read_bvh(path)


@pytest.mark.parametrize("suffix", [".m4a", ".mp4", ".aac", ".wma"])
def test_wav_files_with_the_suffix_of_another_format_are_read(tmp_path, suffix):
    (tmp_path / f"a{suffix}").write_bytes(wav_bytes((tone(1.5) * 32767).astype("<i2")))
    assert len(read_audio(tmp_path / f"a{suffix}")) == 24000
