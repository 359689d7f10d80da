"""Motions of other robots in a scene: planned from their scenarios, or read from files.

Planning imports scenes, so scenes load it by name when they call it.
"""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from knotwork.errors import InputError
from knotwork.polynomial.endless import EndlessCurve
from knotwork.robot import Robot
from knotwork.scenario import OtherRobot, load_scenario

if TYPE_CHECKING:
    from knotwork.scene.model import CollisionModel

SAME_PLACE = 1e-9
"""Joints [rad or m] and robots that are so near are at one place."""

_PACKAGE = __package__.partition(".")[0]

_under_way: list[str] = []
"""Scenarios being planned, each needed by the one before."""


@dataclass(frozen=True, eq=False)
class OtherMotion:
    """Motion of another robot.

    Attributes:
        robot: The robot.
        model: Its bodies, in the axes of its URDF's root.
        known: Positions of all joints of its model.
        held: Names of its held objects.
    """

    robot: Robot
    model: CollisionModel
    known: tuple[EndlessCurve, ...]
    held: frozenset[str]


def other_motion(given: OtherRobot) -> OtherMotion:
    """Plan or read the motion of another robot; cached.

    Raises:
        InputError: Its scenario is wrong, fails its own check, or needs itself.
    """
    source = str(given.scenario)
    if source in _under_way:
        circle = " needs ".join((*_under_way[_under_way.index(source) :], source))
        raise InputError(f"robots need one another: {circle}; accepted: an independent one")
    files = (Path(given.scenario), given.motion) if given.motion else (Path(given.scenario),)
    changed = tuple(one.stat().st_mtime_ns for one in files if one.is_file())
    _under_way.append(source)
    try:
        return _motion(source, given.motion, changed)
    finally:
        _under_way.pop()


@lru_cache(maxsize=8)
def _motion(source: str, motion: Path | None, changed: tuple[int, ...]) -> OtherMotion:
    scenario = load_scenario(source)
    if scenario.task.robot is None:
        raise InputError(f"{source}: names no robot")
    if motion is None:
        plan = _called("pipeline", "plan")(scenario)
        if not plan.report.ok:
            raise InputError(
                f"{source}: its motion fails its own check: {plan.report.failures[0].message}; "
                "accepted: a scenario that passes, or motion: the file of a recorded motion"
            )
        scenario, space, trajectory = plan.scenario, plan.space, plan.trajectory
    else:
        space = _called("scenario.joint_space", "joint_space")(scenario)
        read = _called("foreign.reading", "read_trajectory")
        trajectory, faults = read(motion, space.joint_names, space.joint_units)
        if faults:
            raise InputError(f"{motion}: {faults[0]}")
    moved = _called("verification.checked_motion", "Motion")(trajectory, space)
    model = _called("verification.collisions", "motion_model")(moved, scenario, space.robot)
    held = frozenset(one.name for one in scenario.scene.held)
    known = (EndlessCurve(moved.curve), *model.known)
    return OtherMotion(space.robot, model, known, held)


def in_one_cell(own: Robot, theirs: Robot) -> bool:
    """Whether two robots are arms of one URDF, which defines their relative placement.

    Raises:
        InputError: A joint carries an arm but only moves in the other one's motion, or is at two
            places.
    """
    if own.urdf != theirs.urdf or {*own.joint_names} & {*theirs.joint_names}:
        return False
    for one, other in ((own, theirs), (theirs, own)):
        carriers = other.carrying_joints
        carrying = frozenset().union(*(carriers[name] for name in other.joint_names))
        for joint in sorted(carrying & {*one.joint_names, *one.followers}):
            raise InputError(
                f"joint {joint!r} is moved by the motion of {one.name!r} and carries the arm of "
                f"{other.name!r}, whose motion keeps it fixed; accepted: arms of one URDF on a "
                f"fixed base, {joint!r} locked in both robot files"
            )
        for joint in sorted(carrying & own.locked.keys() & theirs.locked.keys()):
            places = own.locked[joint], theirs.locked[joint]
            if abs(places[0] - places[1]) > SAME_PLACE:
                raise InputError(
                    f"joint {joint!r} is at {places[0]:.6g} for {own.name!r} and at "
                    f"{places[1]:.6g} for {theirs.name!r}, and carries the arm of {other.name!r}; "
                    "accepted: one place, in the `locked` of both robot files"
                )
    return True


def _called(module: str, name: str) -> Any:
    return getattr(importlib.import_module(f"{_PACKAGE}.{module}"), name)
