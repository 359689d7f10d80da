"""What the report says of each way: how many were tried, and the least clearance along it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import islice

from knotwork.choosing.choice import ChosenTimes
from knotwork.joint_space import JointSpace
from knotwork.polynomial.refined import part
from knotwork.trajectory import JointTrajectory
from knotwork.verification import Finding, Motion
from knotwork.verification.bounds.clearance import Clearance, clearances
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
    if free is None or not found:
        return
    motion = Motion(trajectory, space)
    goals = iter(sorted(free.ways))
    for way in found:
        first, *others = islice(goals, len(way.time) - 1)  # it may lead through waypoints
        start, end = waypoints[first - 1], waypoints[[first, *others][-1]]
        tries = f"{way.tries} {'try' if way.tries == 1 else 'tries'}"
        said = f"{start.name} to {end.name}: way found in {tries}"
        interval = (start.time, end.time)
        least = _least(motion, chosen, space, interval)
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


def _least(
    motion: Motion, chosen: ChosenTimes, space: JointSpace, interval: tuple[float, float]
) -> Clearance | None:
    """The least clearance along a way from what stands around; of all pairs, if nothing does."""
    if space.robot is None:
        return None
    scenario = chosen.scenario
    model = motion_model(motion, scenario, space.robot)
    around = tuple(pair for pair in model.pairs if pair.around)
    model = replace(model, pairs=around or model.pairs)
    curve = part(motion.curve, *interval)
    found = clearances(model, curve, scenario.scene.rules.resolution)
    return min(found, key=lambda one: one.distance - one.margin, default=None)
