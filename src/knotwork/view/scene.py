"""What a scene holds: the arm, its motion, the task and what the check found, as plain data.

Everything is in the axes of the URDF's root, z up, in m and s.
"""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin

from knotwork.errors import InputError
from knotwork.joint_space import JointSpace
from knotwork.polynomial import PiecewisePolynomial
from knotwork.robot import Robot
from knotwork.scenario import Scenario
from knotwork.trajectory import JointTrajectory
from knotwork.view.animation import frames, joint_tree
from knotwork.view.camera import first_view
from knotwork.view.links import LinkShapes, link_shapes
from knotwork.view.marks import RED, Target, marks, targets
from knotwork.view.mesh import Mesh, coarse, merged, rod, sphere, triad, tube
from knotwork.view.path import ToolPath, robot_curve, tool_path, tool_speed
from knotwork.waypoints import FloatArray
from knotwork.witness import Report, check

MOST_STOPS = 200
# Copies of the arm that differ by less than this, relative to the scene's size, hide each other.
GHOST_DISTANCE = 0.12
MOST_GHOSTS = 12
# They are faint and need no detail finer than this, relative to the scene's size.
GHOST_DETAIL = 0.007
MOST_SPEEDS = 30_000
# Slow to fast: dark violet, blue, green, yellow; evenly lighter, so that it reads in grey, too.
SPEED_COLOURS = np.array(
    [
        [0.267, 0.005, 0.329],
        [0.231, 0.322, 0.545],
        [0.129, 0.569, 0.549],
        [0.369, 0.788, 0.384],
        [0.85, 0.87, 0.12],
    ]
)


@dataclass(frozen=True, eq=False)
class Scene:
    """A scene, ready to be put on a page.

    Attributes:
        title: What it shows.
        data: Plain data, ready for JSON.
        warnings: What could not be drawn as described.
    """

    title: str
    data: Mapping[str, Any]
    warnings: tuple[str, ...]


def make_scene(
    robot: Robot,
    trajectory: JointTrajectory,
    *,
    scenario: Scenario | None = None,
    space: JointSpace | None = None,
    report: Report | None = None,
    others: Mapping[str, JointTrajectory] | None = None,
) -> Scene:
    """Compose the scene of a motion.

    Args:
        robot: The arm; its meshes are opened.
        trajectory: The motion.
        scenario: The task.
        space: The task's joints and limits.
        report: What the check found.
        others: Motions of other planners, by name, shown over the first as translucent arms.

    Raises:
        InputError: A trajectory is not of the robot's joints, or too long to be shown.
    """
    curve = robot_curve(trajectory, robot)
    motions = {name: robot_curve(other, robot) for name, other in (others or {}).items()}
    asked: list[Target] = []
    has_tool = robot.tcp_frame_id is not None
    if has_tool and scenario is not None and space is not None:
        asked = targets(scenario, space, robot)
    shapes = link_shapes(robot)
    times = [target.time for target in asked]
    path = tool_path(robot, curve, space, report, times) if has_tool else None
    stops = _stops(curve, scenario, trajectory)
    outlines = _outlines(robot, shapes, stops)
    outline = outlines.reshape(-1, 3)
    points = [outline, *([path.position] if path is not None else [])]
    points += [target.pose.translation[np.newaxis] for target in asked]
    if scenario is not None:
        placed = (robot.base_placement * frame for frame in scenario.frames.values())
        points += [frame.translation[np.newaxis] for frame in placed]
    everything = np.concatenate(points)
    size = max(float(np.ptp(everything, axis=0).max()), 1e-3)
    things, labels, legend = _things(robot, curve, path, asked, scenario, report, motions, size)
    for part in things:
        if part["name"] == "tool":
            part["carrier"] = int(robot.model.frames[robot.tcp_frame_id].parentJoint)
    moved = {trajectory.planner or "trajectory": curve, **motions}
    data = {
        "joints": joint_tree(robot),
        "shapes": [packed(shape) for shape in shapes.shapes],
        "coarse": [packed(coarse(s, GHOST_DETAIL * size)) if s else None for s in shapes.shapes],
        "arms": [_arm(name, motion, robot, has_tool) for name, motion in moved.items()],
        "ghosts": stops[_distinct(outlines, GHOST_DISTANCE * size)].tolist(),
        "things": things,
        "labels": labels,
        "tip": robot.model.frames[robot.tcp_frame_id].placement.translation.tolist()
        if has_tool
        else None,
        "legend": legend,
        "size": size,
        "floor": float(min(outline[:, 2].min(), 0.0)),
        "view": first_view(
            _thinned(everything), path.position if path is not None else outline[:0]
        ),
        "ok": report.ok if report is not None else None,
        "failures": [str(item) for item in report.failures] if report is not None else [],
        "others": [
            {"name": name, "failures": _failures(other, scenario, space)}
            for name, other in (others or {}).items()
        ],
        "warnings": list(shapes.warnings),
        "robot": robot.name,
        "planner": trajectory.planner,
        "description": scenario.description.strip() if scenario is not None else "",
    }
    title = scenario.name if scenario is not None else f"{robot.name}: stored trajectory"
    return Scene(title, {"title": title, **data}, shapes.warnings)


