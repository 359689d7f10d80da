"""Use of the free ranges of poses, such as a free turn or tilt, by a motion."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.task.scenario import Scenario, ScenarioPath
from knotwork.task.scenario.scenario_joints import ScenarioJoints
from knotwork.units import Units
from knotwork.verification.bounds.free_turn import free_angles, open_ranges
from knotwork.verification.finding import Finding, Findings, Group, Subject, Topic
from knotwork.verification.motion import Motion
from knotwork.verification.path_checks import group_paths_by_turn
from knotwork.waypoints import CartesianWaypoint, PoseFreedom

if TYPE_CHECKING:
    from knotwork.robot import Robot

PATH_TIMES = 400
"""Number of times at which each path is sampled."""
UNUSED = 1e-6
"""Size below which angles and distances count as zero [rad or m]."""


class FreedomUse(NamedTuple):
    """A motion's use of the freedom of a waypoint or a path.

    Attributes:
        subject: `"waypoint"` or `"path"`.
        name: Name of the waypoint or path.
        time: Sample times [s], shape (k,).
        values: Free angles and positions [rad or m] by name and unit, shape (k,) each.
        bounds: Allowed minimum and maximum of each value.
    """

    subject: Subject
    name: str
    time: FloatArray
    values: dict[tuple[str, str], FloatArray]
    bounds: dict[tuple[str, str], tuple[float, float]]


def sample_freedoms(motion: Motion, scenario: Scenario, robot: Robot) -> Iterator[FreedomUse]:
    """Sample free turns, tilts and positions. Turns are continuous along adjoining paths."""
    from knotwork.robot.joint_axes import joint_axes

    for paths in group_paths_by_turn(scenario):
        uses = []
        for path in paths:
            times = _path_times(path)
            if path.freedom is not None and _covers(motion, times):
                tip, columns, *_ = joint_axes(robot).forward(motion.curve(times))
                poses = tip.T, columns.transpose(2, 1, 0)
                requested = path.timed_path.state(times)[:2]
                name = _path_name(path, scenario)
                uses.append(_freedom_use("path", name, path.freedom, times, requested, poses))
        yield from _continue_turn(uses)
    on_paths = {i for path in scenario.paths for i in range(path.first, path.last + 1)}
    for i, waypoint in enumerate(scenario.waypoints):
        if not isinstance(waypoint, CartesianWaypoint) or i in on_paths:
            continue
        times = np.array([waypoint.time])
        if waypoint.freedom is not None and _covers(motion, times):
            q = motion.curve(waypoint.time)
            pose = robot.tool_pose(q, in_world_frame=waypoint.in_world_frame)
            requested = waypoint.position[None], waypoint.rotation[None]
            poses = pose.translation[None], pose.rotation[None]
            name, freedom = waypoint.name, waypoint.freedom
            use = _freedom_use("waypoint", name, freedom, times, requested, poses)
            yield from _continue_turn([use])


def _path_times(path: ScenarioPath) -> FloatArray:
    return np.linspace(path.timed_path.start_time, path.timed_path.end_time, PATH_TIMES)


def _path_name(path: ScenarioPath, scenario: Scenario) -> str:
    return f"{scenario.waypoints[path.first].name} to {scenario.waypoints[path.last].name}"


def _covers(motion: Motion, times: FloatArray) -> bool:
    return bool(motion.start_time <= times[0] and times[-1] <= motion.end_time)


def _freedom_use(
    subject: Subject,
    name: str,
    freedom: PoseFreedom,
    times: FloatArray,
    requested: tuple[FloatArray, FloatArray],
    poses: tuple[FloatArray, FloatArray],
) -> FreedomUse:
    """Free values of poses relative to requested ones, both positions and rotations."""
    positions, rotations = poses
    turn, travel, work = free_angles(freedom, requested[1], rotations).T
    R = requested[1].transpose(0, 2, 1) @ rotations
    x, y, z = np.einsum("kji,kj->ik", requested[1], positions - requested[0])
    tilt = np.arctan2(np.hypot(R[:, 0, 2], R[:, 1, 2]), R[:, 2, 2])
    values = {"turn": turn, "tilt": tilt, "x": x, "y": y, "z": z}
    if freedom.torch is not None:
        values["travel angle"] = travel + freedom.torch.pose_travel
        values["work angle"] = work + freedom.torch.pose_work
    bounds = open_ranges(freedom)
    return FreedomUse(subject, name, times, {key: values[key[0]] for key in bounds}, bounds)


def _continue_turn(uses: list[FreedomUse]) -> list[FreedomUse]:
    """Make the turn continuous along adjoining paths, near the middle of its range."""
    key = ("turn", "rad")
    if not uses or key not in uses[0].values:
        return uses
    turn = np.unwrap(np.concatenate([use.values[key] for use in uses]))
    middle = np.mean(uses[0].bounds[key]) if np.isfinite(uses[0].bounds[key]).all() else turn[0]
    turn -= 2.0 * np.pi * np.rint((0.5 * (turn.min() + turn.max()) - middle) / (2.0 * np.pi))
    parts = np.split(turn, np.cumsum([len(use.time) for use in uses])[:-1])
    return [
        use._replace(values=use.values | {key: part}) for use, part in zip(uses, parts, strict=True)
    ]


def report_freedoms(motion: Motion, scenario: Scenario, joints: ScenarioJoints) -> Findings:
    """Report the sampled free values within their ranges, and how far external axes move."""
    robot = joints.robot
    if robot is None:
        return
    for use in sample_freedoms(motion, scenario, robot):
        text = ", ".join(
            f"{key[0]} {_range_text(values, use.bounds[key], scenario.units, key[1])}"
            for key, values in use.values.items()
        )
        (_, unit), values = max(use.values.items(), key=lambda item: float(np.ptp(item[1])))
        size = np.ptp(values) if use.subject == "path" else np.abs(values).max()
        topic = Topic(Group.FREEDOM, use.subject, use.name)
        fact = f"{use.name}: {text}"
        yield _sampled_finding(topic, "free_range", fact, float(size), unit, use.time)
    yield from _external_axis_findings(motion, scenario, robot)


def _external_axis_findings(motion: Motion, scenario: Scenario, robot: Robot) -> Findings:
    """Report how far each external axis moves along each path."""
    axes = [i for i, name in enumerate(robot.joint_names) if name in robot.external_axes]
    for path in scenario.paths:
        times = _path_times(path)
        if not axes or not _covers(motion, times):
            continue
        moved = np.abs(np.diff(motion.curve(times), axis=0)).sum(axis=0).tolist()
        for i in axes:
            name, unit = robot.joint_names[i], robot.joint_units[i]
            size = _size_text(moved[i], unit, scenario.units)
            fact = f"{_path_name(path, scenario)}: {name} {size}"
            topic = Topic(Group.FREEDOM, "joint", name)
            yield _sampled_finding(topic, "external_axes", fact, moved[i], unit, times)


def _sampled_finding(
    topic: Topic, quantity: str, fact: str, value: float, unit: str, time: FloatArray
) -> Finding:
    interval = (float(time[0]), float(time[-1]))
    finding = topic.finding(quantity, fact, value=value, unit=unit, interval=interval)
    return replace(finding, proof="sampled", highlight=fact)


def _size_text(value: float, unit: str, units: Units) -> str:
    return f"{_number_text(value, unit, units)} {units.shown(0.0, unit)[1]}"


def _number_text(value: float, unit: str, units: Units) -> str:
    return units.number(value if abs(value) > UNUSED else 0.0, unit, ".3g")


def _range_text(values: FloatArray, bounds: tuple[float, float], units: Units, unit: str) -> str:
    """Text of one value, or of the minimum and maximum, with the allowed range."""
    ends = [_number_text(float(end), unit, units) for end in (values.min(), values.max())]
    allowed = [units.number(end, unit) for end in bounds if np.isfinite(end)]
    text = " to ".join(dict.fromkeys(ends)) + (f" of {' to '.join(allowed)}" if allowed else "")
    return f"{text} {units.shown(0.0, unit)[1]}"
