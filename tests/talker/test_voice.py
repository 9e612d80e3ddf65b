"""The generated corpus' speech: plans keep their promises, and what is rendered is what was planned."""

import functools
import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from a2g_jax.errors import InputError
from a2g_jax.features.mel import MelConfig
from a2g_jax.features.mel import log_mel as log_mel_frames
from a2g_jax.talker.articulation import TRACK_RATE
from a2g_jax.talker.augment import augment
from a2g_jax.talker.emotions import VOICE_EMOTIONS
from a2g_jax.talker.language import lexicon
from a2g_jax.talker.phones import PHONES
from a2g_jax.talker.plan import phone_spans, plan_speech
from a2g_jax.talker.prosody import accent_response, creak_contour, phrase_response, pitch_contour
from a2g_jax.talker.recordings import talk
from a2g_jax.talker.speakers import SPEAKERS, session_voice
from a2g_jax.talker.voice import SPEECH_DBFS, synthesise

RATE = 16000


@functools.cache
def render(speaker="david", emotion="neutral", seconds=20.0, seed=0, rate=RATE):
    rng = np.random.default_rng(seed)
    plan = plan_speech(seconds, speaker, emotion, rng)
    audio = synthesise(plan, rng, rate)
    audio.flags.writeable = False  # shared between tests
    return plan, audio


def streams_of(speaker, emotion, seconds, seed):
    """The generators that `render` synthesises with, as they were before."""
    rng = np.random.default_rng(seed)
    plan_speech(seconds, speaker, emotion, rng)
    return rng.spawn(9)


def energy_db(audio, rate=RATE, seconds=0.03):
    """Sliding RMS in dB and the centre time of each window."""
    width = int(seconds * rate)
    total = np.concatenate([[0.0], np.cumsum(np.square(audio, dtype=np.float64))])
    power = (total[width:] - total[:-width]) / width
    return 10.0 * np.log10(power + 1e-12), (np.arange(len(power)) + 0.5 * width) / rate


def rendered_peaks(plan, audio, rate=RATE):
    """Time and level of the energy peak inside each syllable."""
    level, time = energy_db(audio, rate)
    found = []
    for syllable in plan.syllables:
        low, high = np.searchsorted(time, (syllable.onset, syllable.end))
        best = low + int(np.argmax(level[low:high]))
        found.append((time[best], level[best]))
    return np.array(found)


def active_db(plan, audio, rate=RATE):
    speech = np.concatenate([audio[int(p.start * rate) : int(p.end * rate)] for p in plan.phrases])
    return 10.0 * np.log10(np.mean(np.square(speech, dtype=np.float64)))


def measured_f0(plan, audio, rate=RATE):
    """Autocorrelation pitch (Hz) of the rendered audio around the syllables' peaks."""
    style = SPEAKERS[plan.speaker]
    centre = style.median_f0_hz * 2 ** (VOICE_EMOTIONS[plan.emotion].f0_shift_semitones / 12)
    found = []
    for syllable in plan.syllables:
        middle, half = int(syllable.peak * rate), int(0.025 * rate)
        frame = audio[middle - half : middle + half] * np.hanning(2 * half)
        correlation = np.fft.irfft(np.abs(np.fft.rfft(frame, 4 * half)) ** 2)
        lags = np.arange(int(rate / (2.2 * centre)), int(rate / (0.55 * centre)))
        # The window's own autocorrelation falls with the lag: divide it out, as Boersma 1993 does.
        window = np.fft.irfft(np.abs(np.fft.rfft(np.hanning(2 * half), 4 * half)) ** 2)
        found.append(rate / lags[np.argmax(correlation[lags] / window[lags])])
    return np.array(found)


# Plans


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


# Melody


def test_fujisaki_responses_have_their_known_maxima():
    time = np.linspace(-1.0, 3.0, 4001)
    phrase = phrase_response(time)
    assert time[np.argmax(phrase)] == pytest.approx(1.0 / 3.0, abs=2e-3)  # at 1 / alpha
    assert phrase.max() == pytest.approx(3.0 / np.e, rel=1e-4)  # alpha / e
    assert np.all(phrase[time < 0.0] == 0.0)
    assert accent_response(time).max() == pytest.approx(0.9)


