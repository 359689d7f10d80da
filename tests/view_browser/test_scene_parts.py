"""What scenes are made of, without a browser: meshes, frames, pages."""

from __future__ import annotations

import base64
import json
import re
from dataclasses import replace
from pathlib import Path

import coal
import numpy as np
import pinocchio as pin
import pytest

import knotwork as kw
from knotwork.errors import InputError
from knotwork.polynomial import PiecewisePolynomial
from knotwork.view.animation import LEAST_RATE, frames, joint_tree
from knotwork.view.links import find_mesh, link_shapes
from knotwork.view.mesh import Mesh
from knotwork.view.page import Page, json_in_html
from knotwork.view.path import robot_curve, tool_path
from knotwork.view.show import view_plan
from knotwork.view.solids import box, capsule, cylinder, sphere

FAILING = Path(__file__).parents[1] / "failing"


def volume_and_area(mesh: Mesh) -> tuple[float, float]:
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
    return float(volume), float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


@pytest.mark.parametrize(
    ("mesh", "volume", "area"),
    [
        (box([1, 2, 3], (1, 0, 0, 1)), 6.0, 22.0),
        (cylinder(1, 2, (1, 0, 0, 1)), 2 * np.pi, 6 * np.pi),
        (sphere(1, (1, 0, 0, 1), 96), 4 / 3 * np.pi, 4 * np.pi),
        (capsule(1, 2, (1, 0, 0, 1)), (2 + 4 / 3) * np.pi, 8 * np.pi),
    ],
)
def test_plain_shapes_have_their_volume_and_face_outwards(
    mesh: Mesh, volume: float, area: float
) -> None:
    assert volume_and_area(mesh) == pytest.approx((volume, area), rel=0.02)
    corners = mesh.vertices[mesh.faces]
    outwards = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.einsum("ij,ij->i", outwards, mesh.normals[mesh.faces].mean(axis=1)) > 0).all()


@pytest.mark.parametrize("name", ["ur5", "kinova", "xarm7"])
def test_meshes_are_those_that_pinocchio_reads(name: str) -> None:
    """The outline of the whole arm, from Pinocchio's own geometry model and mesh reader."""
    robot = kw.load_robot(name)
    shown = link_shapes(robot)
    assert not shown.warnings
    text = robot.urdf.read_text(encoding="utf-8")
    data = next(folder for folder in robot.urdf.parents if folder.name == "example-robot-data")
    full = pin.buildModelFromXML(text.replace('type="continuous"', 'type="fixed"'))
    visual = pin.buildGeomFromUrdfString(
        full,
        text.replace('type="continuous"', 'type="fixed"'),
        pin.VISUAL,
        package_dirs=[str(data.parent)],
    )
    triangles = sum(
        shape.geometry.num_tris
        for shape in visual.geometryObjects
        if isinstance(shape.geometry, coal.BVHModelBase)
    )
    drawn = sum(len(mesh.faces) for mesh in shown.shapes if mesh is not None)
    assert drawn == pytest.approx(triangles, rel=0.01)
    fixed = visual.geometryObjects[0]
    points = np.array(fixed.geometry.vertices())
    placed = points @ fixed.placement.rotation.T + fixed.placement.translation
    base = shown.shapes[0]
    assert base is not None
    if fixed.parentJoint == 0:
        assert base.vertices.min(axis=0) == pytest.approx(placed.min(axis=0), abs=1e-6)
        assert base.vertices.max(axis=0) == pytest.approx(placed.max(axis=0), abs=1e-6)


URDF = """<robot name="one">
  <link name="base"><visual><geometry><mesh filename="package://lost/base.stl"/></geometry></visual>
    {collision}</link>
  <joint name="turn" type="revolute"><parent link="base"/><child link="arm"/>
    <origin xyz="0 0 0.5"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
  <link name="arm"><visual><geometry><sphere radius="0.1"/></geometry></visual></link>
</robot>"""


@pytest.mark.parametrize(
    ("collision", "said", "height"),
    [
        ('<collision><geometry><box size="1 1 2"/></geometry></collision>', "collision", 1.0),
        ("", "as a line", 0.5),
    ],
)
def test_a_missing_mesh_is_a_warning(
    tmp_path: Path, collision: str, said: str, height: float
) -> None:
    path = tmp_path / "one.urdf"
    path.write_text(URDF.format(collision=collision), encoding="utf-8")
    shown = link_shapes(kw.load_robot(path).with_tool("arm"))
    (warning,) = shown.warnings
    assert "package://lost/base.stl" in warning
    assert said in warning
    assert shown.shapes[0] is not None
    assert shown.shapes[0].vertices[:, 2].max() == pytest.approx(height, abs=1e-6)


def test_a_broken_mesh_is_a_warning(tmp_path: Path) -> None:
    (tmp_path / "base.dae").write_text("<COLLADA><asset/></COLLADA>", encoding="utf-8")
    path = tmp_path / "one.urdf"
    text = URDF.format(collision="").replace("package://lost/base.stl", "base.dae")
    path.write_text(text, encoding="utf-8")
    assert "can't be read" in link_shapes(kw.load_robot(path).with_tool("arm")).warnings[0]


