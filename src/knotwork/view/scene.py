"""Content of a scene: the arm, its motion, the task and the findings of the check, as plain data.

Everything is in the axes of the URDF's root, z up, in m and s.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from knotwork.polynomial import PiecewisePolynomial
from knotwork.robot import Robot
from knotwork.scenario import Scenario, ScenarioPath
from knotwork.scenario.joint_space import JointSpace
from knotwork.scene.model import CollisionModel
from knotwork.trajectory import JointTrajectory
from knotwork.units import SI
from knotwork.verification import Report
from knotwork.view.arm_at_waypoints import Stops, find_stops
from knotwork.view.camera import views
from knotwork.view.drawn_joints import drawn_joints
from knotwork.view.footing import footing
from knotwork.view.images import image_addresses
from knotwork.view.links import LinkShapes, link_shapes
from knotwork.view.marks import frame_marks, marks
from knotwork.view.mesh import coarse
from knotwork.view.moving_things import known_joints, moving_model, origins, other_robots
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
from knotwork.view.scene_verdict import failures, verdict
from knotwork.view.strip import strip
from knotwork.view.targets import targets
from knotwork.view.tool_trace import ToolTrace, tool_trace
from knotwork.waypoints import CartesianWaypoint, FloatArray

# Copies of the arm are faint and need no detail finer than this, relative to the scene's size.
GHOST_DETAIL = 0.015
# Drawn in their own colours, whatever the light.
UNLIT = ("path", "limits broken", "failures", "deviation", "way")
# Parts of a scene that depend on the robot alone: most of the data.
STILL = ("joints", "shapes", "images", "coarse")
# Shown on demand.
HIDDEN = ("deviation", "knots on paths")


@dataclass(frozen=True, eq=False)
class _Shown:
    """Parts that a scene is composed of."""

    robot: Robot
    trajectory: JointTrajectory
    motions: Mapping[str, PiecewisePolynomial]
    scenario: Scenario | None
    space: JointSpace | None
    report: Report | None
    shapes: LinkShapes
    stops: Stops
    asked: Sequence[CartesianWaypoint]
    path: ToolTrace | None
    model: CollisionModel | None

    @property
    def curve(self) -> PiecewisePolynomial:
        """Joint positions, joints in the robot's order."""
        return self.trajectory.polynomial

    @property
    def paths(self) -> Sequence[ScenarioPath]:
        """Tool paths of the task."""
        return self.scenario.paths if self.scenario is not None else ()

    def task_points(self) -> FloatArray:
        """The tool's path and the waypoints [m], shape (n, 3)."""
        path = [] if self.path is None else [self.path.position]
        asked = [target.pose.translation[np.newaxis] for target in self.asked]
        return self.at_start(np.concatenate([np.zeros((0, 3)), *path, *asked]))

    def points(self) -> FloatArray:
        """Everything that must be in view [m], shape (n, 3)."""
        points = [self.stops.outlines.reshape(-1, 3), self.stops.passed.reshape(-1, 3)]
        points.append(self.task_points())
        return np.concatenate([*points, self.at_start(self.still_points())])

    def at_start(self, points: FloatArray) -> FloatArray:
        """Points of what the base frame carries where the motion begins, shape (n, 3)."""
        start = self.curve(self.curve.x[:1])
        return np.asarray(footing(self.robot).in_cell(start, points[None])[0])

    def other_points(self) -> FloatArray:
        """Where other robots are over the motion [m], shape (n, 3)."""
        if self.model is None:
            return np.zeros((0, 3))
        return self.at_start(origins(self.model, self.robot, self.trajectory)[1])

    def still_points(self) -> FloatArray:
        """What stands in the base frame [m], shape (n, 3)."""
        points = [np.zeros((0, 3))]
        if self.path is not None:
            asked = asked_points(self.scenario, self.robot, 1.0)
            points += [one for _, dashes in asked for one in dashes]
        if self.model is not None:
            points.append(origins(self.model, self.robot, self.trajectory)[0])
        if self.scenario is not None:
            base = self.robot.base_placement
            placed = (base * frame for frame in self.scenario.frames.values())
            points += [frame.translation[np.newaxis] for frame in placed]
        return np.concatenate(points)


