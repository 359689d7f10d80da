"""Joint efforts by inverse dynamics, bounded over all time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from knotwork.scenario import Scenario
from knotwork.scenario.joint_space import JointSpace
from knotwork.verification.checked_motion import Motion
from knotwork.verification.finding import Finding
from knotwork.verification.limits import (
    Reached,
    bounded,
    limit_finding,
    velocity_jumps,
    with_slack,
)
from knotwork.verification.remedies import joint_remedy

if TYPE_CHECKING:
    from knotwork.verification.bounds import Bound

NO_IMPULSE = 1e-9
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
    infinite = _impulses(motion, space)
    parts = [
        torque_bound(robot, part, limit=with_slack(limits))
        for robot, part in space.carrying.parts(motion.trajectory)
    ]
    for i, found in enumerate(map(_worst, zip(*parts, strict=True))):
        reached, limit = bounded(found), float(np.copysign(limits[i], found.value))
        if i in infinite and np.isfinite(limit):
            time, sign = infinite[i]
            reached, limit = Reached(sign * np.inf, time), sign * float(limits[i])
        margin = abs(limit) - abs(reached.value) - (reached.excess if found.ok else 0.0)
        finding = limit_finding(space, i, "effort", reached, limit, margin)
        yield finding.with_remedy(joint_remedy(finding, motion, scenario, space))


def _worst(parts: Sequence[Bound]) -> Bound:
    """The worst bound over all parts of a motion; parts that violate the limit come first."""
    failed = [one for one in parts if not one.ok]
    worst = max(failed or parts, key=lambda one: abs(one.value))
    return worst._replace(
        bound=max(abs(one.bound) for one in parts),
        proved=all(one.proved for one in failed or parts),
        evaluations=sum(one.evaluations for one in parts),
    )


def _impulses(motion: Motion, space: JointSpace) -> dict[int, tuple[float, float]]:
    """Joints with an impulse at a jump of velocities: first time [s] and direction."""
    found: dict[int, tuple[float, float]] = {}
    still = np.zeros(len(space.joint_names))
    if space.carrying is None:
        return found
    for time, q, jump in velocity_jumps(motion.curve):
        robot = space.carrying.at(time)
        impulse = robot.torque(q, still, jump) - robot.torque(q, still, still)
        for i in np.flatnonzero(np.abs(impulse) > NO_IMPULSE * np.abs(impulse).max()):
            found.setdefault(int(i), (time, float(np.sign(impulse[i]))))
    return found
