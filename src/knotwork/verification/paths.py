"""Tool paths against what the tool does: distance, orientation and speed, over all time."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from knotwork.joint_space import JointSpace
from knotwork.scenario import Scenario, ScenarioPath, Stretch
from knotwork.verification.finding import Finding, judged
from knotwork.verification.motion import Motion

if TYPE_CHECKING:
    from knotwork.robot import Robot

GROUP = "Tool paths"


def tool_paths(motion: Motion, scenario: Scenario, space: JointSpace) -> Iterator[Finding]:
    """Compare the tool with each stretch of each path, from the scenario and the motion alone."""
    if space.robot is None:
        return
    for path in scenario.paths:
        for k, stretch in enumerate(path.stretches):
            if motion.start_time < stretch.end and stretch.start < motion.end_time:
                yield from _stretch(motion, scenario, space.robot, path, k, stretch)


def _stretch(
    motion: Motion,
    scenario: Scenario,
    robot: Robot,
    path: ScenarioPath,
    k: int,
    stretch: Stretch,
) -> Iterator[Finding]:
    from knotwork.verification.bounds.path import PathLimits, path_bounds

    allowed = scenario.tolerances
    limits = PathLimits(allowed.path, allowed.path_orientation, allowed.path_speed * stretch.speed)
    interval = stretch.start, stretch.end
    found = path_bounds(
        robot, motion.curve, path.motion, interval, stretch.full_speed, stretch.speed, limits
    )
    begin, end = (scenario.waypoints[path.first + k + j].name for j in (0, 1))
    units = scenario.units
    scale, length = scenario.shown_length
    angle, place = found.orientation.value, scale * found.position.value
    full = stretch.full_speed
    rows = [
        ("path_deviation", found.position, limits.position, "m", interval,
         f"the tool leaves the {stretch.kind} by {place:.3g} {length}, tolerance "
         f"{scale * limits.position:.3g} {length}"),
        ("path_orientation", found.orientation, limits.orientation, "rad", interval,
         f"the tool is turned off by {units.text(angle, 'rad', '.3g')}, tolerance "
         f"{units.text(limits.orientation, 'rad', '.3g')}"),
        ("path_speed", found.speed, limits.speed, "m/s", full,
         f"the speed is {scale * found.slowest:.5g} to {scale * found.fastest:.5g} {length}/s, "
         f"asked for {scale * stretch.speed:.5g} from {full[0]:.3f} s to {full[1]:.3f} s, "
         f"tolerance {100 * allowed.path_speed:.3g} %"),
    ]  # fmt: skip
    brief = f"{begin} to {end}: {place:.3g} of {scale * limits.position:.3g} {length} off"
    if found.speed is not None:
        brief += f", {scale * found.slowest:.4g} to {scale * found.fastest:.4g} {length}/s"
    for quantity, bound, limit, unit, when, said in rows:
        if bound is None:
            continue
        yield Finding(
            group=GROUP,
            subject="path",
            name=f"{begin} to {end}",
            quantity=quantity,
            verdict=judged(bound.value <= limit),
            message=f"from {begin!r} to {end!r} {said}",
            value=bound.value,
            limit=limit,
            margin=limit - (bound.bound if bound.proved else bound.value),
            unit=unit,
            time=bound.time,
            interval=when,
            proof="bounded" if bound.proved else "sampled",
            excess=max(bound.bound - bound.value, 0.0),
            brief=brief if quantity == "path_deviation" else "",
        )
    if found.speed is not None:
        yield Finding(
            group=GROUP,
            subject="path",
            name=f"{begin} to {end}",
            quantity="full_speed",
            verdict="information",
            message=f"{begin!r} to {end!r}: at {scale * found.slowest:.5g} to "
            f"{scale * found.fastest:.5g} {length}/s from {full[0]:.3f} s to {full[1]:.3f} s, "
            f"where the full speed is {scale * stretch.speed:.5g} {length}/s",
            interval=full,
            proof="bounded" if found.speed.proved else "sampled",
        )
