"""From a scenario to its waypoints at the joints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from knotwork.errors import OutOfReachError, RobotError, UnknownNameError
from knotwork.scenario import Scenario
from knotwork.scenario.joint_space import JointSpace
from knotwork.task_to_joint.inserted import completed_waypoints
from knotwork.task_to_joint.solution import Step, TaskSolution
from knotwork.waypoints import FloatArray

if TYPE_CHECKING:
    from knotwork.task_to_joint.search import Search


def solve_task(
    scenario: Scenario,
    space: JointSpace,
    knots: Any = "paper",
    avoided: Sequence[Step] = (),
) -> TaskSolution:
    """Find the joint positions and velocities that meet each waypoint, over the whole sequence.

    Among all solutions of all poses, turns of ±2π within limits included, the sequence is chosen

    1. that is feasible: within the velocity limits at the waypoints, in the mean of each interval
       and, if possible, halfway along cubics between the waypoints;
    2. then, that changes its branch, if at all, where the tool rests;
    3. then, with minimum joint travel relative to the velocity limits, weighted up to threefold
       near position limits and singularities; from rest to rest in a time that is chosen later,
       with the shortest time of the slowest joint.

    With `near` the nearest sequence to that replaces minimum travel, whole turns aside. `branch`
    restricts the candidates. Where nothing is feasible, the sequence with the smallest excess over
    the velocity limits is chosen. Samples of a redundant arm's self-motion are refined later.

    Args:
        scenario: The task.
        space: The joints and the robot.
        knots: Knot placement of the motion along tool paths: see `ModifiedHermiteSpline`.
        avoided: Steps that count as collisions, because a motion with them collided.

    Raises:
        UnreachablePoseError: No configuration reaches a pose.
        OutsideLimitsError: A pose is reached only with joints outside their limits.
        BranchError: No solution of a pose is in the branch asked for.
        SingularityError: The arm can't move as asked at a waypoint.
        RobotError: The arm is not redundant, and no joint can be pulled to the middle.
        DocumentError: Joint values name a joint or configuration that does not exist.

    >>> from knotwork.scenario.joint_space import joint_space
    >>> scenario = kw.load_scenario("ur5_deburring")
    >>> solution = solve_task(scenario, joint_space(scenario))
    >>> solution.choices[0].waypoint, solution.choices[0].branch
    ('approach', 'shoulder left, elbow up, flip')
    """
    given = [state.position if state is not None else None for state in space.targets]
    speeds = [state.velocity if state is not None else None for state in space.targets]
    _check_pull(scenario, space)
    if all(q is not None for q in given):
        return _as_given(scenario, space, np.array(given, float), np.array(speeds, float), knots)
    if space.robot is None:
        first = next(w for w, q in zip(scenario.waypoints, given, strict=True) if q is None)
        raise UnknownNameError("robot", "", (), where=first.where)
    from knotwork.task_to_joint.free_poses import (
        Chains,
        with_virtual_joints,
        without_virtual_joints,
    )
    from knotwork.task_to_joint.search import Search

    chains = Chains(scenario, space.robot)
    pad_virtual = with_virtual_joints(scenario, space, chains)
    solution = _best(Search(scenario, pad_virtual, chains, avoided), knots)
    return _with_chosen(without_virtual_joints(solution, space), space)


def _best(search: Search, knots: Any) -> TaskSolution:
    """The solution with the best sequence."""
    from knotwork.task_to_joint.explain import describe_choices, find_infeasibilities
    from knotwork.task_to_joint.unit_slips import suggest_unit

    try:
        search.find()
        found = search.solve()
    except OutOfReachError as error:
        suggest_unit(error, search.scenario, search.robot)
        raise
    infeasibilities = find_infeasibilities(search, found)
    # every other sequence is too fast, collides at a waypoint or takes a step that collided
    hopeless = bool(infeasibilities) or found.sequence.cost.collisions > 0.0
    values = found.positions, found.velocities
    return TaskSolution(
        completed_waypoints(
            search.scenario,
            search.space,
            *values,
            knots,
            search.dependent,
        ),
        infeasibilities,
        describe_choices(search, found),
        None if hopeless else found.positions,
        {
            path.first: search.dependent.start(path, found.positions[path.first])
            for path in search.scenario.paths
        },
    )


def _as_given(
    scenario: Scenario, space: JointSpace, positions: FloatArray, velocities: FloatArray, knots: Any
) -> TaskSolution:
    """The solution if joint positions are given at all waypoints."""
    if space.robot is not None and scenario.scene.asks():
        from knotwork.task_to_joint.obstacles import Obstacles

        Obstacles(scenario, space, space.robot).check_start(positions[0])
    waypoints = completed_waypoints(scenario, space, positions, velocities, knots)
    return _with_chosen(TaskSolution(waypoints), space)


def _with_chosen(solution: TaskSolution, space: JointSpace) -> TaskSolution:
    """The solution with the velocities that were chosen."""
    chosen = {name: v for run in space.chosen or () for name, v in run.velocity.items()}
    if not chosen:
        return solution
    velocity = solution.waypoints.velocity.copy()
    for name, own in chosen.items():
        velocity[solution.waypoints.names.index(name)] = own
    return replace(solution, waypoints=replace(solution.waypoints, velocity=velocity))


def _check_pull(scenario: Scenario, space: JointSpace) -> None:
    robot = space.robot
    if scenario.task.pull_to_middle and robot is not None and robot.dof <= 6:
        with scenario.error_context("pull_to_middle"):
            raise RobotError(
                robot.name,
                f"is not redundant: it has {robot.dof} joints; leave it out, or use an arm of "
                "seven joints or more",
            )
