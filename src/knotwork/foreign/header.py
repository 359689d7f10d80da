"""What the columns of a CSV file are, from their headings."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

from knotwork.errors import did_you_mean

QUANTITIES = ("position", "velocity", "acceleration")
_WORDS = {
    "position": ("position", "positions", "pos", "q", "angle"),
    "velocity": ("velocity", "velocities", "vel", "qd", "dq", "qdot", "speed"),
    "acceleration": ("acceleration", "accelerations", "acc", "accel", "qdd", "ddq", "qddot"),
    "": ("jerk", "effort", "torque", "tau", "current"),
}
_QUANTITY = {word: quantity for quantity, words in _WORDS.items() for word in words}
_TIMES = {
    "time": 1.0,
    "times": 1.0,
    "t": 1.0,
    "timestamp": 1.0,
    "stamp": 1.0,
    "time_from_start": 1.0,
    "seconds": 1.0,
    "secs": 1.0,
    "sec": 1.0,
    "s": 1.0,
}
_TIME_UNITS = {"s": 1.0, "sec": 1.0, "seconds": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
_UNITS = {
    "rad": ("rad", 1.0),
    "deg": ("rad", math.pi / 180.0),
    "degrees": ("rad", math.pi / 180.0),
    "m": ("m", 1.0),
    "mm": ("m", 1e-3),
}
_ORDER = {"s": 1, "s2": 2, "s3": 3, "nm": 0, "n": 0}
_SEPARATORS = re.compile(r"[._/\s\[\](){}:|-]+")


@dataclass(frozen=True)
class Column:
    """What a column holds.

    Attributes:
        quantity: `"time"`, one of `QUANTITIES`, or empty for what is not needed.
        joint: Index of the joint, or `None`.
        factor: What its numbers are multiplied with to be in SI.
    """

    quantity: str
    joint: int | None = None
    factor: float = 1.0


class HeadingError(Exception):
    """A heading that can't be understood; its message says why, `accepted` what would do."""

    def __init__(self, message: str, accepted: str) -> None:
        self.accepted = accepted
        super().__init__(message)


def column(heading: str, joint_names: Sequence[str], joint_units: Sequence[str]) -> Column:
    """Understand one heading.

    Time is `time`, `t`, `timestamp` and the like, with a unit s, ms, us or ns if any. A joint's
    position is its name alone, or with a word for the quantity before or behind it, and its unit:
    `elbow`, `elbow.position_rad`, `vel_elbow`, `elbow [deg]`, `elbow_velocity (deg/s)`. Jerks,
    efforts and columns of `tool` are not needed and left out.

    Raises:
        HeadingError: It is something else, or in a unit that the joint hasn't got.
    """
    text = heading.strip()
    joint = _joint(text, joint_names)
    if joint is None:
        scale = _time(text)
        if scale is not None:
            return Column("time", None, scale)
        if text.lower().startswith("tool."):
            return Column("")
        known = ["time", *joint_names]
        first = re.split(r"[.\s\[(]", text)[0]
        raise HeadingError(
            f"the column {heading!r} is neither time nor a joint of the scenario",
            did_you_mean(first, known) + ", and with .position, .velocity or .acceleration",
        )
    name = joint_names[joint]
    rest = text.replace(name, " ", 1).lower().replace("²", "2").replace("³", "3").replace("^", "")
    words = [word for word in _SEPARATORS.split(rest) if word]
    quantity, factor, order = "position", 1.0, None
    named = False
    for word in words:
        if word in _QUANTITY and not named:
            quantity, named = _QUANTITY[word], True
        elif word in _UNITS and factor == 1.0:
            kind, factor = _UNITS[word]
            if kind != joint_units[joint]:
                raise HeadingError(
                    f"the column {heading!r} is in {word}, but joint {name!r} is in "
                    f"{joint_units[joint]}",
                    "rad or deg" if joint_units[joint] == "rad" else "m or mm",
                )
        elif word in _ORDER:
            order = _ORDER[word]
        elif word != "per":
            raise HeadingError(
                f"the column {heading!r} has {word!r}, which is not understood",
                "position, velocity or acceleration, and rad, deg, m or mm, per s or s2",
            )
    if order is not None and quantity in QUANTITIES and order != QUANTITIES.index(quantity):
        if named:
            raise HeadingError(
                f"the column {heading!r} is a {quantity} with the unit of another quantity",
                "rad, rad/s and rad/s2 (or deg, m, mm)",
            )
        quantity = QUANTITIES[order] if order < len(QUANTITIES) else ""
    return Column(quantity, joint, factor)


def _joint(text: str, joint_names: Sequence[str]) -> int | None:
    """Index of the joint that a heading names, the longest name if several fit."""
    found = [
        (len(name), i)
        for i, name in enumerate(joint_names)
        if re.search(rf"(?<![^\W_]){re.escape(name)}(?![^\W_])", text)
    ]
    return max(found)[1] if found else None


def _time(text: str) -> float | None:
    """What a time's heading makes a second of, or `None` if it is none."""
    lower = text.lower()
    if lower in _TIMES:
        return _TIMES[lower]
    words = [word for word in _SEPARATORS.split(lower) if word]
    if len(words) > 1 and words[-1] in _TIME_UNITS and "_".join(words[:-1]) in _TIMES:
        return _TIME_UNITS[words[-1]]
    return None
