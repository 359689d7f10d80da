"""Comparison of a motion with its path, at samples and between them, by each criterion.

The velocity along the path is the component of the tool's velocity along the tangent at the nearest
point. In a ramp every value from zero to the full speed is accepted.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from knotwork.arrays import BoolArray, FloatArray
from knotwork.curves.tool_paths.rotations import rotation_angle
from knotwork.curves.tool_paths.tool_path import CORNER_ANGLE
from knotwork.verification.bounds.free_turn import centre_turns, continue_turns, excess_over_ranges
from knotwork.verification.bounds.path_samples import PathSamples, ToolMotionBounds
from knotwork.waypoints import PoseFreedom

if TYPE_CHECKING:
    from knotwork.curves.tool_paths import ToolPath
    from knotwork.task.task_options import ToolTolerances


class RequiredSpeed(NamedTuple):
    """The required speed of a stretch.

    Attributes:
        full_speed: The speed [m/s].
        tolerance: Its tolerance [m/s].
        interval: Interval in which it is required [s]; outside, the speed changes.
    """

    full_speed: float
    tolerance: float
    interval: tuple[float, float]


class PathTolerances(NamedTuple):
    """Tolerances of a stretch, and its required speed.

    Attributes:
        position: Tolerance of the distance from the path [m].
        orientation: Tolerance of the angle from its orientation [rad].
        speed: The speed, or `None` if any speed is accepted.
    """

    position: float
    orientation: float
    speed: RequiredSpeed | None

    @classmethod
    def of(
        cls,
        tolerances: ToolTolerances,
        speed: float,
        interval: tuple[float, float],
        part: float = 1.0,
    ) -> PathTolerances:
        """A part of the tolerances of a task, for a speed [m/s] in an interval [s]."""
        required = RequiredSpeed(speed, part * tolerances.path_speed * speed, interval)
        return cls(part * tolerances.path, part * tolerances.path_orientation, required)


class PathBound(NamedTuple):
    """The worst error by one criterion along a stretch of a path.

    Attributes:
        limit: Limit of the error.
        value: The worst sample.
        time: Time of the worst sample [s].
        bound: Upper bound over the stretch.
        proved: Whether the bound keeps the limit, or a sample exceeds it.
        worst_interval: Interval in which the upper bound is largest [s].
    """

    limit: float
    value: float
    time: float
    bound: float
    proved: bool
    worst_interval: tuple[float, float]


class PathCriterion(NamedTuple):
    """The error of the tool on the path by one criterion.

    Attributes:
        limit: Limit of the error.
        samples: Error at each time, minus infinity where it is not judged, shape (n + 1,).
        ends: Error at the worse end of each interval, zero where it is not judged, shape (n,).
        upper: Upper bound over each interval, zero where it is not judged, shape (n,).
    """

    limit: float
    samples: FloatArray
    ends: FloatArray
    upper: FloatArray

    @property
    def is_exceeded(self) -> bool:
        """Whether a sample is beyond the limit."""
        return bool(self.ends.max() > self.limit)

    @property
    def utilisation(self) -> FloatArray:
        """Bound on each interval relative to the limit; if a sample is beyond it, the samples."""
        return (self.ends if self.is_exceeded else self.upper) / self.limit

    @property
    def parts(self) -> FloatArray:
        """Number of parts of each interval that would decide it; zero if it is decided."""
        if self.is_exceeded:
            return np.zeros_like(self.upper)
        remaining = np.maximum(self.limit - self.ends, 1e-3 * self.limit)
        parts = np.sqrt(np.maximum(self.upper - self.ends, 0.0) / remaining)
        return np.where(self.upper > self.limit, parts, 0.0)

    def worst(self, t: FloatArray) -> PathBound:
        """The worst error over the intervals between times [s], shape (n + 1,)."""
        i, j = int(self.samples.argmax()), int(self.upper.argmax())
        value, bound = float(self.samples[i]), float(self.upper[j])
        proved = bound <= self.limit or value > self.limit
        where = (float(t[j]), float(t[j + 1]))
        return PathBound(self.limit, value, float(t[i]), bound, proved, where)


class PathErrors(NamedTuple):
    """Errors of the tool on the path.

    Attributes:
        criteria: Errors by the criteria that are judged: `"path_deviation"` [m],
            `"path_orientation"` [rad], `"path_turn"` (excess of the free turn over its range)
            [rad], `"path_speed"` (difference from the full speed) and `"path_ramp"` (excess over
            the full speed where the speed changes, or backward speed) [m/s].
        slowest, fastest: Bounds on the velocity along the path and on the speed, where full speed
            is required [m/s]; infinite if no part requires it.
        turns: Turn of the tool at the start and at the end of the stretch, including whole turns
            [rad].
    """

    criteria: dict[str, PathCriterion]
    slowest: float
    fastest: float
    turns: tuple[float, float]


class TurnErrors(NamedTuple):
    """Excess of the free turn, and of a torch's angles, over their ranges [rad].

    Attributes:
        samples: Excess at each time, shape (n + 1,).
        upper: Upper bound over each interval, shape (n,).
        turns: Turn at the first and at the last time, including whole turns.
    """

    samples: FloatArray
    upper: FloatArray
    turns: tuple[float, float]


def bounded_path_errors(
    path: ToolPath,
    samples: PathSamples,
    t: FloatArray,
    bounds: ToolMotionBounds,
    tolerances: PathTolerances,
    freedom: PoseFreedom | None = None,
    start_turn: float = 0.0,
) -> PathErrors:
    """Compare a motion with a stretch of a path at n + 1 times, and on the intervals between them.

    Args:
        path: The path.
        samples: Samples of the motion.
        t: Times of the samples [s], shape (n + 1,).
        bounds: Bounds on the intervals between them.
        tolerances: Tolerances, and the required speed.
        freedom: Freedom of the poses.
        start_turn: Approximate turn of the tool at the first time [rad].
    """
    square = np.diff(t) ** 2
    bend = path.bend_bound(samples.s[:-1], samples.s[1:])
    rotation_bend = path.turn_bend_bound(samples.s[:-1], samples.s[1:])
    chord_error = (square * bounds.acceleration + bend) / 8.0 + bounds.rounding
    rotation_error = (square * bounds.rotation + rotation_bend) / 8.0 + bounds.rounding
    everywhere = np.ones(len(square), dtype=bool)
    upper = _worse_end(samples.distance) + chord_error
    angle_upper = rotation_angle(_worse_end(samples.rotation_difference) + rotation_error)
    angle_limit = tolerances.orientation + (0.0 if freedom is None else freedom.tilt)
    criteria = {
        "path_deviation": _criterion(tolerances.position, samples.distance, upper, everywhere),
        "path_orientation": _criterion(angle_limit, samples.angle, angle_upper, everywhere),
    }
    turns = (0.0, 0.0)
    if freedom is not None:
        excess, upper, turns = _follow_turn(path, samples, t, bounds, freedom, start_turn)
        limited = np.isfinite(_worse_end(excess))
        criteria["path_turn"] = _criterion(tolerances.orientation, excess, upper, limited)
    lowest, highest = np.inf, -np.inf
    if tolerances.speed is not None:
        full_speed, tolerance, (begin, end) = tolerances.speed
        speed = np.linalg.norm(samples.velocity, axis=1)
        velocity_error = square * bounds.jerk / 8.0 + bounds.rounding
        slowest = _least_velocity(samples, bend, velocity_error)
        fastest = _worse_end(speed) + velocity_error
        in_full = (t[:-1] >= begin) & (t[1:] <= end)
        for quantity, minimum, judged in (
            ("path_speed", full_speed, in_full),
            ("path_ramp", 0.0, ~in_full),
        ):
            errors = np.maximum(speed - full_speed, minimum - samples.along_speed)
            upper = np.maximum(fastest - full_speed, minimum - slowest)
            criteria[quantity] = _criterion(tolerance, errors, upper, judged)
        lowest = float(slowest[in_full].min(initial=np.inf))
        highest = float(fastest[in_full].max(initial=-np.inf))
    judged_criteria = {name: errors for name, errors in criteria.items() if errors is not None}
    return PathErrors(judged_criteria, lowest, highest, turns)


def _worse_end(errors: FloatArray) -> FloatArray:
    """The larger of the errors at both ends of each interval, shape (n,)."""
    return np.maximum(errors[:-1], errors[1:])


def _criterion(
    limit: float, errors: FloatArray, upper: FloatArray, judged: BoolArray
) -> PathCriterion | None:
    """Select the intervals in which an error is judged; `None` if it is judged in none."""
    if not judged.any():
        return None
    at_judged = np.append(judged, False) | np.append(False, judged)
    ends = np.where(judged, _worse_end(errors), 0.0)
    return PathCriterion(
        limit, np.where(at_judged, errors, -np.inf), ends, np.where(judged, upper, 0.0)
    )


def _follow_turn(
    path: ToolPath,
    samples: PathSamples,
    t: FloatArray,
    bounds: ToolMotionBounds,
    freedom: PoseFreedom,
    start_turn: float,
) -> TurnErrors:
    """Follow the turn, and bound its excess and that of a torch's angles over their ranges.

    The rate of the turn is bounded by the rotation of tool and path (`free_angles`). Within an
    interval the turn exceeds the mean of both ends by at most half of both rotations. It is
    unambiguous between samples if this is less than half a turn. The tilt is judged by the
    orientation.
    """
    low, high = np.minimum(samples.s[:-1], samples.s[1:]), np.maximum(samples.s[:-1], samples.s[1:])
    rotation = np.diff(t) * bounds.spin + (high - low) * path.orientation.rate_bounds(low, high)[0]
    if freedom.torch is None:
        difference = _worse_end(samples.rotation_difference) + rotation * np.sqrt(2.0)
        slower = np.maximum(
            1.0 - difference**2 / 4.0, 1e-12
        )  # cos(φ); the difference is 2 √2 sin(φ/2)
    else:
        travel = np.abs(samples.angles[:, 1] + freedom.torch.pose_travel)
        steep = np.minimum(_worse_end(travel) + rotation, 0.5 * np.pi)
        slower = np.maximum(np.cos(steep), 1e-12)
    change = rotation / slower
    angles, is_unambiguous = continue_turns(samples.angles, start_turn), change < np.pi
    turns = float(angles[0, 0]), float(angles[-1, 0])
    if not is_unambiguous.all():  # a sample is outside only if it is at every whole turn
        angles = centre_turns(freedom, samples.angles)
    excess = excess_over_ranges(freedom, angles)
    upper = 0.5 * (excess[:-1] + excess[1:] + change) + bounds.rounding
    furthest = excess_over_ranges(freedom, np.array([[turns[0], 0.0, 0.0]]))[0] + change.sum()
    if freedom.turn[1] - freedom.turn[0] > 2.0 * np.pi:
        furthest = np.inf  # every turn is within its range
    upper = np.where(is_unambiguous, upper, np.maximum(upper, furthest))
    return TurnErrors(excess, upper, turns)


def _least_velocity(samples: PathSamples, bend: FloatArray, error: FloatArray) -> FloatArray:
    """Lower bound of the velocity along the path on each interval, shape (n,).

    The angle between the tangent and the bisector of the tangents at both ends is at most half of
    the turn of the tangent. The velocity is near its chord. Thus the components of both along and
    across the bisector are bounded.

    Args:
        samples: Samples at n + 1 times.
        bend: See `ToolPath.bend_bound`, shape (n,).
        error: Upper bound on the deviation of the velocity from its chord [m/s], shape (n,).
    """
    step = np.abs(np.diff(samples.s))
    half = 0.5 * np.divide(bend, step, out=np.zeros_like(bend), where=step > 0.0) + CORNER_ANGLE
    middle = samples.tangent[:-1] + samples.tangent[1:]
    middle /= np.maximum(np.linalg.norm(middle, axis=1, keepdims=True), 1e-300)
    ends = np.stack((samples.velocity[:-1], samples.velocity[1:]))
    along = (ends * middle).sum(axis=2)
    across = np.linalg.norm(ends - along[:, :, None] * middle, axis=2).max(axis=0) + error
    low = along.min(axis=0) - error
    bound = np.where(low > 0.0, low * np.cos(half), low) - across * np.sin(half)
    largest = np.linalg.norm(ends, axis=2).max(axis=0) + error
    return np.asarray(np.where(half < 0.5 * np.pi, bound, -largest))
