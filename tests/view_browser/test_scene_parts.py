"""What scenes are made of, as it stands on their pages, without a browser."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import coal
import numpy as np
import pinocchio as pin
import pytest

import knotwork as kw
from drawn import at_rest, faces, numbers, placed, scene, shape_warnings, thing, vertices
from knotwork.errors import InputError
from knotwork.view import view_trajectory
from plans import planned
from sweeps import mostly_exhaustive
from urdfs import joint, link, robot, visual

LEAST_RATE = 60.0  # frames a second


@pytest.mark.parametrize(
    ("shape", "volume", "area"),
    [
        ('<box size="1 2 3"/>', 6.0, 22.0),
        ('<cylinder radius="1" length="2"/>', 2 * np.pi, 6 * np.pi),
        ('<sphere radius="1"/>', 4 / 3 * np.pi, 4 * np.pi),
        ('<capsule radius="1" length="2"/>', (2 + 4 / 3) * np.pi, 8 * np.pi),
    ],
)
def test_shapes_face_outwards(tmp_path: Path, shape: str, volume: float, area: float) -> None:
    path = tmp_path / "one.urdf"
    base = link("base", visual(shape))
    path.write_text(robot(base, link("arm"), joint("turn", "base", "arm")), encoding="utf-8")
    (mesh,) = scene(at_rest(kw.load_robot(path).with_tool("arm")))["shapes"][0]
    a, b, c = np.moveaxis(vertices(mesh)[faces(mesh)], 1, 0)
    outwards = np.cross(b - a, c - a)
    found = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6, np.linalg.norm(outwards, axis=1)
    assert (found[0], found[1].sum() / 2) == pytest.approx((volume, area), rel=0.03)
    normals = numbers(mesh["normals"], "i1")[faces(mesh)].mean(axis=1)
    assert (np.einsum("ij,ij->i", outwards, normals) > 0).all()


@pytest.mark.parametrize("name", mostly_exhaustive(["ur5", "kinova", "xarm7"], "kinova"))
def test_meshes_are_those_that_pinocchio_reads(name: str) -> None:
    """The outline of the whole arm, from Pinocchio's own geometry model and mesh reader."""
    robot = kw.load_robot(name)
    shown = scene(at_rest(robot))["shapes"]
    assert not shape_warnings(robot)
    text = robot.urdf.read_text(encoding="utf-8").replace('type="continuous"', 'type="fixed"')
    data = next(folder for folder in robot.urdf.parents if folder.name == "example-robot-data")
    visual = pin.buildGeomFromUrdfString(
        pin.buildModelFromXML(text), text, pin.VISUAL, package_dirs=[str(data.parent)]
    )
    triangles = sum(
        shape.geometry.num_tris
        for shape in visual.geometryObjects
        if isinstance(shape.geometry, coal.BVHModelBase)
    )
    drawn = sum(len(faces(mesh)) for parts in shown for mesh in parts)
    assert drawn == pytest.approx(triangles, rel=0.01)
    fixed = visual.geometryObjects[0]
    points = np.array(fixed.geometry.vertices())
    placed = points @ fixed.placement.rotation.T + fixed.placement.translation
    base = np.concatenate([vertices(mesh) for mesh in shown[0]])
    if fixed.parentJoint == 0:
        assert base.min(axis=0) == pytest.approx(placed.min(axis=0), abs=1e-6)
        assert base.max(axis=0) == pytest.approx(placed.max(axis=0), abs=1e-6)


def test_without_a_robot_there_is_nothing_to_show() -> None:
    with pytest.raises(InputError, match="or draw plots of its joints"):
        kw.plan("paper_case").view()


def test_a_trajectory_of_other_joints_is_refused() -> None:
    trajectory = kw.plan("ur5_deburring").trajectory
    with pytest.raises(InputError, match=r"the joints of robot 'panda' are panda_joint1"):
        view_trajectory(kw.load_robot("panda"), trajectory)


def test_a_long_motion_has_fewer_frames_a_second() -> None:
    still = np.zeros((2, 2))
    robot = kw.load_robot("planar2")
    motion = kw.JointTrajectory.from_knots(robot.joint_names, [0, 1e5], still, still)
    time = numbers(scene(view_trajectory(robot, motion))["arm"]["time"], "<f4", 1)
    assert len(time) < 250_000
    assert time[-1] == 1e5


