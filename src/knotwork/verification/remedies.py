"""Remedies for exceeded limits of joints or the tool, where they are certain."""

from __future__ import annotations

import math
from bisect import bisect_right

import numpy as np

from knotwork.joint_quantities import DERIVATIVES
from knotwork.scenario import Scenario
from knotwork.scenario.joint_space import JointSpace
from knotwork.spline.polynomial.least_durations import feasible_durations
from knotwork.units import rounded_up
from knotwork.verification.checked_motion import Motion, place_of_time
from knotwork.verification.finding import Finding

EASING = 1.05
"""Additional slowing of weaves and changes of speed, because they are only part of a motion."""
NEEDED_TIME_RATIO = 1.001
"""Minimum ratio of needed time to duration for a move that is reported as too short."""


def slower_remedy(use: float, order: int, scenario: Scenario) -> str:
    """Text of the factor of duration with which the motion keeps a limit on a derivative.

    In k times the duration, derivatives of this order fall by a factor of k to the order.

    Args:
        use: Value relative to the limit, above 1.
        order: Order of the derivative.
        scenario: The task of the motion.
    """
    paths = ", at less speed along tool paths" if scenario.paths else ""
    factor = rounded_up(use ** (1.0 / order), 3)
    return f"slowing the motion down by a factor of {factor:.4g} keeps it{paths}"


def joint_remedy(finding: Finding, motion: Motion, scenario: Scenario, space: JointSpace) -> str:
    """Remedy for a joint that exceeds a limit; empty if none is certain.

    Args:
        finding: The finding.
        motion: The motion.
        scenario: The task of the motion.
        space: The scenario's joints.
    """
    use, time = finding.use, finding.time
    if finding.ok or use is None or not math.isfinite(use) or time is None:
        return ""
    joint = space.joint_names.index(finding.name)
    if finding.quantity == "effort":
        remedies = _weight_share(finding, motion, space, joint), rounded_corner(time, scenario)
        return "; ".join(filter(None, remedies))
    order = DERIVATIVES.index(finding.quantity)
    if not order:
        return ""
    bends = order > 1
    return (
        (rounded_corner(time, scenario) if bends else "")
        or (_slower_ramp(time, use, order, scenario) if bends else "")
        or _slower_weave(time, use, order, scenario)
        or _move_too_short(time, motion, scenario, space, joint)
        or f"it is broken {place_of_time(scenario, time)}; {slower_remedy(use, order, scenario)}"
    )


def rounded_corner(time: float, scenario: Scenario) -> str:
    """Text of the blended corner of a tool path that is passed at a time; empty if none is.

    The acceleration in a blend falls with its length and grows with the square of the speed.
    """
    from knotwork.tool_paths import Blend

    for path in scenario.paths:
        timed = path.motion
        if not timed.start_time <= time <= timed.end_time:
            continue
        along, speed = float(timed.arc_length(time)), float(timed.speed(time))
        for start, curve in zip(timed.path.starts, timed.path.curves, strict=True):
            corner = float(start) + 0.5 * curve.length
            # the knots of the joints may lie next to the blend
            if isinstance(curve, Blend) and abs(along - corner) < curve.length:
                ends = [abs(float(timed.arc_length(part.end)) - corner) for part in path.stretches]
                waypoint = scenario.waypoints[path.first + 1 + ends.index(min(ends))]
                scale, length = scenario.shown_length
                return (
                    f"the tool passes the corner at {waypoint.name!r}, of blend "
                    f"{scale * curve.distance:.4g} {length}, at {scale * speed:.4g} {length}/s "
                    "then: a longer blend or less speed there bends the motion less"
                )
    return ""


def _slower_weave(time: float, use: float, order: int, scenario: Scenario) -> str:
    """Remedy for a weave that is active at a time; empty if none is."""
    for path in scenario.paths:
        for stretch in path.stretches:
            if stretch.weave is not None and stretch.start <= time <= stretch.end:
                frequency = stretch.weave.eased_frequency(EASING * use, order)
                slower = 1.0 / rounded_up(1.0 / frequency, 3)
                return f"a weave is active there; about frequency: {slower:.3g} Hz keeps it"
    return ""


def _slower_ramp(time: float, use: float, order: int, scenario: Scenario) -> str:
    """Remedy for a change of speed at a stop of a path; empty if there is none.

    With acceleration a along the path, derivatives of order k are proportional to a^(k - 1).
    """
    for path in scenario.paths:
        first, last = path.stretches[0].full_speed[0], path.stretches[-1].full_speed[1]
        ramps = (path.motion.start_time, first), (last, path.motion.end_time)
        for (begin, end), speed in zip(ramps, path.asked.ends, strict=True):
            if speed == 0.0 and begin <= time <= end:
                scale, length = scenario.shown_length
                a = scale * path.asked.acceleration
                less = 1.0 / rounded_up((EASING * use) ** (1.0 / (order - 1)) / a, 2)
                return (
                    f"the speed along the path changes there, by path: {{acceleration: {a:.4g}}} "
                    f"[{length}/s²]; about {less:.3g} keeps it"
                )
    return ""


def _move_too_short(
    time: float, motion: Motion, scenario: Scenario, space: JointSpace, joint: int
) -> str:
    """Text of a move's minimum time, if its ends alone need more time than it has."""
    i = min(max(bisect_right(scenario.times, time) - 1, 0), len(scenario.times) - 2)
    ends = np.clip(scenario.times[i : i + 2], motion.start_time, motion.end_time)
    duration = float(ends[1] - ends[0])
    if duration <= 0.0:
        return ""
    q, v = motion.curve(ends)[:, joint], motion.curve(ends, 1)[:, joint]
    V, A = (
        np.maximum(space.limits[kind][joint : joint + 1], np.finfo(float).tiny)
        for kind in ("velocity", "acceleration")
    )
    if np.abs(v).max() > V[0] or (np.isinf(V[0]) and np.isinf(A[0])):
        return ""
    least = float(feasible_durations(q[1:] - q[:1], v[:1], v[1:], V, A)[0][0])
    if not NEEDED_TIME_RATIO * duration < least < math.inf:
        return ""
    first, last = (scenario.waypoints[k].name for k in (i, i + 1))
    return f"the move from {first!r} to {last!r} needs at least {least:.4g} s, not {duration:.4g} s"


def _weight_share(finding: Finding, motion: Motion, space: JointSpace, joint: int) -> str:
    """Text of the weight's share of an effort, which slower motion does not reduce."""
    value, limit, time = finding.value, finding.limit, finding.time
    if space.carrying is None or not limit or value is None or time is None:
        return ""
    still = np.zeros(len(space.joint_names))
    robot = space.carrying.robot_at(time)
    weight = float(robot.torque(motion.curve(time), still, still)[joint])
    text = f"{weight:.4g} {finding.unit} of it is weight"
    if abs(weight) > abs(limit) and weight * value > 0.0:
        return f"{text}, so slower motion does not help: a lighter load or another posture would"
    return f"{text}, the rest falls with the square of the speed"
