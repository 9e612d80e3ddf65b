"""Transcripts of generated speech: tiers nest, and other programs read them."""

import numpy as np
import pytest

from a2g_jax.io.textgrid import read_words, write_words
from a2g_jax.talker.phones import PHONES
from a2g_jax.talker.plan import plan_speech
from a2g_jax.talker.transcript import speech_tiers, word_tier


def written(path, seed, speaker="chiara", seconds=12.3):
    plan = plan_speech(seconds, speaker, "happiness", np.random.default_rng(seed))
    words, tiers = word_tier(plan), speech_tiers(plan)
    write_words(path, words, plan.seconds, tiers=tiers)
    return plan, {"words": words, **tiers}


@pytest.mark.parametrize("seed", range(5))
def test_tiers_survive_the_file(tmp_path, seed):
    path = tmp_path / "speech.TextGrid"
    _, tiers = written(path, seed)
    assert set(tiers) == {"words", "phrases", "syllables", "phones", "accents"}
    for name, entries in tiers.items():
        assert read_words(path, name) == entries
    assert read_words(path) == tiers["words"]


def test_praatio_reads_the_same(tmp_path):
    textgrid = pytest.importorskip("praatio.textgrid")
    path = tmp_path / "speech.TextGrid"
    plan, tiers = written(path, 3)
    grid = textgrid.openTextgrid(str(path), includeEmptyIntervals=False)
    assert grid.maxTimestamp == pytest.approx(plan.seconds)
    assert set(grid.tierNames) == set(tiers)
    for name, entries in tiers.items():
        found = grid.getTier(name).entries
        assert [entry.label for entry in found] == [word.text for word in entries]
        assert np.allclose([entry.start for entry in found], [word.start for word in entries], atol=1e-6)
        assert np.allclose([entry.end for entry in found], [word.end for word in entries], atol=1e-6)


@pytest.mark.parametrize("seed", range(20))
def test_phones_fill_syllables_and_syllables_fill_words(seed):
    plan = plan_speech(15.0, "bruno", "sadness", np.random.default_rng(seed))
    tiers = speech_tiers(plan)
    assert [phone.text for phone in tiers["phones"]] == [p for s in plan.syllables for p in s.phones]
    assert all(phone.text in PHONES for phone in tiers["phones"])
    borders = {phone.start for phone in tiers["phones"]} | {phone.end for phone in tiers["phones"]}
    for syllable, planned in zip(tiers["syllables"], plan.syllables, strict=True):
        assert syllable.start in borders
        assert syllable.end in borders
        assert syllable.text.startswith("'") == bool(planned.stress)
    for name in ("syllables", "phones"):
        length = sum(entry.end - entry.start for entry in tiers[name])
        assert length == pytest.approx(sum(phrase.end - phrase.start for phrase in plan.phrases))
    onsets = {syllable.start for syllable in tiers["syllables"]}
    assert all(accent.start in onsets and 0.0 <= float(accent.text) <= 1.0 for accent in tiers["accents"])
    assert len(tiers["accents"]) == sum(s.accent > 0.0 for s in plan.syllables)
