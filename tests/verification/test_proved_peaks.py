"""Proved peaks against dense samples, and motions whose peaks hide between few samples."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from scipy.optimize import minimize_scalar

import knotwork as kw
from knotwork.robot.payload import Payload
from knotwork.verification import (
    Bound,
    effort_bound,
    singular_value_bound,
    tool_acceleration_bound,
    tool_speed_bound,
)
from knotwork.verification.bounds import adaptive
from plans import planned
from sweeps import first_of

Function = Callable[[np.ndarray, np.ndarray, np.ndarray], float]


def torque_of(robot: kw.Robot, joint: int) -> Function:
    return lambda q, v, a: abs(pin.rnea(robot.model, robot.data, q, v, a)[joint])


def speed_of(robot: kw.Robot) -> Function:
    return lambda q, v, a: float(np.linalg.norm(robot.jacobian(q)[:3] @ v))


def acceleration_of(robot: kw.Robot) -> Function:
    """From the Jacobian at two nearby configurations: p'' = J a + J' v."""

    def value(q: np.ndarray, v: np.ndarray, a: np.ndarray) -> float:
        step = 1e-5
        ahead, behind = (robot.jacobian(q + sign * step * v)[:3] for sign in (1, -1))
        change = (ahead - behind) / (2 * step)
        return float(np.linalg.norm(robot.jacobian(q)[:3] @ a + change @ v))

    return value


def nearness_of(robot: kw.Robot) -> Function:
    return lambda q, v, a: -float(np.linalg.svd(robot.jacobian(q), compute_uv=False)[-1])


def peak(curve: kw.PiecewisePolynomial, function: Function, samples: int) -> float:
    """Largest value of dense samples in every piece, made larger by local search."""

    def at(t: float) -> float:
        return function(*(curve(t, nu) for nu in range(3)))

    best = -np.inf
    for start, end in zip(curve.x[:-1], curve.x[1:], strict=True):
        count = max(8, int(samples * (end - start) / (curve.x[-1] - curve.x[0])))
        times = np.linspace(start, np.nextafter(end, start), count)
        states = zip(*(curve(times, nu) for nu in range(3)), strict=True)
        values = [function(*state) for state in states]
        k = int(np.argmax(values))
        best = max(best, values[k])
        around = times[max(k - 1, 0)], times[min(k + 1, count - 1)]
        found = minimize_scalar(lambda t: -at(t), bounds=around, method="bounded")
        best = max(best, -float(found.fun))
    return best


def random_trajectory(robot: kw.Robot, rng: np.random.Generator) -> kw.JointTrajectory:
    """Pieces of any length and degree, continuous in position only, in any order of the joints."""
    pieces, degree = int(rng.integers(1, 6)), int(rng.integers(1, 8))
    spans = 10.0 ** rng.uniform(-3, 0.5, pieces)
    c = rng.normal(size=(degree + 1, pieces, robot.dof)) * rng.choice([0.1, 1.0])
    for r in range(degree + 1):
        c[r] *= (1.0 / np.maximum(spans, 0.1)[:, None]) ** (degree - r)
    x = rng.choice([0.0, -3.0, 1e4]) + np.concatenate(([0.0], np.cumsum(spans)))
    for i in range(1, pieces):
        c[-1, i] = np.polyval(c[:, i - 1], x[i] - x[i - 1])
    order = rng.permutation(robot.dof)
    units = tuple(robot.joint_units[i] for i in order)
    names = tuple(robot.joint_names[i] for i in order)
    curve = kw.PiecewisePolynomial(c[:, :, order], x)
    return kw.JointTrajectory(names, curve, joint_units=units)


def compare(
    found: Bound, curve: kw.PiecewisePolynomial, function: Function, samples: int, digits: float
) -> None:
    """The bound is above the truth, and the value is what the motion has at its time."""
    truth = peak(curve, function, samples)
    noise = digits * (1.0 + abs(truth))
    assert found.bound >= truth - noise
    assert found.bound >= abs(found.value)
    assert found.proof_gap == pytest.approx(found.bound - abs(found.value))
    before = max(np.nextafter(found.time, -np.inf), curve.x[0])
    there = [function(*(curve(t, nu) for nu in range(3))) for t in (found.time, before)]
    assert min(abs(value - abs(found.value)) for value in there) <= 1e3 * noise


