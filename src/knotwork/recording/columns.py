"""Columns of a log, from the headings of PlotJuggler, ROS bags and robot loggers.

Columns other than joint positions and time are skipped.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from knotwork.foreign.header import HeadingError, column, quantity_named
from knotwork.foreign.unit_words import words

STAMPS = (("sec", "nanosec"), ("secs", "nsecs"), ("sec", "nsec"))
PREFERRED = "joint_states"

_INDEXED = re.compile(r"(?P<word>[^\W\d]+?)_?\[?(?P<index>\d+)\]?")
_MEASURED = ("actual", "measured", "state")
_ASKED = ("target", "desired", "reference", "command", "commanded", "error", "output")


@dataclass(frozen=True)
class LogColumns:
    """Columns of a log.

    Attributes:
        clock: Columns of the time and their factors to s; 0 if the size of the values
            decides.
        position: Index of the column and factor to SI, for each joint.
        units_given: Joints, by index, whose headings state a unit.
    """

    clock: tuple[tuple[int, float], ...]
    position: tuple[tuple[int, float], ...]
    units_given: frozenset[int]


@dataclass(frozen=True)
class _Found:
    topic: str
    joint: int
    index: int
    factor: float
    unit_given: bool


def log_columns(
    headings: Sequence[str],
    first: Sequence[str],
    joint_names: Sequence[str],
    joint_units: Sequence[str],
    *,
    topic: str | None = None,
    degrees: bool = False,
) -> LogColumns:
    """Find time and positions among the headings of a log.

    Args:
        headings: The headings.
        first: Cells of the first row, perhaps with names of joints (`name[0]`).
        joint_names: The known joints.
        joint_units: `"rad"` or `"m"` for each.
        topic: Use columns with this heading before the joint's name.
        degrees: Columns of rad joints without a unit are in degrees.

    Raises:
        HeadingError: Time is missing, or a joint has not exactly one position.
    """
    found = list(_named(headings, joint_names, joint_units)) or list(
        _numbered(headings, first, joint_names)
    )
    chosen = _topic(found, joint_names, topic)
    of = {one.joint: one for one in found if one.topic == chosen}
    position = tuple(
        (of[i].index, math.radians(1.0))
        if degrees and unit == "rad" and not of[i].unit_given
        else (of[i].index, of[i].factor)
        for i, unit in enumerate(joint_units)
    )
    stated = (one.joint for one in of.values() if one.unit_given)
    return LogColumns(_clock(headings, chosen), position, frozenset(stated))


def _named(headings: Sequence[str], names: Sequence[str], units: Sequence[str]) -> Iterable[_Found]:
    """Columns with the name of a joint in their heading."""
    for index, heading in enumerate(headings):
        topic, rest = _split(heading, names)
        try:
            content = column(rest, names, units)
        except HeadingError:
            continue
        if content.joint is None or content.quantity != "position":
            continue
        stated = any(word in ("rad", "deg", "m", "mm", "degrees", "°") for word in words(rest))
        yield _Found(topic, content.joint, index, content.factor, stated)


def _split(heading: str, names: Sequence[str]) -> tuple[str, str]:
    """The topic of a heading, and the rest: the joint and words of the quantity."""
    at = [heading.find(name) for name in names if name in heading]
    before = heading[: min(at)] if at else heading
    topic, divider, _ = before.rpartition("/") if "/" in before else before.rpartition(":")
    rest = heading[len(topic) + len(divider) :]
    last = topic.rpartition("/")[2]
    if quantity_named(last) is not None:  # as in /joint_states/position/elbow
        topic, rest = topic.rpartition("/")[0], f"{last} {rest}"
    return topic, rest


def _numbered(
    headings: Sequence[str], first: Sequence[str], names: Sequence[str]
) -> Iterable[_Found]:
    """Columns with joint numbers, from 0 or 1: `position[0]`, `actual_q_0`, `field.position0`.

    Columns of names, if there are any, give the order; otherwise it is the robot's.
    """
    named: dict[str, dict[int, str]] = {}
    counted: dict[tuple[str, str], list[tuple[int, int]]] = {}
    for index, heading in enumerate(headings):
        topic, _, last = re.sub(r"[./:]", "/", heading.strip()).rpartition("/")
        match = _INDEXED.fullmatch(last)
        if match is None:
            continue
        *kind, word = words(match["word"])
        number = int(match["index"])
        if match["word"] in ("name", "joint_names"):
            named.setdefault(topic, {})[number] = first[index].strip()
        elif quantity_named(word) == "position" and not set(kind) & set(_ASKED):
            group = (topic, "/".join([topic, *kind]))
            counted.setdefault(group, []).append((number, index))
    for (topic, group_name), columns in counted.items():
        # in a controller's state the names are next to the groups of values
        own = named.get(topic, named.get(topic.rpartition("/")[0]))
        if own is None and len(columns) != len(names):
            continue
        order = own or dict(enumerate(names, min(columns)[0]))
        for number, index in columns:
            if order.get(number) in names:
                joint = list(names).index(order[number])
                yield _Found(group_name, joint, index, 1.0, False)


def _topic(positions: Sequence[_Found], names: Sequence[str], wanted: str | None) -> str:
    """The topic with exactly one position of every joint."""
    topics: dict[str, list[int]] = {}
    for one in positions:
        topics.setdefault(one.topic, []).append(one.joint)
    if wanted is not None:
        own = wanted.strip("/")
        topics = {name: joints for name, joints in topics.items() if name.strip("/") == own}
    whole = [name for name, joints in topics.items() if sorted(set(joints)) == [*range(len(names))]]
    if not whole:
        best = max(topics.values(), key=lambda joints: len(set(joints)), default=[])
        missing = [name for i, name in enumerate(names) if i not in best]
        where = f" of the topic {wanted!r}" if wanted is not None else ""
        raise HeadingError(
            f"no column{where} is the position of joint {', '.join(map(repr, missing))}",
            "headings with the joint's name, such as /joint_states/NAME/position, NAME.position "
            "or NAME [deg]; or position[0], actual_q_0 and so on for every joint in the robot's "
            "order",
        )
    preferred = [name for name in whole if name.rpartition("/")[2] == PREFERRED]
    is_own = [n for n in whole if not set(words(n.rpartition("/")[2])) & set(_ASKED)] or whole
    preferred = preferred or [n for n in is_own if set(words(n)) & set(_MEASURED)] or is_own
    if len(preferred) > 1:
        raise HeadingError(
            f"{len(preferred)} topics have positions of all joints: {', '.join(preferred)}",
            "--topic with one of them",
        )
    (chosen,) = preferred
    for joint, name in enumerate(names):
        if topics[chosen].count(joint) > 1:
            raise HeadingError(
                f"{topics[chosen].count(joint)} columns are the position of joint {name!r}", "one"
            )
    return chosen


def _path(heading: str) -> str:
    """A heading in lower case, with slashes as separators."""
    return re.sub(r"[./:]", "/", heading.strip()).lower()


def _clock(headings: Sequence[str], topic: str) -> tuple[tuple[int, float], ...]:
    """Columns of the time: the stamp of the messages, or else of their reception."""
    paths = [_path(heading) for heading in headings]
    own = f"{_path(topic)}/header/stamp".lstrip("/")
    stamps = {path[: path.index("header/stamp") + 12] for path in paths if "header/stamp" in path}
    if own in stamps or len(stamps) == 1:
        stamp = own if own in stamps else stamps.pop()
        for whole, part in STAMPS:
            if f"{stamp}/{whole}" in paths and f"{stamp}/{part}" in paths:
                seconds, rest = paths.index(f"{stamp}/{whole}"), paths.index(f"{stamp}/{part}")
                return (seconds, 1.0), (rest, 1e-9)
        if stamp in paths:
            return ((paths.index(stamp), 0.0),)
    times = []
    for index, heading in enumerate(headings):
        try:
            content = column(heading.strip().lstrip("%"), (), ())
        except HeadingError:
            continue
        if content.quantity == "time" and content.clock != "step":
            stated = words(heading)[-1] in ("s", "sec", "seconds", "ms", "us", "ns")
            times.append((index, content.factor if stated else 0.0))
    if len(times) == 1:
        return (times[0],)
    which = f"{len(times)} columns are times" if times else "no column is the time"
    raise HeadingError(
        which, "one column named time, timestamp or __time, or header.stamp.sec and .nanosec"
    )
