"""One scenario, every planner, one table."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from knotwork import metrics, storage
from knotwork.errors import InputError
from knotwork.interpolation import PLANNERS, PlannerOptions, get_planner
from knotwork.pipeline import FEASIBILITY, Plan, plan
from knotwork.planner_options import planner_options, supported_options
from knotwork.scenario import Scenario, load_scenario
from knotwork.trajectory import JointTrajectory
from knotwork.units import SI, Units
from knotwork.verification import Report, check
from knotwork.verification.collisions import GROUP as COLLISIONS
from knotwork.verification.paths import GROUP as PATHS
from knotwork.waypoints import JointWaypoints


@dataclass(frozen=True)
class Score:
    """Figures of one planner's motion for a scenario.

    Joint values are in rad or m; where they are summed, rad and m are added as numbers.

    Attributes:
        planner: Name of the planner.
        position_miss: Largest error of a joint at a waypoint.
        velocity_miss: Largest error of a joint's velocity at a waypoint.
        acceleration_jump: Largest jump of a joint's acceleration between start and end.
        end_acceleration: Largest magnitude of a joint's acceleration at start and end: the step
            that an arm makes there from rest and to rest.
        peak_velocity: Largest magnitude of the joint nearest its limit; without limits, of any.
        peak_acceleration: The same for acceleration.
        peak_jerk: The same for jerk; `None` where the acceleration jumps: no bound holds there.
        velocity_fluctuation: That of the worst joint: see `knotwork.metrics.velocity_fluctuation`.
        squared_acceleration: Its integral over time, summed over the joints.
        squared_jerk: The same for jerk; `None` where the acceleration jumps: it is infinite.
        path_deviation: Distance of the tool from the straight path between poses [m], sampled;
            `None` where no poses follow each other without a tool path.
        path_turn: Angle of the tool from that path [rad], sampled; `None` likewise.
        tool_path_deviation: Largest distance of the tool from the scenario's tool paths that the
            check finds [m]; `None` without such paths.
        tool_path_speed_error: Largest difference from the speed asked for along them, as a part of
            it; `None` where no speed is asked for.
        clearance: How much nearer the nearest pair of bodies may come to one another than the check
            finds it [m]: its distance beyond the margin to keep; `None` where none is checked.
        duration: [s]
        required, failed: How much the check requires, and how much of that fails: waypoints,
            continuity, limits, tool paths and whatever else it looks at.
        time_to_plan: Time that the planner took, the best of a few runs [s].
    """

    planner: str
    position_miss: float
    velocity_miss: float
    acceleration_jump: float
    end_acceleration: float
    peak_velocity: metrics.Peak
    peak_acceleration: metrics.Peak
    peak_jerk: metrics.Peak | None
    velocity_fluctuation: float
    squared_acceleration: float
    squared_jerk: float | None
    path_deviation: float | None
    path_turn: float | None
    tool_path_deviation: float | None
    tool_path_speed_error: float | None
    clearance: float | None
    duration: float
    required: int
    failed: int
    time_to_plan: float

    @property
    def passed(self) -> bool:
        """Whether the motion does all that is required."""
        return self.failed == 0


@dataclass(frozen=True)
class Refusal:
    """A planner that can't do a scenario.

    Attributes:
        planner: Name of the planner.
        reason: Why.
    """

    planner: str
    reason: str


@dataclass(frozen=True)
class Comparison:
    """A scenario as several planners do it.

    Attributes:
        scenario: Name of the scenario.
        rows: A score or a refusal for each planner.
        trajectories: The motions by planner.
        times_chosen: The scenario leaves times or speeds free. They were chosen once, and every
            planner got them; `modified-hermite` without a rule is the chosen motion.
        units: Those of the scenario, for tables; all figures here are in SI.

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
        """Rows of the planners that can do the scenario."""
        return tuple(row for row in self.rows if isinstance(row, Score))

    def to_dict(self) -> dict[str, Any]:
        """Give the comparison as plain data, ready for JSON."""
        rows = [asdict(row) for row in self.rows]
        return {"scenario": self.scenario, "times_chosen": self.times_chosen, "planners": rows}

    def to_csv(self) -> str:
        """Write the comparison as CSV, a row a planner; a peak takes four columns."""
        rows = [_flat(row) for row in self.rows]
        names: list[str] = []
        for item in fields(Score):
            names += (
                [f"{item.name}.{part}" for part in _PARTS] if item.name in _PEAKS else [item.name]
            )
        names.append("reason")
        return storage.rows_to_csv(names, rows)

    def save(self, folder: str | Path) -> list[Path]:
        """Write `comparison.json` and `comparison.csv` into a folder, both or none.

        Raises:
            InputError: The folder can't be written to.
        """
        return storage.write_files(
            folder,
            {"comparison.json": storage.to_json(self.to_dict()), "comparison.csv": self.to_csv()},
        )


