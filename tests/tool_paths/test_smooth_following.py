"""What is followed has no spikes, and waypoints are inserted until its proof holds.

What the path asks for is found by Pinocchio alone: J⁻¹(ẍ − J̇q̇), at many times.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import example, given, reject
from hypothesis import strategies as st
from numpy.typing import NDArray

import knotwork as kw
from judged import judged, judged_along
from knotwork.errors import FollowingError, PathError
from knotwork.robot.kinematics.following.joints_on_path import JointsOnPath
from knotwork.verification.bounds.path_criteria import PathTolerances, RequiredSpeed
from knotwork.verification.bounds.stretch_bounds import path_bounds
from plans import passing_plan
from seams import ON, task
from sweeps import examples, first_of

Array = NDArray[np.float64]

tp = kw.tool_paths
ARM = kw.load_robot("ur5")
TOP = np.array([0.45, -0.1, 0.25])
DOWN = np.diag([1.0, -1.0, -1.0])

TURNING = ("orientation", "pose", "velocity")
"""What the judge does not read of a path: a tool that turns with each point."""
FACTOR = 1.5
"""A motion accelerates by no more than this factor more than its path."""
SAMPLES = 100


def circle_on_dome(
    count: int = 20, radius: float = 0.02, dome: float = 0.2, turn: float = 2.0 * np.pi
) -> tuple[Array, Array]:
    """Points of a circle about the top of a dome, and rotations of a tool that is normal to it."""
    angle = np.linspace(0.0, turn, count)
    ring = np.column_stack((np.cos(angle), np.sin(angle), np.zeros(count)))
    tilt = np.arcsin(radius / dome)
    normals = np.sin(tilt) * ring + [0.0, 0.0, np.cos(tilt)]
    points = TOP - [0.0, 0.0, dome] + dome * normals
    axes = tilt * np.cross([0.0, 0.0, 1.0], ring)
    return points, np.array([pin.exp3(axis) @ DOWN for axis in axes])


def asked_for(q: Array, twist: Array, change: Array) -> Array:
    """Joint accelerations that give the tool a twist and its derivative where joints are at q."""
    model, data, frame, axes = ARM.model, ARM.data, ARM.tcp_frame_id, pin.LOCAL_WORLD_ALIGNED
    J = pin.computeFrameJacobian(model, data, q, frame, axes)
    v = np.linalg.solve(J, twist)
    pin.forwardKinematics(model, data, q, v, np.zeros(ARM.dof))
    drift = pin.getFrameClassicalAcceleration(model, data, frame, axes).vector
    return np.asarray(np.linalg.solve(J, change - drift))


def peaks(path: Any, curve: Any) -> tuple[float, float]:
    """Greatest joint acceleration along a path [rad/s²]: of a motion, and required."""
    needed = 0.0
    for start, end in pairwise(path.breaks):
        times = np.linspace(start, end, SAMPLES)
        _, _, twists, changes = path.state(times, at=np.full(SAMPLES, 0.5 * (start + end)))
        for q, twist, change in zip(curve(times), twists, changes, strict=True):
            needed = max(needed, float(np.abs(asked_for(q, twist, change)).max()))
    inside = curve.x[(curve.x >= path.start_time) & (curve.x <= path.end_time)]
    # a cubic's acceleration is greatest at a knot
    return float(np.abs(curve(inside, 2)).max()), needed


@given(
    count=st.integers(5, 40),
    radius=st.floats(0.005, 0.04),
    dome=st.floats(0.1, 1.0),
    turn=st.floats(0.5, 2.0 * np.pi),
    oriented=st.booleans(),
    speed=st.floats(0.01, 0.15),
    ramps=st.floats(0.001, 1.0),
)
@examples(8, 48)
def test_no_spikes_at_stops(
    count: int,
    radius: float,
    dome: float,
    turn: float,
    oriented: bool,
    speed: float,
    ramps: float,
) -> None:
    points, rotations = circle_on_dome(count, radius, dome, turn)
    curve = tp.ThroughPoints(points)
    turning = tp.OrientationCurve.constant(DOWN, curve.length)
    if oriented:
        turning = tp.OrientationCurve.through(curve.arc_lengths, rotations)
    path = tp.ToolPath([curve], turning)
    # the ramps take this part of the path; 1 leaves no full speed
    acceleration = 1.5 * speed**2 / (ramps * curve.length)
    try:
        motion = kw.follow_path(ARM, path, speed, acceleration=acceleration)
    except FollowingError as error:  # the joints would have to be faster than they can
        if "would have to move at" not in str(error):
            raise
        reject()
    profile = tp.speed_profile(
        [curve.length], [speed], acceleration=acceleration, start_speed=0, end_speed=0
    )
    found, needed = peaks(tp.TimedPath(path, profile), motion.polynomial)
    assert found <= FACTOR * needed
    start = pin.SE3(path.pose(0.0).rotation, points[0])
    assert not judged_along(
        motion, "ur5", start, points, speed,
        acceleration=acceleration, but=TURNING if oriented else (),
    )  # fmt: skip


TINY = st.floats(-12.0, -2.0).map(lambda power: 10.0**power)
JERK_FACTOR = 2.0
"""Nor has it so many times the jerk and acceleration that it has with only one of the breaks."""


@given(part=TINY)
@example(part=1e-8)
@examples(10, 60)
def test_no_spike_between_adjacent_ramps(part: float) -> None:
    speed, length = 0.1, 0.1
    line = tp.Line(TOP, TOP + np.array([0.0, length, 0.0]))
    motions = [
        kw.follow_path(ARM, line, speed, rotation=DOWN, acceleration=1.5 * speed**2 / length * more)
        for more in (1.0, 1.0 + part)
    ]
    for order in (2, 3):
        without, found = (one.extrema(order).peak.max() for one in motions)
        assert found <= JERK_FACTOR * without


HOME = ARM.configuration("home")


def rough_curve(seed: int) -> tuple[Any, dict[str, float]]:
    """A curve through points that are a little off a smooth one, turned about, and tolerances."""
    rng = np.random.default_rng([14, seed])
    count = int(rng.integers(6, 30))
    pose, t = ARM.forward(HOME), np.linspace(0.0, 1.0, count)
    wave = 0.1 * np.sin(2.0 * np.pi * t * rng.uniform(0.3, 2.0))
    smooth = np.column_stack((wave, 0.3 * t, 0.05 * np.cos(5.0 * t) - 0.05))
    points = pose.translation + smooth + rng.normal(size=(count, 3)) * 10 ** rng.uniform(-5, -3)
    curve = tp.ThroughPoints(points)
    if rng.random() < 0.5:
        turned = [pose.rotation @ pin.exp3(0.03 * rng.normal(size=3)) for _ in range(count)]
        turning = tp.OrientationCurve.through(curve.arc_lengths, np.array(turned))
    else:
        turning = tp.OrientationCurve.constant(pose.rotation, curve.length)
    tolerances = {
        "tolerance": 10 ** rng.uniform(-5.5, -4.0),
        "orientation_tolerance": np.radians(10 ** rng.uniform(-2.0, 0.0)),
        "speed_tolerance": 10 ** rng.uniform(-3.5, -2.0),
    }
    return tp.ToolPath([curve], turning), tolerances


def unproved(path: Any, motion: kw.JointTrajectory, speed: float, allowed: dict[str, float]) -> Any:
    """The bounds that aren't proved to keep their tolerances."""
    timed = tp.TimedPath(path, tp.speed_profile([path.length], [speed], acceleration=1.0))
    whole = timed.start_time, timed.end_time
    tolerances = PathTolerances(
        allowed["tolerance"],
        allowed["orientation_tolerance"],
        RequiredSpeed(speed, allowed["speed_tolerance"] * speed, whole),
    )
    found = path_bounds(ARM, motion.polynomial, timed, whole, tolerances).worst_errors
    assert {"path_deviation", "path_orientation", "path_speed"} <= found.keys()
    return [one for one in found.values() if not one.bound <= one.limit]


