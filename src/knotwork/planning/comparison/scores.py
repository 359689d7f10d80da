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
        peak_velocity: Largest magnitude of the joint nearest its limit; without limits, of any.
        peak_acceleration: Peak of the acceleration.
        peak_jerk: Peak of the jerk; `None` where the acceleration jumps, as it is unbounded.
        velocity_fluctuation: Value of the worst joint:
            see `knotwork.verification.metrics.velocity_fluctuation`.
        squared_acceleration: Integral of acceleration squared over time, summed over the joints.
        squared_jerk: Integral of jerk squared over time, summed over the joints; `None` where the
            acceleration jumps.
        straight_path_deviation: Distance of the tool from straight lines between poses [m],
            sampled; `None` without consecutive poses off tool paths.
        straight_path_turn: Angle of the tool from them [rad], sampled; `None` without such poses.
        tool_path_deviation: Largest distance of the tool from the scenario's tool paths in the
            check [m]; `None` without such paths.
        tool_path_speed_error: Largest deviation from the given speed along them, as a fraction of
            it; `None` without a given speed.
        clearance: Clearance of the nearest pair of bodies beyond the required margin, as in the
            check [m]; `None` without pairs.
        duration: Duration [s].
        required, failed: Number of requirements in the check, and of the failed ones: waypoints,
            continuity, limits, tool paths and others.
        time_to_plan: Computing time of the planner, the best of a few runs [s].
        reason: Reason of a failure, in one line; empty if it passes.
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
        reason: Reason.
    """

    planner: str
    reason: str


def flatten(row: Score | Refusal) -> dict[str, Any]:
    """Flatten a row to known values by column, with four columns for a peak."""
    values: dict[str, Any] = {}
    for name, value in asdict(row).items():
        if isinstance(value, dict):
            values |= {f"{name}.{part}": number for part, number in value.items()}
        elif value is not None:
            values[name] = value
    return values


_NOT_RANKED = ("planner", "clearance", "duration", "required", "reason")
COLUMNS = tuple(item.name for item in fields(Score) if item.name not in _NOT_RANKED)

TIE_TOLERANCE = 0.01
"""Relative tolerance of ties."""


def best(scores: Sequence[Score]) -> dict[str, set[str]]:
    """Planners with the best value of each column among all that pass, by column.

    Values within 1 % of the best are ties and share it; so do all values below 1e-9, the limit
    of floating point.

    >>> scores = kw.compare("paper_case", ["cubic", "modified-hermite", "septic"]).scores
    >>> best(scores)["squared_acceleration"]
    {'modified-hermite'}

    Args:
        scores: Scores of one scenario, such as `Comparison.scores`.
    """
    winners: dict[str, set[str]] = {}
    for column in COLUMNS:
        values = {score.planner: size(getattr(score, column)) for score in scores if score.passed}
        known = {name: value for name, value in values.items() if value is not None}
        if known:
            lowest = max(min(known.values()), 0.0 if column == "time_to_plan" else 1e-9)
            highest = lowest * (1 + TIE_TOLERANCE)
            winners[column] = {name for name, value in known.items() if value <= highest}
    return winners


def size(value: metrics.Peak | float | None) -> float | None:
    """The number that ranks a column: for a peak its utilisation, if there is one."""
    if isinstance(value, metrics.Peak):
        return value.utilisation if value.utilisation is not None else value.value
    return value
