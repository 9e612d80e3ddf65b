import json
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from a2g_jax.errors import InputError
from a2g_jax.io.textgrid import read_words, write_words
from a2g_jax.io.transcripts import read_transcript, transcript_notes, words_at_frames
from a2g_jax.io.words import Word, is_word
from tests.io.fuzz_for_tests import damaged
from tests.io.untrusted_checks import check_message

WORDS = (Word("hello", 0.4, 0.9), Word("wörld", 0.9, 1.25), Word("it's", 2.0, 2.5))
GOOGLE = [
    {
        "alternatives": [
            {
                "transcript": "hello wörld",
                "confidence": 0.9,
                "words": [
                    {"start_time": "0.400s", "end_time": "0.900s", "word": "hello"},
                    {"start_time": "0.900s", "end_time": "1.250s", "word": "wörld"},
                ],
            },
            {"transcript": "yellow", "words": [{"start_time": "0s", "end_time": "9s", "word": "yellow"}]},
        ]
    },
    {"alternatives": []},
    {"alternatives": [{"transcript": ""}]},
    {"alternatives": [{"words": [{"startTime": "2s", "endTime": 2.5, "word": " it's\n"}]}]},
]
TIMED = [{"start": 0.4, "end": 0.9}, {"start": 0.9, "end": 1.25}, {"start": 2, "end": 2.5}]
WHISPER = {
    "text": " hello wörld it's",
    "segments": [
        {"id": 0, "text": " hello wörld", "words": [{"word": " hello", **TIMED[0]}, {"word": " wörld", **TIMED[1]}]},
        {"id": 1, "text": "", "words": []},
        {"id": 2, "text": " it's", "words": [{"text": "it's", **TIMED[2], "confidence": 0.9}]},
    ],
    "language": "en",
}
GENTLE = {
    "transcript": "hello wörld it's",
    "words": [
        {"word": word.text, "alignedWord": word.text, "case": "success", **times, "phones": []}
        for word, times in zip(WORDS, TIMED, strict=True)
    ],
}
TABLE = "0.4\t0.9\thello\r\n0.900000\t1.25\twörld\r\n\r\n2\t2.5\tit's\r\n"


def grid(path):
    write_words(path, WORDS, 3.0, tiers={"phones": [Word("HH", 0.4, 0.5)]})


def write(path, content):
    if callable(content):
        content(path)
    else:
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


FORMS = {
    "google.json": json.dumps(GOOGLE),
    "camel.json": json.dumps({"results": GOOGLE}, ensure_ascii=False),
    "whisper.json": json.dumps(WHISPER),
    "gentle.json": json.dumps(GENTLE),
    "gentle.txt": json.dumps(GENTLE),
    "table.tsv": TABLE,
    "grid.TextGrid": grid,
    "marked.tsv": b"\xef\xbb\xbf" + TABLE.encode(),
    "table.txt": TABLE,
    "google.txt": b"\xef\xbb\xbf  \n" + json.dumps(GOOGLE).encode(),
}


@pytest.mark.parametrize("name", FORMS)
def test_each_form_gives_the_same_words(name, tmp_path):
    assert read_transcript(write(tmp_path / name, FORMS[name])) == WORDS


def test_text_grids_without_a_suffix_in_either_encoding(tmp_path):
    grid(tmp_path / "a.TextGrid")
    text = (tmp_path / "a.TextGrid").read_text(encoding="utf-8")
    for encoding in ("utf-8", "utf-8-sig", "utf-16"):
        assert read_transcript(write(tmp_path / "words", text.encode(encoding))) == WORDS


def test_a_missing_start_is_zero_as_google_leaves_it_out(tmp_path):
    results = [{"alternatives": [{"words": [{"end_time": "0.5s", "word": "so"}]}]}]
    assert read_transcript(write(tmp_path / "a.json", json.dumps(results))) == (Word("so", 0.0, 0.5),)


