"""The free segments of a scenario, each between known states, and their timing problems."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from knotwork.arrays import FloatArray, IndexArray
from knotwork.errors import InputError
from knotwork.joint_quantities import JointLimits
from knotwork.planning.task_to_joint import TaskSolution, knots_of, solve_task
from knotwork.planning.timing import Objective, TimingProblem
from knotwork.task import ClearWay
from knotwork.task.scenario import FreeValues, Scenario
from knotwork.task.scenario.joint_space import JointSpace, joint_space
from knotwork.waypoints import JointWaypoints

if TYPE_CHECKING:
    from knotwork.planning.timing import Dynamics
    from knotwork.scene.collision_model import CollisionModel

MIN_RAMP_TIME = 0.01
"""Minimum time from zero to the maximum acceleration if there is no jerk limit [s]."""

MAX_JERK = 2e4
"""Largest assumed jerk [rad/s³ or m/s³]."""


@dataclass(frozen=True, eq=False)
class SolvedTask:
    """A scenario with free values and the IK solutions of its poses: the input of choosing.

    Timing problems need joint positions, loads and bodies, which the scenario alone does not have.

    Attributes:
        scenario: The scenario.
        free_values: Its free values.
        space: Its joints.
        solution: Its waypoints at the joints, free times as expected.
    """

    scenario: Scenario
    free_values: FreeValues
    space: JointSpace
    solution: TaskSolution

    @classmethod
    def solve(
        cls, scenario: Scenario, free_values: FreeValues, solution: TaskSolution | None = None
    ) -> SolvedTask:
        """A scenario with its joints; its poses are solved unless their solution is given."""
        space = joint_space(scenario)
        solution = solution or solve_task(scenario, space, knots_of(scenario))
        return cls(scenario, free_values, space, solution)

    @property
    def waypoints(self) -> JointWaypoints:
        """All waypoints at the joints, including inserted ones along paths."""
        return self.solution.waypoints

    @property
    def rows(self) -> IndexArray:
        """Rows of the scenario's waypoints, shape (n,)."""
        return np.array(self.waypoints.waypoint_rows)

    @cached_property
    def _dynamics(self) -> tuple[Dynamics, ...]:
        """Dynamics from each waypoint to the next, one object for equal loads."""
        from knotwork.planning.timing import Dynamics

        loaded_robots = self.space.loaded_robots
        robots = () if loaded_robots is None else loaded_robots.by_interval
        models = {id(robot): Dynamics(robot) for robot in robots}
        return tuple(models[id(robot)] for robot in robots)

    def dynamics(self, i: int) -> Dynamics | None:
        """Dynamics of its robot, if there is one, with the load from waypoint i on."""
        return self._dynamics[i] if self._dynamics else None

    @cached_property
    def zero_acceleration_points(self) -> Mapping[int, str]:
        """Reason for each waypoint with zero acceleration, by index.

        Segments are split there. Two collision-free motions are one if only a position is given
        between them.
        """
        free = self.free_values
        unbounded = free.duration_is_free & (free.min_durations == 0.0)
        loads = enumerate(pairwise(self._dynamics), start=1)
        points = {i: "the load changes" for i, (before, after) in loads if before is not after}
        return points | {
            i: "a collision-free motion begins or ends"
            for end in free.way_options
            for i in (end - 1, end)
            if not (
                free.speed_kinds[i] == "free"
                and free.way_options.get(i) == free.way_options.get(i + 1)
                and unbounded[i - 1 : i + 1].all()
            )
        }

    @cached_property
    def collision_model(self) -> CollisionModel:
        """Bodies of the robot and the scene, in which the index of a waypoint is its time."""
        from knotwork.planning.task_to_joint.candidate_collisions import unsolved_collision_model

        if self.space.robot is None:
            raise TypeError("without a robot there are no bodies")
        times = np.arange(len(self.scenario.waypoints), dtype=float)
        return unsolved_collision_model(self.scenario, self.space, self.space.robot, times)

    def where(self, i: int, *key: str) -> str:
        """Location of a key of waypoint i of the scenario, for messages."""
        k = self.scenario.task_index[i]
        location: tuple[str | int, ...] = ("waypoints", k) if k >= 0 else ("start",)
        return self.scenario.where(*location, *key)


@dataclass(frozen=True, eq=False)
class FreeSegment:
    """Consecutive waypoints whose free values are chosen together, and apart from all others.

    There is no tool path or wait between them.

    Attributes:
        waypoints: Their indices in the scenario.
        rows: Their rows in its joint waypoints, shape (n,).
        way_options: Options of a collision-free motion, or `None`.
    """

    waypoints: range
    rows: IndexArray
    way_options: ClearWay | None = None


def find_segments(solved: SolvedTask) -> list[FreeSegment]:
    """Find the free segments of a scenario, in order of time.

    Raises:
        InputError: Two equal stops have no given time between them, or a free velocity is at a
            waypoint where the motion must be split.
    """
    scenario, free = solved.scenario, solved.free_values
    closed = set(solved.space.waits)
    for i in closed:
        if free.duration_is_free[i]:
            names = (scenario.waypoints[k].name for k in (i, i + 1))
            raise InputError(
                f"{' and '.join(map(repr, names))} are the same stop, so the minimum time between "
                "them is zero; accepted: wait: seconds at the first of them, or after: seconds",
                where=solved.where(i + 1),
            )
    ends = solved.zero_acceleration_points
    for i, why in ends.items():
        if free.speed_kinds[i] != "given":
            accepted = "stop, or a velocity"
            if i in free.way_options and i + 1 in free.way_options:
                accepted += ", or velocity: free between ways of equal options without times"
            message = f"the velocity is chosen, but {why} here; accepted: {accepted}"
            raise InputError(message, where=solved.where(i))
    closed.update(i for path in scenario.paths for i in range(path.first, path.last))
    last = len(scenario.waypoints) - 1
    segments: list[FreeSegment] = []
    first = 0
    for i in range(last + 1):
        if i < last and i not in closed and i not in ends:
            continue
        if i > first and _has_free_values(solved, first, i):
            rows = solved.rows[first : i + 1]
            segments.append(FreeSegment(range(first, i + 1), rows, free.way_options.get(i)))
        first = i + 1 if i in closed else i
    return segments


