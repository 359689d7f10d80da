"""What the report says of each way: how many were tried, and the least clearance along it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import islice

from knotwork.choosing.choice import ChosenTimes
from knotwork.polynomial.refined import part
from knotwork.scenario.joint_space import JointSpace
from knotwork.trajectory import JointTrajectory
from knotwork.verification import Finding, Motion
from knotwork.verification.bounds.clearance import clearances
from knotwork.verification.collisions import motion_model

GROUP = "Ways"


def ways_found(
    chosen: ChosenTimes, space: JointSpace, trajectory: JointTrajectory
) -> Iterator[Finding]:
    """A finding for each way.

    Args:
        chosen: What was chosen.
        space: The joints and their robot.
        trajectory: The motion planned with it.
    """
    free, waypoints = chosen.asked.free, chosen.scenario.waypoints
    found = [one for one in chosen.segments if one.line is not None]
    if free is None or space.robot is None or not found:
        return
    motion = Motion(trajectory, space)
    model = motion_model(motion, chosen.scenario, space.robot)
    around = tuple(pair for pair in model.pairs if pair.around)
    model = replace(model, pairs=around or model.pairs)
    resolution = chosen.scenario.scene.rules.resolution
    goals = iter(sorted(free.ways))
    for way in found:
        first, *others = islice(goals, len(way.time) - 1)  # it may lead through waypoints
        start, end = waypoints[first - 1], waypoints[[first, *others][-1]]
        tries = f"{way.tries} {'try' if way.tries == 1 else 'tries'}"
        said = f"{start.name} to {end.name}: way found in {tries}"
        interval = (start.time, end.time)
        # from what stands around; of all pairs, if nothing does
        nearest = clearances(model, part(motion.curve, *interval), resolution)
        least = min(nearest, key=lambda one: one.distance - one.margin, default=None)
        value = time = None
        brief = said
        if least is not None:
            value, time = least.distance, least.time
            clearance = f"least clearance {chosen.scenario.units.text(value, 'm', '.3g')}"
            said += f", {clearance} ({least.second.name}, {least.first.name}) at {time:.2f} s"
            brief = f"{start.name} to {end.name}: {clearance}"
        yield Finding(
            group=GROUP,
            subject="waypoint",
            name=end.name,
            quantity="way",
            verdict="information",
            message=said,
            value=value,
            unit="m" if value is not None else "",
            time=time,
            interval=interval,
            brief=brief,
        )
