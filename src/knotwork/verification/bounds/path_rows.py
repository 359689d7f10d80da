"""Comparison of a motion with its path, at samples and between them: one row per criterion.

The velocity along the path is that of the tool times the tangent at the nearest point. In a ramp
every value from zero to the full speed is accepted.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from knotwork.tool_paths.tool_path import CORNER_ANGLE
from knotwork.verification.bounds.free_turn import continue_turns, excess_over_ranges, nearest_turns
from knotwork.verification.bounds.path_samples import PathSamples, PathSizes
from knotwork.waypoints import FloatArray, PoseFreedom

if TYPE_CHECKING:
    from knotwork.tool_paths import ToolPath


class PathRows(NamedTuple):
    """Errors of the tool on the path: distance, orientation, full speed, ramps, excess turn.

    Attributes:
        samples: Errors at each time, minus infinity where a row does not apply, shape (5, n + 1).
        ends: The worse end of each interval, zero where a row does not apply, shape (5, n).
        upper: Upper bound over each interval, shape (5, n).
        least: Lower bound of the velocity along the path, shape (n,).
        greatest: Upper bound of the speed, shape (n,).
        rows: Whether a row applies to each interval, shape (5, n).
        turned: Turn of the tool at the start and at the end of the stretch [rad].
    """

    samples: FloatArray
    ends: FloatArray
    upper: FloatArray
    least: FloatArray
    greatest: FloatArray
    rows: NDArray[np.bool_]
    turned: tuple[float, float]


def path_rows(
    path: ToolPath,
    samples: PathSamples,
    t: FloatArray,
    sizes: PathSizes,
    full: tuple[float, float],
    speed: float,
    freedom: PoseFreedom | None = None,
    turn: float = 0.0,
) -> PathRows:
    """Compare a motion with a stretch of a path at n + 1 times, and on the intervals between them.

    Args:
        path: The path.
        samples: Samples of the motion.
        t: Times of the samples [s], shape (n + 1,).
        sizes: Bounds on the intervals between them.
        full: Interval of full speed [s].
        speed: Full speed [m/s].
        freedom: Freedom of the poses.
        turn: Turn of the tool at the first time, approximately [rad].
    """
    square = np.diff(t) ** 2
    bend = path.bend(samples.s[:-1], samples.s[1:])
    turn_bend = path.turn_bend(samples.s[:-1], samples.s[1:])
    change = square * sizes.jerk / 8.0 + sizes.rounding
    size = np.linalg.norm(samples.velocity, axis=1)
    too_fast, floors = size - speed, np.array([[speed], [0.0]])
    speeds = np.maximum(too_fast, floors - samples.along)
    beyond, most_beyond, turned = _follow_turn(path, samples, t, sizes, freedom, turn)
    errors = np.vstack((samples.distance, samples.gap, speeds, beyond))
    ends = np.maximum(errors[:, :-1], errors[:, 1:])
    least = _least_velocity(samples, bend, change)
    greatest = np.maximum(size[:-1], size[1:]) + change
    upper = np.vstack(
        (
            ends[0] + (square * sizes.acceleration + bend) / 8.0 + sizes.rounding,
            ends[1] + (square * sizes.turn + turn_bend) / 8.0 + sizes.rounding,
            np.maximum(greatest - speed, floors - least),
            most_beyond,
        )
    )
    rows = np.ones(upper.shape, dtype=bool)
    rows[2] = (t[:-1] >= full[0]) & (t[1:] <= full[1])
    rows[3] = ~rows[2]
    rows[4] = np.isfinite(ends[4])
    ends[~rows] = upper[~rows] = 0.0
    known = np.pad(rows, ((0, 0), (0, 1))) | np.pad(rows, ((0, 0), (1, 0)))
    errors[~known] = -np.inf
    return PathRows(errors, ends, upper, least, greatest, rows, turned)


def _follow_turn(
    path: ToolPath,
    samples: PathSamples,
    t: FloatArray,
    sizes: PathSizes,
    freedom: PoseFreedom | None,
    start: float,
) -> tuple[FloatArray, FloatArray, tuple[float, float]]:
    """Follow the turn, and bound its excess and that of a torch's angles over their ranges [rad].

    The rate of the turn is bounded by the rotation of tool and path (`free_angles`). Within an
    interval the turn exceeds the mean of both ends by at most half of both rotations. It is
    unambiguous between samples if this is less than half a turn. The angles between axes have a
    separate row.

    Returns:
        Excess at times, shape (n + 1,), upper bounds on intervals, shape (n,), and the turn at both
        ends.
    """
    if freedom is None:
        nowhere = np.full(len(t), -np.inf)
        return nowhere, nowhere[1:], (0.0, 0.0)
    low, high = np.minimum(samples.s[:-1], samples.s[1:]), np.maximum(samples.s[:-1], samples.s[1:])
    turned = np.diff(t) * sizes.spin + (high - low) * path.orientation.rate_bounds(low, high)[0]
    if freedom.torch is None:
        apart = np.maximum(samples.gap[:-1], samples.gap[1:]) + turned * np.sqrt(2.0)
        slower = np.maximum(1.0 - apart**2 / 4.0, 1e-12)  # cos(φ), as apart is 2 √2 sin(φ/2)
    else:
        travel = np.abs(samples.angles[:, 1] + freedom.torch.own)
        steep = np.minimum(np.maximum(travel[:-1], travel[1:]) + turned, 0.5 * np.pi)
        slower = np.maximum(np.cos(steep), 1e-12)
    change = turned / slower
    angles, known = continue_turns(samples.angles, start), change < np.pi
    ends = float(angles[0, 0]), float(angles[-1, 0])
    if not known.all():  # then a sample is outside only if it is outside at every whole turn
        angles = nearest_turns(freedom, samples.angles)
    beyond = excess_over_ranges(freedom, angles)
    most = 0.5 * (beyond[:-1] + beyond[1:] + change) + sizes.rounding
    furthest = excess_over_ranges(freedom, np.array([[ends[0], 0.0, 0.0]]))[0] + change.sum()
    if freedom.turn[1] - freedom.turn[0] > 2.0 * np.pi:
        furthest = np.inf  # each single turn would be within
    return beyond, np.where(known, most, np.maximum(most, furthest)), ends


def _least_velocity(samples: PathSamples, bend: FloatArray, change: FloatArray) -> FloatArray:
    """Lower bound of the velocity along the path on each interval, shape (n,).

    The angle between the tangent and the bisector of the tangents at both ends is at most half of
    the turn of the tangent. The velocity is near its chord. So the components of both along and
    across the bisector are bounded.

    Args:
        samples: Samples at n + 1 times.
        bend: See `ToolPath.bend`, shape (n,).
        change: Upper bound on the deviation of the velocity from its chord [m/s], shape (n,).
    """
    step = np.abs(np.diff(samples.s))
    turn = 0.5 * np.divide(bend, step, out=np.zeros_like(bend), where=step > 0.0) + CORNER_ANGLE
    middle = samples.tangent[:-1] + samples.tangent[1:]
    middle /= np.maximum(np.linalg.norm(middle, axis=1, keepdims=True), 1e-300)
    ends = np.stack((samples.velocity[:-1], samples.velocity[1:]))
    along = (ends * middle).sum(axis=2)
    across = np.linalg.norm(ends - along[:, :, None] * middle, axis=2).max(axis=0) + change
    low = along.min(axis=0) - change
    bound = np.where(low > 0.0, low * np.cos(turn), low) - across * np.sin(turn)
    largest = np.linalg.norm(ends, axis=2).max(axis=0) + change
    return np.asarray(np.where(turn < 0.5 * np.pi, bound, -largest))
