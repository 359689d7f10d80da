"""Poses that leave something open: used by what plans, unknown to what checks."""

from __future__ import annotations

import copy
import re
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import knotwork as kw
import seams
from plain import tool_poses
from plans import passing_plan
from sweeps import first_of
from texts import written

DOWN = {"rpy": [180, 0, 0]}
TURN = {"turn": "z"}


def arch(free: Any = TURN, robot: str = "ur5") -> dict[str, Any]:
    """An arc over which the tool turns with the path, unless its turn is free."""
    arc = {"along": {"arc": {"through": [500, 0, 250]}}, "orientation": "tangent", "speed": 50}
    return seams.task(
        {"name": "a", "pose": {"position": [400, -150, 200], **DOWN}, "after": 3, "free": free},
        {"name": "b", **arc, "pose": {"position": [400, 150, 200]}, "free": free},
        {"name": "c", "pose": {"position": [350, 150, 300], **DOWN}, "after": 2},
        robot=robot,
    )


def with_stops(task: dict[str, Any]) -> dict[str, Any]:
    for waypoint in task["waypoints"][:-1]:
        if "along" not in waypoint:
            waypoint["stop"] = True
    task["waypoints"][1]["stop"] = True
    return task


@cache
def planned(free: str = "turn") -> kw.Plan:
    """The plan with stops, its turn free or nothing."""
    return kw.plan(with_stops(arch(TURN if free == "turn" else free)))


def checked(motion: kw.JointTrajectory, task: dict[str, Any]) -> kw.verification.Report:
    return kw.check(motion, kw.load_scenario(task))


def travel(plan: kw.Plan, joint: int) -> float:
    """How far a joint moves along the path [rad]."""
    path = plan.scenario.paths[0]
    times = np.linspace(path.stretches[0].start, path.stretches[-1].end, 500)
    return float(np.abs(np.diff(plan.trajectory.position(times)[:, joint])).sum())


def test_free_turn_spares_last_joint_and_keeps_axis() -> None:
    free, fixed = planned(), planned("none")
    assert free.report.ok
    assert fixed.report.ok
    assert travel(free, 5) < 0.01 < 0.5 < travel(fixed, 5)
    for names in (free.trajectory.joint_names, free.joint_waypoints.joint_names):
        assert names == kw.load_robot("ur5").joint_names
    failed = {f.quantity for f in checked(free.trajectory, with_stops(arch("none"))).failures}
    assert {"orientation", "path_orientation"} & failed
    path = free.scenario.paths[0].timed_path
    times = np.linspace(path.start_time, path.end_time, 300)
    required, _, _, _ = path.state(times)
    poses = tool_poses(free, times)
    off = np.array([pose.translation for pose in poses]) - required
    # behind or ahead of its time, but on the path
    assert np.linalg.norm(off, axis=1).max() < 1.1e-3
    axes = np.array([pose.rotation[:, 2] for pose in poses])
    wanted = path.tool_path.rotation(path.arc_length(times))[:, :, 2]
    assert np.degrees(np.arccos(np.clip((axes * wanted).sum(axis=1), -1, 1))).max() < 0.1


def test_tool_freedom_is_default_of_poses() -> None:
    task = with_stops(arch(None)) | {"tool": {"free": TURN}}
    for waypoint in task["waypoints"]:
        waypoint.pop("free", None)
    assert kw.plan(task).report.ok
    waypoints = kw.load_scenario(task).waypoints
    assert all(getattr(one, "freedom", 1) is not None for one in waypoints)
    task["waypoints"][2]["free"] = "none"
    assert kw.load_scenario(task).waypoints[3].freedom is None


@pytest.mark.parametrize("seed", range(2))
def test_check_ignores_free_turn_but_not_axis(seed: int) -> None:
    random = np.random.default_rng(seed)
    task, plan = with_stops(arch()), planned()
    turned = copy.deepcopy(task)
    rpy = [180, 0, float(random.uniform(-170, 170))]
    turned["waypoints"][0]["pose"]["rpy"] = rpy
    assert checked(plan.trajectory, turned).ok
    tilted = copy.deepcopy(turned)
    tilted["waypoints"][0]["pose"]["rpy"] = [180 - 0.2, 0, rpy[2]]
    report = checked(plan.trajectory, tilted)
    failed = {finding.quantity: finding for finding in report.failures}
    assert {"orientation", "path_orientation"} <= set(failed)
    assert np.degrees(failed["orientation"].value) == pytest.approx(0.2, abs=1e-4)
    assert np.degrees(failed["path_orientation"].value) == pytest.approx(0.2, abs=0.1)


