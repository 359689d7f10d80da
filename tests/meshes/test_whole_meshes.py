"""A mesh that is not read whole is an error: what is left out would be run into."""

from __future__ import annotations

import re
import struct
from pathlib import Path

import numpy as np
import pytest
from test_mesh_files import (
    CORNERS,
    FACES,
    HOSTILE,
    VOLUME,
    ascii_stl,
    binary_stl,
    collada,
    obj,
    read,
    volume,
)

from knotwork.errors import InputError

FACE_LIST = "property list uchar int vertex_indices\n"
AXES = "property float x\nproperty float y\nproperty float z\n"
TEXT_PLY = (
    f"ply\nformat ascii 1.0\ncomment four\nelement vertex 4\n{AXES}element face 4\n{FACE_LIST}"
    "end_header\n"
    + "".join(f"{x} {y} {z}\n" for x, y, z in CORNERS)
    + "".join(f"3 {a} {b} {c}\n" for a, b, c in FACES)
)
# two triangles and two that are joined to a polygon of four corners, on a base
BASE = np.array([[0, 0, 0], [0, 3, 0], [2, 3, 0], [2, 0, 0], [0, 0, 4]])
SIDES = [[0, 1, 2, 3], [0, 4, 1], [1, 4, 2], [2, 4, 3], [3, 4, 0]]
PYRAMID = 2 * 3 * 4 / 3


def binary_ply(order: str = "<", kind: str = "face") -> bytes:
    """The solid, with a colour before each list."""
    name = "binary_little_endian" if order == "<" else "binary_big_endian"
    head = (
        f"ply\nformat {name} 1.0\nelement vertex 4\n{AXES}property uchar red\nelement {kind} 4\n"
        f"property uchar red\n{FACE_LIST}element edge 1\n"
        "property int vertex1\nproperty int vertex2\nend_header\n"
    )
    points = b"".join(struct.pack(f"{order}fffB", *point, 7) for point in CORNERS)
    sides = b"".join(struct.pack(f"{order}BB3i", 9, 3, *one) for one in FACES)
    return head.encode() + points + sides + struct.pack(f"{order}2i", 0, 1)


TEXT_PYRAMID = (
    f"ply\nformat ascii 1.0\nelement vertex 5\n{AXES}element face 5\n{FACE_LIST}end_header\n"
    + "".join(f"{x} {y} {z}\n" for x, y, z in BASE)
    + "".join(f"{len(one)} {' '.join(map(str, one))}\n" for one in SIDES)
)


def relative_obj() -> str:
    """The solid twice, each part right after its points, counted back from the last one."""
    points = [f"v {x} {y} {z}\n" for x, y, z in CORNERS]
    faces = [f"f {a - 4}/1 {b - 4}/1 {c - 4}/1\n" for a, b, c in FACES]
    far = [f"v {x + 9} {y} {z}\n" for x, y, z in CORNERS]
    return "".join(["vt 0 0\n", *points, *faces, "o second\n", *far, *faces, "l 1 2\n"])


def of_faces(faces: str) -> str:
    """A COLLADA file with other faces."""
    return re.sub(r"<triangles.*?</triangles>", faces, collada(), flags=re.DOTALL)


INPUT = '<input semantic="VERTEX" source="#v" offset="0"/>'
FLAT = " ".join(str(value) for value in FACES.ravel())
EACH = "".join(f"<p>{a} {b} {c}</p>" for a, b, c in FACES)
POLYLIST = of_faces(f'<polylist count="4">{INPUT}<vcount>3 3 3 3</vcount><p>{FLAT}</p></polylist>')
POLYGONS = of_faces(f'<polygons count="4">{INPUT}{EACH}</polygons>')
STRIPS = of_faces(f'<tristrips count="4">{INPUT}{EACH}</tristrips>')
FANS = of_faces(f'<trifans count="4">{INPUT}{EACH}</trifans>')
# the solid shown by a node of the library, which the scene shows
LIBRARY = collada().replace(
    "<library_visual_scenes>",
    '<library_nodes><node id="n"><instance_geometry url="#g"/></node></library_nodes>'
    "<library_visual_scenes>",
)
LIBRARY = re.sub(
    r"<instance_geometry url=.#g.><bind.*?</instance_geometry>",
    '<instance_node url="#n"/>',
    LIBRARY,
    flags=re.DOTALL,
)

WHOLE = {
    "two solids": ("a.stl", ascii_stl() + ascii_stl().replace("four", "a facet of it"), 2 * VOLUME),
    "lines of another system": ("a.stl", ascii_stl().upper().replace("\n", "\r\n"), VOLUME),
    "lines that end by a carriage return": ("a.stl", ascii_stl().replace("\n", "\r"), VOLUME),
    "a binary file that says solid": ("a.stl", binary_stl(), VOLUME),
    "text": ("a.ply", TEXT_PLY, VOLUME),
    "polygons of several lengths": ("a.ply", TEXT_PYRAMID, PYRAMID),
    "bytes": ("a.ply", binary_ply(), VOLUME),
    "the other order of bytes": ("a.ply", binary_ply(">"), VOLUME),
    "counted back": ("a.obj", relative_obj(), 2 * VOLUME),
    "continued lines": ("a.obj", obj().replace("v 2.0 ", "v 2.0 \\\n"), VOLUME),
    "polylist": ("a.dae", POLYLIST, VOLUME),
    "polygons": ("a.dae", POLYGONS, VOLUME),
    "strips": ("a.dae", STRIPS, VOLUME),
    "fans": ("a.dae", FANS, VOLUME),
    "a node of the library": ("a.dae", LIBRARY, VOLUME),
}