def test_meshes_are_found_as_ros_finds_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = tmp_path / "share" / "arm_description"
    (package / "meshes").mkdir(parents=True)
    (package / "urdf").mkdir()
    mesh = package / "meshes" / "a.stl"
    mesh.touch()
    name = "package://arm_description/meshes/a.stl"
    assert find_mesh(name, package / "urdf" / "arm.urdf") == mesh
    assert find_mesh("../meshes/a.stl", package / "urdf" / "arm.urdf") is not None
    elsewhere = tmp_path / "other" / "arm.urdf"
    assert find_mesh("package://lost/a.stl", elsewhere) is None
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "share"))
    assert find_mesh(name, Path("/nowhere/arm.urdf")) == mesh


@pytest.mark.parametrize("name", ["ur5_deburring", "kinova_dispense"])
def test_frames_are_samples_of_the_curve_and_its_end(name: str) -> None:
    plan = kw.plan(name)
    shown = frames(plan.trajectory.polynomial)
    assert np.diff(shown.time).max() <= 1 / LEAST_RATE
    assert shown.time[0] == plan.trajectory.start_time
    assert shown.time[-1] == plan.trajectory.end_time
    assert (shown.position == plan.trajectory.position(shown.time)).all()


def test_a_motion_too_long_for_a_page_is_refused() -> None:
    curve = PiecewisePolynomial(np.zeros((2, 1, 1)), np.array([0.0, 1e5]))
    with pytest.raises(InputError, match="can last 4000 s"):
        frames(curve)


@pytest.mark.parametrize("name", kw.robot_names())
def test_the_joint_tree_is_the_robot(name: str) -> None:
    """Chained by hand, it puts the last joint where Pinocchio's forward kinematics does."""
    robot = kw.load_robot(name)
    q = np.random.default_rng(1).uniform(-1, 1, robot.dof)
    places = [pin.SE3.Identity()]
    for joint, value in zip(joint_tree(robot), q, strict=True):
        own = pin.SE3(pin.Quaternion(np.array(joint["quaternion"])), np.array(joint["origin"]))
        axis = np.array(joint["axis"])
        moved = pin.SE3(np.eye(3), value * axis) if joint["slides"] else pin.SE3.Identity()
        if not joint["slides"]:
            moved = pin.SE3(pin.AngleAxis(value, axis).matrix(), np.zeros(3))
        places.append(places[joint["parent"]] * own * moved)
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, q)
    for place, true in zip(places[1:], list(data.oMi)[1:], strict=True):
        assert place.isApprox(true, 1e-9)


def test_the_path_is_broken_where_a_limit_is() -> None:
    plan = kw.plan(FAILING / "velocity_limit_broken.yaml")
    robot = plan.space.robot
    assert robot is not None
    path = tool_path(robot, robot_curve(plan.trajectory, robot), plan.space, plan.report)
    beyond = np.abs(plan.trajectory.velocity(path.time)) > plan.space.limits["velocity"]
    assert path.broken.any()
    assert not path.broken.all()
    assert (path.broken == beyond.any(axis=1)).all()
    (worst,) = [use for use in plan.report.limits if not use.ok]
    assert path.broken[path.time == worst.time].all()


def test_a_page_needs_nothing_else_and_escapes_what_it_is_given(tmp_path: Path) -> None:
    plan = kw.plan("planar2_closed_form")
    name = "</script><b onload=x>&"
    page = view_plan(replace(plan, scenario=replace(plan.scenario, name=name)))
    assert name not in page.html
    assert "&lt;/script&gt;&lt;b onload=x&gt;&amp;" in page.html
    assert not re.search(r"""(?:src|href)\s*=\s*["']?(?:https?:)?//""", page.html)
    saved = page.save(tmp_path / "scene.html")
    assert saved.read_text(encoding="utf-8") == page.html
    inline = page._repr_html_()
    assert inline.startswith("<iframe")
    assert inline.count("<") == 2
    text = json_in_html({"a": name, "b": "\u2028"})
    assert "<" not in text
    assert json.loads(text) == {"a": name, "b": "\u2028"}


def test_a_page_is_not_written_over_a_folder(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="it is a folder"):
        Page("a", "b").save(tmp_path)
    with pytest.raises(InputError, match="can't write"):
        Page("a", "b").save(Path("/proc/nowhere/a.html"))


def test_without_a_robot_there_is_nothing_to_show() -> None:
    with pytest.raises(InputError, match="only plots can be drawn"):
        kw.plan("paper_case").view()


def test_a_trajectory_of_other_joints_is_refused() -> None:
    trajectory = kw.plan("ur5_deburring").trajectory
    with pytest.raises(InputError, match=r"those of robot 'panda' are panda_joint1"):
        robot_curve(trajectory, kw.load_robot("panda"))


def test_numbers_on_the_page_are_those_of_the_trajectory() -> None:
    plan = kw.plan("planar2_closed_form")
    page = plan.view()
    found = re.search(r'<script id="data" type="application/json">(.*?)</script>', page.html)
    assert found is not None
    arm = json.loads(found[1])["arms"][0]
    time = np.frombuffer(base64.b64decode(arm["time"]), "<f4")
    position = np.frombuffer(base64.b64decode(arm["position"]), "<f4").reshape(len(time), -1)
    true = plan.trajectory.sample(120)
    assert position == pytest.approx(true.position, abs=1e-6)
    assert time == pytest.approx(true.time, abs=1e-6)
