"""Jumps of position, velocity and acceleration at the inner breaks, as measured."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from knotwork.joint_quantities import DERIVATIVES, rate_unit
from knotwork.joint_space import JointSpace
from knotwork.polynomial.jumps import measured_jumps
from knotwork.scenario import Scenario
from knotwork.verification.finding import Finding, judged
from knotwork.verification.motion import Motion

ORDERS = 3


def continuity(motion: Motion, scenario: Scenario, space: JointSpace) -> Iterator[Finding]:
    """Find the largest jump of position, velocity and acceleration, against what rounding makes.

    The scenario's `continuity` says up to which derivative a jump fails.
    """
    for order, quantity in enumerate(DERIVATIVES[:ORDERS]):
        sizes, allowed = measured_jumps(motion.curve, order)
        if not len(sizes):
            sizes = allowed = np.zeros((1, len(space.joint_names)))
        share = np.divide(sizes, allowed, out=np.zeros_like(sizes), where=allowed > 0)
        where, joint = divmod(int(share.argmax()), share.shape[1])
        name, unit = space.joint_names[joint], rate_unit(space.joint_units[joint], order)
        value, limit = float(sizes[where, joint]), float(allowed[where, joint])
        time = float(motion.curve.x[min(where + 1, len(motion.curve.x) - 1)])
        yield Finding(
            group="Continuity",
            subject="joint",
            name=name,
            quantity=f"{quantity}_jump",
            verdict=judged(value <= limit, required=order <= scenario.continuity),
            message=f"joint {name!r}: {quantity} jumps by {value:.3g} {unit} at {time:.6g} s",
            value=value,
            limit=limit,
            margin=limit - value,
            unit=unit,
            time=time,
        )
