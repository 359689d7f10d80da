"""Surroundings, tool and held objects as meshes; collision shapes; nearest points."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pinocchio as pin

from knotwork.errors import InputError
from knotwork.meshes.mesh_files import read_mesh
from knotwork.polynomial import PiecewisePolynomial
from knotwork.robot import Robot
from knotwork.scenario import Scenario, Shape
from knotwork.scene.cells import read_cells
from knotwork.verification import Report
from knotwork.view.mesh import Mesh, drawable, from_triangles, merged
from knotwork.view.packing import label, thing
from knotwork.view.primitive_meshes import box, frame_along, rod, solid, sphere, turned
from knotwork.waypoints import FloatArray

MOST_DRAWN = 10_000
"""Cells that are drawn; of more, larger ones that hold them."""


def cloud_mesh(shape: Shape, colour: Sequence[float]) -> Mesh:
    """Draw the sides of a cloud's cells that no other cell covers, in its own axes.

    Raises:
        InputError: The file can't be read.
    """
    if shape.path is None:
        raise InputError("a point cloud needs a file")
    changed = shape.path.stat().st_mtime_ns
    cells = read_cells(shape.path, changed, shape.scale[0], shape.resolution)
    while len(cells.index) > MOST_DRAWN:
        cells = cells.coarser()
    taken = set(map(tuple, cells.index.tolist()))
    quads = []
    for axis in range(3):
        across, up = np.eye(3)[axis - 2], np.eye(3)[axis - 1]
        for side in (0, 1):
            step = np.eye(3, dtype=np.int64)[axis] * (2 * side - 1)
            neighbours = map(tuple, (cells.index + step).tolist())
            bare = np.array([one not in taken for one in neighbours])
            corner = cells.index[bare] + side * np.eye(3)[axis]
            ring = [corner, corner + across, corner + across + up, corner + up]
            quads.append(np.stack(ring if side else ring[::-1], axis=1))
    corners = np.concatenate(quads) * cells.edge
    triangles = np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])
    return from_triangles(triangles, colour)


OBJECT = (0.76, 0.70, 0.58, 1.0)
PLANE = (0.80, 0.80, 0.77, 1.0)
TOOL = (0.33, 0.37, 0.42, 1.0)
HELD = (0.88, 0.62, 0.22, 1.0)
HULL = (0.20, 0.55, 0.85, 0.45)
NEAREST = (0.10, 0.55, 0.30, 1.0)

OBJECTS, COLLISION_SHAPES, CLOSEST = "objects", "collision shapes", "closest"


@dataclass(frozen=True, eq=False)
class Objects:
    """The surroundings in a scene.

    Attributes:
        things: As the page has them.
        labels: Of objects and of the nearest points.
        points: Places that must be in view [m], shape (n, 3).
        warnings: Parts that can't be drawn as described.
    """

    things: list[dict[str, Any]]
    labels: list[dict[str, Any]]
    points: FloatArray
    warnings: tuple[str, ...]


def shape_mesh(shape: Shape, colour: Sequence[float], extent: float) -> Mesh:
    """A shape as a mesh, in the axes that it is placed in.

    Args:
        shape: The shape.
        colour: Red, green, blue and opacity.
        extent: How far half spaces are drawn [m].

    Raises:
        InputError: A file can't be read.
    """
    if shape.kind == "half_space":
        normal, offset = np.array(shape.size[:3]), shape.size[3]
        thin = 0.004 * extent
        made = box([2 * extent, 2 * extent, thin], colour)
        made = made.moved(frame_along(normal), (offset - thin / 2) * normal)
    elif shape.kind == "points":
        made = cloud_mesh(shape, colour)
    elif shape.path is not None:
        parts = [drawable(part) for part in read_mesh(shape.path)]
        made = merged([part if part.coloured else part.painted(colour) for part in parts])
        made = made.scaled(shape.scale)
    elif shape.kind == "ellipsoid":
        made = sphere(1.0, colour).scaled(shape.size)
    elif shape.kind == "cone":
        radius, half = shape.size[0], shape.size[1] / 2
        made = turned([[0, -half], [radius, -half], [0, half]], colour)
    else:
        made = solid(shape.kind, shape.size, colour)
    return made.placed(shape.placement)


def scene_objects(
    scenario: Scenario | None,
    robot: Robot,
    curve: PiecewisePolynomial,
    report: Report | None,
    size: float,
) -> Objects:
    """Draw a scenario's scene: objects, tool, held objects, and the nearest points.

    Args:
        scenario: The task.
        robot: Its robot.
        curve: Joint positions, trailing shape (d,).
        report: Of the check.
        size: Of the scene [m].
    """
    things: list[dict[str, Any]] = []
    labels: list[dict[str, Any]] = []
    points = [np.zeros((0, 3))]
    base = robot.base_placement
    for one in scenario.scene.objects if scenario is not None else ():
        plane = one.shape.kind == "half_space"
        mesh = shape_mesh(one.shape, PLANE if plane else OBJECT, size).placed(base)
        things.append(thing(OBJECTS, mesh, around=True))
        if plane:
            continue
        middle, detail = mesh.vertices.mean(axis=0), f"object {one.name!r}"
        labels.append(label(one.name, "object", middle, detail))
        corners = np.array([mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)])
        if np.ptp(corners, axis=0).max() <= size:
            points.append(corners)
    if scenario is not None:
        things += _carried(scenario, robot, curve, size)
    things += _hulls(robot)
    if report is not None:
        line, distance = _closest(report, {one["text"] for one in labels}, base, size)
        things, labels = things + line, labels + distance
    warnings = () if scenario is None else tuple(_lost_images(scenario))
    return Objects(things, labels, np.concatenate(points), warnings)


def _lost_images(scenario: Scenario) -> Iterator[str]:
    """Images named in the scene's meshes that can't colour them."""
    scene = scenario.scene
    named = [(f"object {one.name!r}", one.shape) for one in scene.objects]
    named += [(f"object {one.name!r}", one.shape) for one in scene.held]
    for what, shape in (*named, *(("tool", shape) for shape in scene.tool)):
        mesh = shape.path if shape.kind == "mesh" else None
        parts = read_mesh(mesh) if mesh is not None else ()
        faults = dict.fromkeys(part.fault for part in parts if part.fault)
        if faults:
            yield f"{what}: {'; '.join(faults)}"


def _carried(
    scenario: Scenario, robot: Robot, curve: PiecewisePolynomial, size: float
) -> list[dict[str, Any]]:
    """The tool's shapes, and held objects: before they are taken, carried, and left."""
    things = []
    scene, model = scenario.scene, robot.model
    if scene.tool and robot.tool_frame is not None:
        frame = model.frames[robot.frame_index(robot.tool_frame)]
        for shape in scene.tool:
            mesh = shape_mesh(shape, TOOL, size).placed(frame.placement)
            things.append(thing("tool shape", mesh, carrier=int(frame.parentJoint)))
    times = {waypoint.name: waypoint.time for waypoint in scenario.waypoints}
    for held in scene.held:
        frame = model.frames[robot.require_tool()]
        mesh = shape_mesh(held.shape, HELD, size)
        start, end = (
            float(np.clip(times[name], curve.x[0], curve.x[-1])) for name in (held.take, held.leave)
        )
        carried = mesh.placed(frame.placement)
        things.append(thing("held", carried, carrier=int(frame.parentJoint), between=[start, end]))
        for time, between in ((start, [None, start]), (end, [end, None])):
            stands = mesh.placed(robot.base_placement * robot.forward(curve(time)))
            things.append(thing("held", stands, between=between))
    return things


