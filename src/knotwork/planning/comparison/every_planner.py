"""One scenario planned and scored with several planners."""

from __future__ import annotations

import timeit
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from knotwork.curves.interpolation import PLANNERS, PlannerOptions, get_planner, rules
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import InputError
from knotwork.files import storage
from knotwork.joint_quantities import RATE_QUANTITIES
from knotwork.planning import Plan, plan
from knotwork.planning.comparison.scores import Refusal, Score, flatten
from knotwork.planning.planner_options import planner_options, supported_options
from knotwork.task import Task
from knotwork.task.scenario import Scenario, load_scenario
from knotwork.units import SI, Units
from knotwork.verification import Report, check, metrics
from knotwork.verification.brief import worst_failure_text
from knotwork.verification.finding import Group
from knotwork.waypoints import JointWaypoints

TIMED_RUNS = 5
"""Number of timed runs of a planner. The fastest counts, because the first also loads modules."""


@dataclass(frozen=True)
class Comparison:
    """A scenario planned by several planners.

    Attributes:
        scenario: Name of the scenario.
        rows: A score or a refusal for each planner.
        trajectories: The motions by planner.
        times_chosen: Whether the scenario has unknown times or speeds. They are chosen once, for
            all planners; `modified-hermite` without a rule is the chosen motion.
        units: Units of the scenario, for tables; all figures here are in SI.

    >>> comparison = kw.compare("paper_case", ["modified-hermite", "cubic"])
    >>> {name: motion.continuity.order for name, motion in comparison.trajectories.items()}
    {'modified-hermite': 2, 'cubic': 1}
    """

    scenario: str
    rows: tuple[Score | Refusal, ...]
    trajectories: Mapping[str, JointTrajectory]
    times_chosen: bool = False
    units: Units = SI

    @property
    def scores(self) -> tuple[Score, ...]:
        """Rows of the planners that succeeded."""
        return tuple(row for row in self.rows if isinstance(row, Score))

    def to_dict(self) -> dict[str, Any]:
        """Return the comparison as plain data, ready for JSON."""
        rows = [asdict(row) for row in self.rows]
        return {"scenario": self.scenario, "times_chosen": self.times_chosen, "planners": rows}

    def to_csv(self) -> str:
        """Return the comparison as CSV, one row per planner; a peak takes four columns."""
        rows = [flatten(row) for row in self.rows]
        columns = {name: None for row in sorted(rows, key=len, reverse=True) for name in row}
        return storage.rows_to_csv(list(columns), rows)

    def save(self, folder: str | Path) -> list[Path]:
        """Write `comparison.json` and `comparison.csv` into a folder, both or none.

        Raises:
            InputError: The folder can't be written to.
        """
        return storage.write_files(
            folder,
            {"comparison.json": storage.json_text(self.to_dict()), "comparison.csv": self.to_csv()},
        )


_BY_RULE = {planner: rules(planner) for planner in ("modified-hermite", "quintic")}
DEFAULT_PLANNERS = tuple(
    name
    for planner in PLANNERS
    for name in (planner, *(f"{planner}:{rule}" for rule in _BY_RULE.get(planner, ())))
)
"""Planners compared by default: all, and two with each of their rules, which others share."""


def compare(
    scenario: str | Path | Mapping[str, Any] | Task | Scenario,
    planners: Sequence[str] | None = None,
) -> Comparison:
    """Plan a scenario with several planners and score the motions.

    Every planner gets the joint waypoints of `knotwork.plan` for the scenario, and the options of
    the scenario that it supports. Only the scenario's own planner gets accelerations and higher
    derivatives at waypoints. Unknown times and speeds are chosen once, for all planners.

    >>> comparison = kw.compare("paper_case", ["modified-hermite", "cubic"])
    >>> {row.planner: round(row.acceleration_jump, 4) for row in comparison.scores}
    {'modified-hermite': 0.0, 'cubic': 0.0175}

    Args:
        scenario: As for `knotwork.plan`.
        planners: Names of planners; a rule may follow after a colon: `septic:estimated`. By
            default `DEFAULT_PLANNERS`, without those whose rule gives the same motion as the
            planner without it.

    Raises:
        UnknownNameError: A planner or rule is unknown.
        InputError: The scenario is wrong, or a waypoint is infeasible.
    """
    requested = [planners] if isinstance(planners, str) else planners
    names = list(dict.fromkeys(DEFAULT_PLANNERS if requested is None else requested))
    if not names:
        raise InputError(f"no planner is given; accepted: {', '.join(PLANNERS)}")
    for name in names:
        get_planner(name)
    if not isinstance(scenario, Scenario):
        scenario = load_scenario(scenario)
    with scenario.locations.errors_at("planner"):
        get_planner(scenario.planner)
    base_plan = _base_plan(scenario)
    own_options = planner_options(base_plan.scenario, base_plan.joints)
    rows: list[Score | Refusal] = []
    trajectories: dict[str, JointTrajectory] = {}
    for name in names:
        options = own_options
        if name != scenario.planner:
            options, _ = supported_options(own_options, scenario.planner, name)
        try:
            trajectory, seconds = _time_planner(name, base_plan.joint_waypoints, options)
        except InputError as error:
            rows.append(Refusal(name, str(error)))
            continue
        without_rule = trajectories.get(name.partition(":")[0])
        if planners is None and without_rule and _same_motion(trajectory, without_rule):
            continue
        trajectories[name] = trajectory
        rows.append(_score(name, trajectory, seconds, base_plan))
    return Comparison(
        scenario.name, tuple(rows), trajectories, scenario.unknowns is not None, scenario.units
    )


