"""Handles of a task in its scene, and the changes of the file when a handle is moved."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from knotwork.arrays import FloatArray
from knotwork.files.documents import Location
from knotwork.robot import Robot
from knotwork.task import JointWaypoint, PathWaypoint, Placement, PoseWaypoint, Task
from knotwork.task.poses import ORIENTATIONS
from knotwork.task.scenario import Scenario
from knotwork.task.scenario.geometry import Frames, read_placement
from knotwork.task.si_units import to_si
from knotwork.waypoints import CartesianWaypoint

FORMS = tuple(form for form in ORIENTATIONS if form != "torch")  # which depends on a path
"""Keys of the orientations that can be edited."""
LENGTH_STEP, ANGLE_STEP = 1e-5, 1e-4
"""Rounding of edited values [m, rad]."""


@dataclass(frozen=True, eq=False)
class Handle:
    """A point or a pose of a task that can be dragged.

    Attributes:
        at: Location in the file of the point, or of the mapping with the position.
        name: Name of the part that the handle moves.
        kind: `"waypoint"`, `"via"`, `"object"` or `"frame"`.
        pose: Pose in the axes of the URDF's root, `pin.SE3`.
        parent_frame: Frame of the position in the file, and axes of the orientation, shape (3, 3).
        form: Key of the orientation in the file; empty without one.
        order: Order of the Euler angles, if the orientation has this form.
        position: Position as given, in the file's unit, shape (3,).
    """

    at: Location
    name: str
    kind: str
    pose: pin.SE3
    parent_frame: tuple[pin.SE3, FloatArray]
    position: Sequence[float]
    form: str = ""
    order: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Convert to plain data for a page."""
        return {
            "at": list(self.at),
            "name": self.name,
            "kind": self.kind,
            "position": self.pose.translation.tolist(),
            "quaternion": pin.Quaternion(self.pose.rotation).coeffs().tolist(),
            "axes": pin.Quaternion(self.parent_frame[0].rotation).coeffs().tolist(),
            "turns": bool(self.form),
        }


def handles(scenario: Scenario, robot: Robot) -> list[Handle]:
    """Make a handle for each fixed waypoint, via point, object and frame placed by numbers.

    Args:
        scenario: The scenario.
        robot: The robot of the task.
    """
    in_si = to_si(scenario.task, scenario.task.units)
    frames = Frames(in_si.frames, scenario.locations)
    fixed_frames = {
        name for name, frame in frames.items() if frame.rests_on(scenario.pose_frame_link)
    }

    def frame(name: str | None) -> pin.SE3:
        return robot.base_placement * frames[name or "base"].rest_placement

    by_place: dict[Location, Handle] = {}
    for i, waypoint in enumerate(in_si.waypoints):
        if not isinstance(waypoint, JointWaypoint) and in_si.frame_of(waypoint) in fixed_frames:
            for handle in _waypoint_handles(scenario, in_si, i, frame):
                by_place.setdefault(handle.at, handle)  # only of the first repetition
    task = scenario.task
    placed_parts = (
        (("scene", "objects"), in_si.scene.objects, task.scene.objects),
        (("frames",), in_si.frames, task.frames),
    )
    for where, parts, parts_in_file in placed_parts:
        for name, part in parts.items():
            if (name if where == ("frames",) else part.parent) not in fixed_frames:
                continue
            at, parent = (*where, name), frame(part.parent)
            if scenario.locations.in_file(at) != at:
                continue  # the place of a repetition
            pose = parent * read_placement(part, scenario.locations, at)
            form, order = _form(part)
            axes, kind = (parent, parent.rotation), where[-1].removesuffix("s")
            numbered = parts_in_file[name].position, form or "rpy", order
            by_place[at] = Handle(at, name, kind, pose, axes, *numbered)
    return list(by_place.values())


