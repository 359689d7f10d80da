"""Obstructions of an arm that follows a tool path."""

from __future__ import annotations

import math

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.tool_paths import TimedPath
from knotwork.errors import FollowingError, FollowingObstruction
from knotwork.robot import Robot
from knotwork.robot.kinematics.chain.joint_ranges import LIMIT_TOLERANCE, position_limits
from knotwork.robot.kinematics.chain.velocity import plausible_speeds
from knotwork.robot.kinematics.following.joint_field import JointField
from knotwork.units import SI, Units

SINGULAR_VALUE = 0.01
"""Smallest singular value below which a path ends at a singularity.

Above it, only the joint speeds are too high.
"""


def find_obstruction(
    robot: Robot,
    curve: PiecewisePolynomial | None,
    blocked: tuple[float, float] = (math.inf, math.nan),
    slack: float = LIMIT_TOLERANCE,
) -> FollowingObstruction | None:
    """Find the first obstruction of a motion along a path.

    A joint limit or a singularity comes before a velocity limit, because no lower speed helps.

    Args:
        robot: The arm.
        curve: Joint positions up to the point where the motion is blocked, trailing shape (d,);
            `None` if it is blocked at its start.
        blocked: Time at which the motion is blocked [s], infinite if it reaches the end, and the
            smallest singular value there.
        slack: Tolerance on limits: absolute for positions [rad or m], relative for velocities.
    """
    time, smallest = blocked
    singular = FollowingObstruction("singularity", time, smallest_singular_value=smallest)
    if curve is None:
        return singular
    reached = _find_first_excess(robot, curve, 0, position_limits(robot), slack)
    if smallest < SINGULAR_VALUE and (reached is None or time < reached.time):
        return singular
    if reached is not None:
        return reached
    plausible = plausible_speeds(robot)
    fast = _find_first_excess(robot, curve, 1, (-plausible, plausible), slack * plausible)
    return singular if fast is None and math.isfinite(time) else fast


def _find_first_excess(
    robot: Robot,
    curve: PiecewisePolynomial,
    nu: int,
    bounds: tuple[FloatArray, FloatArray],
    slack: FloatArray | float,
) -> FollowingObstruction | None:
    """Find the joint that is the first to exceed its bounds by more than the slack, or `None`.

    Args:
        robot: The arm.
        curve: Joint positions, trailing shape (d,).
        nu: Order of the derivative that is bounded: positions 0, velocities 1.
        bounds: Lower and upper bounds, shape (d,) each.
        slack: Tolerance on them.
    """
    (lower, upper), extrema = bounds, curve.extrema(nu)
    above, below = extrema.maximum - upper, lower - extrema.minimum
    is_above = above >= below
    bound = np.where(is_above, upper, lower)
    worst = np.where(is_above, extrema.maximum, extrema.minimum)
    worst_time = np.where(is_above, extrema.maximum_time, extrema.minimum_time)
    values, start = curve.derivative(nu) if nu else curve, float(curve.x[0])
    times = np.full(robot.dof, np.inf)
    for j in np.flatnonzero(np.maximum(above, below) > slack).tolist():
        motion = PiecewisePolynomial(values.c[:, :, j], values.x)
        is_beyond = motion(start) > bound[j] if is_above[j] else motion(start) < bound[j]
        crossings = [start] if is_beyond else motion.solve(float(bound[j])).tolist()
        times[j] = np.nanmin([*crossings, worst_time[j]])
    j = int(times.argmin())
    if np.isinf(times[j]):
        return None
    value, limit = float(worst[j]), float(bound[j])
    return FollowingObstruction(
        "velocity limit" if nu else "joint limit",
        float(times[j]),
        robot.joint_names[j],
        unit=robot.joint_units[j],
        value=abs(value) if nu else value,
        limit=abs(limit) if nu else limit,
        smallest_singular_value=float(
            JointField(robot).smallest_singular_values(curve(worst_time[[j]]))[0]
        ),
    )


def make_following_error(
    path: TimedPath,
    obstruction: FollowingObstruction,
    beginning: str,
    accepted: str,
    *,
    since: float | None = None,
    units: Units = SI,
    waypoint: str = "",
    where: str = "",
) -> FollowingError:
    """Make the error for a path that can't be followed.

    Args:
        path: The path.
        obstruction: Its first obstruction.
        beginning: Beginning of the message.
        accepted: Remedies, apart from a lower speed.
        since: Time from which distance is counted [s]; by default the start of the path.
        units: Units of the message.
        waypoint: The waypoint that can't be reached.
        where: Location of its definition.
    """
    if obstruction.cause == "velocity limit":
        accepted = f"a lower speed, {accepted}"
    begin = path.start_time if since is None else since
    first, reached = path.arc_length(np.array([begin, obstruction.time])).tolist()
    return FollowingError(
        waypoint,
        obstruction,
        beginning=beginning,
        accepted=accepted,
        distance=reached - first,
        arc_length=reached,
        where=where,
        units=units,
    )
