"""Plans of the generated corpus's speech: words, syllables, accents, lengths and the language."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from a2g_jax.errors import InputError
from a2g_jax.talker.emotions import VOICE_EMOTIONS
from a2g_jax.talker.language import lexicon
from a2g_jax.talker.phones import PHONES
from a2g_jax.talker.plan import phone_spans, plan_speech
from a2g_jax.talker.recordings import talk
from a2g_jax.talker.speakers import SPEAKERS


@settings(max_examples=25, deadline=None)
@given(
    seconds=st.floats(2.0, 40.0),
    speaker=st.sampled_from(sorted(SPEAKERS)),
    emotion=st.sampled_from(sorted(VOICE_EMOTIONS)),
    seed=st.integers(0, 2**32 - 1),
)
def test_plan_is_consistent(seconds, speaker, emotion, seed):
    plan = plan_speech(seconds, speaker, emotion, np.random.default_rng(seed))
    assert plan.seconds == seconds
    assert plan.speaker == speaker
    assert plan.emotion == emotion
    assert plan.phrases[0].start >= 0.3 - 1e-9
    assert plan.phrases[-1].end <= seconds - 0.3 + 1e-9
    for before, after in itertools.pairwise(plan.phrases):
        assert after.start - before.end >= 0.2 - 1e-9
    assert all(p.end - p.start <= 5.5 + 1e-9 for p in plan.phrases)
    by_word: dict[int, list] = {}
    for syllable in plan.syllables:
        assert syllable.onset < syllable.peak < syllable.end
        assert 0.0 <= syllable.accent <= 1.0
        assert syllable.stress or syllable.accent == 0.0
        by_word.setdefault(syllable.word, []).append(syllable)
    assert sorted(by_word) == list(range(len(plan.words)))
    for index, word in enumerate(plan.words):
        parts = by_word[index]
        assert parts[0].onset == pytest.approx(word.start)
        assert parts[-1].end == pytest.approx(word.end)
        for before, after in itertools.pairwise(parts):
            assert before.end == pytest.approx(after.onset)
        phrase = plan.phrases[word.phrase]
        assert phrase.start - 1e-9 <= word.start < word.end <= phrase.end + 1e-9


def test_phones_fill_their_syllable():
    plan = plan_speech(20.0, "ada", "neutral", np.random.default_rng(1))
    for syllable in plan.syllables:
        spans = phone_spans(syllable)
        assert tuple(symbol for symbol, _, _ in spans) == syllable.phones
        assert spans[0][1] == syllable.onset
        assert spans[-1][2] == pytest.approx(syllable.end)
        assert all(end - start > 0.01 for _, start, end in spans)
        nucleus = next(span for span in spans if PHONES[span[0]].is_vowel)
        assert nucleus[1] < syllable.peak < nucleus[2]


def test_strong_accents_come_about_once_a_second_and_irregularly():
    gaps = []
    for seed, speaker in enumerate(SPEAKERS):
        plan = plan_speech(60.0, speaker, "neutral", np.random.default_rng(seed))
        gaps += list(np.diff([s.peak for s in plan.syllables if s.accent > 0.5]))
    assert 0.6 < np.median(gaps) < 1.2
    assert np.percentile(gaps, 5) > 0.3
    assert np.std(gaps) > 0.2


def test_stress_accent_and_the_end_of_a_phrase_lengthen():
    plans = [plan_speech(60.0, "david", "neutral", np.random.default_rng(seed)) for seed in range(3)]
    length = {"plain": [], "stressed": [], "accented": [], "final": []}
    for plan in plans:
        ends = {phrase.end for phrase in plan.phrases}
        for s in plan.syllables:
            kind = "final" if s.end in ends else "accented" if s.accent > 0.5 else "stressed" if s.stress else "plain"
            length[kind].append(s.end - s.onset)
    mean = {kind: np.mean(values) for kind, values in length.items()}
    assert mean["plain"] < mean["stressed"] < mean["accented"]
    assert mean["final"] > 1.2 * mean["plain"]


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ((1.0, "ada", "neutral"), "seconds is 1.0"),
        ((float("nan"), "ada", "neutral"), "seconds is nan"),
        ((10.0, "adam", "neutral"), "unknown speaker 'adam'"),
        ((10.0, "ada", "bored"), "unknown emotion 'bored'"),
    ],
)
def test_bad_requests_are_named(arguments, says):
    with pytest.raises(InputError, match=says):
        plan_speech(*arguments, np.random.default_rng(0))


def test_language_has_distinct_words_with_one_stress():
    words = lexicon()
    texts = [word.text for word in words.function + words.content]
    assert len(set(texts)) == len(texts)
    assert all(not w.is_content and len(w.syllables) == 1 for w in words.function)
    assert all(0 <= w.stress < len(w.syllables) for w in words.content)
    for word in words.function + words.content:
        for syllable in word.syllables:
            assert sum(PHONES[symbol].is_vowel for symbol in syllable) == 1


def test_words_recur_within_a_recording_and_differ_between_seeds_and_speakers():
    content = {word.text for word in lexicon().content}

    def said(seed, speaker="david"):
        plan = talk(60.0, seed, speaker=speaker, fps=15.0).annotations["speech"]
        return [word["text"] for word in plan["words"] if word["text"] in content]

    first, second, other = said(0), said(1), said(0, "felix")
    assert 0.35 < len(set(first)) / len(first) < 0.9
    for words in (second, other):
        assert first[:8] != words[:8]
        assert len(set(first) & set(words)) < 0.5 * len(set(first))


def test_speakers_hesitate_now_and_then():
    words = [w.text for s in range(6) for w in plan_speech(60.0, "ada", "neutral", np.random.default_rng(s)).words]
    assert 0.002 < words.count("em") / len(words) < 0.04
