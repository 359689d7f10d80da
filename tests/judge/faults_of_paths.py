"""Faults along tool paths, by a gantry whose joints are the tool's place and its turn about z.

So whatever way the tool shall go is a motion of its joints, and the way along the path, s(t), can
be any: there and back, backwards, too fast, whole turns too few.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

import urdfs
from judge import curves
from judge.cases import Case, Fault, Rng, Shelf, bumped, sign, size
from judge.motion import Motion

NAMES = ("x", "y", "z", "c")
KNOTS = 120
Way = Callable[[np.ndarray], Any]
"""Arc lengths at times, shape (k,) each."""


def gantry(shelf: Shelf) -> str:
    """Path of the gantry's URDF."""
    path = shelf.folder / "gantry.urdf"
    links = ("base", "bridge", "carriage", "column", "head")
    kinds = ("prismatic", "prismatic", "prismatic", "revolute")
    axes = ("1 0 0", "0 1 0", "0 0 1", "0 0 1")
    wide = urdfs.limits(-50, 50, velocity=1000, effort=0)
    joints = [
        urdfs.joint(name, parent, child, kind, axis=axis, more=wide)
        for name, (parent, child), kind, axis in zip(
            NAMES, itertools.pairwise(links), kinds, axes, strict=True
        )
    ]
    path.write_text(urdfs.robot(*map(urdfs.link, links), *joints), encoding="utf-8")
    return str(path)


def covered(t: np.ndarray, start: float, end: float) -> np.ndarray:
    """How far one gets with a speed that rises from 0 to 1 between two times, and stays."""
    u = np.maximum((t - start) / (end - start), 0.0)
    part = np.minimum(u, 1.0)
    return (end - start) * np.asarray(part**3 - 0.5 * part**4 + np.maximum(u - 1.0, 0.0))


@dataclass(frozen=True)
class Along:
    """A path that a gantry follows, from rest to rest.

    Attributes:
        path: Where and when.
        closed: Whether it ends where it begins.
        rate: Of the turn about z [rad/m].
    """

    path: curves.ToolPath
    closed: bool
    rate: float

    @property
    def stretch(self) -> curves.Stretch:
        return self.path.stretches[0]

    def nominal(self, t: np.ndarray) -> np.ndarray:
        """Required arc length over time."""
        one = self.stretch
        return one.speed * (covered(t, one.start, one.full[0]) - covered(t, one.full[1], one.end))

    def places(self, s: np.ndarray) -> np.ndarray:
        """Joint values at arc lengths, before the start and after the end too, shape (k, 4)."""
        curve = self.stretch.curve
        inside = s if isinstance(curve, curves.Arc | curves.Line) else np.clip(s, 0, curve.length)
        return np.column_stack((curve.at(inside)[0], self.rate * s))

    def motion(self, way: Way, knots: int = KNOTS) -> Motion:
        """The joints' motion with which the tool is at s(t), through many knots."""
        one = self.stretch
        marks = [one.start, one.full[0], one.full[1], one.end]
        t = np.unique(np.concatenate([
            np.linspace(low, high, max(3, int(knots * (high - low) / (one.end - one.start))))
            for low, high in itertools.pairwise(marks)
        ]))  # fmt: skip
        still = np.zeros(4)
        spline = CubicSpline(t, self.places(way(t)), bc_type=((1, still), (1, still)))
        return Motion(NAMES, spline.x, spline.c)


def _frame(rng: Rng) -> np.ndarray:
    """Three axes at right angles, the last of which is the normal of an arc."""
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return np.asarray(axes * np.sign(np.linalg.det(axes)))


