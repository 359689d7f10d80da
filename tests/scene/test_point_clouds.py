"""Distances of point clouds, against boxes at each of their cells; clouds that are refused."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from test_distances import CONVEX, compare, solid

from command_line import Command
from drawn import beside_an_arm, scene, thing, vertices, volume
from knotwork.errors import InputError
from knotwork.scene.containment import is_one_inside_other
from knotwork.scene.solids import Placed, Solid
from sweeps import first_of

EDGE = 0.03


def cloud(path: Path, points: Any, edge: float = EDGE) -> Solid:
    rows = [f"{x!r},{y!r},{z!r}" for x, y, z in np.asarray(points, dtype=float).tolist()]
    path.write_text("\n".join(["x,y,z", *rows]))
    return solid("points", path=path, resolution=edge)


def others(folder: Path) -> list[Solid]:
    """One solid of every kind that Coal tells from others, a cloud too."""
    trimesh.creation.icosphere(subdivisions=1, radius=0.05).export(folder / "ball.stl")
    return [
        *CONVEX,
        *(solid("mesh", path=folder / "ball.stl", exact=exact) for exact in (False, True)),
        solid("half_space", 0.0, 0.6, 0.8, -0.3),
        cloud(folder / "other.csv", [(0, 0, 0), (0.04, 0, 0), (0.1, 0.1, 0.1)], 0.02),
    ]


@pytest.mark.parametrize(
    ("rounds", "points", "apart"),
    first_of((4, 40, 15), (300, 150, 1000)),
)
def test_cloud_is_as_far_as_a_cell(rounds: int, points: int, apart: int, tmp_path: Path) -> None:
    places = np.random.default_rng(5).uniform(-0.3, 0.3, (points, 3))
    scanned = cloud(tmp_path / "cloud.csv", places)
    assert compare(scanned, others(tmp_path), rounds)[0] >= apart


def test_every_point_is_in_a_cell_and_every_cell_in_hull_and_box(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    points = rng.normal(0.0, 0.1, (300, 3))
    one = cloud(tmp_path / "cloud.csv", points)
    off = np.abs(points[:, None] - one.cells.centres).max(axis=2).min(axis=1)
    assert off.max() <= EDGE / 2 + 1e-12
    cubes = np.array(one.geometry.toBoxes())[:, :3]
    assert sorted(cubes.round(9).tolist()) == sorted(one.cells.centres.round(9).tolist())
    halves = EDGE / 2 * np.array([*itertools.product((-1, 1), repeat=3)])
    corners = (one.cells.centres[:, None] + halves).reshape(-1, 3)
    assert (corners >= one.corners.min(axis=0) - 1e-12).all()
    assert (corners <= one.corners.max(axis=0) + 1e-12).all()
    directions = rng.normal(size=(200, 3))
    assert (directions @ one.cells.outermost.T).max(axis=1) == pytest.approx(
        (directions @ corners.T).max(axis=1), abs=1e-12
    )
    coarse = one.cells.coarser()
    assert (np.abs(corners[:, None] - coarse.centres).max(axis=2).min(axis=1) <= EDGE + 1e-9).all()


def test_a_part_of_a_cloud_inside_a_closed_mesh_is_found(tmp_path: Path) -> None:
    trimesh.creation.box([0.5, 0.5, 0.5]).export(tmp_path / "box.stl")
    box = solid("mesh", path=tmp_path / "box.stl", exact=True)
    two = cloud(tmp_path / "two.csv", [(1, 1, 1), (1.02, 1.02, 1.02), (0.1, 0.1, 0.1)])
    assert len(two.cells.point_of_each_part) == 2
    still, nothing = np.eye(3), np.zeros(3)
    assert is_one_inside_other(Placed(box, still, nothing), Placed(two, still, nothing))
    assert not is_one_inside_other(Placed(box, still, nothing), Placed(two, still, np.ones(3)))


def test_refuses_too_many_cells(tmp_path: Path) -> None:
    points = np.insert(np.mgrid[0:400, 0:400], 2, 0, axis=0).reshape(3, -1).T
    with pytest.raises(InputError, match=r"fills 160000 cells of 0\.03 m, and at most 100000 are"):
        cloud(tmp_path / "many.csv", EDGE * (points + 0.5))


def test_detects_cloud_in_path_and_free_space_next_to_it(knotwork: Command, tmp_path: Path) -> None:
    grid = np.mgrid[-30:30:8, -30:30:8].reshape(2, -1).T
    points = np.column_stack([grid, np.zeros(len(grid))])
    trimesh.PointCloud(points).export(tmp_path / "sheet.ply")
    for height, code in ((295, 1), (280, 0)):
        (tmp_path / "task.yaml").write_text(
            "units: {length: mm, angle: deg}\nrobot: ur5\n"
            "tool: {offset: {position: [0, 0, 100], rpy: [0, 0, 0]},"
            " shape: {ellipsoid: [10, 20, 50], position: [0, 0, 50]}}\n"
            "scene: {objects: {sheet: {points: {file: sheet.ply, resolution: 10},"
            f" position: [450, 50, {height}]}}}}}}\n"
            "waypoints:\n"
            "- {name: a, pose: {position: [450, 0, 300], rpy: [180, 0, 0]}, stop: true}\n"
            "- {name: b, after: 2, pose: {position: [450, 100, 300], rpy: [180, 0, 0]}}\n"
        )
        ran = knotwork("plan", tmp_path / "task.yaml")
        assert ran.code == code, ran.out + ran.err
        assert "sheet" in ran.out
    assert "tool, sheet clearance 10.0" in ran.out  # cells reach from 280 to 290 mm, the tip to 300


def test_drawn_cells_are_checked_or_larger(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    grid = np.mgrid[-3:3, -3:3, -3:3].reshape(3, -1).T * EDGE + EDGE / 2
    cloud(tmp_path / "cloud.csv", [*grid, (9 * EDGE + 0.001, 0.001, 0.001)])
    points = {"file": str(tmp_path / "cloud.csv"), "resolution": EDGE}
    for most, edge, cells in ((217, EDGE, 217), (216, 2 * EDGE, 8 * 65)):
        monkeypatch.setattr("knotwork.view.surroundings.MAX_DRAWN", most)
        mesh = thing(scene(beside_an_arm({"points": points})), "objects")
        assert volume(mesh) == pytest.approx(cells * EDGE**3, rel=1e-4)
        assert vertices(mesh)[:, 0].min() == pytest.approx(-(4 if edge > EDGE else 3) * EDGE)
