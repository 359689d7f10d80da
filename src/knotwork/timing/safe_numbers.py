"""Numbers that messages name, rounded to the side on which they can be taken."""

from __future__ import annotations

import math
from collections.abc import Callable

SPARE = 1e-4
"""A value that a solver found is moved to the safe side by this part of it."""


def rounded_up(value: float, digits: int = 6) -> float:
    """Round a positive number up to so many digits.

    >>> rounded_up(1.3833333), rounded_up(2.0)
    (1.38334, 2.0)
    """
    return -_rounded_down(-value, digits)


def rounded_down(value: float, digits: int = 6) -> float:
    """Round a positive number down to so many digits.

    >>> rounded_down(1.3833333, 3), rounded_down(0.0)
    (1.38, 0.0)
    """
    return _rounded_down(value, digits)


def with_room(value: float) -> float:
    """A duration or limit a little above one that was found, which a solver can take.

    >>> with_room(1.3833333)
    1.384
    """
    return rounded_up(value * (1.0 + SPARE), 4)


def _rounded_down(value: float, digits: int) -> float:
    if not value or not math.isfinite(value):
        return value
    places = digits - 1 - math.floor(math.log10(abs(value)))
    near = round(value, places)
    if abs(near - value) <= 1e-12 * abs(value):
        return near
    return round(math.floor(value * 10.0**places) / 10.0**places, places)


def with_margin(text: Callable[[float], str], limit: float, margin: float) -> str:
    """A limit in words, with what it is before the margin that it has already.

    >>> with_margin("{:g} m/s".format, 1.8, 0.9)
    '1.8 m/s, 0.9 of 2 m/s (margin)'
    """
    if margin == 1.0:
        return text(limit)
    return f"{text(limit)}, {margin:g} of {text(limit / margin)} (margin)"
