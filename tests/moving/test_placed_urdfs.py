"""A positioner with a URDF of its own: plain Pinocchio reads both URDFs, composed by hand here."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import Any

import coal
import numpy as np
import pinocchio as pin
import pytest
import trimesh

import knotwork as kw
from command_line import Command
from moving.moving_truth import OfArm, distance, links
from moving.test_moving_things import check_pairs, refused
from moving.test_positioners import ARM_HOME, CELL, on_table
from texts import written

HERE = Path(__file__).parent
PLACE, TURNED = [0.62, 0.05, 0.06], [0.02, 0.0, 0.4]
TURNER = {"urdf": "turner.urdf", "position": PLACE, "rpy": TURNED}
TILT = "turner_elbow_joint"
JOINTS = (TILT, "turn")
HOME = {**ARM_HOME, TILT: 0.0, "turn": 0.0}
STEP = pin.SE3(pin.rpy.rpyToMatrix(0, 0, 0.3), np.array([0.05, 0.0, 0.02]))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the positioner, and a robot file that places it by an arm."""
    folder = tmp_path_factory.mktemp("cell")
    (folder / "meshes").mkdir()
    shutil.copy(HERE / "turner.urdf", folder)
    box = trimesh.creation.box([0.36, 0.2, 0.03]).apply_translation([0, 0, 0.015])
    box.export(folder / "meshes" / "cradle.stl")
    written(folder / "cell.yaml", cell())
    return folder


def cell(**axes: Any) -> dict[str, Any]:
    given = {"turner": TURNER, **axes}
    return {**CELL, "external_axes": given, "configurations": {"home": HOME}}


class Composed:
    """The arm and the positioner, each a model of its own."""

    def __init__(self, folder: Path) -> None:
        self.arm = pin.buildModelFromUrdf(str(kw.load_robot("ur5").urdf))
        self.table = pin.buildModelFromUrdf(str(folder / "turner.urdf"))
        self.place = pin.SE3(pin.rpy.rpyToMatrix(*TURNED), np.array(PLACE))

    def link(self, q: dict[str, float], name: str) -> pin.SE3:
        """Where a link of the positioner is."""
        data, turn = self.table.createData(), q["turn"]
        expected = np.array([q[TILT], np.cos(turn), np.sin(turn)])
        pin.framesForwardKinematics(self.table, data, expected)
        return self.place * data.oMf[self.table.getFrameId(name, pin.BODY)]

    def tool(self, q: dict[str, float]) -> pin.SE3:
        data = self.arm.createData()
        pin.framesForwardKinematics(self.arm, data, np.array([q[n] for n in self.arm.names[1:]]))
        return data.oMf[self.arm.getFrameId("tool0")].copy()


def task(folder: Path, **more: Any) -> dict[str, Any]:
    """A pose passed at speed, and a path, on the plate of the positioner."""
    own = {"robot": str(folder / "cell.yaml"), "prefer": {TILT: 0.5, "turn": 0.3}}
    return on_table(0.15, **{**own, **more})


def named(plan: kw.Plan, t: float) -> dict[str, float]:
    return dict(zip(plan.joints.joint_names, plan.trajectory.position(t).tolist(), strict=True))


def test_robot_has_joints_and_limits_of_both_urdfs(folder: Path) -> None:
    robot = kw.load_robot(folder / "cell.yaml")
    assert robot.dof == 6
    assert set(robot.external_axes) == set(JOINTS)
    turned = robot.with_base("plate")
    assert set(turned.joint_names) == {*JOINTS, *robot.joint_names}
    low, high, fast = (
        dict(zip(turned.joint_names, each, strict=True))
        for each in (
            turned.limits.lower,
            turned.limits.upper,
            turned.limits.velocity,
        )
    )
    assert (low[TILT], high[TILT], fast[TILT]) == (-0.6, 0.7, 1.2)
    assert (low["turn"], high["turn"], fast["turn"]) == (-np.inf, np.inf, 4.0)
    both, random = Composed(folder), np.random.default_rng(1)
    for _ in range(20):
        q = random.uniform(-0.6, 0.6, turned.dof)
        values = dict(zip(turned.joint_names, q.tolist(), strict=True))
        expected = both.link(values, "plate").actInv(both.tool(values))
        assert turned.forward(q).isApprox(expected, 1e-12)


