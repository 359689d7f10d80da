"""Bounds on the relative motion of solids over time intervals.

Only the joints between two solids count: those that carry one of them and not the other. With lᵢ
the maximum speed of a point of a solid for a unit velocity of joint i, a solid moves by at most Σᵢ
|Δqᵢ| lᵢ (`RelativeMotion.largest`).

Along a fixed direction n the velocity of a point at the middle of the interval is n·v, a linear
function of the point. It changes at most at the rate of the acceleration,

    Σᵢ |q̈ᵢ| lᵢ + |q̇ᵢ| (|q̇ᵢ| + 2 Σⱼ |q̇ⱼ|) lᵢ,    j nearer to the base than i,

since ∂²p/∂qⱼ∂qᵢ = zⱼ × ∂p/∂qᵢ (`RelativeMotion.approach`).
"""

from __future__ import annotations

import numpy as np

from knotwork.arrays import BoolArray, FloatArray, IndexArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.polynomial.critical_points import differentiate, horner
from knotwork.robot.joint_tree import place_joints
from knotwork.scene.solid_pairs import SolidPairs
from knotwork.verification.bounds.rate_bounds import Intervals, joint_rates


class RelativeMotion:
    """Bounds on the motion of pairs of solids over k intervals.

    Args:
        table: Pairs of solids.
        curve: Positions of the joints that carry them, trailing shape (d,).
        intervals: The intervals.

    Attributes:
        rotation: Rotations of all joints at the middles of the intervals, shape (k, n + 1, 3, 3).
        origin: Origins of all joints at these times [m], shape (k, n + 1, 3).
        placed: Rotations and origins of the solids' axes, see `SolidPairs.placements`.
    """

    def __init__(self, table: SolidPairs, curve: PiecewisePolynomial, intervals: Intervals) -> None:
        self.table, self.tree = table, table.model.tree
        tree, middle = self.tree, intervals.middle[:, None]
        c = curve.c[:, intervals.piece]
        self.rotation, self.origin = place_joints(tree, horner(c, middle))
        self.half = intervals.duration / 2
        carriers = tree.carriers[table.joint]
        a, b = carriers[table.first], carriers[table.second]
        self.between = (a & ~b).astype(float), (b & ~a).astype(float)
        columns = list(tree.column[1:])
        rates = joint_rates(curve, intervals).bounds
        self.speed, self.acceleration = np.zeros((2, *self.origin.shape[:2]))
        self.speed[:, 1:], self.acceleration[:, 1:] = rates[1, columns].T, rates[2, columns].T
        self.rate = np.zeros_like(self.speed)
        self.rate[:, 1:] = horner(differentiate(c), middle)[:, columns]
        self.axis = (self.rotation @ tree.axis[:, :, None])[..., 0]
        self.placed = table.placements(self.rotation, self.origin)
        self.corners = table.corners(*self.placed)
        self.levers = self._levers(carriers)
        self.moves = (self.speed * self.half[:, None])[:, :, None] * self.levers

    def _levers(self, carriers: BoolArray) -> FloatArray:
        """Largest speed of a point of each solid for a joint speed of 1, shape (k, n + 1, s)."""
        tree = self.tree
        k, n = self.origin.shape[:2]
        levers = np.zeros((k, n, len(self.table.solids)))
        for j in range(1, n):
            carried = np.flatnonzero(carriers[:, j])
            arm = self.corners[:, carried] - self.origin[:, j, None, :, None]
            along = (self.axis[:, j, None, None, :] @ arm)[:, :, 0]
            square = (arm * arm).sum(axis=2) - along * along
            off = np.sqrt(np.maximum(square.max(axis=2), 0.0))
            levers[:, j, carried] = tree.angle_per_unit[j] * off + abs(tree.length_per_unit[j])
        return levers

    def largest(self, row: IndexArray, pair: IndexArray) -> FloatArray:
        """Upper bound on the relative motion of points of two solids [m], shape (m,).

        Args:
            row: Rows of the intervals, shape (m,).
            pair: Indices of pairs of solids, shape (m,).
        """
        a, b = self.between
        total = (self.moves[:, :, self.table.first] * a.T).sum(axis=1)
        total += (self.moves[:, :, self.table.second] * b.T).sum(axis=1)
        return np.asarray(total[row, pair])

    def approach(self, row: IndexArray, pair: IndexArray, normal: FloatArray) -> FloatArray:
        """Upper bound on the approach of two solids along a direction [m], shape (m,).

        Args:
            row: Rows of the intervals, shape (m,).
            pair: Indices of pairs of solids, shape (m,).
            normal: Unit vectors, shape (m, 3).
        """
        a, b = self.between
        low_a, high_a, bend_a = self._speeds_along(row, self.table.first[pair], a[pair], normal)
        low_b, high_b, bend_b = self._speeds_along(row, self.table.second[pair], b[pair], normal)
        rate, half = np.maximum(high_a - low_b, high_b - low_a), self.half[row]
        return np.asarray(rate * half + (bend_a + bend_b) * half * half / 2)

    def _speeds_along(
        self, row: IndexArray, solid: IndexArray, moved: FloatArray, normal: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Minimum and maximum speed of points along a direction, and a bound on accelerations.

        Args:
            row: Rows of the intervals, shape (m,).
            solid: Indices of solids, shape (m,).
            moved: 1 for the joints that move the solid relative to the other, else 0; (m, n + 1).
            normal: Unit vectors, shape (m, 3).
        """
        turns, slides, axis = (
            self.tree.angle_per_unit,
            self.tree.length_per_unit,
            self.axis[row],
        )
        rate = self.rate[row] * moved
        turning = np.cross(normal[:, None], axis) * (rate * turns)[:, :, None]
        sliding = rate * (slides * np.einsum("mij,mj->mi", axis, normal))
        slope = turning.sum(axis=1)
        level = sliding.sum(axis=1) - np.einsum("mij,mij->m", turning, self.origin[row])
        speeds = level[:, None] + np.einsum("mi,mic->mc", slope, self.corners[row, solid])
        # The levers are those at the middle, so outer joints may move points farther from an axis.
        moves, speed = self.moves[row, :, solid] * moved, self.speed[row] * moved
        beyond = moves.sum(axis=1)[:, None] - moves.cumsum(axis=1)
        levers = self.levers[row, :, solid] + turns * beyond
        nearer = (turns * speed).cumsum(axis=1) - turns * speed
        bends = self.acceleration[row] * moved + speed * (turns * speed + 2.0 * nearer)
        return speeds.min(axis=1), speeds.max(axis=1), (bends * levers).sum(axis=1)
