"""Jumps of position, velocity and acceleration at the inner breaks, as measured."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from knotwork.joint_quantities import DERIVATIVES, rate_unit
from knotwork.joint_space import JointSpace
from knotwork.polynomial.jumps import NEGLIGIBLE, evaluation_noise, measured_jumps
from knotwork.scenario import Scenario
from knotwork.verification.finding import Finding, judged
from knotwork.verification.motion import Motion

ORDERS = 3

FASTEST = (1e3, 1e5, 1e6)
"""No drive moves as fast as this: velocity, acceleration, jerk [rad/s, rad/s², rad/s³, or m].

What changes faster jumps in effect, even where a tiny piece leads from one value to the other. The
limits of arms are 100 times below."""


def continuity(motion: Motion, scenario: Scenario, space: JointSpace) -> Iterator[Finding]:
    """Find the largest jump of position, velocity and acceleration, against what rounding makes.

    The scenario's `continuity` says up to which derivative a jump fails. A change that is faster
    than `FASTEST` is a jump as well.
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
        rates = motion.curve.extrema(order + 1)
        for i in np.flatnonzero(~(rates.peak <= FASTEST[order])):
            name, unit = space.joint_names[i], rate_unit(space.joint_units[i], order + 1)
            value, time = float(rates.peak[i]), float(rates.peak_time[i])
            yield Finding(
                group="Continuity",
                subject="joint",
                name=name,
                quantity=f"{quantity}_jump",
                verdict=judged(False, required=order <= scenario.continuity),
                message=f"joint {name!r}: {quantity} changes by {value:.3g} {unit} at "
                f"{time:.6g} s, which is a jump for any drive (at most {FASTEST[order]:g} {unit})",
                value=value,
                limit=FASTEST[order],
                margin=FASTEST[order] - value,
                unit=unit,
                time=time,
            )


def resolution(motion: Motion, scenario: Scenario, space: JointSpace) -> Iterator[Finding]:
    """Check that position, velocity and acceleration can be computed from the coefficients.

    Large terms of opposite signs cancel, and what they are rounded by stays. All other checks rely
    on that being negligible.
    """
    noise = evaluation_noise(motion.curve, ORDERS)
    for order, quantity in enumerate(DERIVATIVES[:ORDERS]):
        for i in np.flatnonzero(~(noise[order] <= NEGLIGIBLE[order])):
            name, unit = space.joint_names[i], rate_unit(space.joint_units[i], order)
            value = float(noise[order, i])
            yield Finding(
                group="Motion",
                subject="joint",
                name=name,
                quantity=f"{quantity}_rounding",
                verdict="failed",
                message=f"joint {name!r}: the coefficients cancel one another so far that "
                f"{quantity} is known to {value:.3g} {unit} only, not to {NEGLIGIBLE[order]:g} "
                f"{unit}",
                value=value,
                limit=NEGLIGIBLE[order],
                margin=NEGLIGIBLE[order] - value,
                unit=unit,
            )
