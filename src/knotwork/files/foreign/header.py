"""The meaning of the columns of a CSV file, from their headings."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from knotwork.errors import did_you_mean
from knotwork.files.foreign.point_table import QUANTITIES
from knotwork.files.foreign.unit_words import BASES, LOADS, PER_TIME, SECONDS, time_order, words
from knotwork.joint_quantities import DERIVATIVES

_QUANTITY_WORDS = {
    "position": ("position", "positions", "pos", "q", "angle"),
    "velocity": ("velocity", "velocities", "vel", "qd", "dq", "qdot", "speed"),
    "acceleration": ("acceleration", "accelerations", "acc", "accel", "qdd", "ddq", "qddot"),
    "jerk": ("jerk", "jerks"),
    "effort": ("effort", "efforts", "torque", "tau", "force", "current", "voltage", "temperature"),
}
_QUANTITY = {word: quantity for quantity, words in _QUANTITY_WORDS.items() for word in words}
LABELS = ("segment", "event")
"""Columns of text, which are skipped."""

_CLOCKS = {
    "absolute": (
        ("time", "times", "t", "timestamp", "stamp"),
        ("seconds", "secs", "sec", "s"),
    ),
    "start": (("time_from_start",), ()),
    "step": (("time_step",), ()),
}
_TIMES = {name: clock for clock, (names, seconds) in _CLOCKS.items() for name in names + seconds}
_OWN_TIMES = {"time_s": "absolute", "time_from_start_s": "start", "time_step_s": "step"}
_OWN_JOINT = re.compile(rf"(.+)\.((?:{'|'.join(DERIVATIVES)})_\w+)", re.DOTALL)
_OWN_TOOL = re.compile(
    r"tool\.(position|quaternion|linear_velocity|angular_velocity)_[xyzw](_\w+)?"
)
_TIME_UNITS = {**dict.fromkeys(SECONDS, 1.0), "ms": 1e-3, "us": 1e-6, "ns": 1e-9}


@dataclass(frozen=True)
class Column:
    """The contents of a column.

    Attributes:
        quantity: `"time"`, one of `QUANTITIES`, or empty for a skipped column.
        joint: Index of the joint, or `None`.
        factor: Factor to SI.
        clock: Reference of times: `"absolute"`, `"start"` for the start of the
            task, `"step"` for the previous row.
    """

    quantity: str
    joint: int | None = None
    factor: float = 1.0
    clock: str = "absolute"


class HeadingError(Exception):
    """An invalid heading; the message has the reason, `accepted` the accepted ones."""

    def __init__(self, message: str, accepted: str) -> None:
        self.accepted = accepted
        super().__init__(message)


class UnknownHeadingError(HeadingError):
    """A heading with neither time nor a joint."""


def column(heading: str, joint_names: Sequence[str], joint_units: Sequence[str]) -> Column:
    """Parse one heading.

    Time is `time`, `t`, `timestamp` and the like, `time_from_start` or `time_step`, optionally with
    a unit s, ms, us or ns. A joint's position is its name, or the name with a word for the quantity
    before or after it, and its unit: `elbow`, `elbow.position_rad`, `vel_elbow`, `elbow [deg]`,
    `elbow_velocity (deg/s)`. Jerks, efforts, currents and the like and columns of `tool` are
    skipped.

    Raises:
        HeadingError: The heading is unknown, has a unit that the joint does not have, or
            contradicts itself.
    """
    text = heading.strip()
    joint_match = _joint(heading, joint_names)
    if joint_match is not None:
        joint, beside = joint_match
        return _joint_column(heading, joint, beside, joint_names[joint], joint_units[joint])
    time = _time(heading)
    if time is not None:
        return time
    if text.lower().startswith("tool."):
        return Column("")
    known = ["time", *joint_names]
    first = re.split(r"[.\s\[(]", text)[0]
    raise UnknownHeadingError(
        f"the column {heading!r} is neither time nor a joint",
        did_you_mean(first, known) + ", and with .position, .velocity or .acceleration",
    )


def own_joint(heading: str) -> str | None:
    """The joint of a heading in our export's form, `elbow.velocity_rad_per_s`, or `None`."""
    match = _OWN_JOINT.fullmatch(heading)
    return match[1] if match else None