def test_stacked_urdfs_may_share_names(folder: Path) -> None:
    """What both have is called after each; a joint that mimics another follows the renamed one."""
    text = (folder / "turner.urdf").read_text(encoding="utf-8")
    flap = (
        '<link name="flap"/><joint name="flap" type="revolute"><parent link="plate"/>'
        '<child link="flap"/><axis xyz="1 0 0"/><mimic joint="turn" multiplier="2"/>'
        '<limit lower="-9" upper="9" velocity="9" effort="9"/></joint></robot>'
    )
    (folder / "flap.urdf").write_text(text.replace("</robot>", flap), encoding="utf-8")
    second = {"urdf": "flap.urdf", "in": "turner_plate", "position": [0.0, 0.1, 0.3]}
    given = {**cell(second=second), "configurations": {}}
    robot = kw.load_robot(written(folder / "two.yaml", given)).with_tool("second_plate")
    joints = [f"{one}_{joint}" for one in ("turner", "second") for joint in ("elbow_joint", "turn")]
    assert list(robot.joint_names) == joints
    assert dict(robot.followers) == {"flap": "second_turn"}
    assert set(robot.external_axes) == {*joints, "flap"}
    both, q = Composed(folder), [0.2, 1.1, -0.3, 0.7]
    here = both.link({TILT: q[0], "turn": q[1]}, "plate")
    there = both.place.actInv(both.link({TILT: q[2], "turn": q[3]}, "plate"))
    expected = here * pin.SE3(np.eye(3), np.array([0.0, 0.1, 0.3])) * there
    assert robot.forward(q).isApprox(expected, 1e-12)


def shapes(both: Composed, q: dict[str, float]) -> dict[str, Any]:
    """The collision shapes of the positioner, where they are."""
    tilted = pin.SE3(pin.rpy.rpyToMatrix(0, 0, 0.1), np.array([0, 0, -0.02]))
    hull = coal.Box(0.36, 0.2, 0.03)
    middle = tilted * pin.SE3(np.eye(3), np.array([0, 0, 0.015]))
    return {
        "turner_base_link": [(coal.Box(0.5, 0.3, 0.1), both.link(q, "base_link"))],
        "cradle": [(hull, both.link(q, "cradle") * middle)],
        "plate": [(coal.Cylinder(0.2, 0.02), both.link(q, "plate"))],
    }


@pytest.mark.parametrize("higher", [0.0, 0.2])
def test_checks_arm_against_positioner(folder: Path, higher: float) -> None:
    """Each pair's least distance; where the positioner is higher, the same motion runs into it."""
    plan, both = kw.plan(task(folder)), Composed(folder)
    both.place.translation[2] += higher
    turner = {**TURNER, "position": both.place.translation.tolist()}
    path = written(folder / "higher.yaml", cell(turner=turner))
    report = kw.check(plan.trajectory, kw.load_scenario(task(folder, robot=str(path))))
    moments = np.linspace(0.0, plan.trajectory.end_time, 150)
    arms = links(OfArm(plan), pin.SE3.Identity())
    still = ("base_link", "turner_base_link")
    check_pairs(report, arms, lambda t: shapes(both, named(plan, t)), moments, still)
    assert report.ok == (not higher)


