"""Real languages: plans agree with their audio, repeat bit for bit, and speakers, emotions and accents act."""

import functools
import itertools
import sys
import threading

import numpy as np
import pytest
from voice_for_tests import energy_db, measured_f0

from a2g_jax.cli import main
from a2g_jax.data.corpus import Corpus
from a2g_jax.data.splits import Segment
from a2g_jax.errors import InputError
from a2g_jax.evaluation.baselines import right_motions
from a2g_jax.io.textgrid import read_words
from a2g_jax.talker import recordings
from a2g_jax.talker.demo_speech import demo_speech
from a2g_jax.talker.languages import LANGUAGES
from a2g_jax.talker.recordings import cast, resample_motion, talk
from a2g_jax.talker.speakers import SPEAKERS
from a2g_jax.talker.speech import plan_from_json, plan_to_json
from a2g_jax.talker.voices import library
from a2g_jax.talker.voices.library import Phoneme, Utterance
from a2g_jax.talker.voices.sentences import draw_sentence, function_words, grammar
from a2g_jax.talker.voices.syllables import is_vowel, spoken_words

RATE = 16000


def needs_voices():
    pytest.importorskip("espeakng_loader", reason="the extra 'voices' is not installed")


@functools.cache
def take(language="en", speaker="david", emotion="neutral", seconds=20.0, seed=0):
    recording = talk(seconds, seed, speaker=speaker, emotion=emotion, language=language)
    return plan_from_json(recording.annotations["speech"]), recording


# Texts, which need no library


@pytest.mark.parametrize("language", LANGUAGES)
def test_every_slot_of_a_grammar_has_lines_and_sentences_differ(language):
    rng = np.random.default_rng(0)
    sentences = [draw_sentence(language, rng) for _ in range(500)]
    assert len(set(sentences)) > 440
    for clause in itertools.chain.from_iterable(sentences):
        assert not set("{}[]#|") & set(clause.text)
        assert clause.text[-1] in ",.?"
        assert clause.ending == {",": "continuation", "?": "question", ".": "fall"}[clause.text[-1]]
    assert all(sentence[-1].ending != "continuation" for sentence in sentences)
    words = {word for lines in grammar(language).values() for line in lines for word in line.lower().split()}
    assert len(function_words(language) & words) > 30


def test_words_that_are_spoken_as_one_are_shared_out():
    phonemes = [
        *(Phoneme(ipa, 0, 0.1 * i, 0) for i, ipa in enumerate(("ɪ", "n", "ð", "ə"))),
        *(Phoneme(ipa, 2 * (ipa == "aʊ"), 0.1 * i, 7) for i, ipa in enumerate(("h", "aʊ", "s"), 4)),
    ]
    utterance = Utterance(np.zeros(8000, np.float32), 10000, tuple(phonemes), 0.75, ((0, 0.0), (7, 0.38)))
    inside, the, house = spoken_words("In the house.", utterance)
    assert (inside.text, the.text, house.text) == ("in", "the", "house")
    assert [s.phones for s in inside.syllables + the.syllables] == [("ɪ", "n"), ("ð", "ə")]
    assert (house.syllables[0].starts[0], house.syllables[0].end, house.syllables[0].stress) == (0.38, 0.75, 2)
    assert the.syllables[-1].end == 0.38


def test_phonemes_at_the_same_moment_have_a_duration_each():
    phonemes = [Phoneme(ipa, 0, moment, 0) for ipa, moment in (("k", 0.0), ("a", 0.1), ("n", 0.2), ("t", 0.2))]
    utterance = Utterance(np.zeros(10, np.float32), 10, tuple(phonemes), 0.2, ((0, 0.0),))
    (word,) = spoken_words("Can't.", utterance)
    (syllable,) = word.syllables
    np.testing.assert_allclose((*syllable.starts, syllable.end), (0.0, 0.1, 0.2, 0.204, 0.208))


def test_languages_take_turns_and_leave_the_cast_as_it_is():
    plain, mixed = cast(10.0, 5), cast(10.0, 5, (), (), ("invented", "en", "de"))
    assert all("language" not in role for role in plain)
    assert [{key: value for key, value in role.items() if key != "language"} for role in mixed] == plain
    for block in range(0, 9, 3):
        assert {role["language"] for role in mixed[block : block + 3]} == {"invented", "en", "de"}


