"""Collisions between robot, tool, held objects and surroundings."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors.plain_text import waypoint_text
from knotwork.task.scenario import Scenario
from knotwork.task.scenario.scenario_joints import ScenarioJoints
from knotwork.verification.finding import Finding, Findings, Group, Topic, Verdict
from knotwork.verification.limits import find_grossly_exceeded_limit
from knotwork.verification.motion import AT_WAYPOINT, Motion, describe_time

if TYPE_CHECKING:
    from knotwork.robot import Robot
    from knotwork.scene.collision_model import CollisionModel
    from knotwork.verification.bounds.clearance import Clearance

ROBOT_CLEARANCE_PRECISION = 2e-4
"""Precision of the clearance from another robot, see `clearance_from_robot` [m]."""


def check_collisions(motion: Motion, scenario: Scenario, joints: ScenarioJoints) -> Findings:
    """Prove over all time that all pairs of bodies keep their required clearances."""
    robot, scene = joints.robot, scenario.scene
    if robot is None or not scene.is_checked:
        return
    if exceeded_limit := find_grossly_exceeded_limit(motion.curve, joints):
        yield _not_examined(exceeded_limit)
        return
    from knotwork.verification.bounds.clearance import clearances

    model = collision_model_of(motion, scenario, robot)
    yield from _shape_findings(model, scenario, robot)
    clearances_found = clearances(model, motion.curve, scene.collisions.resolution)
    # tables have the nearest pair of each object, and that of the robot with itself
    nearest: dict[str | None, Clearance] = {}
    for pair in sorted(clearances_found, key=lambda pair: pair.distance)[::-1]:
        nearest[pair.first.name if pair.involves_scene else None] = pair
    for pair in sorted(clearances_found, key=lambda pair: pair.gap):
        yield _pair_finding(pair, scenario, robot, hidden=pair not in nearest.values())


def clearance_from_robot(
    trajectory: JointTrajectory, scenario: Scenario, joints: ScenarioJoints, name: str
) -> Finding | None:
    """Report how near the motion comes to another robot of the scene.

    Args:
        trajectory: The motion.
        scenario: The scenario, whose scene has the other robot.
        joints: The joints and their robot.
        name: Name of the other robot.

    Returns:
        The finding on the nearest pair of bodies; `None` if no pair is checked.
    """
    robot = joints.robot
    motion = Motion(trajectory, joints)
    if robot is None:
        return None
    if exceeded_limit := find_grossly_exceeded_limit(motion.curve, joints):
        return _not_examined(exceeded_limit)
    from knotwork.verification.bounds.clearance import least_clearance

    model = collision_model_of(motion, scenario, robot)
    is_other = [body.name.startswith(f"{name}/") for body in model.bodies]
    pairs = tuple(pair for pair in model.pairs if is_other[pair.first] or is_other[pair.second])
    resolution = scenario.scene.collisions.resolution
    model = replace(model, pairs=pairs)
    nearest = least_clearance(model, motion.curve, resolution, ROBOT_CLEARANCE_PRECISION)
    return None if nearest is None else _pair_finding(nearest, scenario, robot, hidden=False)


def collision_model_of(motion: Motion, scenario: Scenario, robot: Robot) -> CollisionModel:
    """Build the collision model of a scenario, with its held objects.

    Raises:
        DocumentError: A mesh is wrong, or a name in the scenario is unknown.
    """
    from knotwork.scene.building import build_collision_model

    times = np.clip(scenario.times, motion.start_time, motion.end_time).tolist()
    waypoints = scenario.waypoints if scenario.scene.held else ()
    poses = [
        robot.tool_pose(motion.curve(t), in_world_frame=waypoint.in_world_frame)
        for t, waypoint in zip(times, waypoints, strict=False)
    ]
    return build_collision_model(scenario, robot, times, poses)


def _not_examined(reason: str) -> Finding:
    fact = f"collisions are not examined: {reason}"
    return Topic(Group.COLLISIONS).finding("clearance", fact, "failed")


def _shape_findings(model: CollisionModel, scenario: Scenario, robot: Robot) -> Findings:
    """Report bodies without shapes, and pairs that are not checked."""
    notes: list[tuple[Verdict, str]] = [
        ("warning", f"{note}; it is not checked for collisions")
        for note in model.missing_shapes_notes
    ]
    has_bodies = scenario.scene.has_bodies
    if has_bodies and not any(body.kind == "link" for body in model.bodies):
        message = (
            f"the links of robot {robot.name!r} have no collision shapes: only its tool and what "
            "it holds are checked for collisions"
        )
        notes.append(("warning", message))
    elif model.bare:
        notes.append(("warning" if has_bodies else "information", model.bare_links_note))
    for verdict, message in notes:
        yield Topic(Group.COLLISIONS).finding("collision_shapes", message, verdict)
    for message in model.excluded_pairs_notes:
        yield Topic(Group.COLLISIONS).finding("pairs_not_checked", message)


def _pair_finding(pair: Clearance, scenario: Scenario, robot: Robot, *, hidden: bool) -> Finding:
    clear = pair.state == "clear"
    root_in_base = robot.base_placement.inverse()
    points = [root_in_base.act(point) for point in pair.nearest.points]
    return Finding(
        group=Group.COLLISIONS,
        subject="pair",
        name=f"{pair.second.name}, {pair.first.name}",
        quantity="clearance",
        verdict="met" if clear else "failed",
        fact=_pair_fact(pair, points, scenario),
        value=pair.distance,
        limit=pair.required_clearance,
        margin=pair.bound - pair.required_clearance if clear else pair.gap,
        unit="m",
        time=pair.time,
        interval=pair.interval,
        intervals=pair.contacts,
        proof="bounded",
        proof_gap=max(pair.distance - pair.bound, 0.0) if np.isfinite(pair.bound) else 0.0,
        points=tuple(tuple(float(x) for x in point) for point in points),
        short_fact=("unproved: " if pair.state == "unproved" else "") + _pair_text(pair, scenario),
        hidden_in_tables=hidden and clear,
        involves_scene=pair.involves_scene,
        bodies=(pair.second.name, pair.first.name),
        remedy=_remedy(pair, scenario),
    )


def _remedy(pair: Clearance, scenario: Scenario) -> str:
    """Remedy if waypoints themselves collide, where `way: clear` does not help; else empty."""
    inside = [
        waypoint_text(waypoint.name)
        for waypoint in scenario.waypoints
        if any(a - AT_WAYPOINT <= waypoint.time <= b + AT_WAYPOINT for a, b in pair.contacts)
    ]
    fault = "which themselves collide" if len(inside) > 1 else "which itself collides"
    return f"move {', '.join(inside)}, {fault}" if inside else ""


def _pair_fact(pair: Clearance, points: Sequence[FloatArray], scenario: Scenario) -> str:
    """The fact of a pair's finding: distance, time, waypoints around it and nearest points."""
    second, first = (body.name for body in (pair.second, pair.first))
    distance, bound, required = (
        scenario.units.text(length, "m", ".4g")
        for length in (pair.distance, pair.bound, pair.required_clearance)
    )
    at = f"at {pair.time:.3f} s"
    keep = f", required {required}" if pair.required_clearance else ""
    if pair.state == "clear":
        return f"{second} comes within {distance} of {first} {at}{keep}; never nearer than {bound}"
    where = f"{at}, {describe_time(scenario, pair.time)}{keep}"
    span = "from {:.3f} s to {:.3f} s".format(*(pair.interval or (pair.time, pair.time)))
    if pair.state == "unproved":
        resolution = scenario.units.text(scenario.scene.collisions.resolution, "m", ".3g")
        return (
            f"{_pair_text(pair, scenario)} {where}; it is not proved to keep clear {span} "
            f"at the resolution of {resolution}"
        )
    scale, unit = scenario.units.per_metre, scenario.units.length
    ends = " and ".join(_vector_text(scale * point) for point in points)
    if (others := len(pair.contacts) - 1) > 0:
        span += f" and {others} more {'times' if others > 1 else 'time'}"
    nearest = f"nearest points {ends} {unit}"
    return f"{_pair_text(pair, scenario)} {where} (too near {span}; {nearest})"


def _pair_text(pair: Clearance, scenario: Scenario) -> str:
    """Text of the distance or the penetration of two bodies."""
    distance = scenario.units.text(abs(pair.distance), "m", ".4g")
    how = f"is {distance} deep in" if pair.distance <= 0 else f"comes within {distance} of"
    return f"{pair.second.name} {how} {pair.first.name}"


def _vector_text(vector: FloatArray) -> str:
    """Text of a vector, without negative zeros."""
    return "[" + ", ".join(f"{value:.4g}" for value in np.round(vector, 4) + 0.0) + "]"


def failed_pairs(findings: Iterable[Finding]) -> list[Finding]:
    """Findings of pairs that collide or are unproved."""
    return [finding for finding in findings if finding.subject == "pair" and not finding.ok]