_PEAKS = ("peak_velocity", "peak_acceleration", "peak_jerk")
_PARTS = tuple(item.name for item in fields(metrics.Peak))


def _flat(row: Score | Refusal) -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for name, value in asdict(row).items():
        if name not in _PEAKS:
            flat[name] = value
        elif value is not None:
            flat.update({f"{name}.{part}": value[part] for part in _PARTS})
    return flat


_BY_RULE = {"modified-hermite": ("paper", "balanced"), "quintic": ("zero", "estimated")}
DEFAULT = tuple(
    name
    for planner in PLANNERS
    for name in (planner, *(f"{planner}:{rule}" for rule in _BY_RULE.get(planner, ())))
)
"""Planners that are compared by default: all of them, and two with each of their rules."""


def compare(
    scenario: str | Path | Mapping[str, Any] | Scenario, planners: Sequence[str] | None = None
) -> Comparison:
    """Plan a scenario with several planners and score what each makes of it.

    Every planner gets the joint waypoints that `knotwork.plan` takes for the scenario, and those
    of its options that it supports; what is given for each waypoint (accelerations and above) is
    for the scenario's own planner. Times and speeds that are free are chosen once, and every
    planner gets them.

    >>> comparison = kw.compare("paper_case", ["modified-hermite", "cubic"])
    >>> {row.planner: round(row.acceleration_jump, 4) for row in comparison.scores}
    {'modified-hermite': 0.0, 'cubic': 0.0175}

    Args:
        scenario: As for `knotwork.plan`.
        planners: Names of planners; a rule may follow after a colon: `septic:estimated`. By
            default all there are, and those in `DEFAULT` that have a rule, where it makes another
            motion than the scenario's own options do.

    Raises:
        UnknownNameError: There is no such planner or rule.
        InputError: The scenario is wrong, or a waypoint can't be met as asked.
    """
    by_default = planners is None
    names = list(DEFAULT) if planners is None else _names(planners)
    for name in names:
        get_planner(name)
    if not isinstance(scenario, Scenario):
        scenario = load_scenario(scenario)
    with scenario.error_context("planner"):
        get_planner(scenario.planner)
    base = _base(scenario)
    given = planner_options(base.scenario, base.space)
    rows: list[Score | Refusal] = []
    trajectories: dict[str, JointTrajectory] = {}
    for name in names:
        options = (
            supported_options(given, scenario.planner, name)[0]
            if name != scenario.planner
            else given
        )
        try:
            trajectory, seconds = _timed(name, base.joint_waypoints, options)
        except InputError as error:
            rows.append(Refusal(name, str(error)))
            continue
        plain = trajectories.get(name.partition(":")[0])
        if by_default and plain is not None and _same_motion(trajectory, plain):
            continue
        trajectories[name] = trajectory
        rows.append(_score(name, trajectory, seconds, base))
    return Comparison(
        scenario.name, tuple(rows), trajectories, scenario.free is not None, scenario.units
    )


def _base(scenario: Scenario) -> Plan:
    """The plan whose joint waypoints every planner gets.

    Where the scenario's own planner can't do it, it is that of one that can do any task.
    """
    try:
        return plan(scenario)
    except InputError:
        return plan(scenario, planner="cubic")


def _names(planners: Sequence[str]) -> list[str]:
    """Names of planners, each once.

    Raises:
        InputError: There is none.
    """
    names = list(dict.fromkeys([planners] if isinstance(planners, str) else planners))
    if not names:
        raise InputError(f"no planner to compare is given; accepted: {', '.join(PLANNERS)}")
    return names


def _same_motion(one: JointTrajectory, other: JointTrajectory) -> bool:
    a, b = one.polynomial, other.polynomial
    return np.array_equal(a.x, b.x) and np.array_equal(a.c, b.c)


# The first run of a planner loads its module; the best of a few is what the planning itself takes.
RUNS = 5


