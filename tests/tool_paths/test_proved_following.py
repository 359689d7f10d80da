"""Waypoints are inserted until the proof holds: what is followed passes its own check."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import knotwork as kw
from judged import judged, judged_along
from knotwork.errors import PathError
from knotwork.verification.bounds.path_criteria import PathLimits
from knotwork.verification.bounds.stretch_bounds import path_bounds
from seams import ON, task
from sweeps import first_of

tp = kw.tool_paths
ARM = kw.load_robot("ur5")
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
    limits = PathLimits(
        allowed["tolerance"],
        allowed["orientation_tolerance"],
        allowed["speed_tolerance"] * speed,
        speed,
        whole,
    )
    found = path_bounds(ARM, motion.polynomial, timed, whole, limits).bounds
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
    plan = kw.plan(given)
    assert plan.report.ok
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
    plan = kw.plan(given)
    assert plan.report.ok
    assert not judged(plan, given)


def test_refuses_tolerance_below_rounding() -> None:
    at = ARM.forward(HOME).translation
    line = tp.Line(at, at + np.array([0.0, 0.1, 0.0]))
    with pytest.raises(PathError, match=r"tolerance of the speed, .* at least 2\.6e-07 is"):
        kw.follow_path(ARM, line, 0.001, 1e-5, start=HOME, speed_tolerance=1e-9)