def without_path(**first: Any) -> dict[str, Any]:
    """From the first pose to the last, with more keys at the first."""
    task = arch()
    del task["waypoints"][1]
    task["waypoints"][0] |= first
    return task


def passing(free: Any) -> dict[str, Any]:
    """A pose that is passed at a velocity, which turns the tool about its axis, too."""
    velocity = {"linear": [60, 0, 0], "angular": [10, 0, 200]}
    return without_path(free=free, velocity=velocity)


def test_given_velocity_keeps_fixed_components() -> None:
    plan = passing_plan(passing(TURN))
    robot = plan.joints.robot
    twist = robot.twist(plan.trajectory.position(3.0), plan.trajectory.velocity(3.0))
    pose = robot.forward(plan.trajectory.position(3.0))
    np.testing.assert_allclose(twist.linear, [0.06, 0, 0], atol=1e-6)
    across = np.cross(twist.angular - np.radians([10, 0, 200]), pose.rotation[:, 2])
    np.testing.assert_allclose(across, 0, atol=1e-6)
    fixed = kw.plan(passing("none"))
    speeds = [np.linalg.norm(one.trajectory.velocity(3.0)) for one in (plan, fixed)]
    assert speeds[0] < speeds[1]
    assert not checked(plan.trajectory, passing("none")).ok


def test_turn_of_a_circle_stays_off_its_limits() -> None:
    """At a limit of its turn the arm could not follow the path."""
    circle = {"along": {"arc": {"centre": [400, 250, 300], "normal": [0, 0, 1]}}, "speed": 60}
    place, free = {"position": [400, 200, 300]}, {"free": {"turn": [-350, 350]}}
    task = seams.task(
        {"name": "a", "pose": {**place, "rpy": [180, 0, 30]}, "after": 3, "stop": True},
        {"name": "b", "pose": place, **circle, "orientation": "tangent", **free, "stop": True},
        robot="xarm7",
        tool={"offset": {"position": [0, 0, 80]}},
    )
    passing_plan(task)


def test_bounded_turn_along_path_is_checked_at_all_times() -> None:
    task = with_stops(arch({"turn": [-100, 10]}))
    plan = passing_plan(task)
    path = plan.scenario.paths[0]
    times = np.linspace(path.timed_path.start_time, path.timed_path.end_time, 4000)
    required = path.timed_path.tool_path.rotation(path.timed_path.arc_length(times))
    turns = []
    for R, pose in zip(required, tool_poses(plan, times), strict=True):
        x = R.T @ pose.rotation[:, 0]  # the axes agree within a tenth of a degree
        turns.append(np.degrees(np.arctan2(x[1], x[0])))
    least, most = min(turns), max(turns)
    assert -100.1 < least < most < 10.1
    (used,) = plan.report.select(group="Freedom")
    assert f"turn {least:.3g} to {most:.3g} of -100 to 10 deg" in used.message
    assert np.degrees(used.value) == pytest.approx(most - least, abs=0.1)
    found = checked(plan.trajectory, with_stops(arch({"turn": [-179, most + 3]})))
    (row,) = (finding for finding in found.findings if finding.quantity == "path_turn")
    assert found.ok
    assert np.degrees(row.value) == pytest.approx(-3, abs=0.1)
    assert f"3 deg inside its free range (turn -179 to {most + 3:.4g} deg), tol" in row.message
    found = checked(plan.trajectory, with_stops(arch({"turn": [-179, max(0.0, most - 3)]})))
    (row,) = (finding for finding in found.failures if finding.quantity == "path_turn")
    assert f"3 deg outside its free range (turn -179 to {most - 3:.4g} deg), tol" in row.message
    assert most > 3


CONE = {"turn": "z", "tilt": 10}


