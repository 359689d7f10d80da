"""Least times: every given value met to rounding, every limit kept, no motion below the bound."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from timing_cases import assert_kept, random_problem

from knotwork.planning.timing import TimingLimits, TimingProblem, solve


def problems() -> Iterator[tuple[int, int, int]]:
    rng = np.random.default_rng(5)
    for seed in range(12):
        yield seed, int(rng.integers(2, 9)), int(rng.integers(1, 8))


@pytest.mark.parametrize(("seed", "n", "d"), list(problems()))
def test_solves_random_problems(seed: int, n: int, d: int) -> None:
    problem = random_problem(seed, n, d)
    assert_kept(problem, solve(problem))


def from_stop_to_stop(move: float, V: float, A: float, J: float) -> float:
    """Least time of one joint, by its peak velocity: reached by ramps of acceleration, or not."""

    def ramp(v: float) -> float:
        return v / A + A / J if v >= A * A / J else 2.0 * float(np.sqrt(v / J))

    if V * ramp(V) <= move:
        return 2.0 * ramp(V) + (move - V * ramp(V)) / V
    low, high = 0.0, V
    for _ in range(100):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if middle * ramp(middle) > move else (middle, high)
    return 2.0 * ramp(low)


@pytest.mark.parametrize(("seed", "d"), [(0, 1), (1, 1), (2, 2), (3, 6), (4, 6)])
def test_move_between_stops_matches_slowest_joint(seed: int, d: int) -> None:
    rng = np.random.default_rng(seed)
    move = rng.uniform(-1.0, 1.0, d) * 10.0 ** rng.uniform(-1.0, 0.5)
    V, A = rng.uniform(1.0, 4.0, d), rng.uniform(3.0, 20.0, d)
    J = A * 10.0 ** rng.uniform(0.5, 2.5, d)
    names, still = tuple(f"joint {k}" for k in range(d)), np.zeros((2, d))
    limits = TimingLimits(V, A, J)
    problem = TimingProblem(names, [0.0 * move, move], still, limits, acceleration=still)
    motion = solve(problem)
    assert_kept(problem, motion)
    joints = zip(np.abs(move), V, A, J, strict=True)
    exact = max(from_stop_to_stop(*joint) for joint in joints)
    assert (1 - 1e-12) * exact <= motion.duration < (1 + 2e-5) * exact


def test_idle_joint_stays_at_rest() -> None:
    """It could swing out between the stops, and be no slower for it."""
    position = [[0.0, 0.5], [2.0, 1.5], [4.0, 1.5], [5.0, 0.5]]
    limits = TimingLimits([2.0, 2.0], [4.0, 4.0], [40.0, 40.0])
    ends = np.full((4, 2), np.nan)
    ends[[0, -1]] = 0.0
    problem = TimingProblem(("a", "b"), position, np.zeros((4, 2)), limits, acceleration=ends)
    motion = solve(problem)
    assert_kept(problem, motion)
    between = np.linspace(motion.time[1], motion.time[2], 100)
    assert np.ptp(motion.trajectory.position(between)[:, 1]) < 1e-12
    one = TimingProblem(
        ("a",),
        np.array(position)[:, :1],
        np.zeros((4, 1)),
        TimingLimits([2.0], [4.0], [40.0]),
        acceleration=ends[:, :1],
    )
    assert motion.duration < (1 + 1e-5) * solve(one).duration
