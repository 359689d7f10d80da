"""The best choice of one configuration at each waypoint: the shortest path through layers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from knotwork.kinematics.chain.joint_ranges import whole_turns
from knotwork.kinematics.sequence.cost import UNBOUNDED, Cost
from knotwork.kinematics.sequence.step_costs import (
    Layer,
    Reached,
    Rules,
    step_costs,
)
from knotwork.waypoints import FloatArray


@dataclass(frozen=True, eq=False)
class Sequence:
    """A chosen sequence.

    Attributes:
        index: Index of the candidate chosen at each waypoint.
        q: Joint positions; joints without limits at the turn they reach, shape (n, d).
        cost: Cost of the whole sequence, numbers.
        blocked: The first waypoint that no allowed candidate reaches, or `None`.
    """

    index: tuple[int, ...]
    q: FloatArray
    cost: Cost
    blocked: int | None = None


def choose_sequence(layers: list[Layer], durations: FloatArray, rules: Rules) -> Sequence:
    """Choose the minimum-cost sequence by dynamic programming (Bellman, 1957).

    The cost of a joint without limits depends on its shortest rotation in a step. The turn that it
    has reached matters only where given positions follow later; there the turn of the cheapest
    sequence to each candidate is used.

    Args:
        layers: The candidates at each of n waypoints, at least one in each.
        durations: Time between the waypoints [s], shape (n - 1,).
        rules: Rules for the cost of steps.
    """
    greedy = reach(layers, durations, rules, greedy=True)
    whole = len(greedy) == len(layers)
    bound = greedy[-1].layer.cost.take(0) if whole else UNBOUNDED
    states = reach(layers, durations, rules, bound)
    if len(states) < len(layers):
        return Sequence((), np.empty((0, len(rules.speed))), UNBOUNDED, blocked=len(states))
    last = int(states[-1].layer.cost.first_least())
    rows = way_to(states, last)
    index = tuple(int(s.index[row]) for s, row in zip(states, rows, strict=True))
    q = np.array([s.layer.q[row] for s, row in zip(states, rows, strict=True)])
    return Sequence(index, q, states[-1].layer.cost.take(last))


def reach(
    layers: list[Layer],
    durations: FloatArray,
    rules: Rules,
    bound: Cost = UNBOUNDED,
    *,
    greedy: bool = False,
) -> list[Reached]:
    """Find the cheapest sequence to each candidate of each layer.

    Args:
        layers: The candidates at each of n waypoints.
        durations: Time between the waypoints [s], shape (n - 1,).
        rules: Rules for the cost of steps.
        bound: Candidates without a sequence of at most this cost are left out.
        greedy: Keep only the cheapest candidate of each layer.

    Returns:
        A state for each layer; fewer if the sequence is blocked.
    """
    onward = _least_onward(layers, rules)
    first = layers[0]
    kept = np.flatnonzero(first.cost.plus(onward[0]).within(bound))
    if greedy:
        kept = np.array([first.cost.first_least()])
    states = [Reached(first.take(kept), kept, np.zeros(len(kept), dtype=int))]
    for i, (layer, duration) in enumerate(zip(layers[1:], durations, strict=True)):
        before = states[-1].layer
        steps, turns = step_costs(rules, before, layer, float(duration), i)
        came = before.cost.take((slice(None), None)).plus(steps).first_least()
        step = steps.take((came, np.arange(len(came))))
        cost = before.cost.take(came).plus(step).plus(layer.cost)
        inside = cost.plus(onward[i + 1]).within(bound) & np.isfinite(cost.impossible)
        kept = np.flatnonzero(inside)
        if greedy and kept.size:
            kept = kept[[cost.take(kept).first_least()]]
        if not kept.size:
            break
        states.append(_moved(before, layer, cost, came[kept], kept, turns, rules))
    return states


def _least_onward(layers: list[Layer], rules: Rules) -> list[Cost]:
    """Lower bound on the cost from each layer to the end, in distance and travel.

    The minimum cost of each step if all joints could take their shortest rotation.
    """
    once = [_once(layer.q) for layer in layers]
    least = [Cost()]
    for i in range(len(layers) - 2, -1, -1):
        layer, move = layers[i + 1], once[i][:, None, :] - once[i + 1][None, :, :]
        move -= whole_turns(move)
        travel = rules.travel(i, move).min() + layer.cost.travel.min()
        step = Cost(distance=np.min(layer.cost.distance), travel=travel)
        least.append(least[-1].plus(step))
    return least[::-1]


def _once(q: FloatArray) -> FloatArray:
    """Configurations that differ by more than whole turns, each once."""
    turned = np.rint(1e9 * (q - whole_turns(q))).astype(np.int64)
    rows = turned.view(np.dtype((np.void, turned.itemsize * turned.shape[1]))).ravel()
    return np.asarray(q[np.unique(rows, return_index=True)[1]])


def _moved(
    before: Layer,
    layer: Layer,
    cost: Cost,
    came: Any,
    kept: Any,
    turns: FloatArray,
    rules: Rules,
) -> Reached:
    """The candidates kept of a layer, each at the end of its cheapest sequence."""
    taken = layer.take(kept)
    if not layer.fixed:
        for row, j in enumerate(np.flatnonzero(rules.unbounded)):
            taken.q[:, j] = before.q[came, j] + turns[row][came, kept]
    # At a singularity a branch has no flag, and keeps the flag of the sequence to it.
    flags = np.where(taken.flags == 0.0, before.flags[came], taken.flags)
    return Reached(taken._replace(cost=cost.take(kept).without_zeros(), flags=flags), kept, came)


def way_to(states: list[Reached], row: int) -> list[int]:
    """Rows of the states along the cheapest sequence to a row of the last state."""
    rows = [row]
    for state in reversed(states[1:]):
        rows.append(int(state.came[rows[-1]]))
    rows.reverse()
    return rows
