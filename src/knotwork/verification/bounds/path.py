"""Proved bounds on how far the tool is off a path, in place, orientation and speed.

At each sample the nearest point of the path is found. Between two samples the tool is compared with
a point that goes along the path from the one to the other. The difference g(t) of both is within
h²/8 · max |g''| of its chord, and |g''| is at most the tool's acceleration, which the chain of
joints bounds, and that of the point, which the curvature of the path bounds. Orientations are
compared as matrices: two that are an angle φ apart differ by √8 sin(φ/2) in the Frobenius norm.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from knotwork.distinct import distinct
from knotwork.polynomial import PiecewisePolynomial
from knotwork.robot import Robot
from knotwork.tool_paths.rotations import angle_of, gap_of
from knotwork.verification.bounds.adaptive import ROUNDING
from knotwork.verification.bounds.chain import carried, tree, tree_motion
from knotwork.verification.bounds.polynomials import Intervals, joint_rates
from knotwork.waypoints import FloatArray

if TYPE_CHECKING:
    from knotwork.tool_paths import TimedPath, ToolPath

BUDGET = 100_000
"""Samples of one stretch. A verdict that is still open then is not proved."""

BUDGET_PER_PIECE = 20
"""Samples for each piece of the motion, if these are more."""

FIRST = 64
"""Intervals that a stretch is first divided into, at least."""

PRECISION = 0.05
"""How near a bound comes to the largest sample, as a part of the tolerance."""

MOST_PARTS = 16
ROUNDS = 12


class PathLimits(NamedTuple):
    """What a stretch allows: distance [m], angle [rad], and difference of speed [m/s]."""

    position: float
    orientation: float
    speed: float


class PathBound(NamedTuple):
    """The worst of one quantity along a stretch of a path.

    Attributes:
        value: The worst sample.
        time: When [s].
        bound: What it is not above at any time.
        proved: Whether the bound keeps the limit, or a sample breaks it.
    """

    value: float
    time: float
    bound: float
    proved: bool


class StretchBounds(NamedTuple):
    """Bounds on a stretch of a path.

    Attributes:
        position: Distance from the path [m].
        orientation: Angle from the orientation on it [rad].
        speed: Difference from the speed asked for [m/s], where it is asked for in full; `None` if
            it is nowhere.
        slowest, fastest: Proved bounds on the speed there [m/s].
        times: Ends of the n intervals into which the stretch was divided [s], shape (n + 1,).
        use: The part of the limits that each interval is proved to use at most, shape (n,). Where a
            sample breaks a limit, that of the samples counts, as there no bound is sought.
    """

    position: PathBound
    orientation: PathBound
    speed: PathBound | None
    slowest: float
    fastest: float
    times: FloatArray
    use: FloatArray


class _Samples(NamedTuple):
    """The tool at k times, and the nearest points of the path."""

    s: FloatArray
    distance: FloatArray
    gap: FloatArray
    velocity: FloatArray

    def with_more(self, more: _Samples, known: NDArray[np.bool_]) -> _Samples:
        """These where they are known, and more between them."""
        columns = []
        for old, new in zip(self, more, strict=True):
            merged = np.empty((len(known), *old.shape[1:]))
            merged[known], merged[~known] = old, new
            columns.append(merged)
        return _Samples(*columns)


class _Stretch:
    """One stretch of a path, and the motion that is to follow it."""

    def __init__(
        self, robot: Robot, curve: PiecewisePolynomial, motion: TimedPath, start: float, end: float
    ) -> None:
        self.robot, self.curve, self.motion = robot, curve, motion
        self.frame = robot.require_tool()
        self.joints, self.data = tree(robot.model), robot.model.createData()
        self.joint, self.lever = carried(robot.model, self.frame)
        ends = motion.arc_length(np.array([start, end]))
        self.low, self.high = float(ends[0]), float(ends[1])

    def sample(self, t: FloatArray) -> _Samples:
        model, data, frame = self.robot.model, self.data, self.frame
        q, v = self.curve(t), self.curve(t, 1)
        position, rotation = np.empty((len(t), 3)), np.empty((len(t), 3, 3))
        velocity = np.empty((len(t), 3))
        for i in range(len(t)):
            pin.forwardKinematics(model, data, q[i], v[i])
            placed = pin.updateFramePlacement(model, data, frame)
            position[i], rotation[i] = placed.translation, placed.rotation
            velocity[i] = pin.getFrameVelocity(model, data, frame, pin.LOCAL_WORLD_ALIGNED).linear
        base = self.robot.base_placement.inverse()
        position = position @ base.rotation.T + base.translation
        rotation, velocity = base.rotation @ rotation, velocity @ base.rotation.T
        path = self.motion.path
        inside = np.clip(t, self.motion.start_time, self.motion.end_time)
        guess, within = self.motion.arc_length(inside), (self.low, self.high)
        return _Samples(*path.gaps(position, rotation, guess, within), velocity)

    def sizes(self, t: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Bounds between times: tool acceleration, jerk, |R''|, and the rounding of a position."""
        middle = 0.5 * (t[1:] + t[:-1])
        piece = np.clip(np.searchsorted(self.curve.x, middle) - 1, 0, len(self.curve.x) - 2)
        start = np.maximum(t[:-1] - self.curve.x[piece], 0.0)
        rates = joint_rates(self.curve, Intervals(piece, start, np.diff(t)))
        moved = tree_motion(self.joints, rates.bounds)
        point, turn = moved.point(self.joint, self.lever), moved.rotation(self.joint)[1]
        turned = 1.0 + rates.size[self.joints.angles].sum(axis=0)
        return point[2], point[3], turn, ROUNDING * turned * (point[0] + point[1] + 1.0)


