"""Programs of points for controllers of KUKA, ABB and FANUC.

Such a controller makes its own motion between the points of a program: it takes positions and
times, and no velocities. So the points are so near to one another that straight lines between them
are within a tolerance of the motion, and the program says how far off they are. How a controller
rounds the corners between two lines is not published.

Angles are those of the URDF, in deg, and lengths in mm. URDFs of ROS-Industrial count axes as the
controllers do. FANUC counts J3 from the horizontal: J3 = joint 3 - joint 2 of the URDF.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from knotwork.errors import ExportError
from knotwork.export.straight import TICK, Positions, straight_points
from knotwork.trajectory import JointTrajectory
from knotwork.waypoints import FloatArray

AXES = 6
"""Turning axes of an arm that such a controller moves; what slides is an external axis."""


def to_krl(motion: JointTrajectory | Positions, *, fit: float | None = None) -> str:
    """Write a program for a controller of KUKA: a spline block of axis positions, with times.

    The controller draws a spline through the points (KSS 8.3 and later). How it does so is not
    published; the points are near enough for straight lines.

    >>> import knotwork as kw
    >>> to_krl(kw.plan("ur5_deburring").trajectory).count("SPTP {")
    69

    Args:
        motion: From rest to rest, of an arm with six turning axes, base first; sliding joints are
            external axes. Or points of it, as `knotwork.export.straight_points` makes them.
        fit: How far straight lines between points may be off the motion [rad or m]; by default
            1e-3.

    Raises:
        ExportError: The motion moves at an end, or the arm has other axes.
        InputError: The tolerance is out of range.
    """
    points, arm, outer = _points(motion, fit)

    def axes(i: int) -> str:
        names = [f"A{j + 1}" for j in range(AXES)] + [f"E{j + 1}" for j in range(outer.shape[1])]
        values = zip(names, (*arm[i], *outer[i]), strict=True)
        return "{" + ", ".join(f"{name} {value:.6f}" for name, value in values) + "}"

    lines = [f"; {line}" for line in _about(points, "KUKA")]
    lines += ["DEF knotwork_motion()", "  BAS(#INITMOV, 0)", f"  PTP {axes(0)}", "  PTP_SPLINE"]
    lines += ["    TIME_BLOCK START"]
    for i, step in enumerate(np.diff(points.time), 1):
        lines += [f"    SPTP {axes(i)}", f"    TIME_BLOCK PART = {step:.3f}"]
    # parts are proportions of the time at the end of the block
    lines += [f"    TIME_BLOCK END = {points.time[-1]:.3f}"]
    return _text([*lines, "  ENDSPLINE", "END"])


def to_rapid(motion: JointTrajectory | Positions, *, fit: float | None = None) -> str:
    """Write a module for a controller of ABB: moves between axis positions, with times.

    Arguments and errors are those of `to_krl`.

    >>> import knotwork as kw
    >>> to_rapid(kw.plan("ur5_deburring").trajectory).count("MoveAbsJ kw_q")
    70
    """
    points, arm, outer = _points(motion, fit)
    lines = ["MODULE KnotworkMotion", *(f"  ! {line}" for line in _about(points, "ABB"))]
    lines += [f"  CONST jointtarget kw_q{{{points.time.size}}} := ["]
    for i in range(points.time.size):
        more = [f"{value:.6f}" for value in outer[i]] + ["9E9"] * (AXES - outer.shape[1])
        own = ",".join(f"{value:.6f}" for value in arm[i])
        lines += [f"    [[{own}],[{','.join(more)}]]{',' * (i + 1 < points.time.size)}"]
    lines += [
        "  ];",
        "  PROC knotwork_motion()",
        r"    MoveAbsJ kw_q{1}\NoEOffs, v100, fine, tool0;",
    ]
    for i, step in enumerate(np.diff(points.time), 2):
        zone = "fine" if i == points.time.size else "z0"
        lines += [rf"    MoveAbsJ kw_q{{{i}}}\NoEOffs, v5000\T:={step:.3f}, {zone}, tool0;"]
    return _text([*lines, "  ENDPROC", "ENDMODULE"])


def to_ls(motion: JointTrajectory | Positions, *, fit: float | None = None) -> str:
    """Write a program for a controller of FANUC: joint moves with times.

    Arguments and errors are those of `to_krl`. The angle J3 counts from the horizontal: it is
    joint 3 less joint 2 of a URDF of ROS-Industrial.

    >>> import knotwork as kw
    >>> to_ls(kw.plan("ur5_deburring").trajectory).count("msec CNT100")
    68
    """
    points, arm, outer = _points(motion, fit)
    arm = arm.copy()
    arm[:, 2] -= arm[:, 1]
    count = points.time.size
    lines = ["/PROG  KNOTWORK", "/ATTR", 'COMMENT = "KNOTWORK";', "DEFAULT_GROUP = 1,*,*,*,*;"]
    lines += ["/MN"]
    # remarks have up to 32 characters
    moves = [f"!{points.time[-1]:.3f} s, lines {points.error:.1e} off", "J P[1] 10% FINE"]
    for i, step in enumerate(np.diff(points.time), 2):
        end = "FINE" if i == count else "CNT100"
        moves += [f"J P[{i}] {round(step / TICK)}msec {end}"]
    lines += [f"{i:4}:{move} ;" for i, move in enumerate(moves, 1)]
    lines += ["/POS"]
    for i in range(count):
        values = [f"J{j + 1} = {value:.4f} deg" for j, value in enumerate(arm[i])]
        values += [f"E{j + 1} = {value:.4f} mm" for j, value in enumerate(outer[i])]
        lines += [f"P[{i + 1}]{{", "   GP1:", "  UF : F, UT : F,", f"  {', '.join(values)}", "};"]
    return _text([*lines, "/END"])


def _points(
    motion: JointTrajectory | Positions, fit: float | None
) -> tuple[Positions, FloatArray, FloatArray]:
    """Points of a program; angles of the arm [deg], shape (n, 6), and external axes [mm]."""
    points = straight_points(motion, fit=fit)
    units = points.trajectory.joint_units
    turning = [i for i, unit in enumerate(units) if unit == "rad"]
    sliding = [i for i, unit in enumerate(units) if unit != "rad"]
    if len(turning) != AXES or len(sliding) > AXES:
        raise ExportError(
            f"the motion has {len(turning)} turning and {len(sliding)} sliding joints; a program "
            f"of points is for an arm of {AXES} turning axes and up to {AXES} sliding external ones"
        )
    return points, np.degrees(points.position[:, turning]), 1e3 * points.position[:, sliding]


def _about(points: Positions, maker: str) -> Iterator[str]:
    motion = points.trajectory
    names = ", ".join(ascii(name)[1:-1] for name in motion.joint_names)
    yield f"A motion of {motion.duration:.6g} s for a controller of {maker}."
    yield f"{points.describe()}."
    yield f"Joints: {names}, in deg or mm."
    yield "Try it in a simulator first."


def _text(lines: list[str]) -> str:
    return "\n".join(lines) + "\n"
