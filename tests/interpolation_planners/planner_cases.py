"""Waypoints for planners, and the linear system of a spline solved densely."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from knotwork.waypoints import JointWaypoints

Array = NDArray[np.float64]

COUNTS = (2, 3, 4, 5, 6, 9, 40)


def random_waypoints(n: int, seed: int = 0, joints: int = 3, ratio: float = 8.0) -> JointWaypoints:
    random = np.random.default_rng(1000 * n + seed)
    span = np.exp(random.uniform(0.0, np.log(ratio), n - 1))
    return JointWaypoints(
        tuple(f"joint_{i}" for i in range(joints)),
        random.uniform(-3, 3) + np.append(0.0, np.cumsum(span)),
        random.normal(size=(n, joints)),
        random.normal(size=(n, joints)),
    )


class DenseSpline:
    """Polynomials of given degrees between breaks, fixed by linear conditions, solved densely."""

    def __init__(self, breaks: Array, degrees: list[int]) -> None:
        self.breaks, self.degrees = np.asarray(breaks), degrees
        self.offset = np.append(0, np.cumsum(np.array(degrees) + 1))
        self.rows: list[Array] = []
        self.values: list[Array] = []

    def row(self, piece: int, time: float, nu: int) -> Array:
        row = np.zeros(self.offset[-1])
        u = time - self.breaks[piece]
        for power in range(nu, self.degrees[piece] + 1):
            row[self.offset[piece] + power] = math.perm(power, nu) * u ** (power - nu)
        return row

    def meet(self, piece: int, time: float, nu: int, value: Array) -> None:
        self.rows.append(self.row(piece, time, nu))
        self.values.append(np.asarray(value, dtype=float))

    def join(self, order: int) -> None:
        """Make all derivatives up to an order continuous at the inner breaks."""
        zero = np.zeros_like(self.values[0])
        for i, time in enumerate(self.breaks[1:-1]):
            for nu in range(order + 1):
                self.rows.append(self.row(i + 1, time, nu) - self.row(i, time, nu))
                self.values.append(zero)

    def solve(self) -> None:
        matrix = np.array(self.rows)
        assert matrix.shape[0] == matrix.shape[1]
        # scaled by columns, as powers of short and long pieces differ widely
        size = np.abs(matrix).max(axis=0)
        self.solution = np.linalg.solve(matrix / size, np.array(self.values)) / size[:, None]

    def __call__(self, times: Array, nu: int) -> Array:
        piece = np.clip(
            np.searchsorted(self.breaks, times, side="right") - 1, 0, len(self.degrees) - 1
        )
        return np.array(
            [self.row(i, t, nu) @ self.solution for i, t in zip(piece, times, strict=True)]
        )


def inside(breaks: Array) -> Array:
    """Times inside the pieces, where nothing jumps."""
    return np.concatenate([a + (b - a) * np.linspace(0.03, 0.97, 7) for a, b in pairwise(breaks)])
