"""Rules that give the cost of a step from one waypoint of a scenario to the next."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from typing import Literal

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.planning.task_to_joint.free_poses import FreedomChains
from knotwork.planning.task_to_joint.task_solution import SequenceStep
from knotwork.robot import Robot
from knotwork.robot.kinematics.chain.joint_ranges import arm_limits, unbounded_joints
from knotwork.robot.kinematics.sequence.step_costs import (
    STEP_TOLERANCE,
    BlockedStep,
    JointRules,
    StepRules,
)
from knotwork.task.scenario import Scenario, WaypointUnknowns
from knotwork.task.scenario.joint_reader import JointState
from knotwork.waypoints import CartesianWaypoint

COLLISION_DISTANCE = 0.3
"""For a redundant arm, steps within this distance of a blocked step are blocked [rad or m]."""


def joint_rules(robot: Robot) -> JointRules:
    """Rules for the joints of a robot. Virtual joints move freely."""
    limit, virtual = robot.limits.velocity, robot.is_virtual
    lower, upper = arm_limits(robot)
    speed = np.where(np.isfinite(limit), limit, 1.0)
    return JointRules(
        speed=np.where(virtual, np.inf, speed),
        limit=limit,
        lower=lower,
        upper=upper,
        unbounded=unbounded_joints(robot) & ~virtual,
        weights=robot.weights,
        ramp=np.where(virtual, 0.0, speed / robot.limits.acceleration),
    )


def step_rules(
    scenario: Scenario,
    chains: FreedomChains,
    targets: Iterable[JointState | None],
    unknown_speeds: Collection[int],
    blocked_steps: Sequence[SequenceStep],
) -> list[StepRules]:
    """Rules for the cost of the step in each interval.

    Args:
        scenario: The scenario.
        chains: The robot with the virtual joints of each pose.
        targets: State of the joints at each waypoint, `None` where a pose is given.
        unknown_speeds: Waypoints whose speed is chosen later, by index.
        blocked_steps: Steps that count as collisions.
    """
    unknowns, tolerance = scenario.unknowns, _blocked_distance(chains)
    passes = [
        isinstance(w, CartesianWaypoint) and (i in unknown_speeds or bool(w.twist.vector.any()))
        for i, w in enumerate(scenario.waypoints)
    ]
    moves = [
        passed or (target is not None and (i in unknown_speeds or bool(target.velocity.any())))
        for i, (passed, target) in enumerate(zip(passes, targets, strict=True))
    ]
    rules = []
    for i, duration in enumerate(scenario.durations.tolist()):
        # Where the tool passes at speed, a change of branch would move it off its path.
        keeps = scenario.branch == "keep" or passes[i] or passes[i + 1]
        change: Literal["allowed", "avoided", "forbidden"] = "avoided" if keeps else "allowed"
        start, end = unknowns.at_waypoints[i : i + 2] if unknowns else 2 * (WaypointUnknowns(),)
        has_given_speeds = start.velocity_kind == end.velocity_kind == "given"
        rests = end.duration_is_unknown and end.way is None
        rules.append(
            StepRules(
                duration,
                branch_change="forbidden" if scenario.branch == "fixed" else change,
                is_timed=has_given_speeds and end.duration_is_given,
                rest_to_rest=rests and not (moves[i] or moves[i + 1]),
                blocked_steps=tuple(
                    BlockedStep(q_start, q_end, tolerance)
                    for interval, q_start, q_end in blocked_steps
                    if interval == i
                ),
            )
        )
    return rules


def _blocked_distance(chains: FreedomChains) -> FloatArray:
    """Distance to a blocked step within which a step is blocked too [rad or m], shape (d,).

    It is infinite for virtual joints, and for the last joint if the turn about it is free.
    """
    robot, dof = chains.arm_with_freedoms, chains.arm.dof
    if not robot.is_redundant:
        return np.full(robot.dof, STEP_TOLERANCE)
    distance = np.where(robot.is_virtual, np.inf, COLLISION_DISTANCE)
    if any(joint.axis == "z" for joint in robot.virtual_joints):
        distance[dof - 1] = np.inf
    return distance
