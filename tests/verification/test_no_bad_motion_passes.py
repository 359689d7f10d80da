"""Bad motions by many recipes, each fault just beyond what is allowed: none may pass the check.

A motion of many joints is made sound and then disguised: spikes, pieces of high degree, pieces of a
nanosecond and of minutes, breaks next to breaks, padding. Every joint gets a fault of its own, and
every joint must fail for that very fault. Without the faults the same motions pass.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

import knotwork as kw

Rng = np.random.Generator
JOINTS = 20
ORDINARY, EXHAUSTIVE, PARTS = 30, 5_000, 20
NAMES = tuple(f"joint {i}" for i in range(JOINTS))
LIMITED = ("position", "velocity", "acceleration", "jerk")
# What the check must never let through, whatever the motion: jumps, and changes within a piece.
JUMPS = (1e-9, 1e-7, 1e-5)
FASTEST = (1e3, 1e5, 1e6)
EPSILON = float(np.finfo(float).eps)


def moved(c: np.ndarray, by: np.ndarray) -> np.ndarray:
    """Coefficients c[k, m, d] about points that are `by` later, shape (m,)."""
    c, late = np.array(c), np.flatnonzero(by)
    first = int(c.reshape(len(c), -1).any(axis=1).argmax())  # after the leading zeros
    part = c[first:, late]
    for last in range(len(part) - 1, 0, -1):
        for r in range(1, last + 1):
            part[r] += part[r - 1] * by[late, None]
    c[first:, late] = part
    return c


def hump(power: int) -> np.ndarray:
    """(4 u (1 - u))^power, which with power - 1 derivatives is zero at both ends of a piece."""
    shape = np.array([1.0])
    for _ in range(power):
        shape = np.polymul(shape, [-4.0, 4.0, 0.0])
    return shape


def peak_of(shape: np.ndarray, order: int) -> float:
    """Largest value of a derivative on [0, 1], found by samples: at most a little too small."""
    return float(np.abs(np.polyval(np.polyder(shape, order), np.linspace(0, 1, 2001))).max())


HUMPS = {power: hump(power) for power in range(4, 13)}
PEAKS = {power: [peak_of(HUMPS[power], order) for order in range(5)] for power in HUMPS}


@dataclass
class Motion:
    """Joints in motion: pieces in local time, and what the scenario asks for.

    Attributes:
        expected: What each spoiled joint must fail for: subject, name and quantity of a finding.
    """

    x: np.ndarray
    y: np.ndarray
    v: np.ndarray
    c: np.ndarray
    breaks: np.ndarray
    stairs: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=int))
    quick: int | None = None
    continuity: int = 2
    limits: dict[str, dict[str, Any]] = field(default_factory=dict)
    expected: dict[int, tuple[str, str, str]] = field(default_factory=dict)

    def divide(self, at: np.ndarray) -> None:
        x = np.unique(np.concatenate([self.breaks, at]))
        x = x[(x >= self.breaks[0]) & (x <= self.breaks[-1])]
        piece = np.searchsorted(self.breaks, x[:-1], side="right") - 1
        self.c = moved(self.c[:, piece], x[:-1] - self.breaks[piece])
        self.breaks = x

    def add(self, k: int, joint: int, shape: np.ndarray) -> None:
        """Add a polynomial of the unit variable to a piece of a joint."""
        missing = shape.size - len(self.c)
        if missing > 0:
            self.c = np.concatenate([np.zeros((missing, *self.c.shape[1:])), self.c])
        span = self.breaks[k + 1] - self.breaks[k]
        self.c[-shape.size :, k, joint] += shape / span ** np.arange(shape.size - 1.0, -1.0, -1.0)

    def values(self, joint: int, order: int) -> np.ndarray:
        """A derivative at some times in every piece and at both its ends."""
        s = np.linspace(0.0, 1.0, 17)[:, None] * np.diff(self.breaks)
        c = self.c[:, :, joint]
        for _ in range(order):
            c = c[:-1] * np.arange(len(c) - 1, 0, -1.0)[:, None]
        value = np.zeros_like(s)
        for row in c:
            value = value * s + row
        return value

    def report(self) -> kw.Report:
        curve = kw.PiecewisePolynomial(self.c, self.breaks)
        points = [
            {
                "time": float(t),
                "joints": dict(zip(NAMES, y.tolist(), strict=True)),
                "velocity": dict(zip(NAMES, v.tolist(), strict=True)),
            }
            for t, y, v in zip(self.x, self.y, self.v, strict=True)
        ]
        asked = {"waypoints": points, "limits": self.limits, "continuity": self.continuity}
        return kw.check(kw.JointTrajectory(NAMES, curve), kw.load_scenario(asked))


def sound(rng: Rng) -> Motion:
    """A modified Hermite spline through random waypoints, with breaks at these as well."""
    n = int(rng.integers(3, 7))
    spans = rng.uniform(0.3, 2.0, n) * rng.choice([0.3, 1.0, 6.0], size=n if n < 5 else 1)
    x = np.cumsum(spans) + rng.choice([0.0, -2.0, 300.0])
    size = 10.0 ** rng.uniform(-3, 0.5, JOINTS)
    y = rng.normal(size=(n, JOINTS)) * size + rng.choice([0.0, 5.0], size=JOINTS)
    v = rng.normal(size=(n, JOINTS)) * 0.5 * size
    spline = kw.ModifiedHermiteSpline(x, y, v)
    motion = Motion(x, y, v, np.array(spline.c), np.array(spline.x))
    motion.divide(x)
    peaks = [max(np.abs(motion.values(j, nu)).max() for j in range(JOINTS)) for nu in (1, 2, 3)]
    # short intervals beside long ones can make it too fast for any drive
    return motion if (np.array(peaks) < 0.3 * np.array(FASTEST)).all() else sound(rng)


def shaped(motion: Motion, rng: Rng) -> None:
    """Spikes and waves of any width, height and degree, each as smooth as the motion.

    What the rounding of their coefficients makes stays below what counts as a jump.
    """
    peaks = [[np.abs(motion.values(j, order)).max() for order in range(3)] for j in range(JOINTS)]
    for _ in range(int(rng.integers(3))):
        k = int(rng.integers(motion.breaks.size - 1))
        start, span = motion.breaks[k], motion.breaks[k + 1] - motion.breaks[k]
        if rng.random() < 0.7:
            width = span * 10.0 ** rng.uniform(-3, -1)
            start = start + span * rng.uniform(0.1, 0.8)
            motion.divide(np.array([start, start + width]))
            k = int(np.searchsorted(motion.breaks, start))
            span = motion.breaks[k + 1] - start
        for joint in np.flatnonzero(rng.random(JOINTS) < 0.5):
            power = int(rng.integers(4, 13))
            jerk = 10.0 ** rng.uniform(-2, 5)
            height = min(jerk * span**3 / PEAKS[power][3], 10.0)
            for order, (peak, counts) in enumerate(zip(peaks[joint], JUMPS, strict=True)):
                rounding = EPSILON * 8.0**power * (2.0 * power / span) ** order
                height = min(height, min(1e-10 * peak, 0.01 * counts) / rounding)
            motion.add(k, int(joint), rng.choice([-1, 1]) * height * HUMPS[power])


def laid_out(motion: Motion, rng: Rng) -> None:
    """Pieces for faults to stand in: a quick one, and sometimes many next to one another."""
    k = int(rng.integers(1, motion.breaks.size - 1))
    start, span = motion.breaks[k], motion.breaks[k + 1] - motion.breaks[k]
    width = min(10.0 ** rng.uniform(-8, -1), span / 4.0)
    motion.divide(np.array([start + span / 2.0, start + span / 2.0 + width]))
    motion.quick = k + 1
    if rng.random() < 0.2:
        steps = 2 * int(rng.integers(50, 150))
        k = int(rng.integers(1, motion.breaks.size - 1))
        start = motion.breaks[k]
        motion.divide(start + 2.0**-36 * np.arange(1, steps + 1))
        if k <= motion.quick:
            motion.quick += steps
        motion.stairs = np.arange(k, k + steps)


def jump(motion: Motion, joint: int, rng: Rng) -> bool:
    """A derivative jumps at a break; the next one takes it back."""
    order = int(rng.integers(motion.continuity + 1))
    k = int(rng.integers(1, motion.breaks.size - 1))
    size = JUMPS[order] * (1.01 + 10.0 ** rng.uniform(-2, 5))
    motion.c[-1 - order, k, joint] += rng.choice([-1, 1]) * size / (1, 1, 2)[order]
    motion.expected[joint] = ("joint", NAMES[joint], f"{LIMITED[order]}_jump")
    return True


def stairs(motion: Motion, joint: int, rng: Rng) -> bool:
    """Many jumps next to one another, up and down again, each of which is negligible."""
    if not motion.stairs.size:
        return False
    order = int(rng.integers(motion.continuity + 1))
    half = motion.stairs.size // 2
    up = np.concatenate([np.arange(1, half + 1), np.arange(half - 1, -1, -1)])
    step = JUMPS[order] * rng.uniform(1.01, 1.5) / (2 * half)
    motion.c[-1 - order, motion.stairs, joint] += up * step / (1, 1, 2)[order]
    motion.expected[joint] = ("joint", NAMES[joint], f"{LIMITED[order]}_jump")
    return True


def quick(motion: Motion, joint: int, rng: Rng) -> bool:
    """Smooth as mathematics has it, but within one piece faster than any drive."""
    if motion.quick is None:
        return False
    order = int(rng.integers(motion.continuity + 1))
    span = motion.breaks[motion.quick + 1] - motion.breaks[motion.quick]
    power = int(rng.integers(4, 9))
    now = float(np.abs(motion.values(joint, order + 1)).max())
    wanted = FASTEST[order] * rng.uniform(1.01, 3.0) + now
    height = wanted * span ** (order + 1) / PEAKS[power][order + 1]
    motion.add(motion.quick, joint, rng.choice([-1, 1]) * height * HUMPS[power])
    motion.expected[joint] = ("joint", NAMES[joint], f"{LIMITED[order]}_jump")
    return True


def limit(motion: Motion, joint: int, rng: Rng) -> bool:
    """A limit is below the peak by a hair."""
    order = int(rng.integers(4))
    values = motion.values(joint, order)
    low, high = float(values.min()), float(values.max())
    hair = 2e-9 + 10.0 ** rng.uniform(-9, -3)
    if order == 0:
        far = 10.0 ** rng.uniform(-3, 3)
        lower, upper = low - far, high - hair * max(1.0, abs(high))
        if rng.random() < 0.5:
            lower, upper = low + hair * max(1.0, abs(low)), high + far
        if not lower < upper:
            return False
        motion.limits.setdefault("position", {})[NAMES[joint]] = [lower, upper]
    else:
        peak = max(-low, high)
        allowed = peak - hair * max(1.0, peak)
        if allowed <= 0.0:
            return False
        motion.limits.setdefault(LIMITED[order], {})[NAMES[joint]] = allowed
    motion.expected[joint] = ("joint", NAMES[joint], LIMITED[order])
    return True


def waypoint(motion: Motion, joint: int, rng: Rng) -> bool:
    """A waypoint asks for what is off by more than the tolerance; each for one joint alone."""
    i, order = int(rng.integers(motion.x.size)), int(rng.integers(2))
    mark = ("waypoint", f"waypoint {i + 1}", f"joint_{LIMITED[order]}")
    if mark in motion.expected.values():
        return False
    target = motion.y if order == 0 else motion.v
    target[i, joint] += rng.choice([-1, 1]) * 1e-6 * (1.001 + 10.0 ** rng.uniform(-3, 4))
    motion.expected[joint] = mark
    return True


def beside(motion: Motion, rng: Rng) -> None:
    """Breaks next to the breaks there are, at any distance."""
    gap = 10.0 ** rng.uniform(-14, -3)
    inner = motion.breaks[1:-1]
    sides = [inner + gap, inner - gap, np.concatenate([inner - gap, inner + gap])]
    motion.divide(sides[rng.integers(3)])


def scattered(motion: Motion, rng: Rng) -> None:
    """Breaks anywhere, some of them next to one another."""
    at = rng.uniform(motion.breaks[0], motion.breaks[-1], 5)
    motion.divide(np.concatenate([at, at + 10.0 ** rng.uniform(-15, -3, 5)]))


def padded(motion: Motion, rng: Rng) -> None:
    """Leading zeros."""
    rows = int(rng.choice([1, 5, 200]))
    motion.c = np.concatenate([np.zeros((rows, *motion.c.shape[1:])), motion.c])


FAULTS: tuple[Callable[[Motion, int, Rng], bool], ...] = (jump, stairs, quick, limit, waypoint)
DISGUISES: tuple[Callable[[Motion, Rng], None], ...] = (beside, scattered, padded)


def made(seed: int, *, spoiled: bool) -> Motion:
    """The motion of a seed, disguised, with a fault in every joint or with none."""
    rng = np.random.default_rng(seed)
    motion = sound(rng)
    motion.continuity = int(rng.choice([0, 1, 2, 2, 2]))
    shaped(motion, rng)
    laid_out(motion, rng)
    faults = np.random.default_rng((seed, 1))
    for joint in range(JOINTS if spoiled else 0):
        while not FAULTS[faults.integers(len(FAULTS))](motion, joint, faults):
            pass
    for i in rng.integers(len(DISGUISES), size=rng.integers(1, 4)):
        DISGUISES[i](motion, rng)
    return motion


def passed(seeds: range) -> list[tuple[int, int, tuple[str, str, str]]]:
    """The joints of bad motions that do not fail for what is wrong with them."""
    found = []
    for seed in seeds:
        motion = made(seed, spoiled=True)
        failed = {(one.subject, one.name, one.quantity) for one in motion.report().failures}
        found += [
            (seed, joint, mark) for joint, mark in motion.expected.items() if mark not in failed
        ]
        assert len(motion.expected) == JOINTS
    return found


def failing(seeds: range) -> list[tuple[int, str]]:
    """The motions that do not pass though nothing has been spoiled."""
    reports = ((seed, made(seed, spoiled=False).report()) for seed in seeds)
    return [(seed, str(report.failures[0])) for seed, report in reports if not report.ok]


def test_the_motions_pass_unless_they_are_spoiled() -> None:
    assert failing(range(ORDINARY)) == []


def test_no_bad_motion_passes() -> None:
    assert passed(range(ORDINARY)) == []


@pytest.mark.exhaustive
@pytest.mark.parametrize("part", range(PARTS))
def test_none_of_a_hundred_thousand_bad_joints_passes(part: int) -> None:
    """`EXHAUSTIVE` motions of `JOINTS` joints; every tenth of them passes without its faults."""
    share = EXHAUSTIVE // PARTS
    seeds = range(ORDINARY + part * share, ORDINARY + (part + 1) * share)
    assert passed(seeds) == []
    assert failing(seeds[::10]) == []
