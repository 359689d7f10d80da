"""The check of a log, within its noise.

The smoothed motion is checked like any other, but it is only known up to the noise of the log. A
requirement whose margin is below `CERTAIN` standard errors is undecided. Jumps are judged by the
residuals of the samples, because the smoothed curve has none. For a noise-free log, residuals up to
`LIKE_THE_PLAN` times those of the smoothed plan are accepted, because the plan's jerk may jump.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from knotwork.errors import InputError, UnknownNameError
from knotwork.joint_quantities import DERIVATIVES, rate_unit
from knotwork.recording.alignment import Alignment
from knotwork.recording.deviations import LogTolerances, deviation_findings
from knotwork.recording.holes import hole_findings
from knotwork.units import SI, Units
from knotwork.verification import Finding, Report, check
from knotwork.verification.finding import judged

if TYPE_CHECKING:
    from knotwork.robot import Robot
    from knotwork.scenario import Scenario
    from knotwork.scenario.joint_space import JointSpace
    from knotwork.trajectory import JointTrajectory
    from knotwork.waypoints import FloatArray

GROUP = "Log"
ASKED = ("waypoint", "path", "wait", "motion", "event")
"""Subjects whose requirements are replaced by given tolerances."""
CERTAIN = 4.0
"""Number of standard errors beyond which a margin counts."""
JUMP = 8.0
"""Residual in standard deviations beyond which a sample is a jump or wrong."""
LIKE_THE_PLAN = 1.5
"""Largest residual of a noise-free log, as a multiple of that of the smoothed plan."""
_ORDERS = {"m": 0, "rad": 0, "m/s": 1, "rad/s": 1, "m/s²": 2, "rad/s²": 2}
_TURNING = ("rad", "rad/s", "rad/s²")


def check_log(
    alignment: Alignment,
    scenario: Scenario,
    space: JointSpace,
    tolerances: LogTolerances | None = None,
) -> Report:
    """Check a log against a scenario.

    `"passed"` then means that nothing in the log contradicts the scenario beyond the log's noise.
    The findings report undecided requirements. Given tolerances replace the scenario's
    requirements on waypoints, paths, waits and places of events.

    >>> plan = kw.plan("paper_case")
    >>> time = np.arange(0.0, 25.0, 0.05)
    >>> log = np.column_stack([time + 3, plan.trajectory.position(time)])
    >>> np.savetxt("log.csv", log, "%.4f", ",", header="time,joint_1", comments="")
    >>> recorded = kw.recording.read_log("log.csv", ["joint_1"], ["rad"])
    >>> alignment = kw.recording.aligned(kw.recording.smoothed(recorded), plan.trajectory)
    >>> check_log(alignment, plan.scenario, plan.space).ok
    True

    Args:
        alignment: The smoothed log, by the clock of a plan of this scenario.
        scenario: The task.
        space: The scenario's joints and robot.
        tolerances: Tolerances of the log relative to its plan, or `None`.
    """
    report, units = check(alignment.trajectory, scenario, space=space), scenario.units
    compared = compare_log(
        alignment, space.robot, units, tolerances, required=scenario.task.continuity >= 0
    )
    findings = list(compared.findings)
    undecided = 0
    for found in report.findings:
        if found.group == "Continuity" or found.quantity.endswith("_rounding"):
            continue
        if found.subject == "event" and found.verdict == "warning":
            continue  # a log of positions has no signals
        if tolerances is not None and found.required and found.subject in ASKED:
            continue
        known = _known_to(found, alignment, space)
        asked = found.verdict in ("met", "failed")
        if asked and known is not None and abs(found.margin or 0.0) <= known:
            undecided += 1
            to = units.text(known, found.unit, ".2g")
            sentence = f"{found.message}; undecided, as the log resolves it to {to}"
            found = replace(found, verdict="undecided", fact=sentence)
        findings.append(found)
    if undecided:
        findings.append(
            _information(
                "undecided",
                f"{undecided} requirements are undecided: their margins are below "
                f"{CERTAIN:g} standard errors of the log",
                f"undecided: within {CERTAIN:g} standard errors of the limit",
            )
        )
    return replace(report, findings=tuple(findings))


def compare_log(
    alignment: Alignment,
    robot: Robot | None = None,
    units: Units = SI,
    tolerances: LogTolerances | None = None,
    *,
    required: bool = True,
) -> Report:
    """Report the deviations of a log from its plan, the assumptions about it, and jumps.

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
        required: Without tolerances, a jump of the position fails.

    Raises:
        InputError: A tolerance has an unknown subject.
    """
    jumps = tolerances is None
    tolerances = tolerances or LogTolerances()
    _check_tolerances(tolerances, alignment.trajectory, robot)
    allowed = LIKE_THE_PLAN * alignment.left.samples
    return Report(
        scenario=alignment.curve.log.source,
        robot=robot.name if robot is not None else None,
        planner=alignment.trajectory.planner,
        start_time=alignment.trajectory.start_time,
        end_time=alignment.trajectory.end_time,
        findings=(
            *deviation_findings(alignment, robot, units, tolerances),
            *_about(alignment, allowed, units),
            *(_smooth(alignment, allowed, units, required=required) if jumps else ()),
            *hole_findings(alignment),
        ),
        units=units,
    )


def _check_tolerances(
    tolerances: LogTolerances, motion: JointTrajectory, robot: Robot | None
) -> None:
    if tolerances.tool and robot is None:
        raise InputError(
            "a tolerance of the tool needs the scenario's robot; accepted without: "
            "joints=0.1deg, or a joint's name in place of joints"
        )
    units = dict(zip(motion.joint_names, motion.joint_units, strict=True))
    for name in tolerances.joints:
        if name not in {**units, "rad": "", "m": ""}:
            raise UnknownNameError("joint", name, list(units))


def _known_to(found: Finding, alignment: Alignment, space: JointSpace) -> float | None:
    """Uncertainty of a value due to the log's noise, or `None` if unknown."""
    if found.value is None or not np.isfinite(found.value) or found.margin is None:
        return None
    own, names, robot = alignment.trajectory.joint_names, space.joint_names, space.robot

    def errors(nu: int, time: float | None = found.at) -> FloatArray:
        return _unknown(alignment, nu, time)[[own.index(name) for name in names]]

    quantity = found.quantity.removeprefix("joint_")
    if found.subject == "wait" and found.interval is not None:  # between two of its times
        return float((errors(0) + errors(0, found.interval[0])).max())
    if quantity in DERIVATIVES and found.name in names and found.subject == "joint":
        return float(errors(DERIVATIVES.index(quantity))[names.index(found.name)])
    if quantity in DERIVATIVES and found.group == "Joints at the waypoints":
        return float(errors(DERIVATIVES.index(quantity)).max())
    if robot is None:
        return None
    motion = alignment.trajectory.reordered(names, space.joint_units)
    time = motion.start_time if found.at is None else found.at
    time = min(max(time, motion.start_time), motion.end_time)
    q = motion.position(time)
    if found.quantity == "effort" and found.name in names:
        return float(np.linalg.norm((_inertia(robot, q) * errors(2))[names.index(found.name)]))
    if found.unit not in _ORDERS:
        return None
    jacobian, turning = robot.jacobian(q), found.unit in _TURNING
    known = float(np.linalg.norm(jacobian[3 * turning :][:3] * errors(_ORDERS[found.unit])))
    if found.unit == "rad" and found.subject != "waypoint":
        # on a path the orientation depends on the position along it
        v, w = np.split(jacobian @ motion.velocity(time), 2)
        turn = np.linalg.norm(w) / max(np.linalg.norm(v), np.finfo(float).tiny)
        known += float(turn * np.linalg.norm(jacobian[:3] * errors(0)))
    return known