@pytest.mark.parametrize("seed", range(2))
def test_check_of_cone(seed: int) -> None:
    yaw, about = np.random.default_rng(seed).uniform(-np.pi, np.pi, 2)
    motion = planned("none").trajectory
    task = with_stops(arch(CONE))
    down = pin.rpy.rpyToMatrix(np.pi, 0.0, 0.0)
    for tilt, ok in ((9.95, True), (10.25, False)):
        axis = np.array([np.cos(about), np.sin(about), 0.0])
        required = down @ pin.exp3(np.radians(tilt) * axis) @ pin.exp3(np.array([0.0, 0.0, yaw]))
        task["waypoints"][0]["pose"] = {
            "position": [400, -150, 200],
            "rotation_matrix": required.tolist(),
        }
        failed = {finding.quantity for finding in checked(motion, task).failures}
        assert ("path_orientation" in failed, "orientation" in failed) == (not ok, not ok)


def dome(folder: Path) -> dict[str, Any]:
    """A serpentine over a sphere, its points with normals as a CAM tool writes them."""
    centre, radius = np.array([450.0, 0.0, -100.0]), 300.0
    normals = []
    for k, y in enumerate(np.linspace(-0.2, 0.2, 5)):
        across = np.linspace(-0.2, 0.2, 12) * (-1) ** k
        turn = [] if k == 0 else [[(-1) ** k * -0.2, y - 0.05]]
        normals += [*([x + (-1) ** k * -0.03, w] for x, w in turn), *([x, y] for x in across)]
    normal = np.array([[x, y, np.sqrt(1 - x * x - y * y)] for x, y in normals])
    points = centre + radius * normal
    text = "x,y,z,nx,ny,nz\n" + "\n".join(
        ",".join(f"{value:.9f}" for value in row) for row in np.hstack((points, normal))
    )
    (folder / "dome.csv").write_text(text)
    z = -normal[0]
    x = np.cross([0, 1, 0], z) / np.linalg.norm(np.cross([0, 1, 0], z))
    rotation = np.column_stack((x, np.cross(z, x), z))
    task = arch()
    first, path = task["waypoints"][:2]
    first["pose"] = {"position": points[0].tolist(), "rotation_matrix": rotation.tolist()}
    path |= {"pose": {"position": points[-1].tolist()}, "along": {"points": "dome.csv"}}
    del first["free"], path["free"], path["orientation"], task["waypoints"][2]
    return task


def test_normals_go_on_from_line(tmp_path: Path) -> None:
    """A line keeps the tool's orientation, and so does a path with equal normals behind it."""
    rows = "\n".join(f"{x:g},0,0.3,0,0,1" for x in np.linspace(0.5, 0.6, 5))
    (tmp_path / "flat.csv").write_text(f"x,y,z,nx,ny,nz\n{rows}\n")
    begin = {"pose": {"position": [0.4, 0, 0.3], "rpy": [np.pi, 0, 0.7]}}
    line = {"along": "line", "pose": {"position": [0.5, 0, 0.3]}, "free": {"turn": "z"}}
    flat = {"along": {"points": str(tmp_path / "flat.csv")}, "pose": {"position": [0.6, 0, 0.3]}}
    steps = [begin, *({**path, "speed": 0.05} for path in (line, flat))]
    scenario = kw.load_scenario({"robot": "ur5", "waypoints": steps})
    for waypoint in scenario.waypoints[1:]:
        np.testing.assert_allclose(waypoint.rotation, scenario.waypoints[0].rotation, atol=1e-12)
        np.testing.assert_allclose(waypoint.angular, 0.0, atol=1e-12)


def test_normals_give_axis_and_free_turn(tmp_path: Path) -> None:
    plan = passing_plan(written(tmp_path / "task.yaml", dome(tmp_path)))
    motion = plan.scenario.paths[0].timed_path
    times = np.linspace(motion.start_time, motion.end_time, 400)
    for pose in tool_poses(plan, times):
        out = pose.translation - np.array([0.45, 0.0, -0.1])
        out /= np.linalg.norm(out)
        assert np.degrees(np.arccos(np.clip(-out @ pose.rotation[:, 2], -1, 1))) < 1.0
    assert travel(plan, 5) < 0.2


def test_normals_need_free_turn_and_matching_start(tmp_path: Path) -> None:
    task = dome(tmp_path)
    task["waypoints"][1]["free"] = "none"
    with pytest.raises(kw.InputError, match=r"waypoints\[1\]\.free.*normals leave the turn"):
        kw.load_scenario(written(tmp_path / "task.yaml", task))
    task = dome(tmp_path)
    task["waypoints"][0]["pose"] = {"position": task["waypoints"][0]["pose"]["position"], **DOWN}
    with pytest.raises(kw.InputError, match="at the first point the tool is rotated by"):
        kw.load_scenario(written(tmp_path / "task.yaml", task))


