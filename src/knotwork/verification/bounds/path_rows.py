"""A motion against its path, sample by sample and between them: one row for each thing judged.

The velocity along the path is that of the tool times the tangent at the nearest point. In a ramp it
may be anything from zero to the full speed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from knotwork.tool_paths.path import SHARP
from knotwork.verification.bounds.free_turn import beyond_ranges, followed_turns, nearest_turns
from knotwork.verification.bounds.path_samples import PathSamples, PathSizes
from knotwork.waypoints import FloatArray, PoseFreedom

if TYPE_CHECKING:
    from knotwork.tool_paths import ToolPath


class PathRows(NamedTuple):
    """The tool against the path: distance, orientation, full speed, ramps, turn beyond its range.

    Attributes:
        samples: At each time, minus infinity where a row does not apply, shape (5, n + 1).
        ends: The worse end of each interval, zero where a row does not apply, shape (5, n).
        upper: What no time in it exceeds, shape (5, n).
        least: Bound on the velocity along the path from below, shape (n,).
        greatest: Bound on the speed from above, shape (n,).
        rows: Where a row applies, shape (5, n).
        turned: Turn of the tool where the stretch begins and where it ends [rad].
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
    found: PathSamples,
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
        found: Samples of the motion.
        t: Their times [s], shape (n + 1,).
        sizes: Bounds on the intervals between them.
        full: From when to when the speed is asked for in full [s].
        speed: That speed [m/s].
        freedom: What the poses leave open.
        turn: Turn of the tool at the first time, or near it [rad].
    """
    square = np.diff(t) ** 2
    bend = path.bend(found.s[:-1], found.s[1:])
    turn_bend = path.turn_bend(found.s[:-1], found.s[1:])
    change = square * sizes.jerk / 8.0 + sizes.rounding
    size = np.linalg.norm(found.velocity, axis=1)
    too_fast, floors = size - speed, np.array([[speed], [0.0]])
    speeds = np.maximum(too_fast, floors - found.along)
    beyond, most_beyond, turned = _turns(path, found, t, sizes, freedom, turn)
    samples = np.vstack((found.distance, found.gap, speeds, beyond))
    ends = np.maximum(samples[:, :-1], samples[:, 1:])
    least = _least_along(found, bend, change)
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
    samples[~known] = -np.inf
    return PathRows(samples, ends, upper, least, greatest, rows, turned)


def _turns(
    path: ToolPath,
    found: PathSamples,
    t: FloatArray,
    sizes: PathSizes,
    freedom: PoseFreedom | None,
    start: float,
) -> tuple[FloatArray, FloatArray, tuple[float, float]]:
    """Follow the turn, and bound how far it and a torch's angles are beyond their ranges [rad].

    It changes no faster than tool and path turn, see `free_angles`: so no time is above the mean
    of both ends by more than half of what both turn, and from one time to the next it is known
    which turn goes on, where that is less than half a turn. Axes are compared in a row of their
    own.

    Returns:
        At times, shape (n + 1,), as bounds on intervals, shape (n,), and the turn at both ends.
    """
    if freedom is None:
        nowhere = np.full(len(t), -np.inf)
        return nowhere, nowhere[1:], (0.0, 0.0)
    low, high = np.minimum(found.s[:-1], found.s[1:]), np.maximum(found.s[:-1], found.s[1:])
    turned = np.diff(t) * sizes.spin + (high - low) * path.orientation.rate_bounds(low, high)[0]
    if freedom.torch is None:
        apart = np.maximum(found.gap[:-1], found.gap[1:]) + turned * np.sqrt(2.0)
        slower = np.maximum(1.0 - apart**2 / 4.0, 1e-12)  # cos(φ), as apart is 2 √2 sin(φ/2)
    else:
        travel = np.abs(found.angles[:, 1] + freedom.torch.own)
        steep = np.minimum(np.maximum(travel[:-1], travel[1:]) + turned, 0.5 * np.pi)
        slower = np.maximum(np.cos(steep), 1e-12)
    change = turned / slower
    angles, known = followed_turns(found.angles, start), change < np.pi
    ends = float(angles[0, 0]), float(angles[-1, 0])
    if not known.all():  # a sample is beyond, then, where no whole turn brings it back
        angles = nearest_turns(freedom, found.angles)
    beyond = beyond_ranges(freedom, angles)
    most = 0.5 * (beyond[:-1] + beyond[1:] + change) + sizes.rounding
    furthest = beyond_ranges(freedom, np.array([[ends[0], 0.0, 0.0]]))[0] + change.sum()
    if freedom.turn[1] - freedom.turn[0] > 2.0 * np.pi:
        furthest = np.inf  # any turn by itself would be within
    return beyond, np.where(known, most, np.maximum(most, furthest)), ends


def _least_along(found: PathSamples, bend: FloatArray, change: FloatArray) -> FloatArray:
    """Bound the velocity along the path from below on each interval, shape (n,).

    The tangent stays within half of its turn of the direction that halves those at both ends, and
    the velocity near its chord: so their parts along and across that direction are known.

    Args:
        found: Samples at n + 1 times.
        bend: See `ToolPath.bend`, shape (n,).
        change: How far the velocity may be off its chord [m/s], shape (n,).
    """
    step = np.abs(np.diff(found.s))
    turn = 0.5 * np.divide(bend, step, out=np.zeros_like(bend), where=step > 0.0) + SHARP
    middle = found.tangent[:-1] + found.tangent[1:]
    middle /= np.maximum(np.linalg.norm(middle, axis=1, keepdims=True), 1e-300)
    ends = np.stack((found.velocity[:-1], found.velocity[1:]))
    along = (ends * middle).sum(axis=2)
    across = np.linalg.norm(ends - along[:, :, None] * middle, axis=2).max(axis=0) + change
    low = along.min(axis=0) - change
    bound = np.where(low > 0.0, low * np.cos(turn), low) - across * np.sin(turn)
    largest = np.linalg.norm(ends, axis=2).max(axis=0) + change
    return np.asarray(np.where(turn < 0.5 * np.pi, bound, -largest))
