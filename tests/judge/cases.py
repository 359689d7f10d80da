"""Cases: tasks with motions that meet them, from which one fault each is made.

A task is written from its motion, so that it is right by construction: waypoints are read off.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from judge.arm import Arm
from judge.motion import Motion

Rng = np.random.Generator

# Cubic B-spline, quadratic one, hat and box: pieces in their own time, the highest power first.
_PIECES = {
    3: np.array([[1, 0, 0, 0], [-3, 3, 3, 1], [3, -6, 0, 4], [-1, 3, -3, 1]]) / 4.0,
    2: np.array([[0, 1, 0, 0], [0, -2, 2, 1], [0, 1, -2, 1]]) / 1.5,
    1: np.array([[0, 0, 1, 0], [0, 0, -1, 1]]) / 1.0,
    0: np.array([[0, 0, 0, 1]]) / 1.0,
}


@dataclass(frozen=True)
class Case:
    """A task, and a motion for it.

    Attributes:
        data: What the scenario's file says.
        motion: Of its joints.
        extra: What the faults of this kind of case need to know.
    """

    data: dict[str, Any]
    motion: Motion
    extra: dict[str, Any] = field(default_factory=dict)

    def with_data(self, change: Mapping[str, Any]) -> Case:
        return replace(self, data={**copy.deepcopy(self.data), **change})

    def with_motion(self, motion: Motion) -> Case:
        return replace(self, motion=motion)


@dataclass(frozen=True)
class Shelf:
    """Where files of cases are put, and arms that were read once."""

    folder: Path
    arms: dict[str, Arm] = field(default_factory=dict)

    def arm(self, robot: str) -> Arm:
        if robot not in self.arms:
            self.arms[robot] = Arm(robot, self.folder, {}, 1.0, 1.0, None)
        return self.arms[robot]


class Fault(NamedTuple):
    """A kind of fault.

    Attributes:
        right: Makes a right case.
        spoil: Makes one wrong of it.
        kinds: What the judge finds then, one at least, and nothing else.
        count: How many are made.
        samples: How densely the judge looks at limits that it samples.
        collisions: Whether the judge looks for these.
        beside: What the judge may find too, where the fault is large.
    """

    right: Callable[[Rng, Shelf], Case]
    spoil: Callable[[Case, Rng, Shelf], Case]
    kinds: set[str]
    count: int
    samples: int = 1000
    collisions: bool = False
    beside: Collection[str] = ()


def size(rng: Rng, decades: float = 3.0, least: float = 1.5) -> float:
    """How many times a tolerance a fault is: over orders of magnitude, from `least` on."""
    return least * 10.0 ** rng.uniform(0.0, decades)


def sign(rng: Rng) -> float:
    return float(rng.choice([-1.0, 1.0]))


def shifted(c: np.ndarray, by: np.ndarray) -> np.ndarray:
    """Coefficients c[k, m, d] about points that are `by` later, shape (m,)."""
    c = np.array(c)
    for last in range(len(c) - 1, 0, -1):
        for r in range(1, last + 1):
            c[r] += c[r - 1] * by[:, None]
    return c


def on_breaks(motion: Motion, x: np.ndarray) -> Motion:
    """The same motion with more breaks."""
    x = np.unique(np.concatenate((motion.x, x[(x > motion.x[0]) & (x < motion.x[-1])])))
    piece = np.clip(np.searchsorted(motion.x, x[:-1], "right") - 1, 0, len(motion.x) - 2)
    return Motion(motion.names, x, shifted(motion.c[:, piece], x[:-1] - motion.x[piece]))


def disguised(motion: Motion, rng: Rng) -> Motion:
    """The same motion with breaks beside its breaks and anywhere, and leading zeros."""
    gap, at = 10.0 ** rng.uniform(-14, -3), rng.uniform(motion.x[0], motion.x[-1], 5)
    sides = rng.choice([-1.0, 1.0], len(motion.x))
    close = at + 10.0 ** rng.uniform(-15, -3, 5)
    motion = on_breaks(motion, np.concatenate((motion.x + gap * sides, at, close)))
    zeros = np.zeros((int(rng.choice([0, 1, 5, 200])), *motion.c.shape[1:]))
    return Motion(motion.names, motion.x, np.concatenate((zeros, motion.c)))


def bumped(
    motion: Motion, joint: int, middle: float, width: float, height: float, degree: int = 3
) -> Motion:
    """The motion and a bump: of degree 3 it is twice continuously differentiable, of 0 a step.

    Args:
        motion: What it is added to, of degree 3.
        joint: Which joint.
        middle: Of the bump [s].
        width: Half of it [s].
        height: In the middle [rad or m].
        degree: Of its pieces.
    """
    pieces = _PIECES[degree]
    x = middle + width * np.linspace(-1.0, 1.0, len(pieces) + 1)
    step = 2.0 * width / len(pieces)
    motion = on_breaks(motion, x)
    c = np.array(motion.c)
    if len(c) < 4:
        c = np.concatenate((np.zeros((4 - len(c), *c.shape[1:])), c))
    scale = height / step ** np.arange(3, -1, -1.0)
    middles = 0.5 * (motion.x[:-1] + motion.x[1:])
    for k in np.flatnonzero((middles > x[0]) & (middles < x[-1])):
        i = min(int(np.searchsorted(x, middles[k])) - 1, len(pieces) - 1)
        own = (pieces[i] * scale)[:, None, None]
        c[-4:, k, joint] += shifted(own, np.array([motion.x[k] - x[i]]))[:, 0, 0]
    return Motion(motion.names, motion.x, c)


def swung(motion: Motion, joint: int, middle: float, width: float, slope: float) -> Motion:
    """The motion and a swing that has a slope [rad/s or m/s] and no height in its middle."""
    # a bump of half the width on each side; their slopes there add up
    h = width / 3.0
    height = slope * h / 1.5
    once = bumped(motion, joint, middle + h, 2.0 * h, height)
    return bumped(once, joint, middle - h, 2.0 * h, -height)


def uniform_spline(names: tuple[str, ...], controls: np.ndarray, step: float) -> Motion:
    """A uniform cubic B-spline from time 0; four equal controls in a row make it stand still.

    Args:
        names: Of the joints.
        controls: Shape (m + 3, d).
        step: Of its knots [s].
    """
    basis = np.array([[-1, 3, -3, 1], [3, -6, 3, 0], [-3, 0, 3, 0], [1, 4, 1, 0]]) / 6.0
    m = len(controls) - 3
    windows = np.stack([controls[k : k + m] for k in range(4)])
    c = np.einsum("pk,kmd->pmd", basis, windows)
    same = (windows == windows[0]).all(axis=0)  # exactly still, whatever rounding makes of it
    c[:3] *= ~same
    c[3] = np.where(same, windows[0], c[3])
    c /= step ** np.arange(3, -1, -1.0)[:, None, None]
    return Motion(names, step * np.arange(m + 1.0), c)


def wandering(
    rng: Rng, names: tuple[str, ...], middle: np.ndarray, reach: np.ndarray
) -> tuple[Motion, tuple[float, float]]:
    """A random motion about a place, from rest to rest, that waits once: and when it does [s]."""
    d, step = len(names), float(10.0 ** rng.uniform(-0.7, 0.0))
    before, after = (int(rng.integers(3, 6)) for _ in range(2))
    parts = [1 * 3, before, int(rng.integers(4, 7)), after, 3]
    places = middle + reach * rng.uniform(-1.0, 1.0, (before + after + 3, d))
    rows = [places[0]] * parts[0]
    rows += list(places[1 : 1 + before])
    rows += [places[1 + before]] * parts[2]
    rows += list(places[2 + before : 2 + before + after])
    rows += [places[-1]] * parts[4]
    first = parts[0] + before
    wait = step * first, step * (first + parts[2] - 3)
    return uniform_spline(names, np.array(rows), step), wait


def between(motion: Motion, wait: tuple[float, float], rng: Rng) -> list[float]:
    """Times of waypoints: the ends, when the wait begins, and some that are passed."""
    inner = motion.x[1:-1]
    away = (inner < wait[0] - 1e-6) | (inner > wait[1] + 1e-6)
    passed = rng.choice(inner[away], size=min(2, int(away.sum())), replace=False)
    return sorted([float(motion.x[0]), wait[0], float(motion.x[-1]), *map(float, passed)])


def joint_case(rng: Rng, shelf: Shelf) -> Case:
    """Bare joints through joint values, with a wait."""
    d = int(rng.integers(1, 4))
    names = tuple(f"joint {i + 1}" for i in range(d))
    motion, wait = wandering(rng, names, rng.normal(size=d), 10.0 ** rng.uniform(-1, 0.5, d))
    mm, deg = bool(rng.integers(2)), bool(rng.integers(2))
    slides = rng.random(d) < 0.3
    scale = np.where(slides, 1e-3 if mm else 1.0, math.pi / 180 if deg else 1.0)
    data: dict[str, Any] = {
        "units": {"length": "mm" if mm else "m", "angle": "deg" if deg else "rad"},
        "joint_units": {n: "m" if one else "rad" for n, one in zip(names, slides, strict=True)},
        "end_acceleration": "zero",
        "waypoints": [],
    }
    times = between(motion, wait, rng)
    case = Case(data, motion, {"scale": scale, "wait": wait, "times": times})
    return written(case, motion)


def written(case: Case, motion: Motion) -> Case:
    """The case with its waypoints read off a motion of its joints."""
    scale, wait = case.extra["scale"], case.extra["wait"]
    rows: list[dict[str, Any]] = []
    for t in case.extra["times"]:
        row: dict[str, Any] = {"time": float(t), "joints": _mapping(motion, motion(t) / scale)}
        velocity = motion(t, 1) / scale
        if t == wait[0]:
            row["wait"] = float(wait[1] - wait[0])
        elif velocity.any():
            row["velocity"] = _mapping(motion, velocity)
        elif t != motion.x[0] and t != motion.x[-1]:
            row["stop"] = True
        rows.append(row)
    return case.with_data({"waypoints": rows}).with_motion(motion)


def _mapping(motion: Motion, values: np.ndarray) -> dict[str, float]:
    return {name: float(one) for name, one in zip(motion.names, values, strict=True)}


ARMS = {"ur5": 0.25, "panda": 0.2, "planar2": 0.4, "xarm7": 0.2, "ur10": 0.25}
"""Arms, and how far their joints wander about home [rad]."""


def arm_case(rng: Rng, shelf: Shelf) -> Case:
    """An arm through poses of its tool, of which collisions are not looked at."""
    robot = str(rng.choice(list(ARMS)))
    arm = shelf.arm(robot)
    home = arm.configurations["home"]
    motion, wait = wandering(rng, arm.names, home, np.full(len(home), ARMS[robot]))
    mm = bool(rng.integers(2))
    data = {
        "units": {"length": "mm" if mm else "m"},
        "robot": robot,
        "collisions": {"self": False},
        # so that limits of the arm itself do not matter
        "limits": {"velocity": 100.0, "acceleration": 1e4, "jerk": 1e6, "effort": 1e5},
        "waypoints": [],
    }
    times = between(motion, wait, rng)
    case = Case(data, motion, {"length": 1e-3 if mm else 1.0, "wait": wait, "times": times})
    return posed(case, arm)


def posed(case: Case, arm: Arm) -> Case:
    """The case with the poses and velocities of its tool read off its motion."""
    motion, length, wait = case.motion, case.extra["length"], case.extra["wait"]
    times = np.array(case.extra["times"])
    q, v = motion(times), motion(times, 1)
    rows: list[dict[str, Any]] = []
    poses, twists = arm.poses(q), arm.velocities(q, v)
    for t, pose, twist in zip(times, poses, twists, strict=True):
        row: dict[str, Any] = {
            "time": float(t),
            "pose": {
                "position": (pose.translation / length).tolist(),
                "rotation_matrix": pose.rotation.tolist(),
            },
        }
        if t == wait[0]:
            row["wait"] = float(wait[1] - wait[0])
        elif motion(t, 1).any():
            linear, angular = (twist[:3] / length).tolist(), twist[3:].tolist()
            row["velocity"] = {"linear": linear, "angular": angular}
        rows.append(row)
    return case.with_data({"waypoints": rows})
