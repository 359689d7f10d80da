"""Distances of meshes and convex shapes, against Coal's and planes; hulls of meshes."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import coal
import numpy as np
import pinocchio as pin
import pytest
import trimesh

import knotwork as kw
from command_line import python
from knotwork.robot.joint_tree import place_joints
from knotwork.scene.building import build_collision_model, build_robot_collision_model
from knotwork.scene.distances import DISTANCE_ERROR, DistanceMeter
from knotwork.scene.hulls import MAX_NEIGHBOURS, SHEET_THICKNESS, make_convex_hull
from knotwork.scene.solid_pairs import SolidPairs
from knotwork.scene.solids import Placed, Solid, make_solid
from knotwork.task.scenario import PlacedShape, load_scenario
from knotwork.task.scenario.scenario_joints import read_scenario_joints
from sweeps import first_of
from urdfs import collision, joint, link, robot

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
HERE = pin.SE3.Identity()


def solid(kind: str, *size: float, **more: Any) -> Solid:
    return make_solid(PlacedShape(kind, size, HERE, **more), HERE)


CONVEX = (
    solid("box", 0.1, 0.05, 0.2),
    solid("sphere", 0.04),
    solid("capsule", 0.04, 0.3),
    solid("cylinder", 0.02, 0.1),
    solid("cone", 0.05, 0.1),
    solid("ellipsoid", 0.02, 0.1, 0.05),
)


def exact(path: Path, name: str) -> Solid:
    MESHES[name].export(path / f"{name}.ply")
    return solid("mesh", path=path / f"{name}.ply", exact=True)


def pieces(placed: Placed) -> list[tuple[Any, Any]]:
    """What a solid is made of, as Coal has it: the boxes of a cloud one by one."""
    cells = placed.solid.cells
    if cells is None:
        return [(placed.solid.geometry, coal.Transform3s(placed.rotation, placed.origin))]
    box = coal.Box(*(3 * [cells.edge]))
    centres = cells.centres @ placed.rotation.T + placed.origin
    return [(box, coal.Transform3s(placed.rotation, centre)) for centre in centres]


def truth(first: Placed, second: Placed) -> float:
    """Distance of the nearest two of all triangles and boxes, without any bound."""
    request = coal.DistanceRequest()
    request.enable_signed_distance, request.gjk_tolerance = True, 1e-8
    pairs = itertools.product(pieces(first), pieces(second))
    return min(float(coal.distance(*a, *b, request, coal.DistanceResult())) for a, b in pairs)


def compare(examined: Solid, others: Sequence[Solid], rounds: int) -> tuple[int, int]:
    """Compare distances at random places with the truth.

    Returns how many of them are neither 0 nor of hulls alone, and how many measurements end at
    their upper bound.
    """
    rng, meter = np.random.default_rng(7), DistanceMeter()
    apart = cut = 0
    for i, other in itertools.product(range(rounds), others):
        first, second = (
            Placed(one, pin.exp3(rng.uniform(-3, 3, 3)), rng.uniform(-0.3, 0.3, 3))
            for one in (examined, other)
        )
        if i % 2:
            first, second = second, first
        right, found, what = truth(first, second), meter.distance(first, second), other.shape.kind
        for most in (-0.1, 0.0, *rng.uniform(0.1, 1.5, 3) * max(right, 0.0)):
            bounded = meter.distance(first, second, most)
            assert bounded <= max(right, 0.0) + DISTANCE_ERROR, what
            assert right <= 0.0 or bounded >= min(right, most) - DISTANCE_ERROR, what
            cut += bounded < right - DISTANCE_ERROR
        if right <= DISTANCE_ERROR:
            assert found <= DISTANCE_ERROR, what
            continue
        assert found == pytest.approx(right, abs=DISTANCE_ERROR), what
        near = meter.nearest(first, second)
        assert math.dist(*near.points) == pytest.approx(right, abs=DISTANCE_ERROR), what
        off = (near.points[0] - near.points[1]) @ near.normal
        assert off == pytest.approx(right, abs=DISTANCE_ERROR), what
        for one, point in zip((second, first), near.points, strict=True):
            ball = Placed(solid("sphere", right / 2), np.eye(3), point)
            assert truth(one, ball) == pytest.approx(right / 2, abs=3 * DISTANCE_ERROR), what
        apart += 1
    return apart, cut


@pytest.mark.parametrize("name", MESHES)
def test_the_distance_of_a_mesh_is_that_of_its_nearest_triangle(name: str, tmp_path: Path) -> None:
    others = *CONVEX, exact(tmp_path, "torus")
    _, cut = compare(exact(tmp_path, name), others, rounds=30)
    assert cut > 10


BOX_AFTER_BOXES = """
import sys
import numpy as np
from knotwork.task.scenario import PlacedShape
from knotwork.scene.distances import DistanceMeter
from knotwork.scene.solids import Placed, make_solid
import pinocchio as pin