def make_scene(
    robot: Robot,
    trajectory: JointTrajectory,
    *,
    scenario: Scenario | None = None,
    space: JointSpace | None = None,
    report: Report | None = None,
    others: Mapping[str, JointTrajectory] | None = None,
    warnings: Sequence[str] = (),
    before: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Compose the scene of a motion, as plain data that is ready for JSON.

    Args:
        robot: The arm; its meshes are opened.
        trajectory: The motion.
        scenario: The task.
        space: The task's joints and limits.
        report: Of the check.
        others: Motions of other planners, by name, shown over the first as translucent arms.
        warnings: Further ones for the page.
        before: The scene in whose place this one is shown. Of the same robot the parts `STILL` are
            taken over, the very objects, and it is looked at from the same side.

    Raises:
        InputError: A trajectory is not of the robot's joints, or too long to be shown.
    """
    others = others or {}
    shown = _gathered(robot, trajectory, scenario, space, report, others)
    points = shown.points()
    size = max(float(np.ptp(points, axis=0).max()), 1e-3)
    still, unread = _robot_data(shown, size, before)
    same = before is not None and still["joints"] is before["joints"]
    objects = scene_objects(scenario, robot, shown.curve, report, size, shown.model)
    around = other_robots(shown.model, scenario, robot.base_placement, size)
    things, labels, legend = _task_data(shown, size)
    feet, said = footing(robot), [*warnings, *shown.shapes.warnings]
    return {
        **_description(robot, trajectory, scenario),
        **still,
        **_arms(shown, len(still["joints"]), size),
        "things": feet.carrying([*things, *objects.things, *around.things]),
        "labels": feet.carrying(_merged([*labels, *objects.labels, *around.labels])),
        "waypoints": waypoint_times(scenario, trajectory),
        "strip": strip(robot, shown.trajectory, scenario, space, report),
        "legend": legend,
        "size": size,
        "floor": float(min(shown.stops.outlines[..., 2].min(), 0.0)),
        **views(
            _thinned(np.concatenate([points, shown.at_start(objects.points)])),
            shown.task_points(),
            shown.other_points(),
            before["view"]["from"] if same and before is not None else None,
        ),
        **verdict(report, robot, feet.count),
        "others": [
            {"name": name, "failures": failures(other, scenario, space)}
            for name, other in others.items()
        ],
        "warnings": [*said, *objects.warnings, *around.warnings, *unread],
    }


def _arms(shown: _Shown, joints: int, size: float) -> dict[str, Any]:
    """The moving arms, and where copies of the first one stand, of a number of joints each."""
    feet = footing(shown.robot)
    ghosts = feet.positions(shown.stops.position[shown.stops.distinct(size)])
    unmoved = np.zeros(joints - ghosts.shape[1])  # ghosts are of the robot alone
    motions = {shown.trajectory.planner or "trajectory": shown.curve, **shown.motions}
    return {
        "arms": [
            arm_frames(name, motion, shown.robot, shown.model, shown.paths)
            for name, motion in motions.items()
        ],
        "ghosts": [[*one, *unmoved] for one in ghosts.tolist()],
        "first_joint": feet.count,
    }


def _description(
    robot: Robot, trajectory: JointTrajectory, scenario: Scenario | None
) -> dict[str, Any]:
    """What is shown, and its units."""
    units = scenario.units if scenario is not None else SI
    return {
        "title": scenario.name if scenario is not None else f"{robot.name}: stored trajectory",
        "robot": robot.name,
        "planner": trajectory.planner,
        "description": scenario.description.strip() if scenario is not None else "",
        "joint_panel": joint_panel(robot, units),
        "units": {"length": units.length, "per_metre": units.shown(1.0, "m")[0]},
    }


def _robot_data(
    shown: _Shown, size: float, before: Mapping[str, Any] | None
) -> tuple[dict[str, Any], list[str]]:
    """The parts `STILL`, those of `before` where they are equal, and images that can't be read."""
    parts = [mesh for meshes in shown.shapes.parts for mesh in meshes]
    images = list(dict.fromkeys(mesh.image for mesh in parts if mesh.image is not None))
    addresses, unread = image_addresses(images)
    known = [] if shown.model is None else known_joints(shown.model.joints, shown.robot)
    feet = footing(shown.robot)
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


def _gathered(
    robot: Robot,
    trajectory: JointTrajectory,
    scenario: Scenario | None,
    space: JointSpace | None,
    report: Report | None,
    others: Mapping[str, JointTrajectory],
) -> _Shown:
    curve, *shadows = (
        each.reordered(robot.joint_names, robot.joint_units, owner=f"robot {robot.name!r}")
        for each in (trajectory, *others.values())
    )
    motions = {name: each.polynomial for name, each in zip(others, shadows, strict=True)}
    has_tool = robot.tcp_frame_id is not None
    asked: Sequence[CartesianWaypoint] = []
    if has_tool and scenario is not None and space is not None:
        asked = targets(scenario, space, robot, curve.polynomial)
    shapes = link_shapes(robot)
    stops = find_stops(robot, shapes, curve.polynomial, scenario, trajectory)
    times = [target.time for target in asked]
    paths = scenario.paths if scenario is not None else ()
    path = None
    if has_tool:
        path = tool_trace(robot, curve.polynomial, space, report, times, paths)
    model = moving_model(scenario, robot, trajectory, space)
    return _Shown(robot, curve, motions, scenario, space, report, shapes, stops, asked, path, model)


def _task_data(
    shown: _Shown, size: float
) -> tuple[list[dict[str, Any]], list[dict[str, Any]], dict[str, Any]]:
    """Meshes of the tool and its task, labels and the legend; nothing without a tool."""
    robot, path = shown.robot, shown.path
    if path is None:
        return [], [], {}
    colours, speeds = speed_colours(path, shown.scenario, shown.curve, shown.asked)
    meshes = path_meshes(path, colours, size)
    along = {
        "deviation": deviation_mesh(shown.scenario, robot, shown.curve, size),
        "way": way_mesh(path, shown.report, size),
    }
    meshes |= {name: mesh for name, mesh in along.items() if mesh is not None}
    for name, motion in shown.motions.items():
        line = other_path_mesh(tool_trace(robot, motion), size)
        if line is not None:
            meshes[f"path of {name}"] = line
    drawn, labels, seconds = marks(
        shown.asked, shown.curve, robot, shown.scenario, shown.report, size
    )
    meshes |= {**drawn, "tool": tool_mesh(robot, size)}
    things = [
        thing(name, mesh, lit=not name.startswith(UNLIT), hidden=name in HIDDEN)
        for name, mesh in meshes.items()
    ]
    things[-1]["carrier"] = int(robot.model.frames[robot.tcp_frame_id].parentJoint)
    things += [
        thing("path asked for", mesh, lit=False, carrier=carrier)
        for carrier, mesh in asked_path_meshes(shown.scenario, robot, size, shown.model).items()
    ]
    frames, names = frame_marks(shown.scenario, robot, size, shown.model)
    things, labels = [*things, *frames], [*labels, *names]
    legend = {**speeds, **seconds, "broken": bool(path.broken.any()), "way": "way" in meshes}
    if shown.scenario is not None and "deviation" in meshes:
        legend["moving"] = any(path.motion.seam_carrier is not None for path in shown.paths)
        legend["tolerance"] = shown.scenario.tolerances.path
        legend["deviation_colours"] = written(DEVIATION_COLOURS)
    return things, labels, legend


def _merged(labels: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Labels of which an object's is that of the frame of the same name, where there is one."""
    names = [{one["text"] for one in labels if one["kind"] == kind} for kind in ("frame", "object")]
    both = set.intersection(*names)
    return [
        one | ({"detail": f"frame and object {one['text']!r}"} if one["text"] in both else {})
        for one in labels
        if one["kind"] != "object" or one["text"] not in both
    ]


def _thinned(points: FloatArray, most: int = 800) -> FloatArray:
    """Keep the points that lie furthest out in some direction."""
    turns = np.random.default_rng(0).normal(size=(most, 3))
    return np.asarray(points[np.unique((turns @ points.T).argmax(axis=1))])