def test_words_that_an_aligner_did_not_find_are_counted(tmp_path):
    words = [*GENTLE["words"], {"word": "5"}, {"word": "x", "start": None, "end": None}]
    path = write(tmp_path / "a.json", json.dumps({"segments": [{"words": words}]}))
    found, notes = transcript_notes(path)
    assert found == WORDS
    assert [(note.code, note.value) for note in notes] == [("untimed", 2)]
    assert "2 of 5 words have no times and are left out." in str(notes[0])


def test_words_come_in_the_order_of_their_starts(tmp_path):
    path = write(tmp_path / "a.tsv", "2\t3\tb\n1\t1\ta\n2\t2.5\tc\n")
    assert [word.text for word in read_transcript(path)] == ["a", "b", "c"]


def google(*words):
    return json.dumps([{"alternatives": []}, {"alternatives": [{"words": list(words)}]}])


GOOD = {"start_time": "0s", "end_time": "1s", "word": "a"}
WRONG = {
    "a.tsv, line 2: expected start, end and word": "0\t1\ta\n0 1 a\n",
    "a.tsv, line 2: expected start, end and word, separated by tabs; got 4": "0\t1\ta\n0\t1\ta\tb\n",
    "a.tsv, line 3: expected a time in seconds from 0 on; got 'x'": "0\t1\ta\n\n0\tx\tb\n",
    "a.tsv, line 1: expected a time in seconds from 0 on; got '-1'": "-1\t1\ta\n",
    "a.tsv, line 1: expected a time in seconds from 0 on; got 'nan'": "nan\t1\ta\n",
    "a.tsv, line 1: expected a time in seconds from 0 on; got '1e3'": "0\t1e3\ta\n",
    "a.tsv, line 1: expected a time in seconds from 0 on; got '٣'": "0\t٣\ta\n",
    "a.tsv, line 1: expected a time in seconds from 0 on; got 99999999.0": "0\t99999999\ta\n",
    "a.tsv, line 2: ends at 1.0 s, before it starts at 2.0 s": "0\t1\ta\n2\t1\tb\n",
    "a.tsv: is not UTF-8 text (byte 4)": b"0\t1\t\xff\n",
    "a.json: the file: expected a list as Google": "{}",
    "a.json: result 1: expected 'alternatives'": "[{}]",
    "a.json: result 1: expected a list as Google": '[{"alternatives": 3}]',
    "a.json: result 2, word 2: expected 'word'": google(GOOD, {"start_time": "1s", "end_time": "2s"}),
    "a.json: result 2, word 1: expected 'end_time'": google({"word": "a"}),
    "a.json: result 2, word 2: expected 'start_time'": google(GOOD, 3),
    "a.json: result 2, word 1: expected a word; got list": google({**GOOD, "word": ["a"]}),
    "a.json: result 2, word 1: expected a word; got '\\ud800'": google({**GOOD, "word": "\ud800"}),
    "a.json: result 2, word 1: expected a time in seconds from 0 on; got '1 s'": google({**GOOD, "end_time": "1 s"}),
    "a.json: result 2, word 1: expected a time in seconds from 0 on; got bool": google({**GOOD, "end_time": True}),
    "a.json: result 2, word 1: expected a time in seconds from 0 on; got -1.5": google({**GOOD, "start_time": -1.5}),
    "a.json: result 2, word 1: expected a time in seconds from 0 on; got int": google({**GOOD, "end_time": 10**400}),
    "a.json, line 1, column 2: is not JSON": "[",
    "a.json: is nested too deeply": "[" * 100_000,
    "a.json: contains NaN": google({**GOOD, "end_time": float("nan")}),
    "a.json: segment 1: has no list of 'words'; transcribe with word times": '{"segments": [{"text": "a"}]}',
    "a.json: segment 1, word 2: expected an object with 'word'": json.dumps(
        {"words": [GENTLE["words"][0], {"start": 0, "end": 1}]}
    ),
    "a.json: segment 1, word 1: ends at 0.5 s, before it starts at 1.0 s": '{"words": [{"word": "a", "start": 1, "end":'
    " 0.5}]}",
    "a.json: none of its 1 words has a time": '{"words": [{"word": "a", "case": "not-found-in-audio"}]}',
    "a.vtt: is not a transcript in a supported form: subtitles": "WEBVTT\n\n00:01.000 --> 00:02.000\nhello\n",
    "a.srt: is not a transcript in a supported form: subtitles have times of phrases": "1\n00:00:01 --> 00:00:02\na\n",
    "b.txt: is not a transcript in a supported form: subtitles": "1\n00:00:01,000 --> 00:00:02,000\nhello\n",
    "a.txt: is not a transcript in a supported form": "hello",
    "a.TextGrid, line 1: expected a TextGrid text file": "hello",
    "a.tsv: is empty": "",
}


