"""Position-velocity-time tables for motion drives in PVT mode.

A drive in PVT mode interpolates positions and velocities by cubics, so the knots define the motion.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import InputError, UnknownNameError
from knotwork.errors.arguments import require_flag, require_number
from knotwork.files.export.lossless import MotionPoints, motion_points
from knotwork.files.storage import csv_text

DEGREES = 180.0 / math.pi


@np.errstate(over="ignore", invalid="ignore")  # an error reports overflow
def to_pvt(
    motion: JointTrajectory | MotionPoints,
    *,
    degrees: bool = False,
    scale: Mapping[str, float] | None = None,
    offset: Mapping[str, float] | None = None,
    incremental: bool = False,
    tolerance: float | None = None,
) -> str:
    """Write a position-velocity-time table as CSV whose header describes each column.

    A drive's position is scale·q + offset and its velocity scale·q̇, with q in rad, deg or m.

    >>> to_pvt(kw.plan("paper_case").trajectory, degrees=True).splitlines()[4]
    'time_from_start_s,joint_1.position_deg,joint_1.velocity_deg_per_s'

    Args:
        motion: The motion, or points of it from `motion_points`.
        degrees: Give revolute joints in deg instead of rad; prismatic ones stay in m.
        scale: Drive units per rad (deg, m) by joint name, not 0; 1 for joints left out.
        offset: Position of the drive at joint position 0, by joint name; 0 for joints left out.
        incremental: Give times since the previous row instead of since the start.
        tolerance: Tolerance [rad or m], met by inserted points; by default the knots must be exact.

    Raises:
        ExportError: The points can't define the motion, see `motion_points`.
        InputError: A factor or the tolerance is out of range, or a joint is unknown.
    """
    degrees = require_flag(degrees, "degrees")
    incremental = require_flag(incremental, "incremental")
    points = motion_points(motion, tolerance=tolerance)
    trajectory, knots = points.trajectory, points.trajectory.knots
    factors = _number_per_joint(trajectory, scale, 1.0, "scale")
    shifts = _number_per_joint(trajectory, offset, 0.0, "offset")
    time = np.asarray(trajectory.breaks - trajectory.start_time)
    columns = {"time_step_s": increments(time)} if incremental else {"time_from_start_s": time}
    since = "the previous row" if incremental else "the start"
    about = [
        "Position-velocity-time table: join the rows by cubics in each joint.",
        f"{points.describe()}.",
        f"Column 1: time [s] since {since}.",
    ]
    joints = zip(trajectory.joint_names, factors, shifts, strict=True)
    for i, (name, factor, shift) in enumerate(joints):
        is_in_degrees = degrees and trajectory.joint_units[i] == "rad"
        unit = "deg" if is_in_degrees else trajectory.joint_units[i]
        drive_units_per_si = factor * DEGREES if is_in_degrees else factor
        position = knots.position[:, i] * drive_units_per_si + shift
        velocity = knots.velocity[:, i] * drive_units_per_si
        if not np.isfinite([position, velocity]).all():
            raise InputError(f"scale of joint {name!r} is {factor!r}, which is too large")
        label = unit if (factor, shift) == (1.0, 0.0) else "drive"
        columns[f"{name}.position_{label}"] = position
        columns[f"{name}.velocity_{label}_per_s"] = velocity
        numbers = f"Columns {2 * i + 2}, {2 * i + 3}"
        about.append(
            f"{numbers}: position and velocity of joint {name!r} in "
            f"{_units_text(unit, factor, shift)}."
        )
    return "".join(f"# {line}\n" for line in about) + csv_text(columns)


def _units_text(unit: str, factor: float, shift: float) -> str:
    """Units of a joint's two columns; those of a drive by their formulas."""
    if (factor, shift) == (1.0, 0.0):
        return f"{unit} and {unit}/s"
    position = f"{factor!r} * q + {shift!r}".replace("+ -", "- ")
    return f"drive units: {position} and {factor!r} * v, for q in {unit}"


def increments(time: FloatArray) -> FloatArray:
    """Compute steps between rows that add up to the time of each row, without drift by rounding."""
    steps, total = np.empty_like(time), 0.0
    for i, end in enumerate(time.tolist()):
        steps[i] = end - total
        total += steps[i]
    return steps


def _number_per_joint(
    trajectory: JointTrajectory, mapping: Mapping[str, float] | None, missing: float, option: str
) -> list[float]:
    """List the number of each joint, in the order of the motion."""
    if mapping is not None and not isinstance(mapping, Mapping):
        raise InputError(f"{option} is {mapping!r}; it must be a mapping of joint names to numbers")
    values: dict[str, float] = {}
    for name, value in (mapping or {}).items():
        if name not in trajectory.joint_names:
            raise UnknownNameError("joint", name, trajectory.joint_names, where=option)
        values[name] = require_number(value, f"{option} of joint {name!r}")
        if option == "scale" and values[name] == 0.0:
            raise InputError(f"scale of joint {name!r} is {value!r}; it must be other than 0")
    return [values.get(name, missing) for name in trajectory.joint_names]