def _curve(rng: Rng, kind: str, flat: bool) -> tuple[curves.Curve, Any, bool]:
    """A curve, what the file says of it, and whether it is closed [m]."""
    axes = np.eye(3) if flat else _frame(rng)
    start = rng.uniform(-0.5, 0.5, 3)
    if kind == "line":
        end = start + rng.uniform(0.05, 0.4) * axes[:, 0]
        return curves.Line(start, end), "line", False
    if kind == "points":
        bends = np.column_stack((np.arange(6.0), rng.uniform(-0.4, 0.4, (6, 2))))
        points = start + 10.0 ** rng.uniform(-1.7, -1.0) * bends @ axes.T
        return curves.Spline(points), {"points": points[1:-1].tolist()}, False
    radius = float(10.0 ** rng.uniform(-2.5, -1.0))
    normal, centre = axes[:, 2] * sign(rng), start - radius * axes[:, 0]
    if kind == "arc":
        arc = curves.Arc(start, centre, normal, rng.uniform(0.5, 5.5))
        middle = arc.at(np.array([arc.length * rng.uniform(0.3, 0.7)]))[0][0]
        keys: dict[str, Any] = {"through": middle.tolist()}
        if rng.random() < 0.5:
            keys = {"centre": centre.tolist(), "normal": normal.tolist()}
        return arc, {"arc": keys}, False
    turns = 0 if kind == "circle" else int(rng.integers(1, 4))
    arc = curves.Arc(start, centre, normal, 2.0 * math.pi * (1 + turns))
    keys = {"centre": centre.tolist(), "normal": normal.tolist(), "turns": turns}
    return arc, {"arc": keys}, True


def path_case(*kinds: str, loose: bool = False, ramps: float = 0.6) -> Callable[[Rng, Shelf], Case]:
    """A gantry that follows one curve from rest to rest.

    Args:
        kinds: Of curves: line, arc, circle, turns or points.
        loose: Whether the speed may be off by much.
        ramps: The greatest part of the length in which the speed changes.
    """

    def make(rng: Rng, shelf: Shelf) -> Case:
        kind = str(rng.choice(kinds))
        turning = str(rng.choice(["constant", "even", "tangent"]))
        flat = turning == "tangent" and kind != "points"
        curve, keys, closed = _curve(rng, kind, flat)
        row: dict[str, Any] = {"name": "end", "along": keys}
        rate = 0.0
        if flat and isinstance(curve, curves.Arc):
            row["orientation"] = "tangent"
            rate = float(curve.normal[2]) / curve.radius
        end = curve.at(np.array([curve.length]))[0][0]
        row["pose"] = {"position": (curve.at(np.zeros(1))[0][0] if closed else end).tolist()}
        if turning == "even" and not closed:
            turn = float(rng.uniform(-2.0, 2.0))
            rate = turn / curve.length
            row["pose"]["rpy"] = [0.0, 0.0, turn]
        speed = min(float(10.0 ** rng.uniform(-2.0, -0.5)), curve.length)
        if isinstance(curve, curves.Arc):  # within what drives can do
            speed = min(speed, 5.0 * curve.radius)
        acceleration = 1.5 * speed**2 / (curve.length * rng.uniform(0.2, ramps))
        row["speed"] = speed
        times = curves.timed([curve.length], [speed], (0.0, 0.0), acceleration, 0.0)
        stretch = curves.Stretch(
            curve, np.eye(3), np.array([0, 0, rate]), speed, *times[0], ("start", "end")
        )
        along = Along(curves.ToolPath([stretch]), closed, rate)
        part = float(rng.uniform(0.4, 0.6)) if loose else float(10.0 ** rng.uniform(-1.7, -1.0))
        distance = curve.length * 10.0 ** rng.uniform(-3.0, -2.0)
        if isinstance(curve, curves.Arc):  # much smaller than the arc
            distance = min(max(distance, 1e-4 * size(rng)), 0.2 * curve.radius)
        data = {
            "robot": gantry(shelf),
            "tool": {"frame": "head"},
            "path": {"acceleration": acceleration},
            "tolerances": {
                "path": distance,
                "path_orientation": 0.005,
                "path_speed": part,
            },
            "waypoints": [
                {
                    "name": "start",
                    "pose": {"position": curve.at(np.zeros(1))[0][0].tolist(), "rpy": [0, 0, 0]},
                },
                row,
            ],
        }
        return Case(data, along.motion(along.nominal), {"along": along, "part": part})

    return make


def _smooth(u: np.ndarray) -> np.ndarray:
    """From 0 to 1, with four derivatives that are zero at both ends."""
    u = np.clip(u, 0.0, 1.0)
    return np.asarray(u**5 * (126 - 420 * u + 540 * u**2 - 315 * u**3 + 70 * u**4))


def _hump(u: np.ndarray) -> np.ndarray:
    """Up to 1 in the middle of 0 to 1, and down again."""
    u = np.clip(u, 0.0, 1.0)
    return np.asarray((4.0 * u * (1.0 - u)) ** 4)


HUMP_SLOPE = 3.81
"""The greatest slope of a hump, and a little more."""


