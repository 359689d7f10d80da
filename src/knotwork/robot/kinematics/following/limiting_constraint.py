"""`LimitingConstraint`: the constraint that keeps an arm from following a tool path."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from knotwork.curves.tool_paths import TimedPath
from knotwork.errors import FollowingError
from knotwork.robot import Robot
from knotwork.robot.kinematics.chain.joint_ranges import LIMIT_TOLERANCE, limits_of
from knotwork.robot.kinematics.chain.velocity import FASTEST_JOINT
from knotwork.units import SI, Units
from knotwork.waypoints import FloatArray

# Smallest singular value below which a path ends at a singularity. Above it, only the joint speeds
# are too high.
SINGULAR_VALUE = 0.01
# Factor of the recommended speed: joints are a little faster on the curve than on the path.
SPEED_MARGIN = 0.999


class LimitingConstraint(NamedTuple):
    """The constraint that prevents an arm from following a path from a start.

    Attributes:
        kind: `"joint limit"`, `"velocity limit"`, `"collision"`, or `"singularity"` where the tool
            can't stay on the path with any joint motion.
        time: Time at which it begins [s].
        joint: Index of the joint that exceeds its limit then.
        value: The joint's worst value [rad or m, or per second].
        limit: The limit that is exceeded.
        smallest_singular_value: Smallest singular value of the Jacobian at the worst time.
        part: Fraction of its speed at which the path can be followed, if that is sufficient.
        contact: Text of the collision.
    """

    kind: str
    time: float
    joint: int
    value: float
    limit: float
    smallest_singular_value: float
    part: float | None = None
    contact: str = ""

    def describe(self, robot: Robot, units: Units) -> str:
        """Text of the constraint: the joint or the collision, its value and the limit."""
        if self.kind == "singularity":
            return (
                "the arm is stretched out or singular and can't continue (smallest singular value "
                f"{self.smallest_singular_value:.3g})"
            )
        if self.kind == "collision":
            return self.contact
        joint, kind = robot.joint_names[self.joint], robot.joint_units[self.joint]
        if self.kind == "joint limit":
            return (
                f"{joint} reaches its limit {units.text(self.limit, kind, '.4g')}; it would have "
                f"to move to {units.text(self.value, kind, '.4g')}"
            )
        singular = (
            f" (close to a singularity, smallest singular value {self.smallest_singular_value:.3g})"
            if self.smallest_singular_value < 0.05
            else ""
        )
        slower = "" if self.part is None else f"; feasible at {self.part:g} of the speed"
        return (
            f"{joint} would have to turn at {units.text(self.value, f'{kind}/s', '.4g')}, and its "
            f"limit is {units.text(self.limit, f'{kind}/s', '.4g')}{singular}{slower}"
        )


class Steps(NamedTuple):
    """The joints along a path from one start; NaN after the point where it is blocked.

    Attributes:
        time: Times of n steps [s], shape (n,).
        q, v: Joint positions and velocities, shape (n, d).
        turns: Offset of each joint by whole turns, shape (d,).
        smallest: Smallest singular values of the Jacobian, shape (n,).
        full: Whether the tool has the full speed of its stretch, shape (n,).
    """

    time: FloatArray
    q: FloatArray
    v: FloatArray
    turns: FloatArray
    smallest: FloatArray
    full: NDArray[np.bool_]


def limiting_constraint(
    robot: Robot, steps: Steps, lost: float, smallest: float, slack: float = LIMIT_TOLERANCE
) -> LimitingConstraint | None:
    """The first constraint that a start violates.

    A joint limit or a singularity comes before a velocity limit, because no lower speed helps.

    Args:
        robot: The arm.
        steps: The joints along the path.
        lost: Time at which the start is blocked [s]; infinite if it reaches the end.
        smallest: Smallest singular value at that time.
        slack: Tolerance on limits [rad or m, for velocities relative].
    """
    blocked = _beyond_range(robot, steps, slack)
    if smallest < SINGULAR_VALUE and (blocked is None or lost < blocked.time):
        return LimitingConstraint("singularity", lost, 0, 0.0, 0.0, smallest)
    if blocked is not None:
        return blocked
    fast = _too_fast(robot, steps, math.isinf(lost), slack)
    if fast is None and math.isfinite(lost):
        return LimitingConstraint("singularity", lost, 0, 0.0, 0.0, smallest)
    return fast


def _beyond_range(robot: Robot, steps: Steps, slack: float) -> LimitingConstraint | None:
    lower, upper = (bound - steps.turns for bound in limits_of(robot))
    over = np.maximum(steps.q - upper, lower - steps.q)
    beyond = (over > slack).any(axis=1)
    if not beyond.any():
        return None
    i = int(beyond.argmax())
    side = np.where(steps.q[i] > upper, upper, lower)
    time, j = float(steps.time[i]), int(over[i].argmax())
    if i and not (over[i - 1] > 0.0).any():
        time, j = _begin(steps, i - 1, over[i] > slack, side, 0)
    k = int(np.nanargmax(over[:, j]))
    bound = limits_of(robot)[1 if steps.q[k, j] > upper[j] else 0][j]
    value = float(steps.q[k, j] + steps.turns[j])
    return LimitingConstraint("joint limit", time, j, value, float(bound), float(steps.smallest[k]))


def _too_fast(
    robot: Robot, steps: Steps, to_the_end: bool, slack: float
) -> LimitingConstraint | None:
    limit = np.minimum(robot.velocity_limit, FASTEST_JOINT)
    speeds = fastest(steps.time, steps.q, steps.v)
    use = speeds / limit
    beyond = (use > 1.0 + slack).any(axis=1)
    if not beyond.any():
        return None
    i = int(beyond.argmax())
    time, j = float(steps.time[i]), int(use[i].argmax())
    if not (np.abs(steps.v[i]) > limit).any():
        time, j = _begin(steps, i, use[i] > 1.0 + slack, limit, 1)
    k = int(np.nanargmax(use[:, j]))
    part = _part_of_speed(use.max(axis=1), steps.full) if to_the_end else None
    smallest = float(np.nanmin(steps.smallest[k : k + 2]))
    return LimitingConstraint(
        "velocity limit", time, j, float(speeds[k, j]), float(limit[j]), smallest, part
    )


def _begin(steps: Steps, i: int, beyond: Any, bound: FloatArray, nu: int) -> tuple[float, int]:
    """Time at which the first of some joints reaches a bound after a step, and its index.

    Args:
        steps: The steps, connected by cubics.
        i: Index of the step.
        beyond: Whether each joint exceeds the bound up to the next step, shape (d,).
        bound: Bounds on positions, or on absolute velocities, shape (d,).
        nu: Order of the derivative: positions 0, velocities 1.
    """
    from numpy.polynomial import Polynomial

    start, h = float(steps.time[i]), float(steps.time[i + 1] - steps.time[i])
    first = np.inf, 0
    for j in np.flatnonzero(beyond).tolist():
        (a, b), (v, w) = steps.q[i : i + 2, j], h * steps.v[i : i + 2, j]
        value = Polynomial([a, v, 3.0 * (b - a) - 2.0 * v - w, v + w - 2.0 * (b - a)]).deriv(nu)
        over = value**2 - (h * bound[j]) ** 2 if nu else value - bound[j]
        roots = over.roots()
        real = roots.real[(abs(roots.imag) < 1e-9) & (roots.real >= 0.0) & (roots.real <= 1.0)]
        first = min(first, (start + h * float(real.min(initial=1.0)), j))
    return first


def fastest(time: FloatArray, q: FloatArray, v: FloatArray) -> FloatArray:
    """Maximum speeds of cubics between consecutive steps, shape (n - 1, ...).

    Args:
        time: Times of n steps [s], shape (n,).
        q: Joint positions, shape (n, ...); NaN where unknown, which gives speeds of -1.
        v: Joint velocities, likewise.
    """
    h, v, w = np.diff(time).reshape(-1, *np.ones(q.ndim - 1, dtype=int)), v[:-1], v[1:]
    means = np.where(h > 0.0, np.diff(q, axis=0) / np.where(h > 0.0, h, 1.0), 0.5 * (v + w))
    bulge = 6.0 * (means - 0.5 * (v + w))
    with np.errstate(divide="ignore", invalid="ignore"):
        u = np.clip(np.nan_to_num(0.5 + 0.5 * (w - v) / bulge), 0.0, 1.0)
    inner = v + (w - v) * u + u * (1.0 - u) * bulge
    return np.asarray(np.nan_to_num(np.abs([v, w, inner]), nan=-1.0).max(axis=0))


def _part_of_speed(use: FloatArray, full: NDArray[np.bool_]) -> float | None:
    """Fraction of the speed at which every joint is within its limit, rounded down to two digits.

    Where the speed changes, a tool with a lower target speed is faster at the same place. From rest
    it has moved s = 4 a² t³ / (9 v), and its speed is proportional to the cube root of a² s² / v.

    Args:
        use: Joint speeds relative to their limits between steps, shape (n - 1,).
        full: Whether the tool has its full speed at the steps, shape (n,).
    """
    even = full[1:] & full[:-1]
    fastest = float(use[even].max(initial=0.0))
    if fastest <= 1.0:
        return None
    part = SPEED_MARGIN / fastest
    if float(use[~even].max(initial=0.0)) > part ** (1.0 / 3.0):
        return None
    unit = 10.0 ** (math.floor(math.log10(part)) - 1)
    return float(f"{math.floor(part / unit) * unit:.2g}")


def following_error(
    robot: Robot,
    path: TimedPath,
    constraint: LimitingConstraint,
    beginning: str,
    remedy: str,
    *,
    since: float | None = None,
    units: Units = SI,
    waypoint: str = "",
    where: str = "",
) -> FollowingError:
    """The error for a path that can't be followed.

    Args:
        robot: The arm.
        path: The path.
        constraint: The limiting constraint.
        beginning: Beginning of the message.
        remedy: Remedy, as a sentence.
        since: Time from which distance is counted [s]; by default the start of the path.
        units: Units of the message.
        waypoint: The waypoint that can't be reached.
        where: Location of its definition.
    """
    begin = path.start_time if since is None else since
    first, reached = path.arc_length(np.array([begin, constraint.time]))
    along = units.text(float(reached - first), "m", ".4g")
    limited = constraint.kind.endswith("limit")
    return FollowingError(
        waypoint,
        f"{beginning} {along} along it {constraint.describe(robot, units)}. {remedy}",
        where=where,
        arc_length=float(reached),
        cause=constraint.kind,
        joint=robot.joint_names[constraint.joint] if limited else "",
        value=constraint.value if limited else None,
        bound=constraint.limit if limited else None,
        part_of_speed=constraint.part,
    )
