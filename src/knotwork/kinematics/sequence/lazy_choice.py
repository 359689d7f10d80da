"""The best sequence where what lies between the waypoints counts, too."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from knotwork.kinematics.sequence.choice import (
    Sequence,
    choose_sequence,
    first_least,
    positions_of,
    reach,
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

# Of each interval so many steps are looked at in the first round, those that look best so far, and
# twice as many in each round after it.
LOOKED_AT = 16

# Interval and candidates at its two ends, each of shape (k,), in; what the way there costs beyond
# what its ends alone make certain [s], at least 0, shape (k,), out.
Surcharge = Callable[[Any, Any, Any], FloatArray]


def choose_with_passages(
    layers: list[Layer], durations: FloatArray, rules: Rules, samples: int, surcharge: Surcharge
) -> Sequence:
    """Choose the sequence of least cost, the weight of travel being the mean along the way.

    A step takes its travel times 1 and the mean nearness on the way, and its time times the most.
    To look at it is dear, so it counts at first as if nothing were near but its ends: it can't cost
    less. The steps of the sequence that is best so far, and those
    that come next, are looked at and cost more from then on, until the best sequence has been
    looked at all the way. That is the best of all (Dellin and Srinivasa, 2016).

    Args:
        layers: The candidates at each of n waypoints, at least one in each.
        durations: Time between them [s], shape (n - 1,).
        rules: What steps cost.
        samples: Times between two waypoints at which steps are looked at; ends count half each.
        surcharge: Looks at steps.
    """
    least = [replace(layer, weight=1.0 + (layer.weight - 1.0) / (samples + 1)) for layer in layers]
    first = choose_sequence(least, durations, rules)
    if first.blocked is not None:
        return first
    near = [layer.weight - 1.0 for layer in layers]
    index = np.array(first.index)
    more = surcharge(np.arange(len(durations)), index[:-1], index[1:])
    own = np.array([one[k] for one, k in zip(near, index, strict=True)])
    waits = durations * np.maximum(own[1:], own[:-1])
    states = reach(least, durations, rules, widened(first.cost + float((more + waits).sum())))
    steps = _steps(least, states, durations, rules)
    for i, (step, duration) in enumerate(zip(steps, durations, strict=True)):
        a, b = near[i][states[i].index], near[i + 1][states[i + 1].index]
        step += duration * np.maximum.outer(a, b)
    unknown = [np.ones(step.shape, dtype=bool) for step in steps]
    count = LOOKED_AT
    while True:
        ways, rows = _ways(states[0].cost, steps)
        if not any(new[pair] for new, pair in zip(unknown, _pairs(rows), strict=True)):
            break
        _look(states, steps, unknown, ways, surcharge, count)
        count *= 2
    best = tuple(int(state.index[row]) for state, row in zip(states, rows, strict=True))
    return Sequence(best, positions_of(layers, best, rules), float(ways[0].min()))


def _steps(
    layers: list[Layer], states: list[Reached], durations: FloatArray, rules: Rules
) -> list[FloatArray]:
    """Cost of each step and of being where it leads [s]."""
    prices = changes(rules, len(durations))
    result = []
    for i, duration in enumerate(durations):
        layer = layers[i + 1].take(states[i + 1].index)
        cost, _ = step_costs(rules, states[i], layer, float(duration), float(prices[i]))
        result.append(cost + layer.cost)
    return result


def _ways(start: FloatArray, steps: list[FloatArray]) -> tuple[list[FloatArray], list[int]]:
    """Cost of the best sequence by each step, and the rows of the best of all."""
    onward = [np.zeros(steps[-1].shape[1])]
    for step in reversed(steps):
        onward.insert(0, (step + onward[0]).min(axis=1))
    ways, cost = [], start
    rows = [int(first_least((start + onward[0])[:, None])[0])]
    for step, after in zip(steps, onward[1:], strict=True):
        ways.append(cost[:, None] + step + after)
        cost = (cost[:, None] + step).min(axis=0)
        rows.append(int(first_least((step[rows[-1]] + after)[:, None])[0]))
    return ways, rows


def _pairs(rows: list[int]) -> list[tuple[int, int]]:
    return list(itertools.pairwise(rows))


def _look(
    states: list[Reached],
    steps: list[FloatArray],
    unknown: list[Any],
    ways: list[FloatArray],
    surcharge: Surcharge,
    count: int,
) -> None:
    """Look at the most promising steps of all intervals at once, and add what they cost."""
    intervals, starts, ends = [], [], []
    for i, (way, new) in enumerate(zip(ways, unknown, strict=True)):
        open_ = np.where(new & np.isfinite(way), way, np.inf).ravel()
        best = np.flatnonzero(np.isfinite(open_))
        if len(best) > count:
            best = best[np.argpartition(open_[best], count)[:count]]
            best.sort()
        a, b = np.divmod(best, way.shape[1])
        intervals.append(np.full(len(best), i))
        starts.append(a)
        ends.append(b)
    interval, a, b = (np.concatenate(one) for one in (intervals, starts, ends))
    more = surcharge(
        interval,
        np.array([states[i].index[row] for i, row in zip(interval, a, strict=True)]),
        np.array([states[i + 1].index[row] for i, row in zip(interval, b, strict=True)]),
    )
    for i, (step, new) in enumerate(zip(steps, unknown, strict=True)):
        here = interval == i
        step[a[here], b[here]] += more[here]
        new[a[here], b[here]] = False