def _failures(
    trajectory: JointTrajectory, scenario: Scenario | None, space: JointSpace | None
) -> list[str] | None:
    """What another planner's motion fails in, or `None` where there is nothing to check it by."""
    if scenario is None:
        return None
    return [str(item) for item in check(trajectory, scenario, space=space).failures]


def _stops(
    curve: PiecewisePolynomial, scenario: Scenario | None, trajectory: JointTrajectory
) -> FloatArray:
    """Joint positions at the waypoints, or at both ends, shape (n, d)."""
    times = scenario.times if scenario is not None else trajectory.waypoint_times
    times = curve.x[[0, -1]] if times is None else times
    times = times[(times >= curve.x[0]) & (times <= curve.x[-1])]
    if not len(times):
        times = curve.x[[0, -1]]
    return np.asarray(curve(times[:: len(times) // MOST_STOPS + 1]))


def _outlines(robot: Robot, shapes: LinkShapes, stops: FloatArray) -> FloatArray:
    """Corners of boxes about the links at each configuration, root's axes, shape (s, n, 3)."""
    boxes = []
    for i, shape in enumerate(shapes.shapes):
        if shape is not None:
            low, high = shape.vertices.min(axis=0), shape.vertices.max(axis=0)
            corners = np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1).T
            boxes.append((i, corners))
    data = robot.model.createData()
    found = []
    for q in stops:
        pin.forwardKinematics(robot.model, data, q)
        placed = [(data.oMi[i], corners) for i, corners in boxes]
        found.append([corners @ at.rotation.T + at.translation for at, corners in placed])
    return np.array(found).reshape(len(stops), -1, 3)


def _distinct(outlines: FloatArray, distance: float) -> list[int]:
    """Which configurations differ from each other, so that copies of the arm can be told apart."""
    kept: list[int] = []
    for i, outline in enumerate(outlines):
        away = (np.linalg.norm(outline - outlines[k], axis=1).max() for k in kept)
        if len(kept) < MOST_GHOSTS and all(apart > distance for apart in away):
            kept.append(i)
    return kept


def _things(
    robot: Robot,
    curve: PiecewisePolynomial,
    path: ToolPath | None,
    asked: Sequence[Target],
    scenario: Scenario | None,
    report: Report | None,
    motions: Mapping[str, PiecewisePolynomial],
    size: float,
) -> tuple[list[dict[str, Any]], list[dict[str, Any]], dict[str, Any]]:
    """Meshes by name, labels and the legend."""
    if path is None:
        return [], [], {}
    low, high = 0.0, float(path.speed.max())
    things = _path_things(path, high, size)
    for name, motion in motions.items():
        other = tool_path(robot, motion)
        line = _tube(
            other.position, np.tile((0.45, 0.45, 0.5), (len(other.time), 1)), 0.0022 * size
        )
        if line is not None:
            things.append({"name": f"path of {name}", "mesh": packed(line), "lit": False})
    drawn = marks(asked, path, curve, robot, scenario, report, size)
    for name, mesh in drawn.meshes.items():
        things.append({"name": name, "mesh": packed(mesh), "lit": name != "failures"})
    things.append({"name": "tool", "mesh": packed(_tool(robot, size)), "lit": True})
    labels = [
        {"text": one.text, "kind": one.kind, "at": list(one.position), "detail": one.detail}
        for one in drawn.labels
    ]
    legend = {
        "low": low,
        "high": high,
        "colours": [_hex(colour) for colour in SPEED_COLOURS],
        "arrow_seconds": drawn.arrow_seconds,
        "broken": bool(path.broken.any()),
    }
    return things, labels, legend


def _path_things(path: ToolPath, high: float, size: float) -> list[dict[str, Any]]:
    share = path.speed / high if high > 0 else np.zeros_like(path.speed)
    at = np.linspace(0.0, 1.0, len(SPEED_COLOURS))
    colours = np.stack([np.interp(share, at, SPEED_COLOURS[:, i]) for i in range(3)], axis=1)
    things = []
    line = _tube(path.position, colours, 0.0032 * size)
    if line is not None:
        things.append({"name": "path", "mesh": packed(line), "lit": False})
    broken = np.flatnonzero(path.broken)
    red: list[Mesh] = []
    for run in np.split(broken, np.flatnonzero(np.diff(broken) > 1) + 1) if len(broken) else ():
        part = path.position[max(run[0] - 1, 0) : run[-1] + 2]
        colour = np.tile(RED[:3], (len(part), 1))
        tubes = _tube(part, colour, 0.0065 * size)
        red.append(
            tubes
            if tubes is not None  # the tool stands still while the limit is broken
            else sphere(0.012 * size, RED).moved(np.eye(3), part[0])
        )
    if red:
        things.append({"name": "limits broken", "mesh": packed(merged(red)), "lit": False})
    return things


def _tube(points: FloatArray, colours: FloatArray, radius: float) -> Mesh | None:
    """A line as a tube; `None` if it has no length."""
    apart = np.linalg.norm(np.diff(points, axis=0), axis=1)
    keep = np.concatenate([[True], apart > 1e-9])
    points, colours = points[keep], colours[keep]
    return tube(points, colours, radius) if len(points) > 1 else None


def _tool(robot: Robot, size: float) -> Mesh:
    """A rod from the tool frame to the tool centre point, and the axes there; joint's axes."""
    model = robot.model
    tip = model.frames[robot.tcp_frame_id].placement
    flange = tip * robot.tool_offset.inverse()
    parts = [triad(0.06 * size, 0.0028 * size).moved(tip.rotation, tip.translation)]
    if np.linalg.norm(tip.translation - flange.translation) > 1e-6:
        steel = (0.35, 0.36, 0.4, 1.0)
        parts.append(rod(flange.translation, tip.translation, 0.006 * size, steel))
    return merged(parts)


def _arm(name: str, curve: PiecewisePolynomial, robot: Robot, has_tool: bool) -> dict[str, Any]:
    shown = frames(curve)
    arm: dict[str, Any] = {
        "name": name,
        "start": float(shown.time[0]),
        "time": _numbers((shown.time - shown.time[0]).astype("<f4")),
        "position": _numbers(shown.position.astype("<f4")),
    }
    if has_tool and len(shown.time) <= MOST_SPEEDS:
        speed = tool_speed(robot, shown.position, curve(shown.time, 1))
        arm["speed"] = _numbers(speed.astype("<f4"))
    return arm


def packed(mesh: Mesh | None) -> dict[str, Any] | None:
    """Give a mesh as plain data: arrays in base64, little-endian."""
    if mesh is None:
        return None
    if not np.isfinite(mesh.vertices).all():
        raise InputError("a mesh of the robot has points that are not finite")
    wide = len(mesh.vertices) > 65535
    colours = np.round(255 * np.clip(mesh.colours, 0.0, 1.0)).astype(np.uint8)
    plain = bool((colours == colours[:1]).all())
    return {
        "vertices": _numbers(mesh.vertices.astype("<f4")),
        "normals": _numbers(np.round(127 * mesh.normals).astype(np.int8)),
        "faces": _numbers(mesh.faces.astype("<u4" if wide else "<u2")),
        "wide": wide,
        "colours": colours[0].tolist() if plain else _numbers(colours),
        "opacity": mesh.opacity,
    }


def _numbers(array: np.ndarray[Any, Any]) -> str:
    return base64.b64encode(np.ascontiguousarray(array).tobytes()).decode("ascii")


def _hex(colour: FloatArray) -> str:
    return "#" + "".join(f"{round(255 * float(value)):02x}" for value in colour)


def _thinned(points: FloatArray, most: int = 800) -> FloatArray:
    """Those points alone that lie furthest out in some direction."""
    turns = np.random.default_rng(0).normal(size=(most, 3))
    return np.asarray(points[np.unique((points @ turns.T).argmax(axis=0))])
