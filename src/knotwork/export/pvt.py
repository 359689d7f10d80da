"""Position-velocity-time tables, as motion drives in PVT mode take them.

A drive in PVT mode joins positions and velocities by cubics, so the knots carry the whole motion.
"""

from __future__ import annotations

import io
import math
from collections.abc import Mapping

import numpy as np

from knotwork.errors import InputError, UnknownNameError
from knotwork.export.carrying import carry
from knotwork.trajectory import JointTrajectory
from knotwork.waypoints import FloatArray

DEGREES = 180.0 / math.pi


def to_pvt(
    trajectory: JointTrajectory,
    *,
    degrees: bool = False,
    scale: Mapping[str, float] | None = None,
    offset: Mapping[str, float] | None = None,
    incremental: bool = False,
    fit: float | None = None,
) -> str:
    """Write a position-velocity-time table as CSV whose header says what each column is.

    A drive's position is scale·q + offset and its velocity scale·q̇, with q in rad, deg or m.

    Args:
        trajectory: The motion.
        degrees: Give revolute joints in deg instead of rad; prismatic ones stay in m.
        scale: Drive units a rad (deg, m) by joint name, not 0; 1 for joints left out.
        offset: Drive's position, in its own units, where the joint is at 0; 0 for joints left out.
        incremental: Give each row's time since the row before it instead of since the start.
        fit: Insert points until the motion is met within this tolerance [rad or m]; by default
            the knots must carry it exactly.

    Raises:
        ExportError: The points can't carry the motion without loss; see `carry`.
        InputError: A factor or the tolerance is out of range, or names no joint.
    """
    names, units = trajectory.joint_names, trajectory.joint_units
    factors = _by_joint(trajectory, scale, 1.0, "scale")
    shifts = _by_joint(trajectory, offset, 0.0, "offset")
    points = carry(trajectory, accelerations=None, fit=fit)
    knots = points.trajectory.knots
    time = np.asarray(knots.time - knots.time[0])
    shown = ["deg" if unit == "rad" and degrees else unit for unit in units]
    ratio = np.array([DEGREES if unit == "deg" else 1.0 for unit in shown])
    position = knots.position * (ratio * factors) + shifts
    velocity = knots.velocity * (ratio * factors)
    header, columns = ["time_step_s" if incremental else "time_s"], []
    columns.append((increments(time) if incremental else time)[:, None])
    about = [
        "Position-velocity-time table: join the rows by cubics in each joint.",
        f"{points.describe()}.",
        f"Column 1: time [s] {'since the row before' if incremental else 'since the start'}.",
    ]
    for i, (name, unit) in enumerate(zip(names, shown, strict=True)):
        own = factors[i] == 1.0 and shifts[i] == 0.0
        label = unit if own else "drive"
        header += [f"{name}.position_{label}", f"{name}.velocity_{label}_per_s"]
        columns += [position[:, i : i + 1], velocity[:, i : i + 1]]
        text = f"joint {_one_line(name)} [{unit}], velocity [{unit}/s]"
        if not own:
            text += (
                f", each in drive units: {factors[i]:.17g} a {unit}, position "
                f"{shifts[i]:+.17g} drive units"
            )
        about.append(f"Columns {2 * i + 2}, {2 * i + 3}: position of {text}.")
    table = io.StringIO()
    np.savetxt(table, np.hstack(columns), fmt="%.17g", delimiter=",")
    head = "".join(f"# {line}\n" for line in about)
    return head + ",".join(quoted(cell) for cell in header) + "\n" + table.getvalue()


def increments(time: FloatArray) -> FloatArray:
    """Steps from row to row whose sum stays at each row's own time: no drift by rounding."""
    steps, total = np.empty_like(time), 0.0
    for i, end in enumerate(time.tolist()):
        steps[i] = end - total
        total += steps[i]
    return steps


def quoted(cell: str) -> str:
    """A cell of CSV, in quotes where it has to be."""
    return '"' + cell.replace('"', '""') + '"' if set(cell) & set(',"\r\n#') else cell


def _one_line(text: str) -> str:
    return repr(text)


def _by_joint(
    trajectory: JointTrajectory, given: Mapping[str, float] | None, missing: float, what: str
) -> FloatArray:
    values = dict(given or {})
    for name, value in values.items():
        if name not in trajectory.joint_names:
            raise UnknownNameError("joint", name, trajectory.joint_names, where=what)
        number = isinstance(value, int | float | np.number) and math.isfinite(value)
        if not number or (what == "scale" and value == 0):
            raise InputError(
                f"{what} of joint {name!r} is {value!r}; it must be a finite number"
                f"{' other than 0' if what == 'scale' else ''}"
            )
    return np.array([float(values.get(name, missing)) for name in trajectory.joint_names])
