"""The best sequence where the way between waypoints counts, too: intervals evaluated lazily."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from knotwork.kinematics.sequence.choice import Sequence, choose_sequence, positions_of, reach
from knotwork.kinematics.sequence.step_costs import TIE, Cost, Layer, Reached, Rules, step_costs
from knotwork.waypoints import FloatArray

# Steps of each interval that are evaluated in the first round, those that look best so far, and
# twice as many in each round after it.
EVALUATED = 16

# How far motions are beyond limits is rounded to multiples of this [rad or m], so that sums of it
# are exact.
GRAIN = 2.0**-30

# Interval and candidates at its two ends, each of shape (k,), in; what the way there costs beyond
# what its ends alone make certain, in `beyond` and `travel`, at least 0, shape (k,) each, out.
IntervalCost = Callable[[Any, Any, Any], Cost]
# Excess beyond limits and travel, the first to count before the other, as real and imaginary part:
# so NumPy adds and compares pairs.
Pairs: TypeAlias = NDArray[np.complex128]


def choose_with_intervals(
    layers: list[Layer],
    durations: FloatArray,
    rules: Rules,
    samples: int,
    interval_cost: IntervalCost,
) -> Sequence:
    """Choose the sequence of least cost, the weight of travel being the mean along the way.

    A step costs its travel times 1 and the mean nearness on the way, and its time times the most.
    That is expensive to evaluate. So a step counts at first as if nothing were near but its ends:
    it can't cost less. The steps of the sequence that is best so far, and those that come next, are
    evaluated and cost more from then on, until all steps of the best sequence have been evaluated.
    That is the best of all (Dellin and Srinivasa, 2016).

    Args:
        layers: The candidates at each of n waypoints, at least one in each.
        durations: Time between them [s], shape (n - 1,).
        rules: What steps cost.
        samples: Times between two waypoints at which steps are evaluated; ends count half each.
        interval_cost: Evaluates steps.
    """
    least = [layer._replace(weight=1.0 + (layer.weight - 1.0) / (samples + 1)) for layer in layers]
    first = choose_sequence(least, durations, rules)
    if first.blocked is not None:
        return first
    near = [layer.weight - 1.0 for layer in layers]
    index = np.array(first.index)
    more = interval_cost(np.arange(len(durations)), index[:-1], index[1:])
    own = np.array([one[k] for one, k in zip(near, index, strict=True)])
    waits = durations * np.maximum(own[1:], own[:-1])
    extra = Cost(beyond=float(more.beyond.sum()), travel=float((more.travel + waits).sum()))
    states = reach(least, durations, rules, first.cost.plus(extra))
    start, steps = _travel(least, states, durations, rules)
    for i, (step, duration) in enumerate(zip(steps, durations, strict=True)):
        a, b = near[i][states[i].index], near[i + 1][states[i + 1].index]
        step.imag += duration * np.maximum.outer(a, b)
    unknown = [np.ones(step.shape, dtype=bool) for step in steps]
    count = EVALUATED
    while True:
        ways, onward = _ways(start, steps)
        rows = _best(start, steps, onward)
        pairs = itertools.pairwise(rows)
        if not any(new[pair] for new, pair in zip(unknown, pairs, strict=True)):
            break
        _evaluate(states, steps, unknown, ways, interval_cost, count)
        count *= 2
    best = tuple(int(state.index[row]) for state, row in zip(states, rows, strict=True))
    total = ways[0].min()
    cost = first.cost._replace(beyond=float(total.real), travel=float(total.imag))
    return Sequence(best, positions_of(layers, best, rules), cost)


def _travel(
    layers: list[Layer], states: list[Reached], durations: FloatArray, rules: Rules
) -> tuple[Pairs, list[Pairs]]:
    """Travel of the first candidates and of each step [s], infinite off the best sequences.

    The way between waypoints adds to what counts last alone. So only sequences matter that are best
    in all that counts before it.
    """
    costs = []
    for i, duration in enumerate(durations):
        layer = layers[i + 1].take(states[i + 1].index)
        step, _ = step_costs(rules, states[i].layer, layer, float(duration), i)
        costs.append(step.plus(layer.cost))
    shapes = [cost.travel.shape for cost in costs]
    allowed = [np.ones(shape, dtype=bool) for shape in shapes]
    start = states[0].layer.cost
    for level in range(len(start) - 2):
        if not (np.ndim(start[level]) or any(np.ndim(cost[level]) for cost in costs)):
            continue
        steps = [
            np.where(open_, np.broadcast_to(cost[level], open_.shape), np.inf)
            for cost, open_ in zip(costs, allowed, strict=True)
        ]
        ways, _ = _ways(np.broadcast_to(start[level], shapes[0][:1]), steps)
        most = ways[0].min() * (1.0 + TIE) + TIE
        allowed = [way <= most for way in ways]
    travel = [
        np.where(open_, 1j * cost.travel, np.inf)
        for cost, open_ in zip(costs, allowed, strict=True)
    ]
    return 1j * start.travel, travel


def _ways(start: Any, steps: list[Any]) -> tuple[list[Any], list[Any]]:
    """Cost of the best sequence by each step, and of the best way on from each candidate."""
    onward = [np.zeros(steps[-1].shape[1])]
    for step in reversed(steps):
        onward.insert(0, (step + onward[0]).min(axis=1))
    ways, cost = [], start
    for step, after in zip(steps, onward[1:], strict=True):
        there = cost[:, None] + step
        ways.append(there + after)
        cost = there.min(axis=0)
    return ways, onward


def _best(start: Pairs, steps: list[Pairs], onward: list[Pairs]) -> list[int]:
    """The rows of the best sequence of all."""
    rows: list[int] = []
    for i, after in enumerate(onward):
        cost = (steps[i - 1][rows[-1]] if rows else start) + after
        rows.append(int(Cost(beyond=cost.real, travel=cost.imag).first_least()))
    return rows


def _evaluate(
    states: list[Reached],
    steps: list[Pairs],
    unknown: list[Any],
    ways: list[Pairs],
    interval_cost: IntervalCost,
    count: int,
) -> None:
    """Evaluate the most promising steps of all intervals at once, and add what they cost."""
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
    more = interval_cost(
        interval,
        np.array([states[i].index[row] for i, row in zip(interval, a, strict=True)]),
        np.array([states[i + 1].index[row] for i, row in zip(interval, b, strict=True)]),
    )
    pairs = GRAIN * np.rint(more.beyond / GRAIN) + 1j * more.travel
    for i, (step, new) in enumerate(zip(steps, unknown, strict=True)):
        here = interval == i
        step[a[here], b[here]] += pairs[here]
        new[a[here], b[here]] = False
