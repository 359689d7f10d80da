"""Symbolic dynamics against Pinocchio, and motions that keep limits of effort and tool speed."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import knotwork as kw
from knotwork.planning.timing import Dynamics, TimingLimits, TimingProblem, solve
from knotwork.planning.timing.timing_problem import part_of
from knotwork.robot.payload import Payload


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
            effort(*state).full().ravel(), robot.torque(*state), rtol=1e-11, atol=1e-11
        )
        linear = np.linalg.norm(robot.twist(*state[:2]).linear)
        assert float(speed(*state[:2])) == pytest.approx(linear, abs=1e-12)


def swing(**limits: Any) -> TimingProblem:
    robot = kw.load_robot("planar2").with_gravity([0.0, -9.81, 0.0])
    return TimingProblem(
        robot.joint_names,
        [[-1.0, 0.5], [0.0, 0.8], [0.6, -0.4]],
        np.zeros((3, 2)),
        TimingLimits([3.0, 3.0], [12.0, 12.0], [300.0, 300.0], **limits),
        dynamics=Dynamics(robot),
    )


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
    asked = replace(free, limits=replace(free.limits, effort=limit))
    motion = solve(asked)
    times = np.linspace(0.0, motion.duration, 20001)
    assert (efforts(motion.trajectory, times) <= limit).all()
    assert motion.duration > fast.duration
    assert any(one.quantity == "effort" for one in motion.binding)


def test_stopping_motion_is_as_fast_as_its_parts() -> None:
    free = swing()
    still = np.zeros_like(free.position)
    holding = np.abs(free.required_dynamics.effort(free.position, still, still)).max(axis=0)
    asked = replace(free, limits=replace(free.limits, effort=1.1 * holding))
    parts = [
        solve(replace(part_of(asked, i, i + 1), acceleration=still[:2])).duration for i in range(2)
    ]
    assert solve(asked).duration < 1.02 * sum(parts)


def test_keeps_tool_speed_limit_all_the_time() -> None:
    asked = swing(tool_speed=0.8)
    motion = solve(asked)
    robot = asked.required_dynamics.robot
    bound = kw.verification.tool_speed_bound(robot, motion.trajectory, limit=0.8)
    assert bound.ok
    assert bound.proved
    assert any(one.quantity == "tool speed" for one in motion.binding)
