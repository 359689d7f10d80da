"""Reader of URDFs, into a Pinocchio model with one number per joint position.

Only the tree of links and joints, and their masses, are read, without shapes and meshes.
"""

from __future__ import annotations

import contextlib
import os
import re
import tempfile
from collections.abc import Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple
from xml.dom.minidom import Element

import numpy as np
import pinocchio as pin

from knotwork.errors import InputError, RobotError
from knotwork.files.documents import parse_xml, read_text
from knotwork.robot.external_axes import Axes, UrdfFile, add_axes, invert_to_root
from knotwork.robot.urdf_rules import (
    append_element,
    check_tree,
    child_elements,
    elements_by_name,
    read_link,
    reduce_to_tree,
)

_WIDE_LIMIT = "1e9"
"""Limit of unbounded joints while the URDF is parsed; arrays have infinity instead."""
MAX_URDF_BYTES = 32_000_000
"""Maximum size of a file."""
MAX_URDF_ELEMENTS = 100_000
"""Maximum number of elements of a file."""
_OTHER_FORMATS = {"sdf": "SDF", "mujoco": "MJCF (MuJoCo)", "COLLADA": "COLLADA"}
"""Other XML formats of robots, by their root element."""


class Mimic(NamedTuple):
    """A joint that follows another: position = multiplier · position of `joint` + offset."""

    joint: str
    multiplier: float
    offset: float


class Urdf(NamedTuple):
    """A parsed URDF, with the URDFs and axes joined to it.

    Attributes:
        files: The file, followed by those of the URDFs joined to it.
        model: All of its links and joints; unbounded joints are plain angles in it.
        root: Name of the root link.
        links: Names of all links, in the order of the file.
        parents: Parent link of each link except the root of the file.
        leaves: Names of the links without children.
        types: URDF type of each joint; a continuous one turns without limits.
        mimics: Joints that follow another.
        axes: External axes joined to it.
        added: Names of the moving joints that were joined.
    """

    files: tuple[UrdfFile, ...]
    model: Any
    root: str
    links: tuple[str, ...]
    parents: Mapping[str, str]
    leaves: tuple[str, ...]
    types: Mapping[str, str]
    mimics: Mapping[str, Mimic]
    axes: Axes = ()
    added: tuple[str, ...] = ()

    @property
    def joined_links(self) -> frozenset[frozenset[str]]:
        """Pairs of parent and child links of all joints."""
        return frozenset(map(frozenset, self.parents.items()))


def read_urdf(path: Path, robot_name: str, axes: Axes = (), new_root: str = "") -> Urdf:
    """Read a URDF file. The result is cached by the file's text, so it must not be changed.

    Args:
        path: The file.
        robot_name: Name of the robot, for errors.
        axes: External axes; paths of their URDFs are absolute.
        new_root: New root link; by default the root of the file.

    Raises:
        DocumentError: The file can't be read.
        RobotError: The file is not a valid URDF; the message quotes the parser, or names the
            file's format.
    """
    paths = (path, *(Path(file.urdf) for _, file in axes if file.urdf is not None))
    texts = tuple(read_text(file, max_bytes=MAX_URDF_BYTES) for file in paths)
    return _parse(texts, path, robot_name, axes, new_root)


@lru_cache(maxsize=16)
def parse_root(text: str) -> Any:
    """Parse a URDF or SRDF, and return its root element; it is cached, so it must not be changed.

    Raises:
        InputError: The text is not XML, or has more than `MAX_URDF_ELEMENTS`.
    """
    return parse_xml(text.encode(), MAX_URDF_ELEMENTS).documentElement


