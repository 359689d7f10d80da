"""What moves by itself, objects in it and other robots, against Pinocchio and Coal; their pages."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import coal
import numpy as np
import pinocchio as pin
import pytest

import drawn
import knotwork as kw
from drawn import placed
from moving.moving_truth import Bodies, down, frame, links, sampled, seen
from sweeps import mostly_exhaustive

LINEAR, ANGULAR, ORIGIN = [0.0, 0.2, 0.0], [0.0, 0.0, 0.1], [0.4, -0.6, 0.1]


def belt(**more: Any) -> dict[str, Any]:
    """A task in a frame that slides and turns, and one that is placed in it."""
    return {
        "robot": "ur5",
        "frames": {
            "belt": {"position": ORIGIN, "moves": {"linear": LINEAR, "angular": ANGULAR}},
            "tray": {"in": "belt", "position": [0.0, 0.05, 0.02]},
        },
        "frame": "tray",
        "start": "home",
        "waypoints": [
            {"pose": down(0, 0, 0.2), "after": 2, "velocity": {"linear": [0, 0, -0.1]}},
            {"pose": down(0, 0, 0.1), "after": 1, "stop": True, "name": "at"},
            {"along": "line", "pose": down(0.1, 0, 0.1), "speed": 0.05, "stop": True},
            {"joints": "home", "after": 3},
        ],
        **more,
    }


def tool(plan: kw.Plan, t: float) -> tuple[pin.SE3, pin.Motion]:
    """Pose and velocity (of the TCP, in base axes) of a UR5's tool by plain Pinocchio."""
    robot = plan.joints.robot
    model = pin.buildModelFromUrdf(str(robot.urdf))
    data, q, v = model.createData(), plan.trajectory.position(t), plan.trajectory.velocity(t)
    pin.forwardKinematics(model, data, q, v)
    pin.updateFramePlacements(model, data)
    tip = model.getFrameId(robot.tool_frame)
    twist = pin.getFrameVelocity(model, data, tip, pin.LOCAL_WORLD_ALIGNED)
    return data.oMf[tip].copy(), twist


def tray(t: float) -> pin.SE3:
    return frame(ORIGIN, LINEAR, ANGULAR, t) * pin.SE3(np.eye(3), np.array([0, 0.05, 0.02]))


def in_tray(plan: kw.Plan, t: float) -> tuple[pin.SE3, np.ndarray]:
    """Pose and velocity [m/s] of the tool as they are seen from the tray."""
    return seen(lambda s: tray(s).actInv(tool(plan, s)[0]), t)


def test_waypoints_and_paths_move_with_frame() -> None:
    plan = kw.plan(belt())
    assert plan.report.ok, plan.report
    for time, position, velocity in (
        (2.0, [0, 0, 0.2], [0, 0, -0.1]),
        (3.0, [0, 0, 0.1], [0, 0, 0]),
    ):
        pose, moving = in_tray(plan, time)
        assert pose.translation == pytest.approx(np.array(position, dtype=float), abs=1e-8)
        assert abs(pin.log3(pose.rotation.T @ pin.rpy.rpyToMatrix(np.pi, 0, 0))).max() < 1e-7
        assert moving == pytest.approx(np.array(velocity, dtype=float), abs=1e-5)
    path = plan.scenario.paths[0].timed_path
    for t in np.linspace(path.start_time + 1e-4, path.end_time - 1e-4, 60).tolist():
        pose, moving = in_tray(plan, t)
        assert np.hypot(pose.translation[1], pose.translation[2] - 0.1) < 1e-4
        if path.start_time + 0.1 < t < path.end_time - 0.1:
            assert moving[0] == pytest.approx(0.05, rel=0.01)
    (speed,) = plan.report.select(quantity="path_speed")
    assert speed.proof == "bounded"


BOX = {"in": "tray", "box": [0.06, 0.06, 0.04], "position": [0, 0, -0.04]}


def check_pairs(
    report: kw.Report,
    own: Bodies,
    others: Bodies,
    times: np.ndarray,
    left_out: tuple[str, str] | None = None,
) -> None:
    """Proved values hold at samples, and found ones are near the least; of all pairs but one."""
    found = {frozenset(one.name.split(", ")): one for one in report.select(subject="pair")}
    for pair, row in sampled(own, others, times).items():
        if pair == left_out:
            assert frozenset(pair) not in found
            continue
        one, least = found[frozenset(pair)], float(row.min())
        assert least >= one.value - one.proof_gap - 1e-6, one.message
        assert one.value <= max(1.25 * least, least + 2e-3), one.message
        assert one.ok == (least > 1e-6), one.message


