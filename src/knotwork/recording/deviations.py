"""Findings on a log and its plan: the time shift, and how far joints and tool are off the plan."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from knotwork.polynomial import PiecewisePolynomial
from knotwork.polynomial.refined import refined
from knotwork.recording.alignment import Alignment
from knotwork.units import SI, Units
from knotwork.verification import Finding

if TYPE_CHECKING:
    from knotwork.robot import Robot

GROUP = "Against the plan"


def deviation_findings(
    alignment: Alignment, robot: Robot | None = None, units: Units = SI
) -> Iterator[Finding]:
    """Say how far a log is off its plan: the shift, each joint over all time, and the tool.

    Joint deviations are exact extrema between the smoothed log and the plan; the tool's are found
    at the times of the samples. Short reports show the shift with the largest of each.

    >>> plan = kw.plan("paper_case")
    >>> time = np.arange(0.0, 25.0, 0.05)
    >>> log = np.column_stack([time + 3, plan.trajectory.position(time)])
    >>> np.savetxt("log.csv", log, "%.4f", ",", header="time,joint_1", comments="")
    >>> recorded = kw.recording.read_log("log.csv", ["joint_1"], ["rad"])
    >>> alignment = kw.recording.aligned(kw.recording.smoothed(recorded), plan.trajectory)
    >>> next(deviation_findings(alignment)).brief
    'time shift ... s; joint_1 up to ... rad off at ... s'

    Args:
        alignment: The smoothed log, by the plan's clock.
        robot: Gives the deviation of the tool.
        units: Those of the messages.
    """
    sentence = (
        f"the plan's time 0 is {alignment.start:.6f} s after the log's first sample, at "
        f"{alignment.shift:.6f} s by the log's clock; standard error {alignment.shift_error:.1g} s"
    )
    shift = _finding("motion", "", "time_shift", alignment.start, "s", None, sentence)
    joints = list(_joints(alignment, units))
    tool = list(_tool(alignment, robot, units)) if robot is not None else []
    off = [found for found in joints if found.quantity == "joint_deviation"]
    turning = {
        found.unit: max((one for one in off if one.unit == found.unit), key=_size) for found in off
    }
    worst = [*turning.values(), *tool[:1]]
    brief = "; ".join(
        [f"time shift {alignment.start:.4g} s", *(_short(one, units) for one in worst)]
    )
    yield replace(shift, brief=brief)
    yield Finding(GROUP, "motion", "", "clock", "information", sentence)
    yield from joints
    yield from tool


def _size(found: Finding) -> float:
    return abs(found.value or 0.0)


def _short(found: Finding, units: Units) -> str:
    number = units.text(_size(found), found.unit, ".3g")
    return f"{found.name or 'tool'} up to {number} off at {found.when} s"


def _joints(alignment: Alignment, units: Units) -> Iterator[Finding]:
    own, plan = alignment.trajectory.polynomial, alignment.reference.polynomial
    for order, quantity in enumerate(("joint_deviation", "joint_velocity_deviation")):
        gap = _difference(own, plan).extrema(order)
        for j, name in enumerate(alignment.trajectory.joint_names):
            unit = alignment.trajectory.joint_units[j] + ("/s" if order else "")
            value, time = float(gap.peak[j]), float(gap.peak_time[j])
            word = "velocity " if order else ""
            yield _finding(
                "joint", name, quantity, value, unit, time,
                f"joint {name!r}: {word}off the plan by up to {units.text(value, unit, '.3g')}, at "
                f"{time:.4f} s",
            )  # fmt: skip


def _difference(own: PiecewisePolynomial, plan: PiecewisePolynomial) -> PiecewisePolynomial:
    """One curve minus another, in the time that they have in common."""
    low, high = max(own.x[0], plan.x[0]), min(own.x[-1], plan.x[-1])
    breaks = np.union1d(own.x, plan.x)
    breaks = np.union1d(breaks[(breaks > low) & (breaks < high)], [low, high])
    parts = []
    for curve in (own, plan):
        fine = refined(curve, breaks)
        first = int(np.searchsorted(fine.x, low))
        parts.append(fine.c[:, first : first + len(breaks) - 1])
    c = np.zeros((max(len(part) for part in parts), *parts[0].shape[1:]))
    for part, sign in zip(parts, (1.0, -1.0), strict=True):
        c[len(c) - len(part) :] += sign * part
    return PiecewisePolynomial(c, breaks)


def _tool(alignment: Alignment, robot: Robot, units: Units) -> Iterator[Finding]:
    import pinocchio as pin

    own = alignment.trajectory.reordered(robot.joint_names, robot.joint_units)
    plan = alignment.reference.reordered(robot.joint_names, robot.joint_units)
    time = alignment.curve.log.time - alignment.start
    time = time[(time >= own.start_time) & (time <= own.end_time)]
    off, turned = np.zeros(time.size), np.zeros(time.size)
    for i, (q, asked) in enumerate(zip(own.position(time), plan.position(time), strict=True)):
        pose, wanted = robot.forward(q), robot.forward(asked)
        off[i] = np.linalg.norm(pose.translation - wanted.translation)
        turned[i] = np.linalg.norm(pin.log3(wanted.rotation.T @ pose.rotation))
    for quantity, values, unit in (
        ("tool_deviation", off, "m"),
        ("tool_orientation_deviation", turned, "rad"),
    ):
        worst = int(values.argmax())
        value, at = float(values[worst]), float(time[worst])
        word = "orientation " if unit == "rad" else ""
        yield replace(
            _finding(
                "tool", "", quantity, value, unit, at,
                f"the tool's {word or 'position '}is off the plan by up to "
                f"{units.text(value, unit, '.3g')}, at {at:.4f} s",
            ),
            proof="sampled",
        )  # fmt: skip


def _finding(
    subject: str,
    name: str,
    quantity: str,
    value: float,
    unit: str,
    time: float | None,
    message: str,
) -> Finding:
    return Finding(
        group=GROUP,
        subject=subject,
        name=name,
        quantity=quantity,
        verdict="information",
        message=message,
        value=value,
        unit=unit,
        time=time,
    )
