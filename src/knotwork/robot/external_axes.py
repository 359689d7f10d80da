"""External axes of a robot's URDF, and a URDF with another root link.

Both change the URDF before it is read, so that other code handles one tree of joints.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import ClassVar, NamedTuple
from xml.dom.minidom import Element

import numpy as np
from pydantic import model_validator

from knotwork.arrays import FloatArray
from knotwork.errors import InputError
from knotwork.files.documents import StrictModel, Text
from knotwork.files.documents.values import Positive, Range, Vector3, optional
from knotwork.robot.urdf_rules import append_element, child_elements, elements_by_name, read_link

CELL = "cell"
"""Name of the root link of a robot with external axes."""

ROBOT = "robot"
"""Name of the arm as the load of a rail or a column."""


class ExternalAxis(StrictModel):
    """An additional joint or URDF: a rail below the arm, a table next to it, or a positioner."""

    ALTERNATIVES: ClassVar[tuple[tuple[str, ...], ...]] = (
        ("slides", "turns", "urdf"),
        *(("urdf", other) for other in ("carries", "range", "velocity")),
    )

    urdf: Text | None = optional(
        "URDF of a positioner, as `urdf` of the file; its root link is placed, and names in use "
        "get the positioner's name and _ as a prefix"
    )
    carries: Text | None = optional(
        "robot for a rail or a column; otherwise the name of the new link, a table. Left out: "
        "the name of the joint"
    )
    parent: Text = optional(
        "Link that carries it: cell, which is fixed, or that of another axis", CELL, key="in"
    )
    position: Vector3 = optional("Origin in that link [m]", (0.0, 0.0, 0.0))
    rpy: Vector3 = optional("Turns about that link's x, y, z axes [rad]", (0.0, 0.0, 0.0))
    slides: Vector3 | None = optional("Direction of a prismatic joint")
    turns: Vector3 | None = optional("Axis of a revolute joint")
    range: Range | None = optional(
        "Lower and upper limit of its position [rad or m]; left out: unlimited rotation"
    )
    velocity: Positive | None = optional("Largest speed [rad/s or m/s]")

    @model_validator(mode="after")
    def _one_direction(self) -> ExternalAxis:
        if self.urdf is not None:
            return self
        if self.slides is None and self.turns is None:
            raise ValueError("give slides or turns, a direction such as [0, 0, 1], or urdf, a file")
        if not any(self.slides or self.turns or ()):
            raise ValueError("its direction must not be zero")
        if self.slides is not None and self.range is None:
            raise ValueError("slides, and so it has an end: give its range, [lower, upper] in m")
        return self


Axes = tuple[tuple[str, ExternalAxis], ...]
"""External axes with the names of their joints."""


class UrdfFile(NamedTuple):
    """A URDF file, and its links in the tree.

    Attributes:
        path: The file.
        links: Name in the file and name in the tree of each link, in the order of the file.
    """

    path: Path
    links: tuple[tuple[str, str], ...]


def add_axes(
    urdf: Element, axes: Axes, root: str, urdfs: Mapping[str, tuple[Element, str]]
) -> tuple[UrdfFile, ...]:
    """Add external axes to a URDF, below a new root link `CELL`.

    Args:
        urdf: The URDF, which is changed.
        axes: The axes.
        root: Root link of the URDF.
        urdfs: URDF of each axis that has one, whose elements are moved, and its root link.

    Returns:
        Files of the added URDFs.

    Raises:
        InputError: The URDF of an axis has no moving joint, or a name that is used.
    """
    names = {kind: set(elements_by_name(urdf, kind)) for kind in ("link", "joint")}
    names["link"].add(CELL)
    append_element(urdf, "link", name=CELL)
    if not any(axis.carries == ROBOT for _, axis in axes):
        _append_joint(urdf, f"{CELL} to {root}", "fixed", (CELL, root))
    for name, axis in axes:
        if axis.urdf is None:
            _add_joint(urdf, name, axis, root, names)
    shared = {}
    for kind, used_names in names.items():
        added = (elements_by_name(element, kind) for element, _ in urdfs.values())
        counts = Counter(chain(used_names, *added))
        shared[kind] = {name for name, count in counts.items() if count > 1}
    files = [
        _add_urdf(urdf, name, axis, urdfs[name], names, shared)
        for name, axis in axes
        if axis.urdf is not None
    ]
    return tuple(files)


def _add_joint(
    urdf: Element, name: str, axis: ExternalAxis, root: str, names: Mapping[str, set[str]]
) -> None:
    link = axis.carries or name
    names["joint"].add(name)
    if link == ROBOT:
        link = root
    else:
        names["link"].add(link)
        append_element(urdf, "link", name=link)
    kind = "prismatic" if axis.slides else "revolute" if axis.range else "continuous"
    joint = _append_joint(urdf, name, kind, (axis.parent, link), xyz=axis.position, rpy=axis.rpy)
    append_element(joint, "axis", xyz=_format_numbers(axis.slides or axis.turns or ()))
    lower, upper = map(repr, axis.range or (0.0, 0.0))
    append_element(
        joint, "limit", velocity=str(axis.velocity or 0), effort="0", lower=lower, upper=upper
    )


def _add_urdf(
    urdf: Element,
    name: str,
    axis: ExternalAxis,
    added: tuple[Element, str],
    names: Mapping[str, set[str]],
    shared: Mapping[str, set[str]],
) -> UrdfFile:
    """Move links and joints of another URDF into the robot's, renaming `shared` names."""
    other_urdf, root = added
    joints = child_elements(other_urdf, "joint")
    if all(joint.getAttribute("type") == "fixed" for joint in joints):
        raise InputError(
            f"{name}: {axis.urdf} has no joint that moves; accepted: the URDF of a positioner, or, "
            "for what does not move, scene: objects of a scenario"
        )
    new_names: dict[str, dict[str, str]] = {}
    for kind, used_names in names.items():
        elements = elements_by_name(other_urdf, kind)
        new_names[kind] = {old: f"{name}_{old}" if old in shared[kind] else old for old in elements}
        for old, new in new_names[kind].items():
            if new in used_names or (new != old and new in elements):
                raise InputError(
                    f"{name}: another {kind} has the name {old!r} of {axis.urdf}, and {new!r} is "
                    f"the name of one, too; accepted: another name for {name!r}, the prefix"
                )
        used_names.update(new_names[kind].values())
    for element in (*child_elements(other_urdf, "link"), *joints):
        _rename(element, "name", new_names[element.tagName])
        for tag, key in (("parent", "link"), ("child", "link"), ("mimic", "joint")):
            for part in child_elements(element, tag):
                _rename(part, key, new_names[key])
        urdf.appendChild(element)
    new_root = new_names["link"][root]
    _append_joint(
        urdf,
        f"{name} to {new_root}",
        "fixed",
        (axis.parent, new_root),
        xyz=axis.position,
        rpy=axis.rpy,
    )
    return UrdfFile(Path(axis.urdf or ""), tuple(new_names["link"].items()))


