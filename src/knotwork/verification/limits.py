"""Joint limits over all time, from the exact extrema of the polynomials."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from knotwork.joint_quantities import DERIVATIVES, JOINT_QUANTITIES
from knotwork.joint_space import JointSpace
from knotwork.polynomial import PiecewisePolynomial
from knotwork.polynomial.jumps import measured_jumps
from knotwork.scenario import Scenario
from knotwork.verification.finding import Finding, Proof, judged
from knotwork.verification.motion import Motion

JOINT_LIMITS = "Joint limits"
# A limit counts as kept if the excess is within rounding, relative to the limit (or to 1 in SI).
LIMIT_SLACK = 1e-9


def joint_limits(motion: Motion, scenario: Scenario, space: JointSpace) -> Iterator[Finding]:
    """Check position, velocity, acceleration and jerk of each joint against their limits."""
    return derivative_limits(space, motion.curve)


def derivative_limits(space: JointSpace, curve: PiecewisePolynomial) -> Iterator[Finding]:
    """Compare exact extrema of position, velocity, acceleration and jerk with the limits.

    Args:
        space: The joints and their limits.
        curve: Joint positions, trailing shape (d,), joints in the order of `space`.
    """
    for order, quantity in enumerate(DERIVATIVES):
        extrema = curve.extrema(order)
        jumps = _jumps_below(curve, order)
        lower, upper = space.bounds(quantity)
        for i in range(len(space.joint_names)):
            low = (float(extrema.minimum[i]), float(extrema.minimum_time[i]), float(lower[i]))
            high = (float(extrema.maximum[i]), float(extrema.maximum_time[i]), float(upper[i]))
            below, above = low[0] - low[2], high[2] - high[0]
            if np.isinf(below) and np.isinf(above):
                at_low = quantity != "position" and abs(low[0]) > abs(high[0])
            else:
                at_low = below < above
            value, time, limit = low if at_low else high
            margin = below if at_low else above
            if i in jumps and np.isfinite(limit):
                time, sign = jumps[i]
                value, limit, margin = sign * np.inf, sign * float(upper[i]), -np.inf
            yield limit_finding(space, i, quantity, value, limit, margin, time)


def limit_finding(
    space: JointSpace,
    i: int,
    quantity: str,
    value: float,
    limit: float,
    margin: float,
    time: float,
    proof: Proof = "exact",
    excess: float = 0.0,
) -> Finding:
    """Say how the worst of one quantity of one joint stands to its limit.

    Args:
        space: The joints.
        i: Index of the joint.
        quantity: A name in `JOINT_QUANTITIES`.
        value: The value nearest to, or furthest beyond, its limit; infinite at a jump.
        limit: The limit with its sign on that side; infinite if none is given.
        margin: Distance left to it, negative beyond it.
        time: When [s].
        proof: How the value was found.
        excess: By how much the true value may lie beyond it.
    """
    joint = space.joint_names[i]
    unit = JOINT_QUANTITIES[quantity].units[space.joint_units[i]]
    given = bool(np.isfinite(limit))
    if not given:
        said = "has no limit given"
    elif np.isinf(value):
        said = f"is infinite at the jump at {time:.6g} s, limit {limit:.6g} {unit}"
    else:
        said = f"reaches {value:.6g} {unit} at {time:.6g} s, limit {limit:.6g} {unit}"
    return Finding(
        group=JOINT_LIMITS,
        subject="joint",
        name=joint,
        quantity=quantity,
        verdict=judged(margin >= -LIMIT_SLACK * max(1.0, abs(limit)), required=given),
        message=f"joint {joint!r}: {quantity} {said}",
        value=value,
        limit=limit if given else None,
        margin=margin if given else None,
        unit=unit,
        time=time,
        proof=proof,
        excess=excess,
    )


def _jumps_below(curve: PiecewisePolynomial, order: int) -> dict[int, tuple[float, float]]:
    """Joints whose derivative of one order less jumps, where and in which direction.

    A jump is made at once: the quantity itself is infinite there.
    """
    if order == 0:
        return {}
    signed = curve.jumps(order - 1)
    sizes, allowed = measured_jumps(curve, order - 1)
    excess = sizes - allowed
    found = {}
    for i in np.flatnonzero((excess > 0).any(axis=0)):
        k = int(excess[:, i].argmax())
        found[int(i)] = float(curve.x[k + 1]), float(np.sign(signed[k, i]))
    return found
