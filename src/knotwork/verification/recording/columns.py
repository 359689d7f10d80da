"""Columns of a log, from the headings of PlotJuggler, ROS bags and robot loggers.

Columns other than joint positions and time are skipped.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from knotwork.files.foreign.headings import HeadingError, parse_heading, quantity_named, split_words

PREFERRED_TOPIC = "joint_states"
"""Last part of the topic that is read if several topics have all joints, as ROS names it."""

_INDEXED = re.compile(r"(?P<word>[^\W\d]+?)_?\[?(?P<index>\d+)\]?")
_STAMP = re.compile(r"(?P<prefix>.*)header/stamp(/(?P<part>s(?=ec)|n(?=sec|anosec))\w+)?")
_TOPIC_SEPARATORS = re.compile(r"[./:]")
_MEASURED = ("actual", "measured", "state")
_REQUESTED = ("target", "desired", "reference", "command", "commanded", "error", "output")


@dataclass(frozen=True)
class PositionColumn:
    """A column with positions of a joint.

    Attributes:
        topic: The heading before the joint's name.
        joint: Index of the joint.
        index: Index of the column.
        factor: Factor to SI.
        unit_given: Whether the heading states the unit.
    """

    topic: str
    joint: int
    index: int
    factor: float
    unit_given: bool


@dataclass(frozen=True)
class LogColumns:
    """Columns of a log.

    Attributes:
        clock: Columns of the time with their factors to s; a factor of 0 means that the unit
            follows from the size of the values.
        positions: The column of each joint.
    """

    clock: tuple[tuple[int, float], ...]
    positions: tuple[PositionColumn, ...]


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
        first: Cells of the first row, which may have names of joints (`name[0]`).
        joint_names: The known joints.
        joint_units: `"rad"` or `"m"` for each.
        topic: Heading before the joint's name; columns of other topics are skipped.
        degrees: Whether columns of rad joints without a unit are in degrees.

    Raises:
        HeadingError: The time is missing, or a joint has no position column, or several.
    """
    columns = list(_named_positions(headings, joint_names, joint_units))
    columns = columns or list(_numbered_positions(headings, first, joint_names))
    chosen = _choose_topic(columns, joint_names, topic)
    positions = sorted((item for item in columns if item.topic == chosen), key=lambda p: p.joint)
    if degrees:
        positions = [
            replace(position, factor=math.radians(1.0))
            if joint_units[position.joint] == "rad" and not position.unit_given
            else position
            for position in positions
        ]
    return LogColumns(_clock(headings, chosen), tuple(positions))


def _named_positions(
    headings: Sequence[str], names: Sequence[str], units: Sequence[str]
) -> Iterable[PositionColumn]:
    """Columns with the name of a joint in their heading."""
    for index, heading in enumerate(headings):
        topic, description = _split_heading(heading, names)
        try:
            content = parse_heading(description, names, units)
        except HeadingError:
            continue
        if content.joint is not None and content.quantity == "position":
            stated = {"rad", "deg", "m", "mm", "degrees", "°"} & set(split_words(description))
            yield PositionColumn(topic, content.joint, index, content.factor, bool(stated))


def _split_heading(heading: str, names: Sequence[str]) -> tuple[str, str]:
    """The topic of a heading, and its description: the joint and words of the quantity."""
    joints = "|".join(map(re.escape, names))
    match = re.match(rf".*(?<!\w)(?=({joints})(?!\w))", heading, re.DOTALL)  # up to the last name
    before = match[0] if match else heading
    topic, divider, _ = before.rpartition("/") if "/" in before else before.rpartition(":")
    description = heading[len(topic) + len(divider) :]
    parent, _, last = topic.rpartition("/")
    if quantity_named(last) is not None:  # as in /joint_states/position/elbow
        return parent, f"{last} {description}"
    return topic, description


