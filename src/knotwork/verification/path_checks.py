"""Check of tool paths: distance, orientation and speed, over all time."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

from knotwork.scenario import Scenario, ScenarioPath, Stretch
from knotwork.scenario.joint_space import JointSpace
from knotwork.verification.checked_motion import Motion
from knotwork.verification.finding import Finding, judged
from knotwork.waypoints import CartesianWaypoint, PoseFreedom

if TYPE_CHECKING:
    from knotwork.robot import Robot
    from knotwork.units import Units
    from knotwork.verification.bounds.stretch_bounds import (
        PathBound,
        PathLimits,
        Progress,
        StretchBounds,
    )

GROUP = "Tool paths"
SAME = 1e-9
"""Relative difference below which poses are equal."""


def tool_paths(motion: Motion, scenario: Scenario, space: JointSpace) -> Iterator[Finding]:
    """Compare the motion of the tool with each stretch of each path of the scenario."""
    if space.robot is None:
        return
    for paths in joined_paths(scenario):
        for one in _followed(motion, scenario, space.robot, paths):
            yield from _findings(scenario, one)


def joined_paths(scenario: Scenario) -> list[list[ScenarioPath]]:
    """Paths in groups, in which a turn of the tool goes on from one to the next.

    Each begins where the one before ends, or after a wait there, and leaves the same open, or both
    have ranges of the same turn.
    """
    groups: list[list[ScenarioPath]] = []
    for path in scenario.paths:
        before = groups[-1][-1] if groups else path
        goes_on = before.freedom == path.freedom or _one_turn(before.freedom, path.freedom)
        if goes_on and _stays(scenario, before.last, path.first):
            groups[-1].append(path)
        else:
            groups.append([path])
    return groups


def _one_turn(one: PoseFreedom | None, other: PoseFreedom | None) -> bool:
    """Whether both have a range of one and the same angle."""
    if (
        one is None
        or other is None
        or (one.torch and one.torch[2:]) != (other.torch and other.torch[2:])
    ):
        return False
    return all(0.0 < high - low < math.inf for low, high in (one.turn, other.turn))


def _stays(scenario: Scenario, before: int, after: int) -> bool:
    """Whether two waypoints are equal, or one is a wait at the other."""
    if after - before != 1:
        return after == before
    one, other = scenario.waypoints[before : after + 1]
    if not (isinstance(one, CartesianWaypoint) and isinstance(other, CartesianWaypoint)):
        return False
    return bool(one.pose.isApprox(other.pose, SAME))


class _Judged(NamedTuple):
    """A stretch of a path, with the proved bounds of the motion along it."""

    path: ScenarioPath
    k: int
    stretch: Stretch
    limits: PathLimits
    found: StretchBounds


def _followed(
    motion: Motion, scenario: Scenario, robot: Robot, paths: Sequence[ScenarioPath]
) -> list[_Judged]:
    """Follow the tool along paths that are joined, and its turn all along, whole turns counted.

    Where it may begin whole turns away within its range, one is taken that keeps it within.
    """
    found = _from_turn(motion, scenario, robot, paths, 0.0)
    freedom = paths[0].freedom if paths else None
    if not found or freedom is None or all(_turn_kept(one) for one in found):
        return found
    if not math.isfinite(freedom.turn[1] - freedom.turn[0]):
        return found
    start, allowed = found[0].found.turned[0], scenario.tolerances.path_orientation
    low, high = (bound - start for bound in freedom.turn)
    whole = 2.0 * math.pi
    least, most = math.ceil((low - allowed) / whole), math.floor((high + allowed) / whole)
    for turns in range(least, most + 1):
        if turns:
            other = start + whole * turns
            again = _from_turn(motion, scenario, robot, paths, other)
            if all(_turn_kept(one) for one in again):
                return again
    return found


def _turn_kept(one: _Judged) -> bool:
    turn = one.found.turn
    return turn is None or (turn.proved and turn.value <= one.limits.orientation)


def _from_turn(
    motion: Motion, scenario: Scenario, robot: Robot, paths: Sequence[ScenarioPath], turn: float
) -> list[_Judged]:
    """Bounds on each stretch, the first of which begins at about a turn [rad]."""
    from knotwork.verification.bounds.stretch_bounds import PathLimits, path_bounds

    allowed, judged = scenario.tolerances, []
    for path in paths:
        for k, stretch in enumerate(path.stretches):
            if not (motion.start_time < stretch.end and stretch.start < motion.end_time):
                continue
            speed = allowed.path_speed * stretch.speed
            limits = PathLimits(allowed.path, allowed.path_orientation, speed)
            interval, full = (stretch.start, stretch.end), stretch.full_speed
            asked = path.motion, interval, full, stretch.speed, limits
            found = path_bounds(robot, motion.curve, *asked, freedom=path.freedom, turn=turn)
            turn = found.turned[1]
            judged.append(_Judged(path, k, stretch, limits, found))
    return judged


class _Row(NamedTuple):
    """One criterion on a stretch."""

    quantity: str
    bound: PathBound | None
    limit: float
    unit: str
    interval: tuple[float, float]
    text: str


def _findings(scenario: Scenario, one: _Judged) -> Iterator[Finding]:
    path, k, stretch, limits, found = one
    full = stretch.full_speed
    begin, end = (scenario.waypoints[path.first + k + j].name for j in (0, 1))
    name = f"{begin} to {end}"
    for row in _rows(found, limits, scenario, stretch, path.freedom):
        bound, text = row.bound, row.text
        if bound is None:
            continue
        if not bound.proved:
            text += _not_proved(bound, row.unit, scenario)
        yield Finding(
            group=GROUP,
            subject="path",
            name=name,
            quantity=row.quantity,
            verdict=judged(bound.proved and bound.value <= row.limit),
            fact=f"from {begin!r} to {end!r} {text}",
            value=bound.value,
            limit=row.limit,
            margin=row.limit - (bound.value if bound.value > row.limit else bound.bound),
            unit=row.unit,
            time=bound.time,
            interval=row.interval,
            proof="bounded" if bound.proved else "sampled",
            excess=max(bound.bound - bound.value, 0.0),
            brief=f"{name}: {_brief(found, limits, scenario)}"
            if row.quantity == "path_deviation"
            else "",
        )
    if found.speed is not None:
        scale, length = scenario.shown_length
        yield Finding(
            group=GROUP,
            subject="path",
            name=name,
            quantity="full_speed",
            verdict="information",
            fact=f"{begin!r} to {end!r}: at {_speeds(found, scenario, 5)} from {full[0]:.3f} s "
            f"to {full[1]:.3f} s, where the full speed is {scale * stretch.speed:.5g} {length}/s",
            interval=full,
            proof="bounded" if found.speed.proved else "sampled",
        )


def _rows(
    found: StretchBounds,
    limits: PathLimits,
    scenario: Scenario,
    stretch: Stretch,
    freedom: PoseFreedom | None,
) -> Iterator[_Row]:
    """Criteria on a stretch, with their texts."""
    turned = limits.orientation + (0.0 if freedom is None else freedom.tilt)
    allowed, units = scenario.tolerances, scenario.units
    scale, length = scenario.shown_length
    whole, full, kind = (stretch.start, stretch.end), stretch.full_speed, stretch.kind
    yield _Row(
        "path_deviation", found.position, limits.position, "m", whole,
        f"the tool leaves the {kind} by {scale * found.position.value:.3g} {length}, tolerance "
        f"{scale * limits.position:.3g} {length}",
    )  # fmt: skip
    yield _Row(
        "path_orientation", found.orientation, turned, "rad", whole,
        f"the tool is turned off by {units.text(found.orientation.value, 'rad', '.3g')}, tolerance "
        f"{units.text(turned, 'rad', '.3g')}",
    )  # fmt: skip
    if found.turn is not None and freedom is not None:
        where = "beyond" if found.turn.value > 0.0 else "within"
        yield _Row(
            "path_turn", found.turn, limits.orientation, "rad", whole,
            f"the tool is {units.text(abs(found.turn.value), 'rad', '.3g')} {where} what is free, "
            f"{_ranges(freedom, units)}, tolerance {units.text(limits.orientation, 'rad', '.3g')}",
        )  # fmt: skip
    yield _Row(
        "path_progress", _progress_bound(found), max(allowed.path, allowed.position), "m", whole,
        _progress_text(found.progress, scenario, kind),
    )  # fmt: skip
    asked, within = f"{scale * stretch.speed:.5g}", f"tolerance {100 * allowed.path_speed:.3g} %"
    yield _Row(
        "path_speed", found.speed, limits.speed, "m/s", full,
        f"the speed is {_speeds(found, scenario, 5)}, asked for {asked} from {full[0]:.3f} s to "
        f"{full[1]:.3f} s, {within}",
    )  # fmt: skip
    slowest = round(scale * found.ramp_slowest, 9) + 0.0
    yield _Row(
        "path_ramp", found.ramp, limits.speed, "m/s", whole,
        f"where the speed changes it is {slowest:.5g} to {scale * found.ramp_fastest:.5g} "
        f"{length}/s along the {kind}, accepted 0 to {asked}, {within}",
    )  # fmt: skip


def _ranges(freedom: PoseFreedom, units: Units) -> str:
    """Text of the ranges of angles except tilts."""
    from knotwork.verification.bounds.free_turn import open_ranges

    return ", ".join(
        f"{name} {units.text(low, unit, '.4g').split()[0]} to {units.text(high, unit, '.4g')}"
        for (name, unit), (low, high) in open_ranges(freedom).items()
        if unit == "rad" and name != "tilt"
    )


def _brief(found: StretchBounds, limits: PathLimits, scenario: Scenario) -> str:
    scale, length = scenario.shown_length
    off = f"{scale * found.position.value:.3g} of {scale * limits.position:.3g} {length} off"
    return off if found.speed is None else f"{off}, {_speeds(found, scenario, 4)}"


def _speeds(found: StretchBounds, scenario: Scenario, digits: int) -> str:
    """Text of the proved speeds at full speed."""
    scale, length = scenario.shown_length
    slowest, fastest = (f"{scale * one:.{digits}g}" for one in (found.slowest, found.fastest))
    return f"{slowest} to {fastest} {length}/s"


def _progress_bound(found: StretchBounds) -> PathBound:
    """Progress as a criterion, proved if the distance is."""
    progress, position = found.progress, found.position
    value = progress.worst
    return position._replace(value=value, time=progress.time, bound=value)


def _progress_text(progress: Progress, scenario: Scenario, kind: str) -> str:
    """Text of the tool's progress along the path."""
    scale, length = scenario.shown_length
    start, end, whole, back = (
        f"{round(scale * value, 6) + 0.0:.6g}"
        for value in (progress.start, progress.end, progress.length, progress.back)
    )
    most = max(scenario.tolerances.path, scenario.tolerances.position)
    return (
        f"the tool gets from {start} {length} to {end} {length} of the {kind}'s {whole} "
        f"{length} and goes back by {back} {length} at most, tolerance {scale * most:.3g} {length}"
    )


def _not_proved(bound: PathBound, unit: str, scenario: Scenario) -> str:
    """Text for a criterion that is not proved, with its open interval."""
    start, end = bound.where
    return (
        f"; this is not proved: from {start:.6g} s to {end:.6g} s it may be "
        f"{scenario.units.text(bound.bound, unit, '.3g')}"
    )
