"""Contents of a scene as plain data: arm, motion, task and findings of the check.

Everything is in the axes of the URDF's root, z up, in m and s.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.trajectory import JointTrajectory
from knotwork.curves.trajectory.sampling import make_sample_times
from knotwork.robot import Robot
from knotwork.robot.joint_tree import joint_tree, place_joints
from knotwork.units import Units
from knotwork.verification.report import CheckedMotion
from knotwork.view.base_joints import base_joints, drawn_joints
from knotwork.view.environment_joints import (
    draw_other_robots,
    environment_joints,
    environment_positions,
    joint_origins,
)
from knotwork.view.mesh import box_corners
from knotwork.view.page import Page, scene_page
from knotwork.view.path_meshes import draw_paths, given_path_points
from knotwork.view.scene_parts import SceneParts, pack_mesh, pack_numbers
from knotwork.view.scene_verdict import check_results
from knotwork.view.shown_motion import ShownMotion
from knotwork.view.surroundings import draw_surroundings
from knotwork.view.targets import tool_targets
from knotwork.view.task_marks import draw_frames, draw_marks
from knotwork.view.time_strip import time_strip
from knotwork.view.tool_trace import tool_speeds, tool_trace

ROBOT_PARTS = ("joints", "shapes")
"""Parts of a scene that depend only on the robot; they are most of the data."""
OUTLINE_SAMPLES = 100
"""Number of samples of the arm along the motion, all of which must be in view."""
FRAME_RATE = 120.0
"""Frame rate of an animation, unless it would have more than `MAX_FRAMES` frames [Hz]."""
MAX_FRAMES = 240_000
"""Maximum number of frames of an animation."""
MAX_SPEEDS = 30_000
"""Number of frames above which the tool's speed is left out."""
ELEVATION, STEEP, FLAT_SCENE = np.radians(24.0), np.radians(52.0), 0.3
"""Elevation of the camera [rad], the same for flat scenes, and the ratio of height and width below
which a scene is flat.
"""
ASIDE_ANGLE = np.radians(10.0)
"""Azimuth of the camera relative to the task, so that the arm does not hide the task [rad]."""
CLEAR_ANGLE = np.radians(75.0)
"""Turn of the azimuth away from other robots, so that they do not hide the arm [rad]."""
VIEW_MARGIN = 0.35
"""Margin around a view of the task alone, as a fraction of its size."""