@pytest.mark.parametrize("case", WHOLE)
def test_reads_whole_file(case: str, tmp_path: Path) -> None:
    name, content, expected = WHOLE[case]
    assert sum(map(volume, read(tmp_path, name, content))) == pytest.approx(expected)


LATE = ascii_stl().index("facet normal", len(ascii_stl()) // 2)
SKIN = '<instance_controller url="#skin"/>'
IN_PART = {
    "text cut between facets": ("a.stl", ascii_stl()[:LATE], "'endsolid' do not alternate"),
    "a facet of two corners": (
        "a.stl",
        ascii_stl().replace("vertex 2.0 0.0 0.0\n", "", 1),
        "'facet normal .* after 0 facets is no facet",
    ),
    "a long number": ("a.stl", ascii_stl().replace("2.0", "2.0" + 30 * "0"), "more than 32 char"),
    "more after the last solid": ("a.stl", ascii_stl() + "more", "'more' after 4 facets"),
    "a binary file and a byte": (
        "a.stl",
        binary_stl() + b"\n",
        "counts 4 facets, which is a file of 284 bytes, and it has 285",
    ),
    "too short for a header": ("a.stl", b"bin", "it is no text, .* and it has 3"),
    "text PLY cut": (
        "a.ply",
        "\n".join(TEXT_PLY.splitlines()[:-2]),
        "counts 4 of 'vertex', 4 of 'face', a line each, and it has 6 lines",
    ),
    "a line too many": ("a.ply", TEXT_PLY + "3 0 1 2\n", "and it has 9 lines"),
    "a face of two corners": (
        "a.ply",
        TEXT_PLY.replace("\n3 0 2 1", "\n2 0 2"),
        "fewer than 3 corners",
    ),
    "no corner of that number": ("a.ply", TEXT_PLY.replace("3 0 2 1", "3 0 2 9"), "not in 0 to 3"),
    "a header that ends nowhere": ("a.ply", TEXT_PLY[:90], "no line 'end_header'"),
    "binary PLY cut": ("a.ply", binary_ply()[:-30], "it is cut off, damaged"),
    "faces of another name": (
        "a.ply",
        TEXT_PLY.replace("element face 4", f"element face 2\n{FACE_LIST}element polygon 2"),
        "it has 2 of 'polygon' with lists of vertices, and only those of 'face' are read",
    ),
    "a unit that is no number": (
        "a.dae",
        collada().replace('meter="1.0"', 'meter="0,001"'),
        "its unit of length is '0,001', not a number of metres",
    ),
    "triangle strips": ("a.ply", binary_ply(kind="tristrips"), "4 of 'tristrips'"),
    "a free-form surface": ("a.obj", obj() + "surf 0 1 0 1 1 2 3 4\n", "line 9 is 'surf 0 1"),
    "corners before the first": ("a.obj", relative_obj().replace("-4", "-9"), "line 6 is 'f -9"),
    "no such corner": ("a.obj", obj().replace("f 1", "f 5"), "not in 0 to 3"),
    "a point of two numbers": ("a.obj", obj().replace("v 2.0 ", "v "), "line 2 is 'v 0.0 0.0'"),
    "a skin": ("a.dae", collada().replace("</node>", f"{SKIN}</node>"), "a skin or morph"),
    "holes": (
        "a.dae",
        POLYGONS.replace("</polygons>", "<ph><p>0 1 2</p><h>0 1 3</h></ph></polygons>"),
        "a polygon with holes",
    ),
    "no number": ("a.dae", collada().replace(">0.0 0.0", ">NaN 0.0"), "are not finite"),
    "values with others between": (
        "a.dae",
        collada().replace('stride="3"', 'stride="4"'),
        "stride",
    ),
    "a spline": (
        "a.dae",
        collada().replace("<mesh>", "<spline>").replace("</mesh>", "</spline>"),
        "Geometry #g not found",
    ),
    "no scene": ("a.dae", "<COLLADA><asset/></COLLADA>", "it shows no scene"),
    "no triangles": ("a.stl", bytes(84), "has no triangles"),
    "a shape of another file": ("a.dae", collada().replace("#g", "b.dae#g"), "can't be read"),
}


REFUSED = {**HOSTILE, **IN_PART}


@pytest.mark.parametrize("case", REFUSED)
def test_refuses_hostile_or_partly_read_file_in_one_line(case: str, tmp_path: Path) -> None:
    name, content, says = REFUSED[case]
    with pytest.raises(InputError, match=says) as error:
        read(tmp_path, name, content)
    assert name in str(error.value)
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 600
