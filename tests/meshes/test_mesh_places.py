"""A URDF's meshes come from its own package or folder and the folders that the user names."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import pytest

import knotwork as kw
from command_line import Command
from drawn import mesh_visuals, shape_warnings, tower
from texts import written
from urdfs import collision, joint, link, robot, visual

STL = "solid a\nfacet normal 0 0 1\nouter loop\n{}endloop\nendfacet\nendsolid a\n".format(
    "vertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
)
OUTSIDE = {
    "{}/secret/s.stl": "no mesh",
    "file://{}/secret/s.stl": "no mesh",
    "../../secret/s.stl": "no mesh",
    "../../secret/none.stl": "no mesh",
    "package://arm/../secret/s.stl": "no mesh",
    "package://arm/urdf/../../secret/s.stl": "no mesh",
    "package://../../secret/s.stl": "no mesh",
    "package://../secret/s.stl": "there is no mesh",
    "package://secret/s.stl": "there is no mesh",
    "model://secret/s.stl": "there is no mesh",
    "../meshes/link.stl": "no mesh",
    "../meshes/folder/s.stl": "no mesh",
    "package://arm/meshes/link.stl": "no mesh",
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
        written(tmp_path / name, STL)
    (tmp_path / "arm/meshes/link.stl").symlink_to(tmp_path / "secret/s.stl")
    (tmp_path / "arm/meshes/folder").symlink_to(tmp_path / "secret")
    (tmp_path / "arm/meshes/inner.stl").symlink_to("m.stl")
    return tmp_path / "arm" / "urdf" / "arm.urdf"


def warnings_of(urdf: Path, names: Iterable[str], packages: Sequence[Path] = ()) -> list[str]:
    """The warning about each mesh of an arm, empty where it is drawn."""
    listed = list(names)
    urdf.write_text(tower(mesh_visuals(listed)), encoding="utf-8")
    robot = kw.load_robot(
        {"urdf": str(urdf), "tool_frame": "c", "package_paths": list(map(str, packages))}
    )
    warnings = [line for line in shape_warnings(robot) if line.startswith("link ")]
    by_link = dict(line.split(": ", 1) for line in warnings)
    return [by_link.get(f"link 'l{i}'", "") for i in range(len(listed))]


def test_meshes_outside_need_a_named_folder(urdf: Path, tmp_path: Path) -> None:
    addresses = [name.format(tmp_path) for name in OUTSIDE]
    for name, warning in zip(OUTSIDE, warnings_of(urdf, addresses), strict=True):
        assert OUTSIDE[name] in warning
        assert f"below {tmp_path / 'arm'};" in warning
        assert "package_paths" in warning
        assert "--package-path" in warning
    for name, warning in zip(OUTSIDE, warnings_of(urdf, addresses, [tmp_path]), strict=True):
        assert bool(warning) == ("none" in name), warning


def test_meshes_inside_are_taken(urdf: Path, tmp_path: Path) -> None:
    assert not any(warnings_of(urdf, [name.format(tmp_path) for name in INSIDE]))


def test_without_a_package_only_the_folder_of_the_urdf_counts(urdf: Path, tmp_path: Path) -> None:
    (tmp_path / "arm" / "package.xml").unlink()
    names = ("beside.stl", "../meshes/m.stl", "package://arm/meshes/m.stl")
    beside, *others = warnings_of(urdf, names)
    assert not beside
    assert all("no mesh" in warning for warning in others)
    assert not any(warnings_of(urdf, names, [tmp_path / "arm"]))


def test_ros_package_of_links(urdf: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As `colcon build --symlink-install` does it: each file of the package is a link."""
    share = tmp_path / "install" / "share" / "hand"
    source = tmp_path / "source" / "hand"
    share.mkdir(parents=True)
    for name in ("package.xml", "h.stl"):
        (share / name).symlink_to(written(source / name, STL))
    (share / "s.stl").symlink_to(tmp_path / "secret/s.stl")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "install"))
    hand, secret = warnings_of(urdf, ["package://hand/h.stl", "package://hand/s.stl"])
    assert not hand
    assert "no mesh" in secret


def test_meshes_are_found_in_the_users_folders(urdf: Path, tmp_path: Path) -> None:
    for name in ("other/meshes/a.stl", "packages/tool/b.stl"):
        written(tmp_path / name, STL)
    other, packages = tmp_path / "other", tmp_path / "packages"
    names = ("package://tool/b.stl", "meshes/a.stl", "package://other/meshes/a.stl")
    assert all("there is no mesh" in warning for warning in warnings_of(urdf, names))
    assert not any(warnings_of(urdf, names, [packages, other]))
    tool, *lost = warnings_of(urdf, names, [packages])
    assert not tool
    assert all("there is no mesh" in warning for warning in lost)
    cloned = ["package://other_support/meshes/a.stl", "package://other_support/../b.stl"]
    found, outside = warnings_of(urdf, cloned, [other])  # a package in a folder of another name
    assert not found
    assert "no mesh" in outside


def test_impossible_names_and_rings_of_links_are_no_meshes(urdf: Path, tmp_path: Path) -> None:
    (urdf.parent / "ring.stl").symlink_to("ring.stl")
    names = ("ring.stl", "x" * 5000, "package://" + "x" * 5000, "package://", "")
    assert all("there is no mesh" in warning for warning in warnings_of(urdf, names, [tmp_path]))


def test_a_message_names_the_option_that_allows_the_folder(
    urdf: Path, tmp_path: Path, run: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    written(
        tmp_path / "task.yaml",
        "robot: {urdf: arm/urdf/arm.urdf, tool_frame: b}\n"
        "scene: {objects: {wall: {box: [1, 1, 1], position: [0, 0, 5]}}}\n"
        "waypoints:\n  - joints: {j: 0}\n  - {joints: {j: 0.5}, after: 2}\n",
    )
    for command, shape in ((["plan"], collision), (["view", "--html", "a.html"], visual)):
        monkeypatch.setenv("ROS_PACKAGE_PATH", "/nowhere")  # which the option adds to
        base = link("a", shape('<mesh filename="../../secret/s.stl"/>'))
        urdf.write_text(robot(base, link("b"), joint("j", "a", "b")), encoding="utf-8")
        ran = run(*command, "task.yaml")
        output = " ".join((ran.out + ran.err).split())
        assert "link 'a': there is no mesh '../../secret/s.stl'" in output, output
        ran = run(*command, "task.yaml", "--package-path", "secret")
        assert "no mesh" not in ran.out + ran.err
