"""Which shapes of arms and tools are drawn; those that can not be drawn are warnings."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from scipy.spatial import cKDTree

import knotwork as kw
from command_line import Command
from drawn import (
    at_rest,
    beside_an_arm,
    faces,
    scene,
    shape_warnings,
    thing,
    tower,
    vertices,
)
from shipped import SCENARIO_FILES
from sweeps import mostly_exhaustive
from texts import written
from urdfs import joint, link, robot, visual

STL = "solid a\nfacet normal 0 0 0\nouter loop\n{}endloop\nendfacet\nendsolid a\n"
FLAT = STL.format("vertex 0 0 0\n" * 3)
GOOD = STL.format("vertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n")
NOT_A_NUMBER = "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"

# Each in place of the first shape, and what the warning says.
SHAPES = {
    "<box/>": "box has size ''; it must be 3 numbers",
    '<box size="1 1 1 1"/>': "box has size '1 1 1 1'",
    '<box size="1 -1 1"/>': "each must be greater than 0",
    '<sphere radius="0"/>': "sphere has sizes [0.0]; each must be greater than 0",
    '<sphere radius="x"/>': "sphere has radius 'x'; it must be 1 number of at most 1e+06",
    '<sphere radius="nan"/>': "sphere has radius 'nan'",
    '<cylinder radius="1"/>': "cylinder has length ''",
    '<cylinder radius="1e300" length="1"/>': "at most 1e+06",
    "<cone/>": "there is no shape <cone>; accepted: box",
    '<mesh filename="none.stl"/>': "there is no mesh 'none.stl'",
    f'<mesh filename="{"x" * 5000}"/>': "there is no mesh 'xxx",
    "<mesh/>": "there is no mesh ''",
    '<mesh filename="good.stl" scale="x"/>': "mesh has scale 'x'; it must be 3 numbers",
    '<mesh filename="good.stl" scale="1 1"/>': "mesh has scale '1 1'",
    '<mesh filename="good.stl" scale="0 0 0"/>': "none may be 0",
    '<mesh filename="flat.stl"/>': "none of its triangles has an area",
    '<mesh filename="nan.obj"/>': "points that are not finite",
    '<mesh filename="../outside"/>': "there is no mesh '../outside'",
}
PLACES = {
    '<origin xyz="1 2"/>': "origin has xyz '1 2'; it must be 3 numbers",
    '<origin xyz="0 0 nan"/>': "origin has xyz",
    '<origin rpy="1"/>': "origin has rpy '1'",
}
COLOURS = {
    '<material name="m"><color rgba="1 1"/></material>': "color has rgba '1 1'",
    '<material name="m"><color/></material>': "color has rgba ''",
    '<material name="m"><color rgba="1 1 1 nan"/></material>': "color has rgba",
    '<material name="m"><color rgba="9 1 1 1"/></material>': "each must be from 0 to 1",
}
BOX = '<box size="1 1 1"/>'


def urdf(shape: str = BOX, beside: str = "") -> str:
    return robot(
        link("a", visual(shape, beside)),
        link("b", visual(BOX)),
        link("c"),
        joint("j", "a", "b", at="0 0 1"),
        joint("k", "b", "c", "fixed"),
    )


@pytest.fixture
def arm(tmp_path: Path):
    for name, content in (("good.stl", GOOD), ("flat.stl", FLAT), ("nan.obj", NOT_A_NUMBER)):
        (tmp_path / name).write_text(content, encoding="utf-8")

    def make(text: str) -> kw.Robot:
        path = written(tmp_path / "arm.urdf", text)
        return kw.load_robot(path).with_tool("c")

    return make


def test_shapes_that_can_not_be_drawn_are_warnings(arm) -> None:
    warnings = shape_warnings(arm(tower([f"<geometry>{shape}</geometry>" for shape in SHAPES])))
    for i, (warning, message) in enumerate(zip(warnings, SHAPES.values(), strict=True)):
        assert message in warning
        assert warning.startswith(f"link 'l{i}': ")
        assert warning.endswith("drawn as a line")
        assert len(warning) < 500


def test_lines_replace_missing_shapes(arm) -> None:
    bare = arm(re.sub("<visual>.*?</visual>", "", urdf()))
    assert shape_warnings(bare)[-1].endswith("its links are drawn as lines")
    meshes = scene(at_rest(bare))["shapes"][0]  # up to the joint
    assert max(vertices(mesh)[:, 2].max() for mesh in meshes) >= 1.0


def test_a_mesh_has_the_colour_of_its_shape(arm) -> None:
    red = '<material name="r"><color rgba="1 0 0 1"/></material>'
    (base,) = scene(at_rest(arm(urdf('<mesh filename="good.stl"/>', red))))["shapes"][0]
    assert base["colours"] == [255, 0, 0]


@pytest.mark.parametrize(("given", "drawn"), [(PLACES, ""), (COLOURS, "it is drawn grey")])
def test_wrong_places_and_colours_are_warnings(arm, given: dict[str, str], drawn: str) -> None:
    warnings = shape_warnings(arm(tower([f"<geometry>{BOX}</geometry>{one}" for one in given])))
    for warning, message in zip(warnings, given.values(), strict=True):
        assert message in warning
        assert warning.endswith(drawn)


def test_triangles_of_all_shapes_together_are_bounded(arm, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("knotwork.view.links.MAX_DRAWN_TRIANGLES", 20)
    (warning,) = shape_warnings(arm(urdf()))
    assert "more than 20 triangles" in warning


def test_mesh_files_are_read_once_and_bounded(arm, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also one that can't be read, and whatever name it is given."""
    names = ("good.stl", "./good.stl", "flat.stl", ".//flat.stl")
    shapes = [visual(f'<mesh filename="{name}"/>') for name in names]
    shown = arm(urdf().replace("<visual>", "".join(shapes) + "<visual>", 1))
    monkeypatch.setattr("knotwork.view.links.MAX_FILE_BYTES", len(GOOD) + len(FLAT))
    assert not [line for line in shape_warnings(shown) if "is not read" in line]
    monkeypatch.setattr("knotwork.view.links.MAX_FILE_BYTES", len(GOOD))
    assert "flat.stl is not read" in shape_warnings(shown)[0]


