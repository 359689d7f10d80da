"""Joint efforts by inverse dynamics, bounded over all time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from knotwork.task.scenario import Scenario
from knotwork.task.scenario.joint_space import JointSpace
from knotwork.verification.checked_motion import Motion
from knotwork.verification.finding import Finding
from knotwork.verification.limits import (
    WorstValue,
    add_slack,
    bounded_value,
    joint_finding,
    velocity_jumps,
)

if TYPE_CHECKING:
    from knotwork.verification.bounds import Bound

SMALLEST_IMPULSE = 1e-9
"""Minimum relative impulse of a joint at a jump of velocities."""


def effort_limits(motion: Motion, scenario: Scenario, space: JointSpace) -> Iterator[Finding]:
    """Compare joint torques and forces, by inverse dynamics, with their limits."""
    if space.carrying is None:
        if space.robot is not None and space.robot.base_moves:
            name = space.robot.base_frame
            message = f"efforts are not judged, as {name}, which carries the poses, moves"
            yield Finding("Motion", "motion", "", "efforts", "warning", message)
        return
    from knotwork.verification.bounds import torque_bound

    limits = space.limits["effort"]
    jumps = _impulses(motion, space)
    parts = [
        torque_bound(robot, part, limit=add_slack(limits))
        for robot, part in space.carrying.parts(motion.trajectory)
    ]
    for i, bounds in enumerate(zip(*parts, strict=True)):
        bound = _worst_bound(bounds)
        worst, limit = bounded_value(bound), float(np.copysign(limits[i], bound.value))
        if i in jumps and np.isfinite(limit):
            time, sign = jumps[i]
            worst, limit = WorstValue(sign * np.inf, time), sign * float(limits[i])
        margin = abs(limit) - abs(worst.value) - (worst.excess if bound.ok else 0.0)
        yield joint_finding(space, i, "effort", worst, limit, margin)


def _worst_bound(bounds: Sequence[Bound]) -> Bound:
    """The worst bound over all parts of a motion. Parts that violate the limit have priority."""
    decisive = [bound for bound in bounds if not bound.ok] or bounds
    return max(decisive, key=lambda bound: abs(bound.value))._replace(
        bound=max(abs(bound.bound) for bound in bounds),
        proved=all(bound.proved for bound in decisive),
        evaluations=sum(bound.evaluations for bound in bounds),
    )


def _impulses(motion: Motion, space: JointSpace) -> dict[int, tuple[float, float]]:
    """Joints with an impulse at a jump of velocities: first time [s] and direction."""
    impulses: dict[int, tuple[float, float]] = {}
    still = np.zeros(len(space.joint_names))
    if space.carrying is None:
        return impulses
    for time, q, jump in velocity_jumps(motion.curve):
        robot = space.carrying.robot_at(time)
        impulse = robot.torque(q, still, jump) - robot.torque(q, still, still)
        for i in np.flatnonzero(np.abs(impulse) > SMALLEST_IMPULSE * np.abs(impulse).max()):
            impulses.setdefault(int(i), (time, float(np.sign(impulse[i]))))
    return impulses