@pytest.mark.parametrize("name", mostly_exhaustive(kw.robot_names(), "planar2", "panda"))
def test_the_joints_on_a_page_are_the_robot_s(name: str) -> None:
    """Chained by hand, they put the last joint where Pinocchio's forward kinematics does."""
    robot = kw.load_robot(name)
    q = np.random.default_rng(1).uniform(-1, 1, robot.dof)
    places = placed(scene(at_rest(robot)), q)
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, q)
    for place, true in zip(places[1:], list(data.oMi)[1:], strict=True):
        assert place.isApprox(true, 1e-9)


def test_a_page_needs_nothing_else_and_escapes_what_it_is_given(tmp_path: Path) -> None:
    plan = planned("planar2_closed_form")
    name = "</script><b onload=x>&"
    page = replace(plan, scenario=replace(plan.scenario, name=name)).view()
    assert name not in page.html
    assert "&lt;/script&gt;&lt;b onload=x&gt;&amp;" in page.html
    assert not re.search(r"""(?:src|href)\s*=\s*["']?(?:https?:)?//""", page.html)
    saved = page.save(tmp_path / "scene.html")
    assert saved.read_text(encoding="utf-8") == page.html
    inline = page._repr_html_()
    assert inline.startswith("<iframe")
    assert inline.count("<") == 2
    name = "</script>\u2028"
    assert scene(replace(plan, scenario=replace(plan.scenario, name=name)).view())["title"] == name


@pytest.mark.parametrize("name", ["planar2_closed_form", "kinova_dispense"])
def test_frames_are_samples_of_the_curve_and_its_end(name: str) -> None:
    plan = kw.plan(name)
    arm = scene(plan.view())["arm"]
    time = numbers(arm["time"], "<f4", 1)[:, 0] + arm["start"]
    position = numbers(arm["position"], "<f4", len(plan.trajectory.joint_names))
    true = plan.trajectory.sample(120)
    assert position == pytest.approx(true.position, abs=1e-6)
    assert time == pytest.approx(true.time, abs=1e-6)
    assert np.diff(time).max() <= 1 / LEAST_RATE
    assert true.time[[0, -1]].tolist() == [plan.trajectory.start_time, plan.trajectory.end_time]


def test_a_stored_trajectory_does_not_name_its_tool() -> None:
    trajectory = planned("planar2_closed_form").trajectory
    robot = kw.load_robot("planar2")
    (warning,) = view_trajectory(robot, trajectory).warnings
    assert "does not name its tool" in warning
    assert f"frame {robot.tool_frame!r}" in warning
    offset = pin.SE3(np.eye(3), np.array([0, 0, 0.1]))
    assert not view_trajectory(robot.with_tool(robot.tool_frame, offset), trajectory).warnings


def test_arrows_are_as_long_as_the_tool_goes_and_turn_with_the_robots_base() -> None:
    plan = planned("kinova_dispense")
    robot = plan.joints.robot
    data = scene(plan.view())
    seconds = data["legend"]["arrow_seconds"]
    arrows = vertices(thing(data, "given speeds"))
    turn = robot.base_placement.rotation
    found = 0
    for waypoint in plan.scenario.waypoints:
        q, v = plan.trajectory.position(waypoint.time), plan.trajectory.velocity(waypoint.time)
        twist = robot.twist(q, v)
        foot = (robot.base_placement * robot.forward(q)).translation
        if np.linalg.norm(twist.linear) > 1e-6:
            tip = foot + seconds * turn @ twist.linear
            # beside the path, so that its colours are seen: across the speed, all of one length
            beside = arrows - tip
            across = np.abs(beside @ turn @ twist.linear) < 1e-6
            far = np.linalg.norm(beside[across], axis=1) / data["size"]
            assert np.abs(far - 0.014).min() < 1e-4
            found += 1
    per_arrow = len(arrows) / found
    assert found > 1
    assert per_arrow == round(per_arrow)  # and none else


def test_a_frame_and_an_object_of_one_name_have_one_label() -> None:
    labels = scene(planned("ur3_lid").view())["labels"]
    (jar,) = (one for one in labels if one["text"] == "jar")
    assert jar["detail"] == "frame and object 'jar'"
