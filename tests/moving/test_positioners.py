"""Poses on links that joints move, against plain Pinocchio and Coal: nothing is turned round."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import coal
import numpy as np
import pinocchio as pin
import pytest

import drawn
import knotwork as kw
from command_line import Command
from moving.moving_truth import OfArm, down, links, seen
from moving.test_moving_things import check_pairs, middles, placed, scene_of, times
from sweeps import first_of

URDF = "example-robot-data:ur_description/urdf/ur5_robot.urdf"
TILT = {
    "carries": "cradle",
    "turns": [0, 1, 0],
    "range": [-0.6, 0.6],
    "velocity": 1.0,
    "position": [0.6, 0, 0.1],
    "rpy": [0, 0, 0.2],
}
TURN = {"in": "cradle", "turns": [0, 0, 1], "position": [0, 0.02, 0.1], "velocity": 2.0}
ARM_HOME = {
    "shoulder_pan_joint": 0.0,
    "shoulder_lift_joint": -1.6,
    "elbow_joint": 1.6,
    "wrist_1_joint": -1.6,
    "wrist_2_joint": -1.6,
    "wrist_3_joint": 0.0,
}
CELL = {
    "urdf": URDF,
    "external_axes": {"tilt": TILT, "plate": TURN},
    "tool_frame": "tool0",
    "collision": {"ignore": [["base_link", "upper_arm_link"], ["forearm_link", "wrist_2_link"]]},
    "configurations": {"home": {"tilt": 0.0, "plate": 0.0, **ARM_HOME}},
}


def on_table(height: float = 0.1, **more: Any) -> dict[str, Any]:
    """A task on a tilting table: a pose passed at speed, and a path at a height above it."""
    return {
        "robot": CELL,
        "frames": {"part": {"on": "plate", "position": [0.05, 0, 0.02], "rpy": [0, 0, 0.3]}},
        "frame": "part",
        "start": "home",
        "near": "home",
        "prefer": {"plate": 0.3, "tilt": 0.5},
        "waypoints": [
            {"pose": down(0, -0.1, 0.2), "after": 2, "velocity": {"linear": [0, 0.05, -0.1]}},
            {"pose": down(0, 0, height), "after": 1, "stop": True},
            {"along": "line", "pose": down(0.12, 0.1, height), "speed": 0.05, "stop": True},
            {"joints": "home", "after": 3},
        ],
        **more,
    }


def part_and_tool(plan: kw.Plan, t: float) -> tuple[pin.SE3, pin.SE3]:
    """The part and the tool in the cell, each from the joints that carry it."""
    q = dict(zip(plan.joints.joint_names, plan.trajectory.position(t), strict=True))
    model = pin.buildModelFromUrdf(str(plan.joints.robot.urdf))
    data = model.createData()
    pin.framesForwardKinematics(model, data, np.array([q[name] for name in model.names[1:]]))

    def at(xyz: list[float], rpy: tuple[float, float, float]) -> pin.SE3:
        return pin.SE3(pin.rpy.rpyToMatrix(*rpy), np.array(xyz))

    cradle = at([0.6, 0, 0.1], (0, 0, 0.2)) * at([0, 0, 0], (0, q["tilt"], 0))
    plate = cradle * at([0, 0.02, 0.1], (0, 0, q["plate"]))
    return plate * at([0.05, 0, 0.02], (0, 0, 0.3)), data.oMf[model.getFrameId("tool0")].copy()


def relative(plan: kw.Plan, t: float) -> tuple[pin.SE3, np.ndarray]:
    """Pose and velocity [m/s] of the tool as the part sees them."""
    return seen(lambda s: pin.SE3.actInv(*part_and_tool(plan, s)), t)


def test_poses_velocities_and_paths_are_relative_to_part(knotwork: Command, tmp_path: Path) -> None:
    plan = kw.plan(on_table())
    assert plan.report.ok, plan.report
    assert plan.joints.joint_names[:2] == ("plate", "tilt")
    for text in (plan.trajectory.to_ros2(), plan.trajectory.to_csv()):
        assert all(name in text for name in ("plate", "tilt", "elbow_joint"))
    moved = np.ptp([plan.trajectory.position(t) for t in np.linspace(0, 3, 20)], axis=0)
    assert moved[:2].min() > 0.01
    axes = plan.report.select(quantity="external_axes")
    motion = plan.scenario.paths[0].timed_path
    q = plan.trajectory.position(np.linspace(motion.start_time, motion.end_time, 2000))
    travel = np.abs(np.diff(q, axis=0)).sum(axis=0)[:2]
    assert {axis.name for axis in axes} == {"plate", "tilt"}
    assert [axis.value for axis in axes] == pytest.approx(travel, rel=1e-3)
    pose, velocity = relative(plan, 2.0)
    assert pose.translation == pytest.approx([0, -0.1, 0.2], abs=1e-8)
    assert velocity == pytest.approx([0, 0.05, -0.1], abs=1e-5)
    along = np.array([0.12, 0.1, 0]) / np.hypot(0.12, 0.1)
    for t in np.linspace(motion.start_time + 1e-4, motion.end_time - 1e-4, 40).tolist():
        pose, velocity = relative(plan, t)
        assert np.linalg.norm(np.cross(pose.translation - [0, 0, 0.1], along)) < 1e-4
        assert abs(pin.log3(pose.rotation.T @ pin.rpy.rpyToMatrix(np.pi, 0, 0))).max() < 2e-3
        if motion.start_time + 0.3 < t < motion.end_time - 0.3:
            assert velocity @ along == pytest.approx(0.05, rel=0.01)
    (speed,) = plan.report.select(quantity="path_speed")
    assert speed.proof == "bounded"
    (efforts,) = plan.report.select(quantity="efforts")
    assert efforts.verdict == "warning"
    plan.save(tmp_path)
    # the frame of its poses is known without its waypoints
    assert knotwork("check", tmp_path, "--scene", tmp_path / "scenario.yaml").code == 0


def lump_and_post(height: float) -> dict[str, Any]:
    """An object on the part, and one in the cell."""
    return {
        "objects": {
            "lump": {"in": "part", "box": [0.05, 0.05, 0.1], "position": [0.1, -0.1, height]},
            "post": {"box": [0.05, 0.05, 0.5], "position": [0.3, 0.35, 0.25]},
        }
    }


@pytest.mark.parametrize("height", first_of(0.18, 0.05))
def test_objects_move_with_part_or_stay_in_cell(height: float) -> None:
    plan = kw.plan(on_table(scene=lump_and_post(height)))

    def others(t: float) -> dict[str, Any]:
        lump = part_and_tool(plan, t)[0] * pin.SE3(np.eye(3), np.array([0.1, -0.1, height]))
        post = pin.SE3(np.eye(3), np.array([0.3, 0.35, 0.25]))
        return {
            "lump": [(coal.Box(0.05, 0.05, 0.1), lump)],
            "post": [(coal.Box(0.05, 0.05, 0.5), post)],
        }

    moments = np.linspace(0.0, plan.trajectory.end_time, 150)
    arms = links(OfArm(plan), pin.SE3.Identity())

    def moving(t: float) -> dict[str, Any]:
        return {name: placed for name, placed in arms(t).items() if name != "base_link"}

    check_pairs(plan.report, moving, others, moments)
    own = [lambda t, name=name: {name: others(t)[name]} for name in ("lump", "post")]
    check_pairs(plan.report, *own, moments)
    assert plan.report.select(name="base_link, lump")
    assert not plan.report.select(name="base_link, post")


def test_scene_is_shown_in_world_frame() -> None:
    plan = kw.plan(on_table(scene=lump_and_post(0.05)))
    shown = scene_of(plan)
    time = times(shown)
    for frame in (0, len(time) // 3, len(time) - 1):
        part, tool = part_and_tool(plan, float(time[frame]))
        lump, post = middles(shown, "objects", frame)
        assert lump == pytest.approx(part.act(np.array([0.1, -0.1, 0.05])), abs=1e-5)
        assert post == pytest.approx([0.3, 0.35, 0.25], abs=1e-5)
        (path,) = middles(shown, "given path", frame)
        assert path == pytest.approx(part.act(np.array([0.06, 0.05, 0.1])), abs=6e-3)
        (tip,) = (one for one in shown["meshes"] if one["name"] == "tool")
        points = drawn.vertices(tip["mesh"])
        here = placed(shown, frame)[tip["carrier"]]
        nearest = np.linalg.norm(
            points @ here.rotation.T + here.translation - tool.translation, axis=1
        )
        assert nearest.min() < 5e-3
    row = drawn.numbers(shown["arm"]["position"], "<f4", len(shown["joints"]))[0]
    first = shown["first_joint"]
    assert row[first : first + 8] == pytest.approx(plan.trajectory.position(0.0), abs=1e-6)
