"""Solutions next to a singularity, found along the motion that the tool hardly feels.

Where an arm of six joints is nearly singular, as where two axes of its wrist are nearly in line,
it can move along a curve while the tool stays almost at its pose: a valley of the pose error, on
whose floor the error is as small as the distance from the singularity. The solutions are single
points of that curve. A search that comes down into the valley crawls along it and hardly gets to
them; here the valley is followed from end to end instead, and its solutions are where the rest of
the error, which has a sign, passes through zero.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from knotwork.kinematics.chain.joint_ranges import BoolArray, difference
from knotwork.kinematics.chain.levenberg_marquardt import PoseSearch
from knotwork.waypoints import FloatArray

# Errors on the floor of a valley are below this [m, rad]: farther from a singularity searches
# converge as anywhere.
DEEP = 1e-2
# Solutions there are as exact as rounding lets them be [m, rad].
VALLEY_RESIDUAL = 1e-10
STEP = 0.15  # along the valley [rad or m]
SHORTEST_STEP = STEP / 32
# Cosine of the angle that the directions along and across may turn in a step.
SAME_DIRECTION = 0.8
MOST_STEPS = 160
# Valleys followed for one pose at most; a UR5 has four.
MOST_VALLEYS = 10
# A configuration so near one that a valley has been followed through is in that valley.
SAME_VALLEY = 2.0 * STEP
# Steps down to the floor: Newton's, in the directions other than the valley's.
DESCENTS = 6
# A move of less leaves what the square of it leaves: nothing.
DESCENDED = 1e-7
# There is one direction that the tool hardly feels; where there are two, valleys meet.
SECOND_SINGULAR = 1e-3
ROOT_STEPS = 60
DIP_STEPS = 40
GOLDEN = 0.5 * (5.0**0.5 - 1.0)
# A parabola through three points that stays this far above zero is no dip [m, rad].
DIP = 1e-9
# The rest of the error is known no better [m, rad]. A solution a millionth from a singularity is
# then known to a millionth of its way along the valley.
ROUNDING = 1e-15


@dataclass(frozen=True, eq=False)
class _Floor:
    """A point on the floor of a valley.

    Attributes:
        q: Joint positions [rad or m], shape (d,).
        along: Direction of the valley, shape (d,), a unit vector.
        across: Direction of the error that the arm can't mend there, shape (6,), a unit vector.
        rest: The error along it, with its sign.
    """

    q: FloatArray
    along: FloatArray
    across: FloatArray
    rest: float

    def follows(self, before: _Floor) -> bool:
        """Whether the directions are nearly those of the point before."""
        return bool(min(self.along @ before.along, self.across @ before.across) > SAME_DIRECTION)


def solutions_in_valleys(
    search: PoseSearch, starts: Iterable[FloatArray], revolute: BoolArray, tolerance: float
) -> list[FloatArray]:
    """Follow the valleys that configurations lie in, and find the solutions there.

    Args:
        search: The pose, and an arm of six joints.
        starts: Configurations with a small error, shape (d,) each.
        revolute: Which joints are revolute, shape (d,).
        tolerance: Of solutions: distance [m] and angle [rad].

    Returns:
        Solutions, shape (d,) each; some perhaps more than once.
    """
    found: list[FloatArray] = []
    for way in _valleys(search, starts, revolute):
        for a, b in itertools.pairwise(_with_dips(search, way)):
            if a.rest * b.rest <= 0.0:
                found += _root(search, a, b, tolerance)
    return found


def solutions_outward(
    search: PoseSearch, start: FloatArray, tolerance: float, most_steps: int
) -> Iterator[FloatArray]:
    """Follow the valley that a configuration lies in both ways, and give solutions as they come.

    Args:
        search: The pose, and an arm of six joints or more: of the floor of a valley that is not a
            line, a line is followed.
        start: A configuration with a small error, shape (d,).
        tolerance: Of solutions: distance [m] and angle [rad].
        most_steps: How many steps to try either way.
    """
    first = _down(search, start, None)
    if first is None:
        return
    here = [first, first]
    walks = (_walk(search, first, sign, most_steps) for sign in (1.0, -1.0))
    for pair in itertools.zip_longest(*walks):
        for side, point in enumerate(pair):
            if point is None:
                continue
            _, there = point
            if here[side].rest * there.rest <= 0.0:
                yield from _root(search, here[side], there, tolerance)
            here[side] = there


def floors_of_valleys(
    search: PoseSearch, starts: Iterable[FloatArray], revolute: BoolArray, tolerance: float
) -> list[FloatArray]:
    """Follow the valleys of an arm that is singular: all along them the pose is met.

    Arguments as of `solutions_in_valleys`.

    Returns:
        Points along the valleys that are solutions, shape (d,) each.
    """
    points = [floor.q for way in _valleys(search, starts, revolute) for floor in way]
    return [q for q in points if max(search.errors(q)) <= tolerance]


def _valleys(
    search: PoseSearch, starts: Iterable[FloatArray], revolute: BoolArray
) -> Iterator[list[_Floor]]:
    """Points along each valley that starts lie in."""
    followed: list[FloatArray] = []
    for start in starts:
        if len(followed) == MOST_VALLEYS:
            break
        if any(_apart(points, start, revolute).min() < SAME_VALLEY for points in followed):
            continue
        first = _down(search, start, None)
        if first is None:
            continue
        way, closed = _follow(search, first, 1.0, revolute)
        if not closed:
            back, _ = _follow(search, first, -1.0, revolute)
            way = [*reversed(back[1:]), *way]
        followed.append(np.array([floor.q for floor in way]))
        yield way


def _apart(points: FloatArray, q: FloatArray, revolute: BoolArray) -> FloatArray:
    """Largest joint distance of each of some configurations from another, turns aside."""
    return np.asarray(np.abs(difference(points, q, revolute)).max(axis=1))


def _down(search: PoseSearch, q: FloatArray, before: _Floor | None) -> _Floor | None:
    """Go down to the floor of the valley; `None` where there is none."""
    for _ in range(DESCENTS):
        e = search.error(q)
        U, s, Vt = np.linalg.svd(search.jacobian(q), full_matrices=False)
        if s[-2] < SECOND_SINGULAR:
            return None
        move = Vt[:-1].T @ ((U[:, :-1].T @ e) / s[:-1])
        size = float(np.abs(move).max())
        if size > 2.0 * STEP:
            return None
        q = q + move
        if size < DESCENDED:
            break
    along, across = Vt[-1], U[:, -1]
    if before is not None:
        along = along if along @ before.along >= 0.0 else -along
        across = across if across @ before.across >= 0.0 else -across
    rest = float(across @ search.error(q))
    return _Floor(q, along, across, rest) if abs(rest) < DEEP else None


def _follow(
    search: PoseSearch, first: _Floor, sign: float, revolute: BoolArray
) -> tuple[list[_Floor], bool]:
    """Points along a valley in one direction to its end, or round to the first, and whether so."""
    way, closed = [first], False
    for length, there in _walk(search, first, sign):
        way.append(there)
        if closed:  # a step beyond, so that nothing is between the last and the first
            break
        closed = length > 4 * STEP and _apart(there.q[None], first.q, revolute)[0] < 0.75 * STEP
    return way, closed


def _walk(
    search: PoseSearch, first: _Floor, sign: float, most_steps: int = MOST_STEPS
) -> Iterator[tuple[float, _Floor]]:
    """Points along a valley in one direction, and how far they are."""
    here = _Floor(first.q, sign * first.along, first.across, first.rest)
    step, length = STEP, 0.0
    for _ in range(most_steps):
        there = _down(search, here.q + step * here.along, here)
        turned = there is None or not there.follows(here)
        if turned and step > SHORTEST_STEP:
            step *= 0.5
            continue
        if there is None:
            break
        length += step
        yield length, there
        step = min(2.0 * step, STEP)
        here = there


def _with_dips(search: PoseSearch, way: list[_Floor]) -> list[_Floor]:
    """The same with a point where the error dips to zero or below between points.

    There two solutions lie close together: the arm is nearly singular in another way, too.
    """
    result = way[:1]
    for a, b, c in zip(way, way[1:], way[2:], strict=False):
        dip = _dip(search, a, b, c)
        if dip is None:
            result.append(b)
        else:
            t, lowest = dip
            result += [lowest, b] if t < 0.0 else [b, lowest]
    return result + way[-1:]


def _dip(search: PoseSearch, a: _Floor, b: _Floor, c: _Floor) -> tuple[float, _Floor] | None:
    """Where the error between points dips to zero: from -1 at the first to 1 at the third."""
    sign = 1.0 if b.rest > 0.0 else -1.0
    left, here, right = sign * a.rest, sign * b.rest, sign * c.rest
    bend = left - 2.0 * here + right
    if not 0.0 < here <= min(left, right) or here * bend > 0.25 * (left - right) ** 2 + DIP * bend:
        return None
    low, high = -1.0, 1.0
    for _ in range(DIP_STEPS):  # golden section
        inner = [low + part * (high - low) for part in (1.0 - GOLDEN, GOLDEN)]
        floors = [
            _down(search, b.q + (t * (b.q - a.q) if t < 0.0 else t * (c.q - b.q)), b) for t in inner
        ]
        values = [np.inf if floor is None else sign * floor.rest for floor in floors]
        best = int(np.argmin(values))
        floor = floors[best]
        if floor is not None and values[best] <= ROUNDING:
            return inner[best], floor
        low, high = (low, inner[1]) if best == 0 else (inner[0], high)
    return None


def _root(search: PoseSearch, a: _Floor, b: _Floor, tolerance: float) -> Iterator[FloatArray]:
    """The solution between two points of a valley (regula falsi, the Illinois variant)."""
    floor, low, high, at_low, at_high = a, 0.0, 1.0, a.rest, b.rest
    for _ in range(ROOT_STEPS):
        slope = at_high - at_low
        t = 0.5 * (low + high) if slope == 0.0 else (low * at_high - high * at_low) / slope
        between = _down(search, a.q + t * (b.q - a.q), a)
        if between is None:
            return
        floor = between
        if abs(floor.rest) <= ROUNDING or high == low:
            break
        if floor.rest * at_high < 0.0:
            low, at_low = high, at_high
        else:
            at_low *= 0.5
        high, at_high = t, floor.rest
    if max(search.errors(floor.q)) <= tolerance:
        yield floor.q
