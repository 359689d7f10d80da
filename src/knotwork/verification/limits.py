"""Joint limits over all time, from the exact extrema of the polynomials, and missing limits."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from itertools import starmap
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.polynomial.jumps import measure_jumps
from knotwork.joint_quantities import JOINT_QUANTITIES, MAGNITUDES, MOTION_QUANTITIES, rate_unit
from knotwork.task.scenario import Scenario
from knotwork.task.scenario.scenario_joints import ScenarioJoints
from knotwork.units import Units, rounded_up
from knotwork.verification.finding import Finding, Findings, Group, Proof, Topic, verdict_on
from knotwork.verification.motion import Motion, describe_time

if TYPE_CHECKING:
    from knotwork.verification.bounds import Bound

LIMIT_GROUPS = Group.JOINT_LIMITS, Group.TOOL_LIMITS, Group.SINGULARITY
"""Headings of findings on limits."""
SMALLEST_SINGULAR_VALUE = "smallest_singular_value"
"""Quantity of findings on the distance from singularities."""
LIMIT_SLACK = 1e-9
"""Rounding tolerance of limits, relative to the limit, or to 1 in SI for smaller limits."""

GROSS_FACTOR = 10.0
"""Multiple of a velocity limit above which the limit is grossly exceeded."""

GROSS_DISTANCE = 10.0
"""Distance beyond a position limit above which the limit is grossly exceeded [rad or m], unless the
joint's range is wider.
"""

MAX_ACCELERATION = 1e3
"""Acceleration that no arm reaches [rad/s² or m/s²], for joints without a limit."""


def check_joint_limits(motion: Motion, scenario: Scenario, joints: ScenarioJoints) -> Findings:
    """Check position, velocity, acceleration and jerk of each joint against their limits."""
    for finding in check_derivative_limits(joints, motion.curve):
        yield explain_excess(finding, MOTION_QUANTITIES.index(finding.quantity), scenario)


def explain_excess(finding: Finding, order: int | None, scenario: Scenario) -> Finding:
    """State where a limit is exceeded most, and which multiple of the duration would keep it.

    In k times the duration, a derivative of order n decreases by the factor kⁿ. There is no remedy
    for positions and jumps, where slowing does not help. A finding without a failure is unchanged.

    Args:
        finding: Comparison of a value with its limit.
        order: Order of the derivative, 0 for positions; `None` if the effect of slowing is unknown.
        scenario: The scenario of the motion.
    """
    utilisation = finding.utilisation
    if finding.ok or finding.time is None:
        return finding
    fact = f"{finding.fact}; the excess is largest {describe_time(scenario, finding.time)}"
    if not order or utilisation is None or np.isinf(utilisation):
        return replace(finding, fact=fact)
    paths = ", and needs lower speeds along tool paths" if scenario.paths else ""
    factor = rounded_up(utilisation ** (1.0 / order), 3)
    remedy = f"{factor:.4g} times the duration keeps this limit{paths}"
    return replace(finding, fact=fact, remedy=remedy)


def check_derivative_limits(joints: ScenarioJoints, curve: PiecewisePolynomial) -> Findings:
    """Compare exact extrema of position, velocity, acceleration and jerk with the limits.

    Args:
        joints: The joints and their limits.
        curve: Joint positions, trailing shape (d,), joints in the order of `joints`.
    """
    for order, quantity in enumerate(MOTION_QUANTITIES):
        extrema, jumps = curve.extrema(order), infinite_derivatives(curve, order)
        lower, upper = joints.limits.bounds(quantity)
        highest = np.transpose([extrema.maximum, extrema.maximum_time, upper]).tolist()
        lowest = np.transpose([extrema.minimum, extrema.minimum_time, lower]).tolist()
        from_below = starmap(partial(LimitedValue, side=-1.0), lowest)
        for i, sides in enumerate(zip(starmap(LimitedValue, highest), from_below, strict=True)):
            worst = min(sides, key=lambda side: (side.margin, -abs(side.value)))
            yield joint_finding(joints, i, quantity, worst, jumps.get(i))


def find_grossly_exceeded_limit(curve: PiecewisePolynomial, joints: ScenarioJoints) -> str:
    """Name a limit that is exceeded by so much that proofs of other properties are useless.

    Args:
        curve: Joint positions, trailing shape (d,), joints in the order of `joints`.
        joints: The joints and their limits.

    Returns:
        Text that names the joint and the limit; empty if no limit is grossly exceeded.
    """
    lower, upper = joints.limits.bounds("position")
    position, velocity = curve.extrema(0), curve.extrema(1)
    excess = np.maximum(lower - position.minimum, position.maximum - upper)
    outside = excess > np.maximum(upper - lower, GROSS_DISTANCE)
    fast = ~(velocity.peak <= GROSS_FACTOR * joints.limits.bounds("velocity")[1])
    for quantity, exceeded in (("velocity", fast), ("position", outside)):
        for i in np.flatnonzero(exceeded).tolist():
            return f"the {quantity} of joint {joints.joint_names[i]!r} exceeds its limit by far"
    return ""


class LimitedValue(NamedTuple):
    """The worst value of a quantity, and its limit.

    Attributes:
        value: Value in SI; infinite at a jump.
        time: Time of the value [s].
        limit: The upper or lower limit, whichever `side` selects; infinite if none is given.
        side: 1 for an upper limit, -1 for a lower one.
        proof: Kind of proof.
        proof_gap: Maximum difference between the true worst value and `value`.
    """

    value: float
    time: float
    limit: float
    side: float = 1.0
    proof: Proof = "exact"
    proof_gap: float = 0.0

    @classmethod
    def from_bound(cls, bound: Bound, limit: float, side: float = 1.0) -> LimitedValue:
        """Convert a bound; its gap is kept only if it is proved."""
        if not bound.proved:
            return cls(bound.value, bound.time, limit, side, "sampled")
        return cls(bound.value, bound.time, limit, side, "bounded", bound.proof_gap)

    @property
    def margin(self) -> float:
        """Proved distance to the limit; beyond the limit, the negative distance of the value."""
        margin = self.side * (self.limit - self.value)
        return margin - self.proof_gap if margin >= 0.0 else margin

    @property
    def numbers(self) -> dict[str, Any]:
        """Attributes of the finding on this value; without a limit it has no margin."""
        numbers = self._asdict()
        del numbers["side"]
        if np.isfinite(self.limit):
            return numbers | {"margin": self.margin}
        return numbers | {"limit": None}


def limit_slack(limit: ArrayLike) -> Any:
    """Rounding tolerance of limits, in their unit."""
    return LIMIT_SLACK * np.maximum(1.0, np.abs(limit))


def keeps_limit(margin: float, limit: float) -> bool:
    """Whether a limit is kept, within rounding."""
    return bool(margin >= -limit_slack(limit))


def compare_text(worst: LimitedValue, unit: str, units: Units) -> str:
    """Text that compares a value with its limit, and states whether it is only sampled.

    Args:
        worst: The value.
        unit: Its SI unit.
        units: Units of the text.
    """
    has_limit = np.isfinite(worst.limit)
    kind = "limit"
    if worst.limit * worst.side < 0.0:  # a larger magnitude keeps it
        kind = "lower limit" if worst.side < 0.0 else "upper limit"
    allowed = f"{kind} {units.text(worst.limit, unit)}" if has_limit else "no limit is given"
    if worst.margin < 0.0 and worst.limit and 1.0 < worst.value / worst.limit < np.inf:
        percent = 100.0 * worst.value / worst.limit
        allowed += f" ({percent:.0f} %)" if percent >= 101.0 else ""
    if np.isinf(worst.value):
        text = f"is infinite at the jump at {worst.time:.6g} s, {allowed}"
    else:
        text = f"reaches {units.text(worst.value, unit)} at {worst.time:.6g} s, {allowed}"
    if worst.proof != "sampled":
        return text
    return f"{text}; sampled only: a proof exceeds the budget of evaluations"


def limit_finding(
    topic: Topic,
    quantity: str,
    label: str,
    worst: LimitedValue,
    unit: str,
    units: Units,
    *,
    ok: bool | None = None,
) -> Finding:
    """Make the finding of the worst value of a quantity.

    Args:
        topic: Group, kind of subject and name.
        quantity: Name of the quantity.
        label: Text of subject and quantity.
        worst: The worst value.
        unit: SI unit.
        units: Units of the text.
        ok: Whether the limit is kept, by default within rounding.
    """
    required = bool(np.isfinite(worst.limit))
    text = compare_text(worst, unit, units)
    ok = keeps_limit(worst.margin, worst.limit) if ok is None else ok
    verdict = verdict_on(ok, required=required)
    return topic.finding(quantity, f"{label} {text}", verdict, unit=unit, **worst.numbers)


def joint_finding(
    joints: ScenarioJoints,
    i: int,
    quantity: str,
    worst: LimitedValue,
    jump: tuple[float, float] | None = None,
) -> Finding:
    """Make the finding of the worst value of a quantity of joint `i`, see `limit_finding`.

    Args:
        joints: The joints.
        i: Index of the joint.
        quantity: Name of the quantity.
        worst: The worst value.
        jump: Time [s] and sign of a jump at which the quantity is infinite, if there is one.
    """
    if jump is not None and np.isfinite(worst.limit):
        time, side = jump
        worst = LimitedValue(side * np.inf, time, side * abs(worst.limit), side)
    name = joints.joint_names[i]
    unit = JOINT_QUANTITIES[quantity].units[joints.joint_units[i]]
    label = f"joint {name!r}: {quantity}"
    topic = Topic(Group.JOINT_LIMITS, "joint", name)
    return limit_finding(topic, quantity, label, worst, unit, joints.units)


def infinite_derivatives(curve: PiecewisePolynomial, order: int) -> dict[int, tuple[float, float]]:
    """Time [s] and sign of a derivative's infinite value, by index of the joint.

    The derivative of an order is infinite where that of order - 1 jumps; the largest jump is taken.
    """
    if order == 0:
        return {}
    signed = curve.jumps(order - 1)
    sizes, allowed = measure_jumps(curve, order - 1)
    excess = sizes - allowed
    jumps = {}
    for i in np.flatnonzero((excess > 0).any(axis=0)):
        k = int(excess[:, i].argmax())
        jumps[int(i)] = float(curve.x[k + 1]), float(np.copysign(1.0, signed[k, i]))
    return jumps


def report_missing_limits(motion: Motion, scenario: Scenario, joints: ScenarioJoints) -> Findings:
    """Report missing limits of a robot, with the peaks of the motion."""
    if joints.robot is None:
        return
    parts = []
    for quantity in MAGNITUDES:
        missing = np.flatnonzero(np.isinf(joints.limits[quantity]))
        if not missing.size or (quantity == "effort" and joints.robot.base_moves):
            continue
        order = JOINT_QUANTITIES[quantity].order
        part = quantity
        if missing.size < len(joints.joint_names):
            part += " of " + ", ".join(joints.joint_names[i] for i in missing)
        if order is not None:
            extrema = motion.curve.extrema(order)
            i = int(missing[extrema.peak[missing].argmax()])
            unit = JOINT_QUANTITIES[quantity].units[joints.joint_units[i]]
            peak = scenario.units.text(float(extrema.peak[i]), unit, ".4g")
            part += f" (peak {peak}, {joints.joint_names[i]} at {extrema.peak_time[i]:.6g} s)"
        parts.append(part)
    if parts:
        highlight = ", ".join(parts)
        fact = f"{joints.robot.name}: no limit is known of {highlight}"
        yield Topic(Group.NO_LIMIT).finding("missing_limits", fact, highlight=highlight)


def check_acceleration_spike(
    motion: Motion, scenario: Scenario, joints: ScenarioJoints
) -> Findings:
    """Find accelerations above `MAX_ACCELERATION` of a robot's joints without a limit."""
    if joints.robot is None:
        return
    extrema = motion.curve.extrema(2)
    unlimited = np.isinf(joints.limits.acceleration)
    for i in np.flatnonzero(unlimited & ~(extrema.peak <= MAX_ACCELERATION)):
        name = joints.joint_names[i]
        unit = rate_unit(joints.joint_units[i], 2)
        value, time = float(extrema.peak[i]), float(extrema.peak_time[i])
        reached, allowed = (scenario.units.text(x, unit) for x in (value, MAX_ACCELERATION))
        fact = (
            f"joint {name!r}: acceleration peaks at {reached} at {time:.6g} s, "
            f"{describe_time(scenario, time)}; without a limit, no more than {allowed} is accepted"
        )
        yield Topic(Group.CONTINUITY, "joint", name).at_most(
            "acceleration_spike", fact, value, MAX_ACCELERATION, unit, time=time
        )
