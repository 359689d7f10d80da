"""What a step from one waypoint to the next costs, for all pairs of candidates at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from knotwork.kinematics.chain.joint_ranges import FULL_TURN
from knotwork.waypoints import FloatArray

# A mean speed is too fast beyond this part of the limit: at the limit itself rounding must not
# decide.
AT_LIMIT = 1.0 + 1e-9


@dataclass(frozen=True)
class Prices:
    """What counts more than any travel, each more than all of the next together [s].

    Attributes:
        infeasible: An interval or waypoint beyond the velocity limits, once for each time the
            limit, so that where nothing is feasible the least infeasible wins.
        strained: An interval where a cubic is beyond the limits in its middle: the mean speed is
            within them, but a planner would have to go faster on the way. The farther beyond, the
            more, up to twice as much.
        change: A change of branch where it is to be avoided.
    """

    infeasible: float
    strained: float
    change: float

    @classmethod
    def above(cls, bound: float, intervals: int) -> Prices:
        """Prices for sequences of some intervals whose other costs come to a bound at most [s]."""
        change = 2.0 * bound + 1.0
        strained = 2.0 * (intervals + 1) * change
        return cls(4.0 * (intervals + 1) * strained, strained, change)


@dataclass(frozen=True, eq=False)
class Layer:
    """The candidates at one waypoint.

    Attributes:
        q: Joint positions [rad or m], shape (m, d). Joints that turn without limit may be any
            number of turns away, unless the layer is `fixed`.
        cost: Of being at each candidate [s], shape (m,).
        weight: Factor of the travel from and to each, shape (m,).
        signs: What tells branches apart, shape (m, k); 0 for either.
        fixed: The positions are given, turns and all.
        velocity: Joint velocities at each [rad/s or m/s], shape (m, d), or `None` to leave out of
            account how fast joints are between waypoints.
    """

    q: FloatArray
    cost: FloatArray
    weight: FloatArray
    signs: FloatArray
    fixed: bool = False
    velocity: FloatArray | None = None

    def take(self, index: Any) -> Layer:
        """Those candidates of the given indices."""
        return Layer(
            self.q[index],
            self.cost[index],
            self.weight[index],
            self.signs[index],
            self.fixed,
            None if self.velocity is None else self.velocity[index],
        )


@dataclass(frozen=True, eq=False)
class Rules:
    """What a step from one waypoint to the next costs.

    Attributes:
        speed: What joint speeds are measured by [rad/s or m/s], shape (d,): the velocity limits,
            and something else where there is none.
        limit: Velocity limits [rad/s or m/s], shape (d,), infinite where there is none.
        unbounded: Joints that turn without limit, shape (d,).
        prices: What counts more than travel.
        travel: Factor of the travel.
        change: Cost of a change of branch [s], infinite where it is forbidden: for all intervals,
            or one for each, shape (n - 1,).
    """

    speed: FloatArray
    limit: FloatArray
    unbounded: Any
    prices: Prices
    travel: float = 1.0
    change: float | FloatArray = 0.0


@dataclass(frozen=True, eq=False)
class Reached:
    """The candidates of a layer that are kept, and the cheapest way to each.

    Attributes:
        cost: Of the cheapest way to each and of being there [s], shape (m,).
        q: Positions at the turn that way comes to, shape (m, d).
        signs: What tells their branches apart, shape (m, k).
        weight: Factors of travel, shape (m,).
        index: Which candidates of the layer they are, shape (m,).
        came: From which of those kept at the layer before, shape (m,).
        velocity: Joint velocities at each, shape (m, d), or `None`.
    """

    cost: FloatArray
    q: FloatArray
    signs: FloatArray
    weight: FloatArray
    index: Any
    came: Any
    velocity: FloatArray | None


def step_costs(
    rules: Rules, state: Reached, layer: Layer, duration: float, change: float
) -> tuple[FloatArray, FloatArray]:
    """Cost of each step between two waypoints, and how far the joints turn.

    Args:
        rules: What steps cost.
        state: Where steps start, l candidates.
        layer: Where they lead, m candidates.
        duration: Time for the step [s].
        change: What a change of branch costs in it [s].

    Returns:
        Costs, shape (l, m), and the motion of the joints without limits, shape (u, l, m).
    """
    shape = (len(state.q), len(layer.q))
    square, fastest, strain = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    buffer = np.empty(shape)
    turns: list[FloatArray] = []
    for j, speed in enumerate(rules.speed):
        move = np.subtract.outer(state.q[:, j], layer.q[:, j], out=buffer)
        if rules.unbounded[j] and not layer.fixed:
            move -= FULL_TURN * np.round(move / FULL_TURN)
            turns.append(-move)
        move /= speed
        if np.isfinite(rules.limit[j]):
            if state.velocity is not None and layer.velocity is not None:
                # The speed of the cubic in its middle: 3/2 Δq/h − (v₀ + v₁)/4.
                middle = move * (1.5 / duration)
                middle += (0.25 / speed) * state.velocity[:, j, None]
                middle += (0.25 / speed) * layer.velocity[:, j]
                np.maximum(strain, np.abs(middle, out=middle), out=strain)
            np.maximum(fastest, np.abs(move, out=move), out=fastest)
        move *= move
        square += move
    fastest /= duration
    cost = rules.travel * np.sqrt(square)
    cost *= 0.5 * (state.weight[:, None] + layer.weight[None, :])
    beyond = strain > AT_LIMIT
    if beyond.any():
        cost[beyond] += rules.prices.strained * (2.0 - 1.0 / strain[beyond])
    beyond = fastest > AT_LIMIT
    if beyond.any():
        cost[beyond] += rules.prices.infeasible * fastest[beyond]
    if change:
        product = state.signs[:, None, :] * layer.signs[None, :, :]
        cost[(product < 0).any(axis=2)] += change
    return cost, np.array(turns)


def changes(rules: Rules, count: int) -> FloatArray:
    """What a change of branch costs in each of so many intervals [s], shape (count,)."""
    return np.broadcast_to(np.asarray(rules.change, dtype=float), (count,))


def most_travel(layers: list[Layer], rules: Rules) -> float:
    """A bound of what any sequence costs but for prices [s]."""
    every = np.concatenate([layer.q for layer in layers])
    span = (every.max(axis=0) - every.min(axis=0)) / rules.speed
    heaviest = max(float(layer.weight.max()) for layer in layers)
    travel = (len(layers) - 1) * rules.travel * heaviest * float(np.linalg.norm(span))
    return travel + sum(float(layer.cost.max()) for layer in layers)
