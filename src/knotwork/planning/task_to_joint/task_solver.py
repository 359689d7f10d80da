"""From a scenario to its waypoints at the joints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from knotwork.curves.interpolation.knots import KnotPlacement
from knotwork.errors import RobotError
from knotwork.planning.task_to_joint.complete_waypoints import complete_waypoints
from knotwork.planning.task_to_joint.task_solution import SequenceStep, TaskSolution
from knotwork.task.scenario import Scenario
from knotwork.task.scenario.scenario_joints import ScenarioJoints

if TYPE_CHECKING:
    from knotwork.robot import Robot


def solve_task(
    scenario: Scenario,
    joints: ScenarioJoints,
    knots: KnotPlacement = "paper",
    blocked_steps: Sequence[SequenceStep] = (),
    earlier: TaskSolution | None = None,
) -> TaskSolution:
    """Find the joint positions and velocities that meet each waypoint, over the whole sequence.

    Candidates are all solutions of all poses, including turns of ±2π within limits. The criteria,
    in strict order, are:

    1. velocity limits hold at the waypoints, in the mean of each interval and, if
       possible, halfway along cubics between the waypoints;
    2. changes of branch only where the tool is at rest;
    3. minimum joint travel relative to the velocity limits, with a weight of up to 3 near position
       limits and singularities; from rest to rest in a time that is chosen later, the minimum time
       of the slowest joint.

    With `near`, the distance from that configuration replaces the travel, and whole turns are
    ignored. `branch` restricts the candidates. If no sequence keeps the limits, the one with the
    smallest excess over the velocity limits is chosen.

    Args:
        scenario: The scenario.
        joints: The joints and the robot.
        knots: Knot placement of the motion along tool paths: see `ModifiedHermiteSpline`.
        blocked_steps: Steps that count as collisions, because their motion collided or none was
            found.
        earlier: A solution with other speeds along the paths, which are not followed again from the
            same start.

    Raises:
        UnreachablePoseError: No configuration reaches a pose.
        OutsideLimitsError: A pose is reached only with joints outside their limits.
        BranchError: No solution of a pose is in the requested branch.
        SingularityError: The chosen configuration does not allow the velocity at a waypoint.
        FollowingError: No solution can follow a tool path to its end.
        CollisionError: A static object touches the robot at its start.
        RobotError: The arm is not redundant, and no joint can be pulled to the middle.

    >>> from knotwork.task.scenario.scenario_joints import read_scenario_joints
    >>> scenario = kw.load_scenario("ur5_deburring")
    >>> solution = solve_task(scenario, read_scenario_joints(scenario))
    >>> solution.choices[0].waypoint, solution.choices[0].branch
    ('approach', 'shoulder left, elbow up, flip')
    """
    _check_pull(scenario, joints)
    if all(target is not None for target in joints.targets):
        return _solve_joint_targets(scenario, joints, knots)
    if joints.robot is None:
        raise TypeError("poses need a robot")
    return _solve_poses(scenario, joints, joints.robot, knots, blocked_steps, earlier)


def _solve_poses(
    scenario: Scenario,
    joints: ScenarioJoints,
    robot: Robot,
    knots: KnotPlacement,
    blocked_steps: Sequence[SequenceStep],
    earlier: TaskSolution | None,
) -> TaskSolution:
    """The solution if a waypoint is a pose."""
    from knotwork.planning.task_to_joint.free_poses import (
        FreedomChains,
        with_virtual_joints,
    )
    from knotwork.planning.task_to_joint.sequence_search import SequenceSearch
    from knotwork.planning.task_to_joint.solution_findings import (
        describe_choices,
        find_infeasibilities,
    )
    from knotwork.robot.kinematics.sequence.cost import CostLevel

    chains = FreedomChains(scenario, robot)
    extended = with_virtual_joints(scenario, joints, chains)
    earlier_tracks = earlier.tracks if earlier else {}
    search = SequenceSearch(scenario, extended, chains, blocked_steps, earlier_tracks)
    chosen = search.solve()
    infeasibilities = find_infeasibilities(search, chosen)
    waypoints, tracks = complete_waypoints(
        scenario, extended, chosen.positions, chosen.velocities, knots, chosen.tracks
    )
    solution = TaskSolution(
        waypoints,
        infeasibilities=infeasibilities,
        choices=describe_choices(search, chosen),
        sequence=None if infeasibilities else chosen.positions,  # all others are too fast as well
        collisions=int(chosen.cost[CostLevel.COLLISIONS]),
        tracks=tracks,
    )
    return _with_chosen_velocities(_without_virtual_joints(solution, joints), joints)


def _solve_joint_targets(
    scenario: Scenario, joints: ScenarioJoints, knots: KnotPlacement
) -> TaskSolution:
    """The solution if joint positions are given at all waypoints."""
    targets = [target for target in joints.targets if target is not None]
    positions = np.array([target.position for target in targets])
    velocities = np.array([target.velocity for target in targets])
    if joints.robot is not None and scenario.scene.has_bodies:
        from knotwork.planning.task_to_joint.candidate_collisions import CandidateCollisions

        if collisions := CandidateCollisions.for_scenario(scenario, joints, joints.robot):
            collisions.check_start(positions[0])
    waypoints, _ = complete_waypoints(scenario, joints, positions, velocities, knots, ())
    return _with_chosen_velocities(TaskSolution(waypoints), joints)


def _without_virtual_joints(solution: TaskSolution, joints: ScenarioJoints) -> TaskSolution:
    """The solution for the longer chain, reduced to the joints of the arm."""
    waypoints, d = solution.waypoints, len(joints.joint_names)
    if len(waypoints.joint_names) == d:
        return solution
    acceleration = waypoints.acceleration
    waypoints = replace(
        waypoints,
        joint_names=joints.joint_names,
        joint_units=joints.joint_units,
        position=waypoints.position[:, :d],
        velocity=waypoints.velocity[:, :d],
        acceleration=None if acceleration is None else acceleration[:, :d],
    )
    choices = tuple(
        replace(choice, turns={j: k for j, k in choice.turns.items() if j in joints.joint_names})
        for choice in solution.choices
    )
    return replace(solution, waypoints=waypoints, choices=choices)


def _with_chosen_velocities(solution: TaskSolution, joints: ScenarioJoints) -> TaskSolution:
    """The solution with the velocities that were chosen."""
    velocity = solution.waypoints.velocity.copy()
    for section in joints.chosen_sections or ():
        for i, values in section.velocity.items():
            velocity[solution.waypoints.waypoint_rows[i]] = values
    return replace(solution, waypoints=replace(solution.waypoints, velocity=velocity))


def _check_pull(scenario: Scenario, joints: ScenarioJoints) -> None:
    robot = joints.robot
    if scenario.task.pull_to_middle and robot is not None and not robot.is_redundant:
        raise RobotError(
            robot.name,
            f"with {robot.dof} joints the arm has no self-motion; leave out pull_to_middle, or use "
            "an arm of seven joints or more",
            where=scenario.where("pull_to_middle"),
        )