def between_boxes(*boxes: list[float]) -> dict[str, Any]:
    """A Panda's line of 0.9 m past boxes, at 50 mm/s."""
    turned = {"quaternion_xyzw": [0, 0, 0, 1]}
    size = {"box": [0.15, 0.15, 0.15]}
    return {
        "robot": "panda",
        "tool": {"frame": "panda_hand"},
        "scene": {"objects": {f"box {i}": {**size, "position": at} for i, at in enumerate(boxes)}},
        "waypoints": [
            {"name": "a", "pose": {"position": [0.45, 0.54, 0.79], **turned}},
            {
                "name": "b",
                "along": "line",
                "speed": 0.05,
                "pose": {"position": [-0.45, 0.54, 0.79]},
            },
        ],
    }


def test_planned_self_motion_avoids_boxes() -> None:
    plan = passing_plan(between_boxes([0.2, 0.3, 0.4], [-0.25, 0.3, 0.75]))
    times = np.linspace(0.0, plan.trajectory.end_time, 400)
    points = np.array([pose.translation for pose in tool_poses(plan, times)])
    assert np.abs(points[:, 1:] - [0.54, 0.79]).max() < 1e-4


def test_error_where_no_self_motion_helps() -> None:
    with pytest.raises(kw.InputError, match="can't be followed"):
        kw.plan(between_boxes([-0.35, 0.54, 0.79]))


BOX = {"position": {"x": [-60, 60], "z": [-20, 0]}}


def pick(free: Any) -> dict[str, Any]:
    """A pick with the tool down: its x axis is that of the base, y and z are turned round."""
    return without_path(stop=True, free=free)


@pytest.mark.parametrize("free", [BOX, BOX | TURN, BOX | {"turn": "z", "tilt": 15}])
def test_free_position_stays_in_box(free: Any) -> None:
    plans = [kw.plan(pick(one)) for one in (free, "none")]
    assert all(plan.report.ok for plan in plans)
    far = [np.linalg.norm(p.trajectory.position(3.0) - p.trajectory.position(0.0)) for p in plans]
    assert far[0] < far[1]
    (pose,) = tool_poses(plans[0], [3.0])
    x, y, z = 1e3 * (pose.translation - [0.4, -0.15, 0.2])
    assert -60.001 < x < 60.001
    assert abs(y) < 1e-3
    assert -0.001 < z < 20.001  # the tool's z axis points down
    (used,) = plans[0].report.select(group="Freedom")
    assert re.search(rf"x {x:.3g} of -60 to 60 mm, z {-z:.3g} of -20 to 0 mm", used.message)
    moved = pick(free)
    moved["waypoints"][0]["pose"]["position"] = [400 + x + 65, -150, 200]
    (failed,) = checked(plans[0].trajectory, moved).failures
    assert (failed.quantity, failed.value) == ("position", pytest.approx(5e-3, abs=1e-6))


def pick_then_seam(pick: Any, line: Any, robot: str = "ur5") -> dict[str, Any]:
    """A pose where the tool stops, and then a line, each with what it leaves open."""

    def at(name: str, position: list[float], free: Any, **more: Any) -> dict[str, Any]:
        pose = {"position": position} | ({} if "along" in more else DOWN)
        return {"name": name, "pose": pose, "stop": True, "free": free, **more}

    return seams.task(
        at("pick", [400, -200, 150], pick, after=3),
        at("up", [400, -200, 250], "none", after=2),
        at("a", [450, -100, 250], "none", after=2),
        at("b", [450, 200, 250], line, along="line", speed=50),
        at("c", [450, 200, 300], "none", after=2),
        robot=robot,
    )


PLACE = {"position": {"x": [-20, 20]}}


