"""Argument types for numbers in a range and for lists of formats; each refuses other text in words."""

import argparse
from collections.abc import Callable
from typing import Any

from a2g_jax.errors import InputError
from a2g_jax.generation.formats import chosen_formats
from a2g_jax.io.reading import parse_channel

#: Help of ``--channel`` and ``--tier``.
CHANNEL = "channel of audio files with several (default: the mean of all)"
TIER = "tier of TextGrids with several, or the speaker it is of (default: the first tier of words)"

#: Help on ``--verify``.
VERIFY = (
    "read all files of the corpus to compare them with their hashes, also those whose size and times are as they were"
    " when they were last read"
)


def number(kind: Callable[[str], Any], low: float | int, high: float | int, meaning: str) -> Callable[[str], Any]:
    """An argument type for numbers from ``low`` to ``high``.

    Args:
        kind: ``int`` or ``float``.
        meaning: of the expected value, for the message: ``"a number from 1 to 1000"``.
    """

    def convert(text: str) -> Any:
        try:
            value = kind(text)
        except ValueError:
            value = float("nan")
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"expected {meaning}; got {text!r}")
        return value

    return convert


positive = number(float, 1e-6, 1e9, "a number above 0")
count = number(int, 1, 1000, "a whole number from 1 to 1000")
natural = number(int, 1, 10**9, "a whole number above 0")
whole = number(int, 0, 10**6, "a whole number from 0 to 1000000")
sample_rate = number(int, 8000, 96000, "a whole number from 8000 to 96000")
frame_rate = number(float, 1, 1000, "a number from 1 to 1000")
seed = number(int, 0, 2**31 - 1, "a whole number from 0 to 2147483647")
share = number(float, 0, 1, "a number from 0 to 1")


def channel(text: str) -> int:
    """An argument type for a channel: left, right or a number from 1 on."""
    try:
        return parse_channel(text)
    except InputError:
        raise argparse.ArgumentTypeError(f"expected left, right or a number from 1 on; got {text!r}") from None


def seed_list(text: str) -> tuple[int, ...]:
    """An argument type for different seeds, comma-separated."""
    seeds = tuple(seed(part.strip()) for part in text.split(",") if part.strip())
    if not seeds or len(set(seeds)) < len(seeds):
        raise argparse.ArgumentTypeError(f"expected different whole numbers, comma-separated; got {text!r}")
    return seeds


def device_count(text: str) -> int | str:
    """An argument type for a number of devices, or ``all``."""
    if text == "all":
        return text
    try:
        return int(number(int, 1, 10**6, "")(text))
    except argparse.ArgumentTypeError:
        raise argparse.ArgumentTypeError(f"expected a whole number above 0, or all; got {text!r}") from None


def formats(known: tuple[str, ...]) -> Callable[[str], tuple[str, ...]]:
    """An argument type for a comma-separated list of file formats."""

    def convert(text: str) -> tuple[str, ...]:
        try:
            return chosen_formats(text, known)
        except InputError as error:
            raise argparse.ArgumentTypeError(str(error).rstrip(".")) from None

    return convert


#: A cutoff of ``--smooth``.
cutoff = number(float, 0.5, 60, "a frequency from 0.5 to 60 Hz")
SMOOTH_HELP = "filter out what is faster than HZ, such as shaking joints; timing stays (default: off; alone: %(const)g)"