def scene_of(motion: CheckedMotion, previous: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Compose the scene of a motion, as plain data; `previous` as for `make_scene`.

    Raises:
        InputError: The scenario has no robot, or the motion can't be shown.
    """
    return make_scene(ShownMotion.of_checked(motion), previous=previous)


def view_trajectory(robot: Robot, trajectory: JointTrajectory) -> Page:
    """Show a stored trajectory without its task.

    >>> motion = kw.plan("planar2_closed_form").trajectory
    >>> view_trajectory(kw.load_robot("planar2"), motion).save("arm.html").name
    'arm.html'

    Args:
        robot: The arm.
        trajectory: The motion.

    Raises:
        InputError: The trajectory has other joints than the robot, or can't be shown.
    """
    return scene_page(scene_of_trajectory(robot, trajectory))


def scene_of_trajectory(
    robot: Robot, trajectory: JointTrajectory, previous: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    """Compose the scene of a stored trajectory, as plain data; `previous` as for `make_scene`.

    Raises:
        InputError: The trajectory has other joints than the robot, or can't be shown.
    """
    return make_scene(
        ShownMotion.of_robot(trajectory, robot), warnings=_tool_warnings(robot), previous=previous
    )


def _tool_warnings(robot: Robot) -> list[str]:
    """Warn that a trajectory without a scenario does not name its tool."""
    if robot.tcp_frame_id is not None and not robot.tool_offset.isIdentity(1e-9):
        return []
    return [
        "a trajectory does not name its tool: a path and its speed are those of the frame "
        f"{robot.tool_frame!r} of robot {robot.name!r}; give the scenario to see those of its tool"
    ]


def make_scene(
    shown: ShownMotion,
    *,
    warnings: Sequence[str] = (),
    previous: Mapping[str, Any] | None = None,
    min_scale_end: float = 0.0,
) -> dict[str, Any]:
    """Compose the scene of a motion, as plain data for JSON.

    Args:
        shown: The motion with the arm, its meshes, and the task.
        warnings: Further warnings for the page.
        previous: The scene that this one replaces. For the same robot, its `ROBOT_PARTS` are
            reused, as the same objects, and its view is kept.
        min_scale_end: Lower bound on the end of the scale of tool speeds [m/s].
    """
    base = base_joints(shown.robot)
    outlines = _outlines(shown)
    task = _at_start(shown, _task_points(shown))
    points = np.concatenate([outlines, task, _at_start(shown, _fixed_points(shown))])
    size = max(float(np.ptp(points, axis=0).max()), 1e-3)
    robot_parts = _robot_parts(shown, previous)
    same_robot = previous is not None and robot_parts["joints"] is previous["joints"]
    parts = SceneParts([*warnings, *shown.shapes.warnings])
    legend = draw_paths(parts, shown, size, min_scale_end)
    if tool_trace(shown) is not None:
        legend |= draw_marks(parts, shown, size)
        draw_frames(parts, shown, size)
    draw_surroundings(parts, shown, size)
    draw_other_robots(parts, shown, size)
    in_view = [points, *(_at_start(shown, corners) for corners in parts.corners)]
    return {
        **_description(shown),
        **robot_parts,
        "arm": _arm_frames(shown),
        "first_joint": base.count,
        "meshes": base.carry(parts.meshes),
        "labels": base.carry(_merge_labels(parts.labels)),
        "waypoints": [
            {"name": name, "time": time}
            for name, time in zip(shown.names, shown.times.tolist(), strict=True)
        ],
        "strip": time_strip(shown),
        "legend": legend,
        "size": size,
        "floor": float(min(outlines[:, 2].min(), 0.0)),
        **_views(
            _extreme_points(np.concatenate(in_view)),
            task,
            _at_start(shown, joint_origins(shown)[1]),
            previous["view"]["towards_camera"] if same_robot and previous is not None else None,
        ),
        **check_results(shown),
        "warnings": parts.warnings,
    }


def _arm_frames(shown: ShownMotion) -> dict[str, Any]:
    """Sample a motion's frames, and the tool's speed at each unless there are too many frames.

    Until the next frame, the previous one is shown. The last frame is the end of the motion.
    """
    curve, robot = shown.curve, shown.robot
    start, end = float(curve.x[0]), float(curve.x[-1])
    time = make_sample_times(start, end, min(FRAME_RATE, MAX_FRAMES / (end - start)))
    position = np.hstack((curve(time), environment_positions(shown.collision_model, time)))
    arm: dict[str, Any] = {
        "start": start,
        "time": pack_numbers((time - start).astype("<f4")),
        "position": pack_numbers(base_joints(robot).positions(position).astype("<f4")),
    }
    if robot.tcp_frame_id is not None and len(time) <= MAX_SPEEDS:
        arm["speed"] = pack_numbers(tool_speeds(shown, time).astype("<f4"))
    return arm


def _joint_panel(robot: Robot, units: Units) -> list[dict[str, Any]]:
    """Names, units and limits of the joints; `None` for a missing limit."""
    panel = []
    limits = zip(robot.limits.lower, robot.limits.upper, strict=True)
    for name, unit, bounds in zip(robot.joint_names, robot.joint_units, limits, strict=True):
        factor, shown = units.shown(1.0, unit)
        low, high = (factor * float(bound) if np.isfinite(bound) else None for bound in bounds)
        panel.append({"name": name, "unit": shown, "factor": factor, "low": low, "high": high})
    return panel


def _views(
    points: FloatArray,
    task: FloatArray,
    other_robots: FloatArray,
    towards_camera: Sequence[float] | None = None,
) -> dict[str, Any]:
    """Choose the view of the whole scene, and that of the task alone.

    Args:
        points: Points of the arm and the task, all in view [m], z up, shape (n, 3).
        task: Points of the tool's path and the waypoints [m], shape (m, 3), m >= 0.
        other_robots: Points of other robots [m], shape (k, 3), k >= 0.
        towards_camera: Unit vector from the scene towards the camera, if known.

    Returns:
        `view` has the direction `towards_camera` and the `points` in view; `work` has those of the
        task alone, or is `None`.
    """
    size = np.ptp(points, axis=0)
    if towards_camera is None:
        x, y, _ = (task if len(task) else points).mean(axis=0)
        azimuth = (np.arctan2(y, x) if np.hypot(x, y) > 1e-3 else 0.0) + ASIDE_ANGLE
        if len(other_robots):
            offset_x, offset_y = (other_robots[:, :2] - [x, y]).mean(axis=0)
            azimuth -= np.copysign(CLEAR_ANGLE, np.sin(np.arctan2(offset_y, offset_x) - azimuth))
        up = STEEP if size[2] < FLAT_SCENE * size[:2].max() else ELEVATION
        level = np.cos(up) * np.array([np.cos(azimuth), np.sin(azimuth)])
        towards_camera = [*level.tolist(), float(np.sin(up))]
    view = {"towards_camera": towards_camera, "points": points.tolist()}
    extent = float(np.ptp(task, axis=0).max()) if len(task) else 0.0
    if extent < 1e-3 * size.max():
        return {"view": view, "work": None}
    margin = VIEW_MARGIN * extent
    corners = box_corners(np.array([task.min(axis=0) - margin, task.max(axis=0) + margin]))
    return {"view": view, "work": {**view, "points": corners.tolist()}}


def _at_start(shown: ShownMotion, points: FloatArray) -> FloatArray:
    """Points carried by the base frame at the start of the motion, shape (n, 3)."""
    start = shown.curve(shown.curve.x[:1])
    return np.asarray(base_joints(shown.robot).to_world(start, points[None])[0])


def _task_points(shown: ShownMotion) -> FloatArray:
    """The tool's path and the waypoints [m], shape (n, 3)."""
    trace = tool_trace(shown)
    path = [] if trace is None else [trace.position]
    targets = [target.pose.translation[np.newaxis] for target in tool_targets(shown)]
    return np.concatenate([np.zeros((0, 3)), *path, *targets])


def _fixed_points(shown: ShownMotion) -> FloatArray:
    """Fixed points in the base frame [m], shape (n, 3)."""
    paths = given_path_points(shown, 1.0, at_rest=True) if tool_trace(shown) is not None else ()
    base = shown.robot.base_placement
    frames = [(base * frame).translation for frame in shown.scenario.frame_placements.values()]
    points = [joint_origins(shown)[0], np.reshape(frames, (-1, 3))]
    return np.concatenate([*(dash for _, dashes in paths for dash in dashes), *points])


def _outlines(shown: ShownMotion) -> FloatArray:
    """Corners of bounding boxes of the links along the motion, in world axes [m], shape (n, 3)."""
    start, end = shown.curve.x[[0, -1]]
    q = shown.curve(np.linspace(start, end, OUTLINE_SAMPLES))
    rotation, origin = place_joints(joint_tree(shown.robot.model), q)
    placed = [
        box_corners(mesh.vertices) @ rotation[:, i].swapaxes(1, 2) + origin[:, i, np.newaxis]
        for i, mesh in enumerate(shown.shapes.shapes)
        if mesh is not None
    ]
    corners = base_joints(shown.robot).to_world(q, np.concatenate(placed, axis=1))
    return corners.reshape(-1, 3)


def _description(shown: ShownMotion) -> dict[str, Any]:
    """Title of the scene and its units."""
    scenario, units = shown.scenario, shown.scenario.units
    return {
        "title": scenario.name,
        "robot": shown.robot.name,
        "origin": shown.trajectory.origin,
        "description": scenario.task.description.strip(),
        "joint_panel": _joint_panel(shown.robot, units),
        "units": {"length": units.length, "per_metre": units.shown(1.0, "m")[0]},
    }


def _robot_parts(shown: ShownMotion, previous: Mapping[str, Any] | None) -> dict[str, Any]:
    """The `ROBOT_PARTS` of a scene, reused from `previous` if they are equal."""
    model, base, others = shown.robot.model, base_joints(shown.robot), environment_joints(shown)
    own = drawn_joints(joint_tree(model), list(model.names)[1:])
    carried = [*([] for _ in base.joints), *shown.shapes.parts, *([] for _ in others)]
    parts: dict[str, Any] = {
        "joints": base.below([*own, *others]),
        "shapes": [[pack_mesh(mesh) for mesh in meshes] for meshes in carried],
    }
    if previous is not None and all(parts[name] == previous[name] for name in ROBOT_PARTS):
        return {name: previous[name] for name in ROBOT_PARTS}
    return parts


def _merge_labels(labels: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Labels, of which an object and a frame of the same name share one."""
    frames = {label["text"] for label in labels if label["kind"] == "frame"}
    shared = frames & {label["text"] for label in labels if label["kind"] == "object"}
    merged = [label for label in labels if label["kind"] != "object" or label["text"] not in shared]
    for label in merged:
        if label["text"] in shared:
            label["detail"] = f"frame and object {label['text']!r}"
    return merged


def _extreme_points(points: FloatArray, most: int = 800) -> FloatArray:
    """Points that are extreme in some direction."""
    directions = np.random.default_rng(0).normal(size=(most, 3))
    return np.asarray(points[np.unique((directions @ points.T).argmax(axis=1))])
