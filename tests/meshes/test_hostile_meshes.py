"""Mesh files from strangers: small ones that ask for much, broken ones, and those that pry."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from test_mesh_files import ascii_stl, binary_stl, collada, obj, read

from command_line import PEAK_MEMORY, python
from knotwork.errors import InputError
from knotwork.scene.meshes.mesh_files import read_mesh


def doubling(levels: int) -> str:
    """Each node shows the one before it twice."""
    shown = "".join(
        f'<node id="n{i}"><instance_node url="#n{i - 1}"/><instance_node url="#n{i - 1}"/></node>'
        for i in range(1, levels + 1)
    )
    first = '<node id="n0"><instance_geometry url="#g"/></node>'
    text = collada(f'<instance_node url="#n{levels}"/>')
    nodes = f"<library_nodes>{first}{shown}</library_nodes>"
    return text.replace("<library_visual_scenes>", f"{nodes}<library_visual_scenes>")


def many_parts() -> str:
    """A shape of many parts, shown often: each part is made anew wherever it is shown."""
    text = collada('<instance_node url="#n"/>' * 100)
    nodes = '<library_nodes><node id="n"><instance_geometry url="#g"/></node></library_nodes>'
    part = re.findall(r"<triangles.*?</triangles>", text, re.DOTALL)[0]
    text = text.replace(part, part * 100)
    return text.replace("<library_visual_scenes>", f"{nodes}<library_visual_scenes>")


def showing_itself() -> str:
    loop = '<node id="a"><instance_node url="#b"/></node><node id="b"><instance_node url="#a"/>'
    text = collada('<instance_node url="#a"/>')
    nodes = f"<library_nodes>{loop}</node></library_nodes>"
    return text.replace("<library_visual_scenes>", f"{nodes}<library_visual_scenes>")


def nested(depth: int) -> str:
    return collada("<node>" * depth + "</node>" * depth)


def laughing() -> str:
    return '<!DOCTYPE COLLADA [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;">]>' + collada()


PLY = (
    "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float x\n"
    "property float y\nproperty float z\nelement face 4000000000\n"
    "property list uchar int vertex_indices\nend_header\n"
)

HOSTILE = {
    "parts of a shape": ("a.dae", many_parts(), r"show 1\.01e\+04 shapes; at most 5000"),
    "nodes that double for ever": ("a.dae", doubling(90), "shapes; at most 5000"),
    "itself": ("a.dae", showing_itself(), "nested too deep"),
    "nested": ("a.dae", nested(2000), "nested more than 100 deep"),
    "entities": ("a.dae", laughing(), "declares an entity"),
    "unit of nothing": ("a.dae", collada(meter=0.0), "Singular|area"),
    "index too large": ("a.dae", collada().replace("<p>0", "<p>99"), "can't be read"),
    "flat": ("a.stl", ascii_stl().replace("2", "0").replace("3", "0"), "an area"),
    "not finite": ("a.obj", obj().replace("v 2.0", "v nan"), "not finite"),
    "bytes that are no text": (
        "a.obj",
        obj().encode().replace(b"v 2.0", b"v 2\xff\xfe"),
        "line 2 is 'v 2",
    ),
    "no points": ("a.obj", obj()[obj().index("f ") :], "can't be read"),
    "too far": ("a.obj", obj().replace("v 2.0", "v 1e300"), "not finite or farther"),
    "more facets than it has": ("a.stl", binary_stl()[:80] + b"\xff" * 120, "can't be read"),
    "counts alone": ("a.ply", PLY, "can't be read"),
    "a suffix that is not read": ("a.blend", "BLENDER", r"read are \.dae, \.stl"),
}


@pytest.mark.parametrize("case", HOSTILE)
def test_refuses_hostile_mesh_in_one_line(case: str, tmp_path: Path) -> None:
    name, content, says = HOSTILE[case]
    with pytest.raises(InputError, match=says) as error:
        read(tmp_path, name, content)
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 600


MANY = {
    "a.obj": obj() + "".join(f"usemtl {i}\nf 1 2 3\n" for i in range(40_000)),
    "a.stl": "".join(ascii_stl().replace("four", str(i)) for i in range(10_000)),
    "b.stl": ascii_stl() + "solid x\nendsolid x\n" * 100_000,
}


@pytest.mark.parametrize("name", MANY)
def test_a_mesh_divided_into_many_is_read_as_one(name: str, tmp_path: Path) -> None:
    (part,) = read(tmp_path, name, MANY[name])
    assert len(part.triangles) in (4, 40_000, 40_004)


def test_no_more_bytes_are_read_than_the_bound(tmp_path: Path) -> None:
    path = tmp_path / "sparse.stl"
    with path.open("wb") as file:
        file.truncate(3_000_000_000)
    with pytest.raises(InputError, match="3000000000 bytes; at most 64000000"):
        read_mesh(path)


def test_more_triangles_than_the_bound_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("knotwork.scene.meshes.mesh_part.MAX_MESH_TRIANGLES", 3)
    for name, content in (("a.stl", binary_stl()), ("a.dae", collada().encode())):
        with pytest.raises(InputError, match="4 triangles; at most 3 are read"):
            read(tmp_path, name, content)


def test_memory_is_bounded_whatever_a_header_counts(tmp_path: Path) -> None:
    """In a process of its own, whose memory nothing else has used."""
    path = tmp_path / "a.stl"
    path.write_bytes(bytes(80) + b"\xff" * 4 + binary_stl()[84:])
    code = (
        "import pathlib, sys, trimesh\n"
        "from knotwork.errors import InputError\n"
        "from knotwork.scene.meshes.mesh_files import read_mesh\n"
        f"{PEAK_MEMORY}before = used()\n"
        "try: read_mesh(pathlib.Path(sys.argv[1]))\n"
        "except InputError: pass\n"
        "print(used() - before)\n"
    )
    ran = python("-c", code, path, check=True)
    assert int(ran.stdout) < 100_000  # kB