@pytest.mark.parametrize(
    ("pick", "seam", "robot"),
    [
        (PLACE, TURN, "ur5"),
        ({"turn": [-90, 90]}, {"turn": [-20, 20]}, "panda"),
    ],
)
def test_freedom_of_each_pose_and_path(pick: Any, seam: Any, robot: str) -> None:
    """By plain Pinocchio: a path with nothing free keeps its orientation."""
    plan = passing_plan(pick_then_seam(pick, seam, robot))
    path = plan.scenario.paths[0].timed_path
    times = np.linspace(path.start_time, path.end_time, 60)
    required = path.state(times)[0]
    turned = []
    for pose, place in zip(tool_poses(plan, times), required, strict=True):
        assert np.abs(pose.translation - place)[[0, 2]].max() < 1e-4
        R = pin.rpy.rpyToMatrix(np.pi, 0, 0).T @ pose.rotation
        assert np.arccos(min(R[2, 2], 1.0)) < 0.0018
        turned.append(np.degrees(np.arctan2(R[1, 0], R[0, 0])))
    most = {"none": 0.1, str(TURN): 180.0}.get(str(seam), 20.1)
    assert np.abs(turned).max() < most
    up = tool_poses(plan, np.array([plan.scenario.waypoints[2].time]))[0]
    assert np.abs(up.rotation - pin.rpy.rpyToMatrix(np.pi, 0, 0)).max() < 1e-6


@pytest.mark.parametrize(
    ("begin", "seam", "wait"),
    [
        ({"turn": [-10, 10]}, TURN, 0.5),
        *first_of(
            ({"tilt": 3}, {"turn": "z", "tilt": 5}, 0),
            ({"turn": [-10, 10]}, {"turn": [-60, 60], "tilt": 10}, 0),
        ),
    ],
)
def test_path_begins_at_pose_of_narrower_freedom(begin: Any, seam: Any, wait: float) -> None:
    """The pose is held to its own range, the path to what it leaves open."""
    task = pick_then_seam("none", seam)
    task["waypoints"][2] |= {"free": begin} | ({"wait": wait} if wait else {})
    task["waypoints"][3]["pose"] = {"position": [300, 300, 250]}
    plan = passing_plan(task)
    start = plan.scenario.paths[0].timed_path.start_time
    R = pin.rpy.rpyToMatrix(np.pi, 0, 0).T @ tool_poses(plan, np.array([start]))[0].rotation
    turn, tilt = np.degrees([np.arctan2(R[1, 0], R[0, 0]), np.arccos(min(R[2, 2], 1.0))])
    assert abs(turn) < max(begin.get("turn", [0, 0])) + 1e-3
    assert tilt < begin.get("tilt", 0) + 1e-3
    task["waypoints"][2]["free"] = "none"
    (own,) = (finding for finding in checked(plan.trajectory, task).failures if finding.name == "a")
    assert own.quantity == "orientation"
    assert np.degrees(own.value) == pytest.approx(abs(turn) if "turn" in begin else tilt, abs=0.02)


def test_tries_other_postures_past_obstacle() -> None:
    """Solutions that differ by the free turn alone collide alike: others are tried."""
    tool = {"cylinder": {"radius": 20, "length": 150}, "position": [0, 0, 75]}
    here, there = ({"position": [500, y, 150], **DOWN} for y in (-200, 200))
    wall = {"box": [300, 20, 250], "position": [500, 0, 105]}
    task = seams.task(
        {"name": "here", "after": 3, "pose": here, "stop": True},
        {"name": "there", "after": 3, "way": "clear", "pose": there},
        tool={"offset": {"position": [0, 0, 150]}, "shape": tool, "free": TURN},
        scene={"margin": 5, "objects": {"wall": wall}},
    )
    assert kw.plan(task).report.ok


@pytest.mark.parametrize(
    ("free", "most"), first_of(({"turn": [-20, 5], "tilt": 8}, 20), ({"tilt": 10}, 0))
)
def test_tilt_keeps_fixed_turn(free: Any, most: float) -> None:
    """By plain Pinocchio: roll, pitch and yaw from what the path asks for."""
    plan = passing_plan(with_stops(arch(free)))
    path = plan.scenario.paths[0].timed_path
    times = np.linspace(path.start_time, path.end_time, 200)
    required = path.tool_path.rotation(path.arc_length(times))
    pairs = zip(required, tool_poses(plan, times), strict=True)
    angles = np.degrees([pin.rpy.matrixToRpy(R.T @ pose.rotation) for R, pose in pairs])
    assert 1.0 < np.abs(angles[:, :2]).max() < free["tilt"] + 0.1
    assert -most - 0.11 < angles[:, 2].min()
    assert angles[:, 2].max() < (5.11 if most else 0.11)
    # a turn that is not open fails, however little the axis leans
    narrow = with_stops(arch({"turn": [0, 0.01], "tilt": 12}))
    assert checked(plan.trajectory, narrow).ok is (most == 0)
