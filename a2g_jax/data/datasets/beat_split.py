"""The official split of BEAT's English data.

From the README (github.com/PantoMatrix/PantoMatrix, "Train/val/test split") and ``preprocessing.ipynb`` there, which
cuts recordings at 30 and 300 seconds.
"""

from typing import NamedTuple

_FOUR_HOURS = frozenset({1, 2, 3, 4, 6, 7, 8, 9, 11, 21})
_SPEAKERS = range(1, 31)
_FIRST_OF_EMOTION = frozenset({65, 73, 81, 87, 95, 103, 111})
_LAST_OF_EMOTION = frozenset({72, 80, 86, 94, 102, 110, 118})


class Part(NamedTuple):
    """A part of a recording in the split."""

    label: str
    """Suffix of the recording's name: ``""`` for the whole, ``"a"`` and ``"b"`` for its halves."""
    split: str
    start: float
    """Seconds."""
    end: float | None


def parts(speaker: int, kind: int, first: int, last: int) -> tuple[Part, ...]:
    """The parts of a recording in the split.

    Speakers of four hours are split by sequence number. Of those of one hour, the first sequence of each emotion and
    the first conversation are cut into a half for testing and one for validation. Numbers that the README
    does not list are for training, as in its script. Other languages have no split, nor has a recording of
    several sequences that are split differently.

    Args:
        speaker: number of the speaker, 1 to 30.
        kind: type of the recording: 0 English speech, 1 English conversation, above: other languages.
        first: first sequence number of the recording.
        last: its last sequence number.
    """
    whole = (Part("", "", 0.0, None),)
    if kind > 1 or speaker not in _SPEAKERS:
        return whole
    four_hours = speaker in _FOUR_HOURS
    found = {_split(four_hours, bool(kind), number) for number in range(first, last + 1)}
    if found == {"halves"}:
        middle = 300.0 if kind else 30.0
        return (Part("a", "test", 0.0, middle), Part("b", "validation", middle, None))
    return (Part("", found.pop(), 0.0, None),) if len(found) == 1 else whole


def _split(four_hours: bool, conversation: bool, number: int) -> str:
    if conversation:
        if number == 1:
            return "test" if four_hours else "halves"
        return "validation" if four_hours and number == 12 else "train"
    if number in _FIRST_OF_EMOTION:
        return "test" if four_hours else "halves"
    if four_hours:
        test, validation = number in range(1, 9), number in range(57, 65) or number in _LAST_OF_EMOTION
    else:
        test, validation = number in range(1, 5), number in range(5, 9)
    return "test" if test else "validation" if validation else "train"