def test_speakers_differ_in_pitch_and_its_median_is_theirs():
    medians = {}
    for seed, (name, style) in enumerate(SPEAKERS.items()):
        plan, audio = render(name, seconds=20.0, seed=seed)
        medians[name] = float(np.median(measured_f0(plan, audio)))
        # Syllable peaks carry the accents, so they lie somewhat above the median of all voiced frames.
        assert 0.93 < medians[name] / style.median_f0_hz < 1.25
    female, male = ("ada", "chiara", "elif"), ("bruno", "david", "felix")
    assert min(medians[name] for name in female) > 1.1 * max(medians[name] for name in male)
    assert np.all(np.diff(sorted(medians.values())) > 5.0)


def test_accents_raise_the_pitch():
    plan, audio = render("felix", seconds=30.0, seed=5)
    f0 = measured_f0(plan, audio)
    accent = np.array([s.accent for s in plan.syllables])
    assert np.median(f0[accent > 0.5]) > 1.1 * np.median(f0[accent == 0.0])


def test_emotions_move_the_voice_as_documented():
    measured = {}
    for name, emotion in VOICE_EMOTIONS.items():
        plan = plan_speech(40.0, "ada", name, np.random.default_rng(4))
        times = np.arange(0.0, 40.0, 0.01)
        log_f0 = np.log2(pitch_contour(plan, SPEAKERS["ada"], emotion, times, np.random.default_rng(4)))
        spoken = np.any([(times >= p.start) & (times < p.end) for p in plan.phrases], axis=0)
        phonation = sum(p.end - p.start for p in plan.phrases)
        low, middle, high = np.percentile(log_f0[spoken], (10, 50, 90))
        measured[name] = {"level": middle, "range": high - low, "rate": len(plan.syllables) / phonation}
    neutral = measured["neutral"]
    for name, emotion in VOICE_EMOTIONS.items():
        for key, direction in (
            ("level", emotion.f0_shift_semitones / 12.0),
            ("range", np.log(emotion.f0_range_factor)),
            ("rate", np.log(emotion.rate_factor)),
        ):
            if abs(direction) > 0.1:
                assert np.sign(measured[name][key] - neutral[key]) == np.sign(direction), (name, key)


def test_rendered_pitch_follows_the_contour():
    for speaker, seed in (("felix", 5), ("ada", 6), ("bruno", 7)):
        plan, audio = render(speaker, seconds=15.0, seed=seed)
        streams = streams_of(speaker, "neutral", 15.0, seed)
        times = np.arange(15 * int(TRACK_RATE) + 1) / TRACK_RATE
        voice, mood = session_voice(SPEAKERS[speaker], streams[0]), VOICE_EMOTIONS["neutral"]
        contour = pitch_contour(plan, voice, mood, times, streams[4])
        contour *= 0.55 ** creak_contour(plan, times, streams[3])
        wanted = np.interp([s.peak for s in plan.syllables], times, contour)
        error = np.abs(12.0 * np.log2(measured_f0(plan, audio) / wanted))
        assert np.median(error) < 0.3
        assert np.mean(error < 1.0) > 0.85


def test_phrases_end_low_or_high_as_planned():
    last = {"fall": [], "continuation": [], "question": []}
    for seed in range(4):
        plan = plan_speech(60.0, "ada", "neutral", np.random.default_rng(seed))
        times = np.arange(0.0, 60.0, 0.01)
        f0 = pitch_contour(plan, SPEAKERS["ada"], VOICE_EMOTIONS["neutral"], times, np.random.default_rng(seed))
        for phrase in plan.phrases:
            last[phrase.ending].append(np.log2(f0[int(phrase.end * 100) - 1]))
    assert np.mean(last["fall"]) < np.mean(last["continuation"]) < np.mean(last["question"])
    assert plan.phrases[-1].ending == "fall"


# Audio


@pytest.mark.parametrize("rate", [16000, 22050, 24000, 48000])
def test_audio_has_exactly_the_planned_length(rate):
    plan, audio = render("elif", seconds=4.321, rate=rate)
    assert audio.shape == (round(4.321 * rate),)
    assert audio.dtype == np.float32
    assert np.all(np.isfinite(audio))
    assert 0.05 < np.max(np.abs(audio)) < 1.0
    assert len(plan.phrases) >= 1