def examine(robot: kw.Robot, trajectory: kw.JointTrajectory, samples: int) -> None:
    order = [trajectory.joint_names.index(name) for name in robot.joint_names]
    curve = kw.PiecewisePolynomial(trajectory.polynomial.c[:, :, order], trajectory.breaks)
    for joint, found in enumerate(
        effort_bound(robot, trajectory, limit=np.full(robot.dof, np.inf))
    ):
        compare(found, curve, torque_of(robot, joint), samples, 1e-9)
    compare(tool_speed_bound(robot, trajectory), curve, speed_of(robot), samples, 1e-9)
    # the reference differentiates by differences, so it has fewer digits
    found = tool_acceleration_bound(robot, trajectory)
    compare(found, curve, acceleration_of(robot), samples, 1e-6)
    nearest = singular_value_bound(robot, trajectory)
    assert nearest.bound <= -peak(curve, nearness_of(robot), samples) + 1e-9
    assert nearest.bound <= nearest.value + 1e-12


def robots() -> Iterator[kw.Robot]:
    """Every shipped robot, every other one with a payload and hung from a wall."""
    load = Payload(2.0, [0.02, -0.03, 0.08], np.diag([0.01, 0.02, 0.015]))
    for i, name in enumerate(kw.robot_names()):
        robot = kw.load_robot(name)
        robot = robot if robot.tool_frame else robot.with_tool(robot.tool_candidates[0])
        yield robot.with_tool(payload=load).with_gravity([0, -9.81, 0]) if i % 2 else robot


@pytest.mark.parametrize(
    ("seed", "motions", "samples"),
    first_of((5, 1, 300), (6, 15, 2_000)),
)
def test_random_motions_peak_below_bounds(seed: int, motions: int, samples: int) -> None:
    rng = np.random.default_rng(seed)
    for robot in robots():
        for _ in range(motions):
            examine(robot, random_trajectory(robot, rng), samples)


def test_limits_close_to_peak_are_decided() -> None:
    plan = planned("ur5_deburring")
    robot, trajectory = plan.joints.robot, plan.trajectory
    tight = effort_bound(robot, trajectory, limit=np.full(6, np.inf))
    peaks = [peak(trajectory.polynomial, torque_of(robot, joint), 20_000) for joint in range(6)]
    assert all(
        found.proof_gap <= 1.01e-3 * truth for found, truth in zip(tight, peaks, strict=True)
    )
    for share, ok in ((1e-6, True), (-1e-6, False)):
        found = effort_bound(robot, trajectory, limit=np.array(peaks) * (1 + share))
        assert [bound.ok for bound in found] == [ok] * 6
        assert [bound.proved for bound in found] == [True] * 6
    speed = peak(trajectory.polynomial, speed_of(robot), 20_000)
    assert tool_speed_bound(robot, trajectory, limit=speed * (1 + 1e-7)).proved
    assert not tool_speed_bound(robot, trajectory, limit=speed * (1 - 1e-7)).ok
    nearest = -peak(trajectory.polynomial, nearness_of(robot), 20_000)
    assert singular_value_bound(robot, trajectory, limit=nearest * (1 - 1e-5)).proved
    assert not singular_value_bound(robot, trajectory, limit=nearest * (1 + 1e-5)).ok


