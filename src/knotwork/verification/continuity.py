"""Jumps of position, velocity and acceleration at the inner breaks, as measured."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from knotwork.joint_quantities import DERIVATIVES, rate_unit
from knotwork.polynomial.jumps import NEGLIGIBLE, evaluation_noise, measured_jumps
from knotwork.scenario import Scenario
from knotwork.scenario.joint_space import JointSpace
from knotwork.verification.checked_motion import Motion
from knotwork.verification.finding import Finding, judged
from knotwork.verification.remedies import rounded_corner

ORDERS = 3

FASTEST = (1e3, 1e5, 1e6)
"""Faster changes count as jumps: velocity, acceleration, jerk [rad/s, rad/s², rad/s³, or m].

No drive follows them, even if a tiny piece connects the two values. The limits of arms are 100
times lower."""


def continuity(motion: Motion, scenario: Scenario, space: JointSpace) -> Iterator[Finding]:
    """Find jumps of position, velocity and acceleration beyond rounding.

    Every joint that jumps is named; if none does, the one with the largest change. The scenario's
    `continuity` is the highest derivative of which a jump fails. A change faster than `FASTEST`
    is a jump, too.
    """
    for order, quantity in enumerate(DERIVATIVES[:ORDERS]):
        sizes, allowed = measured_jumps(motion.curve, order)
        if not len(sizes):
            sizes = allowed = np.zeros((1, len(space.joint_names)))
        share = np.divide(sizes, allowed, out=np.zeros_like(sizes), where=allowed > 0)
        share[~(sizes <= allowed)] = np.inf
        jumping = np.flatnonzero(np.isinf(share).any(axis=0))
        for joint in jumping if jumping.size else [share.max(axis=0).argmax()]:
            beyond = np.where(sizes[:, joint] <= allowed[:, joint], -1.0, sizes[:, joint])
            where = int((beyond if jumping.size else share[:, joint]).argmax())
            time = float(motion.curve.x[min(where + 1, len(motion.curve.x) - 1)])
            value = float(sizes[where, joint])
            unit = rate_unit(space.joint_units[joint], order)
            yield _finding(
                "Continuity", space.joint_names[joint], f"{quantity}_jump",
                value, float(allowed[where, joint]), unit, time,
                f"{quantity} jumps by {scenario.units.text(value, unit, '.3g')} at {time:.6g} s",
                required=order <= scenario.task.continuity,
            )  # fmt: skip
        rates = motion.curve.extrema(order + 1)
        for i in np.flatnonzero(~(rates.peak <= FASTEST[order])):
            value, time = float(rates.peak[i]), float(rates.peak_time[i])
            unit = rate_unit(space.joint_units[i], order + 1)
            yield _finding(
                "Continuity", space.joint_names[i], f"{quantity}_jump",
                value, FASTEST[order], unit, time,
                f"{quantity} changes by {scenario.units.text(value, unit, '.3g')} at {time:.6g} s, "
                "which is a jump for any drive (at most "
                f"{scenario.units.text(FASTEST[order], unit, 'g')})",
                required=order <= scenario.task.continuity,
            ).with_remedy(rounded_corner(time, scenario))  # fmt: skip


def resolution(motion: Motion, scenario: Scenario, space: JointSpace) -> Iterator[Finding]:
    """Check that rounding of position, velocity and acceleration is negligible.

    Large terms of opposite signs cancel, and their rounding errors remain. All other checks assume
    that these are negligible.
    """
    noise = evaluation_noise(motion.curve, ORDERS)
    for order, quantity in enumerate(DERIVATIVES[:ORDERS]):
        for i in np.flatnonzero(~(noise[order] <= NEGLIGIBLE[order])):
            value, limit = float(noise[order, i]), NEGLIGIBLE[order]
            unit = rate_unit(space.joint_units[i], order)
            yield _finding(
                "Motion", space.joint_names[i], f"{quantity}_rounding", value, limit, unit, None,
                f"the coefficients cancel one another so far that {quantity} is known to "
                f"{scenario.units.text(value, unit, '.3g')} only, not to "
                f"{scenario.units.text(limit, unit, 'g')}",
            )  # fmt: skip


def _finding(
    group: str,
    joint: str,
    quantity: str,
    value: float,
    limit: float,
    unit: str,
    time: float | None,
    text: str,
    *,
    required: bool = True,
) -> Finding:
    return Finding(
        group=group,
        subject="joint",
        name=joint,
        quantity=quantity,
        verdict=judged(value <= limit, required=required),
        message=f"joint {joint!r}: {text}",
        value=value,
        limit=limit,
        margin=limit - value,
        unit=unit,
        time=time,
    )