def placed(kind, size, turn, origin):
    shape = PlacedShape(kind, size, pin.SE3.Identity(), None, (1.0, 1.0, 1.0))
    return Placed(make_solid(shape, pin.SE3.Identity()), turn, np.array(origin))

meter, turn, box = DistanceMeter(), pin.rpy.rpyToMatrix(0.3, 0.5, 0.7), ("box", (0.2, 0.3, 0.4))
capsule = placed("capsule", (0.1, 0.2), np.eye(3), [-0.9, -0.2, -0.1])
if "box" in sys.argv:
    meter.distance(placed(*box, np.eye(3), [0.9, 0.0, 0.0]), capsule)
print(meter.distance(capsule, placed(*box, turn, [0.0, 0.0, 0.0])).hex())
"""


def test_what_was_measured_before_does_not_change_a_distance() -> None:
    alone, after = (python("-c", BOX_AFTER_BOXES, word, check=True) for word in ("", "box"))
    assert alone.stdout == after.stdout
    assert alone.stdout.startswith("0x1.")


def support(one: Solid, direction: Any) -> float:
    """How far a solid reaches along a direction in its own axes [m]."""
    x, y, z = direction
    size, kind = one.shape.size, one.shape.kind
    if kind == "box":
        return float(np.abs(direction) @ size / 2)
    if kind == "ellipsoid":
        return float(np.linalg.norm(size * direction))
    if kind == "sphere":
        return float(size[0] * np.linalg.norm(direction))
    if kind == "capsule":
        return float(size[0] * np.linalg.norm(direction) + size[1] / 2 * abs(z))
    if kind == "cylinder":
        return float(size[0] * math.hypot(x, y) + size[1] / 2 * abs(z))
    return float(max(size[1] / 2 * z, size[0] * math.hypot(x, y) - size[1] / 2 * z))


def gap(first: Placed, second: Placed, normal: Any) -> float:
    """How far a plane square to a direction keeps two solids apart at least [m]."""
    normal = normal / np.linalg.norm(normal)
    far = support(second.solid, second.rotation.T @ normal) + normal @ second.origin
    return float(normal @ first.origin - support(first.solid, -first.rotation.T @ normal) - far)


def widest(first: Placed, second: Placed, normal: Any, rng: np.random.Generator) -> float:
    """The widest gap that planes with nearly this normal keep between two solids [m]."""
    best, step = gap(first, second, normal), 1e-3
    while step > 1e-12:
        tries = [normal + step * rng.normal(size=3) for _ in range(40)]
        gaps = [gap(first, second, one) for one in tries]
        if max(gaps) > best:
            best, normal = max(gaps), tries[int(np.argmax(gaps))]
        else:
            step /= 2
    return best


def largest_error(count: int, rng: np.random.Generator) -> float:
    """By how much measured distances of random pairs are too large at most [m]."""
    kinds = {"box": 3, "sphere": 1, "cylinder": 2, "cone": 2, "ellipsoid": 3, "capsule": 2}
    meter, worst = DistanceMeter(), 0.0
    for _ in range(count):
        pair = []
        for kind in rng.choice(list(kinds), 2):
            size = np.exp(rng.uniform(np.log(0.003), 0.0, kinds[kind])).tolist()
            turn, origin = pin.exp3(rng.uniform(-3, 3, 3)), rng.normal(size=3) / 10
            pair.append(Placed(solid(str(kind), *size), turn, origin))
        first, second = pair
        toward = rng.normal(size=3)
        toward /= np.linalg.norm(toward)
        apart = np.exp(rng.uniform(np.log(1e-5), 0.0)) - gap(first, second, toward)
        first = first._replace(origin=first.origin + apart * toward)
        found = meter.nearest(first, second)
        error = found.distance - gap(first, second, found.normal)
        if error > DISTANCE_ERROR / 10:
            error = found.distance - widest(first, second, found.normal, rng)
        worst = max(worst, error)
    return worst


@pytest.mark.parametrize(("pairs", "seed"), first_of((1000, 3), (50_000, 4)))
def test_distances_of_convex_shapes_are_right(pairs: int, seed: int) -> None:
    assert 0.0 < largest_error(pairs, np.random.default_rng(seed)) < DISTANCE_ERROR / 4


@pytest.mark.parametrize("name", ["ur5_deburring", "ur10_spray"])
def test_bounds_by_boxes_are_lower_bounds(name: str) -> None:
    scenario = load_scenario(name)
    robot = read_scenario_joints(scenario).robot
    pairs = SolidPairs(build_collision_model(scenario, robot))
    q = np.random.default_rng(4).uniform(-2.5, 2.5, (4, robot.dof))
    turn, shift = pairs.placements(*place_joints(pairs.model.tree, q))
    item, combo = (x.ravel() for x in np.indices((len(q), len(pairs.first))))
    bounds = pairs.min_distances(item, combo, turn, shift)
    for i, c, bound in zip(item, combo, bounds, strict=True):
        assert bound <= max(pairs.measure(c, turn[i], shift[i])[0], 0.0) + DISTANCE_ERROR


MAX_GROWTH = 4e-4
"""Maximum growth of a hull, relative to the largest distance of a point from the middle."""

URDF = robot(link("a"), link("b", collision('<mesh filename="part.stl"/>')), joint("j", "a", "b"))


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
    hull = make_convex_hull(points)
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
    rng, meter = np.random.default_rng(edges), DistanceMeter()
    cone, ball = solid("mesh", path=tmp_path / "cone.ply"), solid("sphere", 0.02)
    still = np.eye(3)
    corners = trimesh.load(tmp_path / "cone.ply", process=False).triangles
    for at in rng.normal(size=(20, 3)) * 0.3 + [0.0, 0.0, 0.15]:
        near = trimesh.triangles.closest_point(corners, np.tile(at, (len(corners), 1)))
        right = float(np.linalg.norm(near - at, axis=1).min()) - 0.02
        if right > DISTANCE_ERROR and np.hypot(at[0], at[1]) > 0.2 * (1 - at[2] / 0.3):
            found = meter.distance(Placed(cone, still, np.zeros(3)), Placed(ball, still, at))
            assert -0.4 * MAX_GROWTH - DISTANCE_ERROR <= found - right <= DISTANCE_ERROR


def test_accepts_fine_disc_and_cone(tmp_path: Path) -> None:
    for mesh in (
        trimesh.creation.cone(1.0, 1.0, 600),
        trimesh.creation.cylinder(1.0, 0.1, 900),
    ):
        mesh.export(tmp_path / "part.stl")
        part = solid("mesh", path=tmp_path / "part.stl", exact=True)
        assert len(part.triangles) == len(mesh.faces)
