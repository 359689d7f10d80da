"""Tool paths of lines and arcs, and those of one’s own."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import knotwork as kw
from knotwork.errors import CornerError, InputError, PathError
from sweeps import examples

tp = kw.tool_paths
Turn = tp.OrientationCurve


def slot():
    """A line, half a circle and a line back, the tool turning with the half circle."""
    curves = [
        tp.Line([0, 0, 0], [0.2, 0, 0]),
        tp.Arc.about([0.2, 0, 0], [0.2, 0.05, 0], [0.2, 0.1, 0], [0, 0, 1]),
        tp.Line([0.2, 0.1, 0], [0, 0.1, 0]),
    ]
    half = Rotation.from_euler("z", 180, degrees=True).as_matrix()
    turning = Turn.joined(
        [
            Turn.constant(np.eye(3), 0.2),
            Turn.turning(np.eye(3), [0, 0, 1], math.pi, curves[1].length),
            Turn.constant(half, 0.2),
        ]
    )
    return tp.ToolPath(curves, turning)


def hook():
    """Two lines at a right angle, with a stop at the corner."""
    curves = [tp.Line([0, 0, 0], [0.2, 0, 0]), tp.Line([0.2, 0, 0], [0.2, 0.3, 0])]
    quarter = Rotation.from_euler("z", 90, degrees=True).as_matrix()
    turning = Turn.joined(
        [Turn.even_turning(np.eye(3), quarter, 0.2), Turn.even_turning(quarter, np.eye(3), 0.3)],
        stops={0},
    )
    return tp.ToolPath(curves, turning, stops={0})


def test_breaks_of_path():
    path = slot()
    half = math.pi * 0.05
    np.testing.assert_allclose(path.starts, [0, 0.2, 0.2 + half])
    assert path.length == pytest.approx(0.4 + half)
    # the tool begins to turn a quarter of the arc, the shorter stretch, before it, and so on
    shares = [0, 0.2 - half / 4, 0.2, 0.2 + half / 4, 0.2 + 3 * half / 4]
    shares += [0.2 + half, 0.2 + 5 * half / 4, 0.4 + half]
    np.testing.assert_allclose(path.breaks, shares, atol=1e-12)


def test_position_and_direction_are_continuous():
    path = slot()
    s = path.starts[1:]
    for order in (0, 1):
        left, right = (path.derivatives(s, order, at=s + side)[order] for side in (-0.1, 0.1))
        np.testing.assert_allclose(left, right, atol=1e-12)
    np.testing.assert_allclose(path.position(s[:1], 2), [[0, 20, 0]], atol=1e-12)
    before = s[:1] - 0.1
    np.testing.assert_array_equal(path.derivatives(s[:1], 2, at=before)[2], np.zeros((1, 3)))
    beyond = path.derivatives(s[:1] + 0.1, 0, at=before)[0]
    np.testing.assert_allclose(beyond, [[0.3, 0, 0]])


@examples()
@given(st.floats(0, 1), st.floats(-0.08, 0.08), st.floats(-0.01, 0.01))
def test_nearest_continues_in_next_curve(share, ahead, aside):
    path = slot()
    s = np.array([share * path.length])
    point = path.position(s) + np.array([[0, 0, aside]])
    guess = np.clip(s + ahead, 0, path.length)
    np.testing.assert_allclose(path.nearest(point, guess), s, atol=1e-12)


@examples()
@given(st.integers(0, 10_000))
def test_bend_bounds_deviation_from_chord(seed):
    path = slot()
    s0, s1 = np.random.default_rng(seed).uniform(0, path.length, (2, 30))
    s1[15:] = np.clip(s0[15:] + 0.2 * (s1[15:] - s0[15:]), 0, path.length)
    bend, turn_bend_bound = path.bend_bound(s0, s1), path.turn_bend_bound(s0, s1)
    assert (bend > 0).any()
    for i in range(30):
        share = np.linspace(0, 1, 41)
        s = s0[i] + share * (s1[i] - s0[i])
        # an eighth of the bound at most, and at most τ (1 - τ)/2 of it everywhere
        allowed = 0.5 * share * (1 - share) + 1e-13
        for values, bound in ((path.position(s), bend[i]), (path.rotation(s), turn_bend_bound[i])):
            values = values.reshape(41, -1)
            chord = values[0] + share[:, None] * (values[-1] - values[0])
            off = np.linalg.norm(values - chord, axis=1)
            assert (off <= allowed * bound + 1e-12).all()


def test_refuses_sharp_corner_with_angle():
    lines = [tp.Line([0, 0, 0], [0.2, 0, 0]), tp.Line([0.2, 0, 0], [0.2, 0.3, 0])]
    with pytest.raises(CornerError, match=r"by 90 deg at .0\.2, 0, 0. m.*blend or stop") as raised:
        tp.ToolPath(lines, Turn.constant(np.eye(3), 0.5))
    assert raised.value.junction == 0
    assert raised.value.angle == pytest.approx(math.pi / 2)
    assert raised.value.point == pytest.approx((0.2, 0, 0))


def broken(**changes):
    lines = [tp.Line([0, 0, 0], [0.2, 0, 0]), tp.Line([0.2, 0, 0], [0.5, 0, 0])]
    arguments = {"curves": lines, "orientation": Turn.constant(np.eye(3), 0.5), **changes}
    return tp.ToolPath(**arguments)


def test_refuses_invalid_paths():
    apart = [tp.Line([0, 0, 0], [0.2, 0, 0]), tp.Line([0.3, 0, 0], [0.5, 0, 0])]
    turn = Turn.turning(np.eye(3), [0, 0, 1], 1.0, 0.3)
    jumps = Turn.joined([Turn.constant(np.eye(3), 0.2), turn], stops={0})
    short = Turn.constant(np.eye(3), 0.4)
    for changes, message in (
        ({"curves": []}, "no curves"),
        ({"curves": apart}, r"curve 2 starts 0\.1 m away"),
        ({"orientation": short}, r"the orientation is 0\.4 m long and the path 0\.5 m"),
        ({"orientation": jumps}, r"jumps at arc length 0\.2 m"),
    ):
        with pytest.raises(PathError, match=message):
            broken(**changes)
    broken(orientation=jumps, stops={0})


@pytest.mark.parametrize("make", [slot, hook])
def test_twist_and_acceleration_equal_differences(make):
    path, h = make(), 1e-5
    lengths = [curve.length for curve in path.curves]
    rest = {"start_speed": 0.0, "end_speed": 0.0, "stops": path.stops}
    profile = tp.speed_profile(lengths, [0.1] * len(lengths), acceleration=1.0, **rest)
    motion = tp.TimedPath(path, profile, start_time=2.0)
    t = np.sort(np.concatenate((np.linspace(2, motion.end_time, 301), motion.breaks)))
    for side in ("left", "right"):
        _, rotation, twist, acceleration = motion.state(t, side=side)
        before, after = (motion.state(t + step, at=t, side=side) for step in (-h, h))
        np.testing.assert_allclose((after[0] - before[0]) / (2 * h), twist[:, :3], atol=1e-8)
        turned = Rotation.from_matrix(after[1] @ np.swapaxes(before[1], 1, 2)).as_rotvec()
        np.testing.assert_allclose(turned / (2 * h), twist[:, 3:], atol=1e-7)
        np.testing.assert_allclose((after[2] - before[2]) / (2 * h), acceleration, atol=1e-4)
        np.testing.assert_allclose(
            rotation @ np.swapaxes(rotation, 1, 2), np.tile(np.eye(3), (t.size, 1, 1)), atol=1e-12
        )


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


def test_nearest_stays_in_turn_of_guess():
    arc = tp.Arc.about([1, 0, 0], [0, 0, 0], [1, 0, 0], [0, 0, 1], turns=2)
    s = np.linspace(0.1, arc.length - 0.1, 40)
    points = 1.3 * arc.position(s) + [0, 0, 0.4]
    np.testing.assert_allclose(arc.nearest(points, s + 2.0), s, atol=1e-12)
    np.testing.assert_allclose(arc.nearest(points[:1], [-4.0]), [0.0])


REFUSED = [
    (lambda: tp.Line([0, 0, 0], [0, 0, 0]), "has no length"),
    (lambda: tp.Arc.through([0, 0, 0], [1, 1, 0], [2, 2, 0]), "on a line"),
    (lambda: tp.Arc.through([0, 0, 0], [2, 2, 0], [1, 1, 0]), "on a line"),
    (lambda: tp.Arc.through([1, 1, 0], [0, 0, 0], [2, 2, 0]), "on a line"),
    (lambda: tp.Arc.through([0, 0, 0], [1, 1, 0], [0, 0, 0]), "give its centre"),
    (lambda: tp.Arc.through([0, 0, 0], [0, 0, 0], [1, 0, 0]), "are on a line"),
    (lambda: tp.Arc.about([1, 0, 0], [0, 0, 0], [0, 1.1, 0]), "is 1 m from .* 1.1 m from the end"),
    (lambda: tp.Arc.about([1, 0, 0], [0, 0, 0], [1, 0, 0]), "a full circle"),
    (lambda: tp.Arc.about([1, 0, 0], [0, 0, 0], [-1, 0, 0]), "half a circle"),
    (
        lambda: tp.Arc.about([1, 0, 0], [0, 0, 0], [0, 1, 0], [0, 0.1, 1]),
        "84.2894.* the radius at the end",
    ),
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
