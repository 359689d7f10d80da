"""The choice over the whole sequence, and the next best: equal to trying every one."""

from __future__ import annotations

import itertools
import random
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from knotwork.kinematics.sequence.alternatives import runners_up
from knotwork.kinematics.sequence.choice import choose_sequence, first_least
from knotwork.kinematics.sequence.costs import (
    Layer,
    Prices,
    Rules,
    most_travel,
)
from knotwork.kinematics.sequence.lazy_choice import choose_with_passages
from sweeps import examples

SPEED = np.array([3.0, 2.0])
PRICES = Prices(infeasible=1e6, strained=1e5, change=50.0)


def layers_of(seed: int, sizes: list[int], spread: float = 4.0) -> list[Layer]:
    generator = np.random.default_rng(seed)
    return [
        Layer(
            q=generator.uniform(-spread, spread, (m, 2)),
            cost=generator.choice([0.0, 0.3, PRICES.infeasible], m, p=[0.6, 0.3, 0.1]),
            weight=generator.uniform(1, 3, m),
            signs=generator.choice([-1.0, 1.0], (m, 2)),
            velocity=generator.uniform(-2, 2, (m, 2)),
        )
        for m in sizes
    ]


def cost_of(
    layers: list[Layer],
    index: tuple[int, ...],
    durations: np.ndarray,
    change: float | np.ndarray,
) -> float:
    """The cost of one sequence, written out."""
    total = sum(layer.cost[k] for layer, k in zip(layers, index, strict=True))
    for i in range(len(index) - 1):
        here, there = layers[i], layers[i + 1]
        a, b = index[i], index[i + 1]
        move = np.abs(there.q[b] - here.q[a]) / SPEED
        total += np.hypot(*move) * (here.weight[a] + there.weight[b]) / 2
        if move.max() > durations[i]:
            total += PRICES.infeasible * move.max() / durations[i]
        # The cubic by its Bézier points, and its derivative in the middle by de Casteljau.
        third = durations[i] / 3
        points = [here.q[a], here.q[a] + third * here.velocity[a]]
        points += [there.q[b] - third * there.velocity[b], there.q[b]]
        legs = np.diff(points, axis=0) / third
        halfway = np.abs(legs[0] + 2 * legs[1] + legs[2]) / 4 / SPEED
        if halfway.max() > 1:
            total += PRICES.strained * (2 - 1 / halfway.max())
        if (here.signs[a] != there.signs[b]).any():
            total += np.broadcast_to(change, len(durations))[i]
    return total


@examples(40)
@given(
    st.integers(0, 10**6),
    st.lists(st.integers(1, 5), min_size=2, max_size=5),
    st.sampled_from([0.0, 50.0, np.inf]),
    st.floats(0.3, 3.0),
)
def test_equal_to_trying_every_sequence(
    seed: int, sizes: list[int], change: float, duration: float
) -> None:
    layers = layers_of(seed, sizes)
    durations = np.full(len(sizes) - 1, duration)
    if change == 50.0:  # in every other interval
        change = np.where(np.arange(len(durations)) % 2, 50.0, 0.0)
    rules = Rules(SPEED, SPEED, np.zeros(2, dtype=bool), PRICES, change=change)
    chosen = choose_sequence(layers, durations, rules)
    every = itertools.product(*(range(m) for m in sizes))
    best = min(cost_of(layers, index, durations, change) for index in every)
    if np.isinf(best):
        assert chosen.blocked is not None
        return
    assert chosen.cost == pytest.approx(best, rel=1e-9)
    assert cost_of(layers, chosen.index, durations, change) == pytest.approx(best, rel=1e-9)
    for layer, k, q in zip(layers, chosen.index, chosen.q, strict=True):
        np.testing.assert_array_equal(q, layer.q[k])


