from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import knotwork as kw
from knotwork.errors import CornerError, PathError
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


def timed(path, speed=0.1, **more):
    lengths = [curve.length for curve in path.curves]
    timing = tp.speed_profile(
        lengths, [speed] * len(lengths), acceleration=1.0, stops=path.stops, **more
    )
    return tp.TimedPath(path, timing, start_time=2.0)


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
        left, right = (path.position(s, order, side=side) for side in ("left", "right"))
        np.testing.assert_allclose(left, right, atol=1e-12)
    np.testing.assert_allclose(path.position(s[:1], 2), [[0, 20, 0]], atol=1e-12)
    np.testing.assert_array_equal(path.position(s[:1], 2, side="left"), np.zeros((1, 3)))
    beyond = path.position(s[:1] + 0.1, at=s[:1], side="left")
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
    bend, turn_bend = path.bend(s0, s1), path.turn_bend(s0, s1)
    assert (bend > 0).any()
    for i in range(30):
        share = np.linspace(0, 1, 41)
        s = s0[i] + share * (s1[i] - s0[i])
        # an eighth of the bound at most, and at most τ (1 - τ)/2 of it everywhere
        allowed = 0.5 * share * (1 - share) + 1e-13
        for values, bound in ((path.position(s), bend[i]), (path.rotation(s), turn_bend[i])):
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
    with pytest.raises(PathError, match="no curves"):
        broken(curves=[])
    with pytest.raises(PathError, match=r"curve 1 starts 0\.1 m away"):
        broken(curves=[tp.Line([0, 0, 0], [0.2, 0, 0]), tp.Line([0.3, 0, 0], [0.5, 0, 0])])
    with pytest.raises(PathError, match=r"the orientation is 0\.4 m long and the path 0\.5 m"):
        broken(orientation=Turn.constant(np.eye(3), 0.4))
    turn = Turn.turning(np.eye(3), [0, 0, 1], 1.0, 0.3)
    jumps = Turn.joined([Turn.constant(np.eye(3), 0.2), turn], stops={0})
    with pytest.raises(PathError, match=r"jumps at arc length 0\.2 m"):
        broken(orientation=jumps)
    broken(orientation=jumps, stops={0})


@pytest.mark.parametrize("make", [slot, hook])
def test_twist_and_acceleration_equal_differences(make):
    motion = timed(make(), start_speed=0.0, end_speed=0.0)
    h = 1e-5
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
