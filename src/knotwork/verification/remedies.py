"""Remedies for exceeded limits of joints or the tool, where they are certain."""

from __future__ import annotations

import math
from bisect import bisect_right

import numpy as np

from knotwork.joint_quantities import DERIVATIVES
from knotwork.polynomial.least_durations import feasible_durations
from knotwork.scenario import Scenario, ScenarioPath, Stretch
from knotwork.scenario.joint_space import JointSpace
from knotwork.units import rounded_up
from knotwork.verification.finding import Finding
from knotwork.verification.motion import Motion, between

EASED = 1.05
"""Additional slowing of weaves and changes of speed, because they are only part of a motion."""
NEAR, LARGE = 0.05, 0.25
"""A weave is the cause if, within this fraction of its period, its derivative reaches this fraction
of its maximum."""
NOTABLE = 1.001
"""Minimum ratio of needed time to duration for a move that is reported as too short."""


def slower(use: float, order: int, scenario: Scenario) -> str:
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


def joint_remedy(found: Finding, motion: Motion, scenario: Scenario, space: JointSpace) -> str:
    """Remedy for a joint that exceeds a limit; empty if none is certain.

    Args:
        found: The finding.
        motion: The motion.
        scenario: The task of the motion.
        space: The scenario's joints.
    """
    use = found.use
    if found.ok or use is None or not math.isfinite(use) or found.time is None:
        return ""
    j = space.joint_names.index(found.name)
    if found.quantity == "effort":
        remedies = _weight(found, motion, space, j), rounded_corner(found.time, scenario)
        return "; ".join(filter(None, remedies))
    order = DERIVATIVES.index(found.quantity)
    if not order:
        return ""
    helps = (
        (rounded_corner(found.time, scenario) if order > 1 else "")
        or _woven(found.time, use, order, scenario)
        or (_change_of_speed(found.time, use, order, scenario) if order > 1 else "")
        or _move_too_short(found.time, motion, scenario, space, j)
    )
    if helps:
        return helps
    return f"it is broken {between(scenario, found.time)}; {slower(use, order, scenario)}"


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
            # the knots of the joints may lie next to the blend
            beyond = abs(along - float(start) - 0.5 * curve.length) / curve.length
            if isinstance(curve, Blend) and beyond < 1.0:
                corner = float(start) + 0.5 * curve.length
                ends = [abs(float(timed.arc_length(one.end)) - corner) for one in path.stretches]
                k = path.first + 1 + ends.index(min(ends))
                scale, length = scenario.shown_length
                return (
                    f"the tool passes the corner at {scenario.waypoints[k].name!r}, of blend "
                    f"{scale * curve.distance:.4g} {length}, at {scale * speed:.4g} {length}/s "
                    "then: a longer blend or less speed there bends the motion less"
                )
    return ""


def _woven(time: float, use: float, order: int, scenario: Scenario) -> str:
    """Remedy for a weave that is active at a time; empty if none is."""
    for path in scenario.paths:
        for one in path.stretches:
            if one.weave is not None and one.start <= time <= one.end:
                return _slower_weave(time, use, order, path, one, scenario)
    return ""


def _slower_weave(
    time: float, use: float, order: int, path: ScenarioPath, one: Stretch, scenario: Scenario
) -> str:
    added = path.motion.carrier
    if one.weave is None or added is None:
        return ""
    near = NEAR / one.weave.frequency
    there, whole = (
        np.linalg.norm(added.joints[-1].curve(np.linspace(*span, 4001), order), axis=1).max()
        for span in ((time - near, time + near), (one.start, one.end))
    )
    if there < LARGE * whole:  # the path begins or ends, or what comes before or after is to blame
        return ""
    frequency = one.weave.lower_frequency(EASED * use, order)
    text = f"frequency: {1.0 / rounded_up(1.0 / frequency, 3):.3g} Hz"
    return f"a weave is active there; about {text} keeps it"


def _change_of_speed(time: float, use: float, order: int, scenario: Scenario) -> str:
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
                less = 1.0 / rounded_up((EASED * use) ** (1.0 / (order - 1)) / a, 2)
                return (
                    f"the speed along the path changes there, by path: {{acceleration: {a:.4g}}} "
                    f"[{length}/s²]; about {less:.3g} keeps it"
                )
    return ""


def _move_too_short(
    time: float, motion: Motion, scenario: Scenario, space: JointSpace, j: int
) -> str:
    """Text of a move's minimum time, if its ends alone need more time than it has."""
    times = scenario.times
    i = min(max(bisect_right(times, time) - 1, 0), len(times) - 2)
    ends = np.clip(times[i : i + 2], motion.start_time, motion.end_time)
    duration = float(ends[1] - ends[0])
    if duration <= 0.0:
        return ""
    q, v = motion.curve(ends)[:, j], motion.curve(ends, 1)[:, j]
    limits = (space.limits[kind][j : j + 1] for kind in ("velocity", "acceleration"))
    V, A = (np.maximum(limit, np.finfo(float).tiny) for limit in limits)
    if np.abs(v).max() > V[0] or (np.isinf(V[0]) and np.isinf(A[0])):
        return ""
    least = float(feasible_durations(q[1:] - q[:1], v[:1], v[1:], V, A)[0][0])
    if not NOTABLE * duration < least < math.inf:
        return ""
    first, last = (scenario.waypoints[k].name for k in (i, i + 1))
    return f"the move from {first!r} to {last!r} needs at least {least:.4g} s, not {duration:.4g} s"


def _weight(found: Finding, motion: Motion, space: JointSpace, j: int) -> str:
    """Text of the weight's share of an effort, which slower motion does not reduce."""
    if space.carrying is None or not found.limit or found.value is None or found.time is None:
        return ""
    q, still = motion.curve(found.time), np.zeros(len(space.joint_names))
    weight = float(space.carrying.at(found.time).torque(q, still, still)[j])
    text = f"{weight:.4g} {found.unit} of it is weight"
    if abs(weight) > abs(found.limit) and weight * found.value > 0.0:
        return f"{text}, so slower motion does not help: a lighter load or another posture would"
    return f"{text}, the rest falls with the square of the speed"
