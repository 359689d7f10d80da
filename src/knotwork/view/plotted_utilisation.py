"""Utilisation of each limit in the check over time, sampled."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cache, partial

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.joint_quantities import FRAME_ORDERS, JOINT_QUANTITIES
from knotwork.robot import Robot
from knotwork.robot.many_states import frame_rates
from knotwork.task.scenario.scenario_joints import ScenarioJoints
from knotwork.verification import Finding
from knotwork.verification.limits import (
    LIMIT_GROUPS,
    SMALLEST_SINGULAR_VALUE,
    limit_slack,
)
from knotwork.view.shown_motion import ShownMotion


def sample_utilisation(
    shown: ShownMotion, findings: Iterable[Finding], time: FloatArray
) -> Iterator[tuple[Finding, FloatArray]]:
    """Sample the utilisation of each limit. The sample nearest a finding's time has its value.

    Args:
        shown: The motion.
        findings: Findings of its check; those without a limit are ignored.
        time: Sample times, ascending [s], shape (n,).

    Yields:
        A finding, and the utilisation of its limit at each time, shape (n,). Above 1 the limit is
        exceeded. It is infinite at jumps and for a limit of 0.
    """
    curve = shown.curve
    joints = shown.joints
    states = [curve(time, k) for k in range(3)]
    of_joints = cache(partial(_joint_values, joints=joints, curve=curve, time=time))
    for finding in findings:
        maximum = np.inf if finding.utilisation is None and not finding.ok else finding.utilisation
        if finding.group not in LIMIT_GROUPS or finding.limit is None or maximum is None:
            continue
        lower = -np.inf
        upper = finding.limit
        if finding.subject == "joint" and finding.quantity in JOINT_QUANTITIES:
            i = joints.joint_names.index(finding.name)
            values = of_joints(finding.quantity)[:, i]
            lower, upper = _judged_sides(finding, i, joints)
        elif finding.quantity in FRAME_ORDERS:
            values = frame_values(
                shown.robot, finding.name, FRAME_ORDERS[finding.quantity], *states
            )
        elif finding.quantity == SMALLEST_SINGULAR_VALUE:
            values = smallest_singular_values(shown.robot, states[0])
            lower = finding.limit
            upper = np.inf
        else:  # a quantity of the user's own check is known at its time only
            values = np.zeros(time.shape)
            upper = np.inf
        larger = np.maximum(_utilisation(values, upper), _utilisation(-values, -lower))
        utilisation = np.minimum(larger, maximum)
        utilisation[... if finding.time is None else np.abs(time - finding.time).argmin()] = maximum
        yield finding, utilisation


def frame_values(
    robot: Robot, frame: str, order: int, q: FloatArray, v: FloatArray, a: FloatArray
) -> FloatArray:
    """Speed [m/s] or acceleration [m/s²] of a link's origin, or of the tool (""), shape (n,).

    Args:
        robot: The arm.
        frame: Name of the link.
        order: 1 for speeds, 2 for accelerations.
        q: Joint positions, shape (n, d).
        v: Joint velocities.
        a: Joint accelerations.
    """
    index = robot.link_index(frame) if frame else robot.require_tool()
    rates = frame_rates(robot.model, [(index, order)], q, v, a)
    return np.asarray(np.linalg.norm(rates[:, 0], axis=1))


def smallest_singular_values(robot: Robot, q: FloatArray) -> FloatArray:
    """The smallest singular value of the tool Jacobian, shape (n,), from q of shape (n, d)."""
    return np.array([np.linalg.svd(robot.jacobian(row), compute_uv=False)[-1] for row in q])


def _joint_values(
    quantity: str, joints: ScenarioJoints, curve: PiecewisePolynomial, time: FloatArray
) -> FloatArray:
    """Values of a quantity of all joints, shape (n, d); zero for efforts if the load is unknown."""
    order = JOINT_QUANTITIES[quantity].order
    if order is not None:
        return curve(time, order)
    if joints.loaded_robots is None:
        return np.zeros((len(time), len(joints.joint_names)))
    states = zip(time, curve(time), curve(time, 1), curve(time, 2), strict=True)
    return np.array([joints.loaded_robots.robot_at(when).effort(*state) for when, *state in states])


def _judged_sides(finding: Finding, joint: int, joints: ScenarioJoints) -> tuple[float, float]:
    """Lower and upper limit; for a range that is kept, only the limit of the finding."""
    lower, upper = (float(bounds[joint]) for bounds in joints.limits.bounds(finding.quantity))
    if JOINT_QUANTITIES[finding.quantity].limit != "range" or not finding.ok:
        return lower, upper
    return (lower, np.inf) if finding.limit == lower else (-np.inf, upper)


def _utilisation(values: FloatArray, upper: float) -> FloatArray:
    """Used fraction of an upper limit, as in findings."""
    if not np.isfinite(upper):
        return np.zeros(values.shape)
    if upper > 0.0:
        return np.maximum(values / upper, 0.0)
    beyond = np.where(values > upper + limit_slack(upper), np.inf, 0.0)
    return np.divide(upper, values, out=beyond, where=(values < 0.0) & (upper < 0.0))
