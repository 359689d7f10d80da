"""Limits of effort and of the tool's speed, as planes that hold near a motion.

What a joint's effort, or the tool's speed, takes of its limit is a function u(q, v, a) of the state
at one place. Near a state it is linear: a row for the program asks for

    u₀ + ∂u/∂(q, v, a) · (q - q₀, v - v₀, a - a₀) <= 1.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pinocchio as pin

from knotwork.timing.problem import TimingProblem
from knotwork.waypoints import FloatArray
from knotwork.ways.states import Row, States

PARTS = (0.0, 0.25, 0.5, 0.75)
"""Where in each piece they are looked at; not at the very start, which is given."""

NEAR = 0.9
"""States that take less than this part of their limits get no row."""

MARGIN = 2e-3
"""Part of these limits that rows leave, so that no piece exceeds them between its places."""


def rows_of_use(problem: TimingProblem, states: States) -> list[Row]:
    """Rows where a motion is near the limits of effort and of the tool's speed, or exceeds them."""
    limits = problem.limits
    if not (np.isfinite(limits.effort).any() or np.isfinite(limits.tool_speed).any()):
        return []
    places = [(piece, part) for piece in range(len(states.span)) for part in PARTS][1:]
    starts = np.concatenate(([0.0], np.cumsum(states.span)))
    times = np.array([starts[piece] + part * states.span[piece] for piece, part in places])
    found = []
    for (piece, part), state in zip(
        places, np.stack([states.curve(times, k) for k in range(3)], axis=1), strict=True
    ):
        for use, slope in _uses(problem, *state):
            if use > NEAR:
                offset = use - 1.0 + MARGIN - float((slope * state).sum())
                found.append(Row(piece, part, -slope, offset))
    return found


def _uses(
    problem: TimingProblem, q: FloatArray, v: FloatArray, a: FloatArray
) -> Iterator[tuple[float, FloatArray]]:
    """What is taken of each limit, and how it changes with the state, shape (3, d)."""
    robot, limits = problem.arm.robot, problem.limits
    model, data = robot.model, robot.data
    if np.isfinite(limits.effort).any():
        slopes = np.stack(pin.computeRNEADerivatives(model, data, q, v, a))
        for k, share in enumerate(data.tau / limits.effort):
            yield abs(share), np.sign(share) * slopes[:, k] / limits.effort[k]
    if np.isfinite(limits.tool_speed):
        frame = robot.require_tool()
        pin.computeForwardKinematicsDerivatives(model, data, q, v, a)
        by_position, by_velocity = pin.getFrameVelocityDerivatives(model, data, frame, pin.LOCAL)
        velocity = (by_velocity @ v)[:3]
        speed = float(np.linalg.norm(velocity))
        if speed > 0.0:
            slopes = np.stack((by_position[:3], by_velocity[:3], np.zeros_like(by_position[:3])))
            yield speed / limits.tool_speed, (velocity / speed) @ slopes / limits.tool_speed
