"""Limits on the motion of tool and links, and nearness to singularities, bounded over all time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from knotwork.joint_quantities import rate_unit
from knotwork.joint_space import JointSpace
from knotwork.scenario import Scenario
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
from knotwork.verification.motion import Motion
from knotwork.verification.remedies import slower

if TYPE_CHECKING:
    from knotwork.robot import Robot
    from knotwork.verification.bounds import Bound

ALMOST_SINGULAR = 1e-3
"""A singular value below this is called so where it has no limit of its own."""

NO_JUMP = 1e-9
"""A jump of the tool's velocity up to this [m/s] is rounding."""


def tool_limits(motion: Motion, scenario: Scenario, space: JointSpace) -> Iterator[Finding]:
    """Compare speed and acceleration of the tool, and the speed of links, with their limits."""
    if space.robot is None:
        return
    from knotwork.verification.bounds import tool_acceleration_bound, tool_speed_bound

    robot, limits = space.robot, scenario.motion_limits
    if limits.tool_speed is not None:
        limit = limits.tool_speed
        yield _of_frame(tool_speed_bound, motion, robot, limit, "tool_speed", 1, scenario)
    if limits.tool_acceleration is not None:
        limit, jump = limits.tool_acceleration, _tool_jump(motion, robot)
        found = _of_frame(
            tool_acceleration_bound, motion, robot, limit, "tool_acceleration", 2, scenario,
            jump=jump,
        )  # fmt: skip
        yield found
    for one in limits.frame_speeds:
        yield _of_frame(
            tool_speed_bound, motion, robot, one.speed, "frame_speed", 1, scenario,
            frame=one.frame,
        )  # fmt: skip


def _of_frame(
    bound: Callable[..., Bound],
    motion: Motion,
    robot: Robot,
    limit: float,
    quantity: str,
    order: int,
    scenario: Scenario,
    *,
    frame: str | None = None,
    jump: float | None = None,
) -> Finding:
    """Compare a quantity of a link, or of the tool, with its limit.

    Args:
        bound: Bounds the quantity.
        motion: The motion to check.
        robot: The arm.
        limit: In SI.
        quantity: Its name.
        order: Of its derivative of position.
        scenario: The task; messages are in its units.
        frame: Name of the link; by default the tool.
        jump: When it is infinite [s], if it is.
    """
    found = bound(robot, motion.trajectory, frame=frame, limit=float(with_slack(limit)))
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
        value=reached.value,
        limit=limit,
        margin=margin,
        unit=unit,
        time=reached.time,
        proof=reached.proof,
        excess=reached.excess,
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
    """Find where the motion comes nearest to a singularity of the arm, against a limit if any."""
    if space.robot is None or space.robot.tool_frame is None:
        return
    from knotwork.verification.bounds import singular_value_bound

    limit = scenario.motion_limits.singular_value
    least = None if limit is None else limit * (1.0 - LIMIT_SLACK)
    found = singular_value_bound(space.robot, motion.trajectory, limit=least)
    reached = bounded(found)
    message = (
        f"the smallest singular value of the tool Jacobian is {found.value:.4g} at "
        f"{found.time:.6g} s (metres and radians mixed)"
    )
    if limit is not None:
        message = (
            "tool: the smallest singular value (metres and radians mixed) "
            f"{in_words(reached, limit, '', scenario.units)}"
        )
    yield Finding(
        group=SINGULARITY,
        subject="tool",
        name="",
        quantity="smallest_singular_value",
        verdict=judged(found.ok, required=limit is not None),
        message=message,
        value=found.value,
        limit=limit,
        margin=None
        if limit is None
        else found.value - limit - (reached.excess if found.ok else 0.0),
        time=found.time,
        proof=reached.proof,
        excess=reached.excess,
        brief=f"almost singular: smallest singular value {found.value:.4g} at {found.time:.3f} s"
        if limit is None and found.value < ALMOST_SINGULAR
        else "",
    )
