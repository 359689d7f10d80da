"""Headings of the columns of a CSV file, and the names of units in them."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

from knotwork.errors import suggest_name
from knotwork.files.foreign.point_table import QUANTITIES
from knotwork.joint_quantities import JOINT_QUANTITIES, MOTION_QUANTITIES

_OTHER_WORDS = {
    "position": ("pos", "q", "angle"),
    "velocity": ("vel", "qd", "dq", "qdot", "speed"),
    "acceleration": ("acc", "accel", "qdd", "ddq", "qddot"),
    "effort": ("torque", "tau", "force", "current", "voltage", "temperature"),
}
_QUANTITY = {
    word: name
    for name, quantity in JOINT_QUANTITIES.items()
    for word in (name, quantity.plural, *_OTHER_WORDS.get(name, ()))
}
LABELS = ("segment", "event")
"""Headings of columns of text, which are skipped."""

_CLOCKS = {
    "absolute": ("time", "times", "t", "timestamp", "stamp", "seconds", "secs", "sec", "s"),
    "start": ("time_from_start",),
    "step": ("time_step",),
}
_TIMES = {name: clock for clock, names in _CLOCKS.items() for name in names}
_SECONDS = ("s", "sec", "second", "seconds")
_TIME_UNITS = {**dict.fromkeys(_SECONDS, 1.0), "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
_OWN_JOINT = re.compile(rf"(.+)\.((?:{'|'.join(MOTION_QUANTITIES)})_\w+)", re.DOTALL)
_OWN_TOOL = re.compile(
    r"tool\.(position|quaternion|linear_velocity|angular_velocity)_[xyzw](_\w+)?"
)
_OWN_TIME = re.compile(r"time(_from_start|_step)?_s")

_POSITION_UNITS = (
    ("rad", 1.0, ("rad", "radian", "radians")),
    ("rad", math.pi / 180.0, ("deg", "degree", "degrees", "°")),
    ("m", 1.0, ("m", "meter", "meters", "metre", "metres")),
    ("m", 1e-3, ("mm",)),
)
_BASES = {word: (unit, size) for unit, size, names in _POSITION_UNITS for word in names}
"""By a word for a unit of position: SI unit of the joint, and size of the unit in it."""
_PER_TIME = {"s": 1, "sec": 1, "second": 1} | {
    f"{word}{order}": order for word in ("s", "sec") for order in range(2, len(MOTION_QUANTITIES))
}
"""Power of seconds by a word in the denominator of a unit."""
_SKIPPED_UNITS = ("nm", "n", "a", "ma")
"""Units of efforts and currents, whose columns are skipped."""
_SEPARATORS = re.compile(r"[._/\s\[\](){}:|-]+")
_NEWTON_METRE = re.compile(r"(?<![^\W_])n[\s·⋅*.]?m(?![^\W_])")


@dataclass(frozen=True)
class Column:
    """The contents of a column.

    Attributes:
        quantity: `"time"`, one of `QUANTITIES`, or empty for a skipped column.
        joint: Index of the joint, or `None`.
        factor: Factor to SI.
        clock: Reference of times: `"absolute"`, `"start"` for the start of the task, `"step"` for
            the previous row.
    """

    quantity: str
    joint: int | None = None
    factor: float = 1.0
    clock: str = "absolute"


class HeadingError(Exception):
    """An invalid heading; `accepted` describes the accepted ones, if the message does not."""

    def __init__(self, message: str, accepted: str = "") -> None:
        self.accepted = accepted
        super().__init__(message)


def parse_heading(heading: str, joint_names: Sequence[str], joint_units: Sequence[str]) -> Column:
    """Parse one heading.

    Time is `time`, `t`, `timestamp` and the like, `time_from_start` or `time_step`, optionally with
    a unit s, ms, us or ns. A joint's position is its name, or the name with a word for the quantity
    before or after it, and its unit: `elbow`, `elbow.position_rad`, `vel_elbow`, `elbow [deg]`,
    `elbow_velocity (deg/s)`. Jerks, efforts, currents and the like, labels, and columns of `tool`
    are skipped. Headings of Knotwork's own tables are matched whole, so a joint may have any name.

    Raises:
        HeadingError: The heading is unknown, has a unit that the joint does not have, or
            contradicts itself.
    """
    if _OWN_TOOL.fullmatch(heading) or heading in LABELS:
        return Column("")
    own_heading = _OWN_JOINT.fullmatch(heading)
    named = None if _OWN_TIME.fullmatch(heading) else _longest_named(heading, joint_names)
    if own_heading is not None and own_heading[1] in joint_names:
        named = joint_names.index(own_heading[1]), own_heading[2]
    if named is not None:
        joint, description = named
        name, unit = joint_names[joint], joint_units[joint]
        quantity, factor = _joint_quantity(heading, split_words(description), name, unit)
        return Column(quantity, joint, factor) if quantity in QUANTITIES else Column("")
    time = _time(heading)
    if time is not None:
        return time
    if heading.strip().lower().startswith("tool."):
        return Column("")
    first = re.split(r"[.\s\[(]", heading.strip())[0]
    hint = suggest_name(first, ["time", *joint_names])
    raise HeadingError(
        f"the column {heading!r} is neither time nor a joint; {hint}, and with .position, "
        ".velocity or .acceleration"
    )


def quantity_named(word: str) -> str | None:
    """The quantity that a word names, for example `"velocity"` for `qd`; or `None`."""
    return _QUANTITY.get(word.lower())


def _joint_quantity(heading: str, parts: list[str], name: str, unit: str) -> tuple[str, float]:
    """Quantity of a joint's column, and its factor to SI, from the words next to the name."""
    accepted = "rad, rad/s and rad/s2 (or deg)" if unit == "rad" else "m, m/s and m/s2 (or mm)"
    quantities = list(dict.fromkeys(_QUANTITY[word] for word in parts if word in _QUANTITY))
    stated = [word for word in parts if word not in _QUANTITY and word != "per"]
    if len(quantities) > 1:
        message = f"the column {heading!r} is named {quantities[0]} and {quantities[1]}"
        raise HeadingError(message, "one of them")
    quantity = quantities[0] if quantities else ""
    if quantity == "effort" or (not quantity and len(stated) == 1 and stated[0] in _SKIPPED_UNITS):
        return "effort", 1.0
    if not stated:
        return quantity or "position", 1.0
    base, *per = stated
    kind, factor = _BASES.get(base, ("", 1.0))
    order = sum(_PER_TIME.get(word, len(MOTION_QUANTITIES)) for word in per)
    derived = MOTION_QUANTITIES[order : order + 1]  # empty beyond jerk
    if kind == unit and derived and quantity in ("", *derived):
        return derived[0], factor
    raise HeadingError(
        f"the column {heading!r} has {' '.join(stated)!r}, which is no unit of "
        f"{f'a {quantity} of ' if quantity else ''}joint {name!r}, in {unit}",
        f"position, velocity or acceleration, and {accepted}",
    )


