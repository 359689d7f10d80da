"""`Units`: the units of a scenario file, for output."""

from __future__ import annotations

import math
from dataclasses import dataclass
from decimal import ROUND_CEILING, ROUND_FLOOR, Context

_FACTORS = {"m": 1.0, "mm": 1e3, "rad": 1.0, "deg": 180.0 / math.pi}
"""Number of each unit in one SI unit."""
MAX_DIGITS = 7
"""Maximum number of digits before the decimal point; larger numbers have a power of ten."""


@dataclass(frozen=True)
class Units:
    """Units of length and angle for output; values are computed and stored in SI.

    >>> Units("mm", "deg").shown(0.25, "m/s")
    (250.0, 'mm/s')

    Attributes:
        length: `"m"` or `"mm"`.
        angle: `"rad"` or `"deg"`.
    """

    length: str = "m"
    angle: str = "rad"

    @property
    def per_metre(self) -> float:
        """Number of units of length in a metre."""
        return _FACTORS[self.length]

    def shown(self, value: float, unit: str) -> tuple[float, str]:
        """Convert a value from SI, and return it with the name of its unit.

        Args:
            value: Value in SI.
            unit: SI unit of the value; units that don't begin with metres or radians are unchanged.
        """
        base, slash, rate = unit.partition("/")
        name = {"m": self.length, "rad": self.angle}.get(base)
        return (value, unit) if name is None else (value * _FACTORS[name], f"{name}{slash}{rate}")

    def text(self, value: float, unit: str, spec: str = ".6g") -> str:
        """Format an SI value in these units, with its unit; `spec` is a format of Python.

        >>> Units("mm", "deg").text(3.14159, "rad/s²", ".4g")
        '180 deg/s²'
        """
        return f"{self.number(value, unit, spec)} {self.shown(value, unit)[1]}".rstrip()

    def number(self, value: float | None, unit: str, spec: str = ".4g") -> str:
        """Text of an SI value in these units, without its unit; empty for `None`."""
        return "" if value is None else readable(self.shown(value, unit)[0], spec)


def readable(value: float, spec: str = ".4g") -> str:
    """Text of a number, without a power of ten if it is below ten million.

    >>> readable(-429_718.3), readable(1.25e9), readable(2.54e-14, ".3g")
    ('-429700', '1.25e9', '2.54e-14')
    """
    text = format(value, spec)
    digits, power, exponent = text.partition("e")
    if value == 0.0:
        return "0"
    if not power:
        return text
    return f"{float(text):.0f}" if 0 < int(exponent) < MAX_DIGITS else f"{digits}e{int(exponent)}"


def rounded_up(value: float, digits: int = 6) -> float:
    """Round up to `digits` significant digits; differences below 1e-12 of the value are ignored.

    >>> rounded_up(1.3833333), rounded_up(2.0)
    (1.38334, 2.0)
    """
    return float(Context(prec=digits, rounding=ROUND_CEILING).create_decimal(f"{value:.12g}"))


def rounded_down(value: float, digits: int = 6) -> float:
    """Round down to `digits` significant digits; differences below 1e-12 of the value are ignored.

    >>> rounded_down(1.3833333, 3), rounded_down(0.0)
    (1.38, 0.0)
    """
    return float(Context(prec=digits, rounding=ROUND_FLOOR).create_decimal(f"{value:.12g}"))


SI = Units()
"""Metres and radians."""