def _unknown(alignment: Alignment, order: int, time: float | None) -> FloatArray:
    """Uncertainty of each joint, by noise and by the residual of the smoothed plan."""
    noise = CERTAIN * alignment.errors(order, time)
    return noise + LIKE_THE_PLAN * alignment.left_of_plan(order, time)


def _inertia(robot: Robot, q: FloatArray) -> FloatArray:
    """The mass matrix, from the torques of unit accelerations."""
    still = np.zeros(q.size)
    rest = robot.torque(q, still, still)
    return np.column_stack([robot.torque(q, still, one) - rest for one in np.eye(q.size)])


def _smooth(
    alignment: Alignment, allowed: FloatArray, units: Units, *, required: bool
) -> Iterator[Finding]:
    """Report the residuals of the samples of each joint, relative to their noise.

    Args:
        alignment: The smoothed log, by the plan's clock.
        allowed: Residuals due to jumps of the jerk, beyond the noise [rad or m], shape (d,).
        units: Units of the messages.
        required: A jump fails.
    """
    curve = alignment.curve
    off, limits = np.abs(curve.residuals), JUMP * curve.sigma + allowed
    for j, (name, unit) in enumerate(
        zip(curve.log.joint_names, curve.log.joint_units, strict=True)
    ):
        worst = int((off[:, j] / limits[:, j]).argmax())
        value, limit = float(off[worst, j]), float(limits[worst, j])
        time = float(curve.log.time[worst] - alignment.start)
        shown = units.text(value, unit, ".3g")
        sentence = f"a sample is off the smooth curve by {shown} at {time:.4f} s"
        if value > limit:
            times = value / float(curve.sigma[worst, j])
            sentence += f", {times:.3g} times the noise: the motion jumps, or the sample is wrong"
            if not curve.noise.stated:
                largest = float(off.max())
                sentence += f"; if such errors are expected, use --noise {largest:.0e}"
        yield Finding(
            "Continuity", "joint", name, "sample_off_the_curve",
            judged(value <= limit, required=required), f"joint {name!r}: {sentence}",
            value=value, limit=limit, margin=limit - value, unit=unit, time=time,
        )  # fmt: skip


