"""Findings on a log and its plan: the time shift, and deviations of joints and tool."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.polynomial.splitting import cut_curve, split_at
from knotwork.curves.polynomial.two_point import raise_degree
from knotwork.curves.trajectory import JointTrajectory
from knotwork.joint_quantities import rate_unit
from knotwork.units import SI, Units
from knotwork.verification.finding import Finding, Findings, Group, Topic, verdict_on
from knotwork.verification.recording.alignment import Alignment
from knotwork.verification.recording.log_delays import delay_text

if TYPE_CHECKING:
    from knotwork.robot import Robot


class LogTolerances(NamedTuple):
    """Tolerances of a log relative to its plan.

    Attributes:
        tool: Tolerances of the tool's position and orientation, by unit: `"m"`, `"rad"`.
        joints: Tolerances of joints, by name, or by unit for all other joints.
        delay: Largest allowed delay [s]. If it is given, positions are compared without delays.
    """

    tool: Mapping[str, float] = MappingProxyType({})
    joints: Mapping[str, float] = MappingProxyType({})
    delay: float | None = None

    def of_joint(self, name: str, unit: str) -> float | None:
        """Tolerance of a joint [rad or m], or `None`."""
        return self.joints.get(name, self.joints.get(unit))


def deviation_findings(
    alignment: Alignment,
    robot: Robot | None = None,
    units: Units = SI,
    tolerances: LogTolerances = LogTolerances(),  # noqa: B008
) -> Findings:
    """Report the deviations of a log from its plan: time, each joint over all time, and the tool.

    Joint deviations are exact extrema between the smoothed log and the plan. Deviations of the tool
    are evaluated at the times of the samples. Short reports show the largest joint and tool
    deviations, the time shift and the delays.

    >>> plan = kw.plan("paper_case")
    >>> time = np.arange(0.0, 25.0, 0.05)
    >>> log = np.column_stack([time + 3, plan.trajectory.position(time)])
    >>> np.savetxt("log.csv", log, "%.4f", ",", header="time,joint_1", comments="")
    >>> recorded = kw.recording.read_log("log.csv", ["joint_1"], ["rad"])
    >>> alignment = kw.recording.aligned(kw.recording.smoothed(recorded), plan.trajectory)
    >>> next(deviation_findings(alignment)).highlight
    'joint_1 up to ... rad off at ... s; time shift ... s'

    Args:
        alignment: The smoothed log, by the plan's clock.
        robot: Robot, for the deviation of the tool.
        units: Units of the messages.
        tolerances: Tolerances of the deviations; without one a deviation is only information.
    """
    motion = alignment.trajectory if tolerances.delay is None else alignment.on_time()
    joint_findings = list(_joint_findings(motion, alignment, units, tolerances))
    tool_findings = list(_tool_findings(motion, alignment, robot, units, tolerances))
    worst: dict[str, Finding] = {}
    for finding in joint_findings:
        if finding.quantity == "joint_deviation":
            worst[finding.unit] = max(worst.get(finding.unit, finding), finding, key=_size)
    short = [
        f"{finding.name or 'tool'} up to {units.text(_size(finding), finding.unit, '.3g')} off "
        f"at {finding.time_text} s"
        for finding in (*worst.values(), *tool_findings[:1])
    ]
    text = delay_text(alignment.delays)
    fact = (
        f"the plan's time 0 is {alignment.lead:.6f} s after the log's first sample, at "
        f"{alignment.shift:.6f} s by the log's clock; standard error {alignment.shift_error:.1g} s"
    )
    highlight = "; ".join(filter(None, [text, *short, f"time shift {alignment.lead:.4g} s"]))
    yield Topic(Group.AGAINST_PLAN).finding(
        "time_shift", fact, value=alignment.lead, unit="s", highlight=highlight
    )
    largest = max(alignment.delays, key=lambda span: abs(span.delay))
    lateness = Topic(Group.AGAINST_PLAN).finding(
        "lateness",
        text or "the log is on time",
        value=largest.delay,
        unit="s",
        time=largest.start,
    )
    yield _compared(lateness, tolerances.delay, units)
    yield from joint_findings
    yield from tool_findings


def _size(finding: Finding) -> float:
    return abs(finding.value or 0.0)


def _joint_findings(
    motion: JointTrajectory, alignment: Alignment, units: Units, tolerances: LogTolerances
) -> Findings:
    difference = _difference(motion.polynomial, alignment.plan.polynomial)
    for order, word in enumerate(("", "velocity_")):
        extrema = difference.extrema(order)
        for j, (name, unit) in enumerate(zip(motion.joint_names, motion.joint_units, strict=True)):
            limit = tolerances.of_joint(name, unit) if not order else None
            fact = f"joint {name!r}:{' velocity' if order else ''} off the plan"
            value, time = float(extrema.peak[j]), float(extrema.peak_time[j])
            deviation = Topic(Group.AGAINST_PLAN, "joint", name).finding(
                f"joint_{word}deviation", fact, value=value, unit=rate_unit(unit, order), time=time
            )
            yield _compared(deviation, limit, units)


def _difference(curve: PiecewisePolynomial, plan: PiecewisePolynomial) -> PiecewisePolynomial:
    """Difference of two curves over their common time."""
    low, high = max(curve.x[0], plan.x[0]), min(curve.x[-1], plan.x[-1])
    curve, plan = cut_curve(curve, low, high), cut_curve(plan, low, high)
    curve, plan = split_at(curve, plan.x), split_at(plan, curve.x)
    degree = max(curve.degree, plan.degree)
    c = raise_degree(curve.c, degree) - raise_degree(plan.c, degree)
    return PiecewisePolynomial(c, curve.x)


def _tool_findings(
    motion: JointTrajectory,
    alignment: Alignment,
    robot: Robot | None,
    units: Units,
    tolerances: LogTolerances,
) -> Findings:
    if robot is None:
        return
    import pinocchio as pin

    motion = motion.reordered(robot.joint_names, robot.joint_units)
    plan = alignment.plan.reordered(robot.joint_names, robot.joint_units)
    times = alignment.smoothed.log.time - alignment.lead
    times = times[(times >= motion.start_time) & (times <= motion.end_time)]
    errors = np.empty((2, times.size))
    positions = zip(motion.position(times), plan.position(times), strict=True)
    for i, (q, requested) in enumerate(positions):
        pose, wanted = robot.forward(q), robot.forward(requested)
        errors[0, i] = np.linalg.norm(pose.translation - wanted.translation)
        errors[1, i] = np.linalg.norm(pin.log3(wanted.rotation.T @ pose.rotation))
    rows = ("tool_deviation", "position", "m"), ("tool_orientation_deviation", "orientation", "rad")
    for (quantity, word, unit), sizes in zip(rows, errors, strict=True):
        worst = int(sizes.argmax())
        value, time = float(sizes[worst]), float(times[worst])
        fact = f"the tool's {word} is off the plan"
        deviation = Topic(Group.AGAINST_PLAN, "tool").finding(
            quantity, fact, value=value, unit=unit, time=time, proof="sampled"
        )
        yield _compared(deviation, tolerances.tool.get(unit), units)


def _compared(deviation: Finding, limit: float | None, units: Units) -> Finding:
    """Add the size of a deviation to its fact, and compare it with its tolerance if it has one."""
    size = _size(deviation)
    fact = deviation.fact
    if deviation.unit != "s":
        reached = units.text(size, deviation.unit, ".3g")
        fact += f" by up to {reached}, at {deviation.time:.4f} s"
    if limit is None:
        return replace(deviation, fact=fact)
    return replace(
        deviation,
        group=Group.TOLERANCES,
        verdict=verdict_on(size <= limit),
        fact=f"{fact}, tolerance {units.text(limit, deviation.unit, '.3g')}",
        limit=limit,
        margin=limit - size,
    )
