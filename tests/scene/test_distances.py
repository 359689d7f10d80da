"""Distances of meshes that are taken as they are, against Coal's over all their triangles."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import coal
import numpy as np
import pinocchio as pin
import pytest
import trimesh

from knotwork.scenario import Shape
from knotwork.scene.distances import ROUNDING, DistanceMeter
from knotwork.scene.solids import Placed, Solid, solid

MESHES = {
    "sphere": trimesh.creation.icosphere(subdivisions=3, radius=0.1),
    "torus": trimesh.creation.torus(0.2, 0.03),
    "two": trimesh.util.concatenate(
        [
            trimesh.creation.box([0.1, 0.2, 0.05]).apply_translation([0.2, 0, 0]),
            trimesh.creation.cone(0.05, 0.2),
        ]
    ),
}
CONVEX = [
    ("box", (0.1, 0.05, 0.2)),
    ("capsule", (0.04, 0.3)),
    ("cylinder", (0.02, 0.1)),
    ("ellipsoid", (0.05, 0.1, 0.02)),
]


def exact(path: Path, name: str) -> Solid:
    MESHES[name].export(path / f"{name}.ply")
    place = pin.SE3.Identity()
    return solid(Shape("mesh", (), place, path / f"{name}.ply", exact=True), place)


def somewhere(one: Solid, rng: np.random.Generator, reach: float) -> Placed:
    return Placed(one, pin.exp3(rng.uniform(-3, 3, 3)), rng.uniform(-reach, reach, 3))


def truth(first: Placed, second: Placed) -> float:
    """Distance of all triangles, without any bound."""
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    request.enable_signed_distance, request.gjk_tolerance = True, 1e-8
    places: list[Any] = [coal.Transform3s(one.rotation, one.origin) for one in (first, second)]
    return float(
        coal.distance(
            first.solid.geometry, places[0], second.solid.geometry, places[1], request, result
        )
    )


@pytest.mark.parametrize("name", MESHES)
def test_the_distance_of_a_mesh_is_that_of_its_nearest_triangle(name: str, tmp_path: Path) -> None:
    rng, meter, mesh = np.random.default_rng(7), DistanceMeter(), exact(tmp_path, name)
    others = [solid(Shape(*one, pin.SE3.Identity()), pin.SE3.Identity()) for one in CONVEX]
    others.append(exact(tmp_path, "torus"))
    cut = 0
    for i in range(120):
        pair = somewhere(mesh, rng, 0.3), somewhere(others[i % len(others)], rng, 0.3)
        if i % 2:
            pair = pair[::-1]
        right = truth(*pair)
        found = meter.distance(*pair)
        if right <= ROUNDING:
            assert found <= ROUNDING
        else:
            assert found == pytest.approx(right, abs=ROUNDING)
            near = meter.nearest(*pair)
            assert math.dist(*near.points) == pytest.approx(right, abs=ROUNDING)
        for most in (-0.1, 0.0, *rng.uniform(0.1, 1.5, 3) * max(right, 0.0)):
            found = meter.distance(*pair, most)
            assert found <= max(right, 0.0) + ROUNDING
            assert found >= min(right, most) - ROUNDING
            cut += found < right - ROUNDING
    assert cut > 10
