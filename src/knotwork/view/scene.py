"""Content of a scene: arm, motion, task and findings of the check, as plain data.

Everything is in the axes of the URDF's root, z up, in m and s.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from knotwork.polynomial import PiecewisePolynomial
from knotwork.trajectory import JointTrajectory
from knotwork.view.arm_at_waypoints import find_stops
from knotwork.view.camera import views
from knotwork.view.footing import drawn_joints, footing
from knotwork.view.images import image_addresses
from knotwork.view.marks import frame_marks, marks, standing_marks
from knotwork.view.mesh import coarse
from knotwork.view.moving_things import known_joints, origins, other_robots
from knotwork.view.objects import scene_objects
from knotwork.view.packing import packed, thing
from knotwork.view.path_meshes import (
    DEVIATION_COLOURS,
    asked_path_meshes,
    asked_points,
    deviation_mesh,
    other_path_mesh,
    path_meshes,
    speed_colours,
    tool_mesh,
    way_mesh,
    written,
)
from knotwork.view.playback import arm_frames, joint_panel, waypoint_times
from knotwork.view.scene_verdict import verdict
from knotwork.view.shown import Shown
from knotwork.view.strip import strip
from knotwork.view.tool_trace import tool_trace
from knotwork.waypoints import FloatArray

# Faint copies of the arm need no finer detail than this, relative to the scene's size.
GHOST_DETAIL = 0.015
# Parts in their own colours, independent of the light.
UNLIT = ("path", "limits broken", "failures", "deviation", "way")
# Parts of a scene that depend only on the robot: most of the data.
STILL = ("joints", "shapes", "images", "coarse")
# Parts shown on demand.
HIDDEN = ("deviation", "knots on paths")


def _task_points(shown: Shown) -> FloatArray:
    """The tool's path and the waypoints [m], shape (n, 3)."""
    path = [] if shown.path is None else [shown.path.position]
    asked = [target.pose.translation[np.newaxis] for target in shown.asked]
    return shown.at_start(np.concatenate([np.zeros((0, 3)), *path, *asked]))


def _still_points(shown: Shown) -> FloatArray:
    """Fixed points in the base frame [m], shape (n, 3)."""
    asked = asked_points(shown, 1.0, at_rest=True) if shown.path is not None else ()
    base = shown.robot.base_placement
    frames = [(base * frame).translation for frame in shown.scenario.frames.values()]
    points = [origins(shown)[0], np.reshape(frames, (-1, 3))]
    return shown.at_start(
        np.concatenate([*(one for _, dashes in asked for one in dashes), *points])
    )