@pytest.mark.parametrize("rate", [22050, 24000, 44100, 48000])
def test_sample_rates_give_the_same_speech(rate):
    plan, reference = render("chiara", seconds=6.0, seed=2)
    other_plan, audio = render("chiara", seconds=6.0, seed=2, rate=rate)
    assert plan == other_plan
    size = round(6.0 * 6000)  # what lies below 3 kHz, where little is noise
    low = [np.fft.irfft(np.fft.rfft(signal)[: size // 2 + 1], size) for signal in (reference, audio)]
    assert np.corrcoef(low)[0, 1] > 0.97
    spectrum = np.square(np.abs(np.fft.rfft(audio)))
    hertz = np.fft.rfftfreq(len(audio), 1.0 / rate)
    bands = [10.0 * np.log10(spectrum[(hertz >= a) & (hertz < b)].mean()) for a, b in ((6000, 8000), (8000, 11000))]
    assert 2.0 < bands[0] - bands[1] < 15.0  # frication continues above 8 kHz, softer


def test_same_seed_same_audio_other_seed_other_audio():
    plan, audio = render(seconds=5.0, seed=7)
    again_plan, again = render.__wrapped__(seconds=5.0, seed=7)
    other_plan, other = render(seconds=5.0, seed=8)
    assert plan == again_plan
    assert np.array_equal(audio, again)
    assert plan != other_plan
    assert not np.array_equal(audio, other)


@pytest.mark.parametrize(
    ("speaker", "emotion"),
    list(zip(sorted(SPEAKERS), ("happiness", "sadness", "anger", "neutral", "fear", "disgust"), strict=True)),
)
def test_energy_peaks_where_the_plan_says_and_accents_are_heard(speaker, emotion):
    plan, audio = render(speaker, emotion, seconds=30.0, seed=11)
    found = rendered_peaks(plan, audio)
    claimed = np.array([s.peak for s in plan.syllables])
    accent = np.array([s.accent for s in plan.syllables])
    strong = accent > 0.5
    errors = np.abs(found[:, 0] - claimed)
    assert np.mean(errors[strong] < 0.03) > 0.95
    assert np.max(errors[strong]) < 0.05
    assert np.mean(errors < 0.03) > 0.85  # unaccented syllables, too, for the most part
    assert 5.0 < np.median(found[strong, 1]) - np.median(found[accent == 0.0, 1]) < 12.0
    # The peaks' levels alone separate accented from unaccented syllables.
    pairs = found[strong, 1][:, None] > found[accent == 0.0, 1][None, :]
    assert np.mean(pairs) > 0.94


def test_level_follows_speaker_and_emotion():
    for speaker, emotion in (("ada", "neutral"), ("bruno", "sadness"), ("felix", "anger")):
        plan, audio = render(speaker, emotion, seconds=15.0, seed=3)
        voice = session_voice(SPEAKERS[speaker], streams_of(speaker, emotion, 15.0, 3)[0])
        wanted = SPEECH_DBFS + voice.loudness_db + plan.strength * VOICE_EMOTIONS[emotion].loudness_db
        assert active_db(plan, audio) == pytest.approx(wanted, abs=0.7)


def test_emotions_are_as_loud_as_their_order_says():
    level = {
        name: np.mean([active_db(*render("david", name, seconds=5.0, seed=seed)) for seed in range(8)])
        for name in ("sadness", "neutral", "happiness", "anger")
    }
    assert level["sadness"] < level["neutral"] - 2.0
    assert level["neutral"] < level["happiness"] < level["anger"]


def test_pauses_are_quiet_but_not_digital_silence():
    plan, audio = render("david", seconds=30.0, seed=6)
    level, time = energy_db(audio)
    for before, after in itertools.pairwise(plan.phrases):
        inside = (time > before.end + 0.03) & (time < after.start - 0.03)
        assert np.max(level[inside]) < -35.0
        assert np.min(level[inside]) > -75.0


def test_energy_peaks_lie_at_the_planned_peaks_over_many_voices():
    errors = []
    for seed, (speaker, emotion) in enumerate(itertools.product(SPEAKERS, VOICE_EMOTIONS)):
        plan, audio = render(speaker, emotion, seconds=4.0, seed=seed)
        assert np.all(np.isfinite(audio))
        assert np.max(np.abs(audio)) < 1.0
        errors += list(np.abs(rendered_peaks(plan, audio)[:, 0] - [s.peak for s in plan.syllables]))
    assert np.median(errors) < 0.015
    assert np.percentile(errors, 90) < 0.03


def test_accents_are_predictable_from_log_mel_energy():
    features, accents = [], []
    for seed, speaker in enumerate((*SPEAKERS, *SPEAKERS)):
        plan, audio = render(speaker, seconds=12.0, seed=50 + seed)
        mel = log_mel_frames(audio, MelConfig(), 30.0, 360)
        mel = (mel - mel.mean(0)) / mel.std(0)
        at = np.rint([s.peak * 30.0 for s in plan.syllables]).astype(int)
        window = mel[np.clip(at[:, None] + np.arange(-4, 5), 0, 359)].reshape(len(at), 9, 16, 4).mean(-1)
        features.append(np.concatenate([window.reshape(len(at), -1), np.ones((len(at), 1))], 1))
        accents.append([s.accent for s in plan.syllables])
    known, truth = np.concatenate(features[:9]), np.concatenate(accents[:9])
    weights = np.linalg.solve(known.T @ known + 30.0 * np.eye(known.shape[1]), known.T @ truth)
    guess, truth = np.concatenate(features[9:]) @ weights, np.concatenate(accents[9:])
    assert np.corrcoef(guess, truth)[0, 1] > 0.7  # about 0 by chance


def test_rejects_telephone_rates_and_less():
    plan = plan_speech(3.0, "ada", "neutral", np.random.default_rng(0))
    with pytest.raises(InputError, match="8000"):
        synthesise(plan, np.random.default_rng(0), 4000)


# Augmentation


def test_augment_keeps_length_and_timing_and_is_deterministic():
    plan, audio = render("ada", seconds=15.0, seed=9)
    level, _ = energy_db(audio)
    for seed in range(6):
        changed = augment(audio, RATE, np.random.default_rng(seed))
        assert changed.shape == audio.shape
        assert changed.dtype == np.float32
        assert np.all(np.isfinite(changed))
        assert np.max(np.abs(changed)) < 1.0
        assert np.array_equal(changed, augment(audio, RATE, np.random.default_rng(seed)))
        assert not np.allclose(changed, audio, atol=1e-3)
        strong = np.array([s.accent > 0.5 for s in plan.syllables])
        moved = rendered_peaks(plan, changed)[strong, 0] - rendered_peaks(plan, audio)[strong, 0]
        assert np.median(np.abs(moved)) < 0.02
        assert np.corrcoef(level, energy_db(changed)[0])[0, 1] > 0.7


def test_augment_survives_silence():
    silent = augment(np.zeros(8000, np.float32), RATE, np.random.default_rng(0))
    assert np.all(np.isfinite(silent))
    assert np.max(np.abs(silent)) < 1e-3


# Beside real speech


def log_mel(audio):
    """Log-mel (dB) of the active frames, after normalising the active level: 64 bands, 2048-point windows, 30 fps."""
    level, _ = energy_db(audio)
    audio = audio * 10.0 ** (-(20.0 + np.percentile(level, 90)) / 20.0)
    frames = np.lib.stride_tricks.sliding_window_view(audio, 2048)[::533]
    power = np.abs(np.fft.rfft(frames * np.hanning(2048))) ** 2
    edges = 700.0 * (np.exp(np.linspace(0.0, np.log(1.0 + 8000.0 / 700.0), 66)) - 1.0)
    frequency = np.fft.rfftfreq(2048, 1.0 / RATE)
    triangles = [np.interp(frequency, edges[band : band + 3], (0.0, 1.0, 0.0)) for band in range(64)]
    decibels = 10.0 * np.log10(np.array(triangles) @ power.T + 1e-10)
    loudness = decibels.max(axis=0)
    return decibels[:, loudness > np.percentile(loudness, 95) - 25.0]


def test_log_mel_statistics_are_near_real_speech(shared):
    import soundfile

    real = []
    for name in ("speech/jfk.wav", "beat/2_scott_0_1_1.wav", "zeggs/067_Speech_2_x_1_0.wav"):
        audio, rate = soundfile.read(shared / name, dtype="float32")
        assert rate == RATE
        real.append(log_mel(audio[: 40 * RATE]))
    ours = [log_mel(render(speaker, seconds=20.0, seed=1)[1]) for speaker in SPEAKERS]
    mean_gap = np.mean([m.mean(1) for m in ours], axis=0) - np.mean([m.mean(1) for m in real], axis=0)
    std_gap = np.mean([m.std(1) for m in ours], axis=0) - np.mean([m.std(1) for m in real], axis=0)
    assert np.mean(np.abs(mean_gap)) < 6.0
    assert np.mean(np.abs(std_gap)) < 5.0
