"""The figures that tell motions apart, and the deviation from straight paths, on paper."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from knotwork.curves.interpolation import PLANNERS, PlannerOptions
from knotwork.curves.trajectory import JointTrajectory
from knotwork.verification import metrics
from knotwork.verification.metrics.deviation import deviation_from_line
from knotwork.waypoints import JointWaypoints
from sweeps import examples

Array = NDArray[np.float64]


def random_waypoints(seed: int, n: int, joints: int = 2) -> JointWaypoints:
    rng = np.random.default_rng(seed)
    time = np.cumsum(rng.uniform(0.3, 3.0, n))
    names = tuple(f"j{k}" for k in range(joints))
    return JointWaypoints(names, time, rng.normal(size=(n, joints)), rng.normal(size=(n, joints)))


@examples(in_all=360)
@given(st.integers(0, 10**6), st.integers(2, 6), st.sampled_from(sorted(PLANNERS)))
def test_fluctuation_is_variation_beyond_minimum(seed: int, n: int, planner: str) -> None:
    waypoints = random_waypoints(seed, n)
    try:
        trajectory = PLANNERS[planner](waypoints, PlannerOptions())
    except ValueError:
        return  # a planner that can't do this task says so elsewhere
    score = metrics.velocity_fluctuation(trajectory, waypoints)
    assert (score >= 0).all()
    np.testing.assert_allclose(
        score, sampled_fluctuation(trajectory, waypoints), rtol=2e-3, atol=2e-3
    )


def sampled_fluctuation(trajectory: JointTrajectory, waypoints: JointWaypoints) -> Array:
    total = np.zeros(len(trajectory.joint_names))
    for i in range(len(waypoints.time) - 1):
        t = np.linspace(waypoints.time[i], waypoints.time[i + 1], 4001)
        v = trajectory.velocity(t)
        v = np.vstack([waypoints.velocity[i], v, waypoints.velocity[i + 1]])
        q = trajectory.position(t[[0, -1]])
        mean = (q[1] - q[0]) / (t[-1] - t[0])
        total += np.abs(np.diff(v, axis=0)).sum(axis=0)
        total -= np.abs(mean - v[0]) + np.abs(mean - v[-1])
    return total


@pytest.mark.parametrize("planner", sorted(PLANNERS))
def test_integrals_of_squares_equal_fine_sum(planner: str) -> None:
    waypoints = random_waypoints(3, 5)
    trajectory = PLANNERS[planner](waypoints, PlannerOptions())
    for order in (2, 3):
        total = 0.0
        for low, high in zip(trajectory.breaks, trajectory.breaks[1:], strict=False):
            t = low + (np.arange(4000) + 0.5) * (high - low) / 4000  # midpoints, never a break
            total += float((trajectory(t, order) ** 2).sum() * (high - low) / 4000)
        assert metrics.integral_of_square(trajectory, order) == pytest.approx(total, rel=1e-5)


def test_peak_is_of_joint_nearest_limit() -> None:
    waypoints = JointWaypoints(("slow", "fast"), [0.0, 1.0], [[0, 0], [1, 4]], np.zeros((2, 2)))
    trajectory = PLANNERS["cubic"](waypoints, PlannerOptions())
    free = metrics.peak(trajectory, 1, np.array([np.inf, np.inf]))
    assert (free.joint, free.utilisation) == ("fast", None)
    assert free.value == pytest.approx(6.0)
    limited = metrics.peak(trajectory, 1, np.array([2.0, 60.0]))
    assert limited.joint == "slow"
    assert limited.utilisation == pytest.approx(0.75)
    assert limited.time == pytest.approx(0.5)


def test_misses_and_jumps_of_plain_cubic() -> None:
    waypoints = JointWaypoints(("j",), [0.0, 1.0, 3.0], [[0], [1], [0]], [[0], [0.5], [0]])
    cubic = PLANNERS["cubic"](waypoints, PlannerOptions())
    assert metrics.position_miss(cubic, waypoints) < 1e-12
    assert metrics.velocity_miss(cubic, waypoints) < 1e-12
    # eq (20) on the left, (21) on the right of the second waypoint
    left = 6 * (0 - 1) / 1 + (2 * 0 + 4 * 0.5) / 1
    right = 6 * (0 - 1) / 4 - (4 * 0.5 + 2 * 0) / 2
    assert metrics.acceleration_jump(cubic) == pytest.approx(abs(right - left), rel=1e-12)
    other = JointWaypoints(("j",), [0.0, 1.0, 3.0], [[0], [1.25], [0]], [[0], [0.1], [0]])
    assert metrics.position_miss(cubic, other) == pytest.approx(0.25)
    assert metrics.velocity_miss(cubic, other) == pytest.approx(0.4)


RADIAN = 0.1  # what a radian counts where the tool moves and turns at once [m]


def pose(x: float, y: float, z: float, angle: float = 0.0) -> pin.SE3:
    return pin.SE3(pin.exp3(np.array([0.0, 0.0, angle])), np.array([x, y, z]))


distances = st.floats(-2, 2)


@examples(in_all=600)
@given(
    along=st.floats(0, 1),
    off=distances,
    length=st.floats(1e-4, 3),
    turn=st.floats(-2, 2),
    more=st.floats(-0.3, 0.3),
)
def test_off_the_line(along: float, off: float, length: float, turn: float, more: float) -> None:
    def path(s: float) -> pin.SE3:
        return pose(s * length, 0, 0, s * turn)

    reached = pose(along * length, off, 0, along * turn + more)
    found = deviation_from_line(reached, path(0.0), path(1.0))

    def errors(s: float) -> tuple[float, float]:
        return float(np.hypot((along - s) * length, off)), abs((along - s) * turn + more)

    grid = np.linspace(0, 1, 2001)
    least = min(d**2 + (RADIAN * a) ** 2 for d, a in map(errors, grid))
    assert found[0] ** 2 + (RADIAN * found[1]) ** 2 <= least + 1e-12
    assert found[0] >= abs(off) - 1e-12
    if more == 0.0:
        assert found == pytest.approx((abs(off), 0), abs=1e-7)


@pytest.mark.parametrize("apart", [0.0, 1e-16, 1e-12])
def test_deviation_at_one_place_is_turn_only(apart: float) -> None:
    start, end = pose(0.5, 0, 0), pose(0.5, apart, 0, 1.0)
    for turned in (0.0, 0.3, 1.0):
        off, angle = deviation_from_line(pose(0.5, 0, 0, turned), start, end)
        assert off < 1e-9
        assert angle < 1e-9
    assert deviation_from_line(pose(0.5, 0.02, 0, 0.4), start, end) == pytest.approx(
        (0.02, 0), abs=1e-9
    )
    assert deviation_from_line(pose(0.5, 0, 0, 1.25), start, end) == pytest.approx(
        (0, 0.25), abs=1e-9
    )
