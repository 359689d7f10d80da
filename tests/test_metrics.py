"""The figures that tell motions apart, against sampling and on paper."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from knotwork.curves.interpolation import PLANNERS, PlannerOptions
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.trajectory import JointTrajectory
from knotwork.verification import metrics
from knotwork.waypoints import JointWaypoints
from sweeps import examples

Array = NDArray[np.float64]


def motion(times: list[float], velocity_pieces: list[list[float]]) -> JointTrajectory:
    """Integrate pieces of velocity, highest power first, into a motion of one joint."""
    size = max(len(piece) for piece in velocity_pieces)
    c = np.zeros((size, len(velocity_pieces), 1))
    for i, piece in enumerate(velocity_pieces):
        c[size - len(piece) :, i, 0] = piece
    curve = PiecewisePolynomial(c, np.array(times)).antiderivative()
    return JointTrajectory(("j",), curve)


def asked(trajectory: JointTrajectory, times: list[float], v: list[float]) -> JointWaypoints:
    time = np.array(times)
    return JointWaypoints(("j",), time, trajectory.position(time), np.array(v)[:, None])


def random_waypoints(seed: int, n: int, joints: int = 2) -> JointWaypoints:
    rng = np.random.default_rng(seed)
    time = np.cumsum(rng.uniform(0.3, 3.0, n))
    names = tuple(f"j{k}" for k in range(joints))
    return JointWaypoints(names, time, rng.normal(size=(n, joints)), rng.normal(size=(n, joints)))


class TestFluctuation:
    def test_a_swing_counts_twice_its_height(self) -> None:
        # from 1 down to 0 and back to 1, where staying at the mean ½ would ask for 1 in all
        swing = motion([0, 1, 2], [[-1.0, 1.0], [1.0, 0.0]])
        score = metrics.velocity_fluctuation(swing, asked(swing, [0, 2], [1, 1]))
        np.testing.assert_allclose(score, 2.0 - 1.0, rtol=1e-12)

    def test_stopping_where_a_speed_is_asked_counts(self) -> None:
        stop = motion([0, 1], [[-6.0, 6.0, 0.0]])  # rest to rest over 1
        score = metrics.velocity_fluctuation(stop, asked(stop, [0, 1], [1.0, 1.0]))
        # from 1 to 0 at once, up to 1.5, down to 0, and to 1 at once; nothing of it was forced
        np.testing.assert_allclose(score, 1 + 1.5 + 1.5 + 1, rtol=1e-12)

    @examples(in_all=360)
    @given(st.integers(0, 10**6), st.integers(2, 6), st.sampled_from(sorted(PLANNERS)))
    def test_it_is_the_sampled_variation_beyond_the_least_and_never_negative(
        self, seed: int, n: int, planner: str
    ) -> None:
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
    assert (free.joint, free.use) == ("fast", None)
    assert free.value == pytest.approx(6.0)
    limited = metrics.peak(trajectory, 1, np.array([2.0, 60.0]))
    assert limited.joint == "slow"
    assert limited.use == pytest.approx(0.75)
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
