"""Stored waveforms keep the precision of quiet recordings and are not clipped; ordinary ones keep their bits."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from a2g_jax.data.corpus import Corpus
from a2g_jax.data.corpus_integrity import verify_corpus
from a2g_jax.data.corpus_writer import Item, Plan, prepare_corpus, prepare_recording
from a2g_jax.data.scaled_waveform import ScaledWaveform, scaled_waveform
from a2g_jax.data.settings import Features
from a2g_jax.io.stored_array import StoredArray
from a2g_jax.talker.recordings import talk

FEATURES = Features(waveform=True)


def rest_of(items, done):
    yield from items[done:]


@pytest.mark.parametrize(("scale", "gain"), [(1.0, 1.0), (0.02, 1.0), (3.0, 0.25), (1e-3, 512.0), (1e-5, 2.0**16)])
def test_the_scale_is_a_power_of_two_and_1_for_ordinary_levels(scale, gain):
    audio = (scale * np.sin(np.arange(4000) / 7)).astype(np.float32)
    stored, found = scaled_waveform(audio, 4100)
    assert found == gain
    assert stored.shape == (4100,)
    np.testing.assert_allclose(stored[:4000] / 32767 / gain, audio, atol=0.51 / 32767 / gain)


def test_a_corpus_gives_them_back_in_pieces(tmp_path):
    takes = [talk(2.0, seed, name=f"take{seed}") for seed in range(3)]
    scales = (1.0, 1e-4, 1.0)
    takes = [replace(take, audio=take.audio * np.float32(scale)) for take, scale in zip(takes, scales, strict=True)]
    items = [prepare_recording(take, FEATURES) for take in takes]
    plan = Plan(FEATURES, {"reader": "folder"})
    prepare_corpus(tmp_path / "corpus", [Item(item.name, ()) for item in items], partial(rest_of, items), plan)
    corpus = Corpus.open(tmp_path / "corpus")
    verify_corpus(corpus)
    assert isinstance(corpus.waveform, ScaledWaveform)
    whole = np.asarray(corpus.waveform) / 32768
    for entry, take in zip(corpus.recordings, takes, strict=True):
        part = whole[entry.first_sample : entry.first_sample + entry.samples]
        peak = float(np.abs(take.audio).max())
        np.testing.assert_allclose(part[: len(take.audio)], take.audio, atol=peak / 5000)
        assert ("waveform_gain" in entry.to_json()) == (peak < 0.01)
    for start, stop in ((0, 10), (31990, 32010), (63999, 64001), (40000, 50000), (5, 5), (0, len(whole))):
        np.testing.assert_array_equal(corpus.waveform[start:stop] / 32768, whole[start:stop])
    assert corpus.waveform[40000] == corpus.waveform[40000 - len(whole)] == whole[40000] * 32768
    ordinary = [prepare_recording(take, FEATURES) for take in (takes[0], takes[2])]
    assert [item.waveform_gain for item in ordinary] == [1.0, 1.0]


def test_ordinary_corpora_read_16_bit_samples(tmp_path):
    items = [prepare_recording(talk(2.0, seed, name=f"take{seed}"), FEATURES) for seed in range(3)]
    plan = Plan(FEATURES, {"reader": "folder"})
    prepare_corpus(tmp_path / "corpus", [Item(item.name, ()) for item in items], partial(rest_of, items), plan)
    assert isinstance(Corpus.open(tmp_path / "corpus").waveform, StoredArray)
    assert "waveform_gain" not in (tmp_path / "corpus" / "manifest.json").read_text()