def test_reports_unchecked_pairs_of_surroundings() -> None:
    post = {"box": [0.02, 0.02, 0.02], "position": [0, 2, 0]}
    wall = {"box": [0.02, 0.02, 0.02], "position": [0, 2.2, 0]}
    report = kw.plan(belt(scene={"objects": {"box": BOX, "post": post, "wall": wall}})).report
    messages = [finding.message for finding in report.select(quantity="pairs_not_checked")]
    because = "not checked, since no joint of the robot moves one of them to the other: "
    assert f"{because}box and post; box and wall" in messages


@pytest.mark.parametrize("height", [0.2, 0.02])
def test_proof_moves_objects_with_frame(height: float) -> None:
    task = belt(scene={"objects": {"box": BOX}})
    task["waypoints"][1]["pose"] = down(0, 0, height)
    task["waypoints"][2]["pose"] = down(0.03, 0, height)
    plan = kw.plan(task)
    times = np.linspace(0.0, plan.trajectory.end_time, 400)
    own = links(plan.trajectory, pin.SE3.Identity())
    box, below = coal.Box(0.06, 0.06, 0.04), pin.SE3(np.eye(3), np.array([0.0, 0.0, -0.04]))
    check_pairs(plan.report, own, lambda t: {"box": [(box, tray(t) * below)]}, times)


LEFT = {
    "robot": "ur5",
    "start": "home",
    "waypoints": [
        {"pose": down(0.4, 0.3, 0.3), "after": 2, "stop": True},
        {"joints": "home", "after": 3},
    ],
}


def two_arms(folder: Path, **more: Any) -> dict[str, Any]:
    path = kw.Task(**LEFT).save(folder / "left.yaml")
    left = {"scenario": str(path), "position": [0.9, 0, 0], "rpy": [0, 0, np.pi], **more}
    return {**LEFT, "scene": {"robots": {"left": left}}}


def other_arm(apart: float) -> Bodies:
    """Links of the arm that faces the first one, on its own clock."""
    facing = pin.SE3(pin.rpy.rpyToMatrix(0, 0, np.pi), np.array([apart, 0, 0]))
    return links(kw.plan(LEFT).trajectory, facing)


@pytest.mark.parametrize("delay", mostly_exhaustive([0.5, 2.5], 0.5))
@pytest.mark.parametrize("apart", mostly_exhaustive([0.9, 0.8], 0.8))
def test_other_robot_follows_its_plan(tmp_path: Path, delay: float, apart: float) -> None:
    plan = kw.plan(two_arms(tmp_path, delay=delay, position=[apart, 0, 0]))
    there = other_arm(apart)
    own = links(plan.trajectory, pin.SE3.Identity())

    def others(t: float) -> dict[str, Any]:
        return {f"left/{name}": placed for name, placed in there(t - delay).items()}

    check_pairs(plan.report, own, others, np.linspace(0.0, plan.trajectory.end_time, 60))


def test_other_robot_follows_recorded_motion(tmp_path: Path) -> None:
    recorded = kw.plan(LEFT).save(tmp_path / "motion")[0]
    planned = kw.plan(two_arms(tmp_path, delay=0.5)).report.select(subject="pair")
    read = kw.plan(two_arms(tmp_path, delay=0.5, motion=str(recorded))).report
    assert [one.value for one in read.select(subject="pair")] == [one.value for one in planned]


def refused(task: dict[str, Any]) -> str:
    with pytest.raises(kw.errors.InputError) as caught:
        kw.plan(task)
    return str(caught.value)


