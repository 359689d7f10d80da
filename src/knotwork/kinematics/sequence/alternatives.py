"""The next best choice: the best sequence that passes a waypoint in another branch."""

from __future__ import annotations

from collections.abc import Sequence as Many
from dataclasses import dataclass
from typing import Any

import numpy as np

from knotwork.kinematics.sequence.choice import (
    Sequence,
    first_least,
    reach,
    way_to,
    widened,
)
from knotwork.kinematics.sequence.costs import (
    Layer,
    Reached,
    Rules,
    changes,
    step_costs,
)
from knotwork.waypoints import FloatArray

# Copies of each branch that a first guess at the next best sequence is made with: those nearest
# the sequence chosen.
COPIES = 2


@dataclass(frozen=True, eq=False)
class RunnerUp:
    """The best sequence that has another branch at one waypoint.

    Attributes:
        index: Its candidate at each waypoint.
        cost: What it costs [s].
    """

    index: tuple[int, ...]
    cost: float


def runners_up(
    layers: list[Layer],
    durations: FloatArray,
    rules: Rules,
    chosen: Sequence,
    branches: Many[Any],
    *,
    turns: bool = False,
) -> list[RunnerUp | None]:
    """Find for each waypoint the best sequence that passes it in another branch.

    The cheapest way to each candidate and the cheapest way on from it give the cheapest sequence
    through it, for all waypoints at once. A first guess with few candidates bounds what that
    may cost, so that most candidates can be left out.

    Args:
        layers: The candidates at each of n waypoints.
        durations: Time between them [s], shape (n - 1,).
        rules: What steps cost.
        chosen: The best sequence.
        branches: For each layer the branch of each candidate, shape (m,).
        turns: Other turns of the same branch count as well.

    Returns:
        For each waypoint the runner-up, or `None` where all that is allowed is of one branch.
    """
    few = [
        _few(layer, branch, q, k, rules)
        for layer, branch, q, k in zip(layers, branches, chosen.q, chosen.index, strict=True)
    ]
    groups = [np.arange(len(layer.q)) for layer in layers] if turns else branches
    guess = _ways(
        [layer.take(k) for layer, k in zip(layers, few, strict=True)],
        durations,
        rules,
        [group[k] != group[own] for group, k, own in zip(groups, few, chosen.index, strict=True)],
        np.inf,
    )
    bounds = [cost.min() for cost in guess[1]] if guess is not None else []
    bounds = [bound for bound in bounds if np.isfinite(bound)]
    if not bounds:
        return [None] * len(layers)
    others = [group != group[k] for group, k in zip(groups, chosen.index, strict=True)]
    return _through(layers, durations, rules, others, widened(max(bounds)))


def _few(layer: Layer, group: Any, q: FloatArray, own: int, rules: Rules) -> Any:
    """The copies of each branch, and signs, that are nearest the sequence chosen, in order."""
    gap = layer.q - q
    if not layer.fixed:
        turns = 2 * np.pi * np.round(gap / (2 * np.pi))
        gap = np.where(rules.unbounded, gap - turns, gap)
    order = np.argsort(np.linalg.norm(gap / rules.speed, axis=1), kind="stable")
    kept = {own}
    kinds = np.unique(np.column_stack([group, layer.signs]), axis=0, return_inverse=True)[1].ravel()
    for kind in range(kinds.max() + 1):
        kept.update(order[kinds[order] == kind][:COPIES].tolist())
    return np.array(sorted(kept))


def _through(
    layers: list[Layer],
    durations: FloatArray,
    rules: Rules,
    others: Many[Any],
    bound: float,
) -> list[RunnerUp | None]:
    """The best sequence through one of the candidates asked for at each layer, within a bound."""
    ways = _ways(layers, durations, rules, others, bound)
    if ways is None:
        return [None] * len(layers)
    states, costs, follows = ways
    found: list[RunnerUp | None] = []
    for i, cost in enumerate(costs):
        row = int(first_least(cost[:, None])[0])
        if not np.isfinite(cost[row]):
            found.append(None)
            continue
        rows = way_to(states[: i + 1], row)
        for after in follows[i:]:
            rows.append(int(after[rows[-1]]))
        index = tuple(int(s.index[r]) for s, r in zip(states, rows, strict=True))
        found.append(RunnerUp(index, float(cost[row])))
    return found


def _ways(
    layers: list[Layer],
    durations: FloatArray,
    rules: Rules,
    others: Many[Any],
    bound: float,
) -> tuple[list[Reached], list[FloatArray], list[Any]] | None:
    """What is kept of each layer, the cost of the best way through that, and where it goes on.

    Through candidates that are not asked for the cost is infinite. `None` if there is no way.
    """
    states = reach(layers, durations, rules, bound)
    if len(states) < len(layers):
        return None
    onward, follows = _ways_on(layers, states, durations, rules)
    costs = [
        np.where(wanted[state.index], state.cost + rest, np.inf)
        for state, wanted, rest in zip(states, others, onward, strict=True)
    ]
    return states, costs, follows


def _ways_on(
    layers: list[Layer], states: list[Reached], durations: FloatArray, rules: Rules
) -> tuple[list[FloatArray], list[Any]]:
    """Cost of the cheapest way to the end from what is kept of each layer, and where it goes."""
    onward = [np.zeros(len(states[-1].index))]
    follows: list[Any] = []
    prices = changes(rules, len(durations))
    for i in range(len(layers) - 2, -1, -1):
        layer = layers[i + 1].take(states[i + 1].index)
        steps, _ = step_costs(rules, states[i], layer, float(durations[i]), float(prices[i]))
        total = (steps + (layer.cost + onward[0])).T
        row = first_least(total)
        onward.insert(0, total[row, np.arange(total.shape[1])])
        follows.insert(0, row)
    return onward, follows
