"""Motions of other robots in a scene: planned from their scenarios, or read from files.

Planning imports scenes, so scenes load it by name when they call it.
"""

from __future__ import annotations

from contextvars import ContextVar
from dataclasses import dataclass
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from knotwork.curves.polynomial.extended_curve import ExtendedCurve
from knotwork.errors import InputError
from knotwork.files.foreign import read_trajectory
from knotwork.robot import Robot
from knotwork.task.scenario import PlacedRobot, load_scenario
from knotwork.task.scenario.scenario_joints import read_scenario_joints

if TYPE_CHECKING:
    from knotwork.scene.collision_model import CollisionModel

LOCKED_JOINT_TOLERANCE = 1e-9
"""Tolerance of the position of a joint that two robot files lock [rad or m]."""

_being_planned: ContextVar[tuple[str, ...]] = ContextVar("_being_planned", default=())
"""Scenarios that are being planned in this thread; each one needs the next one."""


@dataclass(frozen=True, eq=False)
class OtherMotion:
    """Motion of another robot.

    Attributes:
        robot: The robot.
        model: Its bodies, in the axes of its URDF's root.
        known_motions: Positions of all joints of its model.
        held: Names of its held objects.
    """

    robot: Robot
    model: CollisionModel
    known_motions: tuple[ExtendedCurve, ...]
    held: frozenset[str]


def load_other_motion(placed: PlacedRobot) -> OtherMotion:
    """Plan or read the motion of another robot; results are cached.

    Raises:
        InputError: Its scenario is wrong, fails its own check, or needs itself.
    """
    path = str(placed.scenario)
    waiting = _being_planned.get()
    if path in waiting:
        cycle = " needs ".join((*waiting[waiting.index(path) :], path))
        raise InputError(
            f"robots need one another: {cycle}; accepted: motion: a recorded motion of one of them"
        )
    files = (Path(placed.scenario), placed.motion) if placed.motion else (Path(placed.scenario),)
    changed = tuple(file.stat().st_mtime_ns for file in files if file.is_file())
    token = _being_planned.set((*waiting, path))
    try:
        return _load_motion(path, placed.motion, changed)
    finally:
        _being_planned.reset(token)


@lru_cache(maxsize=8)
def _load_motion(path: str, motion: Path | None, changed: tuple[int, ...]) -> OtherMotion:
    scenario = load_scenario(path)
    if scenario.task.robot is None:
        raise InputError(f"{path}: names no robot")
    if motion is None:
        plan = import_module("knotwork.planning").plan(scenario)
        if not plan.report.ok:
            raise InputError(
                f"{path}: its motion fails its own check: {plan.report.failures[0].message}; "
                "accepted: a scenario that passes, or motion: the file of a recorded motion"
            )
        scenario, joints, trajectory = plan.scenario, plan.joints, plan.trajectory
    else:
        joints = read_scenario_joints(scenario)
        trajectory, faults = read_trajectory(motion, joints.joint_names, joints.joint_units)
        if faults:
            raise InputError(f"{motion}: {faults[0]}")
    moving = import_module("knotwork.verification.motion").Motion(trajectory, joints)
    collisions = import_module("knotwork.verification.collisions")
    model = collisions.collision_model_of(moving, scenario, joints.robot)
    held = frozenset(held.name for held in scenario.scene.held)
    known = (ExtendedCurve(moving.curve), *model.known_motions)
    return OtherMotion(joints.robot, model, known, held)


def are_in_one_cell(robot: Robot, second: Robot) -> bool:
    """Whether two robots are arms of one URDF, which defines their relative placement.

    Raises:
        InputError: A joint carries an arm but only moves in the motion of the other one, or has two
            positions.
    """
    if robot.urdf != second.urdf or {*robot.joint_names} & {*second.joint_names}:
        return False
    for arm, other in ((robot, second), (second, robot)):
        by_joint = other.carrying_joints
        carrying = frozenset().union(*(by_joint[name] for name in other.joint_names))
        for joint in sorted(carrying & {*arm.joint_names, *arm.followers}):
            raise InputError(
                f"joint {joint!r} is moved by the motion of {arm.name!r} and carries the arm of "
                f"{other.name!r}, whose motion keeps it fixed; accepted: arms of one URDF on a "
                f"fixed base, {joint!r} locked in both robot files"
            )
        for joint in sorted(carrying & robot.locked.keys() & second.locked.keys()):
            positions = robot.locked[joint], second.locked[joint]
            if abs(positions[0] - positions[1]) > LOCKED_JOINT_TOLERANCE:
                raise InputError(
                    f"joint {joint!r} is at {positions[0]:.6g} for {robot.name!r} and at "
                    f"{positions[1]:.6g} for {second.name!r}, and carries the arm of "
                    f"{other.name!r}; accepted: one position, in the `locked` of both robot files"
                )
    return True