def test_exhausted_budget_is_not_proved(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(adaptive, "EVALUATION_BUDGET", 0)
    monkeypatch.setattr(adaptive, "EVALUATIONS_PER_PIECE", 0)
    plan = planned("ur5_deburring")
    robot, trajectory = plan.joints.robot, plan.trajectory
    truth = peak(trajectory.polynomial, torque_of(robot, 1), 20_000)
    limit = np.full(6, truth * (1 + 1e-6))
    found = effort_bound(robot, trajectory, limit=limit)[1]
    assert found.ok
    assert not found.proved
    assert found.bound > truth


def test_finds_singular_motion() -> None:
    """The elbow of a UR arm passes through straight."""
    robot = kw.load_robot("ur5")
    q = robot.configuration(next(iter(robot.configurations)))
    start, end = q.copy(), q.copy()
    start[2], end[2] = -0.2, 0.31
    trajectory = kw.JointTrajectory.from_knots(
        robot.joint_names, [0, 1], [start, end], np.zeros((2, 6))
    )
    found = singular_value_bound(robot, trajectory, limit=0.01)
    assert not found.ok
    assert found.proved
    assert found.bound == pytest.approx(0.0, abs=1e-3)


BENT = np.array([0.0, -0.4, 0.8, 0.0, 0.0, 0.0])


def swing() -> kw.JointTrajectory:
    """From hanging down to upright, between long rests: gravity is strongest half-way."""
    down = np.array([0.0, np.pi / 2, 0.0, 0.0, 0.0, 0.0])
    joints, times = kw.load_robot("ur5").joint_names, [0.0, 999.3, 1000.6, 2000.0]
    return kw.JointTrajectory.from_knots(
        joints, times, [down, down, -down, -down], np.zeros((4, 6))
    )


def ramp() -> kw.JointTrajectory:
    """The base's acceleration grows up to a break and is zero after it."""
    c = np.zeros((4, 3, 6))
    c[-1] = BENT
    c[0, 1, 0], c[-1, 2, 0], c[-2, 2, 0] = 1.0, 8.0, 12.0
    return of_pieces(c, [0.0, 1000.1, 1002.1, 1003.0])


def bump() -> kw.JointTrajectory:
    """One piece of degree 26 between rests, its acceleration a narrow bump in the middle."""
    shape = np.array([20.0])
    for _ in range(12):
        shape = np.polymul(shape, [-1.0, 1.0, 0.0])
        shape *= 4.0
    path = np.polyint(np.polyint(shape))
    c = np.zeros((path.size, 3, 6))
    c[-1] = BENT
    c[:, 1, 0] = path
    c[-1, 2, 0], c[-2, 2, 0] = np.polyval(path, 1.0), np.polyval(np.polyder(path), 1.0)
    return of_pieces(c, [0.0, 3000.4, 3001.4, 3005.0])


def of_pieces(c: np.ndarray, x: list[float]) -> kw.JointTrajectory:
    joints = kw.load_robot("ur5").joint_names
    return kw.JointTrajectory(joints, kw.PiecewisePolynomial(c, x))


HIDDEN = {"swing": (swing, 1), "ramp": (ramp, 0), "bump": (bump, 0)}


@pytest.mark.parametrize("name", HIDDEN)
def test_finds_peak_between_samples(name: str) -> None:
    """500 even samples and one at each break miss more than 2 % of these."""
    make, joint = HIDDEN[name]
    robot, trajectory = kw.load_robot("ur5"), make()
    torque = torque_of(robot, joint)
    times = np.linspace(trajectory.start_time, trajectory.end_time, 500)
    times = np.sort(np.concatenate([times, trajectory.breaks]))
    sampled = max(
        torque(*state) for state in zip(*(trajectory(times, nu) for nu in range(3)), strict=True)
    )
    truth = peak(trajectory.polynomial, torque, 20_000)
    assert truth > 1.02 * sampled
    limit = np.full(6, np.inf)
    limit[joint] = (truth + sampled) / 2.0
    found = effort_bound(robot, trajectory, limit=limit)[joint]
    assert not found.ok
    assert found.proved
    assert found.bound >= truth * (1 - 1e-12)


def test_refuses_unknown_frames_and_limits() -> None:
    plan = planned("ur5_deburring")
    robot, trajectory = plan.joints.robot, plan.trajectory
    with pytest.raises(kw.InputError, match="unknown link 'forearm'; did you mean 'forearm_link'"):
        tool_speed_bound(robot, trajectory, frame="forearm")
    other = kw.JointTrajectory.from_knots(["a"], [0, 1], [[0], [1]], [[0], [0]])
    with pytest.raises(kw.InputError, match="has joint a; the joints of robot 'ur5' are"):
        singular_value_bound(robot, other)


@pytest.mark.parametrize("limit", ["a", [1.0], True, math.nan, -1.0, 0])
def test_refuses_limits_that_are_not_positive(limit: Any) -> None:
    plan = planned("ur5_deburring")
    with pytest.raises(kw.InputError, match="limit of the tool speed"):
        kw.verification.tool_speed_bound(plan.joints.robot, plan.trajectory, limit=limit)
    with pytest.raises(kw.InputError, match=r"effort limits.*accepted: 6 positive numbers"):
        kw.verification.effort_bound(plan.joints.robot, plan.trajectory, limit=limit)
