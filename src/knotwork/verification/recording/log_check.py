"""The check of a log, within its noise.

The smoothed motion is checked like any other, but it is only known up to the noise of the log. A
requirement is undecided if its margin is below `STANDARD_ERRORS` standard errors. The smoothed
curve has no jumps, so the residuals of the samples are checked instead. Even a log without noise
may have residuals of `PLAN_RESIDUAL_RATIO` times those of the smoothed plan, because the plan's
jerk may jump.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.polynomial.splitting import cut_curve
from knotwork.errors import InputError, UnknownNameError
from knotwork.joint_quantities import MOTION_QUANTITIES, rate_unit
from knotwork.units import SI, Units
from knotwork.verification import Finding, Report, check
from knotwork.verification.continuity import ROUNDING_QUANTITIES
from knotwork.verification.finding import Findings, Group, Topic, Verdict
from knotwork.verification.limits import LimitedValue
from knotwork.verification.recording.alignment import (
    PLAN_RESIDUAL_RATIO,
    STANDARD_ERRORS,
    Alignment,
)
from knotwork.verification.recording.deviations import LogTolerances, deviation_findings
from knotwork.verification.recording.smoothing import ERROR_ORDERS

if TYPE_CHECKING:
    from knotwork.curves.trajectory import JointTrajectory
    from knotwork.robot import Robot
    from knotwork.task.scenario import Scenario
    from knotwork.task.scenario.scenario_joints import ScenarioJoints

REPLACED_SUBJECTS = ("waypoint", "path", "wait", "motion", "event")
"""Subjects of requirements that are left out if tolerances of the log are given."""
JUMP_DEVIATIONS = 8.0
"""Residual, in standard deviations, above which the motion jumps or a sample is wrong."""
GAP_PERIODS = 5.5
"""Time without samples, in sample periods, above which it is a gap."""
MOVING_GAP_PERIODS = 1.75
"""Time without samples, in sample periods, above which it is a gap if the plan moves far in it."""
MOVING_GAP_RANGE = 0.1
"""Fraction of the range of a joint's motion beyond which it moves far in a gap."""
REST_DEVIATIONS = 4.0
"""Motion of a plan, in standard deviations of the noise, below which it is at rest."""
JACOBIAN_ROWS = {
    rate_unit(unit, order): (order, rows)
    for unit, rows in (("m", slice(3)), ("rad", slice(3, 6)))
    for order in range(3)
}
"""Order of a derivative of the tool's pose, and its rows of the Jacobian, by its unit."""


def check_log(
    alignment: Alignment,
    scenario: Scenario,
    joints: ScenarioJoints,
    tolerances: LogTolerances | None = None,
) -> Report:
    """Check a log against a scenario.

    If the report passes, nothing in the log contradicts the scenario beyond the log's noise; some
    requirements may be undecided. Given tolerances replace the requirements of the scenario on
    waypoints, paths, waits and positions of events. A tolerance of a joint also allows jumps of its
    samples; with other tolerances jumps are warnings.

    >>> plan = kw.plan("paper_case")
    >>> time = np.arange(0.0, 25.0, 0.05)
    >>> log = np.column_stack([time + 3, plan.trajectory.position(time)])
    >>> np.savetxt("log.csv", log, "%.4f", ",", header="time,joint_1", comments="")
    >>> recorded = kw.recording.read_log("log.csv", ["joint_1"], ["rad"])
    >>> alignment = kw.recording.aligned(kw.recording.smoothed(recorded), plan.trajectory)
    >>> check_log(alignment, plan.scenario, plan.joints).ok
    True

    Args:
        alignment: The smoothed log, by the clock of a plan of this scenario.
        scenario: The scenario.
        joints: The scenario's joints and robot.
        tolerances: Tolerances of the log relative to its plan, or `None`.
    """
    report = check(alignment.trajectory, scenario, joints=joints)
    units = scenario.units
    compared = compare_log(alignment, joints.robot, units, tolerances)
    findings = list(compared.findings)
    undecided = 0
    for finding in report.findings:
        if finding.group == Group.CONTINUITY or finding.quantity in ROUNDING_QUANTITIES:
            continue
        if finding.subject == "event" and finding.verdict == "warning":
            continue  # a log of positions has no signals
        if tolerances is not None and finding.is_decided and finding.subject in REPLACED_SUBJECTS:
            continue
        error = _uncertainty(finding, alignment, joints) if finding.is_decided else None
        if error is not None and abs(finding.margin or 0.0) <= error:
            undecided += 1
            size = units.text(error, finding.unit, ".2g")
            fact = f"{finding.fact}; undecided, because the log resolves the value to {size}"
            finding = replace(finding, verdict="undecided", fact=fact, remedy="")
        findings.append(finding)
    if undecided:
        errors = f"{STANDARD_ERRORS:g} standard errors"
        fact = f"requirements undecided: {undecided}, with margins below {errors} of the log"
        highlight = f"undecided: within {errors} of the limit"
        findings.append(Topic(Group.LOG).finding("undecided", fact, highlight=highlight))
    return replace(report, findings=tuple(findings))


