"""What makes a plan pass that fails: found by planning it with one change."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator, Mapping
from dataclasses import replace
from math import isfinite
from typing import TYPE_CHECKING, TypeAlias

from knotwork.errors import InputError
from knotwork.verification.collisions import GROUP as COLLISIONS
from knotwork.verification.collisions import failed_pairs
from knotwork.verification.finding import PASSES, Finding
from knotwork.verification.limits import LIMITS
from knotwork.verification.remedies import rounded_up

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
SLACK = (1.0, 1.3)
"""So many times as long as it would have to be alone is tried for a move that breaks limits."""
ORDERS = {"velocity": 1, "speed": 1, "acceleration": 2, "effort": 2, "jerk": 3}
"""With which power of the speed a quantity grows."""
AT_WAYPOINT = 1e-6
"""So near a waypoint a limit is broken at it [s]."""
LEAST_CHANGE = (0, 2, 3, 1)
"""Of the kinds of changes in `_found` those first that change the task least."""
TURNS = (90, -90, 180)
"""So far the tool is turned about its own z axis where it collides [deg]."""


def with_remedies(plan: Plan) -> Plan:
    """Add to the report of a plan that fails with which change it passes, if one is found.

    Other knots are tried, the tool turned about its axis, more time for moves that break limits or
    are short, and other solutions than those asked for. How many motions are planned depends on
    the plan alone, so that the same is found on any machine.

    Args:
        plan: The plan; of one whose times were chosen nothing is tried.
    """
    if plan.report.ok or plan.chosen is not None:
        return plan
    said = _found(plan)
    if not said:
        return plan
    finding = Finding(GROUP, "motion", "", PASSES, "information", said)
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
    """With which changes it passes, those first that change the task least; empty if with none."""
    trials = _Trials(plan)
    others = _without_branch(plan)
    kinds = [_with_balanced_knots(plan), _turned(plan), _with_longer(plan), others]
    rank = [kinds[i] for i in LEAST_CHANGE]
    found: list[tuple[int, str]] = []
    while kinds and trials.left > 0:
        for kind in tuple(kinds):
            said, changed = next(kind, ("", None))
            if changed is None or trials.left < 1:
                kinds.remove(kind)
                continue
            # the best of other solutions is less often the right one
            made = trials.planned(changed, LEAST if kind is others else 1)
            if made is not None and made.report.ok:
                found.append((rank.index(kind), said))
                kinds.remove(kind)
    return f"tried: it passes {', or '.join(said for _, said in sorted(found))}" if found else ""


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


def _failing_moves(plan: Plan, *groups: str) -> list[int]:
    """The waypoints at the ends of the moves in which findings of these groups fail."""
    times = plan.scenario.times
    failed = (one.at for one in plan.report.failures if one.group in groups)
    ends = (bisect_right(times, at) for at in failed if at is not None)
    return sorted({min(max(i, 1), len(times) - 1) for i in ends})


def _short_move(plan: Plan) -> int | None:
    """Waypoint at the end of the shortest move among those that fail and those beside them.

    A short move can make those beside it swing out, beyond limits and into objects.

    Returns:
        Its index; `None` if no move is short.
    """
    found = []
    for i in _failing_moves(plan, *LIMITS, COLLISIONS):
        near = [k for k in (i - 1, i, i + 1) if 0 < k < len(plan.scenario.times)]
        durations = {k: _duration(plan, k) for k in near}
        shortest = min(near, key=durations.__getitem__)
        if durations[shortest] <= SHORT * max(durations.values()):
            found.append((durations[shortest], shortest))
    return min(found)[1] if found else None


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


def _with_longer(plan: Plan) -> Changes:
    """The scenario with more time for moves that break limits, or for a short one."""
    needed, short = _needed(plan), _short_move(plan)
    wanted = []
    if short is not None:
        wanted += [{short: factor * _duration(plan, short)} for factor in LONGER]
    if needed:
        wanted += [{k: more * time for k, time in needed.items()} for more in SLACK]
    for durations in wanted:
        rounded = {k: rounded_up(duration, 2) for k, duration in durations.items()}
        yield from _lengthened(plan, rounded)


def _needed(plan: Plan) -> dict[int, float]:
    """How long moves would have to be that break limits on speeds, accelerations and the like.

    Slowed down as a whole they would keep them then. Of a move between other ones that is a guess.

    Returns:
        Durations [s] by the waypoint at the end of the move; none if a tool path breaks a limit,
        as its time follows from its speed.
    """
    times = plan.scenario.times
    on_paths = {k for path in plan.scenario.paths for k in range(path.first + 1, path.last + 1)}
    needed: dict[int, float] = {}
    for found in plan.report.failures:
        order = ORDERS.get(found.quantity.rpartition("_")[2])
        if found.group not in LIMITS or order is None or found.at is None or not found.use:
            continue
        k = min(max(bisect_right(times, found.at), 1), len(times) - 1)
        # at a waypoint it may come from either side
        moves = [k - 1, k] if abs(found.at - times[k - 1]) < AT_WAYPOINT and k > 1 else [k]
        if not isfinite(found.use) or k in on_paths:
            return {}
        for i in moves:
            duration = found.use ** (1.0 / order) * _duration(plan, i)
            if i not in on_paths:
                needed[i] = max(needed.get(i, 0.0), duration)
    return needed


def _lengthened(plan: Plan, durations: Mapping[int, float]) -> Changes:
    """The scenario with other durations of moves, if its file has numbers for them.

    Args:
        plan: The plan.
        durations: By the waypoint at the end of the move [s].
    """
    from knotwork.documents import edited
    from knotwork.scenario import scenario_of

    document = plan.scenario.document
    if document is None:
        return
    index = {one.name: k for k, one in enumerate(plan.scenario.waypoints)}
    edits: dict[tuple[str | int, ...], float] = {}
    said: list[str] = []
    later, others = 0.0, False
    for i, row in enumerate(document.data["waypoints"]):
        name = row.get("name") or f"waypoint {i + 1}"
        k = index.get(name, 0)
        key = next((one for one in ("after", "time") if isinstance(row.get(one), int | float)), "")
        more = durations[k] - _duration(plan, k) if k in durations else 0.0
        if more and not key:
            return
        later += more
        moved = later if key == "time" else more
        if moved:
            new = float(f"{row[key] + moved:.6g}")
            edits["waypoints", i, key] = new
            if more:
                said.append(f"`{key}: {new:g}` for {name!r} in place of {row[key]:g}")
            else:
                others = True
    if len(said) < len(durations):
        return
    try:
        scenario = scenario_of(edited(document, edits))
    except InputError:  # other times are not possible
        return
    after = ", and later times moved with it" if others else ""
    yield f"with {' and '.join(said)}{after}", replace(scenario, knots=plan.scenario.knots)
