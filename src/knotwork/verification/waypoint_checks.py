"""Checks of the motion at the times of waypoints and during waits."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.polynomial.splitting import cut_curve
from knotwork.errors.plain_text import quoted_waypoint, waypoint_text
from knotwork.joint_quantities import MOTION_QUANTITIES, rate_unit
from knotwork.task.scenario import Scenario
from knotwork.task.scenario.joint_reader import JointState
from knotwork.task.scenario.scenario_joints import ScenarioJoints
from knotwork.units import Units
from knotwork.verification.bounds.free_turn import turned_beyond
from knotwork.verification.finding import Finding, Findings, Group, Topic, verdict_on
from knotwork.verification.motion import Motion, time_slack
from knotwork.waypoints import CartesianWaypoint, PoseFreedom

if TYPE_CHECKING:
    from knotwork.task.scenario import ScenarioWaypoint

REST_TOLERANCE = 1e-9
"""Tolerance of positions [rad or m] and velocities [rad/s or m/s] at the start."""


class _ComparedValue(NamedTuple):
    """A requested and an achieved value at a waypoint, with the error."""

    quantity: str
    requested: FloatArray
    achieved: FloatArray
    error: float
    tolerance: float
    unit: str

    def finding(self, topic: Topic, time: float, units: Units) -> Finding:
        """Compare the error at a time [s] with its tolerance."""
        error = units.text(self.error, self.unit, ".3g")
        tolerance = units.text(self.tolerance, self.unit, ".3g")
        fact = (
            f"{waypoint_text(topic.name)} at {time:g} s: error of the "
            f"{self.quantity.replace('_', ' ')} {error}, tolerance {tolerance}"
        )
        finding = topic.at_most(
            self.quantity, fact, self.error, self.tolerance, self.unit, time=time
        )
        requested, achieved = (tuple(values.tolist()) for values in (self.requested, self.achieved))
        return replace(finding, requested=requested, achieved=achieved)


def check_time_span(motion: Motion, scenario: Scenario, joints: ScenarioJoints) -> Findings:
    """Check that the motion has the time span of its scenario."""
    slack = time_slack(motion.start_time, motion.end_time)
    first, last = scenario.waypoints[0].time, scenario.waypoints[-1].time
    same = abs(motion.start_time - first) <= slack and abs(motion.end_time - last) <= slack
    message = f"the trajectory runs from {motion.start_time:.12g} s to {motion.end_time:.12g} s"
    if not same:
        message += f", but the waypoints run from {first:.12g} s to {last:.12g} s"
    yield Topic(Group.MOTION).finding("time_span", message, verdict_on(same))


def report_no_start(motion: Motion, scenario: Scenario, joints: ScenarioJoints) -> Findings:
    """Report that the approach to the first waypoint is not planned, because no start is given."""
    if joints.robot is None or scenario.task.start is not None:
        return
    home = joints.robot.configurations.get("home")
    start = motion.curve(motion.start_time)
    if home is not None and np.abs(start - home).max() <= REST_TOLERANCE:
        return
    at_speed = np.any(np.abs(motion.curve(motion.start_time, 1)) > REST_TOLERANCE)
    cause = "the motion begins at speed" if at_speed else "the task gives no start"
    name = f"the approach to {quoted_waypoint(scenario.waypoints[0].name)}"
    fact = f"{name} is neither planned nor checked: {cause}"
    yield Topic(Group.NOT_PLANNED).finding("no_start", fact, highlight=f"{name}: {cause}")


def check_tool_at_waypoints(motion: Motion, scenario: Scenario, joints: ScenarioJoints) -> Findings:
    """Compare the tool's pose and velocity, by forward kinematics (eq 1), with the waypoints."""
    for i, time in _passing_times(motion, scenario).items():
        yield from _tool_findings(i, scenario.waypoints[i], time, motion, scenario, joints)


