"""The timing sections of a scenario, each between known states, and their timing problems."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from knotwork.arrays import FloatArray, IndexArray
from knotwork.errors import InputError, TimingError
from knotwork.errors.plain_text import quoted_waypoint
from knotwork.joint_quantities import JointLimits
from knotwork.planning.choosing.solved_scenario import SolvedScenario
from knotwork.planning.timing import Objective, TimingProblem
from knotwork.task import ClearWay
from knotwork.task.scenario import Scenario, WaypointUnknowns
from knotwork.task.scenario.scenario_joints import ScenarioJoints

if TYPE_CHECKING:
    from knotwork.robot import Robot

MIN_RAMP_TIME = 0.01
"""Minimum time from zero to the maximum acceleration if there is no jerk limit [s]."""

MAX_JERK = 2e4
"""Maximum assumed jerk [rad/s³ or m/s³]."""


@dataclass(frozen=True, eq=False)
class TimingSection:
    """Consecutive waypoints whose unknowns are chosen together, and apart from all others.

    There is no tool path or wait between them.

    Attributes:
        solved: The scenario and its IK solutions.
        indices: Indices of the waypoints in the scenario.
    """

    solved: SolvedScenario
    indices: range

    @property
    def rows(self) -> IndexArray:
        """Rows of the waypoints in the joint waypoints of the scenario, shape (n,)."""
        return self.solved.rows[self.indices]

    @property
    def waypoint_unknowns(self) -> tuple[WaypointUnknowns, ...]:
        """The unknowns at each waypoint, and on the way to it from the one before."""
        return self.solved.unknowns.at_waypoints[self.indices[0] : self.indices[-1] + 1]

    @property
    def way(self) -> ClearWay | None:
        """Options of a collision-free motion, or `None`."""
        return self.waypoint_unknowns[-1].way

    @property
    def has_unknown_durations(self) -> bool:
        """Whether any time between the waypoints is unknown."""
        return any(waypoint.duration_is_unknown for waypoint in self.waypoint_unknowns[1:])

    @property
    def has_unknowns(self) -> bool:
        """Whether anything is chosen between the waypoints or at them."""
        ends = {self.indices[0], self.indices[-1]}
        return bool(
            self.solved.split_reasons.keys() & ends
            or self.solved.unknowns.knots_are_unknown
            or self.has_unknown_durations
            or any(waypoint.velocity_kind != "given" for waypoint in self.waypoint_unknowns)
        )

    def located(self, errors: list[TimingError]) -> list[TimingError]:
        """Give errors of timing their locations in the file, and indices in the scenario."""
        for error in errors:
            error.where = self.solved.scenario.name
            if error.waypoint_index is not None:
                error.waypoint_index = self.indices[error.waypoint_index]
                # an interval is described in the file at the waypoint where it ends
                end = error.waypoint_index + (1 if error.in_interval else 0)
                error.where = self.solved.where(end)
        return errors

    def timing_problem(self, objective: Objective, total: float | None = None) -> TimingProblem:
        """Make the timing problem from given values and unknowns.

        Args:
            objective: Objective to minimise.
            total: Duration of the section [s], or `None`.

        Raises:
            InputError: A joint has neither an acceleration nor an effort limit.
        """
        solved = self.solved
        joints, waypoints, scenario = solved.joints, solved.joint_waypoints, solved.scenario
        velocity = waypoints.velocity[self.rows].copy()
        unknowns = self.waypoint_unknowns
        velocity[[waypoint.velocity_kind == "unknown" for waypoint in unknowns]] = np.nan
        limits = replace(joints.limits, jerk=jerk_limits(joints))
        if joints.robot is None:  # no dynamics are known
            limits = replace(limits, effort=np.full(len(joints.joint_names), np.inf))
        tool_speed = scenario.motion_limits.tool_speed or np.inf
        if self.has_unknown_durations and total is None:
            _check_limits(scenario, joints, limits)
        effort = bool(np.isfinite(limits.effort).any() or objective.effort)
        needs_dynamics = effort or np.isfinite(tool_speed)
        dynamics = solved.dynamics[self.indices[0]] if needs_dynamics else None
        if needs_dynamics and dynamics is None and joints.robot is not None:
            raise _moving_base_error(scenario, joints.robot)
        return TimingProblem(
            joints.joint_names,
            waypoints.position[self.rows],
            velocity,
            limits,
            names=tuple(waypoints.names[row] for row in self.rows),
            joint_units=joints.joint_units,
            is_direction=np.array([waypoint.velocity_kind == "direction" for waypoint in unknowns]),
            max_factor=np.array([waypoint.max_speed for waypoint in unknowns]),
            acceleration=self._accelerations(),
            duration=scenario.durations[self.indices[:-1]],
            min_duration=np.array([waypoint.min_duration for waypoint in unknowns[1:]]),
            total=total,
            tool_speed=tool_speed,
            objective=objective,
            dynamics=dynamics,
            units=scenario.units,
        )

    def _accelerations(self) -> FloatArray:
        """Accelerations at the waypoints, NaN where unknown, shape (n, d).

        At the ends of the motion they are as given. Otherwise they are zero there if times are
        chosen, and free if only knots are. They are zero where a collision-free motion begins or
        ends.
        """
        solved, rows = self.solved, self.rows
        joints, waypoints = solved.joints, solved.joint_waypoints
        accelerations = np.full((len(rows), len(joints.joint_names)), np.nan)
        for end, last in ((0, 0), (-1, len(waypoints.time) - 1)):
            row, given = rows[end], waypoints.acceleration
            if given is not None and not np.isnan(given[row]).any():
                accelerations[end] = given[row]
            elif row == last and joints.end_acceleration is not None:
                accelerations[end] = joints.end_acceleration[end]
            elif self.indices[end] in solved.split_reasons or (
                row == last and solved.unknowns.has_unknown_durations
            ):
                accelerations[end] = 0.0
        return accelerations


def find_sections(solved: SolvedScenario) -> list[TimingSection]:
    """Find the timing sections of a scenario, in order of time.

    Raises:
        InputError: Two equal stops have no given time between them, or an unknown velocity is at a
            waypoint where the motion must be split.
    """
    scenario, waypoint_unknowns = solved.scenario, solved.unknowns.at_waypoints
    not_planned = set(solved.joints.rest_intervals)
    for i in not_planned:
        if waypoint_unknowns[i + 1].duration_is_unknown:
            stops = (quoted_waypoint(scenario.waypoints[k].name) for k in (i, i + 1))
            raise InputError(
                f"{' and '.join(stops)} are the same stop, so the minimum time between "
                "them is zero; accepted: wait: seconds at the first of them, or after: seconds",
                where=solved.where(i + 1),
            )
    for i, reason in solved.split_reasons.items():
        if waypoint_unknowns[i].velocity_kind != "given":
            accepted = "stop, or a velocity"
            if [bool(end.way) for end in waypoint_unknowns[i : i + 2]] == [True, True]:
                accepted += ", or velocity: free between ways of equal options without times"
            message = f"the velocity is chosen, but {reason} here; accepted: {accepted}"
            raise InputError(message, where=solved.where(i))
    not_planned.update(i for path in scenario.paths for i in range(path.first, path.last))
    splits = {0, len(scenario.waypoints) - 1, *solved.split_reasons}
    splits |= not_planned | {i + 1 for i in not_planned}
    sections = [
        TimingSection(solved, range(first, last + 1))
        for first, last in pairwise(sorted(splits))
        if first not in not_planned
    ]
    return [section for section in sections if section.has_unknowns]


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
    # without tool speed, only the objective: effort limits are dropped where the base moves
    key = ("limits", "tool_speed") if scenario.motion_limits.tool_speed else ("objective", "effort")
    return InputError(
        f"does not apply to chosen times here, because the frame of the poses is on "
        f"{robot.base_frame!r}, which moves; leave it out, or give the times",
        where=scenario.where(*key),
    )


def _check_limits(scenario: Scenario, joints: ScenarioJoints, limits: JointLimits) -> None:
    """Refuse a joint with unbounded acceleration."""
    bounded = np.isfinite(limits.acceleration)
    quantity, values = "acceleration", ""
    if joints.robot is not None:
        bounded |= np.isfinite(limits.effort)
        quantity = "acceleration or effort"
        values = ", with values for this robot"
    unbounded = np.array(joints.joint_names)[~bounded]
    if unbounded.size:
        raise InputError(
            f"times are chosen, so each joint needs a limit of {quantity}, but none is known for "
            f"{', '.join(unbounded)}; accepted: acceleration: {{joint: value, …}}{values}",
            where=scenario.where("limits"),
        )
