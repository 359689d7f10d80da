"""The task in a scene: waypoints, the speeds asked for, frames, knots, and what is missed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from knotwork.joint_space import JointSpace
from knotwork.polynomial import PiecewisePolynomial
from knotwork.robot import Robot
from knotwork.scenario import JointTarget, Scenario
from knotwork.view.mesh import Mesh, arrow, merged, rod, sphere, triad
from knotwork.view.path import ToolPath
from knotwork.waypoints import FloatArray
from knotwork.witness import Report, Requirement

RED = (0.86, 0.08, 0.1, 1.0)
KNOT = (0.12, 0.12, 0.14, 1.0)
ARROW = (0.9, 0.35, 0.0, 1.0)
# Seconds of motion that an arrow may stand for.
_NICE = [mantissa * 10.0**power for power in range(3, -5, -1) for mantissa in (5, 2, 1)]
MOST_KNOTS = 2000
_PICTURED = {
    "m": (1e3, "mm"),
    "m/s": (1e3, "mm/s"),
    "m/s²": (1e3, "mm/s²"),
    "rad": (180 / np.pi, "deg"),
    "rad/s": (180 / np.pi, "deg/s"),
    "rad/s²": (180 / np.pi, "deg/s²"),
}


@dataclass(frozen=True, eq=False)
class Target:
    """A waypoint at the tool, as asked for, in the axes of the URDF's root.

    Attributes:
        name, time: Of the waypoint; time in s.
        pose: Of the tool, `pin.SE3`.
        linear: Velocity of the TCP [m/s], shape (3,).
    """

    name: str
    time: float
    pose: pin.SE3
    linear: FloatArray


@dataclass(frozen=True)
class Label:
    """Words at a point.

    Attributes:
        text: What is said there.
        kind: `"waypoint"`, `"frame"` or `"miss"`.
        position: [m].
        detail: More of it, to be shown on demand.
    """

    text: str
    kind: str
    position: tuple[float, ...]
    detail: str = ""


@dataclass(frozen=True, eq=False)
class SceneMarks:
    """What is drawn of a task: by kind a mesh, and labels.

    Attributes:
        meshes: Kind to mesh; only what there is.
        labels: Words beside them.
        arrow_seconds: An arrow is as long as the tool goes in this time at the speed asked for.
    """

    meshes: dict[str, Mesh]
    labels: tuple[Label, ...]
    arrow_seconds: float | None


def targets(scenario: Scenario, space: JointSpace, robot: Robot) -> list[Target]:
    """Find the tool pose and velocity that each waypoint asks for."""
    base = robot.base_placement
    found = []
    for waypoint in scenario.waypoints:
        if isinstance(waypoint, JointTarget):
            q = space.values(waypoint.joints)
            v = np.zeros_like(q)
            if waypoint.velocity is not None:
                v = space.values(waypoint.velocity, missing=0.0)
            pose, linear = robot.forward(q), robot.twist(q, v).linear
        else:
            pose, linear = waypoint.pose, np.array(waypoint.linear)
        found.append(Target(waypoint.name, waypoint.time, base * pose, base.rotation @ linear))
    return found


def marks(
    asked: Sequence[Target],
    path: ToolPath,
    curve: PiecewisePolynomial,
    robot: Robot,
    scenario: Scenario | None,
    report: Report | None,
    size: float,
) -> SceneMarks:
    """Draw a task and what the check found.

    Args:
        asked: The waypoints at the tool.
        path: Where the tool goes.
        curve: The motion, joints in the robot's order.
        robot: The arm.
        scenario: The task, for its named frames.
        report: What the check found.
        size: Extent of the scene [m].
    """
    axis = _axis_length(asked, size)
    meshes: dict[str, Mesh] = {}
    labels: list[Label] = []
    if asked:
        triads = [
            triad(axis, 0.045 * axis).moved(target.pose.rotation, target.pose.translation)
            for target in asked
        ]
        meshes["waypoints"] = merged(triads)
        missed = {item.waypoint for item in report.requirements if not item.ok} if report else ()
        labels += [_waypoint_label(target) for target in asked if target.name not in missed]
    seconds = _arrow_seconds(asked, size)
    arrows = []
    for target in asked:
        if seconds is not None and np.linalg.norm(target.linear) > 1e-9:
            foot = target.pose.translation
            arrows.append(arrow(foot, foot + seconds * target.linear, 0.0035 * size, ARROW))
    if arrows:
        meshes["speeds asked for"] = merged(arrows)
    base = robot.base_placement
    knots = curve.x if len(curve.x) <= MOST_KNOTS else curve.x[:0]
    points = [(base * robot.forward(q)).translation for q in curve(knots)] if len(knots) else []
    if points:
        dots = [sphere(0.0048 * size, KNOT, 12).moved(np.eye(3), point) for point in points]
        meshes["knots"] = merged(dots)
    if scenario is not None and scenario.frames:
        frames = {name: base * frame for name, frame in scenario.frames.items()}
        length = 0.075 * size
        meshes["frames"] = merged(
            [triad(length, 0.05 * length).moved(f.rotation, f.translation) for f in frames.values()]
        )
        labels += [
            Label(name, "frame", tuple(frame.translation.tolist()), f"frame {name!r}")
            for name, frame in frames.items()
        ]
    if report is not None:
        _add_failures(meshes, labels, asked, curve, robot, report, size)
    return SceneMarks(meshes, tuple(labels), seconds if arrows else None)


def _waypoint_label(target: Target) -> Label:
    speed = float(np.linalg.norm(target.linear))
    detail = f"{target.name}: at {target.time:g} s, {1000 * speed:.4g} mm/s"
    return Label(target.name, "waypoint", tuple(target.pose.translation.tolist()), detail)


def _spacings(asked: Sequence[Target]) -> FloatArray:
    """Distances from each waypoint to the next [m], those that stay in place left out."""
    points = np.array([target.pose.translation for target in asked]).reshape(-1, 3)
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    return np.asarray(lengths[lengths > 1e-6])


def _axis_length(asked: Sequence[Target], size: float) -> float:
    spacings = _spacings(asked)
    nearest = float(spacings.min()) if len(spacings) else size
    return min(0.06 * size, max(0.6 * nearest, 0.025 * size))


def _arrow_seconds(asked: Sequence[Target], size: float) -> float | None:
    """Scale of the arrows: the longest is at most a sixth of the scene."""
    fastest = max((float(np.linalg.norm(target.linear)) for target in asked), default=0.0)
    if fastest <= 1e-9:
        return None
    spacings = _spacings(asked)
    longest = size / 6
    if len(spacings):
        longest = min(longest, max(float(np.median(spacings)), 0.04 * size))
    return next((s for s in _NICE if s * fastest <= longest), _NICE[-1])


def _add_failures(
    meshes: dict[str, Mesh],
    labels: list[Label],
    asked: Sequence[Target],
    curve: PiecewisePolynomial,
    robot: Robot,
    report: Report,
    size: float,
) -> None:
    base = robot.base_placement
    wrong: list[Mesh] = []
    missed = [item for item in report.requirements if not item.ok]
    for name in dict.fromkeys(item.waypoint for item in missed):
        target = next((one for one in asked if one.name == name), None)
        if target is None:
            continue
        point = target.pose.translation
        reached = (base * robot.forward(curve(target.time))).translation
        wrong.append(sphere(0.011 * size, RED).moved(np.eye(3), reached))
        if np.linalg.norm(reached - point) > 1e-9:
            wrong.append(rod(point, reached, 0.004 * size, RED))
        found = [item for item in missed if item.waypoint == name]
        at = tuple(((point + reached) / 2).tolist())
        text = f"{name}: off by {', '.join(_size(item) for item in found)}"
        labels.append(Label(text, "miss", at, "\n".join(str(item) for item in found)))
    for jump in report.jumps:
        if not jump.ok:
            at = (base * robot.forward(curve(jump.time))).translation
            wrong.append(sphere(0.011 * size, RED).moved(np.eye(3), at))
            text = f"{jump.joint}: {jump.quantity} jumps by {jump.value:.3g} {jump.unit}"
            labels.append(Label(text, "miss", tuple(at.tolist()), str(jump)))
    for use in report.limits:
        if not use.ok:
            at = (base * robot.forward(curve(use.time))).translation
            text = f"{use.joint}: {use.quantity} {use.value:.3g}, limit {use.limit:.3g} {use.unit}"
            labels.append(Label(text, "miss", tuple(at.tolist()), str(use)))
    if wrong:
        meshes["failures"] = merged(wrong)


def _size(item: Requirement) -> str:
    """Error of a requirement in units that one can picture."""
    factor, unit = _PICTURED.get(item.unit, (1.0, item.unit))
    return f"{factor * item.error:.3g} {unit}"
