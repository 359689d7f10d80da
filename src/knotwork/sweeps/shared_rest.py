"""Figures of a row without the stops that all rows share.

A motion that begins at home is never better there than home is, whatever is varied. The same holds
at every waypoint with fixed joint values, unless an object is taken or released there. Fixed poses
do not count: rows are planned independently, and may reach them with other joint values. If such a
waypoint is the worst place of a motion, the figure can't rank rows. Then it is computed from the
rest only: from each other waypoint to the next one. Its figures are at least as good, so rows
with a worse motion elsewhere stay behind.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from functools import cache
from itertools import groupby

from knotwork.documents import Location
from knotwork.pipeline import Plan
from knotwork.polynomial.refined import part
from knotwork.scenario import ScenarioWaypoint
from knotwork.sweeps.figures import FIGURES, RowFigure
from knotwork.verification.bounds.clearance import PARTS
from knotwork.verification.checked_motion import Motion
from knotwork.verification.collisions import collisions
from knotwork.verification.effort_checks import effort_limits
from knotwork.verification.limits import joint_limits
from knotwork.verification.tool_motion import singularity
from knotwork.waypoints import CartesianWaypoint

INSTANT = 1e-3
"""Length of motion examined for one time [s]."""
NEAR = 1 / PARTS
"""Precision of the place of a worst value, as a fraction of the motion."""
AS_BAD = 1e-6
"""Relative tolerance of equal values."""


def row_figures(plan: Plan, varied: Collection[Location] = ()) -> dict[str, float | None]:
    """All figures of a row, by name.

    Args:
        plan: The motion.
        varied: Locations in the scenario's document that differ between rows.
    """
    shared, others = _divided(plan, varied)

    @cache
    def between(start: float, end: float) -> Plan:
        return _between(plan, start, end)

    def found(figure: RowFigure) -> float | None:
        whole = figure.of(plan)
        if whole is None or not figure.at_rest or not others:
            return whole
        worst = [
            one.time
            for one in plan.report.select(quantity=figure.at_rest)
            if one.time is not None and whole in (one.value, one.use)
        ]
        near = NEAR * plan.trajectory.duration
        at = [rest for rest in shared if any(abs(time - rest) <= near for time in worst)]
        values = [figure.of(between(time, time)) for time in at]
        if any(value is not None and _as_bad(value, whole, figure) for value in values):
            left = [value for one in others if (value := figure.of(between(*one))) is not None]
            return (min if figure.more_is_better else max)(left, default=None)
        return whole

    return {name: found(figure) for name, figure in FIGURES.items()}


def _divided(
    plan: Plan, varied: Collection[Location]
) -> tuple[list[float], list[tuple[float, float]]]:
    """Times [s] of waypoints that all rows share, and time intervals between other ones."""
    handled = {name for one in plan.scenario.scene.held for name in (one.take, one.leave)}

    def is_shared(one: ScenarioWaypoint) -> bool:
        if isinstance(one, CartesianWaypoint) or one.name in handled:
            return False
        where = one.location
        return not any(place[: len(where)] == where[: len(place)] for place in varied)

    shared: list[float] = []
    others: list[tuple[float, float]] = []
    for alike, waypoints in groupby(plan.scenario.waypoints, key=is_shared):
        times = [one.time for one in waypoints]
        if alike:
            shared += times
        else:
            others.append((times[0], times[-1]))
    return shared, others


def _between(plan: Plan, start: float, end: float) -> Plan:
    """The plan cut to a time interval, with everything that figures use."""
    motion = plan.trajectory
    if end - start < INSTANT:
        start = min(start, motion.end_time - INSTANT)
        start, end = max(start, motion.start_time), min(start + INSTANT, motion.end_time)
    curve = part(motion.polynomial, start, end)
    cut = replace(motion, polynomial=curve, waypoint_times=None)
    arguments = Motion(cut, plan.space), plan.scenario, plan.space
    checks = (joint_limits, effort_limits, singularity, collisions)
    findings = [one for look in checks for one in look(*arguments)]
    report = replace(plan.report, start_time=start, end_time=end, findings=tuple(findings))
    return replace(plan, trajectory=cut, report=report)


def _as_bad(value: float, whole: float, figure: RowFigure) -> bool:
    """Whether a value is no better than that of the whole motion."""
    better = value - whole if figure.more_is_better else whole - value
    return better <= AS_BAD * abs(whole)
