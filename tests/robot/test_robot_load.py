"""Finding robots, taking a chain out of a bigger model, and saying what is wrong with a file."""

import re
from pathlib import Path

import numpy as np
import pytest

import knotwork as kw
import urdfs
from knotwork import load_robot, robot_names
from knotwork.errors import DocumentError, InputError, RobotError
from knotwork.files.documents import parse
from plain import tool_frames
from shipped import ROBOT_FILES
from texts import written
from urdfs import limits, link

FURTHER = {"iiwa14": "rtb-data", "kr16": "rtb-data", "ur3e": "airo-models", "ur5e": "airo-models"}
# Moving the tool in its worst direction at 0.09 m/s (or rad/s) takes joint speeds of 1 rad/s at
# most, which is a motion that a person would call possible from there.
NOT_SINGULAR = 0.09


RANGE = limits(-1, 2, velocity=3, effort=4)


def joint(name: str, kind: str, parent: str, child: str, extra: str = "") -> str:
    limited = kind in ("revolute", "prismatic") and "limit" not in extra
    more = extra + (RANGE if limited else "")
    return urdfs.joint(name, parent, child, kind, at="0.1 0 0.2", axis="0 1 0", more=more)


def chain(kind: str, extra: str = "") -> str:
    """A revolute joint, then the one in question."""
    return urdfs.robot(
        *map(link, "abc"),
        joint("first", "revolute", "a", "b"),
        joint("second", kind, "b", "c", extra),
    )


def test_shipped_robots() -> None:
    files = {path.stem for path in ROBOT_FILES.glob("*.yaml")}
    assert {*robot_names(), *FURTHER} == files
    for name in set(FURTHER) - set(robot_names()):
        with pytest.raises(RobotError, match=f"install it with `pip install {FURTHER[name]}`"):
            load_robot(name)


