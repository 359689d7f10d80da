"""Marks of a task in a scene: waypoints, their velocities, frames, knots and failures."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from knotwork.units import Units
from knotwork.verification import Finding, Report
from knotwork.verification.brief import failure_text
from knotwork.view.mesh import Mesh, merge_meshes
from knotwork.view.primitive_meshes import rod, sphere, triad
from knotwork.view.scene_parts import SceneParts
from knotwork.view.shown_motion import ShownMotion
from knotwork.view.targets import (
    ToolTarget,
    given_velocities,
    spacings,
    tool_targets,
    velocity_arrows,
)

RED = (0.86, 0.08, 0.1, 1.0)
KNOT = (0.12, 0.12, 0.14, 1.0)
MAX_KNOTS = 2000


def draw_marks(parts: SceneParts, shown: ShownMotion, size: float) -> dict[str, float]:
    """Draw the marks of a task, and of the failures of its check, in a scene of some size [m].

    Returns:
        For the legend `arrow_seconds`, the time in which the tool moves by the length of arrows.
    """
    curve, robot = shown.curve, shown.robot
    _draw_waypoints(parts, shown, size)
    legend = {}
    arrows = velocity_arrows(given_velocities(shown), size)
    if arrows is not None:
        mesh, legend["arrow_seconds"] = arrows
        parts.draw("given speeds", mesh)
    if len(curve.x) <= MAX_KNOTS:
        ball = sphere(0.0048 * size, KNOT, 12)
        places = [(robot.base_placement * robot.forward(q)).translation for q in curve(curve.x)]
        dots = merge_meshes([ball.shift(place) for place in places])
        parts.draw("knots", dots, hidden=bool(shown.scenario.paths))  # many along a path
    if shown.report is not None:
        _draw_failures(parts, shown, shown.report, size)
    return legend


def _draw_waypoints(parts: SceneParts, shown: ShownMotion, size: float) -> None:
    """Draw the waypoints. If joints move the base frame, those in the world move in the scene."""
    robot = shown.robot
    waypoints = {waypoint.name: waypoint for waypoint in shown.scenario.waypoints}
    frame = robot.model.frames[robot.link_index(robot.world_frame)]
    missed, units = {finding.name for finding in shown.failures}, shown.scenario.units
    moving = [target for target in tool_targets(shown) if not target.in_world_frame]
    in_world_frame = [
        target._replace(pose=frame.placement * waypoints[target.name].pose)  # type: ignore[union-attr]
        for target in tool_targets(shown)
        if target.in_world_frame
    ]
    for targets, carrier in ((moving, None), (in_world_frame, int(frame.parentJoint))):
        if targets:
            length = _axis_length(targets, size)
            axes = _triads([target.pose for target in targets], length, 0.045)
            parts.draw("waypoints", axes, lit=False, carrier=carrier)
        for target in targets:
            if target.name not in missed:
                point, detail = target.pose.translation, _waypoint_detail(target, units)
                parts.write(target.name, "waypoint", point, detail, carrier=carrier)


def draw_frames(parts: SceneParts, shown: ShownMotion, size: float) -> None:
    """Draw the named frames of a task. Moving ones move in the scene."""
    placed: dict[int | None, list[pin.SE3]] = {}
    for name, frame in shown.scenario.frame_placements.items():
        carrier, base = shown.carrier_of(shown.scenario.scene.frames[name])
        pose = base * frame
        placed.setdefault(carrier, []).append(pose)
        parts.write(name, "frame", pose.translation, f"frame {name!r}", carrier=carrier)
    for carrier, poses in placed.items():
        parts.draw("frames", _triads(poses, 0.075 * size, 0.05), carrier=carrier)


def _triads(poses: Sequence[pin.SE3], length: float, thickness: float) -> Mesh:
    axes = triad(length, thickness * length)
    return merge_meshes([axes.place(pose) for pose in poses])


def _waypoint_detail(target: ToolTarget, units: Units) -> str:
    speed = float(np.linalg.norm(target.linear))
    turning = float(np.linalg.norm(target.angular))
    detail = f"{target.name}: at {target.time:g} s, {units.text(speed, 'm/s', '.4g')}"
    return detail + (
        f", turning at {units.text(turning, 'rad/s', '.4g')}" if turning > 1e-8 else ""
    )


def _axis_length(targets: Sequence[ToolTarget], size: float) -> float:
    distances = spacings(targets)
    nearest = float(distances.min()) if len(distances) else size
    return min(0.06 * size, max(0.6 * nearest, 0.025 * size))


def _draw_failures(parts: SceneParts, shown: ShownMotion, report: Report, size: float) -> None:
    """Mark the position of the tool at a failure, with a line to the required position."""
    robot, curve = shown.robot, shown.curve
    base = robot.base_placement
    wrong: list[Mesh] = []
    poses = {target.name: target.pose for target in tool_targets(shown)}
    together: dict[tuple[str, str, float], list[Finding]] = {}
    for finding in report.failures:
        if finding.shown_time is not None:
            together.setdefault((finding.subject, finding.name, finding.shown_time), []).append(
                finding
            )
    for (subject, name, time), findings in together.items():
        inside = min(max(time, float(curve.x[0])), float(curve.x[-1]))
        reached = at = (base * robot.forward(curve(inside))).translation
        if findings[0].points:  # of two bodies, not of the tool
            reached = at = base.act(np.mean(findings[0].points, axis=0))
        wrong.append(sphere(0.011 * size, RED).shift(reached))
        if subject == "waypoint" and name in poses:
            point = poses[name].translation
            at = (point + reached) / 2
            if np.linalg.norm(reached - point) > 1e-9:
                wrong.append(rod(point, reached, 0.004 * size, RED))
        text = failure_text(findings[0], report.units)
        if len(findings) > 1:
            text += f", and {len(findings) - 1} more"
        parts.write(text, "miss", at, "\n".join(map(str, findings)), time=time)
    parts.draw("failures", merge_meshes(wrong) if wrong else None, lit=False)