def path_bounds(
    robot: Robot,
    curve: PiecewisePolynomial,
    motion: TimedPath,
    interval: tuple[float, float],
    full_speed: tuple[float, float],
    speed: float,
    limits: PathLimits,
    budget: int = BUDGET,
) -> StretchBounds:
    """Bound how far the tool is off a stretch of a path, over all its time.

    Args:
        robot: The arm.
        curve: Joint positions, trailing shape (d,).
        motion: The path and its timing.
        interval: From when to when the tool is on the stretch [s].
        full_speed: From when to when the speed is asked for [s].
        speed: That speed [m/s].
        limits: Verdicts are decided against these.
        budget: How many samples may be taken.
    """
    stretch = _Stretch(robot, curve, motion, *interval)
    t = _first_times(curve, interval, full_speed)
    if budget >= BUDGET:
        inside = (curve.x > interval[0]) & (curve.x < interval[1])
        budget = max(budget, BUDGET_PER_PIECE * int(inside.sum()))
    most = np.array([limits.position, gap_of(limits.orientation), limits.speed])
    # the bounds alone tell how fine the samples must be, before any is taken
    sizes = stretch.sizes(t)
    for _ in range(4):
        rough = np.diff(t) ** 2 / 8.0 * np.array([sizes[0], sizes[2], sizes[1]])
        needed = np.sqrt((rough / (PRECISION * most[:, None])).max(axis=0))
        finer = _divided(t, np.clip(np.ceil(needed), 1, MOST_PARTS), needed, budget // 4)
        if len(finer) == len(t):
            break
        t, sizes = finer, stretch.sizes(finer)
    found = stretch.sample(t)
    for left in range(ROUNDS, -1, -1):
        values, excess = _compared(stretch.motion.path, found, t, sizes, full_speed, speed)
        upper = values + excess
        is_open = (upper > most[:, None]) & ~(values.max(axis=1) > most)[:, None]
        if not left or not is_open.any():
            break
        gap = np.maximum(most[:, None] - values, 1e-3 * most[:, None])
        needed = np.where(is_open, np.sqrt(excess / gap), 0.0).max(axis=0)
        parts = np.where(is_open.any(axis=0), np.clip(np.ceil(needed), 2, MOST_PARTS), 1)
        finer = _divided(t, parts, needed, budget)
        if len(finer) == len(t):
            break
        known = np.isin(finer, t)
        t, found = finer, found.with_more(stretch.sample(finer[~known]), known)
        sizes = stretch.sizes(t)
    return _summed(t, found, values, upper, most, full_speed, speed)


def _first_times(
    curve: PiecewisePolynomial, interval: tuple[float, float], full: tuple[float, float]
) -> FloatArray:
    low, high = max(interval[0], float(curve.x[0])), min(interval[1], float(curve.x[-1]))
    inner = curve.x[(curve.x > low) & (curve.x < high)]
    known = [t for t in full if low < t < high]
    # at a break both sides count: velocities may jump where a scenario asks for no more
    before = np.nextafter(inner, -np.inf)
    ends = np.concatenate(([low], inner, [high]))
    middle = 0.5 * (ends[1:] + ends[:-1])  # no piece is looked at at its ends alone
    grid = np.linspace(low, high, FIRST + 1)
    return distinct(grid, inner, before, middle, known)


def _divided(t: FloatArray, parts: FloatArray, needed: FloatArray, budget: int) -> FloatArray:
    """Divide intervals into parts; where the budget does not do, those that need it most."""
    count = parts.astype(np.intp)
    if count.sum() > budget:
        order = np.argsort(-needed, kind="stable")
        allowed = np.cumsum(count[order] - 1) <= budget - len(count)
        count[order[~allowed]] = 1
    index = np.repeat(np.arange(len(count)), count)
    step = np.arange(len(index)) - np.repeat(np.cumsum(count) - count, count)
    inner = t[index] + (t[index + 1] - t[index]) * (step / count[index])
    return np.append(inner, t[-1])


def _compared(
    path: ToolPath,
    found: _Samples,
    t: FloatArray,
    sizes: tuple[FloatArray, FloatArray, FloatArray, FloatArray],
    full: tuple[float, float],
    speed: float,
) -> tuple[FloatArray, FloatArray]:
    """Worst end of each interval, and how much worse it may be between; shape (3, n) both."""
    length = np.diff(t)
    acceleration, jerk, turn, rounding = sizes
    bend = path.bend(found.s[:-1], found.s[1:])
    turn_bend = path.turn_bend(found.s[:-1], found.s[1:])
    excess = np.stack(
        (
            (length**2 * acceleration + bend) / 8.0 + rounding,
            (length**2 * turn + turn_bend) / 8.0 + rounding,
            length**2 * jerk / 8.0 + rounding,
        )
    )
    values = np.stack(
        (
            np.maximum(found.distance[:-1], found.distance[1:]),
            np.maximum(found.gap[:-1], found.gap[1:]),
            np.maximum(*_speed_ends(found, speed)),
        )
    )
    outside = (t[:-1] < full[0]) | (t[1:] > full[1])
    values[2, outside] = excess[2, outside] = 0.0
    return values, excess


def _speed_ends(found: _Samples, speed: float) -> tuple[FloatArray, FloatArray]:
    """How much too fast, and too slow, the ends of each interval are.

    Between them the speed is at least that along one direction, which is that of their sum.
    """
    v = found.velocity
    size = np.linalg.norm(v, axis=1)
    both = v[1:] + v[:-1]
    along = both / np.maximum(np.linalg.norm(both, axis=1, keepdims=True), 1e-300)
    slow = np.minimum((v[:-1] * along).sum(axis=1), (v[1:] * along).sum(axis=1))
    return np.maximum(size[:-1], size[1:]) - speed, speed - slow


def _summed(
    t: FloatArray,
    found: _Samples,
    values: FloatArray,
    upper: FloatArray,
    most: FloatArray,
    full: tuple[float, float],
    speed: float,
) -> StretchBounds:
    inside = (t >= full[0]) & (t <= full[1])
    fast, slow = _speed_ends(found, speed)
    off = np.where(inside, np.abs(np.linalg.norm(found.velocity, axis=1) - speed), -np.inf)
    worst: list[PathBound] = []
    for row, samples in enumerate((found.distance, found.gap, off)):
        i = int(samples.argmax())
        bound = float(upper[row].max())
        proved = bool(bound <= most[row] or samples[i] > most[row])
        value = float(samples[i])
        if row == 1:
            value, bound = float(angle_of(value)), float(angle_of(bound))
        worst.append(PathBound(value, float(t[i]), bound, proved))
    asked: NDArray[np.bool_] = (t[:-1] >= full[0]) & (t[1:] <= full[1])
    broken = (values.max(axis=1) > most)[:, None]
    use = (np.where(broken, values, upper) / most[:, None]).max(axis=0)
    if not asked.any():
        return StretchBounds(worst[0], worst[1], None, np.nan, np.nan, t, use)
    excess = upper[2] - values[2]
    fastest = float((speed + fast + excess)[asked].max())
    slowest = float((speed - slow - excess)[asked].min())
    return StretchBounds(worst[0], worst[1], worst[2], slowest, fastest, t, use)


def path_rounding(robot: Robot, curve: PiecewisePolynomial, motion: TimedPath) -> float:
    """What rounding adds to bounds on a path: no limit below it can be proved [m, m/s].

    Args:
        robot: The arm.
        curve: Joint positions along the whole path, trailing shape (d,).
        motion: The path and its timing.
    """
    stretch = _Stretch(robot, curve, motion, motion.start_time, motion.end_time)
    return float(stretch.sizes(curve.x)[3].max())
