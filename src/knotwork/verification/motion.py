"""Joint limits over all time from the exact extrema, and continuity as measured at the breaks."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from knotwork.joint_space import JointSpace
from knotwork.polynomial import PiecewisePolynomial
from knotwork.polynomial.jumps import CONTINUITY_TOLERANCE, measured_jumps
from knotwork.verification.report import Jump, LimitUse

QUANTITIES = ("position", "velocity", "acceleration", "jerk")
# A limit counts as kept if the excess is within rounding, relative to the limit (or to 1 in SI).
LIMIT_SLACK = 1e-9


def rate_unit(unit: str, order: int) -> str:
    """Unit of the derivative of some order, for example `rad/s²`."""
    return unit + ("", "/s", "/s²", "/s³")[order]


def limit_use(space: JointSpace, curve: PiecewisePolynomial) -> Iterator[LimitUse]:
    """Compare exact extrema of position, velocity, acceleration and jerk with the limits.

    Args:
        space: The joints and their limits.
        curve: Joint positions, trailing shape (d,), joints in the order of `space`.
    """
    for order, quantity in enumerate(QUANTITIES):
        extrema = curve.extrema(order)
        jumps = _jumps_below(curve, order)
        if quantity == "position":
            lower, upper = space.lower_position_limit, space.upper_position_limit
        else:
            upper = space.limits[quantity]
            lower = -upper
        for i, joint in enumerate(space.joint_names):
            low = (float(extrema.minimum[i]), float(extrema.minimum_time[i]), float(lower[i]))
            high = (float(extrema.maximum[i]), float(extrema.maximum_time[i]), float(upper[i]))
            below, above = low[0] - low[2], high[2] - high[0]
            if np.isinf(below) and np.isinf(above):
                at_low = quantity != "position" and abs(low[0]) > abs(high[0])
            else:
                at_low = below < above
            value, time, limit = low if at_low else high
            margin = below if at_low else above
            given = bool(np.isfinite(limit))
            if given and i in jumps:
                time, sign = jumps[i]
                value, limit, margin = sign * np.inf, sign * float(upper[i]), -np.inf
            yield LimitUse(
                joint,
                quantity,
                value,
                limit if given else None,
                margin if given else None,
                time,
                rate_unit(space.joint_units[i], order),
                False,
                margin >= -LIMIT_SLACK * max(1.0, abs(limit)) if given else True,
            )


def _jumps_below(curve: PiecewisePolynomial, order: int) -> dict[int, tuple[float, float]]:
    """Joints whose derivative of one order less jumps, where and in which direction.

    A jump is made at once: the quantity itself is infinite there.
    """
    if order == 0:
        return {}
    signed = curve.jumps(order - 1)
    _, relative = measured_jumps(curve, order - 1)
    found = {}
    for i in np.flatnonzero((relative > CONTINUITY_TOLERANCE).any(axis=0)):
        k = int(relative[:, i].argmax())
        found[int(i)] = float(curve.x[k + 1]), float(np.sign(signed[k, i]))
    return found


def continuity(
    space: JointSpace, curve: PiecewisePolynomial, required_order: int
) -> Iterator[Jump]:
    """Measure the jumps of position, velocity and acceleration at the inner breaks.

    Args:
        space: The joints.
        curve: Joint positions, trailing shape (d,), joints in the order of `space`.
        required_order: Order of continuity asked for.
    """
    for order in range(3):
        jumps, relative = measured_jumps(curve, order)
        if not len(jumps):
            jumps = relative = np.zeros((1, len(space.joint_names)))
        where, joint = divmod(int(relative.argmax()), relative.shape[1])
        ok = bool(relative[where, joint] <= CONTINUITY_TOLERANCE)
        yield Jump(
            QUANTITIES[order],
            float(jumps[where, joint]),
            float(relative[where, joint]),
            CONTINUITY_TOLERANCE,
            space.joint_names[joint],
            float(curve.x[min(where + 1, len(curve.x) - 1)]),
            rate_unit(space.joint_units[joint], order),
            order <= required_order,
            ok or order > required_order,
        )
