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
    name = f"{begin} to {end}"
    scale, length = scenario.shown_length
    rows = [
        (
            "path_deviation",
            found.position,
            limits.position,
            "m",
            f"the tool leaves the {stretch.kind}",
        ),
        (
            "path_orientation",
            found.orientation,
            limits.orientation,
            "rad",
            "the tool is turned off",
        ),
    ]
    for quantity, bound, limit, unit, what in rows:
        factor, shown = (scale, length) if unit == "m" else (1.0, unit)
        yield Finding(
            group=GROUP,
            subject="path",
            name=name,
            quantity=quantity,
            verdict=judged(bound.value <= limit),
            message=f"from {begin!r} to {end!r} {what} by {factor * bound.value:.3g} {shown}, "
            f"tolerance {factor * limit:.3g} {shown}",
            value=bound.value,
            limit=limit,
            margin=limit - bound.bound if bound.proved else limit - bound.value,
            unit=unit,
            time=bound.time,
            interval=interval,
            proof="bounded" if bound.proved else "sampled",
            excess=max(bound.bound - bound.value, 0.0),
        )
    if found.speed is None:
        return
    speed = found.speed
    yield Finding(
        group=GROUP,
        subject="path",
        name=name,
        quantity="path_speed",
        verdict=judged(speed.value <= limits.speed),
        message=f"from {begin!r} to {end!r} the speed is {scale * found.slowest:.5g} to "
        f"{scale * found.fastest:.5g} {length}/s, asked for {scale * stretch.speed:.5g} "
        f"from {stretch.full_speed[0]:.3f} s to {stretch.full_speed[1]:.3f} s, tolerance "
        f"{100 * allowed.path_speed:.3g} %",
        value=speed.value,
        limit=limits.speed,
        margin=limits.speed - (speed.bound if speed.proved else speed.value),
        unit="m/s",
        time=speed.time,
        interval=stretch.full_speed,
        proof="bounded" if speed.proved else "sampled",
        excess=max(speed.bound - speed.value, 0.0),
    )
