import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from a2g_jax.errors import InputError
from a2g_jax.io.textgrid import read_words, write_words
from a2g_jax.io.words import is_word
from a2g_jax.recording import Word

WORDS = (Word("hello", 0.25, 0.5), Word('"world"', 0.5, 1.0), Word("ünï, ! [1] xmin = 3", 1.5, 2.0))

SHORT = """File type = "ooTextFile"
Object class = "TextGrid"

0
2.5
<exists>
3
"TextTier"
"clicks"
0
2.5
1
0.75
"click"
"IntervalTier"
"phones"
0
2.5
1
0
2.5
"sil"
"IntervalTier"
"scott - words"
0
2.5
4
0
0.25
""
0.25
0.5
"hello"
0.5
1.0
"say ""world"" "
1
2.5
"<eps>"
"""


def test_round_trip(tmp_path):
    path = tmp_path / "a.TextGrid"
    write_words(path, WORDS, 2.5, tiers={'"phones"': (Word("h", 0.25, 0.3),)})
    assert read_words(path) == WORDS
    assert read_words(path, '"phones"') == (Word("h", 0.25, 0.3),)
    write_words(path, (), 2.5)
    assert read_words(path) == ()
    assert list(tmp_path.iterdir()) == [path]


letters = st.characters(exclude_categories=("C", "Z"))


@settings(max_examples=50, deadline=None)
@given(
    texts=st.lists(st.text(letters, min_size=1, max_size=8), max_size=6),
    steps=st.lists(st.floats(1e-3, 10), min_size=13, max_size=13),
)
def test_any_words_round_trip(tmp_path_factory, texts, steps):
    path = tmp_path_factory.mktemp("grid") / "a.TextGrid"
    times = [sum(steps[: i + 1]) for i in range(len(steps))]
    words = tuple(Word(text, times[2 * i], times[2 * i + 1]) for i, text in enumerate(texts) if is_word(text))
    write_words(path, words, times[-1])
    assert read_words(path) == words


def test_praatio_reads_the_same(tmp_path):
    praat = pytest.importorskip("praatio.textgrid")
    path = tmp_path / "a.TextGrid"
    write_words(path, WORDS, 2.5, tiers={"phones": (Word("h", 0.25, 0.3),)})
    grid = praat.openTextgrid(str(path), includeEmptyIntervals=False)
    assert grid.tierNames == ("words", "phones")
    assert grid.maxTimestamp == 2.5
    assert [(e.label, e.start, e.end) for e in grid.getTier("words").entries] == [
        (w.text, w.start, w.end) for w in WORDS
    ]


@pytest.mark.parametrize("form", ["short_textgrid", "long_textgrid"])
def test_reads_what_praatio_writes(tmp_path, form):
    praat = pytest.importorskip("praatio.textgrid")
    grid = praat.Textgrid(0, 3)
    grid.addTier(praat.IntervalTier("words", [(w.start, w.end, w.text) for w in WORDS], 0, 3))
    grid.save(str(tmp_path / "a.TextGrid"), format=form, includeBlankSpaces=True)
    assert read_words(tmp_path / "a.TextGrid") == WORDS


@pytest.mark.parametrize(
    "encode",
    [
        lambda t: t.encode(),
        lambda t: t.encode("utf-8-sig"),
        lambda t: t.encode("utf-16"),
        lambda t: t.replace("\n", "\r\n").encode(),
        lambda t: t.replace("\n", "\r").encode(),
        lambda t: t.rstrip("\n").encode(),
        lambda t: t.replace("ooTextFile", "ooTextFile short").encode(),
        lambda t: t.replace("<exists>", '<exists> ! a comment with 7 and a " in it').encode(),
    ],
)
def test_short_form_in_every_encoding(tmp_path, encode):
    path = tmp_path / "a.TextGrid"
    path.write_bytes(encode(SHORT))
    assert read_words(path) == (Word("hello", 0.25, 0.5), Word('say "world"', 0.5, 1.0))


def test_chooses_the_tier(tmp_path):
    path = tmp_path / "a.TextGrid"
    path.write_text(SHORT.replace("scott - words", "other").replace('"sil"', '"f"'))
    assert read_words(path)[0].text == "hello"
    assert read_words(path, "other")[0].text == "hello"
    assert read_words(path, "phones") == (Word("f", 0.0, 2.5),)
    with pytest.raises(InputError, match="has no interval tier 'clicks'; its tiers are 'phones', 'other'"):
        read_words(path, "clicks")


