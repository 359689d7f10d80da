"""Joints that a robot's file adds to its URDF, and a URDF seen from another of its links.

Both change the URDF before it is read, so that all else knows one tree of joints.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple
from xml.dom.minidom import Element

import numpy as np
import pinocchio as pin

from knotwork.robot.urdf_rules import child_elements, link_of
from knotwork.waypoints import FloatArray

CELL = "cell"
"""Name of the root link of a robot with external axes."""

ROBOT = "robot"
"""What a rail or a column carries."""

Numbers = tuple[float, ...]


class ExternalAxis(NamedTuple):
    """A joint beside those of a URDF: a rail below it, a turntable next to it.

    Attributes:
        name: Of the joint.
        carries: Name of the link that it makes, or `"robot"` for the root of the URDF.
        parent: Link that carries it.
        position: Of its origin in that link [m].
        rpy: Turns about that link's x, y, z axes [rad].
        axis: Direction in its own axes.
        turns: Whether it turns, or slides.
        range: Lower and upper limit [rad or m]; empty for one that turns without limit.
        velocity: Its limit [rad/s or m/s]; 0 for none.
    """

    name: str
    carries: str
    parent: str
    position: Numbers
    rpy: Numbers
    axis: Numbers
    turns: bool
    range: Numbers
    velocity: float


def add_axes(robot: Element, axes: Sequence[ExternalAxis], root: str) -> None:
    """Put external axes into a URDF, below a new root link `CELL`.

    Args:
        robot: The URDF, which is changed.
        axes: The axes.
        root: Its root link.
    """
    made = [CELL, *(one.carries for one in axes if one.carries != ROBOT)]
    for name in made:
        _put(robot, "link", name=name)
    for one in axes:
        kind = "prismatic" if not one.turns else "revolute" if one.range else "continuous"
        child = root if one.carries == ROBOT else one.carries
        joint = _add_joint(robot, one.name, kind, (one.parent, child), one.position, one.rpy)
        _put(joint, "axis", xyz=_text(one.axis))
        lower, upper = one.range or (0.0, 0.0)
        limit = {"lower": repr(lower), "upper": repr(upper)} if one.range else {}
        _put(joint, "limit", velocity=repr(one.velocity), effort="0", **limit)
    if all(one.carries != ROBOT for one in axes):
        _add_joint(robot, f"{CELL} to {root}", "fixed", (CELL, root))


def see_from(robot: Element, link: str) -> None:
    """Make a link the root of a URDF: joints on the way to it from the root are turned round.

    A joint brings its child to T · J(q) in its parent, so it brings the parent to J(-q) · T⁻¹ in
    the child: an axis that points the other way, then a fixed step.

    Args:
        robot: The URDF, which is changed.
        link: One of its links.
    """
    above = {link_of(one, "child"): one for one in child_elements(robot, "joint")}
    while link in above:
        joint, child = above[link], link
        link = link_of(joint, "parent")
        step = f"{link} from {child}"
        origin = _origin(joint).inverse()
        fixed = joint.getAttribute("type") == "fixed"
        _end(joint, "parent", child)
        _end(joint, "child", link if fixed else step)
        for old in child_elements(joint, "origin"):
            joint.removeChild(old)
        back = tuple(origin.translation), tuple(pin.rpy.matrixToRpy(origin.rotation))
        if fixed:
            _put(joint, "origin", xyz=_text(back[0]), rpy=_text(back[1]))
            continue
        axis = next(iter(child_elements(joint, "axis")), None)
        if axis is None:
            axis = _put(joint, "axis", xyz="1 0 0")
        axis.setAttribute("xyz", _text(-_numbers(axis.getAttribute("xyz"))))
        _put(robot, "link", name=step)
        _add_joint(robot, step, "fixed", (step, link), *back)


def _origin(joint: Element) -> pin.SE3:
    for one in child_elements(joint, "origin"):
        xyz, rpy = (one.getAttribute(name) or "0 0 0" for name in ("xyz", "rpy"))
        return pin.SE3(pin.rpy.rpyToMatrix(_numbers(rpy)), _numbers(xyz))
    return pin.SE3.Identity()


def _end(joint: Element, end: str, link: str) -> None:
    child_elements(joint, end)[0].setAttribute("link", link)


def _add_joint(
    robot: Element,
    name: str,
    kind: str,
    ends: tuple[str, str],
    position: Numbers = (0.0, 0.0, 0.0),
    rpy: Numbers = (0.0, 0.0, 0.0),
) -> Element:
    joint = _put(robot, "joint", name=name, type=kind)
    _put(joint, "origin", xyz=_text(position), rpy=_text(rpy))
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


def _numbers(text: str) -> FloatArray:
    return np.array([float(part) for part in text.split()])
