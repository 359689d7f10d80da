"""Proofs of paths and of turns along them, against dense samples."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

import knotwork as kw
import seams
from judged import judged, with_bump
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.trajectory import JointTrajectory
from knotwork.verification.bounds.path_criteria import PathBound, PathTolerances, RequiredSpeed
from knotwork.verification.bounds.stretch_bounds import path_bounds
from plans import arm, passing_plan
from sweeps import examples, first_of, mostly_exhaustive


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
    return replace(plan.trajectory, polynomial=PiecewisePolynomial(c, x))


@examples(2, 24)
@given(
    along=st.sampled_from(["line", {"arc": {"through": [490, -30, 70]}}]),
    tolerance=st.floats(0.005, 0.2),
    tilt=st.floats(-30, 30),
)
def test_path_bounds_stay_above_dense_samples(along: Any, tolerance: float, tilt: float) -> None:
    end = {"position": [450, 50, 60], "rpy": [180, tilt, 0]}
    given = task(along, [450, 50, 60], tolerances={"path": tolerance})
    given["waypoints"][1]["pose"] = end
    plan = passing_plan(given)
    found = findings(plan.report)
    assert judged(plan, given) == []
    assert all(one.proof == "bounded" for one in found.values())
    motion, path = plan.trajectory, plan.scenario.paths[0].timed_path
    times = np.random.default_rng(0).uniform(path.start_time, path.end_time, 4000)
    poses = [plan.joints.robot.forward(q) for q in motion.position(times)]
    points = np.array([pose.translation for pose in poses])
    s = np.linspace(0, path.tool_path.length, 4001)
    near = path.tool_path.nearest(points, path.arc_length(times))
    off = np.linalg.norm(points - path.tool_path.position(near), axis=1)
    coarse = np.linalg.norm(points[:50, None] - path.tool_path.position(s), axis=2).min(axis=1)
    assert (coarse >= off[:50] - 1e-6).all()
    turned = max(
        np.linalg.norm(pin.log3(R.T @ pose.rotation))
        for R, pose in zip(path.tool_path.rotation(near), poses, strict=True)
    )
    for quantity, value in (("path_deviation", off.max()), ("path_orientation", turned)):
        one = found[quantity]
        assert value <= one.value + one.proof_gap <= one.limit


@pytest.mark.parametrize("width", [0.2, 0.02, 0.002])
def test_bump_between_samples_fails(line: kw.Plan, width: float) -> None:
    stretch = line.scenario.paths[0].stretches[0]
    time = stretch.start + 0.437 * (stretch.end - stretch.start)
    J = line.joints.robot.jacobian(line.trajectory.position(time))
    reach = np.linalg.norm(J[[0, 2], 1])  # across the line, which is along y
    for factor, ok in ((0.5, True), (1.5, False)):
        motion = with_bump(line.trajectory, 1, time, 0.5 * width, factor * 1e-4 / reach)
        one = findings(kw.check(motion, line.scenario))["path_deviation"]
        assert one.ok is ok, one.message
        assert one.proof == "bounded"


def test_speed_jump_is_seen_on_both_sides_of_break(line: kw.Plan) -> None:
    """Twice as fast just before a break, and at the requested speed after it."""
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
        speed = RequiredSpeed(stretch.speed, 0.01, stretch.full_speed_interval)
        allowed = PathTolerances(tolerance, 0.01, speed)
        interval, robot = (stretch.start, stretch.end), arm(line)
        found = path_bounds(robot, line.trajectory.polynomial, path.timed_path, interval, allowed)
        return found.worst_errors["path_deviation"]

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


TURN = {"turn": "z"}
HALF = {"turn": [-180, 180]}


def rim(
    axis: int = 1, parts: int = 1, *, at_ends: Any = (), yaw: float = 0.0, free: Any = TURN
) -> dict[str, Any]:
    """A round of a rim, in parts: a tool that does not turn turns once against its path."""
    arc = {"arc": {"centre": [600, 0, 200], "normal": [0, 0, axis]}}
    ends = [axis * 2 * np.pi * (k + 1) / parts - np.pi / 2 for k in range(parts)]
    down = {"rpy": [180, 0, yaw]}
    given = seams.task(
        {"after": 3, "pose": {"position": [600, -200, 200], **down}, "stop": True},
        *(
            {
                "along": arc,
                "orientation": "tangent",
                "speed": 80,
                **dict(at_ends),
                "pose": {"position": [600 + 200 * np.cos(a), 200 * np.sin(a), 200]},
            }
            for a in ends
        ),
        robot="ur10",
        tool={"offset": {"position": [0, 0, 120]}},
    )
    for k, waypoint in enumerate(given["waypoints"]):
        waypoint |= {"name": "abcde"[k], "free": free if k else "none"}
    return given


def checked(motion: kw.JointTrajectory, task: dict[str, Any], free: Any) -> kw.verification.Report:
    for waypoint in task["waypoints"]:
        waypoint["free"] = free
    return kw.check(motion, kw.load_scenario(task))


def turns(plan: kw.Plan) -> np.ndarray:
    """Of the tool's x axis against the direction about the rim's centre [rad], whole turns too."""
    robot = arm(plan)
    first, last = plan.scenario.paths[0].timed_path, plan.scenario.paths[-1].timed_path
    poses = [
        robot.forward(q)
        for q in plan.trajectory.position(np.linspace(first.start_time, last.end_time, 2000))
    ]
    x = np.unwrap([np.arctan2(*pose.rotation[1::-1, 0]) for pose in poses])
    place = [pose.translation - [0.6, 0.0, 0.2] for pose in poses]
    about = np.unwrap([np.arctan2(y, x) for x, y, _ in place])
    return np.asarray((x - x[0]) - (about - about[0]))


@pytest.mark.parametrize(
    ("axis", "parts", "at_ends"),
    [
        pytest.param(1, 1, {}, marks=pytest.mark.exhaustive),
        (-1, 2, {}),
        pytest.param(1, 2, {"stop": True}, marks=pytest.mark.exhaustive),
    ],
)
def test_whole_turn_exceeds_half_turn_range(axis: int, parts: int, at_ends: dict[str, Any]) -> None:
    plan = passing_plan(rim(axis, parts, at_ends=at_ends))
    wound = np.abs(turns(plan)).max()
    assert wound > np.radians(350)
    report = checked(plan.trajectory, rim(axis, parts, at_ends=at_ends), HALF)
    worst = max(report.select(quantity="path_turn"), key=lambda one: one.value or 0.0)
    assert {one.quantity for one in report.failures} == {"path_turn"}
    assert worst.value == pytest.approx(wound - np.pi, abs=1e-3)


RANGES = [(1, 361, -1), (1, 350, 10), (2, 361, -1)]


@pytest.mark.parametrize(("rounds", "most", "off"), mostly_exhaustive(RANGES, RANGES[1]))
def test_range_of_several_turns_is_bounded(rounds: int, most: float, off: float) -> None:
    """Two rounds fit into one turn each way, begun at its end."""
    task = rim(-1)
    task["waypoints"][1]["along"]["arc"]["turns"] = rounds - 1
    plan = kw.plan(task)
    assert np.degrees(np.abs(turns(plan)).max()) == pytest.approx(360 * rounds, abs=2)
    report = checked(plan.trajectory, task, {"turn": [-most, most]})
    (row,) = report.select(quantity="path_turn")
    assert report.ok == (off < 0)
    assert np.degrees(row.value or 0.0) == pytest.approx(off, abs=1)


@pytest.mark.parametrize("free", first_of({"turn": [-400, 300]}, HALF))
def test_plans_turn_within_range(free: Any) -> None:
    assert kw.plan(rim(free=free)).report.ok


@pytest.mark.parametrize("axis", first_of(1, -1))
def test_turn_may_wind_across_whole_range(axis: int) -> None:
    plan = kw.plan(rim(axis))
    report = checked(plan.trajectory, rim(axis, yaw=180), HALF)
    assert report.ok, report.failures
    (used,) = report.select(group="Freedom")
    ends = [float(word) for word in used.message.split("turn ")[1].split(" of ")[0].split(" to ")]
    assert np.abs(np.abs(ends) - 180).max() < 5


@pytest.mark.parametrize(
    ("at_ends", "more"),
    [
        ({"stop": True}, {}),
        pytest.param({"wait": 0.5}, {}, marks=pytest.mark.exhaustive),
        ({"stop": True}, {"tilt": 5}),
    ],
)
def test_turn_does_not_wrap_at_joints(at_ends: dict[str, Any], more: dict[str, Any]) -> None:
    """Half a turn each, both within the range if the second began anew at its other end."""
    plan = kw.plan(rim(parts=2, at_ends=at_ends))
    first, last = (one.timed_path for one in plan.scenario.paths)
    part = (first.end_time - first.start_time) / (last.end_time - first.start_time)
    found = turns(plan)
    halfway = float(np.interp(part, np.linspace(0, 1, len(found)), found))
    task = rim(parts=2, at_ends=at_ends, yaw=180 + float(np.degrees(halfway)))
    for waypoint, free in zip(task["waypoints"], (HALF, HALF, HALF | more), strict=True):
        waypoint["free"] = free
    report = kw.check(plan.trajectory, kw.load_scenario(task))
    first_half, second_half = report.select(quantity="path_turn")
    assert first_half.ok
    assert first_half.value == pytest.approx(0.0, abs=1e-3)
    assert second_half.value == pytest.approx(halfway - found[-1], abs=2e-3)