def check_joints_at_waypoints(
    motion: Motion, scenario: Scenario, joints: ScenarioJoints
) -> Findings:
    """Compare joint values with those that the waypoints and the two ends require.

    Where the tool must stop, all joints must stop, because self-motion would not move the tool.
    """
    passed = _passing_times(motion, scenario)
    times = np.array([*passed.values()])
    achieved = [motion.curve(times, order) for order in (0, 1)]  # all waypoints at once, for speed
    for row, (i, time) in enumerate(passed.items()):
        waypoint = scenario.waypoints[i]
        for order, requested in _required_joint_values(waypoint, joints.targets[i], joints):
            value = _compare_joints(order, requested, achieved[order][row], joints)
            yield value.finding(_joint_topic(waypoint), time, scenario.units)
    if joints.end_acceleration is not None:
        ends = (scenario.waypoints[0], scenario.waypoints[-1])
        end_times = (motion.start_time, motion.end_time)
        for end, time, requested in zip(ends, end_times, joints.end_acceleration, strict=True):
            value = _compare_joints(2, requested, motion.curve(time, 2), joints)
            yield value.finding(_joint_topic(end), time, scenario.units)


def _required_joint_values(
    waypoint: ScenarioWaypoint, state: JointState | None, joints: ScenarioJoints
) -> Iterator[tuple[int, FloatArray]]:
    """Required joint values at a waypoint, shape (d,), each with the order of its derivative."""
    if state is not None:
        yield from enumerate(state)
    elif isinstance(waypoint, CartesianWaypoint) and not waypoint.twist.vector.any():
        yield 1, np.zeros(len(joints.joint_names))


def _passing_times(motion: Motion, scenario: Scenario) -> dict[int, float]:
    """Times [s] of the waypoints within the motion's time, by index."""
    start, end = motion.start_time, motion.end_time
    slack = time_slack(start, end)
    return {
        i: min(max(waypoint.time, start), end)
        for i, waypoint in enumerate(scenario.waypoints)
        if start - slack <= waypoint.time <= end + slack
    }


def _tool_findings(
    i: int,
    waypoint: ScenarioWaypoint,
    time: float,
    motion: Motion,
    scenario: Scenario,
    joints: ScenarioJoints,
) -> Findings:
    """Compare the tool at a time [s] with waypoint i, if that is given by a pose."""
    if joints.robot is None or not isinstance(waypoint, CartesianWaypoint):
        return
    import pinocchio as pin

    # the velocity has the freedom of the path that starts there, if any
    from_there = (path.freedom for path in scenario.paths if path.first == i and path.freedom)
    velocity_freedom = next(from_there, waypoint.freedom)
    robot, columns = joints.robot.robot_and_columns(in_world_frame=waypoint.in_world_frame)
    q, v = motion.curve(time)[columns], motion.curve(time, 1)[columns]
    pose, twist = robot.forward(q), robot.twist(q, v)
    rotation, spin = waypoint.rotation, twist.angular
    offset = float(np.linalg.norm(pose.translation - waypoint.position))
    turn = float(np.linalg.norm(pin.log3(rotation.T @ pose.rotation)))
    if waypoint.freedom is not None:
        turn = _excess_rotation(waypoint.freedom, rotation, pose.rotation)
        shift = rotation.T @ (pose.translation - waypoint.position)
        offset = float(np.linalg.norm(shift - np.clip(shift, *np.transpose(waypoint.freedom.box))))
    if velocity_freedom is not None and velocity_freedom.tilt:
        spin = waypoint.angular  # a free tilt may have any speed
    elif velocity_freedom is not None and velocity_freedom.turn[0] < velocity_freedom.turn[1]:
        axis = pose.rotation[:, 2]
        spin = spin - axis * (axis @ (spin - waypoint.angular))
    speed = float(np.linalg.norm(twist.linear - waypoint.linear))
    rate = float(np.linalg.norm(spin - waypoint.angular))
    quaternion, reached = (np.array(pin.Quaternion(R).coeffs()) for R in (rotation, pose.rotation))
    reached = reached if quaternion @ reached >= 0 else -reached
    allowed = scenario.tolerances
    topic = Topic(Group.TOOL_AT_WAYPOINTS, "waypoint", waypoint.name)
    for value in (
        _ComparedValue(
            "position", waypoint.position, pose.translation, offset, allowed.position, "m"
        ),
        _ComparedValue("orientation", quaternion, reached, turn, allowed.orientation, "rad"),
        _ComparedValue(
            "linear_velocity", waypoint.linear, twist.linear, speed, allowed.linear_velocity, "m/s"
        ),
        _ComparedValue(
            "angular_velocity", waypoint.angular, spin, rate, allowed.angular_velocity, "rad/s"
        ),
    ):
        yield value.finding(topic, time, scenario.units)