def _about(alignment: Alignment, allowed: FloatArray, units: Units) -> Iterator[Finding]:
    """The assumptions about the log, and its resolution."""
    curve, log = alignment.curve, alignment.curve.log
    noise, joints = curve.noise, list(zip(log.joint_names, log.joint_units, strict=True))
    origin = "as given" if noise.stated else "estimated from the samples and their digits"
    for (name, unit), value in zip(joints, noise.position.tolist(), strict=True):
        size = units.text(value, unit, ".2g")
        message = f"joint {name!r}: samples are off by {size} (standard deviation), {origin}"
        yield _number(name, "noise", value, unit, message)
    for order, quantity in enumerate(DERIVATIVES[:3]):
        errors = _unknown(alignment, order, None).tolist()
        for (name, unit), value in zip(joints, errors, strict=True):
            size = units.text(value, rate_unit(unit, order), ".2g")
            message = f"joint {name!r}: the log resolves {quantity} to {size} at worst"
            yield _number(name, f"{quantity}_known_to", value, rate_unit(unit, order), message)
    largest: dict[str, float] = {}
    for (_, unit), value in zip(joints, noise.position.tolist(), strict=True):
        largest[unit] = max(value, largest.get(unit, 0.0))
    sizes = ", ".join(units.text(value, unit, ".2g") for unit, value in largest.items())
    yield _information(
        "log",
        f"log: {log.time.size} samples, every {1e3 * log.period:.4g} ms, smoothed by "
        f"{curve.trajectory.breaks.size - 1} cubics; noise {sizes} and jitter "
        f"of time stamps {1e3 * noise.jitter:.2g} ms, {origin}",
    )
    if log.notes:
        yield _information("left_out", f"left out or mended: {'; '.join(log.notes)}")
    beyond = log.time[(np.abs(curve.residuals) > allowed).any(axis=1)]
    missed = [span for span in curve.missed if ((beyond >= span[0]) & (beyond <= span[1])).any()]
    if missed:
        start, end = (time - alignment.start for time in missed[0])
        times = f", {len(missed)} times, first" if len(missed) > 1 else ""
        message = (
            f"the motion changes faster than the log resolves{times}, from {start:.4f} s to "
            f"{end:.4f} s: it is uncertain there"
        )
        yield Finding("Warnings", "motion", "", "too_coarse", "warning", message, time=float(start))


def _information(quantity: str, message: str, brief: str = "") -> Finding:
    return Finding(GROUP, "motion", "", quantity, "information", message, brief=brief)


def _number(name: str, quantity: str, value: float, unit: str, message: str) -> Finding:
    return Finding(
        GROUP, "joint", name, quantity, "information", message, value=value, unit=unit,
        proof="sampled",
    )  # fmt: skip
