"""What a test plans is judged by the judge too: it shares nothing with Knotwork."""

from __future__ import annotations

import tempfile
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

import knotwork as kw
from judge.cases import bumped
from judge.motion import Motion
from judge.task import Task
from judge.verdict import Wrong, judge
from knotwork.waypoints import JointWaypoints

FEW = 100
"""Samples of a motion where a test judges many of them."""


def judged(plan: kw.Plan, given: Path | dict[str, Any]) -> list[Wrong]:
    """What the judge finds in a plan, from the scenario's file or mapping.

    Nothing if the plan failed its own check: it is not passed off as right.
    """
    if not plan.report.ok:
        return []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        plan.save(folder)
        return judged_folder(folder, given)


def judged_folder(folder: Path, given: Path | dict[str, Any]) -> list[Wrong]:
    """What the judge finds in a plan that is saved in a folder."""
    numbers = folder / "scenario.yaml"  # where times were free
    if numbers.exists():
        given = numbers
    task = Task.read(given) if isinstance(given, Path) else Task(given, folder)
    still = task.arm is None or not (task.arm.moved or task.arm.ground or task.arm.on)
    motion = Motion.read(folder / "trajectory.json")
    return judge(task, motion, collisions=still)  # moving things are judged in tests/moving


def judged_joints(
    motion: kw.JointTrajectory, waypoints: JointWaypoints, but: Collection[str] = (), **more: Any
) -> list[Wrong]:
    """What the judge finds in a motion through waypoints of joints.

    Args:
        motion: The motion.
        waypoints: The positions and velocities that it was planned for.
        but: Kinds that the planner does not promise anything of.
        more: Other keys of the task.
    """
    names = waypoints.joint_names
    values = zip(waypoints.time, waypoints.position, waypoints.velocity, strict=True)
    rows = [
        {
            "time": float(t),
            "joints": dict(zip(names, y.tolist(), strict=True)),
            "velocity": dict(zip(names, v.tolist(), strict=True)),
        }
        for t, y, v in values
    ]
    return _found(motion, {"waypoints": rows, **more}, but)


OWN_LIMITS = ("effort limit", "acceleration limit", "jerk limit")
"""Of the arm, which following a path does not know."""


def judged_along(
    motion: kw.JointTrajectory,
    robot: str,
    first: pin.SE3,
    points: NDArray[np.float64],
    speed: float,
    *,
    acceleration: float = 1.0,
    but: Collection[str] = (),
    **tolerances: float,
) -> list[Wrong]:
    """What the judge finds in a motion along a curve through points, from rest to rest.

    Args:
        motion: The motion.
        robot: Name of the arm.
        first: Pose of the tool at the start, whose orientation it keeps [m].
        points: On the curve [m], shape (n, 3).
        speed: Of the tool [m/s].
        acceleration: Along the path [m/s²].
        but: Kinds that are not looked for, such as an orientation that is not kept. Following does
            not limit efforts, nor how fast the path asks accelerations to change.
        tolerances: Of the task.
    """
    start = {
        "position": first.translation.tolist(),
        "quaternion_xyzw": pin.Quaternion(first.rotation).coeffs().tolist(),
    }
    along = {"along": {"points": points.tolist()}, "speed": speed}
    end = {"name": "end", "pose": {"position": points[-1].tolist()}, **along}
    waypoints = [{"name": "start", "time": motion.start_time, "pose": start}, end]
    data = {"robot": robot, "path": {"acceleration": acceleration}, "waypoints": waypoints}
    found = _found(motion, {**data, "tolerances": tolerances}, {*but, *OWN_LIMITS})
    return [finding for finding in found if finding.where != "acceleration changes"]


def with_bump(
    motion: kw.JointTrajectory, joint: int, middle: float, half: float, height: float
) -> kw.JointTrajectory:
    """The motion and a smooth bump of one joint: when, half its time [s] and how high [rad]."""
    curve = motion.polynomial
    own = Motion(motion.joint_names, curve.x, curve.c)
    spoiled = bumped(own, joint, middle, half, height)
    return replace(motion, polynomial=kw.PiecewisePolynomial(spoiled.c, spoiled.x))


def _found(motion: kw.JointTrajectory, data: dict[str, Any], but: Collection[str]) -> list[Wrong]:
    curve = Motion(motion.joint_names, motion.polynomial.x, motion.polynomial.c)
    wrongs = judge(Task(data, Path()), curve, collisions=False, samples=FEW)
    return [one for one in wrongs if one.kind not in but]