def _base_plan(scenario: Scenario) -> Plan:
    """Plan a scenario to get the joint waypoints for all planners.

    If the scenario's own planner refuses, they come from a planner that accepts any waypoints.
    """
    try:
        return plan(scenario)
    except InputError:
        return plan(scenario, planner="cubic")


def _same_motion(first: JointTrajectory, second: JointTrajectory) -> bool:
    a, b = first.polynomial, second.polynomial
    return np.array_equal(a.x, b.x) and np.array_equal(a.c, b.c)


def _time_planner(
    name: str, waypoints: JointWaypoints, options: PlannerOptions
) -> tuple[JointTrajectory, float]:
    planner = get_planner(name)
    seconds = timeit.repeat(lambda: planner(waypoints, options), number=1, repeat=TIMED_RUNS)
    return planner(waypoints, options), min(seconds)


def _score(name: str, trajectory: JointTrajectory, seconds: float, base_plan: Plan) -> Score:
    scenario, joints, waypoints = base_plan.scenario, base_plan.joints, base_plan.joint_waypoints
    deviation = None
    if joints.robot is not None:
        from knotwork.verification.metrics.deviation import straight_path_deviation

        paths = scenario.paths
        deviation = straight_path_deviation(joints.robot, trajectory, scenario.waypoints, paths)
    report = base_plan.report
    if not _same_motion(trajectory, base_plan.trajectory):
        known = report.select(group=Group.FEASIBILITY)
        report = check(trajectory, scenario, joints=joints, known=known)
    deviations = _values_and_limits(report, "path", "path_deviation")
    speeds = _values_and_limits(report, "path", "path_speed")
    clearances = _values_and_limits(report, "pair", "clearance")
    speed_tolerance = scenario.tolerances.path_speed
    _, required = report.counts
    jerk_bounded = trajectory.continuity.order >= 2
    peaks = {
        name: metrics.peak(trajectory, order, joints.limits[name])
        for order, name in enumerate(RATE_QUANTITIES, 1)
    }
    return Score(
        planner=name,
        position_miss=metrics.position_miss(trajectory, waypoints),
        velocity_miss=metrics.velocity_miss(trajectory, waypoints),
        acceleration_jump=metrics.acceleration_jump(trajectory),
        end_acceleration=metrics.end_acceleration(trajectory),
        peak_velocity=peaks["velocity"],
        peak_acceleration=peaks["acceleration"],
        peak_jerk=peaks["jerk"] if jerk_bounded else None,
        velocity_fluctuation=float(metrics.velocity_fluctuation(trajectory, waypoints).max()),
        squared_acceleration=metrics.integral_of_square(trajectory, 2),
        squared_jerk=metrics.integral_of_square(trajectory, 3) if jerk_bounded else None,
        straight_path_deviation=deviation.position if deviation is not None else None,
        straight_path_turn=deviation.orientation if deviation is not None else None,
        tool_path_deviation=max((value for value, _ in deviations), default=None),
        tool_path_speed_error=max(
            (speed_tolerance * value / limit for value, limit in speeds), default=None
        ),
        clearance=min((value - limit for value, limit in clearances), default=None),
        duration=trajectory.duration,
        required=required,
        failed=len(report.failures),
        time_to_plan=seconds,
        reason=worst_failure_text(report.failures, scenario.units),
    )


def _values_and_limits(report: Report, subject: str, quantity: str) -> list[tuple[float, float]]:
    """Values and limits of the selected findings that have both."""
    return [
        (finding.value, finding.limit)
        for finding in report.select(subject=subject, quantity=quantity)
        if finding.value is not None and finding.limit is not None
    ]
