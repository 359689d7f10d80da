"""What scenes are made of, without a browser: meshes, frames, pages."""

from __future__ import annotations

import base64
import io
import json
import re
from dataclasses import replace
from pathlib import Path

import coal
import numpy as np
import pinocchio as pin
import pytest
from PIL import Image

import knotwork as kw
from knotwork.errors import InputError
from knotwork.meshes.finding import find_mesh
from knotwork.polynomial import PiecewisePolynomial
from knotwork.view import images
from knotwork.view.animation import LEAST_RATE, frames, joint_tree
from knotwork.view.links import link_shapes
from knotwork.view.mesh import Mesh
from knotwork.view.page import Page, json_in_html
from knotwork.view.path import tool_path
from knotwork.view.show import view_plan, view_trajectory
from knotwork.view.solids import box, capsule, cylinder, frame_along, sphere
from knotwork.view.speed_arrows import round_arrows
from knotwork.view.targets import Target, targets

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
    path = tool_path(
        robot, plan.trajectory.reordered(robot.joint_names).polynomial, plan.space, plan.report
    )
    beyond = np.abs(plan.trajectory.velocity(path.time)) > plan.space.limits["velocity"]
    assert path.broken.any()
    assert not path.broken.all()
    assert (path.broken == beyond.any(axis=1)).all()
    (worst,) = plan.report.failures
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


def test_a_page_makes_its_folder_and_is_never_one(tmp_path: Path) -> None:
    path = Page("a", "b").save(tmp_path / "new" / "er" / "a.html")
    assert path.read_text(encoding="utf-8") == "b"
    (tmp_path / "folder.html").mkdir()
    for name, says in (
        ("folder.html", "it is a folder"),
        ("new/er/a.html/b.html", "is no folder"),
        ("a", r"it has no suffix; give \.html, \.htm"),
        ("a.pdf", r"the suffix is '\.pdf'; give \.html"),
    ):
        with pytest.raises(InputError, match=says):
            Page("a", "b").save(tmp_path / name)
    with pytest.raises(InputError, match="it is a folder"):
        Page("a", "b").save(tmp_path)
    with pytest.raises(InputError, match="can't write"):
        Page("a", "b").save(Path("/proc/nowhere/a.html"))


def test_without_a_robot_there_is_nothing_to_show() -> None:
    with pytest.raises(InputError, match="only plots can be drawn"):
        kw.plan("paper_case").view()


def test_a_trajectory_of_other_joints_is_refused() -> None:
    trajectory = kw.plan("ur5_deburring").trajectory
    with pytest.raises(InputError, match=r"the joints of robot 'panda' are panda_joint1"):
        view_trajectory(kw.load_robot("panda"), trajectory)


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


def test_a_stored_trajectory_leaves_the_tool_unsaid() -> None:
    trajectory = kw.plan("planar2_closed_form").trajectory
    robot = kw.load_robot("planar2")
    (warning,) = view_trajectory(robot, trajectory).warnings
    assert "does not say which tool" in warning
    assert f"frame {robot.tool_frame!r}" in warning
    offset = pin.SE3(np.eye(3), np.array([0, 0, 0.1]))
    assert not view_trajectory(robot.with_tool(robot.tool_frame, offset), trajectory).warnings


def test_a_turn_asked_for_goes_as_far_as_the_tool_turns() -> None:
    """The arrow's points: on a circle about the axis, right-handed, up to the angle."""
    turn = np.array([0.0, 0.3, 0.4])
    pose = pin.SE3(np.eye(3), np.array([1.0, 2.0, 3.0]))
    still = Target("b", 1.0, pose, np.zeros(3), np.zeros(3))
    arrows = round_arrows([Target("a", 0.0, pose, np.zeros(3), turn), still], radius=0.1)
    assert arrows is not None
    assert arrows.seconds == 10.0  # 5 rad; in 20 s it would be more than a round
    axes = frame_along(turn / 0.5)
    local = (arrows.mesh.vertices - pose.translation) @ axes
    assert np.linalg.norm(local[:, :2], axis=1) == pytest.approx(0.1, abs=0.03)
    assert np.abs(local[:, 2]).max() < 0.03
    angle = np.arctan2(local[:, 1], local[:, 0]) % (2 * np.pi)
    angle = angle[angle < 2 * np.pi - 0.3]  # the foot is as thick as the rod
    assert angle.max() == pytest.approx(5.0, abs=0.1)
    assert round_arrows([still], radius=0.1) is None