def own_column(heading: str, joint_names: Sequence[str], joint_units: Sequence[str]) -> Column:
    """Parse one heading of a file with headings in our export's form.

    They are matched whole, so a joint may have any name, for example `time_s` or `position`. Other
    headings are parsed by `column`, which raises its errors.
    """
    if heading in _OWN_TIMES:
        return Column("time", clock=_OWN_TIMES[heading])
    if _OWN_TOOL.fullmatch(heading) or heading in LABELS:
        return Column("")
    match = _OWN_JOINT.fullmatch(heading)
    if match is None or match[1] not in joint_names:
        return column(heading, joint_names, joint_units)
    joint = joint_names.index(match[1])
    return _joint_column(heading, joint, match[2], match[1], joint_units[joint])


def quantity_named(word: str) -> str | None:
    """The quantity named by a word, `"velocity"` for `qd`, or `None`."""
    return _QUANTITY.get(word.lower())


def _joint_column(heading: str, joint: int, beside: str, name: str, unit: str) -> Column:
    """The column of a joint, from the words next to the joint's name."""
    quantity, factor = _content(heading, words(beside), name, unit)
    return Column(quantity, joint, factor) if quantity in QUANTITIES else Column("")


def _content(heading: str, parts: list[str], name: str, unit: str) -> tuple[str, float]:
    """Quantity and factor of a joint's column, from the words next to the joint's name."""
    accepted = "rad, rad/s and rad/s2 (or deg)" if unit == "rad" else "m, m/s and m/s2 (or mm)"
    named = list(dict.fromkeys(_QUANTITY[word] for word in parts if word in _QUANTITY))
    if len(named) > 1:
        message = f"the column {heading!r} is named {named[0]} and {named[1]}"
        raise HeadingError(message, "one of them")
    if named == ["effort"]:
        return "effort", 1.0
    loads = [word for word in parts if word in LOADS]
    bases = [word for word in parts if word in BASES]
    per = [word for word in parts if word in PER_TIME]
    for word in parts:
        if word == "drive":
            raise HeadingError(
                f"the column {heading!r} is in drive units, and the file does not define them",
                f"{accepted}; export without --scale and --offset to check a table",
            )
        if word != "per" and word not in (*_QUANTITY, *loads, *bases, *per):
            raise HeadingError(
                f"the column {heading!r} has {word!r}, which is unknown",
                f"position, velocity or acceleration, and {accepted}",
            )
    if len(loads) + len(bases) > 1:
        units = " and ".join(map(repr, (*bases, *loads)))
        raise HeadingError(f"the column {heading!r} has the units {units}", "one unit")
    if loads and not named:
        return "effort", 1.0
    if loads:
        raise HeadingError(
            f"the column {heading!r} is a {named[0]} with the unit of an effort or current",
            accepted,
        )
    if not bases:
        if per:
            raise HeadingError(f"the column {heading!r} is per {per[0]} of no unit", accepted)
        return (named or ["position"])[0], 1.0
    kind, factor = BASES[bases[0]]
    if kind != unit:
        raise HeadingError(
            f"the column {heading!r} is in {bases[0]}, but joint {name!r} is in {unit}", accepted
        )
    order = time_order(per)
    quantity = DERIVATIVES[order] if order < len(DERIVATIVES) else ""
    if not quantity or (named and named != [quantity]):
        fault = f"a {named[0]} with the unit of another quantity" if named else "of no known unit"
        raise HeadingError(f"the column {heading!r} is {fault}", accepted)
    return quantity, factor


def _joint(text: str, joint_names: Sequence[str]) -> tuple[int, str] | None:
    """The joint named in a heading (the longest match).

    Returns its index and the remaining text.
    """
    matches = [
        (len(name), i, f"{text[: match.start()]} {text[match.end() :]}")
        for i, name in enumerate(joint_names)
        if (match := re.search(rf"(?<![^\W_]){re.escape(name)}(?![^\W_])", text))
    ]
    return max(matches)[1:] if matches else None


def _time(heading: str) -> Column | None:
    """Parse the heading of a column of times; `None` for another heading."""
    parts = words(heading)
    joined_words, named = "_".join(parts), "_".join(parts[:-1])
    if joined_words in _TIMES:
        return Column("time", None, 1.0, _TIMES[joined_words])
    if named not in _TIMES or named in SECONDS:
        return None
    if parts[-1] not in _TIME_UNITS:
        raise HeadingError(f"the column {heading!r} is a time in {parts[-1]!r}", "s, ms, us or ns")
    return Column("time", None, _TIME_UNITS[parts[-1]], _TIMES[named])
