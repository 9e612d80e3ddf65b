"""Which labels are words, which tier has them, and what is remarked on transcripts."""

import json

import pytest

from a2g_jax.errors import InputError
from a2g_jax.io.reading import reading
from a2g_jax.io.textgrid import read_words, write_words
from a2g_jax.io.transcripts import read_transcript, transcript_notes
from a2g_jax.io.words import Word, is_word

HELLO = (Word("hello", 0.2, 0.5), Word("there", 0.5, 0.9))
YES = (Word("yes", 1.0, 1.3),)
PHONES = tuple(Word(text, 0.2 + 0.1 * k, 0.3 + 0.1 * k) for k, text in enumerate(("HH", "AH0", "L", "OW1")))


def grid(path, encoding="utf-8", **tiers):
    """A TextGrid, long form, of tiers by name; names with spaces as ``spk1___words``."""
    lines = ['File type = "ooTextFile"', 'Object class = "TextGrid"', "", "xmin = 0", "xmax = 9000", "tiers? <exists>"]
    lines += [f"size = {len(tiers)}", "item []:"]
    for number, (name, words) in enumerate(tiers.items(), 1):
        lines += [f"item [{number}]:", 'class = "IntervalTier"', f'name = "{name.replace("___", " - ")}"', "xmin = 0"]
        lines += ["xmax = 9000", f"intervals: size = {len(words)}"]
        for k, word in enumerate(words, 1):
            lines += [f"intervals [{k}]:", f"xmin = {word.start}", f"xmax = {word.end}"]
            lines += ['text = "' + word.text.replace('"', '""') + '"']
    path.write_bytes("\n".join(lines).encode(encoding))
    return path


def codes(path):
    return [note.code for note in transcript_notes(path)[1]]


@pytest.mark.parametrize(
    "text",
    ["", " ", "sil", "SIL", "sp", "spn", "SPN", "{spn}", "<unk>", "<UNK>", "unk", "<eps>", "<p:>", "[laughter]",
     "(noise)", "{laugh}", "<usb>", "[ Breath ]", "*coughs*", "-", "...", "#", "--", "?"],
)  # fmt: skip
def test_no_words(text, tmp_path):
    assert not is_word(text)
    words = (Word("a", 0.0, 0.5), Word(text or " ", 0.5, 1.0), Word("b", 1.0, 1.5))
    assert [word.text for word in read_words(grid(tmp_path / "a.TextGrid", words=words))] == ["a", "b"]
    if text.strip():
        (tmp_path / "a.tsv").write_text("".join(f"{w.start}\t{w.end}\t{w.text}\n" for w in words))
        entries = [{"start_time": w.start, "end_time": w.end, "word": w.text} for w in words]
        (tmp_path / "a.json").write_text(json.dumps([{"alternatives": [{"words": entries}]}]))
        for name in ("a.tsv", "a.json"):
            assert [word.text for word in read_transcript(tmp_path / name)] == ["a", "b"]


@pytest.mark.parametrize(
    "text",
    ["hello", "it's", "silence", "noise", "A", "3", "o'clock", 'say "hi"', "wörld", "你好", "e-mail", "[a] b [c"],
)
def test_words(text, tmp_path):
    assert is_word(text)
    for encoding in ("utf-8", "utf-16"):
        path = grid(tmp_path / "a.TextGrid", encoding, words=(Word(text, 0.0, 0.5),))
        assert read_words(path) == (Word(text, 0.0, 0.5),)


@pytest.mark.parametrize(
    "name", ["words", "Words", "word", "anna - words", "anna_words", "allwords", "ORT-MAU", "Wörter"]
)
def test_the_tier_of_words_is_found_by_its_name(name, tmp_path):
    path = grid(tmp_path / "a.TextGrid", **{"phones": PHONES, "notes": YES, name: HELLO})
    assert read_words(path) == HELLO
    assert codes(path) == []


def test_a_tier_of_any_other_name(tmp_path):
    path = grid(tmp_path / "a.TextGrid", phones=PHONES, Anna=HELLO)
    assert read_words(path) == HELLO
    assert codes(path) == []


@pytest.mark.parametrize("name", ["phones", "anna - phones", "Phonemes", "MAU", "segments", "syllables"])
def test_phones_alone_are_refused(name, tmp_path):
    path = grid(tmp_path / "a.TextGrid", **{name: PHONES})
    with pytest.raises(InputError, match=f"has no tier of words; its tier is '{name}'"):
        read_words(path)
    assert read_words(path, name) == PHONES


@pytest.mark.parametrize("labels", [("HH", "AH0", "L", "OW1"), ("h", "ə", "l", "oʊ")])
def test_phones_are_known_by_their_labels_too(labels, tmp_path):
    many = tuple(Word(labels[k % 4], 0.1 * k, 0.1 * k + 0.1) for k in range(40))
    path = grid(tmp_path / "a.TextGrid", anna=many)
    with pytest.raises(InputError, match="has no tier of words"):
        read_words(path)
    assert read_words(grid(path, words=many)) == many
    chinese = tuple(Word("你好"[k % 2], 0.1 * k, 0.1 * k + 0.1) for k in range(40))
    assert read_words(grid(path, anna=chinese)) == chinese