def _within(along: Along, rng: Rng, least: float = 0.4) -> tuple[float, float]:
    """An interval of time within the window of full speed [s]."""
    low, high = along.stretch.full
    width = (high - low) * rng.uniform(least, 1.0)
    begin = rng.uniform(low, high - width)
    return begin, begin + width


def _spoiled(case: Case, way: Way, knots: int = 3 * KNOTS) -> Case:
    return case.with_motion(case.extra["along"].motion(way, knots))


def distance(case: Case, rng: Rng, shelf: Shelf) -> Case:
    """Beside the path, square to it or nearly so, for a while."""
    along = case.extra["along"]
    one, tolerance = along.stretch, case.data["tolerances"]["path"]
    half = 0.5 * (one.end - one.start) * rng.uniform(0.2, 0.9)
    middle = rng.uniform(one.start + half, one.end - half)
    s = along.nominal(np.array([middle]))
    T = along.path.at(s)[1][0]
    aside = np.cross(T, rng.normal(size=3))
    aside /= np.linalg.norm(aside)
    off = tolerance * size(rng, 1.0)
    if isinstance(one.curve, curves.Arc):
        off = min(off, 0.3 * one.curve.radius)
    motion = case.motion
    for j in range(3):
        motion = bumped(motion, j, middle, half, off * aside[j])
    return case.with_motion(motion)


def orientation(case: Case, rng: Rng, shelf: Shelf) -> Case:
    one = case.extra["along"].stretch
    half = 0.5 * (one.end - one.start) * rng.uniform(0.05, 0.9)
    middle = rng.uniform(one.start + half, one.end - half)
    off = sign(rng) * min(0.005 * size(rng, 2.5), 2.5)
    return case.with_motion(bumped(case.motion, 3, middle, half, off))


def speed(case: Case, rng: Rng, shelf: Shelf) -> Case:
    """Too fast or too slow within the window of full speed, never backwards."""
    along = case.extra["along"]
    low, high = _within(along, rng)
    part = min(case.extra["part"] * size(rng, 1.0, least=2.0), 0.95)
    rise = sign(rng) * part * along.stretch.speed * (high - low) / HUMP_SLOPE
    return _spoiled(case, lambda t: along.nominal(t) + rise * _hump((t - low) / (high - low)))


def backwards(case: Case, rng: Rng, shelf: Shelf) -> Case:
    """Ahead and back for a while within the window of full speed, always on the path."""
    along = case.extra["along"]
    one = along.stretch
    low = one.full[0] + rng.uniform(0.0, 0.4) * (one.full[1] - one.full[0])
    room = one.speed * (one.full[1] - low)
    rise = room * rng.uniform(0.1, 0.35)
    width = rise * rng.uniform(0.3, 1.5) / one.speed
    return _spoiled(case, lambda t: along.nominal(t) + rise * _hump((t - low) / width))


def there_and_back(case: Case, rng: Rng, shelf: Shelf) -> Case:
    """A closed path that is never gone around: a part of it, and back; and so the other way."""
    along = case.extra["along"]
    one, around = along.stretch, 2.0 * math.pi * along.stretch.curve.radius
    far, both = around * rng.uniform(0.02, 0.6), rng.random() < 0.5
    far *= sign(rng) if both else 1.0

    def way(t: np.ndarray) -> np.ndarray:
        u = (t - one.start) / (one.end - one.start)
        if both:
            return np.asarray(far * (_hump(2.0 * u) - _hump(2.0 * u - 1.0)))
        return np.asarray(far * _smooth(2.0 * u) * _smooth(2.0 - 2.0 * u))

    return _spoiled(case, way)


def other_way_round(case: Case, rng: Rng, shelf: Shelf) -> Case:
    along = case.extra["along"]
    turned = replace(along, rate=-along.rate)  # so that the tool turns as required
    return case.with_motion(turned.motion(lambda t: -along.nominal(t), KNOTS))


def turns(case: Case, rng: Rng, shelf: Shelf) -> Case:
    """Whole turns too many or too few, at nearly the speed: its tolerance is large here."""
    along = case.extra["along"]
    around = 2.0 * math.pi * along.stretch.curve.radius
    turns = round(along.path.length / around)
    most = case.extra["part"] * 0.9
    choices = [k for k in range(1, 2 * turns + 1) if k != turns and abs(k / turns - 1) < most]
    count = float(rng.choice(choices)) if choices else turns - 1.0
    return _spoiled(case, lambda t: count / turns * along.nominal(t), KNOTS)