@examples(40)
@given(
    st.integers(0, 10**6),
    st.lists(st.integers(1, 5), min_size=2, max_size=4),
    st.sampled_from([0.0, 50.0, np.inf]),
    st.floats(0.3, 3.0),
    st.booleans(),
)
def test_the_next_best_is_that_of_trying_every_sequence(
    seed: int, sizes: list[int], change: float, duration: float, turns: bool
) -> None:
    """Through each waypoint in another branch, a branch having several copies."""
    layers = layers_of(seed, sizes)
    groups = [np.random.default_rng(seed + m).integers(0, 3, m) for m in sizes]
    for layer, group in zip(layers, groups, strict=True):  # a branch has its signs
        layer.signs[:] = np.column_stack([group > 0, group > 1]) * 2.0 - 1.0
    durations = np.full(len(sizes) - 1, duration)
    rules = Rules(SPEED, SPEED, np.zeros(2, dtype=bool), PRICES, change=change)
    chosen = choose_sequence(layers, durations, rules)
    if chosen.blocked is not None:
        return
    every = list(itertools.product(*(range(m) for m in sizes)))
    costs = np.array([cost_of(layers, index, durations, change) for index in every])
    others_up = runners_up(layers, durations, rules, chosen, groups, turns=turns)
    if turns:
        groups = [np.arange(m) for m in sizes]
    for i, found in enumerate(others_up):
        own = groups[i][chosen.index[i]]
        others = [groups[i][index[i]] != own for index in every]
        best = costs[others].min(initial=np.inf)
        if np.isinf(best):
            assert found is None
            continue
        assert found is not None
        assert found.cost == pytest.approx(best, rel=1e-9)
        assert cost_of(layers, found.index, durations, change) == pytest.approx(best, rel=1e-9)
        assert groups[i][found.index[i]] != own
        assert found.cost >= chosen.cost * (1 - 1e-12)


@examples(30)
@given(
    st.integers(0, 10**6),
    st.lists(st.integers(1, 7), min_size=2, max_size=4),
    st.floats(0.3, 3.0),
    st.integers(0, 4),
)
def test_looking_at_the_way_between_where_it_matters_is_looking_at_it_everywhere(
    seed: int, sizes: list[int], duration: float, samples: int
) -> None:
    layers = layers_of(seed, sizes)
    generator = np.random.default_rng(seed)
    more = [
        generator.choice([0.0, 1.0, 5.0], (m, n)) * generator.uniform(0.5, 1, (m, n))
        for m, n in itertools.pairwise(sizes)
    ]
    looked_at = set()

    def surcharge(interval: Any, start: Any, end: Any) -> np.ndarray:
        asked = list(zip(interval.tolist(), start.tolist(), end.tolist(), strict=True))
        assert len(set(asked)) == len(asked) > 0
        looked_at.update(asked)
        return np.array([more[i][a, b] for i, a, b in asked])

    durations = np.full(len(sizes) - 1, duration)
    rules = Rules(SPEED, SPEED, np.zeros(2, dtype=bool), PRICES)
    chosen = choose_with_passages(layers, durations, rules, samples, surcharge)

    def total(index: tuple[int, ...]) -> float:
        """Ends count less the more is looked at between, and the nearer one for all the time."""
        lighter = [
            replace(layer, weight=1 + (layer.weight - 1) / (samples + 1)) for layer in layers
        ]
        between = sum(more[i][a, b] for i, (a, b) in enumerate(itertools.pairwise(index)))
        near = [layer.weight[k] - 1 for layer, k in zip(layers, index, strict=True)]
        waits = duration * sum(max(pair) for pair in itertools.pairwise(near))
        return float(cost_of(lighter, index, durations, 0.0) + between + waits)

    every = itertools.product(*(range(m) for m in sizes))
    assert chosen.cost == pytest.approx(min(map(total, every)), rel=1e-9)
    assert total(chosen.index) == pytest.approx(chosen.cost, rel=1e-9)
    assert looked_at >= {(i, *pair) for i, pair in enumerate(itertools.pairwise(chosen.index))}


@examples(30)
@given(
    st.integers(0, 10**6),
    st.lists(st.integers(1, 4), min_size=2, max_size=4),
    st.floats(0.5, 3.0),
    st.randoms(use_true_random=False),
)
def test_the_order_of_the_candidates_matters_for_ties_alone(
    seed: int, sizes: list[int], duration: float, order: random.Random
) -> None:
    layers = layers_of(seed, sizes)
    rows = [order.sample(range(m), m) for m in sizes]
    durations = np.full(len(sizes) - 1, duration)
    rules = Rules(SPEED, SPEED, np.zeros(2, dtype=bool), PRICES)
    one = choose_sequence(layers, durations, rules)
    shuffled = [layer.take(row) for layer, row in zip(layers, rows, strict=True)]
    other = choose_sequence(shuffled, durations, rules)
    assert other.cost == pytest.approx(one.cost, rel=1e-9)
    # The costs are random numbers, and no two sequences cost the same.
    assert [row[k] for row, k in zip(rows, other.index, strict=True)] == list(one.index)


