"""Checks of jumps at the inner breaks, of sudden changes and of rounding errors."""

from __future__ import annotations

import numpy as np

from knotwork.curves.polynomial.jumps import ALWAYS_A_JUMP, evaluation_noise, measure_jumps
from knotwork.joint_quantities import MOTION_QUANTITIES, rate_unit
from knotwork.task.scenario import Scenario
from knotwork.task.scenario.scenario_joints import ScenarioJoints
from knotwork.verification.finding import Findings, Group, Topic
from knotwork.verification.motion import Motion

JUMP_ORDERS = 3
"""Order below which jumps of derivatives are measured: of position, velocity and acceleration."""

ROUNDING_QUANTITIES = tuple(f"{quantity}_rounding" for quantity in MOTION_QUANTITIES[:JUMP_ORDERS])
"""Quantities of findings on rounding errors."""

MAX_RATES_OF_CHANGE = (1e3, 1e5, 1e6)
"""Velocity, acceleration and jerk above which a change counts as a jump [rad or m per s, s², s³].

No drive follows such a change, even if a short piece connects the two values. The limits of arms
are about 100 times lower.
"""


def check_continuity(motion: Motion, scenario: Scenario, joints: ScenarioJoints) -> Findings:
    """Find jumps of position, velocity and acceleration beyond rounding.

    Every joint that jumps has a finding; if none jumps, the joint nearest to a jump has one. Jumps
    of derivatives up to the order of the scenario's `continuity` fail. A change faster than
    `MAX_RATES_OF_CHANGE` counts as a jump as well.
    """
    names = joints.joint_names
    for order, quantity in enumerate(MOTION_QUANTITIES[:JUMP_ORDERS]):
        required = order <= scenario.task.continuity
        sizes, allowed = measure_jumps(motion.curve, order)
        if not len(sizes):
            sizes = allowed = np.zeros((1, len(names)))
        utilisation = np.divide(sizes, allowed, out=np.zeros_like(sizes), where=allowed > 0)
        utilisation[~(sizes <= allowed)] = np.inf
        jumping = np.flatnonzero(np.isinf(utilisation).any(axis=0))
        for joint in jumping if jumping.size else [utilisation.max(axis=0).argmax()]:
            worst = max(range(len(sizes)), key=lambda k: (utilisation[k, joint], sizes[k, joint]))
            time = float(motion.curve.x[min(worst + 1, len(motion.curve.x) - 1)])
            value, limit = float(sizes[worst, joint]), float(allowed[worst, joint])
            unit = rate_unit(joints.joint_units[joint], order)
            jump, tolerance = (scenario.units.text(x, unit, ".3g") for x in (value, limit))
            fact = f"joint {names[joint]!r}: largest jump of {quantity} {jump} at {time:.6g} s"
            fact += f", tolerance {tolerance}" if required else ""
            yield Topic(Group.CONTINUITY, "joint", names[joint]).at_most(
                f"{quantity}_jump", fact, value, limit, unit, required=required, time=time
            )
        rates = motion.curve.extrema(order + 1)
        limit = MAX_RATES_OF_CHANGE[order]
        for joint in np.flatnonzero(~(rates.peak <= limit)):
            value, time = float(rates.peak[joint]), float(rates.peak_time[joint])
            unit = rate_unit(joints.joint_units[joint], order + 1)
            rate, fastest = (scenario.units.text(x, unit, ".3g") for x in (value, limit))
            fact = (
                f"joint {names[joint]!r}: {quantity} changes at {rate} at {time:.6g} s, which is a "
                f"jump for any drive (at most {fastest})"
            )
            yield Topic(Group.CONTINUITY, "joint", names[joint]).at_most(
                f"{quantity}_change", fact, value, limit, unit, required=required, time=time
            )


def check_rounding(motion: Motion, scenario: Scenario, joints: ScenarioJoints) -> Findings:
    """Check that rounding errors of position, velocity and acceleration are negligible.

    Where large terms of opposite signs cancel, their rounding errors remain. All other checks
    assume that these errors are negligible.
    """
    noise = evaluation_noise(motion.curve, JUMP_ORDERS)
    for order, quantity in enumerate(MOTION_QUANTITIES[:JUMP_ORDERS]):
        for joint in np.flatnonzero(~(noise[order] <= ALWAYS_A_JUMP[order])):
            name = joints.joint_names[joint]
            unit = rate_unit(joints.joint_units[joint], order)
            value = float(noise[order, joint])
            limit = ALWAYS_A_JUMP[order]
            fact = (
                f"joint {name!r}: the terms of its polynomials cancel, so {quantity} has a "
                f"rounding error of {scenario.units.text(value, unit, '.3g')}, tolerance "
                f"{scenario.units.text(limit, unit, 'g')}"
            )
            topic = Topic(Group.MOTION, "joint", name)
            yield topic.at_most(ROUNDING_QUANTITIES[order], fact, value, limit, unit)
