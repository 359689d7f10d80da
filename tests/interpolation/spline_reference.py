"""The spline found in other ways than the package finds it, to compare with."""

from __future__ import annotations

from fractions import Fraction
from math import perm

import numpy as np


def knots_of_paper(x):
    """Eq. (39), written out index by index."""
    n = len(x)
    t = [x[0], x[0] + 0.618 * (x[1] - x[0])]
    for i in range(2, n - 1):
        t += [x[i - 1] + (x[i] - x[i - 1]) / 4, x[i - 1] + 3 * (x[i] - x[i - 1]) / 4]
    return np.array([*t, x[-1] - 0.618 * (x[-1] - x[-2]), x[-1]])


def paper_system(x, y, dydx, t):
    """Eqs. (30), (31), (34) in their corrected forms, for one joint and m = 2n - 2 knots.

    Unknowns are r[1…m-2], then drdt[1…m-2]; the rows are those of Eq. (34), each divided by
    H[j] + H[j+1], then (30) and (31) of each inner waypoint in turn, as Eq. (40) has them.
    """
    n, m = len(x), len(t)
    H = np.concatenate(([np.nan], np.diff(t)))
    known = {("r", 0): y[0], ("r", m - 1): y[-1], ("v", 0): dydx[0], ("v", m - 1): dydx[-1]}
    rows, right = [], []

    def add(terms, value):
        row = np.zeros(2 * (m - 2))
        for kind, j, factor in terms:
            if (kind, j) in known:
                value -= factor * known[kind, j]
            else:
                row[j - 1 + (m - 2 if kind == "v" else 0)] += factor
        rows.append(row)
        right.append(value)

    for j in range(1, m - 1):
        a, b, s = H[j], H[j + 1], H[j] + H[j + 1]
        add(
            [
                ("r", j - 1, 3 * b / a / s),
                ("r", j, 3 * (a / b - b / a) / s),
                ("r", j + 1, -3 * a / b / s),
                ("v", j - 1, b / s),
                ("v", j, 2.0),
                ("v", j + 1, a / s),
            ],
            0.0,
        )
    for i in range(1, n - 1):
        j = 2 * i - 1
        h, u = H[j + 1], (x[i] - t[j]) / H[j + 1]
        add(
            [
                ("r", j, 1 - 3 * u**2 + 2 * u**3),
                ("r", j + 1, 3 * u**2 - 2 * u**3),
                ("v", j, h * (u - 2 * u**2 + u**3)),
                ("v", j + 1, h * (u**3 - u**2)),
            ],
            y[i],
        )
        add(
            [
                ("r", j, (6 * u**2 - 6 * u) / h),
                ("r", j + 1, (6 * u - 6 * u**2) / h),
                ("v", j, 1 - 4 * u + 3 * u**2),
                ("v", j + 1, 3 * u**2 - 2 * u),
            ],
            dydx[i],
        )
    return np.array(rows), np.array(right)


def exact_pieces(x, y, dydx, t, ends=None):
    """Coefficients of the pieces (highest power first, local time), in rational arithmetic."""
    x, y, dydx, t = ([Fraction(float(v)) for v in values] for values in (x, y, dydx, t))
    pieces = len(t) - 1
    rows = []

    def powers(u, nu):
        return [perm(k, nu) * u ** max(k - nu, 0) for k in (3, 2, 1, 0)]

    def add(terms, value):
        row = [Fraction(0)] * (4 * pieces) + [Fraction(value)]
        for piece, factors, sign in terms:
            for k, factor in enumerate(factors):
                row[4 * piece + k] += sign * factor
        rows.append(row)

    for i, time in enumerate(x):
        piece = max(j for j in range(pieces) if t[j] <= time)
        for nu, value in ((0, y[i]), (1, dydx[i])):
            add([(piece, powers(time - t[piece], nu), 1)], value)
    for j in range(1, pieces):
        for nu in range(3):
            left = (j - 1, powers(t[j] - t[j - 1], nu), 1)
            add([left, (j, powers(Fraction(0), nu), -1)], 0)
    if ends is not None:
        add([(0, powers(Fraction(0), 2), 1)], Fraction(float(ends[0])))
        add([(pieces - 1, powers(t[-1] - t[-2], 2), 1)], Fraction(float(ends[1])))
    size = 4 * pieces
    for column in range(size):
        pivot = next(r for r in range(column, size) if rows[r][column])
        rows[column], rows[pivot] = rows[pivot], rows[column]
        head = rows[column] = [value / rows[column][column] for value in rows[column]]
        for r in range(size):
            factor = rows[r][column]
            if r != column and factor:
                rows[r] = [a - factor * b for a, b in zip(rows[r], head, strict=True)]
    return np.array([[float(rows[4 * j + k][-1]) for j in range(pieces)] for k in range(4)])
