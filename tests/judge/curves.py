"""The curves that tools follow, by arc length: lines, arcs and C² curves through points."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

SAME = 1e-9


class Line:
    """Straight from one point to another [m]."""

    def __init__(self, start: np.ndarray, end: np.ndarray) -> None:
        self.start, way = start, end - start
        self.length = float(np.linalg.norm(way))
        self.way = way / self.length

    def at(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Points, directions and curvature vectors at arc lengths, shape (k, 3) each."""
        ones = np.ones((len(s), 1))
        return self.start + s[:, None] * self.way, ones * self.way, 0.0 * ones * self.way


class Arc:
    """About a centre, from a point on, turning positively about a normal by an angle [rad]."""

    def __init__(
        self, start: np.ndarray, centre: np.ndarray, normal: np.ndarray, angle: float
    ) -> None:
        self.centre, self.normal = centre, normal / np.linalg.norm(normal)
        spoke = start - centre
        self.radius, self.angle = float(np.linalg.norm(spoke)), angle
        self.out = spoke / self.radius
        self.aside = np.cross(self.normal, self.out)
        self.length = self.radius * angle

    def at(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        c, z = (f(s / self.radius)[:, None] for f in (np.cos, np.sin))
        out, along = c * self.out + z * self.aside, c * self.aside - z * self.out
        return self.centre + self.radius * out, along, -out / self.radius


class Spline:
    """The cubic spline through points over the distances along their chords, without end knots."""

    CELLS = 64

    def __init__(self, points: np.ndarray) -> None:
        from scipy.interpolate import CubicSpline

        u = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))))
        self.curve = CubicSpline(u, points)
        cells = [np.linspace(a, b, self.CELLS + 1)[:-1] for a, b in itertools.pairwise(u)]
        self.u = np.append(np.concatenate(cells), u[-1])
        node, weight = np.polynomial.legendre.leggauss(5)
        h = 0.5 * np.diff(self.u)
        at = self.u[:-1, None] + h[:, None] * (1.0 + node)
        parts = h * (np.linalg.norm(self.curve(at, 1), axis=2) @ weight)
        self.s = np.concatenate(([0.0], np.cumsum(parts)))
        self.length = float(self.s[-1])

    def at(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        cell = np.clip(np.searchsorted(self.s, s, "right") - 1, 0, len(self.u) - 2)
        u = np.interp(s, self.s, self.u)
        node, weight = np.polynomial.legendre.leggauss(5)
        for _ in range(3):  # Newton's method for s(u) = s, within the cell
            h = 0.5 * (u - self.u[cell])
            places = self.u[cell][:, None] + h[:, None] * (1.0 + node)
            reached = self.s[cell] + h * (np.linalg.norm(self.curve(places, 1), axis=2) @ weight)
            u = u - (reached - s) / np.linalg.norm(self.curve(u, 1), axis=1)
        first, second = self.curve(u, 1), self.curve(u, 2)
        speed = np.linalg.norm(first, axis=1)[:, None]
        T = first / speed
        bent = (second - (second * T).sum(axis=1)[:, None] * T) / speed**2
        return self.curve(u), T, bent


Curve = Line | Arc | Spline


def arc_through(start: np.ndarray, point: np.ndarray, end: np.ndarray) -> Arc:
    """From start to end through a point on the way."""
    u, v = point - start, end - start
    normal = np.cross(u, v)
    centre = start + np.cross((u @ u) * v - (v @ v) * u, normal) / (2.0 * (normal @ normal))
    return Arc(start, centre, normal, _angle(start - centre, end - centre, normal))


def arc_about(
    start: np.ndarray, centre: np.ndarray, end: np.ndarray, normal: np.ndarray | None, turns: int
) -> Arc:
    """About a centre: the shorter way, or the positive one about a normal, and whole turns more."""
    axis = np.cross(start - centre, end - centre) if normal is None else normal
    angle = _angle(start - centre, end - centre, axis)
    if np.linalg.norm(end - start) <= SAME:
        angle = 2.0 * math.pi
    return Arc(start, centre, axis, angle + 2.0 * math.pi * turns)


def _angle(one: np.ndarray, other: np.ndarray, axis: np.ndarray) -> float:
    """From one spoke to another, positively about an axis, in (0, 2π]."""
    axis = axis / np.linalg.norm(axis)
    angle = math.atan2(float(axis @ np.cross(one, other)), float(one @ other))
    return angle if angle > 0.0 else angle + 2.0 * math.pi


@dataclass(frozen=True, eq=False)
class Stretch:
    """A curve with a speed, along which the tool turns evenly.

    Attributes:
        rotation: Of the tool at its start.
        rate: How it turns from there on, in base axes, per unit of length [rad/m].
        speed: [m/s]
        start, end: When it begins and ends [s].
        full: From when to when the speed is required in full [s].
        kept: The speed at both ends [m/s].
    """

    curve: Curve
    rotation: np.ndarray
    rate: np.ndarray
    speed: float
    start: float
    end: float
    full: tuple[float, float]
    kept: tuple[float, float]
    names: tuple[str, str]


class ToolPath:
    """Stretches one after another, from one stop to the next.

    Attributes:
        woven: What a weave adds at times [m], shape (k,) to (k, 3).
        axis: The tool's z axis at arc lengths, (k,) to (k, 3), where its turn is free.
    """

    def __init__(self, stretches: Sequence[Stretch]) -> None:
        self.stretches = list(stretches)
        self.woven: Callable[[np.ndarray], np.ndarray] = lambda t: np.zeros((len(t), 3))
        self.axis: Callable[[np.ndarray], np.ndarray] | None = None
        self.ends = np.cumsum([stretch.curve.length for stretch in stretches])
        self.length = float(self.ends[-1])

    def _split(self, s: np.ndarray) -> list[tuple[int, np.ndarray, np.ndarray]]:
        """For each stretch the arc lengths on it, from its own start."""
        which = np.minimum(np.searchsorted(self.ends, s, "left"), len(self.ends) - 1)
        starts = np.concatenate(([0.0], self.ends[:-1]))
        return [(k, which == k, s[which == k] - starts[k]) for k in np.unique(which)]

    def at(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        found = np.empty((3, len(s), 3))
        for k, mask, own in self._split(s):
            found[:, mask] = self.stretches[k].curve.at(own)
        return found[0], found[1], found[2]

    def rotations(self, s: np.ndarray) -> np.ndarray:
        """Of the tool, where it turns evenly from end to end, shape (k, 3, 3)."""
        found = np.empty((len(s), 3, 3))
        for k, mask, own in self._split(s):
            one = self.stretches[k]
            found[mask] = [pin.exp3(one.rate * d) @ one.rotation for d in own]
        return found

    def ahead(self, s: np.ndarray) -> np.ndarray:
        """How far the tool may be turned off near where two rates meet [rad].

        docs/tool_paths.md: within a quarter of the shorter stretch it is turned ahead by at most
        2.5 % of the difference of the rates times the length of the shorter stretch.
        """
        room = np.zeros(len(s))
        for k in range(len(self.stretches) - 1):
            one, other = self.stretches[k : k + 2]
            shorter = min(one.curve.length, other.curve.length)
            near = np.abs(s - self.ends[k]) <= 0.25 * shorter
            ease = 0.025 * float(np.linalg.norm(one.rate - other.rate)) * shorter
            room[near] = np.maximum(room[near], ease)
        return room

    def twist(self, k: int, speed: float) -> np.ndarray:
        """Velocity of the tool at the end of stretch k - 1, where stretch k begins."""
        s = np.array([0.0 if k == 0 else self.ends[k - 1]])
        rates = [self.stretches[i].rate for i in (k - 1, k) if 0 <= i < len(self.stretches)]
        rate = np.mean(rates, axis=0)  # where two meet, that in the middle of both
        return np.concatenate((speed * self.at(s)[1][0], speed * rate))


def timed(
    lengths: Sequence[float],
    speeds: Sequence[float],
    ends: tuple[float | None, float | None],
    acceleration: float,
    start: float,
) -> list[tuple[float, float, tuple[float, float], tuple[float, float]]]:
    """Start, end, window of full speed [s], and speeds at both ends [m/s] of each stretch.

    docs/tool_paths.md: from v0 to v1 in 1.5 |v1 - v0| / a, in the faster stretch.
    """
    found, last = [], len(lengths) - 1
    for k, (length, v) in enumerate(zip(lengths, speeds, strict=True)):
        before = ends[0] if k == 0 else min(v, speeds[k - 1])
        after = ends[1] if k == last else min(v, speeds[k + 1])
        v0, v1 = v if before is None else before, v if after is None else after
        ramps = [1.5 * abs(v - u) / acceleration for u in (v0, v1)]
        even = (length - 0.5 * (v0 + v) * ramps[0] - 0.5 * (v1 + v) * ramps[1]) / v
        full = start + ramps[0], start + ramps[0] + max(even, 0.0)
        end = full[1] + ramps[1]
        found.append((start, end, full, (v0, v1)))
        start = end
    return found
