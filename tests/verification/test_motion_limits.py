"""Limits on the motion of tool and links, payloads and gravity, through files and Python."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import knotwork as kw
from command_line import Command
from judge.arm import Arm
from knotwork.robot.payload import Payload

HOME = "home"
AWAY = {
    "shoulder_pan_joint": 1.2,
    "shoulder_lift_joint": -1.3,
    "elbow_joint": 1.1,
    "wrist_1_joint": -1.5,
    "wrist_2_joint": -1.0,
    "wrist_3_joint": 0.3,
}
TOOL: dict[str, Any] = {
    "frame": "tool0",
    "offset": {"position": [0, 0, 0.18]},
    "mass": 2.0,
    "centre_of_mass": [0.01, 0, 0.06],
    "inertia": {"ixx": 0.01, "iyy": 0.012, "izz": 0.005, "ixz": 0.001},
}


def move(**rest: Any) -> dict[str, Any]:
    """A UR5 moves from rest to rest in 2 s."""
    waypoints = [{"joints": HOME}, {"joints": AWAY, "after": 2}]
    return {"robot": "ur5", "waypoints": waypoints, **rest}


def peak_speed(plan: kw.Plan, frame: str | None = None) -> float:
    robot = plan.joints.robot
    index = robot.tcp_frame_id if frame is None else robot.model.getFrameId(frame, pin.BODY)
    places = []
    for q in plan.trajectory(np.linspace(0, 2, 20_001)):
        pin.framesForwardKinematics(robot.model, robot.data, q)
        places.append(robot.data.oMf[index].translation.copy())
    return float(np.linalg.norm(np.diff(places, axis=0), axis=1).max() / 1e-4)


KEYS = {
    "tool_speed": (None, lambda limit: limit),
    "frame_speed": ("forearm_link", lambda limit: {"frame": "forearm_link", "speed": limit}),
}


@pytest.mark.parametrize("key", KEYS)
@pytest.mark.parametrize("unit", [1.0, 1e-3])
def test_speed_limit_is_decided_close_to_peak(key: str, unit: float) -> None:
    frame, entry = KEYS[key]
    peak = peak_speed(kw.plan(move()), frame) / unit
    units = {"length": "m" if unit == 1.0 else "mm"}
    for share, ok in ((1.00001, True), (0.99999, False)):
        report = kw.plan(move(units=units, limits={key: entry(share * peak)})).report
        (finding,) = report.select(quantity=key)
        assert (finding.ok, report.ok, finding.proof) == (ok, ok, "bounded")
        assert finding.limit == pytest.approx(share * peak * unit)
        assert finding.value == pytest.approx(peak * unit, rel=1e-5)
        assert finding.margin <= finding.limit - finding.value


def test_checks_each_limited_link() -> None:
    limits = {
        "frame_speed": [
            {"frame": "forearm_link", "speed": 10},
            {"frame": "wrist_1_link", "speed": 0.01},
            {"frame": "base_link", "speed": 0.01},
        ]
    }
    report = kw.plan(move(limits=limits)).report
    findings = report.select(quantity="frame_speed")
    assert [(one.name, one.ok, one.proof) for one in findings] == [
        ("forearm_link", True, "bounded"),
        ("wrist_1_link", False, "bounded"),
        ("base_link", True, "bounded"),
    ]


def test_velocity_jump_makes_tool_acceleration_and_torque_infinite() -> None:
    """Straight lines: no piece accelerates, but the corner can't be passed at any torque."""
    q = kw.load_robot("ur5").configuration(HOME)
    names = kw.load_robot("ur5").joint_names
    middle = q + 0.3 * np.eye(6)[1]
    c = np.zeros((2, 2, 6))
    c[1] = q, middle
    c[0, 0] = middle - q
    joints = [dict(zip(names, state, strict=True)) for state in (q, middle)]
    scenario = kw.load_scenario(
        {
            "robot": "ur5",
            "continuity": 0,
            "limits": {"tool_acceleration": 50, "acceleration": 50},
            "tolerances": {"joint_velocity": 10},
            "waypoints": [{"joints": joints[0]}, {"joints": joints[1], "after": 2}],
        }
    )
    motion = kw.JointTrajectory(names, kw.PiecewisePolynomial(c, [0.0, 1.0, 2.0]))
    report = kw.check(motion, scenario)
    (finding,) = report.select(quantity="tool_acceleration")
    assert (finding.ok, finding.value, finding.time) == (False, np.inf, 1.0)
    efforts = {one.name: one for one in report.select(quantity="effort")}
    assert not efforts["shoulder_lift_joint"].ok
    assert not efforts["elbow_joint"].ok
    assert "is infinite at the jump at 1 s, limit -150 N m" in str(efforts["shoulder_lift_joint"])


