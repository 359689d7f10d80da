"""`ToolPath`: consecutive curves, and the tool's orientation along them."""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Iterator, Sequence
from typing import Literal

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from knotwork.arrays import FloatArray, IndexArray
from knotwork.curves.polynomial.distinct import sort_distinct
from knotwork.curves.tool_paths.curve import (
    Curve,
    checked_curve_order,
    geometry_error,
    point_text,
    sort_ends,
)
from knotwork.curves.tool_paths.orientation import OrientationCurve
from knotwork.errors import CornerError, PathError

JUNCTION_GAP = 1e-9
"""Tolerance of gaps between consecutive curves [m]."""

CORNER_ANGLE = 1e-6
"""Tolerance of the change of direction there [rad]."""

LENGTH_MISMATCH = 1e-9
"""Relative tolerance of the lengths of curves and orientation."""


class ToolPath:
    """A path of the tool: position and rotation as functions of arc length.

    The curvature may jump between curves. The direction, or the rate of rotation, may jump only
    where the tool stops.

    Args:
        curves: Consecutive curves; each begins at the end of the previous one, in its direction.
        orientation: Rotation of the tool along all curves, of the same total length.
        stops: Indices of the curves that end at a stop.

    Attributes:
        curves, orientation, stops: The arguments.
        length: Length of the path [m].
        starts: Arc lengths at which the curves begin [m], shape (n,).
        breaks: Arc lengths at which a curve or a part of the orientation begins, and both ends of
            the path [m]. Between them second derivatives are continuous; third derivatives jump
            within curves through points or rotations.

    Raises:
        CornerError: The direction jumps without a stop.
        PathError: There is no curve or a gap between two, the orientation has another length, or
            its rate jumps without a stop.

    >>> line = kw.tool_paths.Line([0, 0, 0], [0.3, 0, 0])
    >>> still = kw.tool_paths.OrientationCurve.constant(np.eye(3), line.length)
    >>> path = kw.tool_paths.ToolPath([line], still)
    >>> path.pose(0.1).translation
    array([0.1, 0. , 0. ])
    """

    def __init__(
        self,
        curves: Sequence[Curve],
        orientation: OrientationCurve,
        stops: Collection[int] = (),
    ) -> None:
        if not curves:
            raise PathError("no curves are given; a path needs at least one")
        self.curves, self.orientation = tuple(curves), orientation
        self.stops = frozenset(stops)
        ends = np.cumsum([curve.length for curve in curves])
        self.length = float(ends[-1])
        self.starts: FloatArray = np.concatenate(([0.0], ends[:-1]))
        self._check_junctions()
        off = orientation.length - self.length
        if abs(off) > LENGTH_MISMATCH * self.length:
            raise PathError(
                f"the orientation is {orientation.length:.12g} m long and the path "
                f"{self.length:.12g} m; both must be the same"
            )
        stops_at = self.starts[[i + 1 for i in sorted(self.stops) if i + 1 < len(self.curves)]]
        self._stops_at: FloatArray = stops_at
        for s in orientation.jumps:
            if not (np.abs(stops_at - s) <= LENGTH_MISMATCH * self.length).any():
                raise geometry_error(
                    "the rate at which the tool turns jumps at arc length {s}, where it does not "
                    "stop; join the stretches with OrientationCurve.joined, or stop there",
                    s=float(s),
                )
        self.breaks = self._merge_breaks(
            np.concatenate((self.starts, ends[-1:], orientation.breaks))
        )

    def _check_junctions(self) -> None:
        for i, (before, after) in enumerate(itertools.pairwise(self.curves)):
            at_end, at_start = np.array([before.length]), np.zeros(1)
            end, start = before.position(at_end)[0], after.position(at_start)[0]
            gap = float(np.linalg.norm(start - end))
            if gap > JUNCTION_GAP:
                raise geometry_error(
                    f"curve {i + 1} ends at {{end}} and curve {i + 2} starts {{gap}} away, at "
                    "{start}; each must start where the one before ends",
                    end=end,
                    gap=gap,
                    start=start,
                )
            u, v = before.position(at_end, 1)[0], after.position(at_start, 1)[0]
            angle = math.atan2(float(np.linalg.norm(np.cross(u, v))), float(u @ v))
            if angle > CORNER_ANGLE and i not in self.stops:
                raise CornerError(
                    f"the path turns sharply by {math.degrees(angle):.6g} deg at "
                    f"{point_text(end)}, between curves {i + 1} and {i + 2}; round the corner with "
                    "a blend or stop there",
                    junction=i,
                    angle=angle,
                    point=end.tolist(),
                )

    def _merge_breaks(self, s: FloatArray) -> FloatArray:
        """Sort arc lengths, and drop those within rounding of a curve's ends."""
        exact = np.append(self.starts, self.length)
        nearest = exact[np.abs(s[:, None] - exact).argmin(axis=1)]
        return sort_distinct(
            np.where(np.abs(s - nearest) <= LENGTH_MISMATCH * self.length, nearest, s)
        )

    def _curve_of(self, s: FloatArray, side: Literal["left", "right"] = "right") -> IndexArray:
        index = np.searchsorted(self.starts, s, side) - 1
        return np.clip(index, 0, len(self.curves) - 1)

    def _by_curve(self, index: IndexArray) -> Iterator[tuple[int, slice | IndexArray]]:
        """Give each curve that occurs, with its rows."""
        if index.size and (index == index[0]).all():
            yield int(index[0]), slice(None)
            return
        for i in np.flatnonzero(np.bincount(index)):
            yield int(i), np.flatnonzero(index == i)

    def position(self, s: ArrayLike, order: int = 0) -> FloatArray:
        """Points of the path, or their derivatives with respect to arc length.

        Args:
            s: Arc lengths [m], shape (k,).
            order: Order of the derivative, 0 to 3.

        Returns:
            Points [m], or derivatives [m^(1 - order)], shape (k, 3).
        """
        return np.asarray(self.derivatives(s, checked_curve_order(order))[order])

    def derivatives(self, s: ArrayLike, order: int, at: ArrayLike | None = None) -> FloatArray:
        """Points of the path and their derivatives up to an order, shape (order + 1, k, 3).

        Args:
            s: Arc lengths [m], shape (k,).
            order: Order of the highest derivative, 0 to 3.
            at: Arc lengths that choose the curves, by default s [m], shape (k,): a curve is
                extended smoothly beyond its ends.
        """
        s = np.asarray(s, dtype=float)
        at = s if at is None else np.broadcast_to(np.asarray(at, dtype=float), s.shape)
        result = np.empty((order + 1, s.size, 3))
        for i, rows in self._by_curve(self._curve_of(at)):
            result[:, rows] = self.curves[i].derivatives(s[rows] - self.starts[i], order)
        return result

    def rotation(self, s: ArrayLike) -> FloatArray:
        """Rotation matrices of the tool at arc lengths (k,) [m], shape (k, 3, 3)."""
        return self.orientation.rotation(s)

    def pose(self, s: float) -> pin.SE3:
        """Pose of the tool at an arc length [m]."""
        return pin.SE3(self.rotation([s])[0], self.position([s])[0])

    def nearest(self, points: ArrayLike, guess: ArrayLike) -> FloatArray:
        """Arc lengths of the nearest points of the path, near a guess.

        From the end of a curve the search continues in the next one, as long as the distance
        decreases.

        Args:
            points: Points in space [m], shape (k, 3).
            guess: Arc lengths to start from [m], shape (k,).

        Returns:
            Arc lengths in [0, length] [m], shape (k,).
        """
        points = np.asarray(points, dtype=float)
        best: FloatArray = np.clip(np.asarray(guess, dtype=float), 0.0, self.length)
        curve = self._curve_of(best)
        distance = np.full(best.size, np.inf)
        going, direction = np.arange(best.size), np.zeros(best.size, dtype=np.intp)
        while going.size:
            s = np.empty(going.size)
            end = np.zeros(going.size, dtype=np.intp)
            off = np.empty(going.size)
            for i, rows in self._by_curve(curve[going]):
                chosen = going[rows]
                local = self.curves[i].nearest(points[chosen], best[chosen] - self.starts[i])
                reached = self.curves[i].position(local)
                off[rows] = np.linalg.norm(reached - points[chosen], axis=1)
                s[rows] = self.starts[i] + local
                end[rows] = (local >= self.curves[i].length).astype(int) - (local <= 0.0)
            nearer = off < distance[going]
            best[going[nearer]], distance[going[nearer]] = s[nearer], off[nearer]
            # Continue with the neighbour on the side of the nearest point, never back.
            following = curve[going] + end
            on = nearer & (end != 0) & (end * direction[going] >= 0)
            on &= (following >= 0) & (following < len(self.curves))
            going, end, following = going[on], end[on], following[on]
            curve[going], direction[going] = following, end
        return best

    def deviations(
        self, positions: FloatArray, rotations: FloatArray, s: FloatArray, *, axis: bool = False
    ) -> tuple[FloatArray, FloatArray]:
        """Deviations of poses from those of the path.

        Args:
            positions: Positions [m], shape (k, 3).
            rotations: Rotations, shape (k, 3, 3).
            s: Arc lengths of the poses of the path [m], shape (k,).
            axis: Whether only the z axes of the rotations count.

        Returns:
            Distances [m] and Frobenius norms of the difference of the rotations, see
            `rotations.rotation_angle`; shape (k,) each.
        """
        distance = np.linalg.norm(positions - self.position(s), axis=1)
        difference = rotations - self.rotation(s)
        if axis:  # a unit vector turned by φ moves by 2 sin(φ/2), and a rotation by √8 sin(φ/2)
            return distance, math.sqrt(2.0) * np.linalg.norm(difference[:, :, 2], axis=1)
        return distance, np.linalg.norm(difference, axis=(1, 2))

    def bend_bound(self, s0: ArrayLike, s1: ArrayLike) -> FloatArray:
        """Upper bounds of the norm of d²P/dτ², with arc length linear in τ from s0 at 0 to s1 at 1.

        At a junction the curvature jumps. The bound uses the larger curvature, and the deviation
        from the chord is still at most an eighth of the bound. Across a stop the bound is infinite.

        Args:
            s0: Arc lengths at the start, in [0, length] [m], shape (k,).
            s1: Arc lengths at the end, above or below s0 [m], shape (k,).

        Returns:
            (s1 - s0)² times the largest curvature [m], shape (k,).
        """
        low, high = sort_ends(s0, s1)
        first, last = self._curve_of(low), self._curve_of(high, "left")
        curvature = np.zeros(low.size)
        for i in range(int(last.max(initial=0) - first.min(initial=0)) + 1):
            for j, rows in self._by_curve(np.minimum(first + i, np.maximum(last, first))):
                curve, start = self.curves[j], self.starts[j]
                bound = curve.curvature_bound(
                    np.clip(low[rows] - start, 0.0, curve.length),
                    np.clip(high[rows] - start, 0.0, curve.length),
                )
                curvature[rows] = np.maximum(curvature[rows], bound)
            if (first + i >= last).all():
                break
        return self._but_across_stops(low, high, (high - low) ** 2 * curvature)

    def turn_bend_bound(self, s0: ArrayLike, s1: ArrayLike) -> FloatArray:
        """Upper bounds of the Frobenius norm of d²R/dτ² for the same motion as in `bend_bound`.

        With the rate w and its derivative, R'' = ([w'] + [w]²) R, where [w] is the matrix of the
        cross product. Its norm is at most √2 (‖w'‖ + ‖w‖²). Across a stop the bound is infinite.

        Args:
            s0: Arc lengths at the start, in [0, length] [m], shape (k,).
            s1: Arc lengths at the end, above or below s0 [m], shape (k,).
        """
        low, high = sort_ends(s0, s1)
        rate, change = self.orientation.rate_bounds(low, high)
        bound = math.sqrt(2.0) * (high - low) ** 2 * (change + rate**2)
        return self._but_across_stops(low, high, bound)

    def _but_across_stops(self, low: FloatArray, high: FloatArray, bound: FloatArray) -> FloatArray:
        """The bound, infinite for intervals that contain a stop."""
        after = np.searchsorted(self._stops_at, low, "right")
        crossing = after < np.searchsorted(self._stops_at, high, "left")
        return np.asarray(np.where(crossing, np.inf, bound))
