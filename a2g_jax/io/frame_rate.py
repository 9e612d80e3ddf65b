"""Frame rates from rounded frame times."""

import math
import re

#: Rates of cameras and capture systems. Whole numbers come first: a short number that fits 24 and 23.976 means 24.
_USUAL = (15, 20, 24, 25, 30, 48, 50, 60, 90, 100, 120, 240, *(rate * 1000 / 1001 for rate in (24, 30, 60, 120)))


def rate_from_frame_time(printed: str) -> float:
    """Frames per second, from the seconds between frames as printed in a file.

    A frame time is a rounded number, and its error accumulates: 0.0333 read as 30.03 fps drifts from the speech by
    60 ms per minute. So the rate is the usual one (or the whole number) whose frame time prints as the same digits, or
    that differs by less than one part in ten thousand; otherwise it is 1 / frame time.

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


def usual_rate(rate: float, within: float) -> float | None:
    """The usual rate that is nearest to a measured one, if it differs by no more than a share; otherwise None."""
    nearest = min(_USUAL, key=lambda usual: abs(usual - rate))
    return float(nearest) if abs(nearest - rate) <= within * nearest else None


def _precision(printed: str) -> tuple[int, int]:
    # Significant digits, and digits after the decimal point.
    mantissa, _, exponent = printed.lower().partition("e")
    figures = re.sub(r"[^0-9]", "", mantissa).lstrip("0")
    decimals = len(mantissa.partition(".")[2]) - int(exponent or 0)
    return len(figures), max(decimals, 0)


def _prints_as(exact: float, seconds: float, digits: int, decimals: int) -> bool:
    # One digit is too little evidence, and so are two where the writer truncated instead of rounding.
    unit = 10.0**-decimals
    if digits < 2:
        return False
    rounded = abs(exact - seconds) <= 0.5001 * unit
    cut = digits >= 3 and 0 <= exact - seconds <= unit
    return rounded or cut
