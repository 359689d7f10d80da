"""Bad motions by many recipes, each with a fault just beyond what is allowed: none may pass.

A sound motion is spoiled by one fault, and the fault is then hidden: pieces are divided at odd
places, coefficients padded, spikes put elsewhere. Each recipe says what it broke.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import knotwork as kw

Rng = np.random.Generator
ORDINARY, EXHAUSTIVE = 150, 4_000
LIMITED = ("position", "velocity", "acceleration", "jerk")


class Spoiled:
    """A motion of one joint being spoiled: pieces in local time, and what its scenario asks for."""

    def __init__(self, rng: Rng) -> None:
        n = int(rng.integers(3, 7))
        self.x = np.cumsum(rng.uniform(0.3, 2.0, n)) + rng.choice([0.0, -2.0, 300.0])
        self.y = rng.normal(size=n) + rng.choice([0.0, 5.0])
        self.v = rng.normal(size=n) * 0.5
        spline = kw.ModifiedHermiteSpline(self.x, self.y, self.v)
        self.c, self.breaks = np.array(spline.c), np.array(spline.x)
        self.limits: dict[str, Any] = {}
        self.continuity = 2

    def curve(self) -> kw.PiecewisePolynomial:
        return kw.PiecewisePolynomial(self.c[:, :, None], self.breaks)

    def scenario(self) -> kw.Scenario:
        points = [
            {"time": t, "joints": {"turn": y}, "velocity": {"turn": v}}
            for t, y, v in zip(self.x.tolist(), self.y.tolist(), self.v.tolist(), strict=True)
        ]
        return kw.load_scenario(
            {"waypoints": points, "limits": self.limits, "continuity": self.continuity}
        )

    def passes(self) -> bool:
        try:
            trajectory = kw.JointTrajectory(("turn",), self.curve())
        except kw.InputError:
            return False  # refused
        return kw.check(trajectory, self.scenario()).ok

    def divide(self, at: np.ndarray) -> None:
        x = np.unique(np.concatenate([self.breaks, at]))
        x = x[(x >= self.breaks[0]) & (x <= self.breaks[-1])]
        piece = np.clip(
            np.searchsorted(self.breaks, x[:-1], side="right") - 1, 0, self.breaks.size - 2
        )
        self.c = moved(self.c[:, piece], x[:-1] - self.breaks[piece])
        self.breaks = x


def moved(c: np.ndarray, by: np.ndarray | float) -> np.ndarray:
    """Coefficients c[k, m] about points that are `by` later."""
    c = np.array(c)
    for last in range(len(c) - 1, 0, -1):
        for r in range(1, last + 1):
            c[r] += c[r - 1] * by
    return c


def jump(motion: Spoiled, rng: Rng) -> None:
    """A derivative jumps at a break that is no waypoint; the next break takes it back."""
    order = int(rng.integers(3))
    size = float(rng.choice([2e-9, 2e-7, 2e-5][order : order + 1])) * 10.0 ** rng.uniform(0, 5)
    k = int(rng.integers(1, motion.breaks.size - 1))
    motion.c[-1 - order, k] += rng.choice([-1, 1]) * size / (1, 1, 2)[order]
    motion.continuity = int(rng.integers(order, 3))


def ramp(motion: Spoiled, rng: Rng) -> None:
    """The acceleration changes within nanoseconds, in a piece of its own."""
    gap = 2.0 ** -float(rng.integers(24, 34))
    change = rng.uniform(0.5, 20.0)
    k = int(rng.integers(1, motion.breaks.size - 1))
    start = motion.breaks[k]
    motion.divide(np.array([start + gap]))
    gap = motion.breaks[k + 1] - start
    motion.c[0, k] += change / gap / 6.0
    motion.c[:, k + 1] = moved(motion.c[:, k : k + 1], gap)[:, 0]
    motion.c[0, k + 1] = 0.0


def stairs(motion: Spoiled, rng: Rng) -> None:
    """Many jumps next to one another, each of which is negligible."""
    steps = int(rng.integers(200, 400))
    gap = 2.0**-40
    k = int(rng.integers(1, motion.breaks.size - 1))
    start = motion.breaks[k]
    motion.divide(start + gap * np.arange(1, steps))
    step = 9e-6 * rng.uniform(0.5, 1.0)
    for i in range(1, steps):
        motion.c[1, k + i] += 0.5 * step * i


def limit(motion: Spoiled, rng: Rng) -> None:
    """A limit is set below the peak by a hair."""
    order = int(rng.integers(4))
    extrema = motion.curve().extrema(order)
    low, high = float(extrema.minimum[0]), float(extrema.maximum[0])
    hair = 10.0 ** rng.uniform(-8, -2)
    if order == 0:
        room = 1.0 if rng.random() < 0.5 else 1e3
        motion.limits = {"position": {"turn": [low - room, high - hair * max(1.0, abs(high))]}}
    else:
        peak = max(-low, high)
        motion.limits = {LIMITED[order]: {"turn": peak - hair * max(1.0, peak)}}


def waypoint(motion: Spoiled, rng: Rng) -> None:
    """A waypoint asks for what is off by more than the tolerance."""
    i = int(rng.integers(motion.x.size))
    target = motion.y if rng.random() < 0.5 else motion.v
    target[i] += rng.choice([-1, 1]) * 1.1e-6 * 10.0 ** rng.uniform(0, 4)


def bump(motion: Spoiled, rng: Rng) -> None:
    """A polynomial of high degree leaves a limit within one piece only."""
    k = int(rng.integers(motion.breaks.size - 1))
    power = int(rng.integers(3, 10))
    span = motion.breaks[k + 1] - motion.breaks[k]
    shape = np.array([1.0])
    for _ in range(power):
        shape = np.polymul(shape, np.array([-4.0, 4.0, 0.0]))
    shape = shape / span ** np.arange(2 * power, -1.0, -1.0)
    c = np.zeros((shape.size, motion.c.shape[1]))
    c[-motion.c.shape[0] :] = motion.c
    c[:, k] += shape * rng.uniform(5.0, 50.0)
    before = motion.curve().extrema(0)
    low, high = float(before.minimum[0]), float(before.maximum[0])
    motion.c = c
    motion.limits = {"position": {"turn": [low - 1e3, high + 1e-3]}}


def as_it_is(motion: Spoiled, rng: Rng) -> None:
    pass


def divided(motion: Spoiled, rng: Rng) -> None:
    """Breaks next to the breaks there are, at any distance."""
    gap = 10.0 ** rng.uniform(-14, -1)
    inner = motion.breaks[1:-1]
    sides = [inner + gap, inner - gap, np.concatenate([inner - gap, inner + gap])]
    motion.divide(sides[rng.integers(3)])


def scattered(motion: Spoiled, rng: Rng) -> None:
    """Breaks anywhere, some of them next to one another."""
    at = rng.uniform(motion.breaks[0], motion.breaks[-1], 5)
    motion.divide(np.concatenate([at, at + 10.0 ** rng.uniform(-15, -3, 5)]))


def padded(motion: Spoiled, rng: Rng) -> None:
    """Leading zeros."""
    rows = int(rng.choice([1, 5, 27, 200, 400]))
    motion.c = np.concatenate([np.zeros((rows, motion.c.shape[1])), motion.c])


def spiked(motion: Spoiled, rng: Rng) -> None:
    """A spike of any width and height elsewhere, as two pieces of its own."""
    k = int(rng.integers(motion.breaks.size - 1))
    span = motion.breaks[k + 1] - motion.breaks[k]
    start = motion.breaks[k] + span * rng.uniform(0.2, 0.7)
    half = 2.0 ** np.round(rng.uniform(-40, -4)) * span / 4
    motion.divide(np.array([start, start + half, start + 2 * half]))
    i = int(np.searchsorted(motion.breaks, start))
    height = 10.0 ** rng.uniform(-12, -4)
    if i + 2 < motion.breaks.size and motion.c.shape[0] >= 4:
        first = motion.breaks[i + 1] - motion.breaks[i]
        second = motion.breaks[i + 2] - motion.breaks[i + 1]
        motion.c[-4, i] -= 2 * height / first**3
        motion.c[-3, i] += 3 * height / first**2
        motion.c[-1, i + 1] += height
        motion.c[-4, i + 1] += 2 * height / second**3
        motion.c[-3, i + 1] -= 3 * height / second**2


def cancelling(motion: Spoiled, rng: Rng) -> None:
    """Huge terms of high degree that cancel one another but for rounding."""
    k = int(rng.integers(motion.breaks.size - 1))
    size = max(motion.c.shape[0], 12)
    c = np.zeros((size, motion.c.shape[1]))
    c[-motion.c.shape[0] :] = motion.c
    span = motion.breaks[k + 1] - motion.breaks[k]
    # u⁸ (u - span)³, zero with two derivatives at both ends
    c[-12:, k] += (
        np.concatenate([[1, -3 * span, 3 * span**2, -(span**3)], np.zeros(8)])
        * 10.0 ** rng.uniform(-3, 12)
        / span**11
    )
    motion.c = c


FAULTS: tuple[Callable[[Spoiled, Rng], None], ...] = (jump, ramp, stairs, limit, waypoint, bump)
DISGUISES = (as_it_is, divided, scattered, padded, spiked, cancelling)


def test_the_motions_are_sound_before_they_are_spoiled() -> None:
    rng = np.random.default_rng(10)
    assert all(Spoiled(rng).passes() for _ in range(40))


def beyond_limits(motion: Spoiled) -> bool:
    """Whether dense samples are beyond a limit: a disguise that bends the motion may mend it."""
    curve = motion.curve()
    share = np.linspace(0.0, 1.0, 20_001)[:, None]
    times = curve.x[:-1] + share * np.diff(curve.x)
    times = np.clip(times, curve.x[0], curve.x[-1])
    for quantity, values in motion.limits.items():
        found = curve(times, LIMITED.index(quantity))
        ends = values["turn"] if quantity == "position" else [-values["turn"], values["turn"]]
        if found.min() < ends[0] - 2e-9 or found.max() > ends[1] + 2e-9:
            return True
    return False


def passed(seeds: range) -> list[tuple[int, str, list[str]]]:
    """The bad motions that pass the check."""
    found = []
    for seed in seeds:
        rng = np.random.default_rng(seed)
        motion = Spoiled(rng)
        fault = FAULTS[rng.integers(len(FAULTS))]
        fault(motion, rng)
        disguises = [DISGUISES[i] for i in rng.integers(len(DISGUISES), size=rng.integers(1, 4))]
        with np.errstate(all="ignore"):
            for disguise in disguises:
                disguise(motion, rng)
        if motion.passes() and (fault is not limit or beyond_limits(motion)):
            found.append((seed, fault.__name__, [one.__name__ for one in disguises]))
    return found


def test_no_bad_motion_passes() -> None:
    assert passed(range(ORDINARY)) == []


@pytest.mark.exhaustive
@pytest.mark.parametrize("part", range(20))
def test_none_of_thousands_of_bad_motions_passes(part: int) -> None:
    share = EXHAUSTIVE // 20
    assert passed(range(ORDINARY + part * share, ORDINARY + (part + 1) * share)) == []