def test_checks_singular_value_limit() -> None:
    plan = kw.plan(move())
    (free,) = plan.report.select(quantity="smallest_singular_value")
    assert (free.verdict, free.limit) == ("information", None)
    smallest = min(
        np.linalg.svd(plan.joints.robot.jacobian(q), compute_uv=False)[-1]
        for q in plan.trajectory(np.linspace(0, 2, 10_001))
    )
    for share, ok in ((0.9999, True), (1.0001, False)):
        report = kw.plan(move(limits={"singular_value": share * smallest})).report
        (finding,) = report.select(quantity="smallest_singular_value")
        assert (finding.proof, finding.ok, report.ok) == ("bounded", ok, ok)
        assert (finding.margin >= 0) == ok


def test_use_of_lower_limit_grows_towards_it() -> None:
    limits = {"singular_value": 0.05}
    (finding,) = kw.plan(move(limits=limits)).report.select(quantity="smallest_singular_value")
    assert finding.utilisation == pytest.approx(0.05 / finding.value)


def even_turn() -> dict[str, Any]:
    """The base turns evenly, and the tool's speed, always the same, is its limit: no proof."""
    robot = kw.load_robot("ur5")
    start = dict(zip(robot.joint_names, robot.configuration(HOME), strict=True))
    pan = robot.joint_names[0]
    speed = 3.0 * float(np.linalg.norm(robot.jacobian(robot.configuration(HOME))[:3, 0]))
    turn = [
        {"joints": start, "velocity": {pan: 3.0}},
        {"joints": {**start, pan: start[pan] + 4.5}, "velocity": {pan: 3.0}, "after": 1.5},
    ]
    return {"name": "turn", "robot": "ur5", "limits": {"tool_speed": speed}, "waypoints": turn}


def test_unproved_limit_is_reported_as_sampled() -> None:
    plan = kw.plan(even_turn())
    (finding,) = plan.report.select(quantity="tool_speed")
    assert (finding.proof, finding.proof_gap, finding.ok) == ("sampled", 0.0, True)
    assert (finding.margin, finding.utilisation) == (None, None)
    assert str(finding).endswith("; sampled only: a proof exceeds the budget of evaluations")
    assert plan.report.sampled == (finding,)
    met, required = plan.report.counts
    first, second, *others = str(plan).splitlines()
    assert first == f"PASSED turn: {met} of {required} requirements met, 1 sampled only; 1.5 s"
    assert second.startswith("not proved: tool: speed reaches")
    (row,) = [line for line in others if line.startswith("  Tool and links")]
    assert row.endswith("  sampled only")
    assert "tool_speed" not in {one.quantity for one in plan.report.tightest}
    assert plan.report.to_dict()["sampled"] == [str(finding)]


@pytest.mark.usefixtures("without_plots")
def test_all_outputs_mark_sampled_verdict(knotwork: Command, tmp_path: Path) -> None:
    from knotwork.view import report_page

    plan = kw.plan(even_turn())
    met, required = plan.report.counts
    text = f"{met} of {required} met, 1 sampled only"
    assert text in plan.view().html
    page = report_page(plan).html
    head, _, rest = page.partition("</header>")
    assert text in head
    assert "sampled only: a proof exceeds the budget of evaluations" in head
    assert "tool speed" not in rest.partition('id="tightest"')[2].partition("</section>")[0]
    (row,) = re.findall(r'<tr><th scope="row"></th>.*?</tr>', rest)
    assert "sampled" in row
    assert 'data-label="margin"></td>' in row
    assert "width: 0%" in row
    full = knotwork("plan", kw.Task(**even_turn()).save(tmp_path / "turn.yaml"), "--full").out
    last = full.strip().splitlines()[-1]
    assert last == f"PASSED turn: {met} of {required} requirements met, 1 sampled only"


def test_sweep_has_no_figure_of_sampled_value() -> None:
    study = kw.sweep(even_turn(), {"waypoints[1].after": [1.5]}, workers=0)
    assert study["verdict"] == ["passed"]
    assert study["tool_speed_use"] == [None]
    assert study["message"] == ["1 of its requirements is sampled only"]


