"""The frame rate that a printed frame time stands for."""

import math
import re

#: Rates that cameras and capture systems run at. The whole numbers come first: where a short number fits both 24 and
#: 23.976, it means 24.
_USUAL = (15, 20, 24, 25, 30, 48, 50, 60, 90, 100, 120, 240, *(rate * 1000 / 1001 for rate in (24, 30, 60, 120)))


def rate_from_frame_time(printed: str) -> float:
    """Frames a second, from the seconds between frames as a file prints them.

    A frame time is a rounded number, and its error adds up: 0.0333 read as 30.03 fps drifts from the speech by 60 ms
    a minute. The rate is therefore the usual one (or the whole number) that prints as the same digits, or that lies
    within one part in ten thousand; else it is 1 / frame time.

    Args:
        printed: a positive, finite decimal number such as ``0.033333`` or ``8.333e-03``.
    """
    seconds = float(printed)
    rate = 1 / seconds
    digits, decimals = _precision(printed)
    whole = round(rate)
    for usual in _USUAL:
        if math.isclose(rate, usual, rel_tol=1e-6):
            return float(usual)
    for usual in _USUAL:
        if abs(rate - usual) <= 0.02 * usual and _prints_as(1 / usual, seconds, digits, decimals):
            return float(usual)
    near = [usual for usual in (*_USUAL, whole) if usual > 0 and math.isclose(rate, usual, rel_tol=1e-4)]
    if near:
        return float(min(near, key=lambda usual: abs(usual - rate)))
    if whole > 0 and digits >= 3 and _prints_as(1 / whole, seconds, digits, decimals):
        return float(whole)
    return rate


def _precision(printed: str) -> tuple[int, int]:
    # Significant digits, and decimals behind the point.
    mantissa, _, exponent = printed.lower().partition("e")
    figures = re.sub(r"[^0-9]", "", mantissa).lstrip("0")
    decimals = len(mantissa.partition(".")[2]) - int(exponent or 0)
    return len(figures), max(decimals, 0)


def _prints_as(exact: float, seconds: float, digits: int, decimals: int) -> bool:
    # One digit says too little, and two do where the writer cut digits off instead of rounding.
    unit = 10.0**-decimals
    if digits < 2:
        return False
    rounded = abs(exact - seconds) <= 0.5001 * unit
    cut = digits >= 3 and 0 <= exact - seconds <= unit
    return rounded or cut
