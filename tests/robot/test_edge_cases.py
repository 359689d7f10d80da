"""Robots at the edge of what is one: odd trees, hostile files, a single joint, no tool frame."""

from __future__ import annotations

import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import knotwork as kw
from knotwork import load_robot, solve_pose_ik
from knotwork.errors import DocumentError, RobotError
from texts import written
from urdfs import joint, limits, link, robot


def row(count: int) -> str:
    links = (link(f"l{i}") for i in range(count))
    return robot(*links, *(joint(f"j{i}", f"l{i - 1}", f"l{i}", "fixed") for i in range(1, count)))


def star(count: int) -> str:
    links = (link(f"l{i}") for i in range(count))
    return robot(*links, *(joint(f"j{i}", "l0", f"l{i}", "fixed") for i in range(1, count)))


ARM = (
    *map(link, "abc"),
    joint("j", "a", "b", "continuous", at="1 0 0"),
    joint("k", "b", "c", at="1 0 0"),
)
LAUGHS = '<!DOCTYPE robot [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;">]>'
DEFAULTS = f'<!DOCTYPE robot [<!ATTLIST x y CDATA "{"a" * 5_000_000}">]>'
MASS = link("c", '<inertial><mass value="{}"/></inertial>')

INERTIA = '<inertia ixx="-1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>'

HOSTILE = {
    "long row": (row(60_000), "more than 100000 elements"),
    "row": (row(1_500), "the last of 501 in a row; at most 500"),
    "many links": (star(2_500), "2500 links; at most 2000"),
    "nested": (robot(*ARM, "<x>" * 2_000, "</x>" * 2_000), "nested more than 100 deep"),
    "elements": (robot(*ARM, "<x/>" * 200_000), "more than 100000 elements"),
    "entities": (LAUGHS + robot(*ARM), "declares an entity"),
    "attributes": (DEFAULTS + robot(*ARM, "<x/>" * 90_000), "declares an attribute"),
    "unknown encoding": ('<?xml version="1.0" encoding="x"?>' + robot(*ARM), "not XML"),
    "ring": (
        robot(*ARM[:2], joint("j", "a", "b", "fixed"), joint("k", "b", "a", "fixed")),
        "form a ring, which no root link carries: '[ab]', '[ab]'",
    ),
    "its own parent": (robot(*ARM[:2], joint("j", "b", "b", "fixed")), "form a ring"),
    "two parents": (robot(*ARM, joint("l", "a", "c", "fixed")), "'c' is the child of two joints"),
    "joint twice": (robot(*ARM, link("d"), joint("k", "c", "d", "fixed")), "'k' is given"),
    "joint without a parent": (robot(*ARM).replace('<parent link="a"/>', ""), "'j' is not given"),
    "reserved name": (robot(*ARM).replace('"j"', '"universe"'), "is named 'universe'"),
    "mass of no number": (robot(*ARM).replace(ARM[2], MASS.format("heavy")), "'c' is 'heavy'"),
    "mass of nothing": (robot(*ARM).replace(ARM[2], MASS.format("nan")), "'c' is 'nan'"),
    "negative mass": (robot(*ARM).replace(ARM[2], MASS.format("-1")), "number from 0 on"),
    "negative inertia": (
        robot(*ARM).replace(ARM[2], MASS.format(f'1"/>{INERTIA}<x y="')),
        "ixx of link 'c' is '-1'; it must be a number from 0 on",
    ),
    "axis of no direction": (
        robot(*ARM).replace('<axis xyz="0 0 1"/>', '<axis xyz="0 0 0"/>'),
        "the axis of joint 'j' is '0 0 0'; it must be a direction",
    ),
    "axis of no number": (
        robot(*ARM).replace('<axis xyz="0 0 1"/>', '<axis xyz="0 nan 1"/>'),
        "the axis of joint 'j' is '0 nan 1'",
    ),
    "empty": ("", "not XML"),
    "unclosed": ("<robot name='a'>", "not XML"),
    "other XML": ("<html/>", "<html>"),
    "no robot name": ("<robot><link name='a'/></robot>", "(?i)name"),
    "no link": ("<robot name='a'/>", "(?i)link"),
    "unknown parent": (robot(*ARM[:1], joint("j", "x", "a")), "x"),
    "unknown child": (robot(*ARM[:1], joint("j", "a", "x")), "x"),
    "two roots": (robot(*ARM[:2]), "(?i)root"),
    "no limits": (robot(*ARM[:2], joint("j", "a", "b", more="<limits/>")), "j.*limit"),
    "unknown type": (robot(*ARM).replace("continuous", "ball"), "ball"),
    "not a number": (robot(*ARM).replace("1 0 0", "1 zero 0"), "zero"),
    "not finite": (robot(*ARM).replace("1 0 0", "1 nan 0"), "(?i)not finite|nan"),
    "two links of a name": (robot(ARM[0], ARM[0]), "(?i)a"),
}


