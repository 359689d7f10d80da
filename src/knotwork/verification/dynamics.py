"""Joint efforts by inverse dynamics, and nearness to singularities, bounded over all time."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from knotwork.joint_space import JointSpace
from knotwork.scenario import Scenario
from knotwork.verification.finding import Finding
from knotwork.verification.limits import limit_finding
from knotwork.verification.motion import Motion


def effort_limits(motion: Motion, scenario: Scenario, space: JointSpace) -> Iterator[Finding]:
    """Compare joint torques and forces, by inverse dynamics, with their limits."""
    if space.robot is None:
        return
    from knotwork.verification.bounds import torque_bound

    limits = space.limits["effort"]
    for i, found in enumerate(torque_bound(space.robot, motion.trajectory, limit=limits)):
        beyond = found.excess if found.ok and found.proved else 0.0
        yield limit_finding(
            space,
            i,
            "effort",
            found.value,
            float(np.copysign(limits[i], found.value)),
            float(limits[i]) - abs(found.value) - beyond,
            found.time,
            "bounded" if found.proved else "sampled",
            found.excess if found.proved else 0.0,
        )


def singularity(motion: Motion, scenario: Scenario, space: JointSpace) -> Iterator[Finding]:
    """Find where the motion comes nearest to a singularity of the arm; for information."""
    if space.robot is None or space.robot.tool_frame is None:
        return
    from knotwork.verification.bounds import singular_value_bound

    found = singular_value_bound(space.robot, motion.trajectory)
    yield Finding(
        group="Singularity",
        subject="tool",
        name="",
        quantity="smallest_singular_value",
        verdict="information",
        message=f"the smallest singular value of the tool Jacobian is {found.value:.4g} at "
        f"{found.time:.6g} s (metres and radians mixed)",
        value=found.value,
        time=found.time,
        proof="bounded" if found.proved else "sampled",
        excess=found.excess if found.proved else 0.0,
    )
