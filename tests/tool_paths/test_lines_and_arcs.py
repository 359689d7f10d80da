from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import knotwork as kw
from knotwork.errors import InputError
from sweeps import examples

tp = kw.tool_paths

angles = st.floats(0.05, 6.2)
seeds = st.integers(0, 10_000)


def circle(seed, angle, radius):
    """Three points of an arc in any plane, and its centre and normal."""
    rng = np.random.default_rng(seed)
    turn = Rotation.random(random_state=seed)
    centre = rng.uniform(-1, 1, 3)
    phi = np.array([0.0, rng.uniform(0.2, 0.8) * angle, angle])
    points = turn.apply(radius * np.column_stack((np.cos(phi), np.sin(phi), 0 * phi))) + centre
    return points, centre, turn.apply([0, 0, 1])


def differences(curve, order, h):
    """Central differences of the derivative before, at places inside the curve and beyond it."""
    s = np.linspace(-0.05, 1.05, 23) * curve.length
    after, before = curve.position(s + h, order - 1), curve.position(s - h, order - 1)
    return (after - before) / (2 * h), curve.position(s, order)


@pytest.mark.parametrize(
    "curve",
    [
        tp.Line([0.1, -0.2, 0.3], [0.4, 0.5, 0.1]),
        tp.Arc.through([1, 0, 0.2], [0, 1, 0.2], [0, -1, 0.2]),
        tp.Arc.about([0.5, 0, 0], [0, 0, 0], [0, 0.5, 0], [0, 0, 1], turns=2),
    ],
)
@pytest.mark.parametrize("order", [1, 2, 3])
def test_derivatives_equal_differences(curve, order):
    by_differences, derivative = differences(curve, order, 1e-5)
    np.testing.assert_allclose(by_differences, derivative, atol=1e-8)


@examples()
@given(seeds, angles, st.floats(0.01, 10))
def test_arc_through_points_is_their_circle(seed, angle, radius):
    points, centre, normal = circle(seed, angle, radius)
    arc = tp.Arc.through(*points)
    assert arc.radius == pytest.approx(radius, rel=1e-8)
    assert arc.angle == pytest.approx(angle, rel=1e-8)
    np.testing.assert_allclose(arc.centre, centre, atol=1e-8 * radius)
    np.testing.assert_allclose(arc.normal, normal, atol=1e-8)
    np.testing.assert_allclose(arc.position([0, arc.length]), points[[0, 2]], atol=1e-12)
    s = arc.nearest(points[1:2], [0.5 * arc.length])
    np.testing.assert_allclose(arc.position(s), points[1:2], atol=1e-9)


@examples()
@given(seeds, angles, st.integers(0, 3))
def test_arc_about_centre_turns_about_normal(seed, angle, turns):
    points, centre, normal = circle(seed, angle, 0.3)
    arc = tp.Arc.about(points[0], centre, points[2], normal, turns)
    assert arc.angle == pytest.approx(angle + 2 * np.pi * turns, abs=1e-9)
    back = tp.Arc.about(points[0], centre, points[2], -normal, turns)
    assert back.angle == pytest.approx(2 * np.pi - angle + 2 * np.pi * turns, abs=1e-9)
    for way in (arc, back):
        np.testing.assert_allclose(way.position([way.length])[0], points[2], atol=1e-12)


@examples()
@given(seeds, angles)
def test_arc_of_radius_is_small_or_large(seed, angle):
    points, centre, normal = circle(seed, angle, 0.3)
    arc = tp.Arc.of_radius(points[0], points[2], 0.3, normal, large=angle > np.pi)
    np.testing.assert_allclose(arc.centre, centre, atol=1e-7)
    assert arc.angle == pytest.approx(angle, abs=1e-6)


def test_arc_with_rounded_centre_ends_exactly():
    end = [np.cos(1.0), np.sin(1.0), 0]
    arc = tp.Arc.about([1, 0, 0], [4e-7, -3e-7, 2e-7], end)
    np.testing.assert_allclose(arc.end, end, atol=1e-15)


