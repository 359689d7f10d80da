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
    add_slack,
    bounded_value,
    joint_finding,
    jumps_below,
)

if TYPE_CHECKING:
    from knotwork.verification.bounds import Bound


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
    jumps = jumps_below(motion.curve, 2)  # a jump of one joint is an impulse on all
    parts = [
        torque_bound(robot, part, limit=add_slack(limits))
        for robot, part in space.carrying.parts(motion.trajectory)
    ]
    for i, bounds in enumerate(zip(*parts, strict=True)):
        bound = _worst_bound(bounds)
        worst, limit = bounded_value(bound), float(np.copysign(limits[i], bound.value))
        margin = abs(limit) - abs(worst.value) - (worst.excess if bound.ok else 0.0)
        jump = jumps.get(i, next(iter(jumps.values()), None))
        yield joint_finding(space, i, "effort", worst, limit, margin, jump)


def _worst_bound(bounds: Sequence[Bound]) -> Bound:
    """The worst bound over all parts of a motion. Parts that violate the limit have priority."""
    decisive = [bound for bound in bounds if not bound.ok] or bounds
    return max(decisive, key=lambda bound: abs(bound.value))._replace(
        bound=max(abs(bound.bound) for bound in bounds),
        proved=all(bound.proved for bound in decisive),
        evaluations=sum(bound.evaluations for bound in bounds),
    )
