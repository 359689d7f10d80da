"""Outcome of a row: its verdict, the reason of a failure, and its figures."""

from __future__ import annotations

import time
from collections.abc import Collection
from dataclasses import dataclass, field, replace
from functools import cache, partial
from itertools import groupby

from knotwork import errors
from knotwork.files.documents import Document, Edits, Location
from knotwork.planning import Plan, plan
from knotwork.scenario import ScenarioWaypoint
from knotwork.spline.polynomial.refined import cut_curve
from knotwork.sweeps.field_path import scenario_with
from knotwork.sweeps.figures import FIGURES, RowFigure
from knotwork.verification.bounds.clearance import CLEARANCE_INTERVALS
from knotwork.verification.checked_motion import Motion
from knotwork.verification.collisions import collisions
from knotwork.verification.effort_checks import effort_limits
from knotwork.verification.limits import joint_limits
from knotwork.verification.tool_motion import singularity
from knotwork.waypoints import CartesianWaypoint

ROW_PASSED, ROW_FAILED, ROW_REFUSED = "passed", "failed", "refused"
"""Verdicts: all checks pass; one fails; there is no motion."""
ROW_TIME_LIMIT, ROW_CRASHED = "time limit", "crashed"
"""Verdicts: the time limit was exceeded; the process crashed."""
ROW_WRONG_INPUT = "wrong input"
# The first matching class decides.
_REASONS: tuple[tuple[type[Exception], str], ...] = (
    (errors.OutOfReachError, "out of reach"),
    (errors.BranchError, "branch"),
    (errors.SingularityError, "singularity"),
    (errors.FollowingError, "path not followed"),
    (errors.CollisionError, "collision at the start"),
    (errors.TimingError, "no time found"),
    (errors.PathError, "path not made"),
    (errors.TaskError, "task"),
    (errors.InputError, ROW_WRONG_INPUT),
)


INSTANT = 1e-3
"""Length of motion examined for one time [s]."""
SAME_PLACE = 1 / CLEARANCE_INTERVALS
"""Precision of the place of a worst value, as a fraction of the motion."""
SAME_VALUE = 1e-6
"""Relative tolerance of equal values."""


@dataclass(frozen=True)
class Outcome:
    """Outcome of one scenario.

    Attributes:
        verdict: One of the verdicts above.
        reason: Reason of a failure, in few words; else empty.
        message: Reason as a sentence; for a motion that passes, the number of sampled requirements.
        figures: Figures by name; `None` without a motion, or if the report does not have it.
        plan_time: Planning time [s].
    """

    verdict: str
    reason: str = ""
    message: str = ""
    figures: dict[str, float | None] = field(default_factory=dict)
    plan_time: float = 0.0


def outcome_of(document: Document, edits: Edits) -> Outcome:
    """Plan a document with other values."""
    begin = time.perf_counter()
    try:
        motion = plan(scenario_with(document, edits))
        return _with_motion(motion, edits, time.perf_counter() - begin)
    except Exception as error:  # an internal error in one row does not stop the others
        return _without_motion(error, time.perf_counter() - begin)


def _with_motion(motion: Plan, varied: Collection[Location], plan_time: float) -> Outcome:
    figures, failures = row_figures(motion, varied), motion.report.failures
    if failures:
        return Outcome(ROW_FAILED, failures[0].title, str(failures[0]), figures, plan_time)
    sampled = len(motion.report.sampled)
    are = "is" if sampled == 1 else "are"
    message = f"{sampled} of its requirements {are} sampled only" if sampled else ""
    return Outcome(ROW_PASSED, "", message, figures, plan_time)


def _without_motion(error: Exception, plan_time: float) -> Outcome:
    for kind, reason in _REASONS:
        if isinstance(error, kind):
            return Outcome(ROW_REFUSED, reason, str(error), {}, plan_time)
    message = f"internal error: {type(error).__name__}: {error}"
    return Outcome(ROW_CRASHED, ROW_CRASHED, message, {}, plan_time)


def row_figures(plan: Plan, varied: Collection[Location] = ()) -> dict[str, float | None]:
    """All figures of a row, by name.

    Args:
        plan: The motion.
        varied: Locations in the scenario's document that differ between rows.
    """
    shared_times, stretches = _split_motion(plan, varied)
    cut = cache(partial(_cut_plan, plan))

    def compute(figure: RowFigure) -> float | None:
        value = figure.value_of(plan)
        if value is None or not figure.at_rest or not stretches:
            return value
        worst_times = [
            finding.time
            for finding in plan.report.select(quantity=figure.at_rest)
            if finding.time is not None and value in (finding.value, finding.use)
        ]
        near = SAME_PLACE * plan.trajectory.duration
        at = [t for t in shared_times if any(abs(time - t) <= near for time in worst_times)]
        if any(_is_as_bad(figure.value_of(cut(t, t)), value, figure) for t in at):
            remaining = (figure.value_of(cut(*stretch)) for stretch in stretches)
            worst = min if figure.more_is_better else max
            return worst((x for x in remaining if x is not None), default=None)
        return value

    return {name: compute(figure) for name, figure in FIGURES.items()}


def _split_motion(
    plan: Plan, varied: Collection[Location]
) -> tuple[list[float], list[tuple[float, float]]]:
    """Times [s] of waypoints that all rows share, and time intervals between other ones."""
    handled = {name for held in plan.scenario.scene.held for name in (held.take, held.leave)}

    def is_shared(waypoint: ScenarioWaypoint) -> bool:
        if isinstance(waypoint, CartesianWaypoint) or waypoint.name in handled:
            return False
        where = waypoint.location
        return not any(place[: len(where)] == where[: len(place)] for place in varied)

    shared_times: list[float] = []
    stretches: list[tuple[float, float]] = []
    for is_alike, waypoints in groupby(plan.scenario.waypoints, key=is_shared):
        times = [waypoint.time for waypoint in waypoints]
        if is_alike:
            shared_times += times
        else:
            stretches.append((times[0], times[-1]))
    return shared_times, stretches


def _cut_plan(plan: Plan, start: float, end: float) -> Plan:
    """The plan cut to a time interval, with everything that figures use."""
    motion = plan.trajectory
    if end - start < INSTANT:
        start = min(start, motion.end_time - INSTANT)
        start, end = max(start, motion.start_time), min(start + INSTANT, motion.end_time)
    curve = cut_curve(motion.polynomial, start, end)
    cut = replace(motion, polynomial=curve, waypoint_times=None)
    arguments = Motion(cut, plan.space), plan.scenario, plan.space
    checks = (joint_limits, effort_limits, singularity, collisions)
    findings = tuple(finding for check in checks for finding in check(*arguments))
    report = replace(plan.report, start_time=start, end_time=end, findings=findings)
    return replace(plan, trajectory=cut, report=report)


def _is_as_bad(value: float | None, reference: float, figure: RowFigure) -> bool:
    """Whether a value is known, and no better than a reference."""
    if value is None:
        return False
    gain = value - reference if figure.more_is_better else reference - value
    return gain <= SAME_VALUE * abs(reference)
