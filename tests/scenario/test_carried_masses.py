"""What the arm holds has a mass while it is held, and objects appear; against plain Pinocchio."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
import yaml

import knotwork as kw
from judge.motion import Motion
from judge.task import Task as JudgesTask
from judge.verdict import judge
from knotwork.files import storage
from moving.moving_truth import down
from sweeps import first_of
from urscript_controller import Controller

BOX = {"from": "pick", "to": "place", "box": [0.2, 0.1, 0.1], "position": [0, 0, 0.06]}
INERTIA = {"ixx": 0.02, "iyy": 0.03, "izz": 0.04, "ixy": 0.002}
TOOL = {"offset": {"position": [0, 0.02, 0.1], "rpy": [0.3, 0, 0.2]}, "frame": "tool0"}


def stacking(held: dict[str, Any], **more: Any) -> dict[str, Any]:
    """A UR5 takes a box, carries it to the other side, and goes back."""
    return {
        "robot": "ur5",
        "gravity": [0.5, 0.0, -9.7],
        "tool": {**TOOL, "mass": 1.0, "centre_of_mass": [0, 0, 0.05], "holds": {"box": held}},
        "times": "fastest",
        "limits": {"used_fraction": 0.5, "acceleration": 12},
        "waypoints": [
            {"name": "home", "pose": down(0.4, 0.1, 0.4)},
            {"name": "pick", "pose": down(0.6, 0.3, 0.2), "stop": True},
            {"name": "over", "pose": down(0.6, 0.0, 0.3), "velocity": "free"},
            {"name": "place", "pose": down(0.6, -0.3, 0.2), "stop": True},
            {"name": "back", "pose": down(0.4, 0.1, 0.4)},
        ],
    } | more


def timed(task: dict[str, Any]) -> dict[str, Any]:
    """The task with a stop at each waypoint, every 1.5 s."""
    del task["times"]
    for waypoint in task["waypoints"][1:]:
        waypoint.pop("velocity", None)
        waypoint |= {"after": 1.5, "stop": True}
    return task


def tensor(moments: dict[str, float]) -> np.ndarray:
    """The inertia that a file gives, shape (3, 3) [kg m²]."""
    ixx, iyy, izz, ixy = (moments.get(key, 0.0) for key in ("ixx", "iyy", "izz", "ixy"))
    return np.array([[ixx, ixy, 0], [ixy, iyy, 0], [0, 0, izz]])


def torques(plan: kw.Plan, payload: pin.Inertia, at: pin.SE3) -> tuple[np.ndarray, np.ndarray]:
    """Times and joint torques of a motion, of a model with the payload from pick to place on."""
    bare = plan.joints.robot.model
    loaded = bare.copy()
    tool = loaded.frames[loaded.getFrameId("tool0")]
    loaded.appendBodyToJoint(tool.parentJoint, payload, tool.placement * at)
    times = {waypoint.name: waypoint.time for waypoint in plan.scenario.waypoints}
    rows, when = [], []
    for start, end in pairwise([0.0, times["pick"], times["place"], plan.trajectory.end_time]):
        model = loaded if start == times["pick"] else bare
        data = model.createData()
        inside = np.linspace(start, end, 1500)[1:-1]
        states = (plan.trajectory(inside, order) for order in range(3))
        rows += [pin.rnea(model, data, *state).copy() for state in zip(*states, strict=True)]
        when += inside.tolist()
    return np.array(when), np.array(rows)


@pytest.mark.parametrize(
    ("mass", "centre", "inertia"),
    first_of((3.0, [0.05, -0.02, 0.1], INERTIA), (4.0, None, None)),
)
def test_torque_includes_held_object(mass: float, centre: Any, inertia: Any) -> None:
    own = {"centre_of_mass": centre, "inertia": inertia}
    held = BOX | {"mass": mass} | {key: one for key, one in own.items() if one}
    plan = kw.plan(stacking(held))
    payload = pin.Inertia(mass, np.array(centre or BOX["position"]), tensor(inertia or {}))
    at = pin.SE3(pin.rpy.rpyToMatrix(0.3, 0, 0.2), np.array([0, 0.02, 0.1]))
    _, torque = torques(plan, payload, at)
    findings = plan.report.select(quantity="effort", subject="joint")
    most = np.abs(torque).max(axis=0)
    for one, dense in zip(findings, most, strict=True):
        assert one.ok
        assert dense <= abs(one.value) + one.proof_gap + 1e-6
        assert dense == pytest.approx(abs(one.value), rel=5e-3, abs=5e-3)
    # the limits bind with the load, and are kept
    assert (most / plan.joints.limits["effort"]).max() == pytest.approx(1.0, abs=0.02)
    assert plan.report.ok


def test_heavier_box_exceeds_effort_limits(tmp_path: Path) -> None:
    """For the check, and for the judge, which shares nothing with it."""
    plan = kw.plan(stacking(BOX | {"mass": 4.0}))
    plan.save(tmp_path)
    motion = Motion.read(tmp_path / "trajectory.json")
    text = (tmp_path / "scenario.yaml").read_text()
    for mass, joints in (("4.0", set()), ("4.5", {"shoulder_lift_joint"})):
        data = yaml.safe_load(text.replace("mass: 4.0", f"mass: {mass}"))
        found = kw.check(plan.trajectory, kw.load_scenario(data)).failures
        assert {finding.quantity for finding in found} <= {"effort"}
        assert {finding.name for finding in found} >= joints
        wrong = judge(JudgesTask(data, tmp_path), motion)
        assert {one.where for one in wrong} == {finding.name for finding in found}


def test_load_slows_motion_only_while_held() -> None:
    spans = {}
    for mass in (0.0, 4.0):
        plan = kw.plan(stacking(BOX | {"mass": mass}))
        spans[mass] = np.diff(plan.scenario.times)
    assert spans[4.0][0] == pytest.approx(spans[0.0][0], rel=0.05)
    assert spans[4.0][1:3].sum() > 1.1 * spans[0.0][1:3].sum()


def test_the_load_changes_at_rest(tmp_path: Any) -> None:
    plan = kw.plan(stacking(BOX | {"mass": 4.0}))
    times = {waypoint.name: waypoint.time for waypoint in plan.scenario.waypoints}
    for name in ("pick", "place"):
        assert np.abs(plan.trajectory.acceleration(times[name])).max() < 1e-9
    again = kw.plan(plan.freeze(tmp_path / "frozen.yaml"))
    assert np.array_equal(again.trajectory.polynomial.c, plan.trajectory.polynomial.c)


@pytest.mark.parametrize(
    ("appears", "hit"), [(None, True), ("over", True), ("place", False), ("back", False)]
)
def test_object_appears_at_waypoint(appears: str | None, hit: bool) -> None:
    """What comes later stands in no way before, and in the way from then on."""
    crate: dict[str, Any] = {"box": [0.1, 0.1, 0.1], "position": [0.6, 0.0, 0.25]}
    if appears is not None:
        crate["appears"] = appears
    task = timed(stacking(BOX, scene={"objects": {"crate": crate}}))
    failures = kw.plan(task).report.failures
    assert any("crate" in finding.name for finding in failures if finding.subject == "pair") == hit


def test_programs_of_universal_robots_set_payload_and_tool(tmp_path: Path) -> None:
    task = timed(stacking(BOX | {"mass": 3.0, "inertia": INERTIA}))
    task["waypoints"][1] |= {"wait": 0.4}
    task["waypoints"][1].pop("stop")
    plan = kw.plan(task)
    motion = storage.load_trajectory(plan.save(tmp_path)[0])
    assert motion.loads == plan.trajectory.loads
    at = pin.SE3(pin.rpy.rpyToMatrix(0.3, 0, 0.2), np.array([0, 0.02, 0.1]))
    both = (1.0 * np.array([0, 0, 0.05]) + 3.0 * (at * np.array([0, 0, 0.06]))) / 4.0
    expected = [(0.0, 1.0, [0, 0, 0.05]), (1.5, 4.0, both), (4.9, 1.0, [0, 0, 0.05])]
    controller = Controller(motion.position(0.0), 500.0)
    robot = plan.joints.robot
    controller.run(motion.to_urscript(robot=robot))
    flange = robot.tool_offset
    np.testing.assert_allclose(controller.tcp[:3], flange.translation)
    assert pin.exp3(controller.tcp[3:]) == pytest.approx(flange.rotation)
    point = pin.Inertia(1.0, np.array([0, 0, 0.05]), np.zeros((3, 3)))
    whole = point + at.act(pin.Inertia(3.0, np.array([0, 0, 0.06]), tensor(INERTIA)))
    m = whole.inertia
    moments = [m[0, 0], m[1, 1], m[2, 2], m[0, 1], m[0, 2], m[1, 2]]
    np.testing.assert_allclose(controller.inertias[1], moments, atol=1e-12)
    for found, wanted in zip(controller.payloads, expected, strict=True):
        assert abs(found[0] - wanted[0]) <= 0.0021
        assert found[1] == pytest.approx(wanted[1])
        np.testing.assert_allclose(found[2], wanted[2], atol=1e-12)
