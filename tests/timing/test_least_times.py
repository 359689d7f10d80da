"""Least times: given values are met, limits of efforts, too, are kept, and bounds are reached."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from timing_cases import assert_kept, random_problem

import knotwork as kw
from knotwork.errors import TimingError
from knotwork.joint_quantities import JointLimits
from knotwork.planning.timing import Dynamics, TimingProblem, lower_bound, solve
from knotwork.robot.payload import Payload
from sweeps import examples


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
    limits = JointLimits(V, A, J)
    problem = TimingProblem(names, [0.0 * move, move], still, limits, acceleration=still)
    motion = solve(problem)
    assert_kept(problem, motion)
    joints = zip(np.abs(move), V, A, J, strict=True)
    exact = max(from_stop_to_stop(*joint) for joint in joints)
    assert (1 - 1e-12) * exact <= motion.duration < (1 + 2e-5) * exact


def test_idle_joint_stays_at_rest() -> None:
    """It could swing out between the stops, and be no slower for it."""
    position = [[0.0, 0.5], [2.0, 1.5], [4.0, 1.5], [5.0, 0.5]]
    limits = JointLimits([2.0, 2.0], [4.0, 4.0], [40.0, 40.0])
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
        JointLimits([2.0], [4.0], [40.0]),
        acceleration=ends[:, :1],
    )
    assert motion.duration < (1 + 1e-5) * solve(one).duration


PARTS = st.lists(st.tuples(st.floats(0.01, 2.0), st.floats(-1.0, 1.0)), min_size=1, max_size=6)


@examples(200)
@given(parts=PARTS, start=st.floats(-1.0, 1.0), scale=st.floats(0.01, 100.0))
@example(parts=[(1.0, -1.0), (1.0, -0.9999999999999999)], start=1.0, scale=1.0)  # back by 1e-16
@example(parts=[(1.0, -0.9999999999999999)] * 2, start=1.0, scale=1.0)
def test_no_motion_is_sooner(parts: list[tuple[float, float]], start: float, scale: float) -> None:
    """Any motion of accelerations between -1 and 1, its own peak velocity being the limit."""
    v, q, peak, duration = start, 0.0, abs(start), 0.0
    for h, a in parts:
        q += v * h + 0.5 * a * h * h
        v += a * h
        peak, duration = max(peak, abs(v)), duration + h
    limits = JointLimits([scale * peak + 1e-9], [scale])
    for known in (slice(0, 2), slice(0, 1), slice(1, 2), slice(0, 0)):
        velocity = np.full((2, 1), np.nan)
        velocity[known] = scale * np.array([[start], [v]])[known]
        problem = TimingProblem(("a",), [[0.0], [scale * q]], velocity, limits)
        assert lower_bound(problem) <= duration * (1 + 1e-9) + 1e-12


@pytest.mark.parametrize(
    ("move", "ends", "least"),
    [
        (1.0, (0.0, 0.0), 2.0),  # up and down
        (8.0, (0.0, 0.0), 6.0),  # with a stretch at the limit of 2
        (1.0, (1.0, 1.0), 2.0 * (np.sqrt(2.0) - 1.0)),
        (-1.0, (0.0, 0.0), 2.0),
        (-0.25, (0.5, 0.5), 1.0 + 2.0 * np.sqrt(0.5)),  # there and back
    ],
)
def test_lower_bounds_by_hand(move: float, ends: tuple[float, float], least: float) -> None:
    limits = JointLimits([2.0], [1.0])
    problem = TimingProblem(("a",), [[0.0], [move]], [[ends[0]], [ends[1]]], limits)
    assert lower_bound(problem) == pytest.approx(least)


@pytest.mark.parametrize("name", ["planar2", "ur5", "panda"])
def test_symbolic_efforts_are_those_of_pinocchio(name: str) -> None:
    import casadi as ca

    robot = kw.load_robot(name).with_gravity([1.0, 2.0, -9.0])
    if name == "ur5":
        robot = robot.with_tool(payload=Payload(3.0, [0.01, 0.02, 0.06]))
    dynamics, d = Dynamics(robot), robot.dof
    q, v, a = (ca.SX.sym(letter, d) for letter in "qva")
    effort = ca.Function("effort", [q, v, a], [dynamics.symbolic_effort(q, v, a)])
    speed = ca.Function("speed", [q, v], [ca.norm_2(dynamics.symbolic_tool_velocity(q, v))])
    rng = np.random.default_rng(2)
    for _ in range(5):
        state = rng.normal(size=(3, d))
        np.testing.assert_allclose(
            effort(*state).full().ravel(), robot.effort(*state), rtol=1e-11, atol=1e-11
        )
        linear = np.linalg.norm(robot.twist(*state[:2]).linear)
        assert float(speed(*state[:2])) == pytest.approx(linear, abs=1e-12)


def swing(**options: Any) -> TimingProblem:
    robot = kw.load_robot("planar2").with_gravity([0.0, -9.81, 0.0])
    return TimingProblem(
        robot.joint_names,
        [[-1.0, 0.5], [0.0, 0.8], [0.6, -0.4]],
        np.zeros((3, 2)),
        JointLimits([3.0, 3.0], [12.0, 12.0], [300.0, 300.0]),
        dynamics=Dynamics(robot),
        **options,
    )


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"used_fraction": 0}, "used_fraction is 0; it must be a positive"),
        ({"used_fraction": float("nan")}, "used_fraction is nan"),
        ({"used_fraction": "a"}, "used_fraction is 'a'"),
        ({"jerk": "a"}, "jerk limit must be numbers, not 'a'"),
        ({"jerk": ["2"]}, r"jerk limit must be numbers, not \['2'\]"),
        ({"jerk": [float("nan")]}, r"jerk limits are \[nan\]; give positive ones"),
        ({"upper": 1.0}, r"upper limit must have shape \(1,\)"),
        ({"lower": [float("nan")]}, r"position limits run from \[nan\] to \[inf\]"),
        ({"lower": [2], "upper": [1]}, "each lower one must not be above its upper one"),
    ],
)
def test_refuses_meaningless_limits(wrong: dict[str, Any], says: str) -> None:
    with pytest.raises(kw.InputError, match=says):
        JointLimits([2.0], **wrong)


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"tool_speed": "a"}, "tool speed limit must be numbers, not 'a'"),
        ({"tool_speed": float("nan")}, "tool speed limit is nan; give a positive one"),
        ({"tool_speed": [1.0]}, r"tool speed limit must have shape \(\)"),
        ({"duration": [np.inf]}, "duration from '0' to '1' is inf s; give a positive and finite"),
    ],
)
def test_refuses_limits_that_no_motion_can_keep(wrong: dict[str, Any], says: str) -> None:
    given = {"limits": JointLimits([2.0]), **wrong}
    with pytest.raises(kw.InputError, match=says):
        TimingProblem(("a",), [[0], [1]], [[0], [0]], **given)


def test_keeps_effort_limits_all_the_time() -> None:
    free = swing()
    fast = solve(free)
    times = np.linspace(0.0, fast.duration, 20001)

    def efforts(curve: kw.JointTrajectory, t: np.ndarray) -> np.ndarray:
        states = (curve.position(t), curve.velocity(t), curve.acceleration(t))
        return np.abs(free.required_dynamics.effort(*states)).max(axis=0)

    peak = efforts(fast.trajectory, times)
    still = np.zeros_like(free.position)
    holding = np.abs(free.required_dynamics.effort(free.position, still, still)).max(axis=0)
    limit = np.maximum(0.85 * peak, 1.1 * holding)
    problem = replace(free, limits=replace(free.limits, effort=limit))
    motion = solve(problem)
    times = np.linspace(0.0, motion.duration, 20001)
    assert (efforts(motion.trajectory, times) <= limit).all()
    assert motion.duration > fast.duration
    assert any(limit.quantity == "effort" for limit in motion.active_limits)


def test_stopping_motion_is_as_fast_as_its_parts() -> None:
    free = swing()
    still = np.zeros_like(free.position)
    holding = np.abs(free.required_dynamics.effort(free.position, still, still)).max(axis=0)
    other = replace(free, limits=replace(free.limits, effort=1.1 * holding))
    parts = [
        solve(replace(other.between(i, i + 1), acceleration=still[:2])).duration for i in range(2)
    ]
    assert solve(other).duration < 1.02 * sum(parts)


def test_keeps_tool_speed_limit_all_the_time() -> None:
    problem = swing(tool_speed=0.8)
    motion = solve(problem)
    robot = problem.required_dynamics.robot
    bound = kw.verification.tool_speed_bound(robot, motion.trajectory, limit=0.8)
    assert bound.ok
    assert bound.proved
    assert any(limit.quantity == "tool_speed" for limit in motion.active_limits)


def test_sufficient_duration_is_not_for_the_speed_of_a_longer_interval() -> None:
    position = [[-1.0, 0.5], [-0.99, 0.5], [0.6, -0.4]]
    problem = replace(swing(tool_speed=0.8), position=position, duration=[0.03, 20.0])
    with pytest.raises(TimingError, match="is enough for a motion that stops") as caught:
        solve(problem)
    assert caught.value.feasible_value < 0.11
