"""The task in a scene: waypoints, the speeds asked for, frames, knots, and what is missed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from knotwork.polynomial import PiecewisePolynomial
from knotwork.robot import Robot
from knotwork.scenario import Scenario
from knotwork.verification import Report, Requirement
from knotwork.view.mesh import Mesh, merged
from knotwork.view.solids import rod, sphere, triad
from knotwork.view.speed_arrows import round_arrows, straight_arrows
from knotwork.view.targets import Target, spacings

RED = (0.86, 0.08, 0.1, 1.0)
KNOT = (0.12, 0.12, 0.14, 1.0)
MOST_KNOTS = 2000
_PICTURED = {
    "m": (1e3, "mm"),
    "m/s": (1e3, "mm/s"),
    "m/s²": (1e3, "mm/s²"),
    "rad": (180 / np.pi, "deg"),
    "rad/s": (180 / np.pi, "deg/s"),
    "rad/s²": (180 / np.pi, "deg/s²"),
}


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
        turn_seconds: A round arrow goes as far as the tool turns in this time.
    """

    meshes: dict[str, Mesh]
    labels: tuple[Label, ...]
    arrow_seconds: float | None
    turn_seconds: float | None


def marks(
    asked: Sequence[Target],
    curve: PiecewisePolynomial,
    robot: Robot,
    scenario: Scenario | None,
    report: Report | None,
    size: float,
) -> SceneMarks:
    """Draw a task and what the check found.

    Args:
        asked: The waypoints at the tool.
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
        meshes["waypoints"] = _triads([target.pose for target in asked], axis, 0.045)
        missed = {item.waypoint for item in report.requirements if not item.ok} if report else ()
        labels += [_waypoint_label(target) for target in asked if target.name not in missed]
    straight, turning = straight_arrows(asked, size), round_arrows(asked, 0.75 * axis)
    if straight is not None:
        meshes["speeds asked for"] = straight.mesh
    if turning is not None:
        meshes["turning asked for"] = turning.mesh
    base = robot.base_placement
    if len(curve.x) <= MOST_KNOTS:
        points = [(base * robot.forward(q)).translation for q in curve(curve.x)]
        dots = [sphere(0.0048 * size, KNOT, 12).moved(np.eye(3), point) for point in points]
        meshes["knots"] = merged(dots)
    if scenario is not None and scenario.frames:
        frames = {name: base * frame for name, frame in scenario.frames.items()}
        meshes["frames"] = _triads(list(frames.values()), 0.075 * size, 0.05)
        labels += [
            Label(name, "frame", tuple(frame.translation.tolist()), f"frame {name!r}")
            for name, frame in frames.items()
        ]
    if report is not None:
        _add_failures(meshes, labels, asked, curve, robot, report, size)
    return SceneMarks(
        meshes,
        tuple(labels),
        straight.seconds if straight is not None else None,
        turning.seconds if turning is not None else None,
    )


def _triads(poses: Sequence[pin.SE3], length: float, thickness: float) -> Mesh:
    axes = triad(length, thickness * length)
    return merged([axes.moved(pose.rotation, pose.translation) for pose in poses])


def _waypoint_label(target: Target) -> Label:
    speed = float(np.linalg.norm(target.linear))
    turning = float(np.degrees(np.linalg.norm(target.angular)))
    detail = f"{target.name}: at {target.time:g} s, {1000 * speed:.4g} mm/s"
    if turning > 1e-6:
        detail += f", turning at {turning:.4g} deg/s"
    return Label(target.name, "waypoint", tuple(target.pose.translation.tolist()), detail)


def _axis_length(asked: Sequence[Target], size: float) -> float:
    apart = spacings(asked)
    nearest = float(apart.min()) if len(apart) else size
    return min(0.06 * size, max(0.6 * nearest, 0.025 * size))


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
