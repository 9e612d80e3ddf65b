"""Preparation of recordings with two speakers: what is left out is said, and another one can be chosen."""

import numpy as np
import pytest
import soundfile

from a2g_jax.cli.parser import main
from a2g_jax.data.corpus import Corpus
from a2g_jax.errors import InputError
from a2g_jax.features.mel import log_mel
from a2g_jax.io.audio import read_audio
from a2g_jax.io.bvh import write_bvh
from a2g_jax.io.textgrid import write_words
from a2g_jax.io.words import Word
from a2g_jax.talker.recordings import talk


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Four takes of eight seconds: two speakers on two channels and two tiers, an offset in one of the channels."""
    path = tmp_path_factory.mktemp("takes")
    for number in range(4):
        host, guest = (talk(8.0, seed + number, speaker=name) for seed, name in ((20, "ada"), (40, "bruno")))
        write_bvh(path / f"take{number}.bvh", host.motion)
        both = np.stack([0.9 * host.audio, 0.9 * guest.audio + 0.02], axis=1)
        soundfile.write(path / f"take{number}.wav", both, 16000, subtype="FLOAT")
        tiers = {"guest - words": (Word("yes", 1.0, 1.2), Word("spn", 1.2, 1.4))}
        write_words(path / f"take{number}.TextGrid", (Word("hello", 0.2, 0.5),), 8.0, tiers=tiers)
    return path


def prepared(folder, out, *flags):
    assert main(["prepare", "folder", str(folder), "--out", str(out), "--workers", "1", *flags]) == 0
    return Corpus.open(out)


def words(corpus):
    return [word["text"] for word in corpus.annotations(0)["words"]]


def test_notes_and_choices(folder, tmp_path, capsys):
    corpus = prepared(folder, tmp_path / "first")
    said = capsys.readouterr().err
    assert said.count("left and right differ") == 4
    assert said.count("'guest - words' left out") == 4
    assert words(corpus) == ["hello"]
    chosen = prepared(folder, tmp_path / "second", "--channel", "right", "--tier", "guest")
    assert "differ" not in capsys.readouterr().err
    assert words(chosen) == ["yes"]
    frames = chosen.recordings[0].frames
    guest = read_audio(folder / "take0.wav", channel=2)
    np.testing.assert_array_equal(chosen.audio[:frames], log_mel(guest, chosen.mel, chosen.fps, frames))
    assert np.abs(np.asarray(corpus.audio[:frames]) - np.asarray(chosen.audio[:frames])).mean() > 1


def test_other_choices_do_not_resume_one(folder, tmp_path):
    from a2g_jax.data.prepare import prepare_data_set
    from a2g_jax.data.settings import Features

    plain, chosen = (
        prepare_data_set("folder", folder, tmp_path / name, Features(), channel=channel, workers=1).recipe
        for name, channel in (("a", None), ("b", 2))
    )
    assert "channel" not in plain
    assert chosen["channel"] == 2
    with pytest.raises(InputError, match="has 2 channels, and channel 3 was chosen"):
        prepare_data_set("folder", folder, tmp_path / "c", Features(), channel=3, workers=1)


def test_noise_is_said(folder, tmp_path, capsys):
    for number in range(2):
        (tmp_path / f"take{number}.bvh").write_bytes((folder / f"take{number}.bvh").read_bytes())
        noise = 0.1 * np.random.default_rng(number).normal(size=8 * 16000)
        soundfile.write(tmp_path / f"take{number}.wav", noise, 16000)
    prepared(tmp_path, tmp_path / "corpus")
    assert capsys.readouterr().err.count("no speech is found") == 2
