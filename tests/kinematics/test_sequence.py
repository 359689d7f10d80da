"""The choice over the whole sequence, and the next best: equal to trying every one."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from knotwork.robot.kinematics.sequence import (
    CostLevel,
    JointRules,
    Layer,
    StepRules,
    choose_sequence,
    lexicographic_argmin,
    make_cost,
)
from sweeps import examples

SPEED = np.array([3.0, 2.0])
QUARTERS = (0.25, 0.5, 0.75)
RAMP = np.array([0.2, 1.5])
HIGHEST = np.array([4.1, np.inf])
BOUNDED = np.zeros(2, dtype=bool)
JOINTS = JointRules(SPEED, SPEED, -HIGHEST, HIGHEST, BOUNDED, np.ones(2), RAMP)
WIDE = JOINTS._replace(lower=np.full(2, -np.inf), upper=np.full(2, np.inf))
ENDLESS = WIDE._replace(unbounded=~BOUNDED)
CHANGES = ["allowed", "avoided", "some", "forbidden"]


def layers_of(seed: int, sizes: list[int], spread: float = 4.0) -> list[Layer]:
    generator = np.random.default_rng(seed)
    return [
        Layer(
            q=generator.uniform(-spread, spread, (m, 2)),
            cost=make_cost(
                m,
                impossible=generator.choice([0.0, 1.2], m, p=[0.9, 0.1]),
                overspeed=generator.choice([0.0, 1.5], m, p=[0.9, 0.1]),
                distance=generator.choice([0.0, 0.7], m),
                travel=generator.choice([0.0, 0.3], m),
            ),
            weight=generator.uniform(1, 3, m),
            flags=generator.choice([-1.0, 1.0], (m, 2)),
            velocity=generator.uniform(-2, 2, (m, 2)),
        )
        for m in sizes
    ]


def still_layer(q: np.ndarray, fixed: bool = False) -> Layer:
    m = len(q)
    return Layer(q, 0 * q, make_cost(m), np.ones(m), np.zeros((m, 1)), fixed=fixed)


def resting_time(distance: float, speed: float, ramp: float) -> float:
    """Rest to rest with acceleration speed/ramp: the time under a trapezium or a triangle."""
    acceleration = speed / ramp
    if distance > speed * ramp:
        return 2 * ramp + (distance - speed * ramp) / speed
    return 2 * float(np.sqrt(distance / acceleration))


def cost_of(
    layers: list[Layer], index: tuple[int, ...], steps: list[StepRules]
) -> tuple[float, ...]:
    """The cost of one sequence, written out, what counts first before the rest."""
    total = sum(layer.cost[:, k] for layer, k in zip(layers, index, strict=True))
    for i in range(len(index) - 1):
        here, there = layers[i], layers[i + 1]
        a, b = index[i], index[i + 1]
        move = np.abs(there.q[b] - here.q[a]) / SPEED
        travel = float(np.hypot(*move))
        duration = steps[i].duration
        if steps[i].rest_to_rest:
            each = zip(move * SPEED, SPEED, RAMP, strict=True)
            travel = 0.1 * travel + max(resting_time(*one) for one in each)
        total[CostLevel.TRAVEL] += travel * (here.weight[a] + there.weight[b]) / 2
        if move.max() > duration:
            total[CostLevel.OVERSPEED] += move.max() / duration
        # The cubic by its Bézier points, and its derivative in the middle by de Casteljau.
        third = duration / 3
        points = [here.q[a], here.q[a] + third * here.velocity[a]]
        points += [there.q[b] - third * there.velocity[b], there.q[b]]
        legs = np.diff(points, axis=0) / third
        halfway = np.abs(legs[0] + 2 * legs[1] + legs[2]) / 4 / SPEED
        if halfway.max() > 1:
            total[CostLevel.CUBIC_EXCESS] += 2 - 1 / halfway.max()
        basis = np.array(
            [[(1 - s) ** 3, 3 * s * (1 - s) ** 2, 3 * s**2 * (1 - s), s**3] for s in QUARTERS]
        )
        beyond = float((np.abs(basis @ points) - HIGHEST).max())
        total[CostLevel.CUBIC_EXCESS] += 1 + beyond if beyond > 1e-9 else 0.0
        if (here.flags[a] != there.flags[b]).any():
            total[CostLevel.IMPOSSIBLE] += np.inf if steps[i].branch_change == "forbidden" else 0.0
            total[CostLevel.CHANGES] += steps[i].branch_change == "avoided"
    return tuple(round(float(level), 9) for level in total)


@examples()
@given(
    st.integers(0, 10**6),
    st.lists(st.integers(1, 5), min_size=2, max_size=5),
    st.sampled_from(CHANGES),
    st.floats(0.3, 3.0),
)
def test_equals_brute_force(seed: int, sizes: list[int], change: Any, duration: float) -> None:
    layers = layers_of(seed, sizes)
    intervals = len(sizes) - 1
    changes = ["allowed", "avoided"] * intervals if change == "some" else [change] * intervals
    steps = [StepRules(duration, changes[i], True, i % 3 != 0) for i in range(intervals)]
    chosen = choose_sequence(layers, JOINTS, steps)
    every = itertools.product(*(range(m) for m in sizes))
    best = min(cost_of(layers, index, steps) for index in every)
    if np.isinf(best[0]):
        assert chosen.blocked_at is not None
        return
    assert tuple(chosen.cost.tolist()) == pytest.approx(best)
    assert cost_of(layers, chosen.index, steps) == pytest.approx(best)
    for layer, k, q in zip(layers, chosen.index, chosen.q, strict=True):
        np.testing.assert_array_equal(q, layer.q[k])


@pytest.mark.parametrize("size", [2, 5])
def test_ties_go_to_first_candidates(size: int) -> None:
    """Rounding of the last digits, which differs between machines, does not decide."""
    generator = np.random.default_rng(size)
    ring = 2 * np.pi * np.arange(size) / size
    circle = np.column_stack([np.cos(ring), np.sin(ring)])
    for _ in range(20):
        layers = [
            still_layer(q)
            for q in (
                np.zeros((1, 2)),
                circle * (1 + 1e-14 * generator.normal(size=(size, 1))),
                np.zeros((1, 2)),
            )
        ]
        joints = WIDE._replace(speed=np.ones(2))
        chosen = choose_sequence(layers, joints, [StepRules(1.0)] * 2)
        assert chosen.index == (0, 0, 0)


@examples()
@given(st.integers(0, 10**6), st.lists(st.integers(1, 4), min_size=2, max_size=5))
def test_unbounded_joints_take_shortest_rotation(seed: int, sizes: list[int]) -> None:
    layers = layers_of(seed, sizes, spread=30.0)
    chosen = choose_sequence(layers, ENDLESS, [StepRules(100.0)] * (len(sizes) - 1))
    assert np.abs(np.diff(chosen.q, axis=0)).max() <= np.pi + 1e-9
    for layer, k, q in zip(layers, chosen.index, chosen.q, strict=True):
        turns = (q - layer.q[k]) / (2 * np.pi)
        np.testing.assert_allclose(turns, np.round(turns), atol=1e-9)


def test_given_position_keeps_its_turn() -> None:
    layers = [
        still_layer(np.array([[3.0, 0.0]]), fixed=True),
        still_layer(np.array([[-3.0, 0.0]])),
        still_layer(np.array([[-3.0, 0.0]]), fixed=True),
    ]
    chosen = choose_sequence(layers, ENDLESS, [StepRules(1.0)] * 2)
    np.testing.assert_allclose(chosen.q[:, 0], [3.0, 2 * np.pi - 3.0, -3.0])


@pytest.mark.parametrize("level", CostLevel)
def test_lexicographic_argmin_ignores_rounding(level: CostLevel) -> None:
    value = np.array([[2.0 + 1e-12, 1.0], [2.0, 1.0 - 1e-12], [2.0 - 1e-12, 0.9]])
    cost = make_cost(3, 2, **{level.name.lower(): value})
    np.testing.assert_array_equal(lexicographic_argmin(cost), [0, 2])


def test_infeasible_interval_does_not_hide_later_travel() -> None:
    """Travel counts to the last digit, however much the interval before it is beyond limits."""
    layers = [still_layer(layer.q) for layer in layers_of(3, [4] * 300, spread=0.3)]
    layers[0] = layers[0]._replace(q=layers[0].q + 3.0)
    # the first interval has half of the time that it takes
    steps = [StepRules(t, "avoided") for t in (0.8, *[10.0] * 298)]
    chosen = choose_sequence(layers, WIDE, steps)
    assert chosen.cost[CostLevel.OVERSPEED] > 1.0
    first = layers[1].select([chosen.index[1]])
    best = choose_sequence([first, *layers[2:]], WIDE, steps[1:])
    taken = [layer.select([k]) for layer, k in zip(layers[1:], chosen.index[1:], strict=True)]
    remaining = choose_sequence(taken, WIDE, steps[1:])
    assert remaining.cost == pytest.approx(best.cost, rel=1e-12)
