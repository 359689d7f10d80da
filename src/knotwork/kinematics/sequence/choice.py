"""The best choice of one configuration at each waypoint: the shortest path through layers."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np

from knotwork.kinematics.chain.joint_ranges import FULL_TURN
from knotwork.kinematics.sequence.costs import Layer, Reached, Rules, changes, step_costs
from knotwork.waypoints import FloatArray

# Costs that differ by less, [s] and relative, are equal: then the first candidate wins, on every
# machine.
TIE = 1e-9
RELATIVE_TIE = 1e-14


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
        bound: Candidates that no way passes that costs so little are left out [s].

    Returns:
        A state for each layer; fewer where nothing allowed leads on.
    """
    first, onward = layers[0], least_onward(layers, rules)
    kept = np.flatnonzero(first.cost + onward[0] <= bound)
    state = _start(first.take(kept), kept)
    states = [state]
    costs = changes(rules, len(durations))
    for layer, duration, change, rest in zip(layers[1:], durations, costs, onward[1:], strict=True):
        steps, turns = step_costs(rules, state, layer, float(duration), float(change))
        total = state.cost[:, None] + steps
        came = first_least(total)
        cost = total[came, np.arange(len(layer.q))] + layer.cost
        kept = np.flatnonzero((cost + rest <= bound) & np.isfinite(cost))
        if not kept.size:
            break
        state = _moved(state, layer, cost, came, kept, turns, rules)
        states.append(state)
    return states


def least_onward(layers: list[Layer], rules: Rules) -> FloatArray:
    """What the way on from each layer to the end costs at least [s], shape (n,).

    The least that each step would cost if all joints could go the short way round.
    """
    once = [_once(layer.q) for layer in layers]
    least = np.zeros(len(layers))
    for i, (before, after) in enumerate(itertools.pairwise(once)):
        move = before[:, None, :] - after[None, :, :]
        move -= FULL_TURN * np.round(move / FULL_TURN)
        travel = np.linalg.norm(move / rules.speed, axis=2).min()
        least[i] = rules.travel * travel + layers[i + 1].cost.min()
    return np.asarray(np.cumsum(least[::-1])[::-1])


def _once(q: FloatArray) -> FloatArray:
    """Configurations that are more than turns apart, each once."""
    turned = np.rint(1e9 * (q - FULL_TURN * np.round(q / FULL_TURN))).astype(np.int64)
    rows = {row.tobytes(): i for i, row in enumerate(turned)}
    return np.asarray(q[list(rows.values())])


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
    return np.argmax(cost <= finite + TIE + RELATIVE_TIE * np.abs(finite), axis=0)
