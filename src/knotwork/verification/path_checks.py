"""Check of tool paths: distance, orientation and speed, over all time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

from knotwork.errors.plain_text import quoted_waypoint
from knotwork.task.scenario import Scenario, ScenarioPath, Stretch
from knotwork.task.scenario.scenario_joints import ScenarioJoints
from knotwork.verification.finding import Findings, Group, Proof, Topic, verdict_on
from knotwork.verification.limits import LimitedValue
from knotwork.verification.motion import Motion
from knotwork.waypoints import CartesianWaypoint, PoseFreedom

if TYPE_CHECKING:
    from knotwork.robot import Robot
    from knotwork.units import Units
    from knotwork.verification.bounds.path_criteria import PathBound, PathErrors
    from knotwork.verification.bounds.stretch_bounds import StretchBounds

CRITERION_UNITS = {
    "path_deviation": "m",
    "path_orientation": "rad",
    "path_turn": "rad",
    "path_progress": "m",
    "path_speed": "m/s",
    "path_ramp": "m/s",
}
"""SI unit of each criterion."""
PATH_LENGTH_DECIMALS = 9
"""Decimals of lengths along a path in texts [m]."""
POSE_TOLERANCE = 1e-9
"""Difference below which poses are equal, relative to their numbers."""
MAX_BULGE = 0.2
"""Maximum distance of a plausible curve from the line between two points, relative to the line.