@pytest.mark.parametrize("count", first_of(4, 60))
def test_proves_followed_path(count: int) -> None:
    followed = 0
    for seed in range(count):
        path, allowed = rough_curve(seed)
        start = kw.solve_pose_ik(ARM, path.pose(0.0), HOME).q
        try:
            motion = kw.follow_path(ARM, path, 0.03, start=start, **allowed)
        except kw.errors.FollowingError:
            continue
        followed += 1
        assert not unproved(path, motion, 0.03, allowed), seed
        turned = np.abs(path.pose(path.length).rotation - path.pose(0.0).rotation).max() > 1e-9
        # it begins and ends at full speed: to the judge its ramps are over at once
        found = judged_along(
            motion, "ur5", path.pose(0.0), path.curves[0].points, 0.03, acceleration=1e9,
            but=("velocity", *(("orientation", "pose") if turned else ())),
            path=allowed["tolerance"], path_orientation=allowed["orientation_tolerance"],
            path_speed=allowed["speed_tolerance"],
        )  # fmt: skip
        assert not found, seed
    assert followed > count / 2


CIRCLE = {
    "name": "round",
    "along": {"arc": {"centre": [400, -100, 60], "normal": [0, 0, 1]}},
    "speed": 50,
    "stop": True,
    "pose": {"position": [450, -100, 60]},
}