def _rename(element: Element, key: str, new_names: Mapping[str, str]) -> None:
    old = element.getAttribute(key)
    element.setAttribute(key, new_names.get(old, old))


def invert_to_root(urdf: Element, link: str) -> None:
    """Make a link the root of a URDF, by inverting the joints between it and the root.

    A joint places its child at T · J(q) in its parent, so it places the parent at J(-q) · T⁻¹ in
    the child. This is a joint with the opposite axis, followed by a fixed joint.

    Args:
        urdf: The URDF, which is changed.
        link: One of its links.
    """
    import pinocchio as pin  # the keys of robot files do not need it

    by_child = {read_link(joint, "child"): joint for joint in child_elements(urdf, "joint")}
    while link in by_child:
        child = link
        joint = by_child[child]
        link = read_link(joint, "parent")
        between = f"{link} from {child}"
        axis = _read_numbers(joint, "axis", "xyz", "1 0 0")
        rotation = pin.rpy.rpyToMatrix(_read_numbers(joint, "origin", "rpy"))
        inverse = pin.SE3(rotation, _read_numbers(joint, "origin", "xyz")).inverse()
        for old in child_elements(joint):
            if old.tagName in ("parent", "child", "origin", "axis"):
                joint.removeChild(old)
        append_element(joint, "parent", link=child)
        append_element(joint, "child", link=between)
        append_element(joint, "axis", xyz=_format_numbers(-axis))
        append_element(urdf, "link", name=between)
        rpy = pin.rpy.matrixToRpy(inverse.rotation)
        _append_joint(urdf, between, "fixed", (between, link), xyz=inverse.translation, rpy=rpy)


def _append_joint(
    urdf: Element,
    name: str,
    kind: str,
    ends: tuple[str, str],
    xyz: Sequence[float] | FloatArray = (0.0, 0.0, 0.0),
    rpy: Sequence[float] | FloatArray = (0.0, 0.0, 0.0),
) -> Element:
    joint = append_element(urdf, "joint", name=name, type=kind)
    append_element(joint, "origin", xyz=_format_numbers(xyz), rpy=_format_numbers(rpy))
    for end, link in zip(("parent", "child"), ends, strict=True):
        append_element(joint, end, link=link)
    return joint


def _format_numbers(numbers: Sequence[float] | FloatArray) -> str:
    return " ".join(repr(float(number)) for number in numbers)


def _read_numbers(joint: Element, tag: str, name: str, default: str = "0 0 0") -> FloatArray:
    values = [element.getAttribute(name) for element in child_elements(joint, tag)]
    return np.array([float(part) for part in ((values and values[0]) or default).split()])