Even a circle through five points is below it.
"""


def check_tool_paths(motion: Motion, scenario: Scenario, joints: ScenarioJoints) -> Findings:
    """Compare the motion of the tool with each stretch of each path of the scenario.

    At another speed than planned, woven paths and those in moving frames are not compared.
    """
    if joints.robot is None:
        return
    for group in group_paths_by_turn(scenario):
        skipped = [path for path in group if path.clock and path.timed_path.has_own_clock]
        for path in skipped:
            ends = (scenario.waypoints[i].name for i in (path.first, path.last))
            begin, end = map(quoted_waypoint, ends)
            kind = "in a moving frame" if path.timed_path.frame.is_moving else "woven"
            fact = f"the tool path from {begin} to {end} is {kind} and is not checked"
            yield Topic(Group.WARNINGS).finding("path", fact, "warning")
        compared = [path for path in group if path not in skipped]
        for followed in _follow_paths(motion, scenario, joints.robot, compared):
            yield from _stretch_findings(scenario, followed)


def check_curve_between_points(
    motion: Motion, scenario: Scenario, joints: ScenarioJoints
) -> Findings:
    """Warn of a curve that deviates far from the straight line between two of its points.

    Its points are then too few or unevenly spaced, and the curve is hardly what the user means.
    """
    for path in scenario.paths:
        last = scenario.waypoints[path.last]
        for curve in path.timed_path.tool_path.curves:
            chords, bulges = curve.chords_and_bulges()
            if (bulges > MAX_BULGE * chords).any():
                i = int((bulges / chords).argmax())
                chord, bulge = (
                    scenario.units.text(size[i], "m", ".4g") for size in (chords, bulges)
                )
                fact = (
                    f"the curve through points to {last.name!r} leaves the straight line between "
                    f"points {i + 1} and {i + 2} of {len(chords) + 1} (its start is point 1), "
                    f"{chord} apart, by {bulge}: "
                    "add points there, or leave out points that are much nearer to one another"
                )
                topic = Topic(Group.WARNINGS, "waypoint", last.name)
                yield topic.finding("curve_between_points", fact, "warning", time=last.time)


def group_paths_by_turn(scenario: Scenario) -> list[list[ScenarioPath]]:
    """Group paths along which the free turn of the tool is continuous.

    Within a group each path begins where the previous one ends, or after a wait there. Both have
    the same freedom, or ranges of the same turn.
    """
    groups: list[list[ScenarioPath]] = []
    for path in scenario.paths:
        before = groups[-1][-1] if groups else path
        continues = before.freedom == path.freedom or _same_turn(before.freedom, path.freedom)
        if groups and continues and _stays(scenario, before.last, path.first):
            groups[-1].append(path)
        else:
            groups.append([path])
    return groups


def _same_turn(a: PoseFreedom | None, b: PoseFreedom | None) -> bool:
    """Whether both freedoms limit the turn about the same axis."""
    if a is None or b is None:
        return False
    if (a.torch and a.torch.angles_at_pose) != (b.torch and b.torch.angles_at_pose):
        return False
    return all(0.0 < high - low < math.inf for low, high in (a.turn, b.turn))


def _stays(scenario: Scenario, first: int, second: int) -> bool:
    """Whether two waypoints are equal, or the second is a wait at the first."""
    if second - first != 1:
        return second == first
    a, b = scenario.waypoints[first : second + 1]
    if not (isinstance(a, CartesianWaypoint) and isinstance(b, CartesianWaypoint)):
        return False
    return bool(a.pose.isApprox(b.pose, POSE_TOLERANCE))


class _FollowedStretch(NamedTuple):
    """A stretch of a path, with the proved bounds of the motion along it."""

    path: ScenarioPath
    ends: tuple[str, str]
    stretch: Stretch
    bounds: StretchBounds

    @property
    def keeps_turn(self) -> bool:
        """Whether the turn is proved to stay within its range."""
        turn = self.bounds.worst_errors.get("path_turn")
        return turn is None or (turn.proved and turn.value <= turn.limit)


def _follow_paths(
    motion: Motion, scenario: Scenario, robot: Robot, paths: Sequence[ScenarioPath]
) -> list[_FollowedStretch]:
    """Follow the tool along adjoining paths; its turn is continuous and counts whole turns.

    If the turn at the beginning is ambiguous by whole turns, one is taken that keeps the turn
    within its range along all paths, if there is one.
    """
    first = _follow_stretches(motion, scenario, robot, paths, 0.0)
    freedom = paths[0].freedom if first else None
    if freedom is None or not math.isfinite(freedom.turn[1] - freedom.turn[0]):
        return first
    start = first[0].bounds.errors.turns[0]
    slack = scenario.tolerances.path_orientation
    low, high = freedom.turn[0] - slack - start, freedom.turn[1] + slack - start
    whole_turns = range(math.ceil(low / math.tau), math.floor(high / math.tau) + 1)
    for count in (0, *whole_turns):
        attempt = first
        if count:
            turn = start + math.tau * count
            attempt = _follow_stretches(motion, scenario, robot, paths, turn)
        if all(stretch.keeps_turn for stretch in attempt):
            return attempt
    return first


def _follow_stretches(
    motion: Motion, scenario: Scenario, robot: Robot, paths: Sequence[ScenarioPath], turn: float
) -> list[_FollowedStretch]:
    """Bound the errors on each stretch within the time of the motion.

    Args:
        motion: The motion.
        scenario: The scenario.
        robot: The arm.
        paths: Adjoining paths.
        turn: Approximate turn of the tool at the beginning [rad].
    """
    from knotwork.verification.bounds.path_criteria import PathTolerances
    from knotwork.verification.bounds.stretch_bounds import path_bounds

    stretches = []
    for path in paths:
        timed_path = path.timed_path
        for i, stretch in enumerate(path.stretches, path.first):
            interval = stretch.start, stretch.end
            if max(stretch.start, motion.start_time) >= min(stretch.end, motion.end_time):
                continue
            full_speed = stretch.full_speed_interval
            allowed = PathTolerances.of(scenario.tolerances, stretch.speed, full_speed)
            if path.clock is not None:
                allowed = allowed._replace(speed=None)
            bounds = path_bounds(
                robot, motion.curve, timed_path, interval, allowed, path.freedom, turn, path.clock
            )
            turn = bounds.errors.turns[1]
            ends = scenario.waypoints[i].name, scenario.waypoints[i + 1].name
            stretches.append(_FollowedStretch(path, ends, stretch, bounds))
    return stretches


def _stretch_findings(scenario: Scenario, followed: _FollowedStretch) -> Findings:
    """Make the findings on a stretch, one for each criterion."""
    _, (begin, end), stretch, bounds = followed
    tolerances = scenario.tolerances
    progress = bounds.progress
    units = scenario.units
    errors = bounds.worst_errors
    # the progress is proved where the deviation is proved
    errors["path_progress"] = errors["path_deviation"]._replace(
        limit=max(tolerances.path, tolerances.position),
        value=progress.error,
        bound=progress.error,
        time=progress.time,
    )
    for quantity, bound in errors.items():
        unit = CRITERION_UNITS[quantity]
        ends = f"from {quoted_waypoint(begin)} to {quoted_waypoint(end)}"
        fact = f"{ends} {_error_text(quantity, bound, followed, scenario)}"
        proof: Proof = "bounded"
        if not bound.proved:
            proof = "sampled"
            low, high = bound.worst_interval
            upper = units.text(bound.bound, unit, ".3g")
            fact += f"; this is not proved: from {low:.6g} s to {high:.6g} s it may be {upper}"
        highlight = ""
        if quantity == "path_deviation":
            off = units.number(bound.value, "m", ".3g")
            highlight = f"{begin} to {end}: {off} of {units.text(bound.limit, 'm', '.3g')} off"
            if "path_speed" in errors:
                highlight += f", {_speed_range_text(bounds.errors, units, '.4g')}"
        interval = stretch.start, stretch.end
        if quantity == "path_speed":
            interval = stretch.full_speed_interval
        proof_gap = max(bound.bound - bound.value, 0.0)
        worst = LimitedValue(bound.value, bound.time, bound.limit, 1.0, proof, proof_gap)
        verdict = verdict_on(bound.proved and bound.value <= bound.limit)
        finding = Topic(Group.TOOL_PATHS, "path", f"{begin} to {end}").finding(
            quantity, fact, verdict, unit=unit, interval=interval, **worst.numbers
        )
        yield replace(finding, highlight=highlight)


def _error_text(
    quantity: str, bound: PathBound, followed: _FollowedStretch, scenario: Scenario
) -> str:
    """Text of the error on a stretch by one criterion."""
    path, _, stretch, bounds = followed
    units = scenario.units
    value, limit, excess = (
        units.text(number, CRITERION_UNITS[quantity], ".3g")
        for number in (abs(bound.value), bound.limit, max(bound.value, 0.0))
    )
    if quantity == "path_deviation":
        return f"the tool is up to {value} from the {stretch.kind}, tolerance {limit}"
    if quantity == "path_orientation":
        return f"the orientation error of the tool is up to {value}, tolerance {limit}"
    if quantity == "path_turn" and path.freedom is not None:
        side = "outside" if bound.value > 0.0 else "inside"
        ranges = _angle_ranges_text(path.freedom, units)
        return f"the orientation is {value} {side} its free range ({ranges}), tolerance {limit}"
    if quantity == "path_progress":
        progress = bounds.progress
        start, end, total, backward = (
            units.text(round(length, PATH_LENGTH_DECIMALS), "m")
            for length in (progress.start, progress.end, progress.length, progress.back)
        )
        return (
            f"the tool moves from {start} to {end} of the {stretch.kind}'s {total} and moves back "
            f"by {backward}, tolerance {limit}"
        )
    speed = units.number(stretch.speed, "m/s", ".5g")
    within = f"tolerance {100 * scenario.tolerances.path_speed:.3g} %"
    if quantity == "path_ramp":
        return f"where the speed changes it is {excess} outside 0 to {speed}, {within}"
    start, end = (f"{time:.3f} s" for time in stretch.full_speed_interval)
    speeds = _speed_range_text(bounds.errors, units, ".5g")
    return f"the speed is {speeds}, required {speed} from {start} to {end}, {within}"


def _angle_ranges_text(freedom: PoseFreedom, units: Units) -> str:
    """Text of the free ranges of turn, travel and work angle."""
    from knotwork.verification.bounds.free_turn import open_ranges

    return ", ".join(
        f"{name} {units.number(low, unit)} to {units.text(high, unit, '.4g')}"
        for (name, unit), (low, high) in open_ranges(freedom).items()
        if unit == "rad" and name != "tilt"
    )


def _speed_range_text(errors: PathErrors, units: Units, spec: str) -> str:
    """Text of the proved minimum and maximum speed where full speed is required."""
    slowest = units.number(errors.slowest, "m/s", spec)
    return f"{slowest} to {units.text(errors.fastest, 'm/s', spec)}"
