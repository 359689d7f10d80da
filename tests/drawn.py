"""What a page of a scene draws, read from its HTML."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Iterable
from itertools import pairwise
from typing import Any

import numpy as np
import pinocchio as pin

import knotwork as kw
import urdfs
from knotwork.view import view_trajectory
from knotwork.view.page import Page


def scene(page: Page) -> Any:
    """The data that a page draws."""
    found = re.search(r'<script id="data" type="application/json">(.*?)</script>', page.html)
    return json.loads(found[1])


def numbers(text: str, kind: str, width: int = 3) -> Any:
    return np.frombuffer(base64.b64decode(text), kind).reshape(-1, width)


def vertices(mesh: Any) -> Any:
    return np.asarray(numbers(mesh["vertices"], "<f4"), dtype=float)


def faces(mesh: Any) -> Any:
    return numbers(mesh["faces"], "<u4" if mesh["wide"] else "<u2").astype(int)


def volume(mesh: Any) -> float:
    """Positive if the triangles face outwards."""
    a, b, c = np.moveaxis(vertices(mesh)[faces(mesh)], 1, 0)
    return float(np.einsum("ij,ij", a, np.cross(b, c)) / 6)


def placed(data: Any, at: int | Any) -> list[pin.SE3]:
    """Where every joint of a page is, by hand: in a frame, or at joint positions."""
    joints = data["joints"]
    rows = numbers(data["arm"]["position"], "<f4", len(joints))
    found = [pin.SE3.Identity()]
    for joint, q in zip(joints, rows[at] if isinstance(at, int) else at, strict=True):
        own = pin.SE3(pin.Quaternion(np.array(joint["quaternion"])), np.array(joint["origin"]))
        moved, axis = pin.SE3.Identity(), float(q) * np.array(joint["axis"])
        if joint["slides"]:
            moved.translation = axis
        else:
            moved.rotation = pin.exp3(axis)
        found.append(found[joint["parent"]] * own * moved)
    return found


def thing(data: Any, name: str) -> Any:
    """The mesh of something drawn beside the arm."""
    return next(one["mesh"] for one in data["meshes"] if one["name"] == name)


def at_rest(robot: kw.Robot) -> Page:
    """A page on which an arm stands still."""
    still = np.zeros((2, robot.dof))
    motion = kw.JointTrajectory.from_knots(
        robot.joint_names, [0, 1], still, still, joint_units=robot.joint_units
    )
    return view_trajectory(robot, motion)


def beside_an_arm(thing: dict[str, Any], **task: Any) -> Page:
    """A page on which an arm stands still beside an object of a scenario."""
    still = {"joints": {"shoulder": 0, "elbow": 0.5}}
    given = {
        "robot": "planar2",
        "scene": {"objects": {"it": {"position": [0, 0, 5], **thing}}},
        "waypoints": [still, {**still, "after": 1}],
    }
    return kw.plan({**given, **task}).view()


def tower(visuals: Iterable[str]) -> str:
    """A URDF of links `l0`, `l1`, … and `c` upon each other, each but `c` with a visual shape."""
    shown = {f"l{i}": visual for i, visual in enumerate(visuals)}
    parts = [urdfs.link("base")]
    for i, (below, link) in enumerate(pairwise(["base", *shown, "c"])):
        drawn = [f"<visual>{shown[link]}</visual>"] if link in shown else []
        kind = "fixed" if i else "revolute"
        parts += [urdfs.link(link, *drawn), urdfs.joint(f"j{i}", below, link, kind, at="0 0 1")]
    return urdfs.robot(*parts)


def mesh_visuals(names: Iterable[str]) -> list[str]:
    return [f'<geometry><mesh filename="{name}"/></geometry>' for name in names]


def shape_warnings(robot: kw.Robot) -> list[str]:
    """What a page says of the shapes that an arm is drawn with."""
    return [line for line in at_rest(robot).warnings if not line.startswith("a trajectory")]
