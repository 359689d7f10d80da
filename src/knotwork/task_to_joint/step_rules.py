"""Rules for the cost of steps between consecutive waypoints of a scenario."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from typing import Any

import numpy as np

from knotwork.kinematics.chain.joint_ranges import unbounded
from knotwork.kinematics.sequence.step_costs import SAME_STEP, CollidingStep, Rules
from knotwork.scenario import Scenario
from knotwork.task_to_joint.free_poses import Chains
from knotwork.task_to_joint.solution import Step
from knotwork.waypoints import CartesianWaypoint, FloatArray

# For a redundant arm, steps within this distance of a colliding step are avoided [rad or m].
COLLISION_DISTANCE = 0.3


def step_rules(
    scenario: Scenario,
    chains: Chains,
    speeds: Sequence[FloatArray | None],
    free_velocity: Collection[int],
    avoided: Iterable[Step],
) -> Rules:
    """Rules for the cost of steps.

    Args:
        scenario: The task.
        chains: The robot with the virtual joints of each pose.
        speeds: Joint velocities at each waypoint, `None` where a pose is given.
        free_velocity: Waypoints whose speed is chosen later, by index.
        avoided: Steps that count as collisions.
    """
    robot, free = chains.whole, scenario.free
    limit = robot.velocity_limit
    branch = scenario.branch if isinstance(scenario.branch, str) else "free"
    speed = np.where(np.isfinite(limit), limit, 1.0)
    moving = _passes_at_speed(scenario, free_velocity)
    return Rules(
        speed=np.where(robot.virtual, np.inf, speed),
        limit=limit,
        weights=robot.weights,
        unbounded=unbounded(robot) & ~robot.virtual,
        lower=np.where(robot.virtual, -np.inf, robot.lower_position_limit),
        upper=np.where(robot.virtual, np.inf, robot.upper_position_limit),
        avoided=branch == "keep" or moving,
        forbidden=branch == "fixed",
        untimed=None if free is None else free.untimed,
        resting=None if free is None else free.duration & _rest_to_rest(scenario, moving, speeds),
        ramp=np.where(robot.virtual, 0.0, speed / robot.limits["acceleration"]),
        colliding=tuple(CollidingStep(*step) for step in avoided),
        apart=_avoided_distance(chains),
    )


def _passes_at_speed(scenario: Scenario, free_velocity: Collection[int]) -> Any:
    """Whether each interval begins or ends at a waypoint passed at speed, shape (n - 1,).

    There a change of branch is avoided also with `branch: free`: it would move the tool off its
    path.
    """
    passes = np.array(
        [
            isinstance(w, CartesianWaypoint)
            and bool(i in free_velocity or w.linear.any() or w.angular.any())
            for i, w in enumerate(scenario.waypoints)
        ]
    )
    return passes[1:] | passes[:-1]


def _rest_to_rest(scenario: Scenario, moving: Any, speeds: Sequence[FloatArray | None]) -> Any:
    """Whether each interval is from rest to rest and not a collision-free motion."""
    free = scenario.free
    resting = ~moving
    for i, v in enumerate(speeds):
        if v is not None and (v.any() or (free is not None and free.speed[i] != "given")):
            resting[max(i - 1, 0) : i + 1] = False
    if free is not None:
        resting[[i - 1 for i in free.ways]] = False
    return resting


def _avoided_distance(chains: Chains) -> FloatArray:
    """Distance to a colliding step within which a step is avoided [rad or m], shape (d,).

    It is infinite for virtual joints, and for the last joint where the turn about it is free.
    """
    robot, dof = chains.whole, chains.arm.dof
    if robot.dof <= 6:
        return np.full(robot.dof, SAME_STEP)
    apart = np.where(robot.virtual, np.inf, COLLISION_DISTANCE)
    if any(one.axis == "z" for one in robot.virtual_joints):
        apart[dof - 1] = np.inf
    return apart
