"""Words, syllables, phones and accents of a speech plan, as the tiers of a TextGrid."""

from a2g_jax.io.words import Word
from a2g_jax.talker.plan import phone_spans
from a2g_jax.talker.speech import SpeechPlan


def word_tier(plan: SpeechPlan) -> tuple[Word, ...]:
    """The words with their times; pauses are the gaps between them."""
    return tuple(Word(word.text, word.start, word.end) for word in plan.words)


def speech_tiers(plan: SpeechPlan) -> dict[str, tuple[Word, ...]]:
    """Tiers above and below the words, for :func:`a2g_jax.io.textgrid.write_words`.

    - ``phrases``: how each breath group's melody ends (``fall``, ``continuation`` or ``question``).
    - ``syllables``: phone symbols joined by dots, after a ``'`` where the lexical stress lies.
    - ``phones``: symbols of :data:`~a2g_jax.talker.phones.PHONES`.
    - ``accents``: prominence of the syllables that carry a pitch accent, 0 to 1 with two decimals.

    Times are seconds, in order and without overlap; neighbours that touch share exactly the same number.
    """
    # Sums in different orders differ in their last bits: a shared boundary is where the next interval starts.
    onsets = [syllable.onset for syllable in plan.syllables]
    following = [*onsets[1:], plan.seconds]
    ends = [min(syllable.end, after) for syllable, after in zip(plan.syllables, following, strict=True)]
    syllables, phones, accents = [], [], []
    for syllable, end in zip(plan.syllables, ends, strict=True):
        text = "'" * (syllable.stress > 0) + ".".join(syllable.phones)
        syllables.append(Word(text, syllable.onset, end))
        if syllable.accent > 0.0:
            accents.append(Word(f"{syllable.accent:.2f}", syllable.onset, end))
        spans = phone_spans(syllable)
        borders = [start for _, start, _ in spans[1:]] + [end]
        phones += [Word(symbol, start, stop) for (symbol, start, _), stop in zip(spans, borders, strict=True)]
    return {
        "phrases": tuple(Word(phrase.ending, phrase.start, phrase.end) for phrase in plan.phrases),
        "syllables": tuple(syllables),
        "phones": tuple(phones),
        "accents": tuple(accents),
    }
