"""Units named by other tools, and their relation to the joints' units."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

_POSITION_UNITS = (
    ("rad", 1.0, ("rad", "radian", "radians")),
    ("rad", math.pi / 180.0, ("deg", "degree", "degrees", "°")),
    ("m", 1.0, ("m", "meter", "meters", "metre", "metres")),
    ("m", 1e-3, ("mm",)),
)
BASES = {word: (unit, size) for unit, size, names in _POSITION_UNITS for word in names}
"""Unit of a joint, and the size in it, by the word for a unit of position."""

PER_TIME = {"s": 1, "sec": 1, "second": 1, "s2": 2, "sec2": 2, "s3": 3, "sec3": 3}
"""Power of seconds in the denominator of a quantity."""

LOADS = ("nm", "n", "a", "ma")
"""Units of efforts and currents; such columns are skipped."""

SECONDS = ("s", "sec", "second", "seconds")

_SEPARATORS = re.compile(r"[._/\s\[\](){}:|-]+")
_NEWTON_METRE = re.compile(r"(?<![^\W_])n[\s·⋅*.]?m(?![^\W_])")


def words(text: str) -> list[str]:
    """Words of a heading or unit in lower case, powers as digits: `rad/s²` is rad, s2."""
    text = text.lower().replace("²", "2").replace("³", "3").replace("^", "").replace("**", "")
    text = _NEWTON_METRE.sub("nm", text)
    return [word for word in _SEPARATORS.split(text) if word]


def in_si(text: str) -> bool:
    """Whether a text names s, rad, m, a rate of these, or a unit of efforts or currents."""
    base, *per = [word for word in words(text) if word != "per"] or [""]
    own = base in (*SECONDS, *LOADS) or (base in BASES and BASES[base][1] == 1.0)
    return own and all(word in PER_TIME for word in per)


def time_order(per: Sequence[str]) -> int:
    """Power of seconds in a unit's denominator, given as `s2` or as repeated `s`."""
    return sum(PER_TIME[word] for word in per)
