"""What makes a plan pass that fails: found by planning it with one change."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, TypeAlias

from knotwork.errors import InputError
from knotwork.verification import Finding
from knotwork.verification.collisions import GROUP as COLLISIONS
from knotwork.verification.collisions import failed_pairs
from knotwork.verification.limits import LIMITS
from knotwork.verification.report import TRIED

if TYPE_CHECKING:
    from knotwork.pipeline import Plan
    from knotwork.scenario import Scenario

    Changes: TypeAlias = Iterator[tuple[str, Scenario]]

GROUP = "Tried"
LEAST = 3
"""Changes take half as many motions as the plan did itself, and at least so many."""
PLANS = 3
"""Where it collides nowhere, they take as many as so many plans of its kind, up to `SOME`."""
SOME = 6
"""More than so many motions only half of those of the plan itself allow."""
SHORT = 1.0 / 3.0
"""A move is short if it has at most this part of the time of the longest beside it."""
LONGER = (2.0, 4.0)
"""So many times its time is tried for a short move."""
TURNS = (90, -90, 180)
"""So far the tool is turned about its own z axis where it collides [deg]."""


def with_remedies(plan: Plan) -> Plan:
    """Add to the report of a plan that fails with which change it passes, if one is found.

    Other knots are tried, the tool turned about its axis, more time for a short move, and other
    solutions than those asked for. How many motions are planned depends on the plan alone, so that
    the same is found on any machine.

    Args:
        plan: The plan; of one whose times were chosen nothing is tried.
    """
    if plan.report.ok or plan.chosen is not None:
        return plan
    said = _found(plan)
    if not said:
        return plan
    finding = Finding(GROUP, "motion", "", TRIED, "information", said)
    return replace(plan, report=replace(plan.report, findings=(*plan.report.findings, finding)))


class _Trials:
    """Plans of changed scenarios, as long as motions are left.

    Where the plan collides nowhere, each is planned with as many sequences of solutions as it was,
    and else with the best one.

    Attributes:
        left: So many motions may still be planned.
    """

    def __init__(self, plan: Plan) -> None:
        collides = bool(failed_pairs(plan.report.findings))
        some = LEAST if collides else min(PLANS * plan.sequences, SOME)
        self.left = max(some, plan.sequences // 2)
        self._each = 1 if collides else plan.sequences
        self._planner = plan.scenario.planner
        self._own_knots = _takes_knots(plan)

    def planned(self, changed: Scenario, least: int = 1) -> Plan | None:
        """The plan of a changed scenario; `None` if it has no motion.

        Args:
            changed: The scenario.
            least: It is planned with so many sequences, too, if so many motions are left.
        """
        from knotwork.pipeline import plan_fixed

        most = min(max(self._each, least), self.left)
        knots = changed.knots if self._own_knots else None
        try:
            made = plan_fixed(changed, most, planner=self._planner, knots=knots)
        except InputError:
            self.left -= 1
            return None
        self.left -= made.sequences
        return made


def _found(plan: Plan) -> str:
    """What was found by trying; else what is known of a short move; empty if it is nothing."""
    trials = _Trials(plan)
    short = _short_move(plan)
    longer = _with_longer(plan, short[0]) if short is not None else iter(())
    others = _without_branch(plan)
    kinds = [_with_balanced_knots(plan), _turned(plan), longer, others]
    found: list[str] = []
    lengthened = False
    while kinds and trials.left > 0:
        for kind in tuple(kinds):
            said, changed = next(kind, ("", None))
            if changed is None or trials.left < 1:
                kinds.remove(kind)
                continue
            # the best of other solutions is less often the right one
            made = trials.planned(changed, LEAST if kind is others else 1)
            lengthened |= kind is longer
            if made is not None and made.report.ok:
                found.append(said)
                kinds.remove(kind)
    if found:
        return f"tried: it passes {', or '.join(found)}"
    return "" if short is None or lengthened else _said_of_short(plan, *short)


def _said_of_short(plan: Plan, k: int, longest: float) -> str:
    """That the move to a waypoint is short, if something fails beside it; not that this is why."""
    beside = [i for i in (k - 1, k + 1) if i in _failing_moves(plan, *LIMITS, COLLISIONS)]
    if not beside:
        return ""
    return (
        f"the move {_ends(plan, k)} has {_duration(plan, k):g} s, beside one of {longest:.4g} s; "
        f"something fails {' and '.join(_ends(plan, i) for i in beside)}; more time for the short "
        "move was not tried"
    )


def _takes_knots(plan: Plan) -> bool:
    """Whether the planner takes the scenario's knots."""
    from knotwork.interpolation import PLANNER_SPECS, planner_and_rule

    name, rule = planner_and_rule(plan.scenario.planner)
    return "knots" in PLANNER_SPECS[name].supports and "knots" not in rule


