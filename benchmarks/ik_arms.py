"""The arms that inverse kinematics is measured on, and the check that every answer goes through."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pinocchio as pin

from knotwork.arrays import FloatArray
from knotwork.robot import Robot, load_robot

ARMS = ("ur3", "ur5", "ur10", "panda", "kinova", "xarm7", "z1", "talos_arm", "bravo7", "baxter")
BAXTER = {
    "name": "baxter",
    "urdf": "example-robot-data:baxter_description/urdf/baxter.urdf",
    "tool_frame": "left_gripper",
}
TOLERANCE = 1e-8
LOOSE = 1e-4
Solver = Callable[[Any, FloatArray], FloatArray | None]


def arm(name: str) -> Robot:
    """An arm by name: the shipped ones, and the left one of a Baxter."""
    return load_robot(BAXTER if name == "baxter" else name)


def box(robot: Robot) -> tuple[FloatArray, FloatArray]:
    """Where configurations are drawn from: the limits, no more than a turn of each joint."""
    lower = np.maximum(robot.limits.lower, -np.pi)
    return lower, np.minimum(robot.limits.upper, lower + 2 * np.pi)


def misses(robot: Robot, pose: Any, q: FloatArray | None) -> float:
    """How far an answer is off [m or rad]; infinite outside the limits or without one."""
    if q is None or not np.isfinite(q).all():
        return np.inf
    slack = 1e-9
    lower, upper = robot.limits.lower - slack, robot.limits.upper + slack
    if ((q < lower) | (q > upper)).any():
        return np.inf
    error = robot.forward(q).actInv(pose)
    return float(max(np.linalg.norm(error.translation), np.linalg.norm(pin.log3(error.rotation))))
