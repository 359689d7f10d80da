"""Checks of efforts, speeds of tool and links, and singularities, by bounds over all time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from knotwork.joint_quantities import FRAME_ORDERS, rate_unit
from knotwork.task.scenario import Scenario
from knotwork.task.scenario.scenario_joints import ScenarioJoints
from knotwork.verification.finding import Findings, Group, Topic
from knotwork.verification.limits import (
    LIMIT_SLACK,
    SMALLEST_SINGULAR_VALUE,
    LimitedValue,
    explain_excess,
    infinite_derivatives,
    joint_finding,
    limit_finding,
    limit_slack,
)
from knotwork.verification.motion import Motion

if TYPE_CHECKING:
    from knotwork.verification.bounds import Bound

ALMOST_SINGULAR = 1e-3
"""Smallest singular value below which a motion is called almost singular if there is no limit."""


def check_tool_limits(motion: Motion, scenario: Scenario, joints: ScenarioJoints) -> Findings:
    """Compare speed and acceleration of the tool, and the speed of links, with their limits."""
    robot = joints.robot
    if robot is None:
        return
    from knotwork.verification.bounds import tool_acceleration_bound, tool_speed_bound

    for quantity, link, limit in scenario.motion_limits.frame_limits:
        order = FRAME_ORDERS[quantity]
        compute_bound = tool_speed_bound if order == 1 else tool_acceleration_bound
        allowed = limit + limit_slack(limit)
        bound = compute_bound(robot, motion.trajectory, frame=link or None, limit=allowed)
        worst = LimitedValue.from_bound(bound, limit)
        jumps = infinite_derivatives(motion.curve, 2) if order == 2 else {}
        if jumps:
            worst = LimitedValue(np.inf, min(jumps.values())[0], limit)
        topic = Topic(Group.TOOL_LIMITS, "link" if link else "tool", link)
        label = f"link {link!r}" if link else "tool"
        text = f"{label}: {quantity.partition('_')[2]}"
        finding = limit_finding(topic, quantity, text, worst, rate_unit("m", order), scenario.units)
        yield explain_excess(finding, order, scenario)


def check_singularity(motion: Motion, scenario: Scenario, joints: ScenarioJoints) -> Findings:
    """Find the smallest singular value over the motion, and compare it with its limit, if any."""
    if joints.robot is None or joints.robot.tool_frame is None:
        return
    from knotwork.verification.bounds import singular_value_bound

    limit = scenario.motion_limits.singular_value
    # relative to any limit, so that the allowed value stays positive
    allowed = None if limit is None else limit * (1.0 - LIMIT_SLACK)
    bound = singular_value_bound(joints.robot, motion.trajectory, limit=allowed)
    worst = LimitedValue.from_bound(bound, math.inf if limit is None else limit, -1.0)
    topic = Topic(Group.SINGULARITY, "tool")
    label = "tool: the smallest singular value (metres and radians mixed)"
    if limit is not None:
        yield limit_finding(
            topic, SMALLEST_SINGULAR_VALUE, label, worst, "", scenario.units, ok=bound.ok
        )
        return
    highlight = f"almost singular: smallest singular value {bound.value:.4g} at {bound.time:.3f} s"
    if bound.value >= ALMOST_SINGULAR:
        highlight = ""
    fact = f"{label} is {bound.value:.4g} at {bound.time:.6g} s"
    yield topic.finding(SMALLEST_SINGULAR_VALUE, fact, highlight=highlight, **worst.numbers)


def check_effort_limits(motion: Motion, scenario: Scenario, joints: ScenarioJoints) -> Findings:
    """Compare joint efforts, by inverse dynamics, with their limits."""
    if joints.loaded_robots is None:
        if joints.robot is not None and joints.robot.base_moves:
            name = joints.robot.base_frame
            message = f"efforts are not checked: the frame of the poses is on {name}, which moves"
            yield Topic(Group.MOTION).finding("efforts", message, "warning")
        return
    from knotwork.verification.bounds import effort_bound

    limits = joints.limits.effort
    # a jump of one joint's velocity is an impulse on all joints
    jumps = infinite_derivatives(motion.curve, 2)
    parts = [
        effort_bound(robot, part, limit=limits + limit_slack(limits))
        for robot, part in joints.loaded_robots.parts(motion.trajectory)
    ]
    for i, bounds in enumerate(zip(*parts, strict=True)):
        bound = _worst_bound(bounds)
        side = math.copysign(1.0, bound.value)
        jump = jumps.get(i, next(iter(jumps.values()), None))
        worst = LimitedValue.from_bound(bound, side * float(limits[i]), side)
        yield explain_excess(joint_finding(joints, i, "effort", worst, jump), None, scenario)


def _worst_bound(bounds: Sequence[Bound]) -> Bound:
    """The worst bound over all parts of a motion, among those that exceed the limit if any do."""
    decisive = [bound for bound in bounds if not bound.ok] or bounds
    return max(decisive, key=lambda bound: abs(bound.value))._replace(
        bound=max(abs(bound.bound) for bound in bounds),
        proved=all(bound.proved for bound in decisive),
    )
