"""Figures of a row without the named configurations at which every row stands.

A motion that begins at home is never better there than home is, whatever is varied. Where such a
configuration of the robot file, passed at rest, is the worst of a motion, the figure does not tell
rows apart. Then it is taken over the task alone: from the first waypoint that the tool's pose, a
tool path or a held object gives to the last one. The task is no worse than the whole motion, so
rows whose motion is worse than that place somewhere stay behind.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

from knotwork.pipeline import Plan
from knotwork.polynomial.refined import part
from knotwork.sweeps.figures import FIGURES, RowFigure
from knotwork.verification.bounds.clearance import PARTS
from knotwork.verification.collisions import collisions
from knotwork.verification.limits import joint_limits
from knotwork.verification.motion import Motion
from knotwork.verification.tool_motion import singularity
from knotwork.waypoints import CartesianWaypoint

INSTANT = 1e-3
"""Length [s] of the stretch of motion that is examined for one time."""
REST = 1e-9
"""A joint that is slower stands [rad/s or m/s]."""
NAMED = 1e-9
"""Joints as near to a named configuration are in it [rad or m]."""
NEAR = 1 / PARTS
"""A worst value is located to this fraction of the motion."""
AS_BAD = 1e-6
"""Values that differ by a smaller part are equal."""


def row_figures(plan: Plan) -> dict[str, float | None]:
    """All figures of a row, by name."""
    rests, task = _rests(plan), _task(plan)

    @cache
    def between(start: float, end: float) -> Plan:
        return _between(plan, start, end)

    def found(figure: RowFigure) -> float | None:
        whole = figure.of(plan)
        if whole is None or not figure.at_rest or task is None:
            return whole
        worst = [
            one.time
            for one in plan.report.select(quantity=figure.at_rest)
            if one.time is not None and whole in (one.value, one.use)
        ]
        near = NEAR * plan.trajectory.duration
        at = [rest for rest in rests if any(abs(time - rest) <= near for time in worst)]
        values = [figure.of(between(time, time)) for time in at]
        if any(value is not None and _as_bad(value, whole, figure) for value in values):
            return figure.of(between(*task))
        return whole

    return {name: found(figure) for name, figure in FIGURES.items()}


def _task(plan: Plan) -> tuple[float, float] | None:
    """From when to when [s] the task lasts; `None` where it is given by joint values alone."""
    scenario = plan.scenario
    handled = {name for one in scenario.scene.held for name in (one.take, one.leave)}
    times = [
        one.time
        for one in scenario.waypoints
        if isinstance(one, CartesianWaypoint) or one.name in handled
    ]
    return (min(times), max(times)) if times else None


def _rests(plan: Plan) -> list[float]:
    """Times [s] at which the arm stands in a named configuration, outside its task."""
    task, robot, motion = _task(plan), plan.space.robot, plan.trajectory
    if task is None or robot is None:
        return []

    def is_named(time: float) -> bool:
        q = motion.position(time)
        return any(abs(q - one).max() <= NAMED for one in robot.configurations.values())

    return [
        one.time
        for one in plan.scenario.waypoints
        if not isinstance(one, CartesianWaypoint)
        and not task[0] <= one.time <= task[1]
        and abs(motion.velocity(one.time)).max() <= REST
        and is_named(one.time)
    ]


def _between(plan: Plan, start: float, end: float) -> Plan:
    """The plan as if the motion lasted from one time to another, with what figures look at."""
    motion = plan.trajectory
    if end - start < INSTANT:
        start = min(start, motion.end_time - INSTANT)
        start, end = max(start, motion.start_time), min(start + INSTANT, motion.end_time)
    curve = part(motion.polynomial, start, end)
    cut = replace(motion, polynomial=curve, waypoint_times=None)
    arguments = Motion(cut, plan.space), plan.scenario, plan.space
    findings = [one for look in (joint_limits, singularity, collisions) for one in look(*arguments)]
    report = replace(plan.report, start_time=start, end_time=end, findings=tuple(findings))
    return replace(plan, trajectory=cut, report=report)


def _as_bad(value: float, whole: float, figure: RowFigure) -> bool:
    """Whether a value is no better than that of the whole motion."""
    better = value - whole if figure.more_is_better else whole - value
    return better <= AS_BAD * abs(whole)