def _waypoint_handles(scenario: Scenario, in_si: Task, i: int, frame: Any) -> Iterator[Handle]:
    waypoint = cast(PoseWaypoint | PathWaypoint, in_si.waypoints[i])
    parent = frame(waypoint.frame or in_si.frame)
    axes = parent.rotation
    if waypoint.orientation_in is not None:
        axes = frame(waypoint.orientation_in).rotation
    shown = cast(CartesianWaypoint, scenario.waypoints[scenario.task_index.index(i)])
    turn = frame(None).rotation @ shown.pose.rotation
    at = scenario.locations.in_file(("waypoints", i))
    in_file = cast(PoseWaypoint, scenario.task.waypoints[i])
    pose = pin.SE3(turn, parent * np.array(waypoint.pose.position))
    form, position = _form(waypoint.pose), in_file.pose.position
    yield Handle((*at, "pose"), shown.name, "waypoint", pose, (parent, axes), position, *form)
    if isinstance(waypoint, PathWaypoint):
        points = zip(_points(waypoint.along), _points(getattr(in_file, "along", None)), strict=True)
        for (place, point), (_, position) in points:
            pose = pin.SE3(turn, parent * np.array(point))
            name = f"{shown.name}: {place[-1]}"
            yield Handle((*at, "along", *place), name, "via", pose, (parent, axes), position)


def _points(along: Any) -> Iterator[tuple[Location, Any]]:
    """Points of a path given as numbers in the file."""
    arc, points = getattr(along, "arc", None), getattr(along, "points", None)
    for key in ("through", "centre"):
        if getattr(arc, key, None) is not None:
            yield ("arc", key), getattr(arc, key)
    if isinstance(points, tuple):
        yield from ((("points", k), point) for k, point in enumerate(points))


def _form(placement: Placement) -> tuple[str, str]:
    """Key of an orientation, and the order of its Euler angles."""
    form = next((name for name in FORMS if getattr(placement, name) is not None), "")
    return form, placement.euler.order if placement.euler is not None else ""


def move_handle(
    handle: Handle,
    units: tuple[float, float],
    position: ArrayLike | None = None,
    quaternion: ArrayLike | None = None,
) -> list[Mapping[str, Any]]:
    """Make the changes of the file that move a handle; numbers are rounded.

    Args:
        handle: The handle.
        units: Units of length [m] and of angle [rad] of the file.
        position: New position in the axes of the URDF's root [m], shape (3,); by default unchanged.
        quaternion: New orientation, scalar part last, shape (4,); by default unchanged.
    """
    changes: list[Mapping[str, Any]] = []
    if position is not None:
        local = handle.parent_frame[0].actInv(np.asarray(position, dtype=float))
        at = handle.at if handle.kind == "via" else (*handle.at, "position")
        pairs = zip(file_values(local, units[0], LENGTH_STEP), handle.position, strict=True)
        value = [  # unchanged values are not rounded
            _drop_decimals(old) if abs(new - old) * units[0] < LENGTH_STEP else new
            for new, old in pairs
        ]
        changes.append({"at": at, "value": value})
    if quaternion is not None and handle.form:
        rotation = pin.Quaternion(np.asarray(quaternion, dtype=float)).matrix()
        turn = handle.parent_frame[1].T @ rotation
        turned = orientation_value(turn, handle.form, units[1], handle.order)
        changes.append({"at": (*handle.at, handle.form), "value": turned})
    return changes


def orientation_value(turn: FloatArray, form: str, angle: float = 1.0, order: str = "") -> Any:
    """Convert a rotation matrix to a form of a file, rounded, with angles in units of `angle`."""
    if form == "rotation_matrix":
        return np.round(turn, 6).tolist()
    if form.startswith("quaternion"):
        x, y, z, w = np.round(pin.Quaternion(turn).coeffs(), 6).tolist()
        return [x, y, z, w] if form.endswith("xyzw") else [w, x, y, z]
    if form == "euler":
        from scipy.spatial.transform import Rotation

        angles = Rotation.from_matrix(turn).as_euler(order)
        return {"order": order, "angles": file_values(angles, angle, ANGLE_STEP)}
    vector = pin.rpy.matrixToRpy(turn) if form == "rpy" else pin.log3(turn)
    if form == "rpy":  # half a turn is 180, not -180
        vector = np.where(vector < ANGLE_STEP - np.pi, -vector, vector)
    return file_values(vector, angle, ANGLE_STEP)


def file_values(values: ArrayLike, unit: float, step: float) -> list[float]:
    """Convert SI values to the unit of a file, rounded to about a step in SI."""
    digits = int(np.ceil(-np.log10(step / unit) - 1e-9))
    return [_drop_decimals(round(value, digits)) for value in (np.asarray(values) / unit).tolist()]


def _drop_decimals(value: float) -> float:
    """A number without a needless decimal: 180, not 180.0."""
    return int(value) if float(value).is_integer() else value