BROKEN = {
    "text": ("hello world\n", "line 2: expected a TextGrid text file"),
    "other object": (SHORT.replace("TextGrid", "Pitch"), "expected a TextGrid text file"),
    "binary": ("ooBinaryFile\x08TextGrid", "expected a TextGrid text file"),
    "cut in a tier": (
        SHORT[: SHORT.index("1.0\n")],
        "line 35: expected an end time in tier 'scott - words'; got the end",
    ),
    "cut in a text": (SHORT[: SHORT.index("lo")], "line 33: a quote opens here and never closes"),
    "fewer intervals": (SHORT.replace("2.5\n4\n", "2.5\n5\n"), "got the end of the file"),
    "many tiers": (SHORT.replace("<exists>\n3", "<exists>\n4"), "expected the class of a tier in quotes; got the end"),
    "half a tier": (SHORT.replace("<exists>\n3", "<exists>\n3.5"), "line 7: expected the number of tiers"),
    "negative": (SHORT.replace("2.5\n4\n", "2.5\n-4\n"), "expected the number of intervals"),
    "huge claim": (SHORT.replace("2.5\n4\n", "2.5\n999999999999\n"), "got the end of the file"),
    "class": (SHORT.replace("IntervalTier", "IntervallTier"), "line 15: expected IntervalTier or TextTier"),
    "backwards": (SHORT.replace("0.25\n0.5\n", "0.5\n0.25\n"), "line 32: expected rising times"),
    "overlap": (SHORT.replace("0.5\n1.0\n", "0.3\n1.0\n"), "line 35: expected rising times"),
    "infinity": (SHORT.replace("0.25\n0.5\n", "0.25\n1e999\n"), "line 32: expected an end time"),
    "no tiers": (SHORT[: SHORT.index("<exists>")] + "<absent>\n", "has no interval tier"),
    "empty": ("", "is empty"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_broken_files(tmp_path, name):
    text, message = BROKEN[name]
    (tmp_path / "a.TextGrid").write_text(text)
    with pytest.raises(InputError) as caught:
        read_words(tmp_path / "a.TextGrid")
    assert message in str(caught.value)
    assert str(caught.value).startswith(str(tmp_path / "a.TextGrid"))
    assert "\n" not in str(caught.value)


def test_other_encodings_and_paths(tmp_path):
    (tmp_path / "a.TextGrid").write_bytes(SHORT.replace("hello", "hällo").encode("latin-1"))
    with pytest.raises(InputError, match="neither UTF-8 nor UTF-16"):
        read_words(tmp_path / "a.TextGrid")
    with pytest.raises(InputError, match="no such file"):
        read_words(tmp_path / "none.TextGrid")
    with pytest.raises(InputError, match="is a folder"):
        read_words(tmp_path)


@pytest.mark.parametrize(
    ("words", "seconds", "tiers", "message"),
    [
        ([Word("a", 0.0, 1.0), Word("b", 0.5, 2.0)], 3.0, None, "'b' is at 0.5 to 2.0 s"),
        ([Word("a", 1.0, 1.0)], 3.0, None, "is at"),
        ([Word("a", -1.0, 1.0)], 3.0, None, "is at"),
        ([Word("a", 0.0, 4.0)], 3.0, None, "is at"),
        ([Word("a", 0.0, float("nan"))], 3.0, None, "is at"),
        ([Word(" ", 0.0, 1.0)], 3.0, None, "printable word"),
        ([Word("a\nb", 0.0, 1.0)], 3.0, None, "printable word"),
        ([], 0.0, None, "positive length"),
        ([], float("inf"), None, "positive length"),
        ([], 1.0, {"words": ()}, "rename the other"),
        ([], 1.0, {"x": [Word("a", 0.0, 2.0)]}, "tier 'x'"),
    ],
)
def test_writing_refuses(tmp_path, words, seconds, tiers, message):
    with pytest.raises(InputError, match=message):
        write_words(tmp_path / "a.TextGrid", words, seconds, tiers=tiers)
    assert list(tmp_path.iterdir()) == []


def test_real_take(shared):
    words = read_words(shared / "beat/2_scott_0_1_1.TextGrid")
    assert len(words) == 199
    assert words[0] == Word("the", 1.42, 1.52)
    assert len(read_words(shared / "beat/2_scott_0_1_1.TextGrid", "phones")) > 400
    praat = pytest.importorskip("praatio.textgrid")
    grid = praat.openTextgrid(str(shared / "beat/2_scott_0_1_1.TextGrid"), includeEmptyIntervals=False)
    assert [e.label for e in grid.getTier("words").entries] == [word.text for word in words]