@pytest.mark.parametrize("message", WRONG)
def test_faults_are_named_with_their_place(message, tmp_path):
    name = re.split("[,:]", message)[0]
    with pytest.raises(InputError) as error:
        read_transcript(write(tmp_path / name, WRONG[message]))
    assert message.replace("٣", "\\u0663") in str(error.value)
    check_message(error.value, tmp_path / name)


def test_files_beyond_the_limit_are_not_read(tmp_path):
    path = tmp_path / "a.json"
    with path.open("wb") as file:
        file.truncate(2**26 + 1)
    with pytest.raises(InputError, match="is larger than 67108864 bytes"):
        read_transcript(path)
    with pytest.raises(InputError, match="no such file"):
        read_transcript(tmp_path / "b.json")


words = st.lists(
    st.builds(
        lambda text, start, length: Word(" ".join(text.split()), start / 1000, (start + length) / 1000),
        st.text(st.characters(exclude_categories=["Cs", "Cc"]), min_size=1, max_size=8).filter(str.strip),
        st.integers(0, 10**6),
        st.integers(0, 5000),
    ),
    max_size=8,
).map(lambda words: tuple(sorted((word for word in words if is_word(word.text)), key=lambda word: word.start)))


@settings(max_examples=60, deadline=None)
@given(words=words)
def test_round_trip(words, tmp_path_factory):
    folder = tmp_path_factory.getbasetemp()
    table = "".join(f"{word.start:.3f}\t{word.end:.3f}\t{word.text}\n" for word in words)
    assert read_transcript(write(folder / "round.tsv", table or "\n")) == words
    entries = [{"start_time": f"{w.start:.3f}s", "end_time": f"{w.end:.3f}s", "word": w.text} for w in words]
    results = [{"alternatives": [{"words": [entry]}]} for entry in entries]
    assert read_transcript(write(folder / "round.json", json.dumps(results))) == words


@pytest.mark.parametrize("name", ["google.json", "whisper.json", "gentle.json", "table.tsv", "grid.TextGrid"])
@settings(max_examples=40, deadline=None)
@given(data=st.data())
def test_damaged_bytes(name, data, tmp_path_factory):
    folder = tmp_path_factory.getbasetemp()
    whole = write(folder / name, FORMS[name]).read_bytes()
    path = folder / f"damaged-{name}"
    path.write_bytes(data.draw(damaged([whole])))
    try:
        found = read_transcript(path)
    except InputError as error:
        check_message(error, path)
    else:
        assert all(0 <= word.start <= word.end for word in found)
        assert all(word.text.strip() == word.text != "" for word in found)
        words_at_frames(found, 30.0, 100)


def test_words_at_frames():
    words = (Word("a", 0.0, 0.5), Word("b", 0.5, 1.0), Word("c", 1.2, 1.25), Word("d", 1.5, 99.0))
    found = words_at_frames(words, 10.0, 20)
    expected = [0] * 5 + [1] * 5 + [-1] * 2 + [2] + [-1] * 2 + [3] * 5
    assert found.tolist() == expected
    assert words_at_frames(words[::-1], 10.0, 20).tolist() == [3 - n if n >= 0 else -1 for n in expected]


