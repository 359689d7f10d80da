"""Convex hulls of meshes: right for many corners in a plane or around one, and read anew."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
import trimesh

import knotwork as kw
from knotwork.scene.building import build_robot_collision_model
from knotwork.scene.distances import DISTANCE_ERROR, DistanceMeter
from knotwork.scene.hulls import MAX_NEIGHBOURS, SHEET_THICKNESS, convex_hull
from knotwork.scene.solids import Placed, make_solid
from knotwork.task.scenario import PlacedShape

MAX_GROWTH = 4e-4
"""Largest growth of a hull, relative to the largest distance of a point from the middle."""

URDF = (
    '<robot name="r"><link name="a"/><link name="b"><collision><geometry>'
    '<mesh filename="part.stl"/></geometry></collision></link><joint name="j" type="revolute">'
    '<parent link="a"/><child link="b"/><axis xyz="0 0 1"/>'
    '<limit lower="-1" upper="1" velocity="1" effort="1"/></joint></robot>'
)


def test_rereads_changed_mesh(tmp_path: Path) -> None:
    """A file that changes, goes or comes, in one process and with one robot."""
    (tmp_path / "arm.urdf").write_text(URDF, encoding="utf-8")
    robot, mesh = kw.load_robot(tmp_path / "arm.urdf").with_tool("b"), tmp_path / "part.stl"
    for edge in (None, 1.0, 2.0, None, 3.0):
        if edge is None:
            mesh.unlink(missing_ok=True)
        else:
            mesh.write_bytes(trimesh.creation.box([edge] * 3).export(file_type="stl"))
        model = build_robot_collision_model(robot)
        if edge is None:
            assert not model.bodies
        else:
            ((solid,),) = (body.solids for body in model.bodies)
            np.testing.assert_allclose(np.ptp(solid.corners, axis=0), edge)


def circles(count: int, heights: tuple[float, ...]) -> Any:
    angle = np.linspace(0.0, 2 * np.pi, count, endpoint=False)
    ring = 0.3 * np.column_stack([np.cos(angle), np.sin(angle)])
    turn = pin.exp3(np.array([0.4, -1.0, 0.7]))
    return np.concatenate([np.insert(ring, 2, height, axis=1) for height in heights]) @ turn.T


def sphere(count: int) -> Any:
    at = np.random.default_rng(1).normal(size=(count, 3))
    return at / np.linalg.norm(at, axis=1)[:, None]


@pytest.mark.parametrize(
    "points",
    [
        pytest.param(np.append(circles(300, (0.0,)), [[0.1, 0.5, 0.2]], axis=0), id="cone"),
        pytest.param(
            np.append(circles(20_000, (0.0,)), [[0.1, 0.5, 0.2]], axis=0),
            id="fine cone",
            marks=pytest.mark.exhaustive,
        ),
        pytest.param(circles(1000, (0.0, 1e-3)), id="disc"),
        pytest.param(circles(1500, (0.0, 0.4)), id="cylinder"),
        pytest.param(circles(3000, (0.0,)), id="sheet"),
        pytest.param(trimesh.creation.uv_sphere(0.2, count=[8, 300]).vertices, id="ball"),
        pytest.param(sphere(3000), id="many points"),
        pytest.param(trimesh.creation.box([0.2] * 3).subdivide_loop(4).vertices, id="round box"),
    ],
)
def test_a_hull_is_larger_than_its_points_by_a_known_little(points: Any) -> None:
    hull = convex_hull(points)
    corners, normals = np.array(hull.points()), sphere(200)
    more = (corners @ normals.T).max(axis=0) - (points @ normals.T).max(axis=0)
    size = np.linalg.norm(points - points.mean(axis=0), axis=1).max()
    flat = (
        SHEET_THICKNESS
        if np.linalg.matrix_rank(points - points.mean(axis=0), tol=1e-9) < 3
        else 0.0
    )
    assert more.min() >= -1e-15
    assert more.max() <= MAX_GROWTH * size + flat
    assert max(len(hull.neighbors(i)) for i in range(hull.num_points)) <= MAX_NEIGHBOURS


@pytest.mark.parametrize("edges", [100, 250, 300, 1000, 5000])
def test_distances_of_cones_of_many_edges_are_right(edges: int, tmp_path: Path) -> None:
    """Against the distances of a ball from all triangles, without Coal."""
    mesh = trimesh.creation.cone(0.2, 0.3, sections=edges)
    mesh.export(tmp_path / "cone.ply")
    here, rng, meter = pin.SE3.Identity(), np.random.default_rng(edges), DistanceMeter()
    cone = make_solid(PlacedShape("mesh", (), here, tmp_path / "cone.ply"), here)
    still, ball = np.eye(3), make_solid(PlacedShape("sphere", (0.02,), here), here)
    corners = trimesh.load(tmp_path / "cone.ply", process=False).triangles
    for at in rng.normal(size=(20, 3)) * 0.3 + [0.0, 0.0, 0.15]:
        near = trimesh.triangles.closest_point(corners, np.tile(at, (len(corners), 1)))
        right = float(np.linalg.norm(near - at, axis=1).min()) - 0.02
        if right > DISTANCE_ERROR and np.hypot(at[0], at[1]) > 0.2 * (1 - at[2] / 0.3):
            found = meter.distance(Placed(cone, still, np.zeros(3)), Placed(ball, still, at))
            assert -0.4 * MAX_GROWTH - DISTANCE_ERROR <= found - right <= DISTANCE_ERROR


def test_accepts_fine_disc_and_cone(tmp_path: Path) -> None:
    place = pin.SE3.Identity()
    for mesh in (
        trimesh.creation.cone(1.0, 1.0, 600),
        trimesh.creation.cylinder(1.0, 0.1, 900),
    ):
        mesh.export(tmp_path / "part.stl")
        made = make_solid(PlacedShape("mesh", (), place, tmp_path / "part.stl", exact=True), place)
        assert made.triangles is not None
        assert len(made.triangles) == len(mesh.faces)
