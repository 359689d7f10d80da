"""A URDF's meshes come from its own package or folder and the folders that the user names."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

import knotwork as kw
from command_line import Command
from knotwork.errors import InputError
from knotwork.meshes.finding import find_mesh
from knotwork.robot.shapes import UrdfShapes

STL = "solid a\nfacet normal 0 0 1\nouter loop\n{}endloop\nendfacet\nendsolid a\n".format(
    "vertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
)
URDF = (
    '<robot name="r"><link name="a"><{kind}><geometry><mesh filename="{mesh}"/></geometry>'
    '</{kind}></link><link name="b"/><joint name="j" type="revolute"><parent link="a"/>'
    '<child link="b"/><axis xyz="0 0 1"/>'
    '<limit lower="-1" upper="1" velocity="1" effort="1"/></joint></robot>'
)
OUTSIDE = {
    "{}/secret/s.stl": "leads to",
    "file://{}/secret/s.stl": "leads to",
    "../../secret/s.stl": "leads to",
    "../../secret/none.stl": "leads to",
    "package://arm/../secret/s.stl": "leads to",
    "package://arm/urdf/../../secret/s.stl": "leads to",
    "package://../../secret/s.stl": "leads to",
    "package://../secret/s.stl": "there is no mesh",
    "package://secret/s.stl": "there is no mesh",
    "model://secret/s.stl": "there is no mesh",
    "../meshes/link.stl": "leads to",
    "../meshes/folder/s.stl": "leads to",
    "package://arm/meshes/link.stl": "leads to",
}
INSIDE = (
    "beside.stl",
    "./beside.stl",
    "../meshes/m.stl",
    "../../arm/meshes/m.stl",
    "{}/arm/meshes/m.stl",
    "file://{}/arm/meshes/m.stl",
    "package://arm/meshes/m.stl",
    "package://meshes/m.stl",
    "../meshes/inner.stl",
)


@pytest.fixture
def urdf(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A package `arm`, and beside it a folder `secret`."""
    for name in ("ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH"):
        monkeypatch.delenv(name, raising=False)
    for name in ("arm/urdf/beside.stl", "arm/meshes/m.stl", "secret/s.stl", "arm/package.xml"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(STL, encoding="utf-8")
    (tmp_path / "arm/meshes/link.stl").symlink_to(tmp_path / "secret/s.stl")
    (tmp_path / "arm/meshes/folder").symlink_to(tmp_path / "secret")
    (tmp_path / "arm/meshes/inner.stl").symlink_to("m.stl")
    return tmp_path / "arm" / "urdf" / "arm.urdf"


@pytest.mark.parametrize("name", OUTSIDE)
def test_a_mesh_outside_is_not_taken_unless_the_user_names_its_folder(
    name: str, urdf: Path, tmp_path: Path
) -> None:
    address = name.format(tmp_path)
    with pytest.raises(InputError) as caught:
        find_mesh(address, urdf)
    said = str(caught.value)
    assert OUTSIDE[name] in said
    assert f"below {tmp_path / 'arm'} (" in said
    assert "package_paths" in said
    assert "--package-path" in said
    if OUTSIDE[name] == "leads to":
        assert f"leads to {tmp_path / 'secret'}{os.sep}" in said
    if "none" not in name:
        found = find_mesh(address, urdf, [tmp_path])
        assert found.resolve() == (tmp_path / "secret/s.stl").resolve()


@pytest.mark.parametrize("name", INSIDE)
def test_a_mesh_inside_is_taken(name: str, urdf: Path, tmp_path: Path) -> None:
    assert find_mesh(name.format(tmp_path), urdf).read_text(encoding="utf-8") == STL


def test_without_a_package_only_the_folder_of_the_urdf_counts(urdf: Path, tmp_path: Path) -> None:
    (tmp_path / "arm" / "package.xml").unlink()
    assert find_mesh("beside.stl", urdf).is_file()
    for name in ("../meshes/m.stl", "package://arm/meshes/m.stl"):
        with pytest.raises(InputError, match=r"no mesh|leads to"):
            find_mesh(name, urdf)
        assert find_mesh(name, urdf, [tmp_path / "arm"]).is_file()


def test_a_package_of_ros_may_be_installed_by_links(
    urdf: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As `colcon build --symlink-install` does it: each file of the package is a link."""
    share = tmp_path / "install" / "share" / "hand"
    source = tmp_path / "source" / "hand"
    for folder in (share, source):
        folder.mkdir(parents=True)
    for name in ("package.xml", "h.stl"):
        (source / name).write_text(STL, encoding="utf-8")
        (share / name).symlink_to(source / name)
    (share / "s.stl").symlink_to(tmp_path / "secret/s.stl")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "install"))
    assert find_mesh("package://hand/h.stl", urdf) == share / "h.stl"
    with pytest.raises(InputError, match="leads to"):
        find_mesh("package://hand/s.stl", urdf)


def test_links_in_a_ring_are_no_mesh(urdf: Path) -> None:
    (urdf.parent / "ring.stl").symlink_to("ring.stl")
    with pytest.raises(InputError, match="there is no mesh"):
        find_mesh("ring.stl", urdf)


def test_the_user_is_told_and_can_allow_the_folder(
    urdf: Path, tmp_path: Path, knotwork: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("ROS_PACKAGE_PATH", "/nowhere")
    (tmp_path / "task.yaml").write_text(
        "robot: {urdf: arm/urdf/arm.urdf, tool_frame: b}\n"
        "scene: {objects: {wall: {box: [1, 1, 1], position: [0, 0, 5]}}}\n"
        "waypoints:\n  - joints: {j: 0}\n  - {joints: {j: 0.5}, after: 2}\n",
        encoding="utf-8",
    )
    for command, kind in ((["plan"], "collision"), (["view", "--html", "a.html"], "visual")):
        text = URDF.format(kind=kind, mesh="../../secret/s.stl")
        urdf.write_text(text, encoding="utf-8")
        ran = knotwork(*command, "task.yaml")
        said = " ".join((ran.out + ran.err).split())
        assert "link 'a': mesh '../../secret/s.stl' leads to" in said, said
        ran = knotwork(*command, "task.yaml", "--package-path", "secret")
        assert "leads to" not in ran.out + ran.err
        monkeypatch.setenv("ROS_PACKAGE_PATH", "/nowhere")


@pytest.mark.parametrize("name", kw.robot_names())
def test_meshes_of_shipped_robots_are_found(name: str) -> None:
    path = kw.load_robot(name).urdf
    shapes = UrdfShapes(path)
    for link in shapes.links:
        for kind in ("visual", "collision"):
            for shape in shapes.of(link, kind)[0]:
                assert shape.kind != "mesh" or find_mesh(shape.mesh, path).is_file()
