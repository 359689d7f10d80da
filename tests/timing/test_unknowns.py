"""What may be left free or given: velocities, directions, durations, totals, accelerations."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from timing_cases import assert_kept, random_problem

from knotwork.errors import TimingError
from knotwork.joint_quantities import JointLimits
from knotwork.planning.timing import (
    Objective,
    Progress,
    TimedMotion,
    TimingProblem,
    solve,
)
from sweeps import first_of


@pytest.fixture(scope="module")
def problem() -> TimingProblem:
    return random_problem(3, 5, 3)


@pytest.fixture(scope="module")
def fastest(problem: TimingProblem) -> TimedMotion:
    return solve(problem)


def test_free_velocities_save_time(problem: TimingProblem, fastest: TimedMotion) -> None:
    velocity = np.array(problem.velocity)
    velocity[1:-1] = np.nan
    free = replace(problem, velocity=velocity)
    motion = solve(free)
    assert_kept(free, motion)
    assert motion.duration < 0.95 * fastest.duration


@pytest.mark.parametrize("long", [5.0, 100.0])
@pytest.mark.parametrize("along", [False, True])
def test_arm_stays_near_in_long_given_duration(long: float, along: bool) -> None:
    limits = JointLimits(velocity=[2.0, 3.0], acceleration=[8.0, 6.0], jerk=[80.0, 60.0])
    velocity = np.full((5, 2), 0.5 if along else np.nan)
    velocity[[0, -1]] = 0.0
    problem = TimingProblem(
        ("a", "b"),
        [[0, 0], [1, 0.5], [1.5, 1.2], [1, 1.4], [2, 1]],
        velocity,
        limits,
        is_direction=[False, along, along, along, False],
        duration=[np.nan, long, np.nan, np.nan],
    )
    motion = solve(problem)
    assert_kept(problem, motion)
    short = solve(replace(problem, duration=[np.nan, 2, np.nan, np.nan]))
    assert motion.duration - long < short.duration - 2 + 1e-3
    span = np.ptp(motion.trajectory.position(np.linspace(0, motion.duration, 2001)), axis=0)
    assert (span < 3.5).all()  # with minimum accelerations alone 8 for 5 s, 50 for 100 s


def test_chooses_factor_along_direction(problem: TimingProblem) -> None:
    along = np.array([False, True, True, True, False])
    other = replace(problem, is_direction=along, max_factor=np.full(5, 0.7))
    motion = solve(other)
    assert_kept(other, motion)
    for i in (1, 2, 3):
        direction = problem.velocity[i]
        factor = motion.velocity[i] @ direction / (direction @ direction)
        assert -1e-12 <= factor <= 0.7 + 1e-8
        np.testing.assert_allclose(motion.velocity[i], factor * direction, atol=1e-14)


def test_keeps_durations_and_lower_bounds(problem: TimingProblem, fastest: TimedMotion) -> None:
    h = np.diff(fastest.time)
    other = replace(
        problem,
        duration=[np.nan, 1.2 * h[1], np.nan, np.nan],
        min_duration=[0.0, 0.0, 1.3 * h[2], 0.0],
    )
    assert_kept(other, solve(other))


def test_meets_given_accelerations(problem: TimingProblem) -> None:
    acceleration = np.full((5, 3), np.nan)
    acceleration[[0, 2, 4]] = 0.0
    other = replace(problem, acceleration=acceleration)
    motion = solve(other)
    assert_kept(other, motion)
    at_rest = motion.trajectory.acceleration(motion.time[[0, 2, 4]])
    np.testing.assert_allclose(at_rest, 0.0, atol=1e-12)
    # What comes after a known state does not change what comes before it.
    first = TimingProblem(
        problem.joint_names,
        problem.position[:3],
        problem.velocity[:3],
        problem.limits,
        acceleration=acceleration[:3],
    )
    assert solve(first).duration == pytest.approx(motion.time[2], rel=1e-6)


def test_given_total_makes_smoothest_motion(problem: TimingProblem, fastest: TimedMotion) -> None:
    found = []
    for stretch in (1.02, 1.2, 1.5):
        other = replace(
            problem, total=stretch * fastest.duration, objective=Objective(time=0.0, jerk=1.0)
        )
        motion = solve(other)
        assert_kept(other, motion)
        assert motion.duration == pytest.approx(stretch * fastest.duration, rel=1e-12)
        span = np.diff(motion.trajectory.breaks)[:, None]
        jerk = 6.0 * motion.trajectory.polynomial.c[0]
        assert motion.objective_values["jerk"] == pytest.approx(float(np.sum(jerk**2 * span)))
        found.append(motion.objective_values["jerk"])
    assert found[0] > found[1] > found[2]


def test_weights_trade_time_for_jerk(problem: TimingProblem, fastest: TimedMotion) -> None:
    smooth = solve(replace(problem, objective=Objective(time=1.0, jerk=1e-3)))
    assert smooth.duration > fastest.duration
    assert smooth.trajectory.extrema("jerk").peak.max() < (
        fastest.trajectory.extrema("jerk").peak.max()
    )


def test_positions_stay_inside_their_limits() -> None:
    limits = JointLimits([2.0], [1.0], [3.0])
    free = TimingProblem(("a",), [[0], [1], [0]], [[0], [1], [0]], limits)
    reached = float(solve(free).trajectory.extrema("position").maximum[0])
    limits = replace(limits, lower=[-5.0], upper=[0.9 * reached + 0.1 * 1.5])
    other = replace(free, limits=limits)
    assert limits.upper < reached
    assert_kept(other, solve(other))


def test_passes_waypoint_at_limits() -> None:
    """A velocity exactly at its limit and a position exactly at one leave the solver no room."""
    limits = JointLimits([1.0, 1.0], [1.0, 1.0], [5.0, 5.0], lower=[0, 0], upper=[2.0, 0.5])
    other = TimingProblem(("a", "b"), [[0, 0], [1, 0.5], [2, 0]], [[0, 0], [1, 0], [0, 0]], limits)
    assert_kept(other, solve(other))


def test_progress_does_not_change_result(problem: TimingProblem, fastest: TimedMotion) -> None:
    steps: list[Progress] = []
    motion = solve(problem, progress=steps.append)
    assert steps[-1].iterations == motion.iterations
    assert motion.duration == fastest.duration


def test_reports_active_limits(fastest: TimedMotion) -> None:
    assert {limit.quantity for limit in fastest.active_limits} & {
        "velocity",
        "acceleration",
        "jerk",
    }
    assert all(one.share is not None and 0.0 < one.share <= 1.0 for one in fastest.active_limits)


def test_windows_cost_little_duration(monkeypatch: pytest.MonkeyPatch) -> None:
    long = random_problem(8, 32, 2)
    windows = solve(long)
    assert_kept(long, windows)
    monkeypatch.setattr("knotwork.planning.timing.solving.MAX_INTERVALS", 1000)
    assert windows.duration < 1.01 * solve(long).duration


@pytest.mark.parametrize("given", ["all", "one", "total"])
@pytest.mark.parametrize("count", first_of(2, 30))
def test_given_times_are_met_or_refused_with_sufficient_ones(given: str, count: int) -> None:
    refused = 0
    for seed in range(count):
        rng = np.random.default_rng([5, seed])
        base = random_problem(seed, int(rng.integers(2, 6)), int(rng.integers(1, 5)))
        velocity, ends = np.array(base.velocity), np.full(base.position.shape, np.nan)
        velocity[1:-1] = (velocity[1:-1], 0.0, np.nan)[seed % 3]
        ends[[0, -1]] = 0.0
        base = replace(base, velocity=velocity, acceleration=ends)
        least = np.diff(solve(base).time)
        for longer in (1.001, 1.01, 1.1, 1.5, 3.0):
            times: dict[str, Any] = {"duration": longer * least}
            if given == "one":
                one = np.arange(least.size) == seed % least.size
                times = {"duration": np.where(one, longer * least, np.nan)}
            elif given == "total":
                smooth = Objective(time=0.0, jerk=1.0)
                times = {"total": longer * float(least.sum()), "objective": smooth}
            problem = replace(base, **times)
            try:
                assert_kept(problem, solve(problem))
            except TimingError as error:
                refused += 1
                assert_suffices(error, problem)
    assert refused <= 3


def assert_suffices(error: TimingError, problem: TimingProblem) -> None:
    """With the durations that are named, taken together, there is a motion."""
    duration = np.array(problem.duration)
    if total := re.search(r"the motion must last .*; ([0-9.]+) s is enough", str(error)):
        solve(replace(problem, total=float(total[1])))
        return
    for line in str(error).splitlines():
        i, named = re.findall(r"from '(\d+)' to .*; ([0-9.]+) s(?:,| is)", line)[0]
        duration[int(i)] = float(named)
    solve(replace(problem, duration=duration))
