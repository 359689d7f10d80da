"""Near-singular continuation: solutions near a singularity, found along a curve.

An arm of six joints is nearly singular if, for example, two axes of its wrist are nearly aligned.
It can then move along a curve while the tool stays almost at its pose. On the curve the error has a
component in one direction only, the smallest left-singular vector of the Jacobian. This component
is the signed residual. It is as small as the distance from the singularity, and its zeros are the
solutions. A local search near the curve converges very slowly. Therefore the curve is followed from
end to end, and the zeros of the signed residual are found.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from knotwork.kinematics.chain.joint_ranges import joint_distances
from knotwork.kinematics.chain.levenberg_marquardt import PoseSearch
from knotwork.robot.joint_axes import joint_axes
from knotwork.waypoints import FloatArray

# Maximum residual on a curve [m, rad]. Farther from a singularity local searches converge as usual.
MAX_RESIDUAL = 1e-2
# Pose error of solutions, limited by rounding [m, rad].
SOLUTION_TOLERANCE = 1e-10
CURVE_STEP = 0.15  # along the curve [rad or m]
MIN_CURVE_STEP = CURVE_STEP / 32
# Cosine of the angle that the smallest singular directions may turn in a step.
SAME_DIRECTION = 0.8
MAX_CURVE_STEPS = 160
# Maximum number of curves per pose; a UR5 has four.
MAX_CURVES = 10
# Distance from a point of a followed curve within which a configuration belongs to that curve.
SAME_CURVE = 2.0 * CURVE_STEP
# Number of Newton steps back onto the curve, perpendicular to it, and the size of the last one [rad
# or m]. The remaining error is its square.
CURVE_CORRECTIONS = 6
CORRECTED = 1e-6
# Second smallest singular value below which curves meet.
SECOND_SINGULAR = 1e-3
ROOT_STEPS = 60
GOLDEN_STEPS = 40
GOLDEN = 0.5 * (5.0**0.5 - 1.0)
# Residual [m, rad] above which the vertex of a parabola through three residuals excludes a zero,
# unless they are below `SMALL_RESIDUAL`.
ZERO_MARGIN = 1e-9
SMALL_RESIDUAL = 1e-6
# Rounding error of the residual [m, rad]. A solution at 1e-6 from a singularity is known to 1e-6
# along the curve.
RESIDUAL_ROUNDING = 1e-15


class _CurvePoint(NamedTuple):
    """A point of a curve.

    Attributes:
        q: Joint positions [rad or m], shape (d,).
        along: Smallest right-singular vector: direction of the curve, shape (d,).
        lost: Smallest left-singular vector: direction lost by the tool, shape (6,).
        residual: Signed error in the lost direction.
    """

    q: FloatArray
    along: FloatArray
    lost: FloatArray
    residual: float

    def follows(self, before: _CurvePoint) -> bool:
        """Whether the directions are close to those of the previous point."""
        return bool(min(self.along @ before.along, self.lost @ before.lost) > SAME_DIRECTION)


def near_singular_solutions(
    search: PoseSearch, starts: Iterable[FloatArray], most_steps: int = MAX_CURVE_STEPS
) -> list[FloatArray]:
    """Follow the curves through configurations, and find the solutions on them.

    Args:
        search: The pose, and an arm of six joints.
        starts: Configurations with a small error, shape (d,) each.
        most_steps: Maximum number of steps along each curve in each direction.

    Returns:
        Solutions, shape (d,) each, possibly with duplicates.
    """
    zeros: list[FloatArray] = []
    touching: list[FloatArray] = []  # less exact: the residual is small along the curve
    for curve in _curves(search, starts, most_steps):
        points = _with_double_zeros(search, curve)
        for a, b in itertools.pairwise(points):
            if a.residual * b.residual <= 0.0:
                zeros += _zero(search, a, b)
        for a, b, c in zip(points, points[1:], points[2:], strict=False):
            if _touches(a, b, c) and max(search.errors(b.q)) <= SOLUTION_TOLERANCE:
                touching.append(b.q)
    return zeros + touching


def _touches(a: _CurvePoint, b: _CurvePoint, c: _CurvePoint) -> bool:
    """Whether the residual has a minimum at the second of three points, all of one sign.

    An equally small residual that is not a minimum lies next to a zero and is not a solution.
    """
    sign = 1.0 if b.residual > 0.0 else -1.0
    return 0.0 < sign * b.residual <= min(sign * a.residual, sign * c.residual)


def singular_solutions(search: PoseSearch, starts: Iterable[FloatArray]) -> list[FloatArray]:
    """Follow the curves of a singular arm, on which every point is a solution.

    Args and returns as of `near_singular_solutions`, but with points all along the curves.
    """
    points = [point.q for curve in _curves(search, starts) for point in curve]
    return [q for q in points if max(search.errors(q)) <= SOLUTION_TOLERANCE]


def _curves(
    search: PoseSearch, starts: Iterable[FloatArray], most_steps: int = MAX_CURVE_STEPS
) -> Iterator[list[_CurvePoint]]:
    """Points along each curve through the starts."""
    followed: list[FloatArray] = []
    revolute = joint_axes(search.robot).revolute
    for start in starts:
        if len(followed) == MAX_CURVES:
            break
        if any(joint_distances(points, start, revolute).min() < SAME_CURVE for points in followed):
            continue
        first = _project_onto_curve(search, start, None)
        if first is None:
            continue
        curve, closed = _one_way(search, first, 1.0, most_steps)
        if not closed:
            backward, _ = _one_way(search, first, -1.0, most_steps)
            curve = [*reversed(backward[1:]), *curve]
        followed.append(np.array([point.q for point in curve]))
        yield curve


def _project_onto_curve(
    search: PoseSearch, q: FloatArray, before: _CurvePoint | None
) -> _CurvePoint | None:
    """Move to the nearest point of the curve; `None` if there is none."""
    for _ in range(CURVE_CORRECTIONS):
        e = search.error(q)
        U, s, Vt = np.linalg.svd(search.jacobian(q), full_matrices=False)
        if s[-2] < SECOND_SINGULAR:
            return None
        move = Vt[:-1].T @ ((U[:, :-1].T @ e) / s[:-1])
        size = float(np.abs(move).max())
        if size > 2.0 * CURVE_STEP:
            return None
        q = q + move
        if size < CORRECTED:
            break
    along, lost = Vt[-1], U[:, -1]
    if before is not None:
        along = along if along @ before.along >= 0.0 else -along
        lost = lost if lost @ before.lost >= 0.0 else -lost
    residual = float(lost @ search.error(q))
    return _CurvePoint(q, along, lost, residual) if abs(residual) < MAX_RESIDUAL else None


def _one_way(
    search: PoseSearch, first: _CurvePoint, sign: float, most_steps: int
) -> tuple[list[_CurvePoint], bool]:
    """Points along a curve in one direction to its end, and whether the curve is closed."""
    point, turned = (
        _CurvePoint(first.q, sign * first.along, first.lost, 0.0),
        np.zeros_like(first.q),
    )
    curve, closed, step, length = [first], False, CURVE_STEP, 0.0
    revolute = joint_axes(search.robot).revolute
    for _ in range(most_steps):
        # Extrapolated direction halfway to the next point (Adams and Bashforth).
        halfway = point.along + 0.5 * step * turned
        following = _project_onto_curve(search, point.q + step * halfway, point)
        if (following is None or not following.follows(point)) and step > MIN_CURVE_STEP:
            step *= 0.5
            continue
        if following is None:
            break
        curve.append(following)
        if closed:  # one more step closes the gap between the last and the first point
            break
        length += step
        gap = joint_distances(following.q, first.q, revolute)
        closed = length > 4 * CURVE_STEP and bool(gap < 0.75 * CURVE_STEP)
        turned = (following.along - point.along) / step
        step, point = min(2.0 * step, CURVE_STEP), following
    return curve, closed


def _with_double_zeros(search: PoseSearch, curve: list[_CurvePoint]) -> list[_CurvePoint]:
    """The curve with additional points at double zeros of the residual.

    There two solutions are close to each other, because the arm is nearly singular in a second way.
    """
    result = curve[:1]
    for a, b, c in zip(curve, curve[1:], curve[2:], strict=False):
        between = _double_zero(search, a, b, c)
        if between is None:
            result.append(b)
        else:
            t, point = between
            result += [point, b] if t < 0.0 else [b, point]
    return result + curve[-1:]


def _double_zero(
    search: PoseSearch, a: _CurvePoint, b: _CurvePoint, c: _CurvePoint
) -> tuple[float, _CurvePoint] | None:
    """Find a double zero of the residual, between -1 at the first point and 1 at the third."""
    if not _touches(a, b, c):
        return None
    sign = 1.0 if b.residual > 0.0 else -1.0
    before, value, after = sign * a.residual, sign * b.residual, sign * c.residual
    bend = before - 2.0 * value + after
    if value > SMALL_RESIDUAL and (value - ZERO_MARGIN) * bend > 0.25 * (before - after) ** 2:
        return None
    low, high = -1.0, 1.0
    for _ in range(GOLDEN_STEPS):
        inner = [low + part * (high - low) for part in (1.0 - GOLDEN, GOLDEN)]
        ends = [b.q - a.q if t < 0.0 else c.q - b.q for t in inner]
        points = [
            _project_onto_curve(search, b.q + t * end, b)
            for t, end in zip(inner, ends, strict=True)
        ]
        values = [np.inf if point is None else sign * point.residual for point in points]
        best = int(np.argmin(values))
        point = points[best]
        if point is not None and values[best] <= RESIDUAL_ROUNDING:
            return inner[best], point
        low, high = (low, inner[1]) if best == 0 else (inner[0], high)
    return (
        (inner[best], point) if point is not None and values[best] <= SOLUTION_TOLERANCE else None
    )


def _zero(search: PoseSearch, a: _CurvePoint, b: _CurvePoint) -> Iterator[FloatArray]:
    """The solution between two points of a curve (regula falsi, the Illinois variant)."""
    point, low, high, at_low, at_high = a, 0.0, 1.0, a.residual, b.residual
    for _ in range(ROOT_STEPS):
        slope = at_high - at_low
        t = 0.5 * (low + high) if slope == 0.0 else (low * at_high - high * at_low) / slope
        between = _project_onto_curve(search, a.q + t * (b.q - a.q), a)
        if between is None:
            return
        point = between
        if abs(point.residual) <= RESIDUAL_ROUNDING or high == low:
            break
        if point.residual * at_high < 0.0:
            low, at_low = high, at_high
        else:
            at_low *= 0.5
        high, at_high = t, point.residual
    if max(search.errors(point.q)) <= SOLUTION_TOLERANCE:
        yield point.q