def _longest_named(text: str, joint_names: Sequence[str]) -> tuple[int, str] | None:
    """The joint with the longest name in a heading: its index, and the text around the name."""
    matches = [
        (len(name), i, f"{text[: match.start()]} {text[match.end() :]}")
        for i, name in enumerate(joint_names)
        if (match := re.search(rf"(?<![^\W_]){re.escape(name)}(?![^\W_])", text))
    ]
    return max(matches)[1:] if matches else None


def _time(heading: str) -> Column | None:
    """Parse the heading of a column of times; `None` for another heading."""
    parts = split_words(heading)
    whole, name = "_".join(parts), "_".join(parts[:-1])
    if whole in _TIMES:
        return Column("time", clock=_TIMES[whole])
    if name not in _TIMES or name in _SECONDS:
        return None
    if parts[-1] not in _TIME_UNITS:
        raise HeadingError(f"the column {heading!r} is a time in {parts[-1]!r}", "s, ms, us or ns")
    return Column("time", None, _TIME_UNITS[parts[-1]], _TIMES[name])


def split_words(text: str) -> list[str]:
    """Split a heading or unit into words in lower case, powers as digits: `rad/s²` is rad, s2."""
    text = text.lower().replace("²", "2").replace("³", "3").replace("^", "").replace("**", "")
    text = _NEWTON_METRE.sub("nm", text)
    return [word for word in _SEPARATORS.split(text) if word]


def is_si(text: str) -> bool:
    """Whether a unit is s, rad, m, a rate of these, or one of efforts or currents."""
    base, *per = [word for word in split_words(text) if word != "per"] or [""]
    is_si_base = base in (*_SECONDS, *_SKIPPED_UNITS) or _BASES.get(base, ("", 0.0))[1] == 1.0
    return is_si_base and all(word in _PER_TIME for word in per)
