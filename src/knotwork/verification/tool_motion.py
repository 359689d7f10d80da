"""Limits on the motion of tool and links, and distance to singularities, bounded over all time."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from knotwork.joint_quantities import rate_unit
from knotwork.scenario import Scenario
from knotwork.scenario.joint_space import JointSpace
from knotwork.verification.checked_motion import Motion
from knotwork.verification.finding import Finding, judged
from knotwork.verification.limits import (
    LIMIT_SLACK,
    SINGULARITY,
    TOOL_LIMITS,
    Reached,
    bounded,
    in_words,
    kept,
    velocity_jumps,
    with_slack,
)
from knotwork.verification.remedies import slower

if TYPE_CHECKING:
    from knotwork.robot import Robot

ALMOST_SINGULAR = 1e-3
"""A smallest singular value below this is called almost singular if it has no limit."""

NO_JUMP = 1e-9
"""Rounding tolerance of jumps of the tool's velocity [m/s]."""


def tool_limits(motion: Motion, scenario: Scenario, space: JointSpace) -> Iterator[Finding]:
    """Compare speed and acceleration of the tool, and the speed of links, with their limits."""
    if space.robot is None:
        return
    limits = scenario.motion_limits
    rows = [
        ("tool_speed", None, 1, limits.tool_speed),
        ("tool_acceleration", None, 2, limits.tool_acceleration),
        *(("frame_speed", one.frame, 1, one.speed) for one in limits.frame_speeds),
    ]
    for quantity, frame, order, limit in rows:
        if limit is not None:
            yield _of_frame(motion, space.robot, quantity, frame, order, limit, scenario)


def _of_frame(
    motion: Motion,
    robot: Robot,
    quantity: str,
    frame: str | None,
    order: int,
    limit: float,
    scenario: Scenario,
) -> Finding:
    """Compare speed (order 1) or acceleration (order 2) of a link, or of the tool, with a limit."""
    from knotwork.verification.bounds import tool_acceleration_bound, tool_speed_bound

    bound = tool_speed_bound if order == 1 else tool_acceleration_bound
    found = bound(robot, motion.trajectory, frame=frame, limit=float(with_slack(limit)))
    jump = _tool_jump(motion, robot) if order == 2 else None
    reached = bounded(found) if jump is None else Reached(np.inf, jump)
    margin = limit - reached.value - (reached.excess if found.ok else 0.0)
    who = "tool" if frame is None else f"link {frame!r}"
    words, unit = quantity.partition("_")[2], rate_unit("m", order)
    finding = Finding(
        group=TOOL_LIMITS,
        subject="tool" if frame is None else "link",
        name=frame or "",
        quantity=quantity,
        verdict=judged(kept(margin, limit)),
        message=f"{who}: {words} {in_words(reached, limit, unit, scenario.units)}",
        limit=limit,
        margin=margin,
        unit=unit,
        **reached._asdict(),
    )
    if finding.ok or np.isinf(reached.value):
        return finding
    return finding.with_remedy(slower(reached.value / limit, order, scenario))


def _tool_jump(motion: Motion, robot: Robot) -> float | None:
    """The first time [s] at which the tool's velocity jumps."""
    for time, q, jump in velocity_jumps(motion.curve):
        if np.linalg.norm(robot.jacobian(q)[:3] @ jump) > NO_JUMP:
            return time
    return None


def singularity(motion: Motion, scenario: Scenario, space: JointSpace) -> Iterator[Finding]:
    """Find the smallest singular value of the motion, and compare it with its limit, if any."""
    if space.robot is None or space.robot.tool_frame is None:
        return
    from knotwork.verification.bounds import singular_value_bound

    limit = scenario.motion_limits.singular_value
    least = None if limit is None else limit * (1.0 - LIMIT_SLACK)
    found = singular_value_bound(space.robot, motion.trajectory, limit=least)
    reached = bounded(found)
    message, margin = f"is {found.value:.4g} at {found.time:.6g} s", None
    if limit is not None:
        message = in_words(reached, limit, "", scenario.units)
        margin = found.value - limit - (reached.excess if found.ok else 0.0)
    yield Finding(
        group=SINGULARITY,
        subject="tool",
        name="",
        quantity="smallest_singular_value",
        verdict=judged(found.ok, required=limit is not None),
        message=f"tool: the smallest singular value (metres and radians mixed) {message}",
        limit=limit,
        margin=margin,
        **reached._asdict(),
        brief=f"almost singular: smallest singular value {found.value:.4g} at {found.time:.3f} s"
        if limit is None and found.value < ALMOST_SINGULAR
        else "",
    )
