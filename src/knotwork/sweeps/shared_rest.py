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
from functools import cache, partial
from itertools import groupby

from knotwork.files.documents import Location
from knotwork.planning import Plan
from knotwork.scenario import ScenarioWaypoint
from knotwork.spline.polynomial.refined import cut_curve
from knotwork.sweeps.figures import FIGURES, RowFigure
from knotwork.verification.bounds.clearance import CLEARANCE_INTERVALS
from knotwork.verification.checked_motion import Motion
from knotwork.verification.collisions import collisions
from knotwork.verification.effort_checks import effort_limits
from knotwork.verification.limits import joint_limits
from knotwork.verification.tool_motion import singularity
from knotwork.waypoints import CartesianWaypoint

INSTANT = 1e-3
"""Length of motion examined for one time [s]."""
SAME_PLACE = 1 / CLEARANCE_INTERVALS
"""Precision of the place of a worst value, as a fraction of the motion."""
SAME_VALUE = 1e-6
"""Relative tolerance of equal values."""


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