@pytest.mark.parametrize("key", ["locked", "start"])
def test_positioner_off_chain_is_fixed_obstacle(folder: Path, key: str) -> None:
    """As the robot's file locks it, or as the configuration says that the motion begins in."""
    where = {TILT: 0.5, "turn": 1.0}
    more = {"locked": where} if key == "locked" else {"configurations": {"home": HOME | where}}
    path = written(folder / "locked.yaml", {**cell(), **more})
    swing = {"joints": {**ARM_HOME, "shoulder_pan_joint": 0.5}, "after": 2}
    plan = kw.plan({"robot": str(path), "start": "home", "waypoints": [swing]})
    assert len(plan.joints.joint_names) == 6
    both = Composed(folder)
    arms = links(plan.trajectory, pin.SE3.Identity())
    plate = shapes(both, where)["plate"]
    moments = np.linspace(0.0, 2.0, 100).tolist()
    value = min(distance(arms(t)["wrist_3_link"], plate) for t in moments)
    (one,) = (
        finding
        for finding in plan.report.select(subject="pair")
        if {*finding.name.split(", ")} == {"plate", "wrist_3_link"}
    )
    assert one.value == pytest.approx(value, abs=2e-3)


def test_refuses_two_configurations_of_positioner_off_chain(folder: Path) -> None:
    away = {**HOME, TILT: 0.5, "shoulder_pan_joint": 0.5}
    path = written(folder / "away.yaml", {**cell(), "configurations": {"home": HOME, "away": away}})
    given = {"robot": str(path), "start": "home", "waypoints": [{"joints": "away", "after": 2}]}
    text = refused(given)
    assert f"waypoints[0].joints: robot 'away': joint {TILT!r} is not planned" in text
    assert "configuration 'away' has it at 0.5, an earlier one at 0; accepted: the same" in text
    assert kw.plan({**given, "waypoints": [{"joints": "home", "after": 2}]}).report.ok


def test_new_task_continues_motion_on_positioner(folder: Path) -> None:
    plan = kw.plan(task(folder))
    again = plan.replan(at=2.5, scenario=kw.Task(**task(folder)))
    assert again.report.ok, again.report
    assert again.joints.joint_names == plan.joints.joint_names
    for order in (0, 1, 2):
        state = plan.trajectory.polynomial(2.5, order)
        assert again.trajectory.polynomial(0.0, order) == pytest.approx(state, abs=1e-9)
    alone = {"robot": str(folder / "cell.yaml"), "waypoints": [{"joints": "home", "after": 2}]}
    with pytest.raises(kw.errors.InputError, match=r"has the joints|unknown joint"):
        plan.replan(at=2.5, scenario=kw.Task(**alone))


WRONG = {
    "missing": (
        {"turner": {**TURNER, "urdf": "tuner.urdf"}},
        r"line 4: external_axes\.turner\.urdf: .*there is no URDF file .*tuner\.urdf",
    ),
    "nothing": ({"turner": {"position": PLACE}}, "give slides or turns, .* or urdf, a file"),
    "still": (
        {"turner": {**TURNER, "urdf": "still.urdf"}},
        r"axes: turner: .*still\.urdf has no joint that moves; accepted: .*scene: objects",
    ),
    "weak": (
        {"turner": {**TURNER, "urdf": "weak.urdf"}},
        r"weak\.urdf is not a valid URDF: joint \[elbow_joint\]: limit has no effort",
    ),
    "on": (
        {"turner": {**TURNER, "in": "tool"}},
        "external_axes: the parent of joint 'turner to .*' is 'tool', which is not a link",
    ),
    "ring": ({"turner": {**TURNER, "in": "plate"}}, "external_axes: its links form a ring"),
    "clash": (
        {"turner": TURNER, TILT: {"turns": [0, 0, 1]}},
        f"turner: another joint has the name 'elbow_joint' of .*, and '{TILT}' is the name of "
        "one, too; accepted: another name for 'turner'",
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_refuses_invalid_positioners(folder: Path, name: str, knotwork: Command) -> None:
    axes, words = WRONG[name]
    (folder / "still.urdf").write_text('<robot name="s"><link name="a"/></robot>', "utf-8")
    turner = (folder / "turner.urdf").read_text(encoding="utf-8")
    (folder / "weak.urdf").write_text(re.sub(r' effort="\w+"', "", turner), "utf-8")
    path = written(folder / f"{name}.yaml", {**cell(), "external_axes": axes})
    err = knotwork("robots", str(path)).refused()
    assert re.search(words, err), err
