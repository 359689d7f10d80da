"""Which pairs of bodies are checked, and what is wrong with a scene."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import trimesh

import knotwork as kw
import urdfs
from command_line import Command
from knotwork.verification import Finding
from texts import written
from urdfs import collision, limits, link, visual

Vector = tuple[float, float, float]
NOWHERE: Vector = (0.0, 0.0, 0.0)


def box(name: str, size: Vector, at: Vector = NOWHERE) -> str:
    """A link that is a box."""
    return link(name, collision(f'<box size="{spaced(size)}"/>', spaced(at)))


def spaced(values: Vector) -> str:
    return " ".join(map(str, values))


def joint(name: str, parent: str, child: str, at: Vector = NOWHERE, *, moves: bool = True) -> str:
    """A joint that is fixed, or one that turns about z."""
    kind, more = ("revolute", limits(-3.1, 3.1, velocity=3, effort=9)) if moves else ("fixed", "")
    return urdfs.joint(name, parent, child, kind, at=spaced(at), more=more)


PEDESTAL = box("base", (0.1, 0.1, 0.05), (0, 0, -0.05))
UPPER = box("upper", (0.4, 0.04, 0.04), (0.2, 0, 0))
FOREARM = box("forearm", (0.3, 0.04, 0.04), (0.15, 0, 0))
ELBOW = joint("elbow", "upper", "forearm", (0.4, 0, 0.1))


def robot(folder: Path, parts: list[str], **more: Any) -> str:
    """Write a URDF and a robot file."""
    written(folder / "arm.urdf", urdfs.robot(*parts))
    return str(written(folder / "arm.yaml", {"urdf": "arm.urdf", **more}))


def turn(arm: str, start: list[float], end: list[float], **more: Any) -> kw.Report:
    """The report on a motion from joint values to others."""
    names = kw.load_robot(arm).joint_names
    first, last = (dict(zip(names, q, strict=True)) for q in (start, end))
    waypoints = [{"joints": first}, {"joints": last, "after": 4}]
    return kw.plan({"robot": arm, "waypoints": waypoints, **more}).report


def clearances(report: kw.Report) -> dict[str, Finding]:
    return {finding.name: finding for finding in report.findings if finding.quantity == "clearance"}


def message(report: kw.Report, quantity: str) -> str:
    return " | ".join(finding.message for finding in report.select(quantity=quantity))


def post(at: Vector) -> list[str]:
    """A post that a fixed joint holds on the base, by way of a plate."""
    return [
        link("plate"),
        box("post", (0.04, 0.04, 0.4)),
        joint("foot", "base", "plate", at, moves=False),
        joint("stand", "plate", "post", moves=False),
    ]


def test_touching_links_are_checked_where_one_moves_deeper(tmp_path: Path) -> None:
    """A disc that is always 1 mm in a post, and beside it a fin that is swept 39 mm into it."""
    disc = collision('<cylinder radius="0.3" length="0.04"/>')
    fin = collision('<box size="0.2 0.04 0.04"/>', "0.4 0 0.1")
    swept = [link("upper", disc, fin), joint("shoulder", "base", "upper")]
    parts = [PEDESTAL, *swept, *post((0.319, 0, 0))]
    report = turn(robot(tmp_path, parts, tool_frame="upper"), [0.8], [-0.8])
    failed = {name for name, one in clearances(report).items() if not one.ok}
    assert {frozenset(name.split(", ")) for name in failed} == {frozenset(("upper", "post"))}


FINGER = box("tool", (0.05, 0.04, 0.04))
HAND = [FINGER, joint("wrist", "forearm", "tool", (0.3, 0, 0), moves=False)]
ARM = [PEDESTAL, UPPER, FOREARM, joint("shoulder", "base", "upper"), ELBOW]
POINTER = {"shape": {"box": [0.02, 0.02, 0.3]}}


@pytest.mark.parametrize("key", ["ignore", "allow"])
def test_a_name_of_a_link_and_of_the_tool_has_to_say_which(key: str, tmp_path: Path) -> None:
    arm = robot(tmp_path, [*ARM, *HAND], tool_frame="tool")

    def task(name: str) -> dict[str, Any]:
        ball = {"sphere": 0.05, "position": [0.1, 0, 0.1]}
        if key == "ignore":
            return {"tool": POINTER, "collisions": {"ignore": [[name, "upper"]]}}
        return {"tool": POINTER, "scene": {"objects": {"ball": {**ball, "allow": [name]}}}}

    with pytest.raises(kw.KnotworkError) as fault:
        turn(arm, [0, 1.5], [0, 3.1], **task("tool"))
    message = str(fault.value)
    assert "'tool'" in message
    assert "'link:tool' or 'scenario:tool'" in message
    assert ("collisions.ignore[0]" if key == "ignore" else "scene.objects.ball.allow") in message
    other = "upper" if key == "ignore" else "ball"
    for name, gone, left in (
        ("scenario:tool", "tool", "link:tool"),
        ("link:tool", "link:tool", "tool"),
    ):
        checked = clearances(turn(arm, [0, 1.5], [0, 3.1], **task(name)))
        assert f"{gone}, {other}" not in checked
        assert f"{left}, {other}" in checked


def test_a_tool_that_is_in_a_link_at_home_but_not_everywhere_is_checked(tmp_path: Path) -> None:
    home = {"home": {"shoulder": 0.0, "elbow": 3.1}}
    flange = [link("tip"), joint("wrist", "forearm", "tip", (0.3, 0, 0), moves=False)]
    arm = robot(tmp_path, [*ARM, *flange], tool_frame="tip", configurations=home)
    report = turn(arm, [0, 1.5], [0, 3.1], tool=POINTER)
    assert not clearances(report)["tool, upper"].ok


def test_a_robot_that_is_not_checked_against_itself_is_named(tmp_path: Path) -> None:
    arm = robot(tmp_path, ARM, tool_frame="forearm")
    ball = {"ball": {"sphere": 0.05, "position": [0, 0, 2]}}
    report = turn(arm, [0, 0.5], [0, 1], scene={"objects": ball}, collisions={"self": False})
    assert "forearm, base" not in clearances(report)
    assert "`self: false`: base and upper; base and forearm" in message(report, "pairs_not_checked")


def test_an_object_of_any_name_has_a_row_of_its_own(tmp_path: Path) -> None:
    arm = robot(tmp_path, ARM, tool_frame="forearm")
    ball = {"itself": {"sphere": 0.05, "position": [0, 0, 2]}}
    report = turn(arm, [0, 0.5], [0, 1], scene={"objects": ball})
    shown = [name for name, one in clearances(report).items() if not one.hidden_in_tables]
    assert "forearm, base" in shown
    assert [name for name in shown if name.endswith(", itself")]


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
    path = written(folder / "task.yaml", TASK.format(objects=objects))
    return knotwork("plan", path).refused()


@pytest.mark.parametrize(
    ("part", "says"),
    [
        ("mesh: empty.stl", "line 3: scene.objects.part.mesh: mesh"),
        ("mesh: half.stl", "half.stl can't be read: it is not read whole: its lines 'solid'"),
        ("mesh: open.stl, exact: true", "is not watertight"),
        ("mesh: small.stl", "probably in another unit; a scale 1000 times as large makes it"),
        ("mesh: large.stl", "probably in another unit; a scale 0.001 times as large makes it"),
    ],
)
def test_refuses_meshes_that_are_no_solid_or_in_another_unit(
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
    err = knotwork("plan", tmp_path / "task.yaml").refused()
    assert "arm.srdf is not an SRDF: it is not XML" in err
    pair = '<disable_collisions link1="{}" link2="{}" reason="Never"/>'
    pairs = pair.format("base_link", "forearm_link") + pair.format("base_link", "elbow_link")
    (tmp_path / "arm.srdf").write_text(f"<robot>{pairs}</robot>")
    ran = knotwork("plan", tmp_path / "task.yaml", "--full")
    assert "not checked, since the SRDF disables it (never): base_link and forearm_link" in ran.out
    (tmp_path / "arm.yaml").write_text(
        f"urdf: {robot}\ntool_frame: tool0\ncollision: {{ignore: [[forearm_link, hand]]}}\n"
    )
    err = knotwork("plan", tmp_path / "task.yaml").refused()
    assert "collision.ignore[0]" in err
    assert "hand" in err


RANGE = limits(-2, 2, velocity=2, effort=9)


def open_door(folder: Path, shape: str) -> Path:
    """A task that opens a door whose post collides with a shape."""
    urdf = urdfs.robot(
        link("post", f"<collision><geometry>{shape}</geometry></collision>"),
        link("leaf", visual('<box size="1 1 1"/>')),
        urdfs.joint("hinge", "post", "leaf", at="0 0 1", more=RANGE),
    )
    (folder / "door.urdf").write_text(urdf)
    (folder / "task.yaml").write_text(
        "robot: {urdf: door.urdf, tool_frame: leaf}\nwaypoints:\n- joints: {hinge: 0}\n"
        "- {joints: {hinge: 1}, after: 2}\n"
    )
    return folder / "task.yaml"


def test_refuses_truncated_mesh_of_link(knotwork: Command, tmp_path: Path) -> None:
    """One that is not there may be on another computer: that is a warning."""
    task, mesh = open_door(tmp_path, '<mesh filename="wall.stl"/>'), tmp_path / "wall.stl"
    box = trimesh.creation.box((1, 1, 1))
    assert "no mesh 'wall.stl'" in " ".join(knotwork("plan", task).done().split())
    mesh.write_text(half(box))
    output = knotwork("plan", task).refused()
    assert "door.urdf: collision shape of link 'post': mesh" in output
    assert "wall.stl can't be read: it is not read whole: its lines 'solid'" in output
    mesh.write_text(str(box.export(file_type="stl_ascii")))
    assert knotwork("plan", task).code == 0


@pytest.mark.parametrize("count", [0, 2])
def test_reports_number_of_collision_shapes(knotwork: Command, tmp_path: Path, count: int) -> None:
    task = open_door(tmp_path, count * '<box size="1 1 1"/>')
    output = " ".join(knotwork("plan", task).out.split())
    assert f"link 'post': <collision> has 1 <geometry> with {count} shapes in all" in output