def test_meshes_come_from_package_paths(arm, tmp_path: Path, run: Command) -> None:
    """Named in the robot's file, relative to it, or on the command line."""
    arm(urdf('<mesh filename="package://mine/meshes/there.stl"/>'))
    written(tmp_path / "elsewhere" / "mine" / "meshes" / "there.stl", GOOD)
    description = {"urdf": "arm.urdf", "tool_frame": "c"}
    lost = shape_warnings(kw.load_robot(description, relative_to=tmp_path))
    assert "there is no mesh 'package://mine/meshes/there.stl'" in lost[0]
    description["package_paths"] = ["elsewhere"]
    found = kw.load_robot(description, relative_to=tmp_path)
    assert found.package_paths == (tmp_path / "elsewhere",)
    assert not [line for line in shape_warnings(found) if "no mesh" in line]
    written(
        tmp_path / "task.yaml",
        "robot: {urdf: arm.urdf, tool_frame: c}\nwaypoints:\n"
        "  - joints: {j: 0}\n  - {joints: {j: 0.5}, after: 2}\n",
    )
    view = ("view", "task.yaml", "--html", "a.html")
    assert "there is no mesh" in run(*view).err
    assert "there is no mesh" not in run(*view, "--package-path", "elsewhere").err


GAP = 0.01
"""Most between a part and what carries it [m]: surfaces are sampled."""
WITH_TOOL = [name for name in SCENARIO_FILES if kw.load_scenario(name).scene.tool]


def surface(corners: Any, count: int = 60_000) -> Any:
    """Points on triangles of shape (n, 3, 3), a millimetre or two apart."""
    first, *sides = np.moveaxis(corners - corners[:, :1] * [[[0], [1], [1]]], 1, 0)
    area = np.linalg.norm(np.cross(*sides), axis=1)
    chance = np.random.default_rng(0)
    which = chance.choice(len(corners), count, p=area / area.sum())
    u, v = chance.random((2, count, 1))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    return first[which] + u * sides[0][which] + v * sides[1][which]


@pytest.mark.parametrize("name", mostly_exhaustive(WITH_TOOL, "ur10_weld"))
def test_a_tool_goes_on_from_what_carries_it(name: str) -> None:
    """Each part begins at the hand, the flange or a part before it."""
    task = yaml.safe_load(SCENARIO_FILES[name].read_text(encoding="utf-8"))
    tool = {key: value for key, value in task["tool"].items() if key != "holds"}
    rest = [{"joints": "home"}, {"joints": "home", "after": 1}]
    units = {"units": task["units"]} if "units" in task else {}
    page = scene(kw.plan({"robot": task["robot"], "tool": tool, "waypoints": rest, **units}).view())
    shapes = [one for one in page["meshes"] if one["name"] == "tool shape"]
    tools = [surface(vertices(shape["mesh"])[faces(shape["mesh"])]) for shape in shapes]
    arm = page["shapes"][shapes[0]["carrier"]]
    corners = np.concatenate([vertices(mesh)[faces(mesh)] for mesh in arm])
    parts = [surface(corners), *tools]
    trees = [cKDTree(part) for part in parts]
    for i, part in enumerate(parts[1:], 1):
        gap = min(tree.query(part)[0].min() for tree in trees[:i])
        assert gap < GAP, f"part {i} is {1e3 * gap:.1f} mm from what carries it"


@pytest.mark.parametrize("kind", ["cylinder", "cone", "capsule", "sphere"])
def test_thin_objects_have_their_size(kind: str) -> None:
    size = 5e-5 if kind == "sphere" else {"radius": 5e-5, "length": 1e-4}
    corners = vertices(thing(scene(beside_an_arm({kind: size})), "objects"))
    assert np.ptp(corners, axis=0)[:2] == pytest.approx(1e-4, rel=0.05)
