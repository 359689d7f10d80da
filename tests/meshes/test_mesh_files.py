"""Mesh files of several formats: the same solid comes out of each; hostile ones do no harm."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from command_line import PEAK_MEMORY, python
from knotwork.errors import InputError
from knotwork.scene.meshes.mesh_files import MeshPart, read_mesh
from texts import written

CORNERS = np.array([[0, 0, 0], [2, 0, 0], [0, 3, 0], [0, 0, 4]], dtype=float)
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
VOLUME = 2 * 3 * 4 / 6

COLLADA = """<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit meter="{meter}"/><up_axis>Y_UP</up_axis></asset>
<library_effects><effect id="e"><profile_COMMON><technique sid="t"><phong><diffuse>
  <color>0.1 0.2 0.3 0.5</color></diffuse></phong></technique></profile_COMMON></effect>
</library_effects>
<library_materials><material id="m"><instance_effect url="#{effect}"/></material>
</library_materials>
<library_geometries><geometry id="g"><mesh>
  <source id="p"><float_array id="pa" count="12">{points}</float_array><technique_common>
    <accessor source="#pa" count="4" stride="3"><param name="X" type="float"/>
    <param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common>
  </source>
  <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
  <triangles material="s" count="4"><input semantic="VERTEX" source="#v" offset="0"/>
    <p>{faces}</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="scene"><node>{steps}
  <instance_geometry url="#g"><bind_material><technique_common>
  <instance_material symbol="s" target="#m"/></technique_common></bind_material>
  </instance_geometry></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#scene"/></scene></COLLADA>"""


def collada(steps: str = "", meter: float = 1.0, effect: str = "e") -> str:
    return COLLADA.format(
        points=" ".join(str(value) for value in CORNERS.ravel()),
        faces=" ".join(str(value) for value in FACES.ravel()),
        steps=steps,
        meter=meter,
        effect=effect,
    )


def ascii_stl() -> str:
    vertices = ["".join(f"vertex {x} {y} {z}\n" for x, y, z in CORNERS[face]) for face in FACES]
    facets = (f"facet normal 0 0 0\nouter loop\n{one}endloop\nendfacet\n" for one in vertices)
    return f"solid four\n{''.join(facets)}endsolid four\n"


def binary_stl() -> bytes:
    record = np.zeros(len(FACES), [("n", "<f4", 3), ("c", "<f4", (3, 3)), ("a", "<u2")])
    record["c"] = CORNERS[FACES]
    # some programs write a header that looks like text
    return b"solid four".ljust(80) + len(FACES).to_bytes(4, "little") + record.tobytes()


def obj() -> str:
    points = "".join(f"v {x} {y} {z}\n" for x, y, z in CORNERS)
    return points + "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in FACES)


def two_materials() -> str:
    """The solid twice, the second far away and of another material."""
    more = "".join(f"v {x + 9} {y} {z}\n" for x, y, z in CORNERS)
    faces = "".join(f"f {a + 5} {b + 5} {c + 5}\n" for a, b, c in FACES)
    return f"usemtl one\n{obj()}{more}usemtl two\n{faces}"


def read(folder: Path, name: str, content: str | bytes) -> list[MeshPart]:
    """The parts of a mesh file."""
    (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_mesh(folder / name)


def corners(part: MeshPart) -> np.ndarray:
    return part.points[part.triangles]


def volume(part: MeshPart) -> float:
    """Positive if the triangles face outwards."""
    a, b, c = np.moveaxis(corners(part), 1, 0)
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.dae", collada()),
        ("a.stl", ascii_stl()),
        ("b.STL", binary_stl()),
        ("a.obj", obj()),
    ],
)
def test_each_format_gives_the_solid(tmp_path: Path, name: str, content: str | bytes) -> None:
    (part,) = read(tmp_path, name, content)
    assert part.triangles.shape == (4, 3)
    assert volume(part) == pytest.approx(VOLUME)
    assert np.unique(corners(part).reshape(-1, 3), axis=0) == pytest.approx(
        np.unique(CORNERS, axis=0)
    )


def test_a_collada_file_says_where_its_solid_is_and_how_large(tmp_path: Path) -> None:
    """Steps act from the last to the first; mirrored, the triangles still face outwards."""
    steps = (
        "<translate>1 2 3</translate><rotate>0 0 1 90</rotate>"
        "<matrix>1 0 0 5 0 1 0 0 0 0 1 0 0 0 0 1</matrix><scale>-1 2 1</scale>"
    )
    (part,) = read(tmp_path, "a.dae", collada(steps, meter=0.01))
    x, y, z = CORNERS.T
    x, y = 5 - x, 2 * y
    expected = 0.01 * np.stack([1 - y, 2 + x, 3 + z], axis=1)
    assert np.unique(part.points.round(6), axis=0) == pytest.approx(np.unique(expected, axis=0))
    assert volume(part) == pytest.approx(2 * VOLUME * 1e-6)
    assert part.colour == (0.1, 0.2, 0.3, 0.5)


def test_a_file_of_two_materials_gives_both_solids(tmp_path: Path) -> None:
    """Coal 3.0.3 gives the second the points of the first."""
    parts = read(tmp_path, "a.obj", two_materials())
    places = np.concatenate([corners(part) for part in parts]).reshape(-1, 3)
    both = np.concatenate([CORNERS, CORNERS + np.array([9, 0, 0])])
    assert np.unique(places, axis=0) == pytest.approx(np.unique(both, axis=0))
    assert sum(map(volume, parts)) == pytest.approx(2 * VOLUME)


def test_a_collada_file_with_a_lost_material_keeps_its_shape(tmp_path: Path) -> None:
    text = collada("<translate>1 2 3</translate>", effect="lost")
    again = text[text.index("<triangles") : text.index("</triangles>") + len("</triangles>")]
    parts = read(tmp_path, "a.dae", text.replace("</triangles>", f"</triangles>{again}"))
    assert [volume(part) for part in parts] == pytest.approx([VOLUME, VOLUME])
    for part in parts:
        assert corners(part).min(axis=(0, 1)) == pytest.approx([1, 2, 3])
        assert part.colour is None


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
    "a suffix that is not read": ("a.blend", "BLENDER", r"accepted are files \.dae, \.stl"),
}


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


def test_refuses_too_many_triangles(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("knotwork.scene.meshes.mesh_part.MAX_MESH_TRIANGLES", 3)
    for name, content in (("a.stl", binary_stl()), ("a.dae", collada().encode())):
        with pytest.raises(InputError, match="4 triangles; at most 3 are read"):
            read(tmp_path, name, content)


def test_memory_is_bounded_whatever_a_header_counts(tmp_path: Path) -> None:
    """In a process of its own, whose memory nothing else has used."""
    path = written(tmp_path / "a.stl", bytes(80) + b"\xff" * 4 + binary_stl()[84:])
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