@pytest.mark.parametrize("size", [2, 5])
def test_of_sequences_that_cost_the_same_the_first_candidates_win(size: int) -> None:
    """Rounding of the last digits, which differs between machines, does not decide."""
    generator = np.random.default_rng(size)
    ring = 2 * np.pi * np.arange(size) / size
    circle = np.column_stack([np.cos(ring), np.sin(ring)])
    for _ in range(20):
        layers = [
            Layer(q, np.zeros(len(q)), np.ones(len(q)), np.zeros((len(q), 1)))
            for q in (
                np.zeros((1, 2)),
                circle * (1 + 1e-14 * generator.normal(size=(size, 1))),
                np.zeros((1, 2)),
            )
        ]
        chosen = choose_sequence(
            layers, np.ones(2), Rules(np.ones(2), SPEED, np.zeros(2, bool), PRICES)
        )
        assert chosen.index == (0, 0, 0)


@examples(20)
@given(st.integers(0, 10**6), st.lists(st.integers(1, 4), min_size=2, max_size=5))
def test_joints_without_limits_go_the_short_way(seed: int, sizes: list[int]) -> None:
    layers = layers_of(seed, sizes, spread=30.0)
    durations = np.full(len(sizes) - 1, 100.0)
    chosen = choose_sequence(layers, durations, Rules(SPEED, SPEED, np.ones(2, dtype=bool), PRICES))
    assert np.abs(np.diff(chosen.q, axis=0)).max() <= np.pi + 1e-9
    for layer, k, q in zip(layers, chosen.index, chosen.q, strict=True):
        turns = (q - layer.q[k]) / (2 * np.pi)
        np.testing.assert_allclose(turns, np.round(turns), atol=1e-9)


def test_a_given_position_is_met_at_its_own_turn() -> None:
    one = np.ones(1)
    signs = np.zeros((1, 1))
    layers = [
        Layer(np.array([[3.0, 0.0]]), 0 * one, one, signs, fixed=True),
        Layer(np.array([[-3.0, 0.0]]), 0 * one, one, signs),
        Layer(np.array([[-3.0, 0.0]]), 0 * one, one, signs, fixed=True),
    ]
    rules = Rules(SPEED, SPEED, np.ones(2, dtype=bool), PRICES)
    chosen = choose_sequence(layers, np.ones(2), rules)
    np.testing.assert_allclose(chosen.q[:, 0], [3.0, 2 * np.pi - 3.0, -3.0])


def test_equal_costs_take_the_first_whatever_their_rounding() -> None:
    cost = np.array([[2.0 + 1e-12, 1.0], [2.0, 1.0 - 1e-12], [2.0 - 1e-12, 0.9]])
    np.testing.assert_array_equal(first_least(cost), [0, 2])


def test_an_infeasible_interval_does_not_blur_what_follows_it() -> None:
    """Its price is many times the travel of a thousand waypoints, which counts all the same."""
    layers = layers_of(3, [4] * 1000, spread=0.3)
    layers = [replace(layer, cost=np.zeros(4), velocity=None) for layer in layers]
    layers[0] = replace(layers[0], q=layers[0].q + 3.0)
    durations = np.r_[0.8, np.full(998, 10.0)]  # of the first, half of what it takes
    rules = Rules(SPEED, SPEED, np.zeros(2, dtype=bool), PRICES)
    prices = Prices.above(most_travel(layers, rules), len(durations))
    rules = replace(rules, prices=prices, change=prices.change)
    chosen = choose_sequence(layers, durations, rules)
    assert chosen.cost > prices.infeasible
    first = layers[1].take([chosen.index[1]])
    best = choose_sequence([first, *layers[2:]], durations[1:], rules)
    taken = [layer.take([k]) for layer, k in zip(layers, chosen.index, strict=True)]
    assert choose_sequence(taken[1:], durations[1:], rules).cost < (1 + 1e-7) * best.cost
