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
# Costs that differ by less [s, relative above 1 s] are equal: then the first candidate wins, on
# every machine.
TIE = 1e-9


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
    """

    q: FloatArray
    cost: FloatArray
    weight: FloatArray
    signs: FloatArray
    fixed: bool = False


@dataclass(frozen=True, eq=False)
class Rules:
    """What a step from one waypoint to the next costs.

    Attributes:
        speed: What joint speeds are measured by [rad/s or m/s], shape (d,): the velocity limits,
            and something else where there is none.
        limit: Velocity limits [rad/s or m/s], shape (d,), infinite where there is none.
        unbounded: Joints that turn without limit, shape (d,).
        travel: Factor of the travel.
        change: Cost of a change of branch [s], infinite where it is forbidden.
    """

    speed: FloatArray
    limit: FloatArray
    unbounded: Any
    travel: float = 1.0
    change: float = 0.0


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


def step_costs(
    rules: Rules,
    before: FloatArray,
    weight_before: FloatArray,
    signs_before: FloatArray,
    layer: Layer,
    duration: float,
) -> tuple[FloatArray, FloatArray]:
    """Cost of each step between two waypoints, and how far the joints turn.

    Args:
        rules: What steps cost.
        before: Positions at the waypoint before, shape (l, d).
        weight_before: Factors of travel there, shape (l,).
        signs_before: What tells branches apart there, shape (l, k).
        layer: The candidates that steps lead to, m of them.
        duration: Time for the step [s].

    Returns:
        Costs, shape (l, m), and the motion of the joints without limits, shape (u, l, m).
    """
    square = np.zeros((len(before), len(layer.q)))
    fastest, buffer = np.zeros_like(square), np.empty_like(square)
    turns: list[FloatArray] = []
    for j, speed in enumerate(rules.speed):
        move = np.subtract.outer(before[:, j], layer.q[:, j], out=buffer)
        if rules.unbounded[j] and not layer.fixed:
            move -= FULL_TURN * np.round(move / FULL_TURN)
            turns.append(-move)
        np.abs(move, out=move)
        move /= speed
        if np.isfinite(rules.limit[j]):
            np.maximum(fastest, move, out=fastest)
        move *= move
        square += move
    fastest /= duration
    cost = rules.travel * np.sqrt(square)
    cost *= 0.5 * (weight_before[:, None] + layer.weight[None, :])
    too_fast = fastest > 1.0
    if too_fast.any():
        cost[too_fast] += INFEASIBLE * fastest[too_fast]
    if rules.change:
        product = signs_before[:, None, :] * layer.signs[None, :, :]
        cost[(product < 0).any(axis=2)] += rules.change
    return cost, np.array(turns)


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
    bound = _greedy_cost(layers, durations, rules) * (1.0 + 1e-6) + 1e-6
    first = layers[0]
    kept = np.flatnonzero(first.cost <= bound)
    state = _Reached(first.cost[kept], first.q[kept], first.signs[kept], first.weight[kept], kept)
    chosen: list[Any] = []
    states = [state]
    for i, layer in enumerate(layers[1:]):
        steps, turns = step_costs(
            rules, state.q, state.weight, state.signs, layer, float(durations[i])
        )
        total = state.cost[:, None] + steps
        came = first_least(total)
        cost = total[came, np.arange(len(layer.q))] + layer.cost
        if not np.isfinite(cost).any():
            return Sequence((), np.empty((0, state.q.shape[1])), np.inf, blocked=i + 1)
        # Costs only grow: what has cost more than some way to the end is on no cheaper one.
        kept = np.flatnonzero(cost <= bound)
        came = came[kept]
        q = layer.q[kept]
        if not layer.fixed:
            for row, j in enumerate(np.flatnonzero(rules.unbounded)):
                q[:, j] = state.q[came, j] + turns[row][came, kept]
        # On a singularity a branch has no sign of its own, and keeps that of the way to it.
        signs = np.where(layer.signs[kept] == 0.0, state.signs[came], layer.signs[kept])
        state = _Reached(cost[kept], q, signs, layer.weight[kept], kept)
        chosen.append(came)
        states.append(state)
    row = int(first_least(state.cost[:, None])[0])
    least = float(state.cost[row])
    rows = [row]
    for came in reversed(chosen):
        rows.append(int(came[rows[-1]]))
    rows.reverse()
    index = tuple(int(s.index[row]) for s, row in zip(states, rows, strict=True))
    return Sequence(index, np.array([s.q[r] for s, r in zip(states, rows, strict=True)]), least)


@dataclass(frozen=True, eq=False)
class _Reached:
    """The candidates of a layer that the best sequence may pass, and the cheapest way to each."""

    cost: FloatArray
    q: FloatArray
    signs: FloatArray
    weight: FloatArray
    index: Any


def _greedy_cost(layers: list[Layer], durations: FloatArray, rules: Rules) -> float:
    """Cost of going from each waypoint to the candidate that is cheapest next."""
    first = layers[0]
    k = int(np.argmin(first.cost))
    q, weight, signs, cost = first.q[[k]], first.weight[[k]], first.signs[[k]], first.cost[k]
    for i, layer in enumerate(layers[1:]):
        steps, turns = step_costs(rules, q, weight, signs, layer, float(durations[i]))
        total = steps[0] + layer.cost
        k = int(np.argmin(total))
        cost += total[k]
        before, q = q, layer.q[[k]]
        if not layer.fixed:
            for row, j in enumerate(np.flatnonzero(rules.unbounded)):
                q[0, j] = before[0, j] + turns[row][0, k]
        signs = np.where(layer.signs[[k]] == 0.0, signs, layer.signs[[k]])
        weight = layer.weight[[k]]
    return float(cost)


def first_least(cost: FloatArray) -> Any:
    """For each column the first row that is as good as the least, but for rounding."""
    least = cost.min(axis=0)
    finite = np.where(np.isfinite(least), least, 0.0)
    return np.argmax(cost <= finite + TIE * np.maximum(1.0, np.abs(finite)), axis=0)
