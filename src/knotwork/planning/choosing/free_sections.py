"""The free sections of a scenario, each between known states, and their timing problems."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from knotwork.arrays import FloatArray, IndexArray
from knotwork.errors import InputError, TimingError
from knotwork.joint_quantities import JointLimits
from knotwork.planning.task_to_joint import TaskSolution, knots_of, solve_task
from knotwork.planning.timing import Objective, TimingProblem
from knotwork.task import ClearWay
from knotwork.task.scenario import FreeValues, FreeWaypoint, Scenario
from knotwork.task.scenario.scenario_joints import ScenarioJoints, read_scenario_joints
from knotwork.waypoints import JointWaypoints

if TYPE_CHECKING:
    from knotwork.planning.timing import Dynamics
    from knotwork.robot import Robot
    from knotwork.scene.collision_model import CollisionModel

MIN_RAMP_TIME = 0.01
"""Minimum time from zero to the maximum acceleration if there is no jerk limit [s]."""

MAX_JERK = 2e4
"""Maximum assumed jerk [rad/s³ or m/s³]."""


@dataclass(frozen=True, eq=False)
class FreeTask:
    """A scenario with free values, its joints and the IK solutions of its poses.

    Timing problems need joint positions, loads and bodies, which the scenario alone does not have.

    Attributes:
        scenario: The scenario.
        free_values: Its free values.
        joints: Its joints.
        solution: Its waypoints at the joints, free times as expected.
    """

    scenario: Scenario
    free_values: FreeValues
    joints: ScenarioJoints
    solution: TaskSolution

    @classmethod
    def solve(cls, scenario: Scenario, free_values: FreeValues) -> FreeTask:
        """A scenario with its joints and the best solutions of its poses."""
        joints = read_scenario_joints(scenario)
        return cls(scenario, free_values, joints, solve_task(scenario, joints, knots_of(scenario)))

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

        loaded_robots = self.joints.loaded_robots
        robots = () if loaded_robots is None else loaded_robots.by_interval
        models = {id(robot): Dynamics(robot) for robot in robots}
        return tuple(models[id(robot)] for robot in robots)

    def dynamics(self, i: int) -> Dynamics | None:
        """Dynamics of its robot, if there is one, with the load from waypoint i on."""
        return self._dynamics[i] if self._dynamics else None

    @cached_property
    def zero_acceleration_points(self) -> Mapping[int, str]:
        """Reason for each waypoint with zero acceleration, by index.

        Sections are split there. Two collision-free motions are one if only a position is given
        between them.
        """
        waypoints = self.free_values.waypoints
        loads = enumerate(pairwise(self._dynamics), start=1)
        points = {i: "the load changes" for i, (before, after) in loads if before is not after}
        return points | {
            i: "a collision-free motion begins or ends"
            for end, free in enumerate(waypoints)
            if free.way
            for i in (end - 1, end)
            if not (
                waypoints[i].speed_kind == "free"
                and waypoints[i].way == waypoints[i + 1].way
                and all(w.duration_is_free and not w.min_duration for w in waypoints[i : i + 2])
            )
        }

    def bodies_in_interval(self, i: int) -> CollisionModel:
        """Bodies of the robot and the scene that are present from waypoint i to the next one."""
        from knotwork.planning.clear_motions.configuration_space import bodies_at

        return bodies_at(self._collision_model, i + 0.5)

    @cached_property
    def _collision_model(self) -> CollisionModel:
        """Bodies of the robot and the scene; the index of a waypoint replaces its unknown time."""
        from knotwork.planning.task_to_joint.candidate_collisions import unsolved_collision_model

        if self.joints.robot is None:
            raise TypeError("without a robot there are no bodies")
        times = np.arange(len(self.scenario.waypoints), dtype=float)
        return unsolved_collision_model(self.scenario, self.joints, self.joints.robot, times)

    def where(self, i: int, *key: str) -> str:
        """Location of a key of waypoint i of the scenario, for messages."""
        k = self.scenario.task_index[i]
        location: tuple[str | int, ...] = ("waypoints", k) if k >= 0 else ("start",)
        return self.scenario.where(*location, *key)


@dataclass(frozen=True, eq=False)
class FreeSection:
    """Consecutive waypoints whose free values are chosen together, and apart from all others.

    There is no tool path or wait between them.

    Attributes:
        free_task: The scenario and its IK solutions.
        waypoints: Their indices in the scenario.
    """

    free_task: FreeTask
    waypoints: range

    @property
    def rows(self) -> IndexArray:
        """Rows of the waypoints in the joint waypoints of the scenario, shape (n,)."""
        return self.free_task.rows[self.waypoints]

    @property
    def free(self) -> tuple[FreeWaypoint, ...]:
        """The free values at each waypoint, and on the way to it from the one before."""
        return self.free_task.free_values.waypoints[self.waypoints[0] : self.waypoints[-1] + 1]

    @property
    def way(self) -> ClearWay | None:
        """Options of a collision-free motion, or `None`."""
        return self.free[-1].way

    @property
    def has_free_durations(self) -> bool:
        """Whether any time between the waypoints is free."""
        return any(free.duration_is_free for free in self.free[1:])

    @property
    def has_free_values(self) -> bool:
        """Whether anything is chosen between the waypoints or at them."""
        ends = {self.waypoints[0], self.waypoints[-1]}
        return bool(
            self.free_task.zero_acceleration_points.keys() & ends
            or self.free_task.free_values.knots_are_free
            or self.has_free_durations
            or any(free.speed_kind != "given" for free in self.free)
        )

    def add_locations(self, errors: Iterable[TimingError]) -> None:
        """Add locations in the file, and indices in the scenario, to errors of timing."""
        for error in errors:
            error.where = self.free_task.scenario.name
            if error.waypoint_index is not None:
                error.waypoint_index = self.waypoints[error.waypoint_index]
                error.where = self.free_task.where(error.waypoint_index + error.in_interval)

    def timing_problem(self, objective: Objective, total: float | None = None) -> TimingProblem:
        """Make the timing problem from given and free values.

        Args:
            objective: Objective to minimise.
            total: Duration of the section [s], or `None`.

        Raises:
            InputError: A joint has neither an acceleration nor an effort limit.
        """
        free_task = self.free_task
        joints, waypoints, scenario = free_task.joints, free_task.waypoints, free_task.scenario
        velocity = waypoints.velocity[self.rows].copy()
        velocity[[free.speed_kind == "free" for free in self.free]] = np.nan
        limits = replace(joints.limits, jerk=jerk_limits(joints))
        if joints.robot is None:  # no dynamics are known
            limits = replace(limits, effort=np.full(len(joints.joint_names), np.inf))
        tool_speed = scenario.motion_limits.tool_speed or np.inf
        if self.has_free_durations and total is None:
            _check_limits(scenario, joints, limits)
        effort = bool(np.isfinite(limits.effort).any() or objective.effort)
        needs_dynamics = effort or np.isfinite(tool_speed)
        dynamics = free_task.dynamics(self.waypoints[0]) if needs_dynamics else None
        if needs_dynamics and dynamics is None and joints.robot is not None:
            raise _moving_base_error(scenario, joints.robot)
        return TimingProblem(
            joints.joint_names,
            waypoints.position[self.rows],
            velocity,
            limits,
            names=tuple(waypoints.names[row] for row in self.rows),
            joint_units=joints.joint_units,
            is_direction=np.array([free.speed_kind == "direction" for free in self.free]),
            max_factor=np.array([free.max_speed for free in self.free]),
            acceleration=self._accelerations(),
            duration=scenario.durations[self.waypoints[:-1]],
            at_least=np.array([free.min_duration for free in self.free[1:]]),
            total=total,
            tool_speed=tool_speed,
            objective=objective,
            dynamics=dynamics,
            units=scenario.units,
        )

    def _accelerations(self) -> FloatArray:
        """Accelerations at the waypoints, NaN where free, shape (n, d).

        At the ends of the motion they are as given. Otherwise they are zero there if times are
        chosen, and free if only knots are. They are zero where a collision-free motion begins or
        ends.
        """
        free_task, rows = self.free_task, self.rows
        joints, waypoints = free_task.joints, free_task.waypoints
        accelerations = np.full((len(rows), len(joints.joint_names)), np.nan)
        for end, last in ((0, 0), (-1, len(waypoints.time) - 1)):
            row, given = rows[end], waypoints.acceleration
            if given is not None and not np.isnan(given[row]).any():
                accelerations[end] = given[row]
            elif row == last and joints.end_acceleration is not None:
                accelerations[end] = joints.end_acceleration[end]
            elif self.waypoints[end] in free_task.zero_acceleration_points or (
                row == last and free_task.free_values.has_free_durations
            ):
                accelerations[end] = 0.0
        return accelerations


def find_sections(free_task: FreeTask) -> list[FreeSection]:
    """Find the free sections of a scenario, in order of time.

    Raises:
        InputError: Two equal stops have no given time between them, or a free velocity is at a
            waypoint where the motion must be split.
    """
    scenario, free = free_task.scenario, free_task.free_values.waypoints
    closed = set(free_task.joints.waits)
    for i in closed:
        if free[i + 1].duration_is_free:
            names = (scenario.waypoints[k].name for k in (i, i + 1))
            raise InputError(
                f"{' and '.join(map(repr, names))} are the same stop, so the minimum time between "
                "them is zero; accepted: wait: seconds at the first of them, or after: seconds",
                where=free_task.where(i + 1),
            )
    ends = free_task.zero_acceleration_points
    for i, why in ends.items():
        if free[i].speed_kind != "given":
            accepted = "stop, or a velocity"
            if [bool(end.way) for end in free[i : i + 2]] == [True, True]:
                accepted += ", or velocity: free between ways of equal options without times"
            message = f"the velocity is chosen, but {why} here; accepted: {accepted}"
            raise InputError(message, where=free_task.where(i))
    closed.update(i for path in scenario.paths for i in range(path.first, path.last))
    last = len(scenario.waypoints) - 1
    sections: list[FreeSection] = []
    first = 0
    for i in range(last + 1):
        if i < last and i not in closed and i not in ends:
            continue
        section = FreeSection(free_task, range(first, i + 1))
        if i > first and section.has_free_values:
            sections.append(section)
        first = i + 1 if i in closed else i
    return sections


def jerk_limits(joints: ScenarioJoints) -> FloatArray:
    """Jerk limits [rad/s³ or m/s³]; without one, a bound that avoids jumps of the acceleration."""
    jerk, acceleration = joints.limits.jerk, joints.limits.acceleration
    ramped = np.where(np.isfinite(acceleration), acceleration / MIN_RAMP_TIME, MAX_JERK)
    return np.where(np.isfinite(jerk), jerk, np.minimum(ramped, MAX_JERK))


def assumed_jerk(joints: ScenarioJoints) -> dict[str, float]:
    """Jerk bounds of the joints without a limit [rad/s³ or m/s³]."""
    has_limit = np.isfinite(joints.limits.jerk)
    bounds = zip(joints.joint_names, has_limit, jerk_limits(joints), strict=True)
    return {name: float(bound) for name, has, bound in bounds if not has}


def _moving_base_error(scenario: Scenario, robot: Robot) -> InputError:
    """Make the error for what needs dynamics, unknown where joints move the frame of the poses."""
    key = ("limits", "tool_speed") if scenario.motion_limits.tool_speed else ("objective", "effort")
    return InputError(
        f"does not apply to chosen times here, because the frame of the poses is on "
        f"{robot.base_frame!r}, which moves; leave it out, or give the times",
        where=scenario.where(*key),
    )


def _check_limits(scenario: Scenario, joints: ScenarioJoints, limits: JointLimits) -> None:
    """Refuse a joint with unbounded acceleration."""
    bounded = np.isfinite(limits.acceleration)
    reason = "no acceleration limit is given"
    if joints.robot is not None:
        bounded |= np.isfinite(limits.effort)
        reason = "neither a limit of acceleration nor one of effort is known"
    unbounded = np.array(joints.joint_names)[~bounded]
    if unbounded.size:
        raise InputError(
            f"times are chosen, but no limit bounds the acceleration of {', '.join(unbounded)}: "
            f"{reason}; accepted: acceleration: {{joint: value, …}}, with values for this robot",
            where=scenario.where("limits"),
        )
