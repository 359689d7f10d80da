"""Speeds along tool paths, and following them: measured by Pinocchio alone."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

import knotwork as kw
from knotwork.errors import FollowingError, InputError, PathError, RampError, UnreachablePoseError
from sweeps import examples

tp = kw.tool_paths

speeds = st.floats(0.005, 0.5)


def profile(lengths, speeds, acceleration=1.0, **more):
    return tp.speed_profile(lengths, speeds, acceleration=acceleration, **more)


def attempt(lengths, speeds, acceleration, options):
    """The timing, or the error."""
    try:
        return profile(lengths, speeds, acceleration, **options), None
    except RampError as error:
        return None, error


def check_advice(error, lengths, wanted, acceleration, options):
    """What an error advises leaves the stretch long enough, for other stretches or not."""
    assert error.needed > error.length == lengths[error.stretch]
    more = error.lowest_acceleration * (1 + 1e-9)
    assert more > acceleration
    _, other = attempt(lengths, wanted, more, options)
    assert other is None or other.stretch > error.stretch
    if error.highest_speed is not None:
        assert error.highest_speed < wanted[error.stretch]
        slower = list(wanted)
        slower[error.stretch] = error.highest_speed
        _, other = attempt(lengths, slower, acceleration, options)
        assert other is None or other.stretch != error.stretch


@examples()
@example([(0.015625, 0.125), (2.0, 0.015625)], 1.0, 0.25, 0.0, set())  # a tiny piece between ramps
@given(
    st.lists(st.tuples(st.floats(0.01, 2.0), speeds), min_size=1, max_size=5),
    st.floats(0.1, 5.0),
    st.floats(0, 0.3),
    st.floats(0, 0.3),
    st.sets(st.integers(0, 3)),
)
def test_profile_holds_or_gives_feasible_values(parts, acceleration, v0, v1, stops):
    lengths, wanted = (list(column) for column in zip(*parts, strict=True))
    options = {"start_speed": v0, "end_speed": v1, "stops": stops}
    timing, error = attempt(lengths, wanted, acceleration, options)
    if timing is None:
        check_advice(error, lengths, wanted, acceleration, options)
        return
    s = timing.arc_length
    ends = np.concatenate(([0.0], np.cumsum(lengths)))
    assert s.x[0] == 0.0
    assert s.x[-1] == timing.duration == timing.times[-1]
    np.testing.assert_allclose(s(timing.times), ends, rtol=1e-9)
    for nu, scale in ((0, ends[-1]), (1, 1.0), (2, 10 * acceleration)):
        assert np.abs(s.jumps(nu)).max(initial=0.0) < 1e-8 * scale
    assert float(s.derivative(2).extrema().peak) <= acceleration * (1 + 1e-6)
    assert float(s.derivative().extrema().minimum) >= -1e-12
    assert timing(np.zeros(1), 1)[0] == pytest.approx(v0, abs=1e-12)
    assert timing(s.x[-1:], 1)[0] == pytest.approx(v1, abs=1e-9)
    for i, (start, end) in enumerate(timing.full_speed_intervals):
        assert timing.times[i] <= start <= end <= timing.times[i + 1]
        if end > start:
            np.testing.assert_allclose(
                timing(np.linspace(start, end, 7)[1:-1], 1), wanted[i], rtol=1e-9
            )
        if i in stops and i + 1 < len(parts):
            assert timing(timing.times[[i + 1]], 1)[0] == pytest.approx(0.0, abs=1e-9)
        elif i + 1 < len(parts):
            lower = min(wanted[i], wanted[i + 1])
            assert timing(timing.times[[i + 1]], 1)[0] == pytest.approx(lower, rel=1e-6)


def test_time_of_inverts_arc_length():
    timing = profile([0.1, 0.2], [0.05, 0.1], start_speed=0.0, end_speed=0.0, stops={0})
    t = np.linspace(0.01, timing.duration - 0.01, 50)
    np.testing.assert_allclose(timing.time_of(timing(t)), t, atol=1e-9)
    np.testing.assert_array_equal(timing.time_of([0.0, 0.1, 0.3]), timing.times)


@examples()
@given(
    st.floats(0.01, 1.0),
    speeds,
    st.floats(0.05, 5.0),
    st.none() | st.floats(0, 0.4),
    st.none() | st.floats(0, 0.4),
)
def test_speed_for_duration_takes_it(length, speed, acceleration, v0, v1):
    ends = {"start_speed": v0, "end_speed": v1}
    try:
        duration = profile([length], [speed], acceleration, **ends).duration
    except RampError:
        assume(False)
    found = tp.speed_for_duration(length, duration, acceleration=acceleration, **ends)
    again = profile([length], [found], acceleration, **ends).duration
    assert again == pytest.approx(duration, rel=1e-8)


def test_short_duration_reports_minimum():
    with pytest.raises(PathError, match=r"at least 0\.489898 s") as raised:
        tp.speed_for_duration(0.04, 0.3, acceleration=1.0, start_speed=0.0, end_speed=0.0)
    least = math.sqrt(0.04 / 1.5) * 1.5 * 2
    assert f"{least:.6g}" in str(raised.value)
    tp.speed_for_duration(0.04, least, acceleration=1.0, start_speed=0.0, end_speed=0.0)


def test_long_duration_reports_maximum():
    with pytest.raises(PathError, match=r"and at most"):
        tp.speed_for_duration(0.01, 9, acceleration=1.0, start_speed=0.5, end_speed=0.5)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: profile([0.1, 0.0], [1, 1]), "length of stretch 2 is 0 m"),
        (lambda: profile([0.1], [-1]), "speed of stretch 1 is -1 m/s"),
        (lambda: profile([0.1], [1], acceleration=0.0), r"acceleration is 0\.0"),
        (lambda: profile([0.1], [1], start_speed=-1.0), r"start_speed is -1\.0"),
        (lambda: profile([0.1], [1], start_speed="x"), r"start_speed is 'x'; it must be a finite"),
        (lambda: profile([], []), "no stretches"),
        (lambda: tp.speed_for_duration(0.1, 0.0, acceleration=1), r"duration is 0\.0"),
        (
            lambda: tp.speed_for_duration(0.01, 1, acceleration=1, start_speed=0.5, end_speed=0.0),
            r"takes 0\.1875 m",
        ),
    ],
)
def test_refuses_invalid_timing(make, message):
    with pytest.raises(InputError, match=message):
        make()


ARM = kw.load_robot("ur5")
HOME = ARM.configuration("home")
AT = ARM.forward(HOME)
LINE = tp.Line(AT.translation, AT.translation + np.array([0, 0.1, 0]))


def test_uses_orientation_of_tool_path() -> None:
    turned = pin.exp3(np.array([0, 0, 0.5])) @ AT.rotation
    path = tp.ToolPath([LINE], tp.OrientationCurve.even_turning(AT.rotation, turned, 0.1))
    motion = kw.follow_path(ARM, path, 0.05, start=HOME)
    end = ARM.forward(motion.position(2.0))
    np.testing.assert_allclose(end.rotation, turned, atol=1e-9)
    with pytest.raises(InputError, match="rotation is given together with a ToolPath"):
        kw.follow_path(ARM, path, 0.05, start=HOME, rotation=turned)


def test_corrects_inaccurate_start() -> None:
    motion = kw.follow_path(ARM, LINE, 0.05, 1e-8, start=HOME + 1e-7)
    np.testing.assert_allclose(
        ARM.forward(motion.position(0.0)).translation, AT.translation, atol=1e-10
    )


def test_default_start_is_nearest_to_home() -> None:
    away = tp.Line(LINE.end, LINE.end + np.array([0, 0, 0.05]))
    start = kw.solve_pose_ik(ARM, pin.SE3(AT.rotation, LINE.end), HOME).q
    motion = kw.follow_path(ARM, away, 0.05)
    np.testing.assert_allclose(motion.position(0.0), start, atol=1e-9)


def corner() -> Any:
    curves = [LINE, tp.Line(LINE.end, LINE.end + np.array([0, 0, 0.05]))]
    kept = tp.OrientationCurve.constant(AT.rotation, 0.15)
    return tp.ToolPath(curves, kept, stops={0})


def test_stops_need_acceleration() -> None:
    motion = kw.follow_path(ARM, corner(), 0.05, start=HOME, acceleration=1.0)
    assert np.abs(motion.velocity(2.075)).max() < 1e-12
    with pytest.raises(PathError, match="has stops; give acceleration"):
        kw.follow_path(ARM, corner(), 0.05, start=HOME)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"start": HOME + 0.1}, r"the tool 0\.1188 m and .* deg from .*kw\.solve_pose_ik"),
        ({"rotation": np.eye(3)}, r"the tool 0 m and 180 deg from"),
        ({"path": tp.Line(LINE.end, AT.translation)}, r"the tool 0\.1 m and 0 deg from"),
        (
            {"path": tp.Line(9 * AT.translation, LINE.end), "start": None},
            "the pose is out of reach",
        ),
        ({"start": HOME[:3]}, r"start must have shape \(6,\)"),
        ({"speed": 0.0}, r"speed is 0\.0; it must be a positive and finite number \[m/s\]"),
        ({"speed": "fast"}, "speed is 'fast'"),
        ({"tolerance": -1.0}, "tolerance is -1.0"),
        ({"tolerance": 1e-10}, "it must be at least 1e-09"),
        ({"orientation_tolerance": np.nan}, "orientation_tolerance is nan"),
        ({"speed_tolerance": 1e-12}, "speed_tolerance is 1e-12"),
        ({"pull_to_middle": None}, "pull_to_middle is null"),
        ({"pull_to_middle": -1}, "pull_to_middle is -1; it must be at least 0"),
        ({"acceleration": 1e-3}, "takes 3.75 m; accepted"),
        ({"acceleration": 0.0}, "acceleration is 0.0"),
        ({"path": "line"}, "path is 'line'; accepted: a ToolPath or a curve"),
        ({"robot": "ur"}, "did you mean"),
    ],
)
def test_refuses_wrong_values(change: dict[str, Any], message: str) -> None:
    given = {"robot": ARM, "path": LINE, "speed": 0.05, "start": HOME, **change}
    with pytest.raises(InputError, match=message):
        kw.follow_path(**given)


def test_reports_obstruction() -> None:
    with pytest.raises(FollowingError, match=r"at its start shoulder_pan_joint would have to move"):
        kw.follow_path(ARM, LINE, 5.0, start=HOME)
    far = tp.Line(AT.translation, AT.translation + np.array([0, 1.5, 0]))
    with pytest.raises(FollowingError) as error:
        kw.follow_path(ARM, far, 0.05, start=HOME)
    assert error.value.cause == "singularity"
    # with the tool turned so, no configuration reaches a little beyond
    beyond = pin.SE3(AT.rotation, far.position([error.value.arc_length + 1e-4])[0])
    with pytest.raises(UnreachablePoseError):
        ARM.solve_pose_ik_all(beyond)
    narrow = ARM.with_limits({"shoulder_pan_joint": (HOME[0] - 0.2, HOME[0] + 0.2)})
    with pytest.raises(FollowingError, match="reaches its limit") as error:
        kw.follow_path(narrow, far, 0.05, start=HOME)
    assert error.value.cause == "joint limit"


def test_reports_arc_length_of_velocity_limit() -> None:
    """The joint is as fast as it may be there, by the inverse of the Jacobian."""
    straight = tp.Line(AT.translation, AT.translation + np.array([0, 0.45, 0]))
    with pytest.raises(FollowingError) as error:
        kw.follow_path(ARM, straight, 1.0, start=HOME)
    one = error.value
    assert one.cause == "velocity limit"
    there = pin.SE3(AT.rotation, straight.position([one.arc_length])[0])
    q = kw.solve_pose_ik(ARM, there, HOME).q
    v = np.linalg.solve(ARM.jacobian(q), [0, 1.0, 0, 0, 0, 0])
    j = ARM.joint_names.index(one.joint)
    assert abs(v[j]) == pytest.approx(ARM.limits.velocity[j], rel=1e-3)
    assert one.limit == ARM.limits.velocity[j]
    kw.follow_path(ARM, straight, 0.98 * one.limit / one.value, start=HOME)
    with pytest.raises(FollowingError):
        kw.follow_path(ARM, straight, 1.02 * one.limit / one.value, start=HOME)


def test_error_falls_with_fourth_power_of_interval() -> None:
    arm = kw.load_robot("xarm7")
    q = np.array([0.3, -0.3, 0.4, 0.8, 0.2, 1.1, 0.0])
    place = arm.forward(q).translation
    circle = tp.Arc.about(place, place + np.array([0, 0.04, 0]), place, [0, 0, 1])
    options = {"start": q, "pull_to_middle": 0.5, "speed_tolerance": 0.5}
    motions = [kw.follow_path(arm, circle, 0.03, tol, **options) for tol in (1e-6, 1e-6 / 256)]
    counts = [len(motion.waypoint_times) - 2 for motion in motions]  # those inserted
    assert counts[0] >= 8
    assert counts[1] <= 4.5 * counts[0]


def test_continuous_joints_turn_without_limit() -> None:
    """Two turns of a tool that turns with the circle: 4π at the joint that carries them."""
    arm = kw.load_robot("kinova")
    q = np.array([4.8, 3.0, 1.2, 3.8, 1.2, 0.8])
    pose = arm.forward(q)
    axis = pose.rotation[:, 2]
    side = np.cross(axis, [0.3, 0.5, 0.8])
    centre = pose.translation + 0.02 * side / np.linalg.norm(side)
    circle = tp.Arc.about(pose.translation, centre, pose.translation, axis, 1)
    turning = tp.OrientationCurve.turning(pose.rotation, axis, 4 * np.pi, circle.length)
    motion = kw.follow_path(arm, tp.ToolPath([circle], turning), 0.005, start=q)
    moved = motion.position(motion.end_time) - motion.position(0.0)
    assert np.abs(moved).max() == pytest.approx(4 * np.pi, abs=1e-6)
    for t in np.linspace(0.0, motion.end_time, 101):
        spoke = arm.forward(motion.position(t)).translation - centre
        assert np.linalg.norm(spoke) == pytest.approx(0.02, abs=1e-4)
