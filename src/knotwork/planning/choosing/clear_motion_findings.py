"""Findings on collision-free motions: number of searches, and minimum clearance."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

from knotwork.curves.polynomial.splitting import cut_curve
from knotwork.curves.trajectory import JointTrajectory
from knotwork.task import ChosenMotion
from knotwork.task.scenario import Scenario
from knotwork.task.scenario.joint_space import JointSpace
from knotwork.task.si_units import si_factors
from knotwork.verification import Finding, Motion
from knotwork.verification.bounds.clearance import least_clearance
from knotwork.verification.collisions import motion_model

WAYS_GROUP = "Ways"

SHOWN_CLEARANCE_PRECISION = 1e-5
"""Precision of the minimum clearance [m]."""


def clear_motion_findings(
    detours: Iterable[tuple[list[int], ChosenMotion]],
    scenario: Scenario,
    space: JointSpace,
    trajectory: JointTrajectory,
) -> Iterator[Finding]:
    """A finding for each collision-free motion.

    Args:
        detours: Its waypoints, by index, and its motion in the task.
        scenario: The task, with all times known.
        space: The joints and their robot.
        trajectory: The planned motion.
    """
    if space.robot is None:
        return
    motion = Motion(trajectory, space)
    model = motion_model(motion, scenario, space.robot)
    around = replace(model, pairs=tuple(pair for pair in model.pairs if pair.around))
    length, _ = si_factors(scenario.task.units)
    resolution = scenario.scene.rules.resolution
    for indices, run in detours:
        count = run.way
        start, end = (scenario.waypoints[indices[k]] for k in (0, -1))
        tries = "1 try" if count == 1 else f"{count} tries"
        message = f"{start.name} to {end.name}: clear motion found in {tries}"
        room = ""
        if run.room is not None:
            room = f" with {scenario.units.text(run.room * length, 'm', '.3g')} of extra clearance"
        message += room
        interval = (start.time, end.time)
        cut = cut_curve(motion.curve, *interval), resolution, SHOWN_CLEARANCE_PRECISION
        # relative to the surroundings, or of all pairs without any
        least = least_clearance(around, *cut) or least_clearance(model, *cut)
        value = time = None
        brief = message
        if least is not None:
            value, time = least.distance, least.time
            clearance = f"minimum clearance {scenario.units.text(value, 'm', '.3g')}"
            message += f", {clearance} ({least.second.name}, {least.first.name}) at {time:.2f} s"
            brief = f"{start.name} to {end.name}:{room}{',' if room else ''} {clearance}"
        yield Finding(
            group=WAYS_GROUP,
            subject="waypoint",
            name=end.name,
            quantity="way",
            verdict="information",
            fact=message,
            value=value,
            unit="m" if value is not None else "",
            time=time,
            interval=interval,
            brief=brief,
        )
