"""What is wrong with a scene is said with its line, what was found and what would be accepted."""

from __future__ import annotations

from pathlib import Path

import pytest
import trimesh

from command_line import Command

TASK = """\
units: {{length: mm, angle: deg}}
robot: ur5
scene: {{objects: {{{objects}}}}}
start: home
waypoints:
  - {{name: here, after: 2, pose: {{position: [450, 0, 300], rpy: [180, 0, 0]}}}}
"""


def half(mesh: trimesh.Trimesh) -> str:
    """A text STL that ends after the first half of its facets."""
    text = str(mesh.export(file_type="stl_ascii"))
    facets = text.split("endfacet\n")
    return "endfacet\n".join([*facets[: len(mesh.faces) // 2], ""])


def run(knotwork: Command, folder: Path, objects: str) -> str:
    """What `plan` says of a task that can't be planned."""
    path = folder / "task.yaml"
    path.write_text(TASK.format(objects=objects))
    ran = knotwork("plan", path)
    assert ran.code == 2, ran.out + ran.err
    return " ".join(ran.err.split())


@pytest.mark.parametrize(
    ("part", "says"),
    [
        ("mesh: empty.stl", "line 3: scene.objects.part.mesh: mesh"),
        ("mesh: half.stl", "half.stl can't be read: it is not read whole: its lines 'solid'"),
        ("mesh: open.stl, exact: true", "is not watertight"),
        ("mesh: small.stl", "plausibly in another unit; a scale 1000 times as large makes it"),
        ("mesh: large.stl", "plausibly in another unit; a scale 0.001 times as large makes it"),
    ],
)
def test_a_mesh_that_is_no_solid_or_of_another_unit_is_refused(
    part: str, says: str, knotwork: Command, tmp_path: Path
) -> None:
    (tmp_path / "empty.stl").write_text("solid nothing\nendsolid nothing\n")
    box = trimesh.creation.box((100, 100, 100))
    trimesh.Trimesh(box.vertices, box.faces[:-1]).export(tmp_path / "open.stl")
    (tmp_path / "half.stl").write_text(half(box))
    box.copy().apply_scale(1e-3).export(tmp_path / "small.stl")
    box.copy().apply_scale(1e3).export(tmp_path / "large.stl")
    assert says in run(knotwork, tmp_path, f"part: {{{part}}}")


def test_a_broken_srdf_is_named(knotwork: Command, tmp_path: Path) -> None:
    (tmp_path / "arm.srdf").write_text("<robot>")
    robot = "example-robot-data:ur_description/urdf/ur5_robot.urdf"
    (tmp_path / "arm.yaml").write_text(
        f"urdf: {robot}\ntool_frame: tool0\ncollision: {{srdf: arm.srdf}}\n"
    )
    (tmp_path / "task.yaml").write_text(
        "robot: arm.yaml\nstart: {shoulder_pan_joint: 0, shoulder_lift_joint: -1, elbow_joint: 1,"
        " wrist_1_joint: 0, wrist_2_joint: 1, wrist_3_joint: 0}\nwaypoints:\n"
        "- {pose: {position: [0.4, 0.1, 0.4], rpy: [0, 0, 0]}, after: 3}\n"
    )
    ran = knotwork("plan", tmp_path / "task.yaml")
    assert ran.code == 2
    assert "arm.srdf is not an SRDF: it is not XML" in ran.err
    pair = '<disable_collisions link1="{}" link2="{}" reason="Never"/>'
    pairs = pair.format("base_link", "forearm_link") + pair.format("base_link", "elbow_link")
    (tmp_path / "arm.srdf").write_text(f"<robot>{pairs}</robot>")
    ran = knotwork("plan", tmp_path / "task.yaml", "--full")
    assert "not checked, as the SRDF disables it (never): base_link and forearm_link" in ran.out
    (tmp_path / "arm.yaml").write_text(
        f"urdf: {robot}\ntool_frame: tool0\ncollision: {{ignore: [[forearm_link, hand]]}}\n"
    )
    ran = knotwork("plan", tmp_path / "task.yaml")
    assert ran.code == 2
    assert "collision.ignore[0]" in ran.err
    assert "hand" in ran.err


URDF = """<robot name="door">
<link name="post"><collision><geometry>{shape}</geometry></collision></link>
<link name="leaf"><visual><geometry><box size="1 1 1"/></geometry></visual></link>
<joint name="hinge" type="revolute"><parent link="post"/><child link="leaf"/>
<origin xyz="0 0 1"/><axis xyz="0 0 1"/><limit lower="-2" upper="2" velocity="2" effort="9"/>
</joint></robot>"""


def test_a_mesh_of_a_link_that_is_cut_in_half_is_an_error(
    knotwork: Command, tmp_path: Path
) -> None:
    """One that is not there may be on another computer: that is a warning."""
    task = tmp_path / "task.yaml"
    task.write_text(
        "robot: {urdf: door.urdf, tool_frame: leaf}\nwaypoints:\n- joints: {hinge: 0}\n"
        "- {joints: {hinge: 1}, after: 2}\n"
    )
    urdf, mesh = tmp_path / "door.urdf", tmp_path / "wall.stl"
    urdf.write_text(URDF.format(shape='<mesh filename="wall.stl"/>'))
    box = trimesh.creation.box((1, 1, 1))
    ran = knotwork("plan", task)
    assert ran.code == 0, ran.err
    assert "no mesh 'wall.stl'" in " ".join(ran.out.split())
    mesh.write_text(half(box))
    ran = knotwork("plan", task)
    assert ran.code == 2, ran.out + ran.err
    said = " ".join(ran.err.split())
    assert "door.urdf: collision shape of link 'post': mesh" in said
    assert "wall.stl can't be read: it is not read whole: its lines 'solid'" in said
    mesh.write_text(str(box.export(file_type="stl_ascii")))
    assert knotwork("plan", task).code == 0


@pytest.mark.parametrize("count", [0, 2])
def test_a_collision_element_without_its_one_shape_is_said(
    knotwork: Command, tmp_path: Path, count: int
) -> None:
    box = '<box size="1 1 1"/>'
    (tmp_path / "door.urdf").write_text(URDF.format(shape=count * box))
    (tmp_path / "task.yaml").write_text(
        "robot: {urdf: door.urdf, tool_frame: leaf}\nwaypoints:\n- joints: {hinge: 0}\n"
        "- {joints: {hinge: 1}, after: 2}\n"
    )
    said = " ".join(knotwork("plan", tmp_path / "task.yaml").out.split())
    assert f"link 'post': <collision> has 1 <geometry> with {count} shapes in all" in said
