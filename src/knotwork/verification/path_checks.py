"""Check of tool paths: distance, orientation and speed, over all time."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

from knotwork.task.scenario import Scenario, ScenarioPath, Stretch
from knotwork.task.scenario.joint_space import JointSpace
from knotwork.verification.checked_motion import Execution, Motion
from knotwork.verification.finding import Finding, verdict_on
from knotwork.waypoints import CartesianWaypoint, PoseFreedom

if TYPE_CHECKING:
    from knotwork.robot import Robot
    from knotwork.units import Units
    from knotwork.verification.bounds.path_criteria import PathLimits
    from knotwork.verification.bounds.stretch_bounds import PathBound, StretchBounds

TOOL_PATHS = "Tool paths"
POSE_TOLERANCE = 1e-9
"""Relative difference below which poses are equal."""


def tool_paths(motion: Motion, scenario: Scenario, space: JointSpace) -> Iterator[Finding]:
    """Compare the motion of the tool with each stretch of each path of the scenario."""
    yield from _tool_paths(motion, scenario, space, None)


def path_geometry(
    motion: Motion, scenario: Scenario, space: JointSpace, execution: Execution
) -> Iterator[Finding]:
    """Compare the tool with the paths of the scenario at any speed: positions, turns and progress.

    Args:
        motion: A motion that executes the task, or a part of it, with another clock.
        scenario: The task, with its own times.
        space: The joints and their robot.
        execution: The clock of the motion.
    """
    start, end = execution.clock(execution.clock.x[[0, -1]])
    own_clock = [
        path
        for path in scenario.paths
        if path.motion.carrier is not None and path.times[0] < end and start < path.times[-1]
    ]
    for path in own_clock:
        names = scenario.waypoints[path.first].name, scenario.waypoints[path.last].name
        kind = "woven" if path.motion.seam_carrier is None else "in a moving frame"
        fact = f"the tool path from {names[0]!r} to {names[1]!r} is {kind} and is not checked"
        yield Finding("Warnings", "motion", "", "path", "warning", fact)
    yield from _tool_paths(motion, scenario, space, execution)


def _tool_paths(
    motion: Motion, scenario: Scenario, space: JointSpace, execution: Execution | None
) -> Iterator[Finding]:
    if space.robot is None:
        return
    for group in join_paths(scenario):
        paths = [path for path in group if execution is None or path.motion.carrier is None]
        for followed in _follow_paths(motion, scenario, space.robot, paths, execution):
            yield from _stretch_findings(scenario, followed)


def join_paths(scenario: Scenario) -> list[list[ScenarioPath]]:
    """Groups of paths along which a turn of the tool is continuous.

    Each path begins where the previous one ends, or after a wait there. Both have the same freedom,
    or ranges of the same turn.
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
    """Whether both have a range of the same angle."""
    if a is None or b is None or (a.torch and a.torch[2:]) != (b.torch and b.torch[2:]):
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
    name: tuple[str, str]
    stretch: Stretch
    limits: PathLimits
    bounds: StretchBounds

    @property
    def keeps_turn(self) -> bool:
        turn = self.bounds.turn
        return turn is None or (turn.proved and turn.value <= self.limits.orientation)


def _follow_paths(
    motion: Motion,
    scenario: Scenario,
    robot: Robot,
    paths: Sequence[ScenarioPath],
    execution: Execution | None,
) -> list[_FollowedStretch]:
    """Follow the tool along joined paths, and its turn continuously, whole turns counted.

    If several whole turns are possible at the beginning, one is taken that keeps the turn within
    its range.
    """
    followed = _follow_from(motion, scenario, robot, paths, execution, 0.0)
    freedom = paths[0].freedom if followed else None
    if freedom is None or not math.isfinite(freedom.turn[1] - freedom.turn[0]):
        return followed
    start, allowed = followed[0].bounds.turned[0], scenario.si.tolerances.path_orientation
    low, high = ((bound - start) / (2.0 * math.pi) for bound in freedom.turn)
    slack = allowed / (2.0 * math.pi)
    for turns in (0, *range(math.ceil(low - slack), math.floor(high + slack) + 1)):
        turn = start + 2.0 * math.pi * turns
        attempt = followed
        if turns:
            attempt = _follow_from(motion, scenario, robot, paths, execution, turn)
        if all(stretch.keeps_turn for stretch in attempt):
            return attempt
    return followed


def _follow_from(
    motion: Motion,
    scenario: Scenario,
    robot: Robot,
    paths: Sequence[ScenarioPath],
    execution: Execution | None,
    turn: float,
) -> list[_FollowedStretch]:
    """Bounds on each stretch, the first of which begins at about a turn [rad]."""
    from knotwork.verification.bounds.path_criteria import PathLimits
    from knotwork.verification.bounds.stretch_bounds import path_bounds

    allowed, followed = scenario.si.tolerances, []
    clock = None if execution is None else execution.clock
    for path in paths:
        for k, stretch in enumerate(path.stretches, path.first):
            name = scenario.waypoints[k].name, scenario.waypoints[k + 1].name
            if execution is not None:
                name, stretch = execution.stretch(stretch, k, name)
            start, end = max(stretch.start, motion.start_time), min(stretch.end, motion.end_time)
            if end - start <= 0.0:
                continue
            speed = allowed.path_speed * stretch.speed
            limits = PathLimits(allowed.path, allowed.path_orientation, speed)
            bounds = path_bounds(
                robot, motion.curve, path.motion, (stretch.start, stretch.end),
                stretch.full_speed, stretch.speed, limits, freedom=path.freedom, turn=turn,
                clock=clock,
            )  # fmt: skip
            turn = bounds.turned[1]
            followed.append(_FollowedStretch(path, name, stretch, limits, bounds))
    return followed


