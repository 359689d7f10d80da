"""Joints that a robot's file adds to its URDF, and a URDF seen from another of its links.

Both change the URDF before it is read, so that all else knows one tree of joints.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any
from xml.dom.minidom import Element

import numpy as np
from pydantic import model_validator

from knotwork.documents import StrictModel, Text
from knotwork.documents.values import Interval, Positive, Vector3, optional
from knotwork.errors import InputError
from knotwork.robot.urdf_rules import child_elements, link_of
from knotwork.waypoints import FloatArray

CELL = "cell"
"""Name of the root link of a robot with external axes."""

ROBOT = "robot"
"""What a rail or a column carries."""


class ExternalAxis(StrictModel):
    """A joint beside those of the URDF: a rail or a column below it, a positioner next to it."""

    carries: Text | None = optional(
        "robot for a rail or a column; else the name of the link that it makes, a "
        "table. Left out: that of the joint"
    )
    parent: Text = optional(
        "Link that carries it: cell, which does not move, or that of another axis", CELL, key="in"
    )
    position: Vector3 = optional("Origin in that link [m]", (0.0, 0.0, 0.0))
    rpy: Vector3 = optional("Turns about that link's x, y, z axes [rad]", (0.0, 0.0, 0.0))
    slides: Vector3 | None = optional("Its direction, if it slides")
    turns: Vector3 | None = optional("Its direction, if it turns")
    range: Interval | None = optional(
        "Lower and upper limit of its position [rad or m]; left out: it turns without limit"
    )
    velocity: Positive | None = optional("Largest speed [rad/s or m/s]")

    @model_validator(mode="after")
    def _one_direction(self) -> ExternalAxis:
        if (self.slides is None) == (self.turns is None):
            raise ValueError("give slides or turns, a direction such as [0, 0, 1]")
        if not any(self.slides or self.turns or ()):
            raise ValueError("its direction must not be zero")
        if self.slides is not None and self.range is None:
            raise ValueError("slides, and so it has an end: give its range, [lower, upper] in m")
        return self


Axes = tuple[tuple[str, ExternalAxis], ...]
"""External axes with the names of their joints."""


def add_axes(robot: Element, axes: Axes, root: str) -> None:
    """Put external axes into a URDF, below a new root link `CELL`.

    Args:
        robot: The URDF, which is changed.
        axes: The axes.
        root: Its root link.

    Raises:
        InputError: An axis makes a link or a joint that there is already.
    """
    links, joints = (
        {one.getAttribute("name") for one in child_elements(robot, kind)}
        for kind in ("link", "joint")
    )
    for name, one in axes:
        link = one.carries or name
        key = "carries: " if one.carries else ""
        if name in joints:
            raise InputError(f"{name}: there is a joint {name!r} already; accepted: another name")
        if link in links or link == CELL:
            raise InputError(
                f"{name}: {key}there is a link {link!r} already; accepted: the name of a new link, "
                f"{ROBOT} for what carries the arm, or, to stand on that link, in: {link}"
            )
        links |= {link} - {ROBOT}
        joints.add(name)
    carried = [one.carries or name for name, one in axes]
    for link in (CELL, *(link for link in carried if link != ROBOT)):
        _put(robot, "link", name=link)
    if ROBOT not in carried:
        _joint(robot, f"{CELL} to {root}", "fixed", (CELL, root))
    for (name, one), link in zip(axes, carried, strict=True):
        kind = "prismatic" if one.slides else "revolute" if one.range else "continuous"
        ends = one.parent, root if link == ROBOT else link
        joint = _joint(robot, name, kind, ends, one.position, one.rpy)
        _put(joint, "axis", xyz=_text(one.slides or one.turns or ()))
        lower, upper = map(repr, one.range or (0.0, 0.0))
        _put(joint, "limit", velocity=str(one.velocity or 0), effort="0", lower=lower, upper=upper)


def see_from(robot: Element, link: str) -> None:
    """Make a link the root of a URDF: joints on the way to it from the root are turned round.

    A joint brings its child to T · J(q) in its parent, so it brings the parent to J(-q) · T⁻¹ in
    the child: an axis that points the other way, then a fixed step.

    Args:
        robot: The URDF, which is changed.
        link: One of its links.
    """
    import pinocchio as pin  # the keys of robot files need none

    above = {link_of(one, "child"): one for one in child_elements(robot, "joint")}
    while link in above:
        joint, child = above[link], link
        link = link_of(joint, "parent")
        step, axis = f"{link} from {child}", _attribute(joint, "axis", "xyz", "1 0 0")
        turn = pin.rpy.rpyToMatrix(_attribute(joint, "origin", "rpy"))
        back = pin.SE3(turn, _attribute(joint, "origin", "xyz")).inverse()
        for old in child_elements(joint):
            if old.tagName in ("parent", "child", "origin", "axis"):
                joint.removeChild(old)
        _put(joint, "parent", link=child)
        _put(joint, "child", link=step)
        _put(joint, "axis", xyz=_text(-axis))
        _put(robot, "link", name=step)
        rpy = pin.rpy.matrixToRpy(back.rotation)
        _joint(robot, step, "fixed", (step, link), back.translation, rpy)


def _joint(
    robot: Element,
    name: str,
    kind: str,
    ends: tuple[str, str],
    xyz: Sequence[float] | FloatArray = (0.0, 0.0, 0.0),
    rpy: Sequence[float] | FloatArray = (0.0, 0.0, 0.0),
) -> Element:
    joint = _put(robot, "joint", name=name, type=kind)
    _put(joint, "origin", xyz=_text(xyz), rpy=_text(rpy))
    for end, link in zip(("parent", "child"), ends, strict=True):
        _put(joint, end, link=link)
    return joint


def _put(carrier: Element, tag: str, **attributes: str) -> Element:
    document: Any = carrier.ownerDocument
    made: Element = document.createElement(tag)
    for name, value in attributes.items():
        made.setAttribute(name, value)
    carrier.appendChild(made)
    return made


def _text(numbers: Sequence[float] | FloatArray) -> str:
    return " ".join(repr(float(number)) for number in numbers)


def _attribute(joint: Element, tag: str, name: str, default: str = "0 0 0") -> FloatArray:
    given = [one.getAttribute(name) for one in child_elements(joint, tag)]
    return np.array([float(part) for part in ((given and given[0]) or default).split()])
