"""Alternatives: the best sequence that passes a waypoint in another branch."""

from __future__ import annotations

from collections.abc import Sequence as Many
from dataclasses import dataclass
from typing import Any

import numpy as np

from knotwork.kinematics.chain.joint_ranges import whole_turns
from knotwork.kinematics.sequence.choice import Sequence, reach, way_to
from knotwork.kinematics.sequence.costs import (
    UNBOUNDED,
    Cost,
    Layer,
    Reached,
    Rules,
    step_costs,
)
from knotwork.waypoints import FloatArray

# Copies of each branch that a first guess at the alternatives is made with: those nearest the
# sequence chosen.
COPIES = 2


@dataclass(frozen=True, eq=False)
class AlternativeSequence:
    """The best sequence that has another branch at one waypoint.

    Attributes:
        index: Its candidate at each waypoint.
        cost: What it costs, numbers.
    """

    index: tuple[int, ...]
    cost: Cost


def find_alternatives(
    layers: list[Layer],
    durations: FloatArray,
    rules: Rules,
    chosen: Sequence,
    branches: Many[Any],
    *,
    turns: bool = False,
) -> list[AlternativeSequence | None]:
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
        For each waypoint the alternative, or `None` where all that is allowed is of one branch.
    """
    few = [
        _few(layer, branch, q, k, rules)
        for layer, branch, q, k in zip(layers, branches, chosen.q, chosen.index, strict=True)
    ]
    groups = [np.arange(len(layer.q)) for layer in layers] if turns else branches
    guess = _through(
        [layer.take(k) for layer, k in zip(layers, few, strict=True)],
        durations,
        rules,
        [group[k] != group[own] for group, k, own in zip(groups, few, chosen.index, strict=True)],
        UNBOUNDED,
    )
    bounds = [one.cost for one in guess if one is not None]
    if not bounds:
        return [None] * len(layers)
    others = [group != group[k] for group, k in zip(groups, chosen.index, strict=True)]
    return _through(layers, durations, rules, others, max(bounds))


def _few(layer: Layer, group: Any, q: FloatArray, own: int, rules: Rules) -> Any:
    """The copies of each branch, and flags, that are nearest the sequence chosen, in order."""
    gap = layer.q - q
    if not layer.fixed:
        gap = np.where(rules.unbounded, gap - whole_turns(gap), gap)
    order = np.argsort(np.linalg.norm(gap / rules.speed, axis=1), kind="stable")
    kept = {own}
    kinds = np.unique(np.column_stack([group, layer.flags]), axis=0, return_inverse=True)[1].ravel()
    for kind in range(kinds.max() + 1):
        kept.update(order[kinds[order] == kind][:COPIES].tolist())
    return np.array(sorted(kept))


def _through(
    layers: list[Layer],
    durations: FloatArray,
    rules: Rules,
    others: Many[Any],
    bound: Cost,
) -> list[AlternativeSequence | None]:
    """The best sequence through one of the candidates asked for at each layer, within a bound."""
    states = reach(layers, durations, rules, bound)
    if len(states) < len(layers):
        return [None] * len(layers)
    onward, follows = _ways_on(layers, states, durations, rules)
    found: list[AlternativeSequence | None] = []
    for i, (state, wanted, rest) in enumerate(zip(states, others, onward, strict=True)):
        cost = state.cost.plus(rest)
        cost = cost._replace(impossible=np.where(wanted[state.index], cost.impossible, np.inf))
        row = int(cost.first_least())
        if not np.isfinite(cost.impossible[row]):
            found.append(None)
            continue
        rows = way_to(states[: i + 1], row)
        for after in follows[i:]:
            rows.append(int(after[rows[-1]]))
        index = tuple(int(s.index[r]) for s, r in zip(states, rows, strict=True))
        found.append(AlternativeSequence(index, Cost(*(float(x) for x in cost.take(row)))))
    return found


def _ways_on(
    layers: list[Layer], states: list[Reached], durations: FloatArray, rules: Rules
) -> tuple[list[Cost], list[Any]]:
    """Cost of the cheapest way to the end from what is kept of each layer, and where it goes."""
    onward = [Cost(travel=np.zeros(len(states[-1].index)))]
    follows: list[Any] = []
    for i in range(len(layers) - 2, -1, -1):
        layer = layers[i + 1].take(states[i + 1].index)
        steps, _ = step_costs(rules, states[i], layer, float(durations[i]), i)
        rest = layer.cost.plus(onward[0])
        after = steps.plus(rest).first_least(axis=-1)
        step = steps.take((np.arange(len(after)), after))
        onward.insert(0, step.plus(rest.take(after)).without_zeros())
        follows.insert(0, after)
    return onward, follows