def compare_log(
    alignment: Alignment,
    robot: Robot | None = None,
    units: Units = SI,
    tolerances: LogTolerances | None = None,
) -> Report:
    """Report the deviations of a log from its plan, the assumptions about the log, and its jumps.

    >>> plan = kw.plan("paper_case")
    >>> time = np.arange(0.0, 25.0, 0.05)
    >>> log = np.column_stack([time + 3, plan.trajectory.position(time)])
    >>> np.savetxt("log.csv", log, "%.4f", ",", header="time,joint_1", comments="")
    >>> recorded = kw.recording.read_log("log.csv", ["joint_1"], ["rad"])
    >>> alignment = kw.recording.aligned(kw.recording.smoothed(recorded), plan.trajectory)
    >>> str(compare_log(alignment)).splitlines()[0]
    'PASSED log.csv: 1 of 1 requirements met; ...'

    Args:
        alignment: The smoothed log, by the plan's clock.
        robot: Robot, for the deviation of the tool.
        units: Units of the messages.
        tolerances: Tolerances of the log relative to the plan, or `None`.

    Raises:
        InputError: A tolerance is of an unknown joint, or of the tool without a robot.
    """
    residuals = _residual_findings(alignment, tolerances, units)
    tolerances = tolerances or LogTolerances()
    _check_tolerances(tolerances, alignment.trajectory, robot)
    return Report(
        scenario=alignment.smoothed.log.source,
        robot=robot.name if robot is not None else None,
        origin=alignment.trajectory.origin,
        start_time=alignment.trajectory.start_time,
        end_time=alignment.trajectory.end_time,
        findings=(
            *deviation_findings(alignment, robot, units, tolerances),
            *_log_findings(alignment, units),
            *residuals,
            *gap_findings(alignment),
        ),
        units=units,
    )


def _check_tolerances(
    tolerances: LogTolerances, motion: JointTrajectory, robot: Robot | None
) -> None:
    if tolerances.tool and robot is None:
        raise InputError(
            "a tolerance of the tool needs the scenario's robot; accepted without a robot: "
            "tolerances of joints"
        )
    units = dict(zip(motion.joint_names, motion.joint_units, strict=True))
    for name in tolerances.joints:
        if name not in {**units, "rad": "", "m": ""}:
            raise UnknownNameError("joint", name, list(units))


def _uncertainty(finding: Finding, alignment: Alignment, joints: ScenarioJoints) -> float | None:
    """Uncertainty of a finding's value because of the noise of the log; `None` if unknown."""
    quantity = finding.quantity.removeprefix("joint_")
    order = MOTION_QUANTITIES.index(quantity) if quantity in MOTION_QUANTITIES else None
    if order is not None and order not in ERROR_ORDERS:
        return np.inf  # the smooth curve has no such derivative
    if finding.value is None or not np.isfinite(finding.value) or finding.margin is None:
        return None
    names, robot = joints.joint_names, joints.robot
    columns = [alignment.trajectory.joint_names.index(name) for name in names]

    def errors(order: int, time: float | None = finding.shown_time) -> FloatArray:
        return alignment.uncertainty(order, time)[columns]

    if finding.subject == "wait" and finding.interval is not None:
        # the finding compares two times, so both errors add
        return float((errors(0) + errors(0, finding.interval[0])).max())
    if order is not None and finding.name in names and finding.subject == "joint":
        return float(errors(order)[names.index(finding.name)])
    if order is not None and finding.group == Group.JOINTS_AT_WAYPOINTS:
        return float(errors(order).max())
    if robot is None:
        return None
    motion = alignment.trajectory.reordered(names, joints.joint_units)
    time = motion.start_time if finding.shown_time is None else finding.shown_time
    time = min(max(time, motion.start_time), motion.end_time)
    q = motion.position(time)
    if finding.quantity == "effort" and finding.name in names:
        row = _inertia(robot, q)[names.index(finding.name)]
        return float(np.linalg.norm(row * errors(2)))
    if finding.subject == "joint" or finding.unit not in JACOBIAN_ROWS:
        return None
    order, rows = JACOBIAN_ROWS[finding.unit]
    jacobian = robot.jacobian(q)
    error = float(np.linalg.norm(jacobian[rows] * errors(order)))
    if finding.unit == "rad" and finding.subject != "waypoint":
        # on a path the orientation depends on the position along it
        v, w = np.split(jacobian @ motion.velocity(time), 2)
        turn = np.linalg.norm(w) / max(np.linalg.norm(v), np.finfo(float).tiny)
        error += float(turn * np.linalg.norm(jacobian[:3] * errors(0)))
    return error


def _inertia(robot: Robot, q: FloatArray) -> FloatArray:
    """The joint-space mass matrix, from the efforts of unit accelerations, shape (d, d)."""
    still = np.zeros(q.size)
    static = robot.effort(q, still, still)
    return np.column_stack([robot.effort(q, still, unit) - static for unit in np.eye(q.size)])