def _has_free_values(solved: SolvedTask, first: int, last: int) -> bool:
    """Whether anything is chosen between two waypoints."""
    free = solved.free_values
    return bool(
        solved.zero_acceleration_points.keys() & {first, last}
        or free.knots_are_free
        or free.duration_is_free[first:last].any()
        or any(kind != "given" for kind in free.speed_kinds[first : last + 1])
    )


def timing_problem(
    solved: SolvedTask, segment: FreeSegment, objective: Objective, total: float | None = None
) -> TimingProblem:
    """Make the timing problem of a segment from its given and free values.

    Args:
        solved: The scenario and its IK solutions.
        segment: The segment.
        objective: Objective to minimise.
        total: Duration of the segment [s], or `None`.

    Raises:
        InputError: A joint has neither an acceleration nor an effort limit.
    """
    free, space, waypoints = solved.free_values, solved.space, solved.waypoints
    rows = segment.rows
    intervals = slice(segment.waypoints[0], segment.waypoints[-1])
    velocity = waypoints.velocity[rows].copy()
    kinds = [free.speed_kinds[i] for i in segment.waypoints]
    velocity[[kind == "free" for kind in kinds]] = np.nan
    limits = replace(space.limits, jerk=jerk_limits(space))
    if space.robot is None:  # no dynamics are known
        limits = replace(limits, effort=np.full(len(space.joint_names), np.inf))
    tool_speed = solved.scenario.motion_limits.tool_speed or np.inf
    duration = solved.scenario.durations[intervals]
    if np.isnan(duration).any() and total is None:
        _check_limits(solved.scenario, space, limits)
    effort = bool(np.isfinite(limits.effort).any() or objective.effort)
    needs_dynamics = effort or np.isfinite(tool_speed)
    return TimingProblem(
        space.joint_names,
        waypoints.position[rows],
        velocity,
        limits,
        names=tuple(waypoints.names[row] for row in rows),
        joint_units=space.joint_units,
        along=np.array([kind == "along" for kind in kinds]),
        max_factor=free.max_speeds[list(segment.waypoints)],
        acceleration=_accelerations(solved, segment),
        duration=duration,
        at_least=free.min_durations[intervals],
        total=total,
        tool_speed=tool_speed,
        objective=objective,
        dynamics=solved.dynamics(segment.waypoints[0]) if needs_dynamics else None,
        units=solved.scenario.units,
    )


def jerk_limits(space: JointSpace) -> FloatArray:
    """Jerk limits [rad/s³ or m/s³]; without one, a bound that avoids jumps of the acceleration."""
    jerk, acceleration = space.limits["jerk"], space.limits["acceleration"]
    ramped = np.where(np.isfinite(acceleration), acceleration / MIN_RAMP_TIME, MAX_JERK)
    return np.where(np.isfinite(jerk), jerk, np.minimum(ramped, MAX_JERK))


def assumed_jerk(space: JointSpace) -> dict[str, float]:
    """Jerk bounds of the joints without a limit [rad/s³ or m/s³]."""
    has_limit = np.isfinite(space.limits["jerk"])
    bounds = zip(space.joint_names, has_limit, jerk_limits(space), strict=True)
    return {name: float(bound) for name, has, bound in bounds if not has}


def _accelerations(solved: SolvedTask, segment: FreeSegment) -> FloatArray:
    """Accelerations at the waypoints of a segment, NaN where free, shape (n, d).

    At the ends of the motion they are as given. Otherwise they are zero there if times are chosen,
    and free if only knots are. They are zero where a collision-free motion begins or ends.
    """
    space, waypoints, rows = solved.space, solved.waypoints, segment.rows
    accelerations = np.full((len(rows), len(space.joint_names)), np.nan)
    for end, last in ((0, 0), (-1, len(waypoints.time) - 1)):
        row, given = rows[end], waypoints.acceleration
        if given is not None and not np.isnan(given[row]).any():
            accelerations[end] = given[row]
        elif row == last and space.end_acceleration is not None:
            accelerations[end] = space.end_acceleration[end]
        elif segment.waypoints[end] in solved.zero_acceleration_points or (
            row == last and solved.free_values.duration_is_free.any()
        ):
            accelerations[end] = 0.0
    return accelerations


def _check_limits(scenario: Scenario, space: JointSpace, limits: JointLimits) -> None:
    """Refuse a joint with unbounded acceleration."""
    bounded, reason = np.isfinite(limits.acceleration), "no acceleration limit is given"
    if space.robot is not None:
        bounded |= np.isfinite(limits.effort)
        reason = "neither a limit of acceleration nor one of torque is known"
    unbounded = np.array(space.joint_names)[~bounded]
    if unbounded.size:
        raise InputError(
            f"times are chosen, but no limit bounds the acceleration of {', '.join(unbounded)}: "
            f"{reason}; accepted: acceleration: {{joint: value, …}}, with values for this robot",
            where=scenario.where("limits"),
        )