def _hulls(robot: Robot) -> list[dict[str, Any]]:
    """The collision shapes of the links, shown on demand."""
    from knotwork.scene.building import robot_collision_model

    by_joint: dict[int, list[Mesh]] = {}
    for body in robot_collision_model(robot).bodies:
        for part in body.solids:
            if part.hull is not None:
                mesh = from_triangles(part.hull, HULL)
            else:
                mesh = shape_mesh(replace(part.shape, placement=pin.SE3.Identity()), HULL, 0.0)
            moved = mesh.moved(part.rotation, part.translation)
            by_joint.setdefault(body.joint, []).append(moved)
    return [
        thing(COLLISION_SHAPES, merged(meshes), carrier=joint or None, hidden=True)
        for joint, meshes in by_joint.items()
    ]


def _closest(
    report: Report, objects: set[str], base: pin.SE3, size: float
) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """The line between the nearest points, and its label; nothing where bodies are too near.

    Pairs with an object come first.
    """
    pairs = [found for found in report.select(subject="pair") if len(found.points) == 2]
    around = [found for found in pairs if not found.detail]
    if not around or not all(found.ok for found in pairs):
        return [], []
    outside = [found for found in around if objects & set(found.name.split(", "))]
    nearest = min(outside or around, key=lambda found: found.value or 0.0)
    first, second = (base.act(np.array(point)) for point in nearest.points)
    distance = report.units.text(nearest.value or 0.0, "m", ".3g")
    text = f"{nearest.name}: {distance} at {nearest.time or 0.0:.2f} s"
    labels = [label(text, "closest", (first + second) / 2, nearest.message)]
    if np.linalg.norm(first - second) <= 1e-6:
        return [], labels
    dots = [sphere(0.006 * size, NEAREST).moved(np.eye(3), end) for end in (first, second)]
    mesh = merged([rod(first, second, 0.003 * size, NEAREST), *dots])
    return [thing(CLOSEST, mesh, lit=False)], labels