def _timed(
    name: str, waypoints: JointWaypoints, options: PlannerOptions
) -> tuple[JointTrajectory, float]:
    planner = get_planner(name)
    best = float("inf")
    for _ in range(RUNS):
        start = time.perf_counter()
        trajectory = planner(waypoints, options)
        best = min(best, time.perf_counter() - start)
    return trajectory, best


def _score(name: str, trajectory: JointTrajectory, seconds: float, base: Plan) -> Score:
    scenario, space, waypoints = base.scenario, base.space, base.joint_waypoints
    deviation = None
    if space.robot is not None:
        from knotwork.deviation import straight_path_deviation

        deviation = straight_path_deviation(
            space.robot, trajectory, scenario.waypoints, scenario.paths
        )
    report = base.report
    if not _same_motion(trajectory, base.trajectory):
        known = report.select(group=FEASIBILITY)
        report = check(trajectory, scenario, space=space, known=known)
    met, required = report.counts
    jerk_bounded = trajectory.continuity.order >= 2
    return Score(
        planner=name,
        position_miss=metrics.position_miss(trajectory, waypoints),
        velocity_miss=metrics.velocity_miss(trajectory, waypoints),
        acceleration_jump=metrics.acceleration_jump(trajectory),
        end_acceleration=metrics.end_acceleration(trajectory),
        peak_velocity=metrics.peak(trajectory, 1, space.limits["velocity"]),
        peak_acceleration=metrics.peak(trajectory, 2, space.limits["acceleration"]),
        peak_jerk=metrics.peak(trajectory, 3, space.limits["jerk"]) if jerk_bounded else None,
        velocity_fluctuation=float(metrics.velocity_fluctuation(trajectory, waypoints).max()),
        squared_acceleration=metrics.integral_of_square(trajectory, 2),
        squared_jerk=metrics.integral_of_square(trajectory, 3) if jerk_bounded else None,
        path_deviation=deviation.position if deviation is not None else None,
        path_turn=deviation.orientation if deviation is not None else None,
        **_along_paths(report, scenario.tolerances.path_speed),
        clearance=_clearance(report),
        duration=trajectory.duration,
        required=required,
        failed=required - met,
        time_to_plan=seconds,
    )


def _clearance(report: Report) -> float | None:
    """Distance of the nearest pair beyond its margin [m]."""
    found = report.select(group=COLLISIONS, quantity="clearance")
    return min(((one.value or 0.0) - (one.limit or 0.0) for one in found), default=None)


def _along_paths(report: Report, allowed: float) -> dict[str, Any]:
    """What the check finds along tool paths; speeds are allowed to be off by a part of theirs."""
    found = [one for one in report.findings if one.group == PATHS]
    worst: dict[str, float] = {}
    for one in found:
        if one.value is not None and one.limit is not None:
            off = one.value if one.quantity == "path_deviation" else allowed * one.value / one.limit
            worst[one.quantity] = max(off, worst.get(one.quantity, 0.0))
    return {
        "tool_path_deviation": worst.get("path_deviation"),
        "tool_path_speed_error": worst.get("path_speed"),
    }


_NOT_RANKED = ("planner", "clearance", "duration", "required")
COLUMNS = tuple(item.name for item in fields(Score) if item.name not in _NOT_RANKED)

TIE = 0.01
"""Part by which values may differ and share the star."""


def best(scores: Sequence[Score]) -> dict[str, set[str]]:
    """Planners that have the best value of each column among those that pass, by column.

    Values within 1 % of the best are ties and share it, and so do all below 1e-9: no machine is
    that exact.

    >>> scores = kw.compare("paper_case", ["cubic", "modified-hermite", "septic"]).scores
    >>> best(scores)["squared_acceleration"]
    {'modified-hermite'}

    Args:
        scores: Of one scenario, such as `Comparison.scores`.
    """
    winners: dict[str, set[str]] = {}
    for column in COLUMNS:
        values = {score.planner: size(getattr(score, column)) for score in scores if score.passed}
        given = {name: value for name, value in values.items() if value is not None}
        if given:
            least = max(min(given.values()), 0.0 if column == "time_to_plan" else 1e-9)
            winners[column] = {name for name, value in given.items() if value <= least * (1 + TIE)}
    return winners


def size(value: metrics.Peak | float | None) -> float | None:
    """The number that ranks a column: for a peak its use of the limit, if there is one."""
    if isinstance(value, metrics.Peak):
        return value.use if value.use is not None else value.value
    return value
