"""Marks of a task in a scene: waypoints, their velocities, frames, knots and failures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from knotwork.errors.plain_text import waypoint_text
from knotwork.scenario import Scenario
from knotwork.units import Units
from knotwork.verification import Finding, Report
from knotwork.verification.brief import in_short
from knotwork.view.mesh import Mesh, merged
from knotwork.view.packing import label, thing
from knotwork.view.primitive_meshes import rod, sphere, triad
from knotwork.view.shown import Shown
from knotwork.view.targets import round_arrows, spacings, straight_arrows
from knotwork.waypoints import CartesianWaypoint, FloatArray

ROUNDING = 1e6
"""A tolerance exceeded by this factor is one for rounding, and is not printed."""
RED = (0.86, 0.08, 0.1, 1.0)
KNOT = (0.12, 0.12, 0.14, 1.0)
MOST_KNOTS = 2000


def marks(
    shown: Shown, size: float
) -> tuple[dict[str, Mesh], list[dict[str, Any]], dict[str, float]]:
    """Draw the marks of a task, and of the failures of its check, in a scene of some size [m].

    Returns:
        Meshes by kind; labels; and for the legend the time in which the tool goes the length of
        straight arrows, `arrow_seconds`, and turns by round ones, `turn_seconds`.
    """
    curve, robot = shown.curve, shown.robot
    asked = [one for one in shown.asked if not one.standing]
    axis = _axis_length(asked, size)
    meshes: dict[str, Mesh] = {}
    labels: list[dict[str, Any]] = []
    seconds: dict[str, float] = {}
    if asked:
        meshes["waypoints"] = _triads([target.pose for target in asked], axis, 0.045)
        missed, units = {found.name for found in shown.failures}, shown.scenario.units
        labels += [_waypoint_label(target, units) for target in asked if target.name not in missed]
    straight, turning = straight_arrows(shown.given, size), round_arrows(shown.given, 0.75 * axis)
    if straight is not None:
        meshes["speeds asked for"], seconds["arrow_seconds"] = straight
    if turning is not None:
        meshes["turning asked for"], seconds["turn_seconds"] = turning
    base = robot.base_placement
    if len(curve.x) <= MOST_KNOTS:
        along = _on_paths(curve.x, shown.scenario)
        for name, times in (("knots", curve.x[~along]), ("knots on paths", curve.x[along])):
            points = [(base * robot.forward(q)).translation for q in curve(times)]
            dots = [sphere(0.0048 * size, KNOT, 12).moved(np.eye(3), point) for point in points]
            if dots:
                meshes[name] = merged(dots)
    if shown.report is not None:
        _add_failures(meshes, labels, shown, shown.report, size)
    return meshes, labels, seconds


def standing_marks(shown: Shown, size: float) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Waypoints that stand while joints move the base frame, with their labels."""
    robot, given = shown.robot, {one.name: one for one in shown.scenario.waypoints}
    still = robot.model.frames[robot.frame_index(robot.standing_frame)]
    asked = [
        replace(one, pose=still.placement * given[one.name].pose)  # type: ignore[union-attr]
        for one in shown.asked
        if one.standing
    ]
    if not asked:
        return [], []
    carrier = int(still.parentJoint)
    mesh = _triads([one.pose for one in asked], _axis_length(asked, size), 0.045)
    missed, units = {found.name for found in shown.failures}, shown.scenario.units
    names = (_waypoint_label(one, units) for one in asked if one.name not in missed)
    labels = [one | {"carrier": carrier} for one in names]
    return [thing("waypoints", mesh, carrier=carrier)], labels


def frame_marks(shown: Shown, size: float) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Named frames of a task, with their labels; those that move ride along."""
    placed: dict[int | None, list[pin.SE3]] = {}
    labels: list[dict[str, Any]] = []
    for name, frame in shown.scenario.frames.items():
        carrier, base = shown.carrying(shown.scenario.scene.moving.get(name))
        pose = base * frame
        placed.setdefault(carrier, []).append(pose)
        labels.append(label(name, "frame", pose.translation, f"frame {name!r}", carrier))
    things = [
        thing("frames", _triads(poses, 0.075 * size, 0.05), carrier=carrier)
        for carrier, poses in placed.items()
    ]
    return things, labels


def _on_paths(times: FloatArray, scenario: Scenario) -> NDArray[np.bool_]:
    """Whether times are within a tool path."""
    within = np.zeros(times.shape, dtype=bool)
    for path in scenario.paths:
        within |= (times > path.motion.start_time) & (times < path.motion.end_time)
    return within


def _triads(poses: Sequence[pin.SE3], length: float, thickness: float) -> Mesh:
    axes = triad(length, thickness * length)
    return merged([axes.placed(pose) for pose in poses])


def _waypoint_label(target: CartesianWaypoint, units: Units) -> dict[str, Any]:
    speed = float(np.linalg.norm(target.linear))
    turning = float(np.linalg.norm(target.angular))
    detail = f"{target.name}: at {target.time:g} s, {units.text(speed, 'm/s', '.4g')}"
    if turning > 1e-8:
        detail += f", turning at {units.text(turning, 'rad/s', '.4g')}"
    return label(target.name, "waypoint", target.pose.translation, detail)


def _axis_length(asked: Sequence[CartesianWaypoint], size: float) -> float:
    apart = spacings(asked)
    nearest = float(apart.min()) if len(apart) else size
    return min(0.06 * size, max(0.6 * nearest, 0.025 * size))


def _add_failures(
    meshes: dict[str, Mesh],
    labels: list[dict[str, Any]],
    shown: Shown,
    report: Report,
    size: float,
) -> None:
    """Mark where the tool is when something fails; from there to where it should be."""
    robot, curve = shown.robot, shown.curve
    base = robot.base_placement
    wrong: list[Mesh] = []
    poses = {target.name: target.pose for target in shown.asked}
    together: dict[tuple[str, str, float], list[Finding]] = {}
    for found in report.failures:
        if found.at is not None:
            together.setdefault((found.subject, found.name, found.at), []).append(found)
    for (subject, name, time), findings in together.items():
        inside = min(max(time, float(curve.x[0])), float(curve.x[-1]))
        reached = at = (base * robot.forward(curve(inside))).translation
        if findings[0].points:  # of two bodies, not of the tool
            reached = at = base.act(np.mean(findings[0].points, axis=0))
        wrong.append(sphere(0.011 * size, RED).moved(np.eye(3), reached))
        if subject == "waypoint" and name in poses:
            point = poses[name].translation
            at = (point + reached) / 2
            if np.linalg.norm(reached - point) > 1e-9:
                wrong.append(rod(point, reached, 0.004 * size, RED))
        text = _in_words(findings[0], report.units)
        if len(findings) > 1:
            text += f", and {len(findings) - 1} more"
        labels.append(label(text, "miss", at, "\n".join(map(str, findings)), time=time))
    if wrong:
        meshes["failures"] = merged(wrong)


def _in_words(found: Finding, units: Units) -> str:
    """A finding as lists have it, but for a tolerance that is one for rounding."""
    name = waypoint_text(found.name) if found.subject == "waypoint" else found.name
    if found.requested is not None:
        return f"{name}: {found.title} off by {units.text(found.value or 0.0, found.unit, '.3g')}"
    if found.value is None or found.label or (found.use or 0.0) <= ROUNDING:
        return in_short(found, units)
    shown, unit = units.shown(found.value, found.unit)
    value = f"{shown:.3g} {unit}" if np.isfinite(shown) else "infinite"
    return " ".join(filter(None, (name, found.title, value)))
