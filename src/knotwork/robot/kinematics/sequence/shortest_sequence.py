"""The best choice of one configuration at each waypoint: the shortest path through layers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from knotwork.arrays import FloatArray, IndexArray
from knotwork.robot.kinematics.sequence.cost import CostLevel, is_within, lexicographic_argmin
from knotwork.robot.kinematics.sequence.step_costs import (
    JointRules,
    Layer,
    StepRules,
    compute_step_costs,
)

UNBOUNDED_COST = np.full(len(CostLevel), np.inf)


@dataclass(frozen=True, eq=False)
class ConfigurationSequence:
    """The chosen configurations at all waypoints.

    Attributes:
        index: Index of the candidate chosen at each waypoint.
        q: Joint positions; joints without limits at the turn they reach, shape (n, d).
        cost: Cost of the whole sequence, one value per `CostLevel`.
        blocked_at: Index of the first waypoint that no allowed candidate reaches, or `None`.
    """

    index: tuple[int, ...]
    q: FloatArray
    cost: FloatArray
    blocked_at: int | None = None


class _LayerState(NamedTuple):
    """The candidates of a layer that are kept, and the cheapest sequence to each.

    Attributes:
        layer: The candidates kept, at the turns that they reach; their cost includes the sequence.
        rows: Indices of these candidates in the whole layer, shape (m,).
        previous: Indices of their predecessors among those kept of the previous layer, shape (m,).
    """

    layer: Layer
    rows: IndexArray
    previous: IndexArray


def choose_sequence(
    layers: Sequence[Layer], joints: JointRules, steps: Sequence[StepRules]
) -> ConfigurationSequence:
    """Choose the minimum-cost sequence by dynamic programming (Bellman, 1957).

    The cost of a joint without limits depends on its shortest rotation in a step. Its number of
    turns only affects the cost where given positions follow later. There each candidate has the
    turn of the cheapest sequence to it.

    Args:
        layers: The candidates at each of n waypoints, at least one in each.
        joints: Rules for the joints.
        steps: Rules for each of the n - 1 intervals.
    """
    greedy = _find_cheapest_sequences(layers, joints, steps, UNBOUNDED_COST, greedy=True)
    bound = greedy[-1].layer.cost[:, 0] if len(greedy) == len(layers) else UNBOUNDED_COST
    states = _find_cheapest_sequences(layers, joints, steps, bound)
    if len(states) < len(layers):
        return ConfigurationSequence(
            (), np.empty((0, len(joints.speed))), UNBOUNDED_COST, blocked_at=len(states)
        )
    row = int(lexicographic_argmin(states[-1].layer.cost))
    cost = states[-1].layer.cost[:, row]
    index, positions = [], []
    for state in reversed(states):
        index.append(int(state.rows[row]))
        positions.append(state.layer.q[row])
        row = int(state.previous[row])
    return ConfigurationSequence(tuple(index[::-1]), np.array(positions[::-1]), cost)


def _find_cheapest_sequences(
    layers: Sequence[Layer],
    joints: JointRules,
    steps: Sequence[StepRules],
    bound: FloatArray,
    *,
    greedy: bool = False,
) -> list[_LayerState]:
    """Find the cheapest sequence to each candidate of each layer.

    Args:
        layers: The candidates at each of n waypoints.
        joints: Rules for the joints.
        steps: Rules for each of the n - 1 intervals.
        bound: Candidates that only more expensive sequences reach are left out, one value per
            `CostLevel`.
        greedy: Keep only the cheapest candidate of each layer.

    Returns:
        A state for each layer; fewer if the sequence is blocked.
    """
    states: list[_LayerState] = []
    for i, layer in enumerate(layers):
        cost, previous = layer.cost, np.zeros(len(layer.q), dtype=int)
        if states:
            before = states[-1].layer
            step, moves = compute_step_costs(joints, steps[i - 1], before, layer)
            previous = lexicographic_argmin(before.cost[:, :, None] + step)
            ends = np.arange(len(previous))
            cost = before.cost[:, previous] + step[:, previous, ends] + layer.cost
            if not layer.fixed:
                unbounded = joints.unbounded
                q = layer.q.copy()
                q[:, unbounded] = (before.q.T[:, previous] + moves[:, previous, ends]).T[
                    :, unbounded
                ]
                layer = layer._replace(q=q)
            # At a singularity a branch has no flag, so it takes the flag of the sequence to it.
            flags = np.where(layer.flags == 0.0, before.flags[previous], layer.flags)
            layer = layer._replace(flags=flags)
        feasible = np.isfinite(cost[CostLevel.IMPOSSIBLE])
        rows = np.flatnonzero(feasible & is_within(cost, bound))
        if greedy and rows.size:
            rows = rows[[lexicographic_argmin(cost[:, rows])]]
        if not rows.size:
            break
        layer = layer._replace(cost=cost)
        states.append(_LayerState(layer.select(rows), rows, previous[rows]))
    return states
