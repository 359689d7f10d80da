"""`OrientationCurve`: orientation of the tool along a path, twice continuously differentiable.

Between two breaks the rotation is a cumulative quintic Bézier curve (Kim, Kim and Shin, "A general
construction scheme for unit quaternion curves with simple high order derivatives", 1995):

    R(u) = R0 exp(v1 f1) exp(v2 f2) exp(v3 f3) exp(v4 f4) exp(v5 f5),    0 <= u <= 1

where fi is the sum of the quintic Bernstein polynomials i to 5. This is a chain of five joints
about the axes vi. At u = 0 only f1 has a first derivative (5), and f1, f2 second ones (-20, 20):
with a, α the rotation per unit of u and its derivative in the axes of R0, v1 = a/5 and v2 = a/5 +
α/20. At u = 1, v5 = b/5 and v4 = b/5 - exp(v5) β/20, with b and β in the axes of R1. v3 is the
remaining rotation. As f1 + … + f5 = 5 u, the rotation is uniform if all axes are the same.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import ArrayLike

from knotwork.arrays import FloatArray, IndexArray, checked_array
from knotwork.curves.tool_paths.bernstein import TurnBounds, bernstein_sums, bernstein_values
from knotwork.curves.tool_paths.curve import (
    checked_curve_order,
    geometry_error,
    sort_ends,
    to_unit_vector,
)
from knotwork.curves.tool_paths.rotations import (
    checked_rotations,
    multiply,
    rotation_matrices,
    rotation_vector,
)
from knotwork.curves.tool_paths.stretch_joining import RATE_TOLERANCE, join_arrays
from knotwork.errors import PathError

HALF_TURN = math.pi - 1e-6
"""Maximum rotation between neighbours [rad]. Beyond it the direction is ambiguous."""

MAX_PART_ANGLE = 0.5 * math.pi
"""Maximum angle of the parts into which rotations about one axis are divided [rad]."""

UNIFORM_TOLERANCE = 1e-14
"""Difference [rad] below which the rotation vectors of a piece give a uniform rotation."""


class OrientationCurve:
    """Rotation of the tool as a function of arc length.

    Other constructors are `constant`, `even_turning`, `turning`, `through` and `joined`.

    Args:
        s: Arc lengths at which rotations are given [m], shape (m,), m >= 2, increasing from 0.
        rotations: Rotation matrices of the tool in base axes, shape (m, 3, 3).
        rates: Angular velocity per unit length in base axes at s [rad/m], shape (m, 3); or
            (m, 2, 3), before and after, where it jumps (at stops of the tool only).
        changes: Derivatives of the rates with respect to arc length [rad/m²], of the same shapes;
            by default zero.
        breaks: Arc lengths of the ends of stretches [m], shape (b,); by default all of s.

    Attributes:
        s, rotations, breaks: The arguments.
        rates, changes: Rates and their derivatives before and after s, shape (m, 2, 3).
        length: The last arc length [m].

    Raises:
        ArrayError: Arrays are not finite or have a wrong shape.
        PathError: Arc lengths do not increase from 0, a matrix is not a rotation, or neighbours are
            half a turn apart.
    """

    def __init__(
        self,
        s: ArrayLike,
        rotations: ArrayLike,
        rates: ArrayLike,
        changes: ArrayLike | None = None,
        breaks: ArrayLike | None = None,
    ) -> None:
        count = len(np.atleast_1d(np.asarray(s)))
        self.s = checked_array(s, (count,), "s")
        if count < 2 or self.s[0] != 0.0 or not (np.diff(self.s) > 0.0).all():
            raise PathError(
                f"the orientation's arc lengths are {self.s.tolist()} m; "
                "two or more are needed, increasing from 0"
            )
        self.length = float(self.s[-1])
        self.rotations = checked_rotations(rotations, (count, 3, 3), "rotations")
        self.rates = repeat_two_sided(rates, count, "rates")
        changes = 0.0 * self.rates if changes is None else changes
        self.changes = repeat_two_sided(changes, count, "changes")
        self.breaks: FloatArray = np.array(self.s if breaks is None else breaks)
        self._steps: FloatArray = np.diff(self.s)
        # Index of the piece that begins at each break.
        self._firsts = np.abs(self.breaks[:, None] - self.s).argmin(axis=1)
        # Vectors v of each piece, shape (m - 1, 5, 3).
        self._v = self._vectors()
        self._bounds = TurnBounds(self._v)
        # The evaluation of constant orientation, or uniform rotation in every piece, is faster.
        spread = np.abs(np.diff(self._v, axis=1)).max()
        self._even = bool(spread <= UNIFORM_TOLERANCE)
        self._still = self._even and not self._v.any()

    def _vectors(self) -> FloatArray:
        """Rotation vectors v1 to v5 of each piece, shape (m - 1, 5, 3)."""
        h = self._steps[:, None]
        to_start, to_end = (R.transpose(0, 2, 1) for R in (self.rotations[:-1], self.rotations[1:]))
        turns = to_start @ self.rotations[1:]
        a = h * multiply(to_start, self.rates[:-1, 1])
        b = h * multiply(to_end, self.rates[1:, 0])
        alpha = h**2 * multiply(to_start, self.changes[:-1, 1])
        beta = h**2 * multiply(to_end, self.changes[1:, 0])
        v = np.zeros((len(h), 5, 3))
        v[:, 0] = a / 5.0
        v[:, 1] = a / 5.0 + alpha / 20.0
        v[:, 4] = b / 5.0
        v[:, 3] = v[:, 4] - multiply(rotation_matrices(v[:, 4]), beta) / 20.0
        exp = rotation_matrices(v.reshape(-1, 3)).reshape(-1, 5, 3, 3)
        middle = (exp[:, 0] @ exp[:, 1]).transpose(0, 2, 1) @ turns
        middle = middle @ (exp[:, 3] @ exp[:, 4]).transpose(0, 2, 1)
        v[:, 2] = [rotation_vector(R) for R in middle]
        angle = np.linalg.norm([rotation_vector(R) for R in turns], axis=1)
        far = np.maximum(angle, np.linalg.norm(v[:, 2], axis=1)) > HALF_TURN
        if far.any():
            i = int(far.argmax())
            raise geometry_error(
                f"the tool turns by {math.degrees(angle[i]):.6g} deg between arc lengths {{start}} "
                "and {end}; it must be less than 180 deg from one given rotation to the next: give "
                "one between",
                start=float(self.s[i]),
                end=float(self.s[i + 1]),
            )
        return v

    @classmethod
    def constant(cls, rotation: ArrayLike, length: float) -> OrientationCurve:
        """A constant orientation on a stretch of a length [m]."""
        R = checked_rotations(rotation, (3, 3), "rotation")
        return cls([0.0, length], np.array([R, R]), np.zeros((2, 3)))

    @classmethod
    def even_turning(cls, start: ArrayLike, end: ArrayLike, length: float) -> OrientationCurve:
        """The shortest uniform rotation along a stretch (slerp); a PathError if it is half a turn.

        >>> half = kw.tool_paths.OrientationCurve.even_turning(
        ...     np.eye(3), [[0, -1, 0], [1, 0, 0], [0, 0, 1]], 0.2)
        >>> half.rate([0.1]).round(6)  # a quarter turn on 0.2 m
        array([[0.      , 0.      , 7.853982]])
        """
        R0 = checked_rotations(start, (3, 3), "start")
        R1 = checked_rotations(end, (3, 3), "end")
        vector = rotation_vector(R0.T @ R1)
        if np.linalg.norm(vector) > HALF_TURN:
            raise PathError(
                "the tool turns by 180 deg from one pose to the next, so that neither way round is "
                "the shorter one; give a pose between"
            )
        return cls([0.0, length], np.array([R0, R1]), np.tile(R0 @ vector / length, (2, 1)))

    @classmethod
    def through(cls, s: ArrayLike, rotations: ArrayLike) -> OrientationCurve:
        """A smooth curve through rotations at increasing arc lengths from 0.

        The rates and their derivatives are those of `scipy.spatial.transform.RotationSpline`.

        Raises:
            ArrayError: Arrays are not finite or have a wrong shape.
            PathError: Arc lengths do not increase from 0, a matrix is not a rotation, or
                neighbours are half a turn apart.
        """
        from scipy.spatial.transform import Rotation, RotationSpline

        still = np.zeros((len(np.atleast_1d(np.asarray(s))), 3))
        checked = cls(s, rotations, still)
        spline = RotationSpline(checked.s, Rotation.from_matrix(checked.rotations))
        # SciPy's are in the axes of the tool.
        rates, changes = (
            np.einsum("kij,kj->ki", checked.rotations, spline(checked.s, order)) for order in (1, 2)
        )
        return cls(checked.s, checked.rotations, rates, changes, checked.s[[0, -1]])

    @classmethod
    def turning(
        cls, rotation: ArrayLike, axis: ArrayLike, angle: float, length: float
    ) -> OrientationCurve:
        """A uniform rotation about an axis in base axes by any angle [rad], along a stretch.

        For example, a tool with a constant direction to an arc's tangent turns about the arc's
        normal by the arc's angle.
        """
        R0 = checked_rotations(rotation, (3, 3), "rotation")
        direction = to_unit_vector(axis, "axis")
        parts = max(1, math.ceil(abs(angle) / MAX_PART_ANGLE - RATE_TOLERANCE))
        share = np.linspace(0.0, 1.0, parts + 1)
        rotations = rotation_matrices(share[:, None] * angle * direction) @ R0
        rate = np.tile(direction * angle / length, (parts + 1, 1))
        return cls(share * length, rotations, rate, breaks=[0.0, length])

    @classmethod
    def joined(
        cls, stretches: Sequence[OrientationCurve], stops: Collection[int] = ()
    ) -> OrientationCurve:
        """Join stretches into one curve with a rate that jumps only at stops.

        If the rates of two stretches differ at their junction, the rate there is the mean of both.
        It changes smoothly on both sides, over a quarter of the length of the shorter stretch.
        Elsewhere the stretches are unchanged. Thus the tool begins to turn before the junction. It
        deviates by at most 2.5 % of the difference of the rates times the length of the shorter
        stretch, and at the junction its orientation is exact. A stretch that does not turn
        uniformly, for example through given rotations, changes its rate in its last piece. If the
        derivatives of the rates differ, the derivative at the junction is zero.

        Args:
            stretches: Consecutive stretches.
            stops: Indices of the stretches that end at a stop. There both sides keep their rate.

        Raises:
            PathError: No stretch is given, or one does not begin at the end of the previous one.
        """
        if not stretches:
            raise PathError("no stretches are given; an orientation needs at least one")
        return cls(*join_arrays(stretches, stops))

    def divided(self, length: float, *, at_end: bool = False) -> OrientationCurve:
        """Insert a break at a distance from an end, if its piece is longer and turns uniformly.

        Args:
            length: Distance [m].
            at_end: Whether it is the distance from the end; otherwise from the start.
        """
        v, step = self._v[-1 if at_end else 0], self._steps[-1 if at_end else 0]
        spread = np.abs(np.diff(v, axis=0)).max()
        if spread > RATE_TOLERANCE * max(1.0, np.abs(v).max()) or step <= length:
            return self
        s = self.length - length if at_end else length
        index = len(self.s) - 1 if at_end else 1
        rotation, *derivatives = self.states([s])
        rates, changes = (
            np.insert(given, index, value, axis=0)
            for given, value in zip((self.rates, self.changes), derivatives, strict=True)
        )
        rotations = np.insert(self.rotations, index, rotation, axis=0)
        breaks = np.sort(np.append(self.breaks, s))
        return OrientationCurve(np.insert(self.s, index, s), rotations, rates, changes, breaks)

    @property
    def jumps(self) -> FloatArray:
        """Arc lengths at which the rate or its derivative jumps (stops only) [m]."""
        both_sides = np.array([self.rates[1:-1], self.changes[1:-1]])
        size = np.abs(both_sides).max(axis=(2, 3), initial=0.0)
        step = np.abs(np.diff(both_sides, axis=2)).max(axis=(2, 3), initial=0.0)
        return np.asarray(self.s[1:-1][(step > RATE_TOLERANCE * size).any(axis=0)])

    def _pieces(self, s: ArrayLike, at: ArrayLike | None = None) -> tuple[IndexArray, FloatArray]:
        """Index of the piece of each arc length, and the parameter u in it."""
        s = np.asarray(s, dtype=float)
        piece = np.clip(np.searchsorted(self.s, s, "right") - 1, 0, len(self.s) - 2)
        if at is not None:  # a stretch between two breaks, of several pieces
            stretch = np.searchsorted(self.breaks, np.asarray(at, dtype=float), "right") - 1
            stretch = np.clip(stretch, 0, len(self.breaks) - 2)
            piece = np.clip(piece, self._firsts[stretch], self._firsts[stretch + 1] - 1)
        return piece, (s - self.s[piece]) / self._steps[piece]

    def rotation(self, s: ArrayLike) -> FloatArray:
        """Rotation matrices of the tool at arc lengths (k,) [m], shape (k, 3, 3)."""
        return self.states(s)[0]

    def rate(self, s: ArrayLike, order: int = 0) -> FloatArray:
        """Angular velocity per unit length in base axes, or its derivative, shape (k, 3).

        Args:
            s: Arc lengths [m], shape (k,).
            order: 0 for the rate [rad/m], 1 for its derivative with respect to s [rad/m²].
        """
        return self.states(s)[1 + checked_curve_order(order, 1)]

    def states(
        self, s: ArrayLike, at: ArrayLike | None = None
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """`rotation`, `rate` and the derivative of the rate in one evaluation.

        Args:
            s: Arc lengths [m], shape (k,).
            at: Arc lengths that choose the stretches between breaks, by default s [m], shape (k,):
                a stretch is extended smoothly beyond its ends.
        """
        piece, u = self._pieces(s, at)
        R = self.rotations[piece]
        if self._even:
            vector = 5.0 * u[:, None] * self._v[piece, 0]
            R = R if self._still else R @ rotation_matrices(vector)
            return np.asarray(R), self.rates[piece, 1], np.zeros_like(vector)
        f = bernstein_sums(bernstein_values(5, u))
        slope = 5.0 * bernstein_values(4, u)
        bent = -20.0 * np.diff(bernstein_values(3, u), axis=0, prepend=0.0, append=0.0)
        rate, change = np.zeros((len(u), 3)), np.zeros((len(u), 3))
        for i in range(5):
            vector = self._v[piece, i]
            axis = np.einsum("kij,kj->ki", R, vector)
            turn = slope[i][:, None] * axis
            # An axis turns with the previous joints.
            change += bent[i][:, None] * axis + np.cross(rate, turn)
            rate += turn
            R = R @ rotation_matrices(f[i][:, None] * vector)
        step = self._steps[piece][:, None]
        return np.asarray(R), rate / step, change / step**2

    def rate_bounds(self, s0: ArrayLike, s1: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Upper bounds of the norms of rate [rad/m] and d rate/ds [rad/m²] from s0 to s1.

        The bound of the derivative does not include jumps of the rate.

        Args:
            s0: Arc lengths at the start, in [0, length] [m], shape (k,), like all results.
            s1: Arc lengths at the end, above or below s0 [m], shape (k,).
        """
        low, high = sort_ends(s0, s1)
        first = np.clip(np.searchsorted(self.s, low, "right") - 1, 0, len(self.s) - 2)
        last = np.maximum(np.clip(np.searchsorted(self.s, high, "left") - 1, 0, None), first)
        last = np.minimum(last, len(self.s) - 2)
        # One row for each pair of interval and piece.
        row = np.repeat(np.arange(low.size), last - first + 1)
        offset = np.arange(row.size) - np.searchsorted(row, row)
        piece = first[row] + offset
        step = self._steps[piece]
        if self._even:
            rate, change = (bound[piece] for bound in self._bounds.whole)
        else:
            ends = (np.clip((s[row] - self.s[piece]) / step, 0.0, 1.0) for s in (low, high))
            rate, change = self._bounds(piece, *ends)
        bounds = np.zeros(low.size), np.zeros(low.size)
        np.maximum.at(bounds[0], row, rate / step)
        np.maximum.at(bounds[1], row, change / step**2)
        return bounds


def repeat_two_sided(values: ArrayLike, count: int, name: str) -> FloatArray:
    """Copy values before and after each break, shape (m, 2, 3)."""
    array = np.asarray(values, dtype=float)
    if array.ndim == 3:
        return checked_array(array, (count, 2, 3), name)
    array = checked_array(array, (count, 3), name)
    return np.repeat(array[:, None], 2, axis=1)