@pytest.mark.parametrize(
    ("first", "second", "chosen"),
    [
        ("spk1___words", "spk2___words", "spk2"),
        ("Host", "Guest", "guest"),
        ("A_words", "B_words", "b"),
        ("words_A", "words_B", "B"),
    ],
)
def test_several_speakers(first, second, chosen, tmp_path):
    path = grid(tmp_path / "a.TextGrid", **{first: HELLO, "phones": PHONES, second: YES})
    words, (note,) = transcript_notes(path)
    assert words == HELLO
    assert note.code == "tiers"
    assert second.replace("___", " - ") in note.message
    assert "--tier" in note.fix
    assert read_words(path, chosen) == YES
    assert read_words(path, note.fix.split("'")[1]) == YES
    with reading(tier=chosen) as choices:
        assert read_words(path) == read_transcript(path) == YES
    assert choices.notes == []
    with pytest.raises(InputError, match="has no interval tier 'Carl'; its tiers are"):
        read_words(path, "Carl")


def test_a_silent_first_speaker_is_passed_over(tmp_path):
    path = grid(tmp_path / "a.TextGrid", spk1___words=(), spk2___words=YES)
    assert read_words(path) == YES
    assert codes(path) == []


def spoken(*times, factor=1.0):
    return tuple(Word(f"w{k}", factor * start, factor * end) for k, (start, end) in enumerate(times))


TIMES = ((0.2, 0.5), (0.5, 0.93), (1.25, 1.5), (2.0, 2.75))


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (spoken(*TIMES), []),
        (spoken(*TIMES, (3.0, 4.9)), []),
        ((), ["no-words"]),
        ((Word("spn", 0.0, 1.0), Word("<eps>", 1.0, 2.0)), ["no-words"]),
        (spoken(*TIMES, (3.0, 301.8)), ["long-word"]),
        (spoken((0.7, 299.5)), ["time-unit"]),
        (spoken(*TIMES, factor=1000), ["milliseconds"]),
        (spoken((840, 1170)), ["milliseconds"]),
        (spoken(*TIMES, factor=16000), ["time-unit"]),
        ((Word("this is one sentence", 0.0, 2.0), Word("and here is another", 2.0, 4.0)), ["sentences"]),
    ],
)
def test_remarks_on_times(words, expected, tmp_path):
    assert codes(grid(tmp_path / "a.TextGrid", words=words)) == expected
    (tmp_path / "a.tsv").write_text("".join(f"{w.start}\t{w.end}\t{w.text}\n" for w in words) or "\n")
    assert codes(tmp_path / "a.tsv") == expected


def test_remarks_go_to_the_reading(tmp_path):
    path = tmp_path / "a.TextGrid"
    write_words(path, (), 2.0)
    with reading() as choices:
        assert read_words(path) == ()
        read_words(path)
    assert choices.notes == [f"{path}: has no words in tier 'words'. Did the aligner fail? Align the transcript again."]


def test_real_take(shared):
    assert codes(shared / "beat" / "2_scott_0_1_1.TextGrid") == []


@pytest.mark.parametrize(("factor", "name"), [(100, "hundredths"), (1000, "milliseconds"), (10_000_000, "100 ns")])
def test_units_of_time_are_told_apart(factor, name, tmp_path):
    _, (note,) = transcript_notes(grid(tmp_path / "a.TextGrid", words=spoken(*TIMES, factor=factor)))
    assert name in note.message
    assert note.fix == f"Divide them by {factor}: times are in seconds."


def test_marks_of_noise_in_other_styles_are_no_words(tmp_path):
    marks = ("NOISE", "LAUGH", "+BREATH+", "%hesitation", "&=laughs", "xxx", "<p:>", "{SL}", "#", "--", "[noise]")
    labels = tuple(Word(mark, 0.1 * n, 0.1 * n + 0.1) for n, mark in enumerate(marks))
    path = grid(tmp_path / "a.TextGrid", words=(*labels, Word("noise", 2.0, 2.2), Word("50%", 2.2, 2.5)))
    assert [word.text for word in transcript_notes(path)[0]] == ["noise", "50%"]


def test_times_before_the_recording_and_decimal_commas_are_named(tmp_path):
    path = grid(tmp_path / "a.TextGrid", words=HELLO)
    text = path.read_text()
    start = str(HELLO[0].start)
    path.write_text(text.replace(f"xmin = {start}", "xmin = -1.5"))
    if path.read_text() != text:
        assert "early-word" in codes(path)
    path.write_text(text.replace(".", ","))
    with pytest.raises(InputError, match="has a decimal comma in"):
        transcript_notes(path)
    (tmp_path / "a.tsv").write_text("0,1\t0,5\thello\n")
    with pytest.raises(InputError, match="write a point in place of the comma"):
        transcript_notes(tmp_path / "a.tsv")