def test_full_circle_closes():
    arc = tp.Arc.about([0.04, 0, 0], [0, 0, 0], [0.04, 0, 0], normal=[0, 0, 2])
    assert arc.length == pytest.approx(0.08 * np.pi)
    np.testing.assert_allclose(arc.position([arc.length]), [[0.04, 0, 0]], atol=1e-16)
    np.testing.assert_allclose(arc.position([arc.length], 1), [[0, 1, 0]], atol=1e-15)


def test_nearest_stays_in_turn_of_guess():
    arc = tp.Arc.about([1, 0, 0], [0, 0, 0], [1, 0, 0], [0, 0, 1], turns=2)
    s = np.linspace(0.1, arc.length - 0.1, 40)
    points = 1.3 * arc.position(s) + [0, 0, 0.4]
    np.testing.assert_allclose(arc.nearest(points, s + 2.0), s, atol=1e-12)
    np.testing.assert_allclose(arc.nearest(points[:1], [-4.0]), [0.0])


REFUSED = [
    (lambda: tp.Line([0, 0, 0], [0, 0, 0]), "has no length"),
    (lambda: tp.Arc.through([0, 0, 0], [1, 1, 0], [2, 2, 0]), "on a line"),
    (lambda: tp.Arc.through([0, 0, 0], [3, 3, 0], [2, 2, 0]), "on a line"),
    (lambda: tp.Arc.through([0, 0, 0], [1, 1, 0], [0, 0, 0]), "give its centre"),
    (lambda: tp.Arc.through([0, 0, 0], [0, 0, 0], [1, 0, 0]), "are on a line"),
    (lambda: tp.Arc.about([1, 0, 0], [0, 0, 0], [0, 1.1, 0]), "is 1 m from .* 1.1 m from the end"),
    (lambda: tp.Arc.about([1, 0, 0], [0, 0, 0], [1, 0, 0]), "a full circle"),
    (lambda: tp.Arc.about([1, 0, 0], [0, 0, 0], [-1, 0, 0]), "half a circle"),
    (lambda: tp.Arc.about([1, 0, 0], [0, 0, 0], [0, 1, 0], [0, 0.1, 1]), "5.71.* deg off"),
    (lambda: tp.Arc.about([1, 0, 0], [0, 0, 0], [1, 0, 0], [0, 0, 0]), "normal is zero"),
    (lambda: tp.Arc.about([1, 0, 0], [0, 0, 0], [1, 0, 0], [1, 0, 1]), "45 deg"),
    (lambda: tp.Arc.about([1, 0, 0], [0, 0, 0], [0, 1, 0], turns=-1), "turns is -1"),
    (lambda: tp.Arc.about([1, 0, 0], [0, 0, 0], [0, 1, 0], turns=0.5), "turns is 0.5"),
    (lambda: tp.Arc.of_radius([0, 0, 0], [1, 0, 0], 0.4, [0, 0, 1]), "at least 0.5 m"),
    (lambda: tp.Arc.of_radius([0, 0, 0], [1, 0, 0], math.nan, [0, 0, 1]), "radius is nan"),
    (lambda: tp.Arc.of_radius([0, 0, 0], [0, 0, 0], 0.4, [0, 0, 1]), "its radius does not define"),
    (lambda: tp.Arc([1, 0, 0], [0, 0, 0], [0, 0, 1], -1.0), "reverse the normal"),
    (lambda: tp.Arc([1, 0, 0], [1, 0, 0], [0, 0, 1], 1.0), "is its centre"),
    (lambda: tp.Arc.of_radius([0, 0, 0], [1, 0, 0], "x", [0, 0, 1]), "is 'x'; it must be a"),
    (lambda: tp.Arc.about([0, 0, 0], [1, 0, 0], [2, 0, 0], turns="a"), "is 'a'; it must be a"),
    (lambda: tp.Arc([1, 0, 0], [0, 0, 0], [0, 0, 1], "x"), "is 'x'; it must be a"),
    (lambda: tp.Blend([0, 0, 0], [1, 0, 0], [1, 1, 0], distance="x"), "is 'x'; it must be a"),
]


@pytest.mark.parametrize(("make", "message"), REFUSED)
def test_refuses_invalid_curves(make, message):
    with pytest.raises(InputError, match=message):
        make()
