"""The best choice of one configuration at each waypoint: the shortest path through layers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from knotwork.kinematics.restarts import FULL_TURN
from knotwork.waypoints import FloatArray

# What an infeasible interval or waypoint costs [s]: more than any travel. What exceeds the limits
# by more costs more in proportion, so that where nothing is feasible the least infeasible wins.
INFEASIBLE = 1e6
# What a cubic between two waypoints costs that is beyond the limits in its middle [s]: the mean
# speed is within them, but a planner would have to go faster on the way. It costs in proportion.
STRAINED = 1e5
# Costs that differ by less [s, relative above 1 s] are equal: then the first candidate wins, on
# every machine.
TIE = 1e-9
# A mean speed is too fast beyond this part of the limit: at the limit itself rounding must not
# decide.
AT_LIMIT = 1.0 + 1e-9


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
        travel: Factor of the travel.
        change: Cost of a change of branch [s], infinite where it is forbidden: for all intervals,
            or one for each, shape (n - 1,).
    """

    speed: FloatArray
    limit: FloatArray
    unbounded: Any
    travel: float = 1.0
    change: float | FloatArray = 0.0


@dataclass(frozen=True, eq=False)
class Sequence:
    """A choice.

    Attributes:
        index: The candidate chosen at each waypoint.
        q: Its joint positions, joints without limits at the turn they come to, shape (n, d).
        cost: Of the whole [s]; infinite if nothing is allowed.
        blocked: The first waypoint that nothing allowed leads to, or `None`.
    """

    index: tuple[int, ...]
    q: FloatArray
    cost: float
    blocked: int | None = None


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
    for use, price in ((strain, STRAINED), (fastest, INFEASIBLE)):
        beyond = use > AT_LIMIT
        if beyond.any():
            cost[beyond] += price * use[beyond]
    if change:
        product = state.signs[:, None, :] * layer.signs[None, :, :]
        cost[(product < 0).any(axis=2)] += change
    return cost, np.array(turns)


def changes(rules: Rules, count: int) -> FloatArray:
    """What a change of branch costs in each of so many intervals [s], shape (count,)."""
    return np.broadcast_to(np.asarray(rules.change, dtype=float), (count,))


def choose_sequence(layers: list[Layer], durations: FloatArray, rules: Rules) -> Sequence:
    """Choose the sequence of least cost by dynamic programming (Bellman, 1957).

    The cost of a joint without limits depends on how far it turns in a step, the short way. Only
    where given positions follow later does it matter which turn it has come to, and there the
    turn of the cheapest way to each candidate counts.

    Args:
        layers: The candidates at each of n waypoints, at least one in each.
        durations: Time between them [s], shape (n - 1,).
        rules: What steps cost.
    """
    states = reach(layers, durations, rules, widened(_greedy_cost(layers, durations, rules)))
    if len(states) < len(layers):
        return Sequence((), np.empty((0, len(rules.speed))), np.inf, blocked=len(states))
    last = int(first_least(states[-1].cost[:, None])[0])
    rows = way_to(states, last)
    index = tuple(int(s.index[row]) for s, row in zip(states, rows, strict=True))
    q = np.array([s.q[row] for s, row in zip(states, rows, strict=True)])
    return Sequence(index, q, float(states[-1].cost[last]))


def widened(cost: float) -> float:
    """A bound that costs equal to the given one but for rounding are within."""
    return cost * (1.0 + 1e-6) + 1e-6


def reach(
    layers: list[Layer], durations: FloatArray, rules: Rules, bound: float = np.inf
) -> list[Reached]:
    """Find the cheapest way to each candidate of each layer.

    Args:
        layers: The candidates at each of n waypoints.
        durations: Time between them [s], shape (n - 1,).
        rules: What steps cost.
        bound: Candidates that cost more to get to are left out [s]. Costs only grow: none is on a
            way to the end that costs no more.

    Returns:
        A state for each layer; fewer where nothing allowed leads on.
    """
    first = layers[0]
    kept = np.flatnonzero(first.cost <= bound)
    state = _start(first.take(kept), kept)
    states = [state]
    costs = changes(rules, len(durations))
    for layer, duration, change in zip(layers[1:], durations, costs, strict=True):
        steps, turns = step_costs(rules, state, layer, float(duration), float(change))
        total = state.cost[:, None] + steps
        came = first_least(total)
        cost = total[came, np.arange(len(layer.q))] + layer.cost
        kept = np.flatnonzero((cost <= bound) & np.isfinite(cost))
        if not kept.size:
            break
        state = _moved(state, layer, cost, came, kept, turns, rules)
        states.append(state)
    return states


def _start(first: Layer, index: Any) -> Reached:
    came = np.zeros(len(index), dtype=int)
    return Reached(first.cost, first.q, first.signs, first.weight, index, came, first.velocity)


def _moved(
    state: Reached,
    layer: Layer,
    cost: FloatArray,
    came: Any,
    kept: Any,
    turns: FloatArray,
    rules: Rules,
) -> Reached:
    """The candidates kept of a layer, each reached the cheapest way."""
    came = came[kept]
    q = layer.q[kept]
    if not layer.fixed:
        for row, j in enumerate(np.flatnonzero(rules.unbounded)):
            q[:, j] = state.q[came, j] + turns[row][came, kept]
    # On a singularity a branch has no sign of its own, and keeps that of the way to it.
    signs = np.where(layer.signs[kept] == 0.0, state.signs[came], layer.signs[kept])
    velocity = None if layer.velocity is None else layer.velocity[kept]
    return Reached(cost[kept], q, signs, layer.weight[kept], kept, came, velocity)


def way_to(states: list[Reached], row: int) -> list[int]:
    """The rows of the states on the cheapest way to a row of the last of them."""
    rows = [row]
    for state in reversed(states[1:]):
        rows.append(int(state.came[rows[-1]]))
    rows.reverse()
    return rows


def positions_of(layers: list[Layer], index: tuple[int, ...], rules: Rules) -> FloatArray:
    """Positions of a sequence, joints without limits at the turn they come to the short way."""
    q = np.array([layer.q[k] for layer, k in zip(layers, index, strict=True)])
    for i in range(1, len(q)):
        if not layers[i].fixed:
            turns = FULL_TURN * np.round((q[i] - q[i - 1]) / (FULL_TURN))
            q[i] = np.where(rules.unbounded, q[i] - turns, q[i])
    return q


def _greedy_cost(layers: list[Layer], durations: FloatArray, rules: Rules) -> float:
    """Cost of going from each waypoint to the candidate that is cheapest next."""
    k = np.array([int(np.argmin(layers[0].cost))])
    state = _start(layers[0].take(k), k)
    costs = changes(rules, len(durations))
    for layer, duration, change in zip(layers[1:], durations, costs, strict=True):
        steps, turns = step_costs(rules, state, layer, float(duration), float(change))
        cost = state.cost[0] + steps[0] + layer.cost
        kept = np.array([int(np.argmin(cost))])
        state = _moved(state, layer, cost, np.zeros(len(cost), int), kept, turns, rules)
    return float(state.cost[0])


def first_least(cost: FloatArray) -> Any:
    """For each column the first row that is as good as the least, but for rounding."""
    least = cost.min(axis=0)
    finite = np.where(np.isfinite(least), least, 0.0)
    return np.argmax(cost <= finite + TIE * np.maximum(1.0, np.abs(finite)), axis=0)