def make_scene(
    shown: Shown,
    others: Mapping[str, JointTrajectory] | None = None,
    *,
    warnings: Sequence[str] = (),
    before: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Compose the scene of a motion, as plain data for JSON.

    Args:
        shown: The motion with the arm, its meshes, and the task.
        others: Motions of other planners by name, shown as translucent arms.
        warnings: Further warnings for the page.
        before: The replaced scene. For the same robot its parts `STILL` are reused, as the same
            objects, and the view is kept.

    Raises:
        InputError: A trajectory has other joints than the robot, or is too long.
    """
    motions = {name: shown.in_order(one).polynomial for name, one in (others or {}).items()}
    stops, task = find_stops(shown), _task_points(shown)
    outlines = [one.reshape(-1, 3) for one in (stops.outlines, stops.passed)]
    points = np.concatenate([*outlines, task, _still_points(shown)])
    size = max(float(np.ptp(points, axis=0).max()), 1e-3)
    still, unread = _robot_data(shown, size, before)
    same = before is not None and still["joints"] is before["joints"]
    objects, around = scene_objects(shown, size), other_robots(shown, size)
    things, labels, legend = _task_data(shown, motions, size)
    feet, notes = footing(shown.robot), [*warnings, *shown.shapes.warnings]
    return {
        **_description(shown),
        **still,
        **_arms(shown, motions, stops.position[stops.distinct(size)], len(still["joints"])),
        "things": feet.carrying([*things, *objects.things, *around.things]),
        "labels": feet.carrying(_merged([*labels, *objects.labels, *around.labels])),
        "waypoints": waypoint_times(shown),
        "strip": strip(shown),
        "legend": legend,
        "size": size,
        "floor": float(min(stops.outlines[..., 2].min(), 0.0)),
        **views(
            _thinned(np.concatenate([points, shown.at_start(objects.points)])),
            task,
            shown.at_start(origins(shown)[1]),
            before["view"]["from"] if same and before is not None else None,
        ),
        **verdict(shown.report, shown.scenario, shown.robot, feet.count),
        "others": [
            {"name": name, "failures": list(map(str, shown.judged(one).failures))}
            for name, one in (others or {}).items()
        ],
        "warnings": [*notes, *objects.warnings, *around.warnings, *unread],
    }


def _arms(
    shown: Shown, motions: Mapping[str, PiecewisePolynomial], copies: FloatArray, joints: int
) -> dict[str, Any]:
    """The moving arms, and the positions of copies of the first one, for given joint counts."""
    feet = footing(shown.robot)
    ghosts = feet.positions(copies)
    unmoved = np.zeros(joints - ghosts.shape[1])  # ghosts have only the robot's joints
    arms = {shown.trajectory.planner or "trajectory": shown.curve, **motions}
    return {
        "arms": [
            arm_frames(name, motion, shown.robot, shown.model, shown.scenario.paths)
            for name, motion in arms.items()
        ],
        "ghosts": [[*one, *unmoved] for one in ghosts.tolist()],
        "first_joint": feet.count,
    }


def _description(shown: Shown) -> dict[str, Any]:
    """Title of the scene and its units."""
    scenario, units = shown.scenario, shown.scenario.units
    return {
        "title": scenario.name,
        "robot": shown.robot.name,
        "planner": shown.trajectory.planner,
        "description": scenario.task.description.strip(),
        "joint_panel": joint_panel(shown.robot, units),
        "units": {"length": units.length, "per_metre": units.shown(1.0, "m")[0]},
    }


def _robot_data(
    shown: Shown, size: float, before: Mapping[str, Any] | None
) -> tuple[dict[str, Any], list[str]]:
    """The parts `STILL`, reused from `before` if equal, and unreadable images."""
    parts = [mesh for meshes in shown.shapes.parts for mesh in meshes]
    images = list(dict.fromkeys(mesh.image for mesh in parts if mesh.image is not None))
    addresses, unread = image_addresses(images)
    known, feet = known_joints(shown), footing(shown.robot)
    carried = [*([] for _ in feet.joints), *shown.shapes.parts, *([] for _ in known)]
    still: dict[str, Any] = {
        "joints": feet.below([*drawn_joints(shown.robot), *known]),
        "shapes": [[packed(mesh, images) for mesh in parts] for parts in carried],
        "images": addresses,
    }
    if before is not None and all(still[name] == before[name] for name in still):
        return {name: before[name] for name in STILL}, unread
    shapes = [*(None for _ in feet.joints), *shown.shapes.shapes, *(None for _ in known)]
    cell = GHOST_DETAIL * size
    still["coarse"] = [packed(coarse(one, cell)) if one else None for one in shapes]
    return still, unread


def _task_data(
    shown: Shown, motions: Mapping[str, PiecewisePolynomial], size: float
) -> tuple[list[dict[str, Any]], list[dict[str, Any]], dict[str, Any]]:
    """Meshes of the tool and its task, labels and the legend; empty without a tool."""
    robot, path = shown.robot, shown.path
    if path is None:
        return [], [], {}
    colours, speeds = speed_colours(path, shown)
    meshes = path_meshes(path, colours, size)
    along = {
        "deviation": deviation_mesh(shown, size),
        "way": way_mesh(path, shown, size),
    }
    meshes |= {name: mesh for name, mesh in along.items() if mesh is not None}
    for name, motion in motions.items():
        line = other_path_mesh(tool_trace(robot, motion), size)
        if line is not None:
            meshes[f"path of {name}"] = line
    drawn, labels, seconds = marks(shown, size)
    meshes |= {**drawn, "tool": tool_mesh(robot, size)}
    things = [
        thing(name, mesh, lit=not name.startswith(UNLIT), hidden=name in HIDDEN)
        for name, mesh in meshes.items()
    ]
    things[-1]["carrier"] = int(robot.model.frames[robot.tcp_frame_id].parentJoint)
    things += [
        thing("path asked for", mesh, lit=False, carrier=carrier)
        for carrier, mesh in asked_path_meshes(shown, size).items()
    ]
    for more, names in (standing_marks(shown, size), frame_marks(shown, size)):
        things, labels = [*things, *more], [*labels, *names]
    legend = {**speeds, **seconds, "broken": bool(path.broken.any()), "way": "way" in meshes}
    if "deviation" in meshes:
        legend["moving"] = any(one.motion.seam_carrier is not None for one in shown.scenario.paths)
        legend["tolerance"] = shown.scenario.tolerances.path
        legend["deviation_colours"] = written(DEVIATION_COLOURS)
    return things, labels, legend


def _merged(labels: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Labels, with one for an object and a frame of the same name."""
    names = [{one["text"] for one in labels if one["kind"] == kind} for kind in ("frame", "object")]
    both = set.intersection(*names)
    return [
        one | ({"detail": f"frame and object {one['text']!r}"} if one["text"] in both else {})
        for one in labels
        if one["kind"] != "object" or one["text"] not in both
    ]


def _thinned(points: FloatArray, most: int = 800) -> FloatArray:
    """Points that are extreme in some direction."""
    turns = np.random.default_rng(0).normal(size=(most, 3))
    return np.asarray(points[np.unique((turns @ points.T).argmax(axis=1))])