def test_finds_model_without_import(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    models = tmp_path / "site" / "some_models"
    written(models / "__init__.py", "raise SystemExit")
    written(models / "arm.urdf", load_robot("planar2").urdf.read_bytes())
    inline = {"urdf": "some_models:arm.urdf", "tool_frame": "tip"}
    with pytest.raises(RobotError, match=r"'some_models', which is not installed; .* some_models`"):
        load_robot(inline)
    monkeypatch.syspath_prepend(tmp_path / "site")
    assert load_robot(inline).joint_names == ("shoulder", "elbow")
    with pytest.raises(RobotError, match=r"there is no URDF file .*leg\.urdf"):
        load_robot({"urdf": "some_models:leg.urdf"})


@pytest.mark.parametrize("name", robot_names())
def test_shipped_robots_have_regular_home(name: str) -> None:
    robot = load_robot(name)
    assert robot.name == name
    assert robot.description
    assert robot.source.name == f"{name}.yaml"
    q = robot.configuration("home")
    values = np.linalg.svd(robot.jacobian(q), compute_uv=False)
    rows = 2 if name == "planar2" else 6
    assert values[rows - 1] > NOT_SINGULAR
    room = np.minimum(q - robot.limits.lower, robot.limits.upper - q)
    assert (room > np.radians(10)).all()
    assert robot.model.nq == robot.model.nv == robot.dof == len(robot.joint_names)
    assert not any("finger" in joint or "ripper" in joint for joint in robot.joint_names)
    assert (robot.limits.velocity > 0).all()
    for limit in (robot.limits.acceleration, robot.limits.jerk):
        assert ((limit > 0) & np.isfinite(limit)).all()
    comment = robot.source.read_text(encoding="utf-8").split("\nlimits:\n")[1].split("  acc")[0]
    assert re.search("our default|documentation|of our own", comment)


def test_loads_robot_by_name_path_and_description(tmp_path: Path) -> None:
    shipped = load_robot("planar2")
    folder = shipped.source.parent
    by_path = load_robot(folder / "planar2.yaml")
    as_text = load_robot("planar2.yaml", relative_to=folder)
    q = [0.3, 0.7]
    inline = load_robot({"urdf": "planar2.urdf", "tool_frame": "tip"}, relative_to=folder)
    written(tmp_path / "planar2.urdf", shipped.urdf.read_text())
    text = "a: 1\nrobot:\n  urdf: planar2.urdf\n  tool_frame: tip\n"
    part = load_robot(parse(text, tmp_path / "task.yaml").part(("robot",)))
    bare = load_robot(str(folder / "planar2.urdf")).with_tool("tip")
    for robot in (by_path, as_text, inline, part, bare):
        assert robot.forward(q).isApprox(shipped.forward(q), 0.0)
        assert robot.name == "planar2"
    assert part.source == tmp_path / "task.yaml"


def test_refuses_number_as_reference() -> None:
    with pytest.raises(InputError, match="robot is 3; accepted: a name, path or mapping"):
        load_robot(3)  # type: ignore[arg-type]


def test_error_has_line_of_file(tmp_path: Path) -> None:
    text = "urdf: x.urdf\ntool_frame: tip\nlimits:\n  velocty: 3\n"
    with pytest.raises(DocumentError) as caught:
        load_robot(parse(text, tmp_path / "arm.yaml"))
    problem = caught.value.problems[0]
    assert (problem.line, problem.field) == (4, "limits.velocty")
    assert "did you mean 'velocity'" in problem.message


def test_names_candidates_for_tool_frame(tmp_path: Path) -> None:
    robot = load_robot(written(tmp_path / "arm.urdf", chain("revolute")))
    assert robot.tool_frame is None
    for method in (robot.forward, robot.jacobian):
        with pytest.raises(RobotError, match=r"tool frame.*links: a, b; .*: c\)$"):
            method(np.zeros(2))


@pytest.mark.parametrize(
    ("kind", "extra", "says"),
    [
        ("floating", "", "'floating' with 6 freedoms"),
        ("planar", "", "'planar' with 3 freedoms"),
        ("revolute", '<mimic joint="first" multiplier="2" offset="0.1"/>', "mimics joint 'first'"),
    ],
)
def test_refuses_unsupported_joints(kind: str, extra: str, says: str, tmp_path: Path) -> None:
    path = written(tmp_path / "arm.urdf", chain(kind, extra))
    robot = load_robot(path)
    assert robot.joint_names == ("first",)
    with pytest.raises(RobotError, match=says) as caught:
        robot.with_tool("c")
    assert caught.value.joint == "second"
    assert "locked: {second: 0}" in str(caught.value)
    locked = load_robot({"urdf": str(path), "tool_frame": "c", "locked": {"second": 0}})
    assert locked.joint_names == ("first",)
    if kind != "revolute":
        with pytest.raises(RobotError, match="can only be locked at 0"):
            load_robot({"urdf": str(path), "tool_frame": "c", "locked": {"second": 0.5}})


def four_links(folder: Path, *joints: str) -> Path:
    """A URDF of the links a to d."""
    return written(folder / "arm.urdf", urdfs.robot(*map(link, "abcd"), *joints))


def test_plans_prismatic_and_unbounded_joints(tmp_path: Path) -> None:
    path = four_links(
        tmp_path,
        joint("slide", "prismatic", "a", "b"),
        joint("spin", "continuous", "b", "c"),
        joint("fix", "fixed", "c", "d"),
    )
    robot = load_robot(path).with_tool("d")
    assert robot.joint_names == ("slide", "spin")
    assert robot.joint_units == ("m", "rad")
    np.testing.assert_array_equal(robot.limits.lower, [-1, -np.inf])
    np.testing.assert_array_equal(robot.limits.velocity, [3, np.inf])
    # Up the slide's axis y by 0.5, then the last offset turned about y by a right angle.
    tool = robot.forward([0.5, np.pi / 2]).translation
    np.testing.assert_allclose(tool, [0.2 + 0.2, 0.5, 0.4 - 0.1], atol=1e-12)


def test_refuses_joint_without_range(tmp_path: Path) -> None:
    path = written(tmp_path / "arm.urdf", chain("revolute", '<limit velocity="1" effort="1"/>'))
    with pytest.raises(RobotError, match=r"'second'.*leaves it no range"):
        load_robot(path).with_tool("c")
    description = {"urdf": str(path), "tool_frame": "c"}
    assert load_robot({**description, "locked": {"second": 0}}).dof == 1
    limits = {"position": {"second": [-1, 1]}}
    assert load_robot({**description, "limits": limits}).limits.upper[1] == 1
    ends = [
        {"joints": {"first": 0, "second": 0}},
        {"joints": {"first": 1, "second": 0}, "after": "fastest"},
    ]
    task = {"robot": {"urdf": str(path)}, "limits": {"acceleration": 1}, "waypoints": ends}
    assert kw.plan(task).report.ok  # without a tool, a joint may stay where it is
    written(path, chain("revolute", '<limit lower="1" upper="0" velocity="1" effort="1"/>'))
    with pytest.raises(RobotError, match=r"'second' are \[1, 0\]"):
        load_robot(path)


def test_locked_mimic_joints_follow_master(tmp_path: Path) -> None:
    path = four_links(
        tmp_path,
        joint("arm", "revolute", "a", "b"),
        joint("finger", "revolute", "b", "c"),
        joint("twin", "revolute", "b", "d", '<mimic joint="finger" multiplier="-2"/>'),
    )
    robot = load_robot({"urdf": str(path), "tool_frame": "b", "locked": {"finger": 0.3}})
    assert robot.locked == {"finger": 0.3, "twin": -0.6}


@pytest.mark.parametrize("frame", ["b", None])
def test_refuses_followers_of_planned_joints(tmp_path: Path, frame) -> None:
    """A link beside the arm that turns with its first joint would be checked as if it stood."""
    path = four_links(
        tmp_path,
        joint("arm", "revolute", "a", "b"),
        joint("crank", "revolute", "a", "c", '<mimic joint="arm"/>'),
        joint("rod", "revolute", "c", "d", '<mimic joint="crank" multiplier="-1"/>'),
    )
    task = {
        "robot": {"urdf": str(path)} | ({"tool_frame": frame} if frame else {}),
        "waypoints": [{"joints": {"arm": 0}}, {"joints": {"arm": 1}, "after": 2}],
    }
    with pytest.raises(RobotError, match=r"'crank' mimics 'arm', which moves"):
        kw.plan(task)
    task["robot"]["locked"] = {"crank": 0.5}
    plan = kw.plan(task)
    assert plan.report.ok
    assert plan.joints.robot.locked == {"crank": 0.5, "rod": -0.5}


def test_other_joints_are_locked_within_limits(tmp_path: Path) -> None:
    text = chain("revolute", '<limit lower="0.5" upper="1" velocity="1" effort="1"/>')
    robot = load_robot(written(tmp_path / "arm.urdf", text)).with_tool("b")
    assert robot.joint_names == ("first",)
    assert robot.locked == {"second": 0.5}


BAXTER = "example-robot-data:baxter_description/urdf/baxter.urdf"


def test_arm_of_two_armed_robot() -> None:
    robot = load_robot({"urdf": BAXTER, "base_frame": "torso", "tool_frame": "left_gripper"})
    assert robot.joint_names == tuple(
        f"left_{joint}" for joint in ("s0", "s1", "e0", "e1", "w0", "w1", "w2")
    )
    chosen = np.linspace(-0.4, 0.5, 7)
    assert robot.forward(chosen).isApprox(*tool_frames(robot, [chosen]), 1e-12)
    other = robot.with_tool("right_gripper")
    assert other.joint_names[0] == "right_s0"


def test_base_frame_within_chain() -> None:
    robot = load_robot(
        {"urdf": BAXTER, "base_frame": "left_upper_elbow", "tool_frame": "left_hand_link"}
    )
    assert robot.joint_names == ("left_e1", "left_w0", "left_w1", "left_w2")
    whole = load_robot({"urdf": BAXTER, "tool_frame": "left_hand_link"})
    elbow = whole.with_tool("left_upper_elbow")
    q = np.array([0.1, -0.3, 0.2, 0.9, -0.5, 0.7, 0.4])
    q[:3] = [robot.locked[joint] for joint in whole.joint_names[:3]]
    expected = elbow.forward(q[:3]).inverse() * whole.forward(q)
    assert robot.forward(q[3:]).isApprox(expected, 1e-12)


@pytest.mark.parametrize(
    ("path", "tool"),
    [
        ("talos_data/robots/talos_full_v2.urdf", "arm_left_7_link"),
        ("pr2_description/urdf/pr2.urdf", "r_gripper_tool_frame"),
        ("tiago_description/robots/tiago.urdf", "arm_tool_link"),
        ("ur_description/urdf/ur5_gripper.urdf", "tool0"),
        ("so_arm_description/urdf/so101.urdf", None),
        ("icub_description/robots/icub.urdf", "l_hand"),
    ],
)
def test_loads_models_of_whole_robots(path: str, tool: str | None) -> None:
    robot = load_robot(f"example-robot-data:{path}")
    robot = robot.with_tool(tool or robot.tool_candidates[-1])
    middle = np.clip(0.0, robot.limits.lower, robot.limits.upper)
    J = robot.jacobian(middle)
    assert J.shape == (6, robot.dof)
    assert robot.dof >= 1
    assert (np.linalg.norm(J, axis=0) > 0).all()