def _residual_findings(
    alignment: Alignment, tolerances: LogTolerances | None, units: Units
) -> Findings:
    """Report the residuals of the samples of each joint, relative to their noise.

    A tolerance of a joint also allows such residuals. Tolerances of the tool or of the delay say
    nothing about a joint's samples, so that its residuals are a warning.

    Args:
        alignment: The smoothed log, by the plan's clock.
        tolerances: Tolerances of the log relative to the plan, or `None`.
        units: Units of the messages.
    """
    curve = alignment.smoothed
    allowed = PLAN_RESIDUAL_RATIO * alignment.residual.samples  # due to jumps of the jerk
    sizes, limits = np.abs(curve.residuals), JUMP_DEVIATIONS * curve.sigma + allowed
    names_and_units = zip(curve.log.joint_names, curve.log.joint_units, strict=True)
    for j, (name, unit) in enumerate(names_and_units):
        tolerance = None if tolerances is None else tolerances.of_joint(name, unit)
        if tolerance is not None:
            limits[:, j] = np.maximum(limits[:, j], tolerance)
        worst = int((sizes[:, j] / limits[:, j]).argmax())
        value, limit = float(sizes[worst, j]), float(limits[worst, j])
        time = float(curve.log.time[worst] - alignment.lead)
        shown = units.text(value, unit, ".3g")
        fact = f"joint {name!r}: a sample is off the smooth curve by {shown} at {time:.4f} s"
        if value > limit:
            times = value / float(curve.sigma[worst, j])
            fact += f", {times:.3g} times the noise: the motion jumps, or the sample is wrong"
            if not curve.noise.stated:
                fact += f"; if such errors are expected, give a noise of {float(sizes.max()):.0e}"
        topic = Topic(Group.CONTINUITY, "joint", name)
        finding = topic.at_most("sample_off_the_curve", fact, value, limit, unit, time=time)
        unjudged = tolerances is not None and tolerance is None
        yield replace(finding, verdict="warning") if unjudged and not finding.ok else finding


def _log_findings(alignment: Alignment, units: Units) -> Findings:
    """Report the assumptions about the log: sampling, smoothing, noise and omissions."""
    curve, log, noise = alignment.smoothed, alignment.smoothed.log, alignment.smoothed.noise
    origin = "as given" if noise.stated else "estimated from the samples and their digits"
    largest: dict[str, float] = {}
    noises = zip(log.joint_names, log.joint_units, noise.position.tolist(), strict=True)
    for name, unit, value in noises:
        size = units.text(value, unit, ".2g")
        fact = f"joint {name!r}: the noise has a standard deviation of {size}, {origin}"
        topic = Topic(Group.LOG, "joint", name)
        yield topic.finding("noise", fact, value=value, unit=unit, proof="sampled")
        largest[unit] = max(value, largest.get(unit, 0.0))
    sizes = ", ".join(units.text(value, unit, ".2g") for unit, value in largest.items())
    yield Topic(Group.LOG).finding(
        "log",
        f"log: {log.time.size} samples, every {1e3 * log.period:.4g} ms, smoothed by "
        f"{curve.trajectory.breaks.size - 1} cubics; noise {sizes} and jitter "
        f"of time stamps {1e3 * noise.jitter:.2g} ms, {origin}",
    )
    if log.notes:
        fact = f"left out or corrected: {'; '.join(log.notes)}"
        yield Topic(Group.LOG).finding("left_out", fact)


def gap_findings(alignment: Alignment) -> Findings:
    """Report each gap in the plan's time, in which the motion of the robot is unknown.

    A gap fails if the plan moves during it, and is a warning if the plan is at rest. In a gap the
    smoothed curve is a guess, and so are all findings on it.
    """
    plan, log = alignment.plan, alignment.smoothed.log
    times = np.concatenate(([plan.start_time], log.time - alignment.lead, [plan.end_time]))
    times = np.sort(np.clip(times, plan.start_time, plan.end_time))
    far = MOVING_GAP_RANGE * _range(plan.polynomial)
    for i in np.flatnonzero(np.diff(times) > MOVING_GAP_PERIODS * log.period):
        start, end = float(times[i]), float(times[i + 1])
        moved = _range(cut_curve(plan.polynomial, start, end))
        moves = moved > REST_DEVIATIONS * alignment.smoothed.noise.position
        is_far = (moves & (moved > far)).any()
        limit = log.period * (MOVING_GAP_PERIODS if is_far else GAP_PERIODS)
        duration = end - start
        if duration <= limit:
            continue
        verdict: Verdict = "warning"
        plan_text = "is at rest there, which the log does not confirm"
        if moves.any():
            verdict = "failed"
            plan_text = "moves there, so the motion of the robot is undecided"
        fact = (
            f"the log has no sample from {start:.3f} s to {end:.3f} s: {duration:.4g} s, "
            f"{duration / log.period:.3g} times its interval of {1e3 * log.period:.4g} ms; "
            f"the plan {plan_text}"
        )
        numbers = LimitedValue(duration, start, limit).numbers
        yield Topic(Group.LOG).finding(
            "gap", fact, verdict, unit="s", interval=(start, end), **numbers
        )


def _range(curve: PiecewisePolynomial) -> FloatArray:
    """Range of motion of each joint, shape (d,)."""
    extrema = curve.extrema(0)
    return extrema.maximum - extrema.minimum