@lru_cache(maxsize=32)
def _parse(texts: tuple[str, ...], path: Path, robot_name: str, axes: Axes, new_root: str) -> Urdf:
    root, base = _parse_tree(texts[0], path, robot_name)
    elements = {kind: elements_by_name(root, kind) for kind in ("link", "joint")}
    files = [UrdfFile(path, tuple((link, link) for link in elements["link"]))]
    if axes:
        trees = {}
        placed = [(name, Path(axis.urdf)) for name, axis in axes if axis.urdf is not None]
        for (name, file), text in zip(placed, texts[1:], strict=True):
            trees[name] = _parse_tree(text, file, robot_name)
            _build_model(reduce_to_tree(trees[name][0]), file, robot_name)  # so that errors name it
        try:
            files += add_axes(root, axes, base, trees)
            base = check_tree(root)
        except InputError as error:
            raise RobotError(robot_name, f"external_axes: {error}") from error
    parents = {
        read_link(element, "child"): read_link(element, "parent")
        for element in child_elements(root, "joint")
    }
    if new_root:
        invert_to_root(root, new_root)
        base = new_root
    joints = elements_by_name(root, "joint")
    types = {name: element.getAttribute("type") for name, element in joints.items()}
    for name, kind in types.items():
        if kind == "continuous":
            _set_wide_limits(joints[name])
    model = _build_model(reduce_to_tree(root), path, robot_name)
    links = tuple(elements_by_name(root, "link"))
    carriers = set(parents.values())
    return Urdf(
        files=tuple(files),
        model=model,
        root=base,
        links=links,
        parents=parents,
        leaves=tuple(link for link in links if link not in carriers),
        types=types,
        mimics={name: mimic for name, e in joints.items() if (mimic := _read_mimic(e)) is not None},
        axes=axes,
        added=tuple(
            n for n, kind in types.items() if n not in elements["joint"] and kind != "fixed"
        ),
    )


def _parse_tree(text: str, path: Path, robot_name: str) -> tuple[Element, str]:
    """Parse a URDF, and check its tree of links; return its root element and its root link."""
    try:
        root = parse_xml(text.encode(), MAX_URDF_ELEMENTS).documentElement
        name = "" if root is None else root.tagName
        if name in _OTHER_FORMATS:
            raise InputError(f"it is {_OTHER_FORMATS[name]}, which is not supported")
        if root is None or name != "robot":
            raise InputError(f"its outermost element is <{name}>, not <robot>")
        if "<xacro:" in re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL):
            expanded = f"{path.name.partition('.')[0]}.urdf"
            raise InputError(
                f"it is xacro; expand it with `xacro {path.name} > {expanded}` (the command comes "
                "with ROS) and give the result"
            )
        return root, check_tree(root)
    except InputError as error:
        raise RobotError(robot_name, f"{path} is not a valid URDF: {error}") from error


def _read_mimic(joint: Element) -> Mimic | None:
    elements = child_elements(joint, "mimic")
    if not elements:
        return None
    mimic = elements[0]
    multiplier, offset = mimic.getAttribute("multiplier"), mimic.getAttribute("offset")
    return Mimic(mimic.getAttribute("joint"), float(multiplier or 1), float(offset or 0))


def _set_wide_limits(joint: Element) -> None:
    """Turn an unbounded joint into a revolute one with wide limits.

    Pinocchio represents a continuous joint by cosine and sine. A curve through waypoints needs the
    angle, including whole turns.
    """
    joint.setAttribute("type", "revolute")
    limits = child_elements(joint, "limit")
    limit = limits[0] if limits else append_element(joint, "limit", velocity="0", effort="0")
    limit.setAttribute("lower", f"-{_WIDE_LIMIT}")
    limit.setAttribute("upper", _WIDE_LIMIT)


def _build_model(text: str, path: Path, robot_name: str) -> Any:
    captured: list[str] = []
    try:
        with _capture_stderr(captured):
            model = pin.buildModelFromXML(text)
    except Exception as error:  # Boost.Python passes on all exceptions of the parser
        reason = captured[0] if captured and captured[0] else str(error)
        raise RobotError(robot_name, f"{path} is not a valid URDF: {reason}") from error
    for frame in model.frames:
        for name, numbers in (
            ("origin", frame.placement.homogeneous),
            ("inertia", frame.inertia.toDynamicParameters()),
        ):
            if not np.isfinite(numbers).all():
                fault = f"the {name} of {frame.name!r} is not finite"
                raise RobotError(robot_name, f"{path} is not a valid URDF: {fault}")
    return model


@contextlib.contextmanager
def _capture_stderr(captured: list[str]) -> Iterator[None]:
    """Append the output of C++ code to standard error, as one line, to `captured`."""
    with tempfile.TemporaryFile() as file:
        try:
            saved = os.dup(2)
        except OSError:  # the process has no standard error
            yield
            return
        os.dup2(file.fileno(), 2)
        try:
            yield
        finally:
            os.dup2(saved, 2)
            os.close(saved)
            file.seek(0)
            text = file.read().decode(errors="replace")
            text = re.sub(r"\n\s+at line \d+ in \S+", "", text)
            lines = [re.sub(r"^(Error|Warning):\s*", "", line) for line in text.splitlines()]
            captured.append("; ".join(line.strip() for line in lines if line.strip()))