def _stretch_findings(scenario: Scenario, followed: _FollowedStretch) -> Iterator[Finding]:
    """Findings on a stretch: one for each criterion, and the speeds at full speed."""
    (begin, end), stretch, bounds = followed.name, followed.stretch, followed.bounds
    name = f"{begin} to {end}"
    for quantity, bound, limit, unit, text in _criteria(scenario, followed):
        if bound is None:
            continue
        fact, brief = f"from {begin!r} to {end!r} {text}", ""
        if not bound.proved:
            low, high = bound.where
            most = scenario.units.text(bound.bound, unit, ".3g")
            fact += f"; this is not proved: from {low:.6g} s to {high:.6g} s it may be {most}"
        if quantity == "path_deviation":
            scale, length = scenario.shown_length
            brief = f"{name}: {scale * bound.value:.3g} of {scale * limit:.3g} {length} off"
            brief += f", {_speeds(bounds, scenario, 4)}" if bounds.speed is not None else ""
        yield Finding(
            group=TOOL_PATHS,
            subject="path",
            name=name,
            quantity=quantity,
            verdict=verdict_on(bound.proved and bound.value <= limit),
            fact=fact,
            value=bound.value,
            limit=limit,
            margin=limit - (bound.value if bound.value > limit else bound.bound),
            unit=unit,
            time=bound.time,
            interval=stretch.full_speed
            if quantity == "path_speed"
            else (stretch.start, stretch.end),
            proof="bounded" if bound.proved else "sampled",
            excess=max(bound.bound - bound.value, 0.0),
            brief=brief,
        )
    if bounds.speed is not None:
        (start, last), (scale, length) = stretch.full_speed, scenario.shown_length
        fact = (
            f"{begin!r} to {end!r}: at {_speeds(bounds, scenario, 5)} from {start:.3f} s to "
            f"{last:.3f} s, where the full speed is {scale * stretch.speed:.5g} {length}/s"
        )
        yield Finding(
            TOOL_PATHS, "path", name, "full_speed", "information", fact,
            interval=stretch.full_speed, proof="bounded" if bounds.speed.proved else "sampled",
        )  # fmt: skip


def _criteria(
    scenario: Scenario, followed: _FollowedStretch
) -> Iterator[tuple[str, PathBound | None, float, str, str]]:
    """Quantity, bound, limit, unit and text of each criterion on a stretch."""
    freedom, stretch, limits = followed.path.freedom, followed.stretch, followed.limits
    bounds, kind, progress = followed.bounds, stretch.kind, followed.bounds.progress
    tolerances, (scale, length) = scenario.si.tolerances, scenario.shown_length

    def text_of(value: float, unit: str = "rad") -> str:
        return scenario.units.text(value, unit, ".3g")

    off, at_most = (f"{scale * x:.3g}" for x in (bounds.position.value, limits.position))
    text = f"the tool leaves the {kind} by {off} {length}, tolerance {at_most} {length}"
    yield "path_deviation", bounds.position, limits.position, "m", text
    turned = limits.orientation + (0.0 if freedom is None else freedom.tilt)
    off = text_of(bounds.orientation.value)
    text = f"the tool is turned off by {off}, tolerance {text_of(turned)}"
    yield "path_orientation", bounds.orientation, turned, "rad", text
    if bounds.turn is not None and freedom is not None:
        side = "beyond" if bounds.turn.value > 0.0 else "within"
        text = (
            f"the tool is {text_of(abs(bounds.turn.value))} {side} what is free, "
            f"{_ranges(freedom, scenario.units)}, tolerance {text_of(limits.orientation)}"
        )
        yield "path_turn", bounds.turn, limits.orientation, "rad", text
    most = max(tolerances.path, tolerances.position)
    start, end, total, backward = (
        f"{round(scale * value, 6) + 0.0:.6g}"
        for value in (progress.start, progress.end, progress.length, progress.back)
    )
    text = (
        f"the tool moves from {start} {length} to {end} {length} of the {kind}'s {total} {length} "
        f"and moves back by {backward} {length}, tolerance {scale * most:.3g} {length}"
    )
    worst = progress.worst  # proved if the distance is
    bound = bounds.position._replace(value=worst, time=progress.time, bound=worst)
    yield "path_progress", bound, most, "m", text
    if math.isinf(stretch.speed):
        return
    asked, within = f"{scale * stretch.speed:.5g}", f"tolerance {100 * tolerances.path_speed:.3g} %"
    start, end = (f"{time:.3f} s" for time in stretch.full_speed)
    speeds = _speeds(bounds, scenario, 5)
    text = f"the speed is {speeds}, required {asked} from {start} to {end}, {within}"
    yield "path_speed", bounds.speed, limits.speed, "m/s", text
    beyond = text_of(0.0 if bounds.ramp is None else max(bounds.ramp.value, 0.0), "m/s")
    text = f"where the speed changes it is {beyond} beyond 0 to {asked}, {within}"
    yield "path_ramp", bounds.ramp, limits.speed, "m/s", text


def _ranges(freedom: PoseFreedom, units: Units) -> str:
    """Text of the ranges of angles except tilts."""
    from knotwork.verification.bounds.free_turn import open_ranges

    return ", ".join(
        f"{name} {units.text(low, unit, '.4g').split()[0]} to {units.text(high, unit, '.4g')}"
        for (name, unit), (low, high) in open_ranges(freedom).items()
        if unit == "rad" and name != "tilt"
    )


def _speeds(bounds: StretchBounds, scenario: Scenario, digits: int) -> str:
    """Text of the proved speeds at full speed."""
    scale, length = scenario.shown_length
    return f"{scale * bounds.slowest:.{digits}g} to {scale * bounds.fastest:.{digits}g} {length}/s"
