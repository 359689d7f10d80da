"""Positions for controllers with cyclic input: RSI, EGM, FANUC's stream motion.

The file is a CSV with comments; your own program sends one row per cycle. The file states the error
of straight lines between the rows.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from knotwork.curves.trajectory import JointTrajectory
from knotwork.files.export.straight import (
    CONTROLLER_UNITS,
    STRAIGHT,
    StraightPoints,
    from_horizontal,
    straight_points,
)
from knotwork.files.storage import csv_text

if TYPE_CHECKING:
    from knotwork.robot import Robot

_ABOUT = {
    "rsi": "KUKA RobotSensorInterface, 4 ms: absolute axis angles",
    "egm": "ABB Externally Guided Motion, 4 ms: joint angles",
    "j519": "FANUC stream motion (J519), 8 ms: joint angles, J3 from the horizontal",
}


def to_rsi(motion: JointTrajectory | StraightPoints) -> str:
    """Write axis angles for KUKA's RSI, one row per 4 ms.

    >>> lift = kw.JointTrajectory.from_knots(["lift"], [0, 1], [[0], [1]], [[0], [0]])
    >>> to_rsi(lift).splitlines()[3:5]
    ['time_s,lift_deg', '0,0']

    Raises:
        ExportError: The motion does not begin and end at rest.
    """
    return _stream(motion, "rsi")


def to_egm(motion: JointTrajectory | StraightPoints) -> str:
    """Write joint angles for ABB's EGM, one row per 4 ms; as for `to_rsi`.

    >>> lift = kw.JointTrajectory.from_knots(["lift"], [0, 1], [[0], [1]], [[0], [0]])
    >>> len(to_egm(lift).splitlines())
    255
    """
    return _stream(motion, "egm")


def to_j519(motion: JointTrajectory | StraightPoints, *, robot: Robot | None = None) -> str:
    """Write joint angles for FANUC's stream motion, one row per 8 ms; as for `to_rsi`.

    J3 counts from the horizontal: it is joint 3 less joint 2 of a URDF of ROS-Industrial, external
    axes of the robot aside.

    >>> lift = kw.JointTrajectory.from_knots(["lift"], [0, 1], [[0], [1]], [[0], [0]])
    >>> len(to_j519(lift).splitlines())
    130
    """
    return _stream(motion, "j519", robot)


def _stream(motion: JointTrajectory | StraightPoints, name: str, robot: Robot | None = None) -> str:
    points = straight_points(motion, **STRAIGHT[name])
    curve = points.trajectory
    about = [f"{_ABOUT[name]}.", f"{points.describe()}.", "The arm must stand at the first row."]
    q = from_horizontal(points, robot) if name == "j519" else points.position
    columns = {"time_s": points.time}
    for joint, unit, values in zip(curve.joint_names, curve.joint_units, q.T, strict=True):
        shown, factor = CONTROLLER_UNITS[unit]
        columns[f"{joint}_{shown}"] = values * factor
    return "".join(f"# {line}\n" for line in about) + csv_text(columns)