def test_the_invented_voice_keeps_its_annotations_and_its_bits():
    plain, named = talk(3.0, 2), talk(3.0, 2, language="invented")
    assert plain.name == named.name == "talker_2_ada_neutral"
    np.testing.assert_array_equal(plain.audio, named.audio)
    speech = plain.annotations["speech"]
    assert not {"language", "synthesizer"} & speech.keys()
    assert set(speech["syllables"][0]) == {"onset", "peak", "end", "phones", "stress", "accent", "word"}
    assert plan_to_json(plan_from_json(speech)) == speech


def test_demo_speech_comes_along():
    recording = demo_speech()
    plan = plan_from_json(recording.annotations["speech"])
    assert len(recording.audio) == 20 * RATE
    assert recording.motion.frames == 600
    assert [word.text for word in recording.words[:5]] == ["hello", "and", "welcome", "when", "people"]
    level, time = energy_db(recording.audio)
    quiet = np.percentile(level, 5)
    assert all(level[np.searchsorted(time, s.peak)] > quiet + 15 for s in plan.syllables if s.accent > 0.3)


@pytest.mark.parametrize(
    "arguments",
    [
        ["talk", "--language", "en"],
        ["prepare", "talker", "--minutes", "0.2", "--languages", "invented,de"],
    ],
)
def test_without_the_library(tmp_path, monkeypatch, capsys, arguments):
    monkeypatch.setitem(sys.modules, "espeakng_loader", None)
    monkeypatch.chdir(tmp_path)
    assert main([*arguments, "--out", "here"]) == 2
    assert "real languages need eSpeak NG: pip install 'a2g_jax[voices]'" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_unknown_languages(tmp_path, capsys):
    with pytest.raises(InputError, match="no language 'xx'; there are: invented, en,"):
        talk(3.0, 0, language="xx")
    assert main(["prepare", "talker", "--languages", "en,xx", "--out", str(tmp_path / "c")]) == 2
    assert "--languages: there is no xx; there are: invented, en" in capsys.readouterr().err


# Speech


@pytest.mark.parametrize("language", LANGUAGES)
def test_plan_is_consistent(language):
    needs_voices()
    plan, recording = take(language)
    assert plan.language == language
    assert plan.synthesizer.startswith("eSpeak NG ")
    assert recording.audio.dtype == np.float32
    assert len(recording.audio) == 20 * RATE
    assert 0.01 < np.abs(recording.audio).max() < 1.0
    assert plan.phrases[0].start >= 0.3
    assert plan.phrases[-1].end <= 20.0 - 0.3 + 1e-9
    assert plan.phrases[-1].ending != "continuation"
    for before, after in itertools.pairwise(plan.phrases):
        assert after.start - before.end >= 0.2 - 1e-9
    for before, after in itertools.pairwise(plan.words):
        assert before.end <= after.start + 1e-9
    for before, after in itertools.pairwise(plan.syllables):
        assert before.end <= after.onset + 1e-9
        assert after.word - before.word in (0, 1)
    accented = [syllable for syllable in plan.syllables if syllable.accent > 0.0]
    assert len(accented) > 10
    for index, word in enumerate(plan.words):
        syllables = [syllable for syllable in plan.syllables if syllable.word == index]
        assert (syllables[0].onset, syllables[-1].end) == (word.start, word.end)
        assert sum(syllable.accent > 0.0 for syllable in syllables) <= 1
        assert word.text == word.text.lower().strip(",.?¿")
        phrase = plan.phrases[word.phrase]
        assert phrase.start - 1e-9 <= word.start < word.end <= phrase.end + 1e-9
    for syllable in plan.syllables:
        assert syllable.onset <= syllable.peak <= syllable.end
        assert sum(map(is_vowel, syllable.phones)) == 1
        bounds = (syllable.onset, *syllable.phone_ends)
        assert all(b - a > 0.003 for a, b in itertools.pairwise(bounds))
        assert bounds[-1] == syllable.end
    assert all(syllable.stress for syllable in accented)
    assert not {plan.words[syllable.word].text for syllable in accented} & function_words(language)
    assert plan_from_json(plan_to_json(plan)) == plan