def test_frames_at_the_edges_of_words():
    # 1/15 s is no decimal: a word from 0.0667 (rounded) on is not spoken at frame 1, one from 0.066666667 on is.
    assert words_at_frames([Word("a", 0.066666667, 0.133333333)], 15.0, 4).tolist() == [-1, 0, -1, -1]
    assert words_at_frames([Word("a", 0.0667, 0.2001)], 15.0, 5).tolist() == [-1, -1, 0, 0, -1]
    assert words_at_frames([Word("a", 0.01, 0.05)], 10.0, 3).tolist() == [-1] * 3  # between two frames
    assert words_at_frames([Word("a", 0.1, 0.1)], 10.0, 3).tolist() == [-1] * 3  # no length
    assert words_at_frames([], 10.0, 3).tolist() == [-1] * 3
    assert words_at_frames([Word("a", 5.0, 6.0)], 10.0, 3).tolist() == [-1] * 3
    assert words_at_frames([Word("a", 0.0, 6.0)], 10.0, 0).shape == (0,)


def test_the_word_that_started_last_counts():
    words = (Word("long", 0.0, 1.0), Word("short", 0.3, 0.5))
    assert words_at_frames(words, 10.0, 10).tolist() == [0] * 3 + [1] * 2 + [0] * 5


@settings(max_examples=60, deadline=None)
@given(words=words, fps=st.sampled_from([15.0, 29.97, 30.0, 120.0]))
def test_words_at_frames_by_definition(words, fps):
    frames = 300
    found = words_at_frames(words, fps, frames)
    for frame in range(0, frames, 7):
        time = frame / fps
        near = [abs(time - edge) * fps for word in words for edge in (word.start, word.end)]
        if min(near, default=1) < 1e-4:
            continue
        spoken = [n for n, word in enumerate(words) if word.start <= time < word.end]
        assert found[frame] == max(spoken, key=lambda n: (words[n].start, n), default=-1)


@pytest.mark.parametrize("fps", [0.0, -1.0, float("nan"), float("inf")])
def test_rates_that_are_none(fps):
    with pytest.raises(InputError, match="fps: expected a positive number"):
        words_at_frames([], fps, 3)


def praatio_words(path, tier=None):
    from praatio import textgrid

    opened = textgrid.openTextgrid(str(path), includeEmptyIntervals=False)
    entries = opened.getTier(tier or opened.tierNames[0]).entries
    return [(entry.label, entry.start, entry.end) for entry in entries]


@pytest.mark.parametrize("form", ["short_textgrid", "long_textgrid"])
def test_text_grids_by_praatio_are_read(form, tmp_path):
    from praatio import textgrid

    entries = [(word.start, word.end, word.text) for word in (*WORDS, Word('say "no"', 2.5, 2.75))]
    written = textgrid.Textgrid()
    written.addTier(textgrid.IntervalTier("words", entries, 0, 3))
    written.addTier(textgrid.PointTier("beats", [(0.5, "x")], 0, 3))
    written.addTier(textgrid.IntervalTier("phones", [(0.4, 0.5, "HH")], 0, 3))
    path = tmp_path / "a.TextGrid"
    written.save(str(path), form, includeBlankSpaces=True)
    expected = [(text, start, end) for start, end, text in entries]
    assert [(word.text, word.start, word.end) for word in read_transcript(path)] == expected
    assert read_words(path, "phones") == (Word("HH", 0.4, 0.5),)


def test_praatio_reads_what_we_write(tmp_path):
    grid(tmp_path / "a.TextGrid")
    assert praatio_words(tmp_path / "a.TextGrid", "words") == [(w.text, w.start, w.end) for w in WORDS]


def test_beat(shared):
    path = shared / "beat" / "2_scott_0_1_1.TextGrid"
    found = read_transcript(path)
    assert [(word.text, word.start, word.end) for word in found] == praatio_words(path)
    assert len(found) > 100
    at = words_at_frames(found, 15.0, 956)
    spoken = set(at.tolist()) - {-1}
    assert len(spoken) > 0.9 * len(found)
    assert (np.diff(at[at >= 0]) >= 0).all()
