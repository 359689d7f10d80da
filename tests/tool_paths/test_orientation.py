"""Orientations along paths: blended, kept, or turned with the tangent."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, RotationSpline, Slerp

import knotwork as kw
from knotwork.errors import PathError
from sweeps import examples

tp = kw.tool_paths
OrientationCurve = tp.OrientationCurve

seeds = st.integers(0, 100_000)


def random_curve(seed, jumps=False):
    rng = np.random.default_rng(seed)
    count = int(rng.integers(2, 6))
    s = np.concatenate(([0.0], np.cumsum(rng.uniform(0.05, 0.4, count - 1))))
    steps = Rotation.from_rotvec(rng.uniform(-1.2, 1.2, (count, 3)))
    rotations = [Rotation.identity()]
    for step in steps[1:]:
        rotations.append(rotations[-1] * step)
    shape = (count, 2, 3) if jumps else (count, 3)
    matrices = np.array([rotation.as_matrix() for rotation in rotations])
    return OrientationCurve(
        s, matrices, rng.normal(scale=4, size=shape), rng.normal(scale=9, size=shape)
    )


def assert_continuous(curve, order, atol):
    """The rate, or its derivative, is the same on both sides of each inner knot."""
    left, right = (curve.rate(curve.s[1:-1] + side, order) for side in (-1e-12, 1e-12))
    np.testing.assert_allclose(left, right, atol=atol)


@examples()
@given(seeds)
def test_passes_given_values_on_both_sides(seed):
    curve = random_curve(seed, jumps=True)
    middles = 0.5 * (curve.s[1:] + curve.s[:-1])
    for side, ends in enumerate((slice(1, None), slice(0, -1))):
        rotation, rate, change = curve.states(curve.s[ends], at=middles)
        np.testing.assert_allclose(rotation, curve.rotations[ends], atol=1e-13)
        np.testing.assert_allclose(rate, curve.rates[ends, side], atol=1e-10)
        np.testing.assert_allclose(change, curve.changes[ends, side], atol=1e-8)


@examples()
@given(seeds)
def test_rates_equal_differences(seed):
    curve, h = random_curve(seed), 1e-5
    s = np.linspace(0, curve.length, 60)
    s = s[(np.abs(s[:, None] - curve.s) > 1e-4).all(axis=1)]
    turned = curve.rotation(s + h) @ np.swapaxes(curve.rotation(s - h), 1, 2)
    rate = Rotation.from_matrix(turned).as_rotvec() / (2 * h)
    scale = 1 + np.abs(curve.rate(s, 1)).max()
    np.testing.assert_allclose(curve.rate(s), rate, atol=1e-6 * scale**2)
    change = (curve.rate(s + h) - curve.rate(s - h)) / (2 * h)
    np.testing.assert_allclose(curve.rate(s, 1), change, atol=1e-6 * scale**2)


@examples()
@given(seeds)
def test_bounds_of_rates_hold(seed):
    curve = random_curve(seed)
    rng = np.random.default_rng(seed)
    ends = rng.uniform(0, curve.length, (2, 20))
    ends[1, 10:] = np.clip(ends[0, 10:] + rng.normal(scale=0.01, size=10), 0, curve.length)
    rate, change = curve.rate_bounds(*ends)
    for i, (a, b) in enumerate(ends.T):
        s = np.linspace(a, b, 80)
        size, rise = (np.linalg.norm(curve.rate(s, order), axis=1).max() for order in (0, 1))
        assert size <= rate[i] * (1 + 1e-12)
        assert rise <= change[i] * (1 + 1e-12)
        if abs(a - b) < 0.005:  # on short intervals the bounds come close
            assert rate[i] < 2.5 * np.abs(curve._v).max() * 25 / curve._steps.min()


@examples()
@given(seeds, st.floats(0.01, 3.1))
def test_even_turning_is_slerp(seed, angle):
    start = Rotation.random(random_state=seed)
    axis = Rotation.random(random_state=seed + 1).apply([1, 0, 0])
    end = start * Rotation.from_rotvec(angle * axis)
    curve = OrientationCurve.even_turning(start.as_matrix(), end.as_matrix(), 0.7)
    s = np.linspace(0, 0.7, 30)
    slerp = Slerp([0, 0.7], Rotation.concatenate([start, end]))(s).as_matrix()
    np.testing.assert_allclose(curve.rotation(s), slerp, atol=1e-12)
    rate, change = curve.rate_bounds([0.0], [0.7])
    assert rate[0] == pytest.approx(angle / 0.7, rel=1e-9)
    assert change[0] < 1e-7


@examples()
@given(seeds, st.floats(-20, 20).filter(lambda angle: abs(angle) > 1e-3))
def test_turning_about_axis_by_any_angle(seed, angle):
    start = Rotation.random(random_state=seed)
    axis = np.random.default_rng(seed).normal(size=3)
    curve = OrientationCurve.turning(start.as_matrix(), axis, angle, 0.3)
    s = np.linspace(0, 0.3, 40)
    unit = axis / np.linalg.norm(axis)
    truth = Rotation.from_rotvec(np.outer(s / 0.3 * angle, unit)) * start
    np.testing.assert_allclose(curve.rotation(s), truth.as_matrix(), atol=1e-12)
    np.testing.assert_allclose(curve.rate(s), np.tile(angle / 0.3 * unit, (40, 1)), atol=1e-8)


def test_through_rotations_is_near_scipy_spline():
    s = np.array([0.0, 0.1, 0.25, 0.3, 0.5])
    turns = Rotation.from_rotvec(0.5 * np.random.default_rng(1).normal(size=(5, 3)))
    curve = OrientationCurve.through(s, turns.as_matrix())
    np.testing.assert_allclose(curve.rotation(s), turns.as_matrix(), atol=1e-13)
    at = np.linspace(0, 0.5, 101)
    spline = RotationSpline(s, turns)
    off = (Rotation.from_matrix(curve.rotation(at)).inv() * spline(at)).magnitude()
    assert off.max() < 0.01
    for order in (0, 1):
        assert_continuous(curve, order, 1e-7)
    truth = spline(s).apply(spline(s, 1))  # SciPy's rates are in the axes of the tool
    np.testing.assert_allclose(curve.rate(s), truth, atol=1e-9)


def test_joined_stretches_have_continuous_rates():
    turns = Rotation.from_euler("xyz", [[0, 0, 0], [0.5, 0, 0], [0.5, 1, 0.2]]).as_matrix()
    stretches = [
        OrientationCurve.even_turning(turns[0], turns[1], 0.4),
        OrientationCurve.even_turning(turns[1], turns[2], 0.2),
        OrientationCurve.turning(turns[2], [0, 0, 1], 8.0, 0.8),
    ]
    curve = OrientationCurve.joined(stretches)
    assert curve.length == pytest.approx(1.4)
    assert curve.jumps.size == 0
    assert_continuous(curve, 0, 1e-9)
    assert_continuous(curve, 1, 1e-7)
    one, other = stretches[0].rate([0.0])[0], stretches[1].rate([0.0])[0]
    np.testing.assert_allclose(curve.rate([0.4])[0], 0.5 * (one + other), atol=1e-12)


HALF = np.diag([-1.0, -1.0, 1.0])
REFUSED = [
    (lambda: OrientationCurve([0, 1], [np.eye(3), HALF], np.zeros((2, 3))), "less than 180 deg"),
    (lambda: OrientationCurve.even_turning(np.eye(3), HALF, 1.0), "180 deg"),
    (lambda: OrientationCurve([0, 0], [np.eye(3)] * 2, np.zeros((2, 3))), "increasing from 0"),
    (lambda: OrientationCurve([0], [np.eye(3)], np.zeros((1, 3))), "two or more"),
    (lambda: OrientationCurve.constant(2 * np.eye(3), 1.0), "not a rotation matrix"),
    (lambda: OrientationCurve.constant(np.diag([1.0, 1, -1]), 1.0), "not a rotation matrix"),
    (lambda: OrientationCurve.turning(np.eye(3), [0, 0, 0], 1.0, 1.0), "axis is zero"),
    (lambda: OrientationCurve.joined([]), "no stretches"),
    (lambda: tp.tangent_orientation(wave(1), 2 * np.eye(3)), "not a rotation matrix"),
    (
        lambda: OrientationCurve.joined(
            [OrientationCurve.constant(np.eye(3), 1), OrientationCurve.constant(HALF, 1)]
        ),
        "turned by 180 deg",
    ),
]


@pytest.mark.parametrize(("make", "message"), REFUSED)
def test_refuses_invalid_orientations(make, message):
    with pytest.raises(PathError, match=message):
        make()


def wave(seed):
    rng = np.random.default_rng(seed)
    return tp.ThroughPoints(0.1 * np.cumsum(rng.normal((1.5, 0, 0), 0.6, (6, 3)), axis=0))


@examples(3, 18)
@given(st.integers(0, 10_000))
def test_tangent_is_constant_in_tool_axes(seed):
    curve = wave(seed)
    start = Rotation.random(random_state=seed).as_matrix()
    orientation = tp.tangent_orientation(curve, start)
    assert orientation.length == pytest.approx(curve.length, rel=1e-12)
    assert orientation.jumps.size == 0
    s = np.linspace(0, curve.length, 200)
    T = curve.position(s, 1)
    seen = np.einsum("kji,kj->ki", orientation.rotation(s), T)
    np.testing.assert_allclose(seen, np.tile(seen[0], (200, 1)), atol=2e-6)

    # Very many small turns, each about the axis at its middle.
    count = 20_000
    middle = (np.arange(count) + 0.5) * curve.length / count
    axes = np.cross(curve.position(middle, 1), curve.position(middle, 2))
    truth = start
    for turn in Rotation.from_rotvec(axes * curve.length / count).as_matrix():
        truth = turn @ truth
    np.testing.assert_allclose(orientation.rotations[-1], truth, atol=3e-6)