def test_peaks_are_where_the_audio_is_loudest():
    needs_voices()
    plan, recording = take("de")
    level, time = energy_db(recording.audio)
    misses = []
    for syllable in plan.syllables:
        low, high = np.searchsorted(time, (syllable.onset, syllable.end))
        misses.append(abs(time[low + int(np.argmax(level[low:high]))] - syllable.peak))
    assert np.median(misses) < 0.005
    assert np.mean(np.array(misses) < 0.01) > 0.9


def test_accents_are_in_energy_and_pitch():
    needs_voices()
    rows = []
    for language, speaker in itertools.product(LANGUAGES, ("david", "elif")):
        plan, recording = take(language, speaker)
        level, time = energy_db(recording.audio)
        peaks = [s.peak for s in plan.syllables]
        f0 = 12.0 * np.log2(measured_f0(plan, recording.audio) / SPEAKERS[speaker].median_f0_hz)
        rows += [
            (s.accent, loud - np.mean(level[np.searchsorted(time, peaks)]), pitch)
            for s, loud, pitch in zip(plan.syllables, level[np.searchsorted(time, peaks)], f0, strict=True)
            if s.stress
        ]
    accent, loud, pitch = np.array(rows).T
    strong, none = accent >= 0.5, accent == 0.0
    assert np.corrcoef(accent, loud)[0, 1] > 0.4
    assert np.median(loud[strong]) > np.median(loud[none]) + 2.0
    assert np.median(pitch[strong]) > np.median(pitch[none]) + 1.0


@pytest.mark.parametrize("seconds", [2.0, 2.7, 4.0])
@pytest.mark.parametrize("emotion", ["neutral", "sadness"])
def test_short_recordings(seconds, emotion):
    needs_voices()
    for language in ("en", "it"):
        plan, recording = take(language, "bruno", emotion, seconds, 3)
        assert len(recording.audio) == round(seconds * RATE)
        assert plan.phrases[-1].end <= seconds - 0.3 + 1e-9


