"""What the least time is traded for: torque and jerk over the duration of one scenario."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from knotwork import metrics, storage
from knotwork.documents import REMOVED, Document, Edits, edited
from knotwork.errors import InputError, TimingError
from knotwork.joint_quantities import rate_unit
from knotwork.pipeline import Plan, plan
from knotwork.robot import Robot
from knotwork.scenario import Scenario, load_scenario, scenario_of
from knotwork.timing import Progress
from knotwork.timing.watch import Budget
from knotwork.trajectory import JointTrajectory
from knotwork.units import SI, Units

FACTORS = (1.0, 1.05, 1.1, 1.2, 1.4, 1.8)
"""Durations that are tried by default, in least times."""

JERK_PARTS = (10.0, 100.0)
"""Where the motion of least torque fails its check, the integral of jerk squared is weighed so many
times as heavily as that of torque, by turns."""

LEAST_SHARE = 0.05
"""When a budget has ended, each plan that is left still has so much [s]."""

NODES = 6
"""Points of Gauss and Legendre in each piece, for integrals of torque."""


@dataclass(frozen=True)
class TradeoffPoint:
    """One duration, and what the motion of that duration takes.

    Attributes:
        factor: The duration in least times.
        duration: [s].
        squared_effort: Integral of the sum of torques squared [N² m² s]; `None` without a robot.
        peak_effort: Torque of the joint nearest its limit, or the largest [N m or N]; `None`
            without a robot.
        effort_use: Part of that limit that is used; `None` where there is none.
        effort_joint: The joint; empty without a robot.
        peak_jerk: Jerk of the joint nearest its limit, or the largest, in `jerk_unit`.
        jerk_use: Part of that limit that is used; `None` where there is none.
        jerk_joint: The joint.
        jerk_unit: Of its jerk, `"rad/s³"` or `"m/s³"`.
        ok: The motion passes the check.
        objective: What is made least: `"time"`, `"effort"`, `"effort and jerk"` or `"jerk"`.
        failure: What fails first, of this motion or of that of least torque in whose place it
            stands; empty if nothing does.
        stopped: The budget ended before the motion was the best.
    """

    factor: float
    duration: float
    squared_effort: float | None
    peak_effort: float | None
    effort_use: float | None
    effort_joint: str
    peak_jerk: float
    jerk_use: float | None
    jerk_joint: str
    jerk_unit: str
    ok: bool
    objective: str = "time"
    failure: str = ""
    stopped: bool = False


@dataclass(frozen=True)
class Tradeoff:
    """The curve of duration against torque and jerk.

    Attributes:
        scenario: Name of the scenario.
        objective: What is made least at each duration: `"effort"` or, without a robot, `"jerk"`.
        points: From the least time on.
        left_out: Factors of durations for which the budget ended before a motion was found.
        units: Those of the scenario, for whatever people read; points are in SI.

    >>> swing = [{"joints": {"a": 0}}, {"joints": {"a": 1}, "after": "fastest"}]
    >>> limits = {"velocity": 2, "acceleration": 4}
    >>> curve = kw.tradeoff({"limits": limits, "waypoints": swing}, factors=[1, 2])
    >>> curve.objective, curve.points[0].peak_jerk > curve.points[1].peak_jerk
    ('jerk', True)
    """

    scenario: str
    objective: str
    points: tuple[TradeoffPoint, ...]
    left_out: tuple[float, ...] = ()
    units: Units = SI

    def to_dict(self) -> dict[str, Any]:
        """Give the curve as plain data, ready for JSON."""
        return {
            "scenario": self.scenario,
            "objective": self.objective,
            "points": [asdict(point) for point in self.points],
            "left_out": list(self.left_out),
        }

    def to_csv(self) -> str:
        """Write the curve as CSV, a row a duration."""
        names = [item.name for item in fields(TradeoffPoint)]
        return storage.rows_to_csv(names, map(asdict, self.points))

    def save(self, folder: str | Path) -> list[Path]:
        """Write `tradeoff.json` and `tradeoff.csv` into a folder, both or none.

        Raises:
            InputError: The folder can't be written to.
        """
        return storage.write_files(
            folder,
            {"tradeoff.json": storage.to_json(self.to_dict()), "tradeoff.csv": self.to_csv()},
        )


def tradeoff(
    scenario: str | Path | Mapping[str, Any] | Scenario,
    factors: Sequence[float] = FACTORS,
    *,
    budget: float | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> Tradeoff:
    """Plan a scenario with free times for several durations, from the least one on.

    At each duration the motion is the one of least torque (the integral of torques squared), or
    without a robot of least jerk; at the least time itself it is the fastest. What stands around is
    not known where times are chosen, and least torque may fold an arm into itself. Where the motion
    of least torque fails its check, one that weighs jerk more takes its place, if it passes.

    Args:
        scenario: As for `knotwork.plan`; with times that are free. Its own objective and duration
            are left out.
        factors: Durations, in least times, each at least 1.
        budget: Time that the solver has for all of them [s]: the least time comes first, and each
            other gets an equal part of what is left; the best motion found in it is taken. By
            default it is not limited.
        progress: Called as the solver goes on.

    Raises:
        InputError: No time is free, a factor is less than 1, a duration can't be planned, or no
            motion of the least duration was found within the budget. A longer duration for which
            none was found in time is left out.

    >>> swing = [{"joints": {"a": 0}}, {"joints": {"a": 1}, "after": "fastest"}]
    >>> limits = {"velocity": 2, "acceleration": 4, "jerk": 40}
    >>> curve = kw.tradeoff({"limits": limits, "waypoints": swing}, factors=[1, 2])
    >>> curve.points[0].peak_jerk > 4 * curve.points[1].peak_jerk
    True
    """
    if not isinstance(scenario, Scenario):
        scenario = load_scenario(scenario)
    if scenario.free is None or not scenario.free.duration.any():
        raise InputError(
            f"{scenario.name}: no time is free, so nothing can be traded; accepted: a scenario "
            "with times: fastest or after: fastest"
        )
    wrong = [factor for factor in factors if not 1.0 <= factor < np.inf]
    if wrong or not len(factors):
        given = f"{wrong[0]:g} is less than 1, or not finite" if wrong else "none is given"
        raise InputError(f"factors of the least time: {given}; accepted: numbers of 1 or more")
    objective = "effort" if scenario.robot is not None else "jerk"
    document = scenario.free.document
    bare: Edits = {(key,): REMOVED for key in ("duration", "objective") if key in document.data}
    tried = sorted(set(factors))
    share = _Shares(Budget(budget), 1 + sum(factor != 1.0 for factor in tried), progress)
    fastest = share.plan(scenario_of(edited(document, bare)))
    least = fastest.trajectory.duration
    points: list[TradeoffPoint] = []
    left_out: list[float] = []
    for factor in tried:
        if factor == 1.0:
            points.append(_point(fastest, factor, "time"))
            continue
        wanted = {**bare, ("duration",): factor * least}
        try:
            points.append(_smoothest(document, wanted, factor, objective, share, fastest))
        except TimingError as error:
            if error.limit != "budget":
                raise
            left_out.append(factor)
    return Tradeoff(scenario.name, objective, tuple(points), tuple(left_out), scenario.units)


@dataclass
class _Shares:
    """Plans, and gives each of several plans its part of a budget.

    Attributes:
        budget: For all of them.
        left: How many are to come.
        progress: Called as the solver goes on.
    """

    budget: Budget
    left: int
    progress: Callable[[Progress], None] | None

    @property
    def over(self) -> bool:
        """Whether the budget has ended."""
        return self.budget.now() > self.budget.end()

    def plan(self, scenario: Scenario, *, warm: Plan | None = None, again: bool = False) -> Plan:
        """Plan, from a start; `again` if it is in the place of one that failed its check."""
        share = None
        if self.budget.seconds is not None:
            # what all others are measured by comes first, and may take all there is
            parts = 1 if warm is None else max(self.left + again, 1)
            share = max(self.budget.turn(1 / parts) - self.budget.now(), LEAST_SHARE)
        self.left -= not again
        return plan(scenario, budget=share, progress=self.progress, warm=warm)


def _smoothest(
    document: Document, wanted: Edits, factor: float, objective: str, share: _Shares, fastest: Plan
) -> TradeoffPoint:
    """The motion of least torque that passes its check; else one in which jerk counts as well."""

    def made(weights: str | dict[str, float], again: bool = True) -> Plan:
        asked = edited(document, {**wanted, ("objective",): weights})
        return share.plan(scenario_of(asked), warm=fastest, again=again)

    first = made(objective, again=False)
    if first.report.ok or objective == "jerk" or first.space.robot is None:
        return _point(first, factor, objective)
    jerk = metrics.integral_of_square(first.trajectory, 3)
    heavy = squared_effort(first.space.robot, first.trajectory) / jerk
    failure = str(first.report.failures[0])
    for part in JERK_PARTS:
        if share.over:
            break
        other = made({"effort": 1.0, "jerk": part * heavy})
        if other.report.ok:
            return _point(other, factor, "effort and jerk", failure)
    if not share.over:
        other = made("jerk")
        if other.report.ok:
            return _point(other, factor, "jerk", failure)
    return _point(first, factor, objective)


def _point(made: Plan, factor: float, objective: str, failure: str = "") -> TradeoffPoint:
    robot, motion = made.space.robot, made.trajectory
    jerk = metrics.peak(motion, 3, made.space.limits["jerk"])
    squared, torque, use, joint = None, None, None, ""
    if robot is not None:
        from knotwork.verification import torque_bound

        squared = squared_effort(robot, motion)
        bounds = torque_bound(robot, motion)
        shares = [abs(one.value) / one.limit if one.limit else 0.0 for one in bounds]
        values = [abs(one.value) for one in bounds]
        worst = int(np.argmax(shares if any(shares) else values))
        torque, joint = values[worst], motion.joint_names[worst]
        use = shares[worst] or None
    jerk_unit = rate_unit(motion.joint_units[motion.joint_names.index(jerk.joint)], 3)
    return TradeoffPoint(
        factor, motion.duration, squared, torque, use, joint,
        jerk.value, jerk.use, jerk.joint, jerk_unit, made.report.ok, objective,
        failure or next((str(one) for one in made.report.failures), ""),
        made.chosen is not None and made.chosen.status == "stopped",
    )  # fmt: skip


def squared_effort(robot: Robot, motion: JointTrajectory) -> float:
    """Integral of the sum of the joints' torques squared [N² m² s], by Gauss and Legendre.

    >>> made = kw.plan("ur5_deburring")
    >>> squared_effort(made.space.robot, made.trajectory) > 0
    True
    """
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    total = 0.0
    for start, end in zip(motion.breaks[:-1], motion.breaks[1:], strict=True):
        half = 0.5 * (end - start)
        times = start + half * (1.0 + nodes)
        rows = zip(*(motion.polynomial(times, order) for order in range(3)), strict=True)
        torques = np.array([robot.torque(*row) for row in rows])
        total += half * float(weights @ (torques**2).sum(axis=1))
    return float(total)
