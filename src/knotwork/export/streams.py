"""Positions for controllers that take one each cycle: RSI, EGM, FANUC's stream motion, Franka.

The file is a CSV with a comment for each fact; a program of yours sends a row each cycle. Between
two rows the controller is taken to go straight, and the file says how far that is off the motion.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from knotwork.errors import ExportError
from knotwork.export.straight import Positions, straight_points
from knotwork.storage import to_csv
from knotwork.trajectory import JointTrajectory
from knotwork.waypoints import FloatArray

if TYPE_CHECKING:
    from knotwork.robot import Robot

TORQUE_RATE = 1000.0
"""Of each joint of a Franka arm, by its control interface [N m/s]."""


CYCLES = {"rsi": 0.004, "egm": 0.004, "j519": 0.008, "franka": 0.001}
"""Time between two positions by format [s]."""
_ABOUT = {
    "rsi": "KUKA RobotSensorInterface, 4 ms: absolute axis angles",
    "egm": "ABB Externally Guided Motion, 4 ms: joint angles",
    "j519": "FANUC stream motion (J519), 8 ms: joint angles, J3 from the horizontal",
    "franka": "Franka control interface, 1 ms: joint positions",
}
_UNITS = {"rad": ("deg", 180.0 / np.pi), "m": ("mm", 1e3)}


def to_rsi(motion: JointTrajectory | Positions) -> str:
    """Write axis angles for KUKA's RSI, a row each 4 ms.

    >>> lift = kw.JointTrajectory.from_knots(["lift"], [0, 1], [[0], [1]], [[0], [0]])
    >>> to_rsi(lift).splitlines()[3:5]
    ['time_s,lift_deg', '0,0']

    Raises:
        ExportError: The motion does not begin and end at rest.
    """
    return _stream(motion, "rsi")


def to_egm(motion: JointTrajectory | Positions) -> str:
    """Write joint angles for ABB's EGM, a row each 4 ms; as `to_rsi`.

    >>> lift = kw.JointTrajectory.from_knots(["lift"], [0, 1], [[0], [1]], [[0], [0]])
    >>> len(to_egm(lift).splitlines())
    255
    """
    return _stream(motion, "egm")


def to_j519(motion: JointTrajectory | Positions) -> str:
    """Write joint angles for FANUC's stream motion, a row each 8 ms; as `to_rsi`.

    J3 counts from the horizontal: it is joint 3 less joint 2 of a URDF of ROS-Industrial.

    >>> lift = kw.JointTrajectory.from_knots(["lift"], [0, 1], [[0], [1]], [[0], [0]])
    >>> len(to_j519(lift).splitlines())
    130
    """
    return _stream(motion, "j519")


def to_franka(motion: JointTrajectory | Positions, *, robot: Robot | None = None) -> str:
    """Write joint positions for Franka's control interface, a row each 1 ms, within its limits.

    The interface takes differences of the rows: velocities, accelerations and jerks must keep the
    limits of the robot file, and torques without gravity may change by 1000 N m/s. A motion begins
    and ends at rest, without acceleration. A callback of libfranka, or of pylibfranka, returns
    `JointPositions` of a row each time that it is called.

    >>> panda = kw.load_robot("panda")
    >>> text = to_franka(kw.plan("panda_pick_place").trajectory, robot=panda)
    >>> "# jerk 0.25 % of its limit: panda_joint2 at" in text
    True

    Args:
        motion: Of the robot's joints.
        robot: The arm; limits and torques are not checked without it, and the file says so.

    Raises:
        ExportError: The motion moves at an end, or exceeds a limit of the interface.
    """
    return _stream(motion, "franka", robot)


def _stream(motion: JointTrajectory | Positions, name: str, robot: Robot | None = None) -> str:
    points = straight_points(motion, cycle=CYCLES[name])
    curve = points.trajectory
    about = [f"{_ABOUT[name]}.", f"{points.describe()}.", "The arm must stand at the first row."]
    if name == "franka":
        about += _franka_use(curve, points.position, robot)
    q = points.position.copy()
    if name == "j519":
        q[:, 2:3] -= q[:, 1:2]
    columns = {"time_s": points.time}
    for joint, unit, values in zip(curve.joint_names, curve.joint_units, q.T, strict=True):
        shown, factor = (unit, 1.0) if name == "franka" else _UNITS[unit]
        columns[f"{joint}_{shown}"] = values * factor
    return "".join(f"# {line}\n" for line in about) + to_csv(columns)


def _franka_use(motion: JointTrajectory, q: FloatArray, robot: Robot | None) -> list[str]:
    """How much of the interface's limits the rows use, at standstill before and after.

    Raises:
        ExportError: One is exceeded.
    """
    if robot is None:
        return ["Limits of the interface are not checked: no robot is given."]
    still = np.concatenate((np.repeat(q[:1], 3, axis=0), q, np.repeat(q[-1:], 3, axis=0)))
    rates, lines, cycle = [still], [], CYCLES["franka"]
    for quantity in ("velocity", "acceleration", "jerk"):
        rates.append(np.diff(rates[-1], axis=0) / cycle)
        limit = getattr(robot, f"{quantity}_limit")
        lines.append(_use(motion, quantity, rates[-1], limit))
    free = robot.with_gravity(np.zeros(3))
    states = zip(still[2:], rates[1][1:], rates[2], strict=True)
    torque = np.array([free.torque(*state) for state in states])
    rate = np.diff(torque, axis=0) / cycle
    return [*lines, _use(motion, "torque rate", rate, np.full(q.shape[1], TORQUE_RATE))]


def _use(motion: JointTrajectory, quantity: str, values: FloatArray, limit: FloatArray) -> str:
    """Say how much of a limit differences of rows use.

    Raises:
        ExportError: More than all of it.
    """
    use = np.abs(values) / limit
    row, joint = (int(i) for i in np.unravel_index(int(use.argmax()), use.shape))
    name, time = motion.joint_names[joint], max(0, row - 3) * CYCLES["franka"]
    if use[row, joint] > 1.0:
        raise ExportError(
            f"{quantity} of joint {name!r} is {abs(values[row, joint]):.4g} at {time:.3f} s, as "
            f"Franka's control interface takes differences of rows; its limit is "
            f"{limit[joint]:.4g}; give the motion more time, or end_acceleration: zero",
            joint=name,
            error=float(abs(values[row, joint])),
            time=time,
        )
    return f"{quantity} {100 * use[row, joint]:.2g} % of its limit: {name} at {time:.3f} s."
