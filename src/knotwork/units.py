"""`Units`: those that a scenario's file is written in, for whatever people read."""

from __future__ import annotations

import math
from dataclasses import dataclass

_FACTORS = {"m": 1.0, "mm": 1e3, "rad": 1.0, "deg": 180.0 / math.pi}
"""What one SI unit is in each of them."""
MOST_DIGITS = 7
"""Of numbers without a power of ten."""


@dataclass(frozen=True)
class Units:
    """Units of length and angle that values are shown in; what is computed and stored is in SI.

    >>> Units("mm", "deg").shown(0.25, "m/s")
    (250.0, 'mm/s')

    Attributes:
        length: `"m"` or `"mm"`.
        angle: `"rad"` or `"deg"`.
    """

    length: str = "m"
    angle: str = "rad"

    def shown(self, value: float, unit: str) -> tuple[float, str]:
        """A value in SI in these units, and the name of its unit.

        Args:
            value: In SI.
            unit: Its SI unit; those without metres or radians at their head stay as they are.
        """
        head, slash, rest = unit.partition("/")
        own = {"m": self.length, "rad": self.angle}.get(head)
        return (value, unit) if own is None else (value * _FACTORS[own], f"{own}{slash}{rest}")

    def text(self, value: float, unit: str, form: str = ".6g") -> str:
        """A value in SI in words, in these units.

        >>> Units("mm", "deg").text(3.14159, "rad/s²", ".4g")
        '180 deg/s²'
        """
        shown, name = self.shown(value, unit)
        return f"{readable(shown, form)} {name}".rstrip()


def readable(value: float, form: str = ".4g") -> str:
    """A number for people: no powers of ten below ten millions, and short ones next to others.

    >>> readable(-429_718.3), readable(1.25e9), readable(2.54e-14, ".3g")
    ('-429700', '1.25e9', '2.54e-14')
    """
    text = format(value, form)
    digits, power, exponent = text.partition("e")
    if value == 0.0:
        return "0"
    if not power:
        return text
    return f"{float(text):.0f}" if 0 < int(exponent) < MOST_DIGITS else f"{digits}e{int(exponent)}"


SI = Units()
"""Metres and radians."""
