"""Proofs of tool paths against dense samples, and motions that leave the path between samples."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

import knotwork as kw
import seams
from judge.cases import bumped
from judge.motion import Motion
from judged import judged
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.trajectory import JointTrajectory
from knotwork.verification.bounds.path_criteria import PathBound, PathLimits
from knotwork.verification.bounds.stretch_bounds import path_bounds
from sweeps import examples


def task(along: Any, end: list[float], **more: Any) -> dict[str, Any]:
    off = {"name": "off", "along": along, "speed": 60, "stop": True, "pose": {"position": end}}
    return seams.task(seams.ON | {"stop": True}, off, **more)


def findings(report: Any) -> dict[str, Any]:
    return {one.quantity: one for one in report.findings if one.group == "Tool paths"}


@pytest.fixture(scope="module")
def line() -> kw.Plan:
    return kw.plan(task("line", [450, 50, 60]))


def disturbed(plan: kw.Plan, change: Any) -> JointTrajectory:
    """The motion with its pieces' coefficients changed, joints and times as they were."""
    curve = plan.trajectory.polynomial
    c, x = change(np.array(curve.c), np.array(curve.x))
    return JointTrajectory(
        plan.trajectory.joint_names,
        PiecewisePolynomial(c, x),
        joint_units=plan.trajectory.joint_units,
    )


def bump(plan: kw.Plan, time: float, width: float, height: float) -> JointTrajectory:
    """A bump of the second joint with a continuous second derivative at a time."""

    def change(c: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        motion = Motion(plan.trajectory.joint_names, x, c)
        made = bumped(motion, 1, time, 0.5 * width, height)
        return made.c, made.x

    return disturbed(plan, change)


@examples(4, 24)
@given(
    along=st.sampled_from(["line", {"arc": {"through": [490, -30, 70]}}]),
    tolerance=st.floats(0.005, 0.2),
    tilt=st.floats(-30, 30),
)
def test_path_bounds_stay_above_dense_samples(along: Any, tolerance: float, tilt: float) -> None:
    end = {"position": [450, 50, 60], "rpy": [180, tilt, 0]}
    given = task(along, [450, 50, 60], tolerances={"path": tolerance})
    given["waypoints"][1]["pose"] = end
    plan = kw.plan(given)
    found = findings(plan.report)
    assert plan.report.ok
    assert judged(plan, given) == []
    assert all(one.proof == "bounded" for one in found.values())
    motion, path = plan.trajectory, plan.scenario.paths[0].motion
    times = np.random.default_rng(0).uniform(path.start_time, path.end_time, 4000)
    poses = [plan.space.robot.forward(q) for q in motion.position(times)]
    points = np.array([pose.translation for pose in poses])
    s = np.linspace(0, path.path.length, 4001)
    near = path.path.nearest(points, path.arc_length(times))
    off = np.linalg.norm(points - path.path.position(near), axis=1).max()
    coarse = np.linalg.norm(points[:50, None] - path.path.position(s)[None], axis=2).min(axis=1)
    assert (coarse >= np.linalg.norm(points - path.path.position(near), axis=1)[:50] - 1e-6).all()
    turned = max(
        np.linalg.norm(pin.log3(R.T @ pose.rotation))
        for R, pose in zip(path.path.rotation(near), poses, strict=True)
    )
    for quantity, value in (("path_deviation", off), ("path_orientation", turned)):
        one = found[quantity]
        assert value <= one.value + one.excess <= one.limit


@pytest.mark.parametrize("width", [0.2, 0.02, 0.002])
def test_bump_between_samples_fails(line: kw.Plan, width: float) -> None:
    stretch = line.scenario.paths[0].stretches[0]
    time = stretch.start + 0.437 * (stretch.end - stretch.start)
    J = line.space.robot.jacobian(line.trajectory.position(time))
    reach = np.linalg.norm(J[[0, 2], 1])  # across the line, which is along y
    for factor, ok in ((0.5, True), (1.5, False)):
        motion = bump(line, time, width, factor * 1e-4 / reach)
        one = findings(kw.check(motion, line.scenario))["path_deviation"]
        assert one.ok is ok, one.message
        assert one.proof == "bounded"


def test_speed_jump_is_seen_on_both_sides_of_break(line: kw.Plan) -> None:
    """Twice as fast just before a break, and as asked after it."""
    stretch = line.scenario.paths[0].stretches[0]
    time = 0.5 * (stretch.start + stretch.end)
    curve = line.trajectory.polynomial

    def change(c: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        new = np.union1d(x, [time - 1e-3, time])
        low = np.array([curve(t) for t in new[:-1]])
        rates = [np.array([curve(t, k) for t in new[:-1]]) for k in (1, 2, 3)]
        full = np.stack((rates[2] / 6, rates[1] / 2, rates[0], low))
        i = int(np.searchsorted(new, time - 1e-3))
        # the same way in the same time, half as fast first and then up to one and a half
        h = new[i + 1] - new[i]
        full[1, i] += 0.5 * rates[0][i] / h
        full[2, i] -= 0.5 * rates[0][i]
        return full, new

    motion = disturbed(line, change)
    given = task("line", [450, 50, 60], continuity=0)
    one = findings(kw.check(motion, kw.load_scenario(given)))["path_speed"]
    assert not one.ok
    assert one.value > 0.4 * 0.06


def test_tolerance_equal_to_deviation_stays_unproved(line: kw.Plan) -> None:
    """No division settles it: rounding is left when all rounds are over."""
    path = line.scenario.paths[0]
    stretch = path.stretches[0]

    def bound(tolerance: float) -> PathBound:
        limits = PathLimits(tolerance, 0.01, 0.01, stretch.speed, stretch.full_speed)
        interval, robot = (stretch.start, stretch.end), line.space.robot
        assert robot is not None
        found = path_bounds(robot, line.trajectory.polynomial, path.motion, interval, limits)
        return found.bounds["path_deviation"]

    tolerance = bound(1e-4).value
    for _ in range(20):
        found = bound(tolerance)
        if found.value <= tolerance:
            break
        tolerance = found.value
    assert not found.proved
    assert found.value <= tolerance < found.bound < tolerance + 1e-9


@pytest.mark.parametrize("ulps", [1, 3])
def test_bounds_hold_between_breaks_next_to_each_other(line: kw.Plan, ulps: int) -> None:
    stretch = line.scenario.paths[0].stretches[0]
    times = [0.4 * stretch.start + 0.6 * stretch.end]
    for _ in range(4 * ulps):
        times.append(float(np.nextafter(times[-1], np.inf)))

    def change(c: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        curve, new = PiecewisePolynomial(c, x), np.union1d(x, times[::ulps])
        rows = [curve(new[:-1], k) / np.prod(range(1, k + 1), initial=1) for k in (3, 2, 1, 0)]
        return np.array(rows), new

    assert kw.check(disturbed(line, change), line.scenario).ok