class Ramp:
    """Where the speed changes at one end of a path.

    Attributes:
        length: How far the tool gets in its time at full speed [m].
    """

    def __init__(self, along: Along, rng: Rng) -> None:
        self.along, one = along, along.stretch
        self.at_end = bool(rng.integers(2))
        self.rest = one.end if self.at_end else one.start
        self.duration = one.end - one.full[1] if self.at_end else one.full[0] - one.start
        self.length = one.speed * self.duration

    def since(self, t: np.ndarray) -> np.ndarray:
        """Time from rest on, as a part of that of the ramp."""
        return (self.rest - t if self.at_end else t - self.rest) / self.duration

    def instead(self, way: Way) -> Way:
        """Progress as required except in the ramp, where it is another one from rest [m]."""

        def progress(t: np.ndarray) -> np.ndarray:
            since = self.since(t)
            gone = self.along.path.length - way(since) if self.at_end else way(since)
            return np.where(since < 1.0, gone, self.along.nominal(t))

        return progress


def ramp_too_fast(case: Case, rng: Rng, shelf: Shelf) -> Case:
    """At rest for too long at an end of the path, so that full speed is exceeded beside it."""
    ramp = Ramp(case.extra["along"], rng)
    late = rng.uniform(0.5, 0.75)

    def way(since: np.ndarray) -> np.ndarray:
        """From rest to full speed, at the place where it is to have it."""
        u = np.clip((since - late) / (1.0 - late), 0.0, 1.0)
        share = 0.5 * (10 * u**3 - 15 * u**4 + 6 * u**5)
        return ramp.length * (share + (1.0 - late) * (-4 * u**3 + 7 * u**4 - 3 * u**5))

    return _spoiled(case, ramp.instead(way))


def ramp_backwards(case: Case, rng: Rng, shelf: Shelf) -> Case:
    """Ahead and back where the speed changes, always on the path."""
    along = case.extra["along"]
    ramp = Ramp(along, rng)
    rise = 0.5 * ramp.length * rng.uniform(0.7, 1.5) * (-1.0 if ramp.at_end else 1.0)
    return _spoiled(case, lambda t: along.nominal(t) + rise * _hump(ramp.since(t)))


def ramp_slowly_back(case: Case, rng: Rng, shelf: Shelf) -> Case:
    """Ahead, back and ahead where the speed changes, never faster than full speed."""
    ramp = Ramp(case.extra["along"], rng)
    ahead, back, half = 0.9, rng.uniform(0.3, 0.8), 0.12
    # middles of the changes of speed: after the last one the tool is where it is required to be
    first, second = 0.13, 0.38
    third = 1.0 - (0.5 - ahead * (second - first) + back * (1.0 - second)) / (1.0 + back)
    changes = ((first, ahead), (second, -ahead - back), (third, 1.0 + back))

    def way(since: np.ndarray) -> Any:
        return ramp.length * sum(by * covered(since, at - half, at + half) for at, by in changes)

    return _spoiled(case, ramp.instead(way))


CLOSED = path_case("circle", "turns", ramps=0.98)
ANY = path_case("line", "arc", "circle", "turns", "points")
AROUND = {"path", "progress", "direction", "speed", "orientation", "pose"}
SAMPLES = 300
FAULTS = {
    name: Fault(right, spoil, kinds, count, SAMPLES)
    for name, right, spoil, kinds, count in (
        ("distance from a path", ANY, distance, {"path", "speed", "orientation"}, 110),
        ("orientation along a path", ANY, orientation, {"orientation"}, 110),
        ("speed along a path", ANY, speed, {"speed"}, 180),
        ("back within a path", ANY, backwards, {"direction", "speed"}, 130),
        ("a ramp too fast", ANY, ramp_too_fast, {"speed"}, 70),
        ("a ramp with a way back", ANY, ramp_backwards, {"direction", "speed"}, 25),
        ("a ramp slowly back", ANY, ramp_slowly_back, {"direction"}, 25),
        ("there and back, for a circle", CLOSED, there_and_back, AROUND, 130),
        ("a circle the other way round", CLOSED, other_way_round, AROUND, 50),
        ("turns too many or too few", path_case("turns", loose=True), turns, AROUND, 100),
    )
}
# a fast way back may jump
FAULTS["back within a path"] = FAULTS["back within a path"]._replace(beside={"jump"})