@pytest.mark.parametrize("case", HOSTILE)
def test_refuses_hostile_urdf_in_one_line(case: str, tmp_path: Path, capfd) -> None:
    text, says = HOSTILE[case]
    path = written(tmp_path / "arm.urdf", text)
    with pytest.raises(RobotError, match=says) as error:
        load_robot(path)
    assert len(str(error.value)) < 600
    assert capfd.readouterr() == ("", "")


def test_reads_largest_trees(tmp_path: Path) -> None:
    """Also in a thread, which may have less room for recursion."""
    path = tmp_path / "arm.urdf"
    for text, links in ((row(500), 500), (star(2_000), 2_000)):
        path.write_text(text, encoding="utf-8")
        with ThreadPoolExecutor(1) as pool:
            assert len(pool.submit(load_robot, path).result().link_names) == links


def test_refuses_file_of_gigabytes(tmp_path: Path) -> None:
    for name in ("arm.urdf", "arm.yaml"):
        with (tmp_path / name).open("wb") as file:
            file.truncate(3_000_000_000)
        with pytest.raises(DocumentError, match="has 3000000000 bytes, and at most"):
            load_robot(tmp_path / name)


@pytest.mark.parametrize("name", ["a", "b", "c", "root_joint", " j ", "é€😀", "[/]"])
@pytest.mark.parametrize("kind", ["continuous", "revolute", "prismatic"])
def test_joint_named_like_link(name: str, kind: str, tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    poses = []
    for text in (robot(*ARM), robot(*ARM).replace('name="j"', f'name="{name}"')):
        path.write_text(text.replace("continuous", kind), encoding="utf-8")
        arm = load_robot(path).with_tool("c")
        poses.append(arm.forward([0.3, 0.2]).homogeneous)
        assert arm.link_names == ("a", "b", "c")
        assert arm.base_frame == "a"
    assert arm.joint_names == (name, "k")
    np.testing.assert_array_equal(*poses)
    locked = load_robot({"urdf": str(path), "tool_frame": "c", "locked": {name: 0.3}})
    np.testing.assert_allclose(locked.forward([0.2]).homogeneous, poses[0], atol=1e-15)


def test_names_with_control_characters(tmp_path: Path) -> None:
    path = written(tmp_path / "arm.urdf", robot(*ARM).replace('name="j"', 'name="x&#10;y&#9;"'))
    assert load_robot(path).with_tool("c").joint_names == ("x\ny\t", "k")


def test_threads_share_robot() -> None:
    arm = load_robot("ur5")
    rng = np.random.default_rng(3)
    q = rng.uniform(-2, 2, (400, arm.dof))
    v = rng.uniform(-1, 1, (400, arm.dof))

    def all_of(i: int) -> tuple[np.ndarray, ...]:
        pose, J = arm.forward_and_jacobian(q[i])
        twist = arm.twist(q[i], v[i]).vector
        found = solve_pose_ik(arm, pose, q[i] + 0.05 * v[i]).q
        return pose.homogeneous, J, twist, arm.effort(q[i], v[i], v[i]), found

    alone = [all_of(i) for i in range(len(q))]
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        with ThreadPoolExecutor(8) as pool:
            together = list(pool.map(all_of, range(len(q))))
    finally:
        sys.setswitchinterval(interval)
    for one, other in zip(alone, together, strict=True):
        for expected, found in zip(one, other, strict=True):
            np.testing.assert_array_equal(found, expected)


LEVER = robot(
    link("stand"),
    link(
        "arm",
        '<inertial><mass value="2"/><origin xyz="0.5 0 0"/>'
        '<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>',
    ),
    joint("turn", "stand", "arm", more=limits(velocity=2, effort=5)),
)


@pytest.fixture
def lever(tmp_path: Path) -> Path:
    return written(tmp_path / "lever.urdf", LEVER)


def test_an_arm_of_one_joint_meets_poses_and_speeds(lever: Path) -> None:
    def pose(angle: float) -> dict[str, list[float]]:
        return {
            "position": [0.8 * np.cos(angle), 0.8 * np.sin(angle), 0.0],
            "rpy": [0.0, 0.0, angle],
        }

    plan = kw.plan(
        {
            "robot": str(lever),
            "tool": {"frame": "arm", "offset": {"position": [0.8, 0, 0]}},
            "waypoints": [
                {"pose": pose(0.0)},
                {
                    "pose": pose(0.3),
                    "after": 1,
                    "velocity": {"linear": [0, 0.16, 0], "angular": [0, 0, 0.2], "in": "tool"},
                },
                {"pose": pose(0.7), "after": 1},
            ],
        }
    )
    plan.report.raise_if_failed()
    np.testing.assert_allclose(plan.joint_waypoints.position[:, 0], [0, 0.3, 0.7], atol=1e-9)
    np.testing.assert_allclose(plan.joint_waypoints.velocity[:, 0], [0, 0.2, 0], atol=1e-9)
    (finding,) = plan.report.select(group="Singularity")
    # J = (0, 0.8, 0, 0, 0, 1): its one singular value is sqrt(1 + 0.8²)
    assert finding.value == pytest.approx(np.hypot(1, 0.8))