def test_the_same_arguments_give_the_same_bits_whatever_was_spoken_before():
    needs_voices()
    first = talk(6.0, 4, speaker="ada", language="en")
    results = []

    def again():
        talk(3.0, 9, speaker="felix", emotion="anger", language="fr")
        results.append(talk(6.0, 4, speaker="ada", language="en"))

    threads = [threading.Thread(target=again) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for other in results:
        np.testing.assert_array_equal(other.audio, first.audio)
        np.testing.assert_array_equal(other.motion.rotations, first.motion.rotations)
        assert other.annotations == first.annotations
    assert len(results) == 3
    fast = talk(6.0, 4, speaker="ada", language="en", sample_rate=24000)
    assert fast.annotations == first.annotations


@pytest.mark.slow
def test_emotions_act_as_in_the_invented_voice():
    needs_voices()
    found = {}
    for emotion in ("neutral", "happiness", "sadness", "anger", "fear", "disgust"):
        rows = []
        for seed in range(3):
            plan, recording = take("en", "david", emotion, 20.0, seed)
            spoken = sum(phrase.end - phrase.start for phrase in plan.phrases)
            f0 = 12.0 * np.log2(measured_f0(plan, recording.audio))
            active = np.concatenate([recording.audio[int(p.start * RATE) : int(p.end * RATE)] for p in plan.phrases])
            level = 10.0 * np.log10(np.mean(np.square(active)))
            rows.append((len(plan.syllables) / spoken, np.median(f0), np.subtract(*np.percentile(f0, [80, 20])), level))
        found[emotion] = np.mean(rows, axis=0)
    rate, pitch, reach, level = range(4)
    neutral = found.pop("neutral")
    change = {emotion: value - neutral for emotion, value in found.items()}
    for emotion in ("happiness", "anger", "fear"):
        assert change[emotion][pitch] > 1.0, emotion
    for emotion in ("sadness", "disgust"):
        assert change[emotion][pitch] < -0.3, emotion
        assert change["fear"][rate] - change[emotion][rate] > 1.0, emotion
        assert change[emotion][level] < -0.5, emotion
    assert change["fear"][rate] > 0.4
    assert change["anger"][level] > 3.0
    assert change["happiness"][reach] > 0.5
    assert change["sadness"][reach] < -0.5


def test_speakers_differ_in_pitch_and_spectrum():
    needs_voices()
    pitch, spectra = {}, {}
    for speaker in SPEAKERS:
        for seed in range(2):
            plan, recording = take("en", speaker, "neutral", 20.0, seed)
            pitch[speaker, seed] = float(np.median(measured_f0(plan, recording.audio)))
            size = 512
            frames = recording.audio[: len(recording.audio) // size * size].reshape(-1, size) * np.hanning(size)
            spectrum = 10.0 * np.log10(
                np.mean(np.abs(np.fft.rfft(frames)) ** 2, axis=0)[4:].reshape(-1, 11).mean(axis=1)
            )
            spectra[speaker, seed] = spectrum - spectrum.mean()
    for speaker, style in SPEAKERS.items():
        for seed in range(2):
            assert abs(12.0 * np.log2(pitch[speaker, seed] / style.median_f0_hz)) < 2.5
    right = 0
    for (speaker, seed), spectrum in spectra.items():
        others = {key: np.linalg.norm(spectrum - other) for key, other in spectra.items() if key != (speaker, seed)}
        right += min(others, key=others.get)[0] == speaker
    assert right >= 9


def test_gestures_and_transcripts_follow(tmp_path):
    needs_voices()
    plan, recording = take("es")
    motion, truth = resample_motion(recording, 1)
    assert motion.frames == recording.motion.frames
    assert len(truth.strokes) > 5
    for stroke in truth.strokes:
        assert -0.03 <= plan.syllables[stroke.syllable].peak - stroke.apex <= 0.2
    out = str(tmp_path / "talk")
    assert main(["talk", "--language", "es", "--seconds", "6", "--samples", "1", "--out", out]) == 0
    words = read_words(tmp_path / "talk" / "speech.TextGrid")
    assert {word.text for word in words} & function_words("es")
    assert read_words(tmp_path / "talk" / "speech.TextGrid", "phones")


# Corpora


@pytest.mark.slow
def test_a_corpus_of_both_kinds_of_voices(tmp_path, monkeypatch):
    needs_voices()
    monkeypatch.setattr(recordings, "RECORDING_SECONDS", 4.0)
    command = ["prepare", "talker", "--minutes", "0.4", "--seed", "6", "--languages", "invented,en,de"]
    for workers in ("1", "2"):
        assert main([*command, "--workers", workers, "--out", str(tmp_path / workers)]) == 0
    corpus, other = Corpus.open(tmp_path / "1"), Corpus.open(tmp_path / "2")
    assert corpus.fingerprint == other.fingerprint
    assert corpus.recipe["languages"] == ["invented", "en", "de"]
    assert corpus.recipe["synthesizer"] == library.library_version()
    spoken = [corpus.annotations(i)["speech"].get("language", "invented") for i in range(len(corpus.recordings))]
    assert sorted(spoken) == ["de", "de", "en", "en", "invented", "invented"]
    for index in (spoken.index("de"), spoken.index("invented")):
        entry = corpus.recordings[index]
        (motion,) = right_motions(corpus, Segment(index, entry.first, entry.first + entry.frames), 1, 0)
        assert motion.shape == (entry.frames, *corpus.pose.shape[1:])
    talk_command = ["talk", "--corpus", str(tmp_path / "1"), "--samples", "1", "--out", str(tmp_path / "talk")]
    assert main([*talk_command, "--recording", corpus.recordings[spoken.index("de")].name]) == 0


def test_another_version_of_the_library_is_noticed(tmp_path, monkeypatch, capsys):
    needs_voices()
    monkeypatch.setattr(recordings, "RECORDING_SECONDS", 4.0)
    out = str(tmp_path / "c")
    assert main(["prepare", "talker", "--minutes", "0.2", "--languages", "en", "--workers", "1", "--out", out]) == 0
    monkeypatch.setattr("a2g_jax.data.generated.library_version", lambda: "eSpeak NG 9.9")
    assert main(["talk", "--corpus", out, "--out", str(tmp_path / "talk")]) == 2
    assert "was spoken by eSpeak NG 1.52.0, here is eSpeak NG 9.9; install that version" in capsys.readouterr().err