def test_targets_turn_with_the_robots_base() -> None:
    plan = kw.plan("kinova_dispense")
    robot = plan.space.robot
    assert robot is not None
    for target, waypoint in zip(
        targets(plan.scenario, plan.space, robot), plan.scenario.waypoints, strict=True
    ):
        twist = robot.twist(
            plan.trajectory.position(target.time), plan.trajectory.velocity(target.time)
        )
        turn = robot.base_placement.rotation
        assert target.name == waypoint.name
        assert target.angular == pytest.approx(turn @ twist.angular, abs=1e-6)
        assert target.linear == pytest.approx(turn @ twist.linear, abs=1e-6)


@pytest.mark.parametrize("name", ["ur5", "panda"])
def test_colours_are_those_of_the_meshes_materials(name: str) -> None:
    robot = kw.load_robot(name)
    names = re.findall(r'<mesh filename="([^"]*\.dae)"', robot.urdf.read_text(encoding="utf-8"))
    given = set()
    for mesh in names:
        path = find_mesh(mesh, robot.urdf)
        assert path is not None
        text = path.read_text(encoding="utf-8")
        for numbers in re.findall(r"<diffuse>\s*<color[^>]*>([^<]*)<", text):
            given.add(tuple(float(number) for number in numbers.split()[:3]))
    shown = link_shapes(robot)
    assert not shown.warnings
    drawn = {tuple(row) for mesh in shown.shapes if mesh for row in np.unique(mesh.colours, axis=0)}
    assert drawn <= given
    assert len(drawn) > 2


def test_a_mesh_without_colours_is_said(tmp_path: Path) -> None:
    corners = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]], dtype="<f4")
    record = np.zeros(1, [("n", "<f4", 3), ("c", "<f4", (3, 3)), ("a", "<u2")])
    record["c"] = corners
    (tmp_path / "base.stl").write_bytes(bytes(80) + (1).to_bytes(4, "little") + record.tobytes())
    path = tmp_path / "one.urdf"
    text = URDF.format(collision="").replace("package://lost/base.stl", "base.stl")
    path.write_text(text, encoding="utf-8")
    (warning,) = link_shapes(kw.load_robot(path).with_tool("arm")).warnings
    assert warning == "no colour is given for parts of base; they are drawn grey"
    red = text.replace("</geometry>", '</geometry><material name="r"><color rgba="1 0 0 1"/>', 1)
    path.write_text(red.replace('1"/></visual>', '1"/></material></visual>', 1), encoding="utf-8")
    shown = link_shapes(kw.load_robot(path).with_tool("arm"))
    assert not shown.warnings
    assert shown.shapes[0] is not None
    assert (shown.shapes[0].colours == [1, 0, 0]).all()


def test_images_on_meshes_are_part_of_the_page(textured_robot: kw.Robot, tmp_path: Path) -> None:
    trajectory = kw.JointTrajectory.from_knots(["turn"], [0, 1], [[0], [0.5]], [[0], [0]])
    shown = link_shapes(textured_robot)
    assert not shown.warnings
    (skin,) = shown.shapes[0].skins if shown.shapes[0] is not None else ()
    assert (skin.start, skin.count, skin.image.name) == (0, 12, "two colours.png")
    page = view_trajectory(textured_robot, trajectory)
    assert "data:image/jpeg;base64," in page.html
    # a picture that is none is a warning, and one that is missing leaves the mesh without colour
    skin.image.write_bytes(b"no picture")
    assert any(
        "can't be read" in said for said in view_trajectory(textured_robot, trajectory).warnings
    )
    skin.image.unlink()
    assert link_shapes(textured_robot).warnings == (
        "no colour is given for parts of base; they are drawn grey",
    )


def test_images_are_made_small_enough_together(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    noise = np.random.default_rng(0).integers(0, 256, (300, 600, 3), dtype=np.uint8)
    Image.fromarray(noise).save(tmp_path / "noise.bmp")

    def widths(most: int) -> set[tuple[int, int]]:
        monkeypatch.setattr(images, "MOST_BYTES", most)
        addresses, warnings = images.image_addresses([tmp_path / "noise.bmp"] * 3)
        assert not warnings
        assert sum(len(address or "") for address in addresses) <= most
        data = (base64.b64decode((address or "").partition(",")[2]) for address in addresses)
        return {Image.open(io.BytesIO(one)).size for one in data}

    assert widths(images.MOST_BYTES) == {(600, 300)}
    assert widths(200_000) == {(256, 128)}