def _excess_rotation(freedom: PoseFreedom, requested: FloatArray, reached: FloatArray) -> float:
    """Smallest rotation that brings a tool into its free ranges of tilt and turn [rad]."""
    R = requested.T @ reached
    tilt = float(np.arctan2(np.hypot(R[0, 2], R[1, 2]), R[2, 2]))
    tilt = max(tilt - freedom.tilt, 0.0)
    excess = max(float(turned_beyond(freedom, requested[None], reached[None])[0]), 0.0)
    # for a tilt and a turn about the axis: cos(φ/2) = cos(tilt/2) cos(turn/2)
    half = np.hypot(np.sin(tilt / 2.0), np.cos(tilt / 2.0) * np.sin(excess / 2.0))
    return float(2.0 * np.arcsin(min(half, 1.0)))


def _joint_topic(waypoint: ScenarioWaypoint) -> Topic:
    return Topic(Group.JOINTS_AT_WAYPOINTS, "waypoint", waypoint.name)


def _compare_joints(
    order: int, requested: FloatArray, achieved: FloatArray, joints: ScenarioJoints
) -> _ComparedValue:
    """Compare the values of all joints, by the largest error relative to its tolerance."""
    quantity = f"joint_{MOTION_QUANTITIES[order]}"
    tolerances = joints.tolerances[quantity]
    errors = np.abs(achieved - requested)
    worst = worst_joint(errors, tolerances)
    unit = rate_unit(joints.joint_units[worst], order)
    error, tolerance = float(errors[worst]), float(tolerances[worst])
    return _ComparedValue(quantity, requested, achieved, error, tolerance, unit)


def worst_joint(errors: FloatArray, tolerances: FloatArray) -> int:
    """Index of the joint with the largest error relative to its tolerance."""
    return int((errors / tolerances).argmax())


def check_waits(motion: Motion, scenario: Scenario, joints: ScenarioJoints) -> Findings:
    """Compare joint positions during each wait with those at its start, over all time."""
    tolerances = joints.tolerances["joint_position"]
    for i in joints.rest_intervals:
        waypoint = scenario.waypoints[i]
        start = max(waypoint.time, motion.start_time)
        end = min(scenario.waypoints[i + 1].time, motion.end_time)
        if end <= start:
            continue
        shifted = cut_curve(motion.curve, start, end)
        c = np.array(shifted.c)
        c[-1] -= motion.curve(start)
        extrema = PiecewisePolynomial(c, shifted.x).extrema()
        worst = worst_joint(extrema.peak, tolerances)
        distance, tolerance = float(extrema.peak[worst]), float(tolerances[worst])
        unit = joints.joint_units[worst]
        fact = (
            f"{waypoint_text(waypoint.name)}: largest movement in the wait from {start:.3f} s to "
            f"{end:.3f} s {scenario.units.text(distance, unit, '.3g')}, of "
            f"{joints.joint_names[worst]}, tolerance "
            f"{scenario.units.text(tolerance, unit, '.3g')}"
        )
        time = float(extrema.peak_time[worst])
        yield Topic(Group.WAITS, "wait", waypoint.name).at_most(
            "movement", fact, distance, tolerance, unit, time=time, interval=(start, end)
        )