@pytest.mark.parametrize(
    "knots",
    [
        pytest.param("paper", marks=pytest.mark.exhaustive),
        "balanced",
        pytest.param({"balanced": 0.1}, marks=pytest.mark.exhaustive),
        {"balanced": 0.45},
    ],
)
def test_follows_path_with_given_knots(knots: Any) -> None:
    given = task(ON, CIRCLE, tolerances={"path": 0.005}, knots=knots)
    plan = passing_plan(given)
    assert not judged(plan, given)


def test_knots_override_scenario() -> None:
    given = task(ON, CIRCLE, tolerances={"path": 0.005})
    assert kw.plan(given, planner="modified-hermite:balanced").report.ok


def test_slow_stretch_keeps_its_speed() -> None:
    slow = {**CIRCLE, "speed": 4, "name": "slow"}
    slow.pop("stop")
    fast = {"name": "fast", "along": {"arc": {"through": [400, -50, 60]}}, "speed": 200}
    fast.update(pose={"position": [350, -100, 60]}, stop=True)
    given = task(ON, slow, fast, tolerances={"path": 1, "path_speed": 0.0005})
    plan = passing_plan(given)
    assert not judged(plan, given)


def test_refuses_tolerance_below_rounding() -> None:
    at = ARM.forward(HOME).translation
    line = tp.Line(at, at + np.array([0.0, 0.1, 0.0]))
    with pytest.raises(PathError, match=r"tolerance of the speed, .* at least 2\.6e-07 is"):
        kw.follow_path(ARM, line, 0.001, 1e-5, start=HOME, speed_tolerance=1e-9)


@pytest.mark.parametrize("name", ["ur5", "panda"])
def test_another_timing_follows_the_same_joints(name: str) -> None:
    """As a function of arc length they are those of an integration with that timing."""
    arm, length = kw.load_robot(name), 0.2
    start = np.array(arm.configuration("home"))
    pose = arm.forward(start)
    line = tp.Line(pose.translation, pose.translation - [0.0, 0.0, length])
    path = tp.ToolPath([line], tp.OrientationCurve.constant(pose.rotation, length))
    fast, slow = (
        tp.TimedPath(
            path, tp.speed_profile([length], [v], acceleration=a, start_speed=0, end_speed=0)
        )
        for v, a in ((0.2, 1.0), (0.05, 0.1))
    )
    first = JointsOnPath(arm, fast, start, 0.0)
    times = np.linspace(slow.start_time, slow.end_time, 201)
    other, again = first.with_timing(slow), JointsOnPath(arm, slow, start, 0.0)
    q = other.positions(times)
    np.testing.assert_allclose(q, again.positions(times), rtol=0, atol=1e-8)
    for found, expected in zip(other.rates(times, q), again.rates(times, q), strict=True):
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6)
    np.testing.assert_allclose(other.curve(times), q, rtol=0, atol=3e-4)