@pytest.mark.parametrize("name", ["ur5", "panda", "kinova", "planar2"])
def test_payload_and_gravity_enter_torque(name: str) -> None:
    rng, bare = np.random.default_rng(3), kw.load_robot(name)
    inertia = np.diag([0.02, 0.03, 0.04]) + 0.002 * (1 - np.eye(3))
    loaded = bare.with_tool(payload=Payload(1.5, [0.02, -0.03, 0.1], inertia))
    moments = dict(zip(("ixx", "iyy", "izz"), np.diag(inertia), strict=True))
    moments |= dict.fromkeys(("ixy", "ixz", "iyz"), 0.002)
    tool = {"mass": 1.5, "centre_of_mass": [0.02, -0.03, 0.1], "inertia": moments}
    for gravity in (None, [3.0, -5.0, 7.0]):
        robot = loaded if gravity is None else loaded.with_gravity(gravity)
        judged = Arm(name, Path(), tool, 1.0, 1.0, gravity)
        q = rng.uniform(-3, 3, (3, bare.dof))
        v, a = rng.normal(size=(2, 3, bare.dof))
        efforts = [robot.effort(*state) for state in zip(q, v, a, strict=True)]
        np.testing.assert_allclose(efforts, judged.efforts(q, v, a), rtol=1e-9, atol=1e-9)


def test_payload_and_gravity_of_file_enter_report() -> None:
    """A heavy tool, an arm on the ceiling: each changes the peaks."""

    def lift(**keys: Any) -> float:
        report = kw.plan(move(**keys)).report
        (finding,) = report.select(quantity="effort", name="shoulder_lift_joint")
        return float(finding.value)

    loaded = lift(tool=TOOL)
    assert abs(loaded) > abs(lift()) + 5
    assert loaded * lift(tool=TOOL, gravity=[0, 0, 9.81]) < 0


def test_gravity_is_in_base_frame() -> None:
    """UR arms: base_link is turned by half a turn about z against base."""
    turned = kw.load_robot({"urdf": str(kw.load_robot("ur5").urdf), "base_frame": "base"})
    arm = turned.with_tool("tool0").with_gravity([5.0, 0, 0])
    flat = kw.load_robot("ur5").with_gravity([-5.0, 0, 0])
    q, still = np.array([0.1, -1, 0.5, 0.2, 0.3, 0.4]), np.zeros(6)
    np.testing.assert_allclose(arm.effort(q, still, still), flat.effort(q, still, still))
    np.testing.assert_allclose(arm.gravity, [5.0, 0, 0], atol=1e-12)


def test_refuses_impossible_payloads() -> None:
    for arguments, message in (
        ((-1.0, [0, 0, 0]), "payload: mass is -1 kg; give a positive number"),
        ((np.nan, [0, 0, 0]), "mass.* is nan; every value must be finite"),
        ((1.0, [0, 0]), r"centre of mass must have shape \(3,\)"),
        ((0.0, [0, 0, 0], np.eye(3)), "payload: inertia is given, but the mass is zero"),
        ((1.0, [0, 0, 0], np.triu(np.ones((3, 3)))), "payload: inertia is not symmetric"),
        ((1.0, [0, 0, 0], -np.eye(3)), "not positive definite"),
    ):
        with pytest.raises(kw.InputError, match=message):
            Payload(*arguments)
    robot = kw.load_robot("ur5")
    with pytest.raises(kw.InputError, match=r"gravity\[2\] is inf; every value must be finite"):
        robot.with_gravity([0, 0, np.inf])
    nothing = robot.with_tool(payload=Payload(0.0, [0, 0, 0]))
    q = np.full(6, 0.3)
    np.testing.assert_array_equal(nothing.effort(q, q, q), robot.effort(q, q, q))


def test_copies_keep_payload_of_frame() -> None:
    import pickle

    robot = kw.load_robot("ur5").with_tool(payload=Payload(2.0, [0, 0, 0.06]))
    hanging = pickle.loads(pickle.dumps(robot.with_gravity([0, 0, 9.81])))
    assert hanging.payload.mass == 2.0
    np.testing.assert_array_equal(hanging.gravity, [0, 0, 9.81])
    assert robot.with_tool("wrist_3_link").payload is None
    assert robot.with_limits(velocity=1.0).payload is robot.payload
