"""Placements of scenario files, read from the descriptions of the schema."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pinocchio as pin

AXES = {"X": np.eye(3)[0], "Y": np.eye(3)[1], "Z": np.eye(3)[2]}
FORMS = (
    *("quaternion_xyzw", "quaternion_wxyz", "rpy", "euler", "rotation_vector", "rotation_matrix"),
    "torch",
)


def about(axis: np.ndarray, angle: float) -> np.ndarray:
    return np.asarray(pin.exp3(np.asarray(axis, dtype=float) * angle))


def rotation(given: Mapping[str, Any], angle: float) -> np.ndarray | None:
    """The rotation that a mapping gives, its angles in a unit of so many radians; or none."""
    form = next((name for name in FORMS if given.get(name) is not None), None)
    if form is None:
        return None
    value = given[form]
    if form == "rpy":  # about the fixed axes x, y, z, one after another
        roll, pitch, yaw = (angle * number for number in value)
        return about(AXES["Z"], yaw) @ about(AXES["Y"], pitch) @ about(AXES["X"], roll)
    if form == "euler":  # about the moving axes
        R = np.eye(3)
        for axis, turn in zip(value["order"], value["angles"], strict=True):
            R = R @ about(AXES[axis], angle * turn)
        return R
    if form == "rotation_vector":
        return np.asarray(pin.exp3(angle * np.array(value, dtype=float)))
    if form == "rotation_matrix":
        return np.array(value, dtype=float)
    if form == "torch":
        return leaning(value["seam"], value, angle)
    x, y, z, w = value if form == "quaternion_xyzw" else (*value[1:], value[0])
    return np.asarray(pin.Quaternion(w, x, y, z).normalized().matrix())


def leaning(seam: Any, given: Mapping[str, Any], angle: float) -> np.ndarray:
    """A tool whose z axis leans to a seam and a surface, its x axis along the seam."""
    assert given.get("tangent", "x") == "x", "others are not read here"
    along = np.array(seam, dtype=float) / np.linalg.norm(seam)
    out = np.array(given["normal"], dtype=float)
    out -= (out @ along) * along
    out /= np.linalg.norm(out)
    work, travel = (angle * given.get(key, 0.0) for key in ("work_angle", "travel_angle"))
    out = np.cos(work) * out + np.sin(work) * np.cross(out, along)
    x = np.cos(travel) * along + np.sin(travel) * out
    z = np.sin(travel) * along - np.cos(travel) * out
    return np.column_stack((x, np.cross(z, x), z))


def placement(given: Mapping[str, Any] | None, length: float, angle: float) -> pin.SE3:
    """A placement, its lengths and angles in units of so many metres and radians."""
    given = given or {}
    R = rotation(given, angle)
    origin = length * np.array(given.get("position", (0.0, 0.0, 0.0)), dtype=float)
    return pin.SE3(np.eye(3) if R is None else R, origin)


def frames(given: Mapping[str, Any], length: float, angle: float) -> dict[str, pin.SE3]:
    """All named frames, placed in the base."""
    placed = {"base": pin.SE3.Identity()}
    left = dict(given)
    while left:
        known = [name for name in left if left[name].get("in", "base") in placed]
        assert known, f"frames that are placed in one another: {list(left)}"
        for name in known:
            one = left.pop(name)
            placed[name] = placed[one.get("in", "base")] * placement(one, length, angle)
    return placed


def turn_between(one: np.ndarray, other: np.ndarray) -> float:
    """Angle between two rotations [rad]."""
    return float(np.linalg.norm(pin.log3(one.T @ other)))