def _numbered_positions(
    headings: Sequence[str], first: Sequence[str], names: Sequence[str]
) -> Iterable[PositionColumn]:
    """Columns with joint numbers, from 0 or 1: `position[0]`, `actual_q_0`, `field.position0`.

    Their order is that of the columns with names, if there are any, or else that of the robot.
    """
    names_by_topic: dict[str, dict[int, str]] = {}
    groups: dict[tuple[str, str], list[tuple[int, int]]] = {}
    for index, heading in enumerate(headings):
        topic, _, last = _TOPIC_SEPARATORS.sub("/", heading.strip()).rpartition("/")
        match = _INDEXED.fullmatch(last)
        if match is None:
            continue
        *kind, word = split_words(match["word"])
        number = int(match["index"])
        if match["word"] in ("name", "joint_names"):
            names_by_topic.setdefault(topic, {})[number] = first[index].strip()
        elif quantity_named(word) == "position" and not set(kind) & set(_REQUESTED):
            group = (topic, "/".join([topic, *kind]))
            groups.setdefault(group, []).append((number, index))
    for (topic, group_name), columns in groups.items():
        # in the messages of a controller's state, names are one level above the values
        order = names_by_topic.get(topic, names_by_topic.get(topic.rpartition("/")[0]))
        if not order:
            if len(columns) != len(names):
                continue
            order = dict(enumerate(names, min(columns)[0]))
        for number, index in columns:
            if order.get(number) in names:
                joint = list(names).index(order[number])
                yield PositionColumn(group_name, joint, index, 1.0, False)


def _choose_topic(
    positions: Sequence[PositionColumn], names: Sequence[str], wanted: str | None
) -> str:
    """The topic with exactly one position of every joint."""
    topics: dict[str, list[int]] = {}
    for position in positions:
        if wanted is None or position.topic.strip("/") == wanted.strip("/"):
            topics.setdefault(position.topic, []).append(position.joint)
    complete = [topic for topic, joints in topics.items() if len(set(joints)) == len(names)]
    if not complete:
        best = max(topics.values(), key=lambda joints: len(set(joints)), default=[])
        missing = [repr(name) for i, name in enumerate(names) if i not in best]
        where = f" of the topic {wanted!r}" if wanted is not None else ""
        raise HeadingError(
            f"no column{where} is the position of joint {', '.join(missing)}",
            "headings with the joint's name, such as /joint_states/NAME/position, NAME.position "
            "or NAME [deg]; or position[0], actual_q_0 and so on for every joint in the robot's "
            "order",
        )
    ranks = [_rank(topic) for topic in complete]
    chosen = [topic for topic, rank in zip(complete, ranks, strict=True) if rank == min(ranks)]
    if len(chosen) > 1:
        raise HeadingError(
            f"{len(chosen)} topics have positions of all joints: {', '.join(chosen)}",
            "one of them as the topic",
        )
    for joint, name in enumerate(names):
        count = topics[chosen[0]].count(joint)
        if count > 1:
            raise HeadingError(f"{count} columns are the position of joint {name!r}", "one")
    return chosen[0]


def _rank(topic: str) -> int:
    """Rank of a topic: 0 for joint states, then measured, other and requested positions."""
    last = topic.rpartition("/")[2]
    if last == PREFERRED_TOPIC:
        return 0
    if set(split_words(last)) & set(_REQUESTED):
        return 3
    return 1 if set(split_words(topic)) & set(_MEASURED) else 2


def _topic_path(heading: str) -> str:
    """A heading in lower case, its parts separated by slashes."""
    return _TOPIC_SEPARATORS.sub("/", heading.strip()).lower().lstrip("/")


def _clock(headings: Sequence[str], topic: str) -> tuple[tuple[int, float], ...]:
    """Columns of the time: the stamp of the messages, or else the time of their reception."""
    stamps: dict[str, dict[str, int]] = {}
    for index, heading in enumerate(headings):
        if match := _STAMP.fullmatch(_topic_path(heading)):
            stamps.setdefault(match["prefix"], {})[match["part"] or "whole"] = index
    stamp = stamps.get(f"{_topic_path(topic)}/".lstrip("/"), {})
    if not stamp and len(stamps) == 1:
        stamp = next(iter(stamps.values()))
    if "s" in stamp and "n" in stamp:
        return (stamp["s"], 1.0), (stamp["n"], 1e-9)
    if "whole" in stamp:
        return ((stamp["whole"], 0.0),)
    times = []
    for index, heading in enumerate(headings):
        try:
            content = parse_heading(heading.strip().lstrip("%"), (), ())
        except HeadingError:
            continue
        if content.quantity == "time" and content.clock != "step":
            stated = split_words(heading)[-1] in ("s", "sec", "seconds", "ms", "us", "ns")
            times.append((index, content.factor if stated else 0.0))
    if len(times) == 1:
        return (times[0],)
    raise HeadingError(
        f"{len(times)} columns are times" if times else "no column is the time",
        "one column named time, timestamp or __time, or header.stamp.sec and .nanosec",
    )