def _with_balanced_knots(plan: Plan) -> Changes:
    """The scenario with balanced knots, if it has the paper's."""
    if _takes_knots(plan) and plan.scenario.knots == "paper":
        yield "with `knots: balanced`", replace(plan.scenario, knots="balanced")


def _without_branch(plan: Plan) -> Changes:
    """The scenario without `branch`, if it has one and fails in moves."""
    if plan.scenario.branch != "free" and _failing_moves(plan, *LIMITS, COLLISIONS):
        yield "without `branch`", replace(plan.scenario, branch="free")


def _duration(plan: Plan, k: int) -> float:
    """How long the move to a waypoint takes [s]."""
    first, last = plan.scenario.times[k - 1 : k + 1]
    return float(round(last - first, 9))


def _ends(plan: Plan, k: int) -> str:
    """Where the move to a waypoint begins and ends, in words."""
    first, last = plan.scenario.waypoints[k - 1 : k + 1]
    return f"from {first.name!r} to {last.name!r}"


def _failing_moves(plan: Plan, *groups: str) -> list[int]:
    """The waypoints at the ends of the moves in which findings of these groups fail."""
    times = plan.scenario.times
    failed = (one.at for one in plan.report.failures if one.group in groups)
    ends = (bisect_right(times, at) for at in failed if at is not None)
    return sorted({min(max(i, 1), len(times) - 1) for i in ends})


def _short_move(plan: Plan) -> tuple[int, float] | None:
    """Waypoint at the end of the shortest move among those that fail and those beside them.

    A short move can make those beside it swing out, beyond limits and into objects.

    Returns:
        Its index with the time of the longest beside it [s]; `None` if no move is short.
    """
    found = []
    for i in _failing_moves(plan, *LIMITS, COLLISIONS):
        near = [k for k in (i - 1, i, i + 1) if 0 < k < len(plan.scenario.times)]
        durations = {k: _duration(plan, k) for k in near}
        shortest = min(near, key=durations.__getitem__)
        if durations[shortest] <= SHORT * max(durations.values()):
            found.append((durations[shortest], shortest, max(durations.values())))
    return min(found)[1:] if found else None


def _turned(plan: Plan) -> Changes:
    """The scenario with the tool turned about its axis on both sides of what collides.

    Along tool paths, where joint values are given, and from where it takes an object to where it
    leaves it, it stays as it is.
    """
    import numpy as np
    import pinocchio as pin

    from knotwork.waypoints import CartesianWaypoint

    scenario = plan.scenario
    index = {one.name: k for k, one in enumerate(scenario.waypoints)}
    kept = [(path.first, path.last) for path in scenario.paths]
    kept += [(index[one.take], index[one.leave]) for one in scenario.scene.held]
    fixed = {k for first, last in kept for k in range(first, last + 1)}
    sides = {k for i in _failing_moves(plan, COLLISIONS) for k in (i - 1, i)}
    poses = {
        k: one
        for k in sorted(sides - fixed)
        if isinstance(one := scenario.waypoints[k], CartesianWaypoint)
    }
    if not poses:
        return
    names = " and ".join(repr(one.name) for one in poses.values())
    for turn in TURNS:
        rotation = pin.SE3(pin.rpy.rpyToMatrix(0.0, 0.0, np.radians(turn)), np.zeros(3))
        waypoints = list(scenario.waypoints)
        for k, one in poses.items():
            waypoints[k] = replace(one, pose=one.pose * rotation)
        yield (
            f"with the tool turned by {turn}° about its z axis at {names}",
            replace(scenario, waypoints=tuple(waypoints)),
        )


def _with_longer(plan: Plan, k: int) -> Changes:
    """The scenario with more time for the move to a waypoint, if its file says it in `after`."""
    from knotwork.documents import edited
    from knotwork.scenario import scenario_of

    document = plan.scenario.document
    if document is None:
        return
    name, duration = plan.scenario.waypoints[k].name, _duration(plan, k)
    for i, row in enumerate(document.data["waypoints"]):
        after = row.get("after")
        if row.get("name") != name or not isinstance(after, int | float):
            continue
        for factor in LONGER:
            longer = float(f"{factor * after:.2g}")
            said = f"with `after: {longer:g}` for {name!r} in place of {duration:g}"
            scenario = scenario_of(edited(document, {("waypoints", i, "after"): longer}))
            yield said, replace(scenario, knots=plan.scenario.knots)