def test_refuses_path_while_frame_speed_jumps(tmp_path: Path) -> None:
    """A file of positions alone is straight between its rows; with speeds it is smooth."""
    rows = [(0, 0.0, 0.1), (1, 0.1, 0.1), (2.5, 0.25, 0.1), (4.0, 0.35, 0.05), (9, 0.6, 0.05)]
    task = belt()
    task["frames"]["belt"]["moves"] = {"file": str(tmp_path / "y.csv"), "at": 0.5}
    (tmp_path / "y.csv").write_text("\n".join(["time,y", *(f"{t},{y}" for t, y, _ in rows)]))
    message = refused(task)
    assert "waypoints[2]: the tool is on the path to it from 3 s to 5" in message
    assert "at 3 s the speed of frame 'belt'" not in message
    assert "at 4.5 s the speed of frame 'belt' jumps by 0.0167 m/s" in message
    lines = ["time,y,y.velocity", *(",".join(map(str, row)) for row in rows)]
    (tmp_path / "y.csv").write_text("\n".join(lines))
    assert kw.plan(task).report.ok


def scene_of(plan: kw.Plan) -> dict[str, Any]:
    shown: dict[str, Any] = drawn.scene(plan.view())
    return shown


def times(scene: dict[str, Any]) -> Any:
    return drawn.numbers(scene["arm"]["time"], "<f4", 1)[:, 0]


def middles(scene: dict[str, Any], name: str, frame: int) -> np.ndarray:
    """Middles of the boxes round things of a name [m], shape (n, 3)."""
    places = placed(scene, frame)
    return np.array([_middle(one, places) for one in scene["meshes"] if one["name"] == name])


def middle_of_held(data: Any, time: float, k: int) -> Any:
    """Middle of the box that is drawn for what is held, at a time [s], that of column k."""
    (here,) = (
        one
        for one in data["meshes"]
        if one["name"] == "held"
        and (one["between"][0] is None or time >= one["between"][0])
        and (one["between"][1] is None or time < one["between"][1])
    )
    return _middle(here, placed(data, k))


def _middle(thing: dict[str, Any], places: list[pin.SE3]) -> Any:
    at = places[thing.get("carrier", 0)]
    corners = drawn.vertices(thing["mesh"]) @ at.rotation.T + at.translation
    return 0.5 * (corners.min(axis=0) + corners.max(axis=0))


def test_draws_scene_relative_to_moving_frame() -> None:
    """Speeds on the path, the given path, frames and labels, against plain Pinocchio."""
    plan = kw.plan(belt(scene={"objects": {"box": BOX}}))
    scene, motion = scene_of(plan), plan.scenario.paths[0].timed_path
    time, speed = times(scene), drawn.numbers(scene["arm"]["speed"], "<f4", 1)[:, 0]
    on = np.flatnonzero((time > motion.start_time) & (time < motion.end_time))
    for k in [*on[::40].tolist(), 20, len(time) - 20]:
        world = np.linalg.norm(tool(plan, float(time[k]))[1].linear)
        seen = np.linalg.norm(in_tray(plan, float(time[k]))[1])
        assert speed[k] == pytest.approx(seen if k in on else world, abs=1e-4)
        assert k not in on or world > seen + 0.1
    for k in (0, len(time) - 1):
        now = tray(float(time[k]))
        (path,) = middles(scene, "given path", k)
        assert now.actInv(path) == pytest.approx(np.array([0.05, 0, 0.1]), abs=6e-3)
        places = placed(scene, k)
        labels = {
            one["text"]: places[one.get("carrier", 0)].act(np.array(one["at"]))
            for one in scene["labels"]
        }
        assert labels["tray"] == pytest.approx(now.translation, abs=1e-5)
        assert labels["box"] == pytest.approx(now.act(np.array([0, 0, -0.04])), abs=1e-5)


def test_draws_other_robot_along_its_motion(tmp_path: Path) -> None:
    plan = kw.plan(two_arms(tmp_path, delay=0.5))
    scene = scene_of(plan)
    there, time = other_arm(0.9), times(scene)
    robot = plan.joints.robot
    first = len(scene["joints"]) - robot.dof + 1  # the other arm's joints come last
    for k in (0, len(time) // 3, len(time) - 1):
        places = placed(scene, k)
        bodies = set(there(0.0))
        for joint, at in enumerate(places[first:], 1):
            body = next(
                f for f in robot.model.frames if f.parentJoint == joint and f.name in bodies
            )
            geometry = there(float(time[k]) - 0.5)[body.name][0][1]
            rest = there(-1.0)[body.name][0][1]
            # the same step from the start to now, seen from the first place of the joint
            start = placed(scene, 0)[first + joint - 1]
            assert (at * start.inverse() * rest).isApprox(geometry, 1e-4)
    assert sum(one["name"].startswith("other robots") for one in scene["meshes"]) >= robot.dof
