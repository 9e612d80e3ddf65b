"""Cases of TextGrid files."""

from pathlib import Path

from a2g_jax.inspection.inspect import inspect
from a2g_jax.io.textgrid import read_words
from experiments.cases.runner import Case, Outcome, finds, refuses, reported


def _words(*expected: str):
    def check(path: Path) -> Outcome:
        report, words = inspect(path), [word.text for word in read_words(path)]
        return words == list(expected) and report.warnings == 0, f"{len(words)} words {words}; {reported(report)}"

    return check


def _speakers(path: Path) -> Outcome:
    report = inspect(path)
    right, text = finds("tiers", words="'spk2 - words' left out")(path)
    first, second = read_words(path), read_words(path, "spk2")
    chosen = inspect(path, tier="spk2")
    right = right and "--tier" in report.text() and first != second and chosen.warnings == 0
    return right, f"{text} With --tier spk2: {[word.text for word in second]}"


CASES: tuple[Case, ...] = (
    Case("textgrid/ref.TextGrid", "five words, nothing reported", _words("ask", "not", "what", "your", "country")),
    Case("textgrid/phones_only.TextGrid", "no tier of words", refuses("has no tier of words", "'phones'")),
    Case("textgrid/speaker_dash_words_mfa3.TextGrid", "the second speaker named, and how to choose", _speakers),
    Case("textgrid/quotes_and_braces.TextGrid", "one word", _words('say "hi"')),
    Case("textgrid/words_tier_empty.TextGrid", "no words", finds("no-words", words="has no words")),
    Case("textgrid/last_word_298s.TextGrid", "a word of 298.8 s", finds("long-word", words="298.8 s")),
    Case("textgrid/milliseconds.TextGrid", "milliseconds", finds("milliseconds", words="milliseconds")),
)
