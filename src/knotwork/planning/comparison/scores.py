"""Figures of the motions of several planners, and the best planner for each figure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from typing import Any

from knotwork.verification import metrics


@dataclass(frozen=True)
class Score:
    """Figures of one planner's motion for a scenario.

    Joint values are in rad or m; sums add rad and m as numbers.

    Attributes:
        planner: Name of the planner.
        position_miss: Largest error of a joint at a waypoint.
        velocity_miss: Largest error of a joint's velocity at a waypoint.
        acceleration_jump: Largest jump of a joint's acceleration inside the motion.
        end_acceleration: Largest magnitude of a joint's acceleration at start and end: the jump
            of an arm that starts and ends at rest.
        peak_velocity: Largest speed of the joint that comes nearest to its limit; without limits,
            of the fastest joint.
        peak_acceleration: The same for the acceleration.
        peak_jerk: The same for the jerk; `None` if the acceleration jumps, because the jerk is then
            unbounded.
        velocity_fluctuation: The largest of any joint, see
            `knotwork.verification.metrics.velocity_fluctuation`.
        squared_acceleration: Integral of acceleration squared over time, summed over the joints.
        squared_jerk: Integral of jerk squared over time, summed over the joints; `None` if the
            acceleration jumps.
        straight_path_deviation: Largest distance of the tool from straight lines between poses
            outside tool paths [m], sampled; `None` without such lines.
        straight_path_turn: Largest angle of the tool from its orientation along these lines [rad],
            sampled; `None` without such lines.
        tool_path_deviation: Largest distance of the tool from the scenario's tool paths in the
            check [m]; `None` without such paths.
        tool_path_speed_error: Largest deviation from the given speed along tool paths, relative to
            that speed; `None` without a given speed.
        clearance: Clearance of the nearest pair of bodies beyond the required one, as in the
            check [m]; `None` without pairs.
        duration: Duration [s].
        required, failed: Number of requirements in the check (waypoints, continuity, limits, tool
            paths and others), and number of those that fail.
        time_to_plan: Computing time of the planner, the best of a few runs [s].
        reason: Reason of a failure, in one line; empty if the motion passes.
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
    straight_path_deviation: float | None
    straight_path_turn: float | None
    tool_path_deviation: float | None
    tool_path_speed_error: float | None
    clearance: float | None
    duration: float
    required: int
    failed: int
    time_to_plan: float
    reason: str = ""

    @property
    def passed(self) -> bool:
        """Whether the motion meets all requirements."""
        return self.failed == 0


@dataclass(frozen=True)
class Refusal:
    """A scenario that a planner can't plan.

    Attributes:
        planner: Name of the planner.
        reason: Reason why the planner refuses.
    """

    planner: str
    reason: str


def flatten(row: Score | Refusal) -> dict[str, Any]:
    """Return the values of a row by column, without missing ones; a peak has four columns."""
    values: dict[str, Any] = {}
    for name, value in asdict(row).items():
        if isinstance(value, dict):
            values |= {f"{name}.{part}": number for part, number in value.items()}
        elif value is not None:
            values[name] = value
    return values


_NOT_RANKED = ("planner", "clearance", "duration", "required", "failed", "reason")
RANKED_COLUMNS = tuple(item.name for item in fields(Score) if item.name not in _NOT_RANKED)

TIE_TOLERANCE = 0.01
"""Relative difference from the best value up to which values are ties."""


def best(scores: Sequence[Score]) -> dict[str, set[str]]:
    """Find the planners with the best value of each column, among all that pass.

    Values within 1 % of the best are ties, and so are all values below 1e-9, which are rounding
    errors.

    >>> scores = kw.compare("paper_case", ["cubic", "modified-hermite", "septic"]).scores
    >>> best(scores)["squared_acceleration"]
    {'modified-hermite'}

    Args:
        scores: Scores of one scenario, such as `Comparison.scores`.
    """
    winners: dict[str, set[str]] = {}
    for column in RANKED_COLUMNS:
        values = {
            score.planner: ranking(getattr(score, column)) for score in scores if score.passed
        }
        known = {name: value for name, value in values.items() if value is not None}
        if known:
            lowest = max(min(known.values()), 0.0 if column == "time_to_plan" else 1e-9)
            highest = lowest * (1 + TIE_TOLERANCE)
            winners[column] = {name for name, value in known.items() if value <= highest}
    return winners


def ranking(value: metrics.Peak | float | None) -> float | None:
    """The number by which planners are ranked: for a peak its utilisation, if there is one."""
    if isinstance(value, metrics.Peak):
        return value.utilisation if value.utilisation is not None else value.value
    return value
