"""`Motion`: joints over time as pieces of polynomials, and their exact extrema."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

IN_PIECE = 8
"""Times in each piece, however short it is."""


@dataclass(frozen=True, eq=False)
class Motion:
    """A motion of joints.

    Attributes:
        names: Of the joints.
        x: Times at which the pieces meet, and both ends [s], shape (m + 1,).
        c: Coefficients in the time since the piece began, the highest power first, shape (k, m, d).
    """

    names: tuple[str, ...]
    x: np.ndarray
    c: np.ndarray

    @classmethod
    def read(cls, path: Path) -> Motion:
        """A saved trajectory.json."""
        data = json.loads(path.read_text(encoding="utf-8"))
        return cls(
            tuple(data["joint_names"]), np.array(data["breaks"]), np.array(data["coefficients"])
        )

    def derivative(self, order: int) -> np.ndarray:
        """Coefficients of a derivative, shape (k - order, m, d), at least one row."""
        c = self.c
        for _ in range(order):
            powers = np.arange(len(c) - 1, 0, -1.0)
            c = c[:-1] * powers[:, None, None] if len(c) > 1 else 0.0 * c
        return c

    def __call__(self, t: np.ndarray | float, order: int = 0, side: str = "right") -> np.ndarray:
        """Values at times, shape of t followed by (d,)."""
        t = np.asarray(t, dtype=float)
        piece = np.searchsorted(self.x, t, side=side) - 1  # type: ignore[call-overload]
        piece = np.clip(piece, 0, len(self.x) - 2)
        local = (t - self.x[piece])[..., None]
        value = np.zeros((*t.shape, self.c.shape[2]))
        for row in self.derivative(order):
            value = value * local + row[piece]
        return value

    def dense(self, count: int = 1000) -> np.ndarray:
        """So many times from the start to the end, and some in every piece."""
        parts = np.linspace(0.0, 1.0, IN_PIECE, endpoint=False)
        within = (self.x[:-1, None] + np.diff(self.x)[:, None] * parts).ravel()
        return np.unique(np.concatenate((np.linspace(self.x[0], self.x[-1], count), within)))

    def critical(self, order: int, low: float, high: float) -> tuple[np.ndarray, np.ndarray]:
        """Least and greatest value of a derivative between two times, shape (d,) each.

        They are at the ends of pieces, from both sides, or where the next derivative is zero.
        """
        c, rate = self.derivative(order), self.derivative(order + 1)
        first = np.maximum(self.x[:-1], low) - self.x[:-1]
        last = np.minimum(self.x[1:], high) - self.x[:-1]
        used = last >= first
        at = [np.broadcast_to(ends[:, None], c.shape[1:]) for ends in (first, last)]
        for root in _roots(rate):
            inside = (root >= first[:, None]) & (root <= last[:, None])
            at.append(np.where(inside, root, first[:, None]))
        t = np.stack(at)
        value = np.zeros_like(t)
        for row in c:
            value = value * t + row
        value = value[:, used]
        return value.min(axis=(0, 1)), value.max(axis=(0, 1))

    def jumps(self, order: int) -> np.ndarray:
        """How far a derivative jumps at each inner break, shape (m - 1, d)."""
        c = self.derivative(order)
        spans = np.diff(self.x)[:, None]
        end = np.zeros(c.shape[1:])
        for row in c:
            end = end * spans + row
        return np.abs(c[-1, 1:] - end[:-1])


def _roots(c: np.ndarray) -> list[np.ndarray]:
    """Real roots of polynomials, and some other places, shape (m, d) each."""
    while len(c) > 1 and not c[0].any():
        c = c[1:]
    if len(c) == 1:
        return []
    with np.errstate(all="ignore"):
        if len(c) == 2:
            return [np.nan_to_num(-c[1] / c[0])]
        if len(c) == 3:
            # where there is none, some other place: it does no harm to look there too
            below = np.sqrt(np.maximum(c[1] ** 2 - 4.0 * c[0] * c[2], 0.0))
            half = -0.5 * (c[1] + np.copysign(below, c[1]))
            return [np.nan_to_num(half / c[0]), np.nan_to_num(c[2] / half)]
    found = np.zeros((len(c) - 1, *c.shape[1:]))
    for place in np.ndindex(*c.shape[1:]):
        roots = np.roots(c[(slice(None), *place)])
        found[(slice(0, len(roots)), *place)] = roots.real
    return list(found)
