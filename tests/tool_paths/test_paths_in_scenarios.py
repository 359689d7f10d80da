"""Tool paths end to end: from a scenario file to the tool, measured by Pinocchio alone."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import knotwork as kw
from knotwork.errors import FollowingError, InputError
from plans import passing_plan
from seams import ON as FIRST
from seams import task
from texts import written

LINE = {
    "name": "off",
    "along": "line",
    "speed": 60,
    "pose": {"position": [450, 50, 60]},
}
UP = {
    "name": "up",
    "after": 2,
    "stop": True,
    "pose": {"position": [450, 50, 200], "rpy": [180, 0, 0]},
}


def tool(plan: kw.Plan, times: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions [mm], rotations and speeds [mm/s] of the tool by Pinocchio."""
    robot, motion = plan.joints.robot, plan.trajectory
    poses = [robot.forward(q) for q in motion.position(times)]
    twists = [
        robot.twist(q, v).linear
        for q, v in zip(motion.position(times), motion.velocity(times), strict=True)
    ]
    return (
        1e3 * np.array([pose.translation for pose in poses]),
        np.array([pose.rotation for pose in poses]),
        1e3 * np.linalg.norm(twists, axis=1),
    )


def test_blend_stays_within_its_distance() -> None:
    corner = {**LINE, "name": "corner", "blend": 10}
    end = {**LINE, "pose": {"position": [530, 50, 60]}}
    plan = passing_plan(task(FIRST, corner, end, UP))
    path = plan.scenario.paths[0].timed_path
    position, _, speed = tool(plan, np.linspace(path.start_time, path.end_time, 3001))
    assert np.abs(speed / 60 - 1).max() < 0.011
    near = np.linalg.norm(position - [450, 50, 60], axis=1)
    beside = np.minimum(np.abs(position[:, 0] - 450), np.abs(position[:, 1] - 50))
    assert beside[near > 10.1].max() < 0.1
    assert 0.5 < near.min() < 10


def test_fails_in_corner_with_tight_blend() -> None:
    corner = {**LINE, "name": "corner", "blend": 0.001}
    end = {**LINE, "pose": {"position": [530, 50, 60]}}
    failures = kw.plan(task(FIRST, corner, end, UP)).report.failures
    assert {failure.quantity for failure in failures} >= {"effort", "acceleration_change"}


def test_path_not_followed_in_requested_branch() -> None:
    on = {**FIRST, "stop": True, "pose": {"position": [450, 300, 300], "rpy": [180, 60, 0]}}
    pose = {"position": [450, -300, 300], "rpy": [180, -60, 0]}
    off = {**LINE, "speed": 250, "stop": True, "pose": pose}
    branch = {"shoulder": "right", "elbow": "down", "wrist": "flip"}
    with pytest.raises(
        FollowingError, match=r"in the requested branch at 'on'.* or branch: free"
    ) as raised:
        kw.plan(task(on, off, branch=branch))
    assert raised.value.path_start == 1
    kw.plan(task(on, off, branch={"shoulder": "right", "elbow": "up", "wrist": "no flip"}))


@pytest.mark.parametrize("tilt", [[0, 0, 0], [15, -10, 0]])
def test_follows_orientations_of_file(tmp_path: Path, tilt: list[float]) -> None:
    """In a tilted frame the points are tilted, and the orientations held in base axes are not."""
    rows = ["x,y,z,qx,qy,qz,qw"]
    wanted = {0.0: 0.0, 40.0: 20.0, 90.0: 35.0, 150.0: 10.0}
    for y, angle in wanted.items():
        half = np.radians(angle) / 2
        rows.append(f"0,{y},0,{np.cos(half):.9f},{np.sin(half):.9f},0,0")
    (tmp_path / "seam.csv").write_text("\n".join(rows))
    pose = {"position": [0, 150, 0]}
    line = {**LINE, "along": {"points": "seam.csv"}, "frame": "seam", "pose": pose}
    if any(tilt):
        line["orientation_in"] = "base"
    frames = {"seam": {"position": [450, -100, 60], "rpy": tilt}}
    plan = kw.plan(written(tmp_path / "task.yaml", task(FIRST, line, UP, frames=frames)))
    assert [finding for finding in plan.report.findings if finding.verdict == "failed"] == []
    down = pin.rpy.rpyToMatrix(np.pi, 0, 0)
    for y, angle in wanted.items():
        position, rotation, _ = tool(plan, np.array([2.0 + y / 60]))
        there = pin.rpy.rpyToMatrix(*np.radians(tilt)) @ [0, y, 0] + [450, -100, 60]
        np.testing.assert_allclose(position[0], there, atol=0.11)
        turned = pin.log3(rotation[0] @ down.T)
        np.testing.assert_allclose(np.degrees(turned), [0, 0, angle], atol=0.1)
    if any(tilt):
        del line["orientation_in"]
        file = written(tmp_path / "task.yaml", task(FIRST, line, UP, frames=frames))
        with pytest.raises(InputError, match="at the first point the tool is rotated by"):
            kw.plan(file)


def test_points_may_begin_and_end_beside_their_waypoints() -> None:
    seam = {**LINE, "along": {"points": [[450, y, 60] for y in (-60, -50, -40, 0, 40)]}}
    assert kw.plan(task(FIRST, seam, UP)).report.ok


def test_shortest_wait() -> None:
    plan = passing_plan(task(FIRST, {**LINE, "wait": 0.001}, UP))
    end, after = (plan.scenario.waypoints[i].time for i in (2, 3))
    assert after - end == pytest.approx(1e-3)


@pytest.mark.parametrize(("speed", "stop"), [(1e-6, {"stop": True}), (1e-9, {})])
def test_reports_lowest_speed_that_times_resolve(speed: float, stop: Any) -> None:
    first, line = {**FIRST, "stop": True}, {**LINE, "speed": speed, **stop}
    words = r"too slow to resolve.*at least ([0-9.e-]+) m/s"
    with pytest.raises(InputError, match=words) as error:
        kw.load_scenario(task(first, line, UP))
    least = float(re.search(words, str(error.value))[1])  # type: ignore[index]
    kw.load_scenario(task(first, {**line, "speed": 1001 * least}, UP))


@pytest.mark.parametrize(("y", "warned"), [(1e-7, True), (0.0, False)])
def test_warns_of_curve_bulging_between_points(y: float, warned: bool) -> None:
    """Of a straight seam one point is given twice, within rounding: the curve bulges by 38 mm."""
    middle = [[0.4, y, 0.2]] if warned else [[0.45, 0.0, 0.2]]
    points = [[0.4, 0.0, 0.2], *middle, [0.5, 0.0, 0.2]]
    down = {"position": points[0], "rpy": [np.pi, 0, 0]}
    seam = {"along": {"points": points}, "speed": 0.05, "pose": {"position": points[-1]}}
    report = kw.plan(
        {"robot": "ur5", "waypoints": [{"pose": down, "stop": True}, seam | {"stop": True}]}
    ).report
    assert report.ok
    found = report.select(quantity="curve_between_points")
    assert [finding.verdict for finding in found] == ["warning"] * warned
    if warned:
        assert "between points 2 and 3 of 3 (its start is point 1), " in found[0].message
