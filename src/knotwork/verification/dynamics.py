"""Joint efforts by inverse dynamics, and nearness to singularities, at sampled times."""

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
    samples = motion.samples
    states = zip(samples.q, samples.v, samples.a, strict=True)
    efforts = np.array([space.robot.torque(*state) for state in states])
    for i, worst in enumerate(np.abs(efforts).argmax(axis=0)):
        value = float(efforts[worst, i])
        limit = float(space.limits["effort"][i])
        yield limit_finding(
            space,
            i,
            "effort",
            value,
            float(np.copysign(limit, value)),
            limit - abs(value),
            float(samples.time[worst]),
            "sampled",
        )


def singularity(motion: Motion, scenario: Scenario, space: JointSpace) -> Iterator[Finding]:
    """Find where the motion comes nearest to a singularity of the arm; for information."""
    if space.robot is None or space.robot.tool_frame is None:
        return
    samples = motion.samples
    jacobians = np.array([space.robot.jacobian(q) for q in samples.q])
    values = np.linalg.svd(jacobians, compute_uv=False)[:, -1]
    nearest = int(values.argmin())
    value, time = float(values[nearest]), float(samples.time[nearest])
    yield Finding(
        group="Singularity",
        subject="tool",
        name="",
        quantity="smallest_singular_value",
        verdict="information",
        message=f"the smallest singular value of the tool Jacobian is {value:.4g} at {time:.6g} s "
        "(metres and radians mixed)",
        value=value,
        time=time,
        proof="sampled",
    )
