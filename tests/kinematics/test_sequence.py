"""The choice over the whole sequence, and the next best: equal to trying every one."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from knotwork.kinematics.sequence import (
    Cost,
    Layer,
    Rules,
    choose_sequence,
)
from sweeps import examples

SPEED = np.array([3.0, 2.0])
QUARTERS = (0.25, 0.5, 0.75)
RAMP = np.array([0.2, 1.5])
HIGHEST = np.array([4.1, np.inf])
BOUNDED = np.zeros(2, dtype=bool)
# Which changes of branch are avoided, and whether they are forbidden.
CHANGES = [(False, False), (True, False), ("some", False), (False, True)]


def layers_of(seed: int, sizes: list[int], spread: float = 4.0) -> list[Layer]:
    generator = np.random.default_rng(seed)
    return [
        Layer(
            q=generator.uniform(-spread, spread, (m, 2)),
            cost=Cost(
                impossible=generator.choice([0.0, 1.2], m, p=[0.9, 0.1]),
                infeasible=generator.choice([0.0, 1.5], m, p=[0.9, 0.1]),
                distance=generator.choice([0.0, 0.7], m),
                travel=generator.choice([0.0, 0.3], m),
            ),
            weight=generator.uniform(1, 3, m),
            flags=generator.choice([-1.0, 1.0], (m, 2)),
            velocity=generator.uniform(-2, 2, (m, 2)),
        )
        for m in sizes
    ]


def rules_of(change: Any, intervals: int) -> Rules:
    avoided, forbidden = change
    if avoided == "some":
        avoided = np.arange(intervals) % 2 == 1
    resting = np.arange(intervals) % 3 != 0
    return Rules(
        SPEED, SPEED, BOUNDED, -HIGHEST, HIGHEST, avoided, forbidden, resting=resting, ramp=RAMP
    )


def resting_time(distance: float, speed: float, ramp: float) -> float:
    """Rest to rest with acceleration speed/ramp: the time under a trapezium or a triangle."""
    acceleration = speed / ramp
    if distance > speed * ramp:
        return 2 * ramp + (distance - speed * ramp) / speed
    return 2 * float(np.sqrt(distance / acceleration))


def cost_of(
    layers: list[Layer], index: tuple[int, ...], durations: np.ndarray, rules: Rules
) -> tuple[float, ...]:
    """The cost of one sequence, written out, what counts first before the rest."""
    total = dict.fromkeys(Cost._fields, 0.0)
    for layer, k in zip(layers, index, strict=True):
        for level, cost in layer.cost._asdict().items():
            total[level] += float(np.broadcast_to(cost, len(layer.q))[k])
    for i in range(len(index) - 1):
        here, there = layers[i], layers[i + 1]
        a, b = index[i], index[i + 1]
        move = np.abs(there.q[b] - here.q[a]) / SPEED
        travel = float(np.hypot(*move))
        if rules.resting is not None and rules.resting[i]:
            each = zip(move * SPEED, SPEED, RAMP, strict=True)
            travel = 0.1 * travel + max(resting_time(*one) for one in each)
        total["travel"] += travel * (here.weight[a] + there.weight[b]) / 2
        if move.max() > durations[i]:
            total["infeasible"] += move.max() / durations[i]
        # The cubic by its Bézier points, and its derivative in the middle by de Casteljau.
        third = durations[i] / 3
        points = [here.q[a], here.q[a] + third * here.velocity[a]]
        points += [there.q[b] - third * there.velocity[b], there.q[b]]
        legs = np.diff(points, axis=0) / third
        halfway = np.abs(legs[0] + 2 * legs[1] + legs[2]) / 4 / SPEED
        if halfway.max() > 1:
            total["violation"] += 2 - 1 / halfway.max()
        basis = np.array(
            [[(1 - s) ** 3, 3 * s * (1 - s) ** 2, 3 * s**2 * (1 - s), s**3] for s in QUARTERS]
        )
        beyond = float((np.abs(basis @ points) - HIGHEST).max())
        total["violation"] += 1 + beyond if beyond > 1e-9 else 0.0
        if (here.flags[a] != there.flags[b]).any():
            total["impossible"] += np.inf if rules.forbidden else 0.0
            total["changes"] += np.broadcast_to(rules.avoided, len(durations))[i]
    return tuple(round(level, 9) for level in total.values())


@examples(40)
@given(
    st.integers(0, 10**6),
    st.lists(st.integers(1, 5), min_size=2, max_size=5),
    st.sampled_from(CHANGES),
    st.floats(0.3, 3.0),
)
def test_equal_to_trying_every_sequence(
    seed: int, sizes: list[int], change: Any, duration: float
) -> None:
    layers = layers_of(seed, sizes)
    durations = np.full(len(sizes) - 1, duration)
    rules = rules_of(change, len(durations))
    chosen = choose_sequence(layers, durations, rules)
    every = itertools.product(*(range(m) for m in sizes))
    best = min(cost_of(layers, index, durations, rules) for index in every)
    if np.isinf(best[0]):
        assert chosen.blocked is not None
        return
    assert tuple(chosen.cost) == pytest.approx(best)
    assert cost_of(layers, chosen.index, durations, rules) == pytest.approx(best)
    for layer, k, q in zip(layers, chosen.index, chosen.q, strict=True):
        np.testing.assert_array_equal(q, layer.q[k])


@pytest.mark.parametrize("size", [2, 5])
def test_of_sequences_that_cost_the_same_the_first_candidates_win(size: int) -> None:
    """Rounding of the last digits, which differs between machines, does not decide."""
    generator = np.random.default_rng(size)
    ring = 2 * np.pi * np.arange(size) / size
    circle = np.column_stack([np.cos(ring), np.sin(ring)])
    for _ in range(20):
        layers = [
            Layer(q, Cost(travel=np.zeros(len(q))), np.ones(len(q)), np.zeros((len(q), 1)))
            for q in (
                np.zeros((1, 2)),
                circle * (1 + 1e-14 * generator.normal(size=(size, 1))),
                np.zeros((1, 2)),
            )
        ]
        chosen = choose_sequence(layers, np.ones(2), Rules(np.ones(2), SPEED, BOUNDED))
        assert chosen.index == (0, 0, 0)


@examples(20)
@given(st.integers(0, 10**6), st.lists(st.integers(1, 4), min_size=2, max_size=5))
def test_joints_without_limits_go_the_short_way(seed: int, sizes: list[int]) -> None:
    layers = layers_of(seed, sizes, spread=30.0)
    durations = np.full(len(sizes) - 1, 100.0)
    chosen = choose_sequence(layers, durations, Rules(SPEED, SPEED, ~BOUNDED))
    assert np.abs(np.diff(chosen.q, axis=0)).max() <= np.pi + 1e-9
    for layer, k, q in zip(layers, chosen.index, chosen.q, strict=True):
        turns = (q - layer.q[k]) / (2 * np.pi)
        np.testing.assert_allclose(turns, np.round(turns), atol=1e-9)


def test_a_given_position_is_met_at_its_own_turn() -> None:
    one, cost = np.ones(1), Cost(travel=np.zeros(1))
    flags = np.zeros((1, 1))
    layers = [
        Layer(np.array([[3.0, 0.0]]), cost, one, flags, fixed=True),
        Layer(np.array([[-3.0, 0.0]]), cost, one, flags),
        Layer(np.array([[-3.0, 0.0]]), cost, one, flags, fixed=True),
    ]
    rules = Rules(SPEED, SPEED, ~BOUNDED)
    chosen = choose_sequence(layers, np.ones(2), rules)
    np.testing.assert_allclose(chosen.q[:, 0], [3.0, 2 * np.pi - 3.0, -3.0])


@pytest.mark.parametrize("level", Cost._fields)
def test_equal_costs_take_the_first_whatever_their_rounding(level: str) -> None:
    value = np.array([[2.0 + 1e-12, 1.0], [2.0, 1.0 - 1e-12], [2.0 - 1e-12, 0.9]])
    cost = Cost(travel=np.zeros((3, 2)))._replace(**{level: value})
    np.testing.assert_array_equal(cost.first_least(), [0, 2])


def test_an_infeasible_interval_does_not_blur_what_follows_it() -> None:
    """Travel counts to the last digit, however much the interval before it is beyond limits."""
    layers = layers_of(3, [4] * 1000, spread=0.3)
    layers = [layer._replace(cost=Cost(travel=np.zeros(4)), velocity=None) for layer in layers]
    layers[0] = layers[0]._replace(q=layers[0].q + 3.0)
    durations = np.r_[0.8, np.full(998, 10.0)]  # of the first, half of what it takes
    rules = Rules(SPEED, SPEED, BOUNDED)
    rules = rules._replace(avoided=True)
    chosen = choose_sequence(layers, durations, rules)
    assert chosen.cost.infeasible > 1.0
    first = layers[1].take([chosen.index[1]])
    best = choose_sequence([first, *layers[2:]], durations[1:], rules)
    taken = [layer.take([k]) for layer, k in zip(layers, chosen.index, strict=True)]
    rest = choose_sequence(taken[1:], durations[1:], rules)
    assert tuple(rest.cost) == pytest.approx(tuple(best.cost), rel=1e-12)
