"""Position-velocity-time tables for motion drives in PVT mode.

A drive in PVT mode interpolates positions and velocities by cubics, so the knots define the motion.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from knotwork.errors import ExportError, InputError, UnknownNameError
from knotwork.errors.arguments import finite_number, flag
from knotwork.export.lossless import LOSSLESS, Points, motion_points
from knotwork.storage import to_csv
from knotwork.trajectory import JointTrajectory
from knotwork.waypoints import FloatArray

DEGREES = 180.0 / math.pi

LARGEST = float(np.finfo(float).max)
SMALLEST = float(np.finfo(float).tiny)
HALF_DIGIT = 2.0**-53
"""Rounding of a sum, relative to it."""

HELD = 1e-9
"""Largest rounding error of positions with a large offset [rad or m]: a hundred-thousandth of the
resolution of encoders whose counts begin far from zero."""


def to_pvt(
    motion: JointTrajectory | Points,
    *,
    degrees: bool = False,
    scale: Mapping[str, float] | None = None,
    offset: Mapping[str, float] | None = None,
    incremental: bool = False,
    fit: float | None = None,
) -> str:
    """Write a position-velocity-time table as CSV whose header describes each column.

    >>> import knotwork as kw
    >>> text = to_pvt(kw.plan("paper_case").trajectory, degrees=True)
    >>> text.splitlines()[4]
    'time_from_start_s,joint_1.position_deg,joint_1.velocity_deg_per_s'

    Args:
        motion: The motion, or points of it from `motion_points`.
        degrees: This and the others are described at `knotwork.trajectory.exportable.DriveOptions`.
        scale: Drive units per rad (deg, m) by joint name.
        offset: Position of the drive at joint position 0, by joint name.
        incremental: Give times since the previous row.
        fit: Tolerance of the motion [rad or m].

    Raises:
        ExportError: The points can't define the motion, see `motion_points`; or their digits in
            drive units can't.
        InputError: A factor or the tolerance is out of range, or a joint is unknown.
    """
    degrees, incremental = flag(degrees, "degrees"), flag(incremental, "incremental")
    points = motion_points(motion, accelerations=None, fit=fit)
    trajectory = points.trajectory
    factors = _by_joint(trajectory, scale, 1.0, "scale")
    shifts = _by_joint(trajectory, offset, 0.0, "offset")
    room = HELD if fit is None else max(HELD, fit - points.error)
    time = np.asarray(trajectory.breaks - trajectory.start_time)
    since = "the previous row" if incremental else "the start"
    columns = {"time_step_s": increments(time)} if incremental else {"time_from_start_s": time}
    about = [
        "Position-velocity-time table: join the rows by cubics in each joint.",
        f"{points.describe()}.",
        f"Column 1: time [s] since {since}.",
    ]
    for i, name in enumerate(trajectory.joint_names):
        si = trajectory.joint_units[i]
        unit = "deg" if si == "rad" and degrees else si
        factor, shift = factors[i], shifts[i]
        position, velocity = _in_drive_units(trajectory, i, unit, factor, shift, room)
        own = factor == 1.0 and shift == 0.0
        label = unit if own else "drive"
        columns[f"{name}.position_{label}"] = position
        columns[f"{name}.velocity_{label}_per_s"] = velocity
        text = f"joint {name!r} [{unit}], velocity [{unit}/s]"
        if not own:
            text += (
                f", each in drive units: {factor!r} a {unit}, position "
                f"{'' if shift < 0.0 else '+'}{shift!r} drive units"
            )
        about.append(f"Columns {2 * i + 2}, {2 * i + 3}: position of {text}.")
    return "".join(f"# {line}\n" for line in about) + to_csv(columns)


def _in_drive_units(
    trajectory: JointTrajectory, joint: int, unit: str, factor: float, shift: float, held: float
) -> tuple[FloatArray, FloatArray]:
    """Positions and velocities of a joint's knots in drive units, shape (n,) each.

    Raises:
        ExportError: Numbers of this size can't represent the motion. Undoing the factor must
            restore it within 1e-12 of the largest value, or of 1 rad or m (per second),
            whichever is more; undoing the offset, within that or `held`.
    """
    name, si = trajectory.joint_names[joint], trajectory.joint_units[joint]
    knots = trajectory.knots
    own = np.stack((knots.position[:, joint], knots.velocity[:, joint]))
    peaks = np.abs(own).max(axis=1)
    bounds = LOSSLESS * np.maximum(1.0, peaks)
    ratio = DEGREES if unit == "deg" else 1.0
    per = np.float64(ratio * factor)
    with np.errstate(all="ignore"):
        scaled = own * per
        kept = np.abs(scaled / per - own) <= bounds[:, None]
        position = scaled[0] + shift
        off = np.abs((position - shift) / per - own[0])
    if not kept.all():
        smallest = 2.0 * SMALLEST / ratio
        largest = 0.5 * LARGEST / ratio / max(1.0, float(peaks.max()))
        raise ExportError(
            f"scale of joint {name!r} is {factor!r}: numbers of that size can't hold its motion, "
            f"which reaches {peaks[0]:.3g} {si} and {peaks[1]:.3g} {si}/s; {smallest:.1e} to "
            f"{largest:.1e} drive units a {unit} are accepted, of either sign",
            joint=name,
        )
    most = max(float(bounds[0]), held)
    if not (off <= most).all():
        worst, room = float(off.max()), most * abs(float(per)) / (4.0 * HALF_DIGIT)
        found = f"only within {worst:.3g} {si}" if math.isfinite(worst) else "not at all"
        raise ExportError(
            f"offset of joint {name!r} is {shift!r}: with it the digits of a number hold the "
            f"motion {found}, and at most {most:.3g} {si} is accepted; with this scale an offset "
            f"from {-room:.1e} to {room:.1e} drive units is accepted",
            joint=name,
            error=worst,
        )
    return position, scaled[1]


def increments(time: FloatArray) -> FloatArray:
    """Steps between rows whose sum stays at each row's own time: no drift by rounding."""
    steps, total = np.empty_like(time), 0.0
    for i, end in enumerate(time.tolist()):
        steps[i] = end - total
        total += steps[i]
    return steps


def _by_joint(
    trajectory: JointTrajectory, given: Mapping[str, float] | None, missing: float, what: str
) -> list[float]:
    """A number for each joint."""
    if given is not None and not isinstance(given, Mapping):
        raise InputError(f"{what} is {given!r}; it must be a mapping of joint names to numbers")
    values: dict[str, float] = {}
    for name, value in (given or {}).items():
        if name not in trajectory.joint_names:
            raise UnknownNameError("joint", name, trajectory.joint_names, where=what)
        values[name] = finite_number(value, f"{what} of joint {name!r}")
        if what == "scale" and values[name] == 0.0:
            raise InputError(f"scale of joint {name!r} is {value!r}; it must be other than 0")
    return [values.get(name, missing) for name in trajectory.joint_names]
