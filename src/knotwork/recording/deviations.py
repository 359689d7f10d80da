"""Findings on a log and its plan: the time shift, and deviations of joints and tool."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from knotwork.joint_quantities import rate_unit
from knotwork.polynomial import PiecewisePolynomial
from knotwork.polynomial.refined import cut_curve, split_at
from knotwork.polynomial.two_point import raise_degree
from knotwork.recording.alignment import Alignment
from knotwork.recording.lateness import delay_text
from knotwork.trajectory import JointTrajectory
from knotwork.units import SI, Units
from knotwork.verification import Finding
from knotwork.verification.finding import judged

if TYPE_CHECKING:
    from knotwork.robot import Robot

GROUP = "Against the plan"


class LogTolerances(NamedTuple):
    """Tolerances of a log relative to its plan.

    Attributes:
        tool: Tolerances of position and orientation, by unit: `"m"`, `"rad"`.
        joints: Tolerances of joints, by name, or by unit for all other joints.
        late: Largest delay [s]; positions are then compared without delays.
    """

    tool: Mapping[str, float] = MappingProxyType({})
    joints: Mapping[str, float] = MappingProxyType({})
    late: float | None = None


def deviation_findings(
    alignment: Alignment,
    robot: Robot | None = None,
    units: Units = SI,
    tolerances: LogTolerances = LogTolerances(),  # noqa: B008
) -> Iterator[Finding]:
    """Report the deviations of a log from its plan: time, each joint over all time, and the tool.

    Joint deviations are exact extrema between the smoothed log and the plan; the tool's are found
    at the times of the samples. Short reports show the largest of each, the shift and delays.

    >>> plan = kw.plan("paper_case")
    >>> time = np.arange(0.0, 25.0, 0.05)
    >>> log = np.column_stack([time + 3, plan.trajectory.position(time)])
    >>> np.savetxt("log.csv", log, "%.4f", ",", header="time,joint_1", comments="")
    >>> recorded = kw.recording.read_log("log.csv", ["joint_1"], ["rad"])
    >>> alignment = kw.recording.aligned(kw.recording.smoothed(recorded), plan.trajectory)
    >>> next(deviation_findings(alignment)).brief
    'joint_1 up to ... rad off at ... s; time shift ... s'

    Args:
        alignment: The smoothed log, by the plan's clock.
        robot: Robot, for the deviation of the tool.
        units: Units of the messages.
        tolerances: Required tolerances; nothing else is required.
    """
    own = alignment.trajectory if tolerances.late is None else alignment.on_time()
    joints = list(_joints(own, alignment, units, tolerances))
    tool = list(_tool(own, alignment, robot, units, tolerances)) if robot is not None else []
    off = [found for found in joints if found.quantity == "joint_deviation"]
    of_units = ([one for one in off if one.unit == unit] for unit in {one.unit: 1 for one in off})
    worst = [*(max(group, key=_size) for group in of_units), *tool[:1]]
    short = (
        f"{one.name or 'tool'} up to {units.text(_size(one), one.unit, '.3g')} off at {one.when} s"
        for one in worst
    )
    late = delay_text(alignment.delays)
    sentence = (
        f"the plan's time 0 is {alignment.start:.6f} s after the log's first sample, at "
        f"{alignment.shift:.6f} s by the log's clock; standard error {alignment.shift_error:.1g} s"
    )
    brief = filter(None, [late, *short, f"time shift {alignment.start:.4g} s"])
    yield Finding(
        GROUP, "motion", "", "time_shift", "information", sentence,
        value=alignment.start, unit="s", brief="; ".join(brief),
    )  # fmt: skip
    latest = max(alignment.delays, key=lambda one: abs(one.late))
    yield _off(
        "motion", "", "lateness", late or "the log is on time", latest.late, "s", latest.start,
        units, tolerances.late,
    )  # fmt: skip
    yield from joints
    yield from tool


def _size(found: Finding) -> float:
    return abs(found.value or 0.0)


def _joints(
    own: JointTrajectory, alignment: Alignment, units: Units, tolerances: LogTolerances
) -> Iterator[Finding]:
    gap = _difference(own.polynomial, alignment.reference.polynomial)
    for order, quantity in enumerate(("joint_deviation", "joint_velocity_deviation")):
        extrema = gap.extrema(order)
        for j, (name, unit) in enumerate(zip(own.joint_names, own.joint_units, strict=True)):
            value, time = float(extrema.peak[j]), float(extrema.peak_time[j])
            what = f"joint {name!r}:{' velocity' if order else ''} off the plan"
            limit = tolerances.joints.get(name, tolerances.joints.get(unit)) if not order else None
            yield _off(
                "joint", name, quantity, what, value, rate_unit(unit, order), time, units, limit
            )


def _difference(own: PiecewisePolynomial, plan: PiecewisePolynomial) -> PiecewisePolynomial:
    """Difference of two curves, in their common time."""
    low, high = max(own.x[0], plan.x[0]), min(own.x[-1], plan.x[-1])
    own, plan = cut_curve(own, low, high), cut_curve(plan, low, high)
    own, plan = split_at(own, plan.x), split_at(plan, own.x)
    degree = max(own.degree, plan.degree)
    return PiecewisePolynomial(raise_degree(own.c, degree) - raise_degree(plan.c, degree), own.x)


def _tool(
    own: JointTrajectory,
    alignment: Alignment,
    robot: Robot,
    units: Units,
    tolerances: LogTolerances,
) -> Iterator[Finding]:
    import pinocchio as pin

    own = own.reordered(robot.joint_names, robot.joint_units)
    plan = alignment.reference.reordered(robot.joint_names, robot.joint_units)
    times = alignment.curve.log.time - alignment.start
    times = times[(times >= own.start_time) & (times <= own.end_time)]
    off = np.empty((times.size, 2))
    for i, (q, asked) in enumerate(zip(own.position(times), plan.position(times), strict=True)):
        pose, wanted = robot.forward(q), robot.forward(asked)
        off[i, 0] = np.linalg.norm(pose.translation - wanted.translation)
        off[i, 1] = np.linalg.norm(pin.log3(wanted.rotation.T @ pose.rotation))
    for k, (word, named, unit) in enumerate(
        (("position", "", "m"), ("orientation", "orientation_", "rad"))
    ):
        worst = int(off[:, k].argmax())
        value, time = float(off[worst, k]), float(times[worst])
        what, limit = f"the tool's {word} is off the plan", tolerances.tool.get(unit)
        found = _off("tool", "", f"tool_{named}deviation", what, value, unit, time, units, limit)
        yield replace(found, proof="sampled")


def _off(
    subject: str,
    name: str,
    quantity: str,
    what: str,
    value: float,
    unit: str,
    time: float,
    units: Units,
    limit: float | None,
) -> Finding:
    """Deviation from the plan, and whether it is within the tolerance."""
    size = units.text(abs(value), unit, ".3g")
    message = what if unit == "s" else f"{what} by up to {size}, at {time:.4f} s"
    if limit is None:
        return Finding(
            GROUP, subject, name, quantity, "information", message, value=value, unit=unit,
            time=time,
        )  # fmt: skip
    return Finding(
        "Tolerances", subject, name, quantity, judged(abs(value) <= limit),
        f"{message}, tolerance {units.text(limit, unit, '.3g')}",
        value=value, limit=limit, margin=limit - abs(value), unit=unit, time=time,
    )  # fmt: skip
