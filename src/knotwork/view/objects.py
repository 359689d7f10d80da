"""Surroundings, tool and held objects as meshes; collision shapes; nearest points."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from knotwork.robot import Robot
from knotwork.scenario import PlacedShape
from knotwork.scene.cells import read_cells
from knotwork.scene.meshes.mesh_files import read_mesh
from knotwork.verification import Finding, Report
from knotwork.view.mesh import Mesh, box_corners, drawable, from_triangles, merged
from knotwork.view.packing import label, thing
from knotwork.view.primitive_meshes import box, frame_along, rod, solid, sphere, turned
from knotwork.view.shown import Shown
from knotwork.waypoints import FloatArray

MOST_DRAWN = 10_000
"""Largest number of drawn cells; above it, larger cells are drawn."""


def cloud_mesh(shape: PlacedShape, path: Path, colour: Sequence[float]) -> Mesh:
    """Draw the outer sides of a cloud's cells, in its own axes.

    Raises:
        InputError: The file can't be read.
    """
    from trimesh import creation

    changed = path.stat().st_mtime_ns
    cells = read_cells(path, changed, shape.scale[0], shape.resolution)
    while len(cells.index) > MOST_DRAWN:
        cells = cells.coarser()
    cube = creation.box(bounds=[[0, 0, 0], [1, 1, 1]])
    taken = set(map(tuple, cells.index.tolist()))
    sides = []
    for side in cube.facets:  # two triangles each
        outwards = np.round(cube.face_normals[side[0]]).astype(np.int64)
        neighbours = map(tuple, (cells.index + outwards).tolist())
        bare = cells.index[[one not in taken for one in neighbours]]
        sides.append(bare[:, np.newaxis, np.newaxis, np.newaxis] + cube.triangles[side])
    return from_triangles(np.concatenate(sides).reshape(-1, 3, 3) * cells.edge, colour)


OBJECT = (0.76, 0.70, 0.58, 1.0)
PLANE = (0.80, 0.80, 0.77, 1.0)
TOOL = (0.33, 0.37, 0.42, 1.0)
HELD = (0.88, 0.62, 0.22, 1.0)
HULL = (0.20, 0.55, 0.85, 0.45)
NEAREST = (0.10, 0.55, 0.30, 1.0)

OBJECTS, COLLISION_SHAPES, CLOSEST = "objects", "collision shapes", "closest"


@dataclass(frozen=True, eq=False)
class Objects:
    """The drawn surroundings of a scene.

    Attributes:
        things: Data for the page.
        labels: Labels of objects and of the nearest points.
        points: Points that must be in view [m], shape (n, 3).
        warnings: Parts that can't be drawn as described.
    """

    things: list[dict[str, Any]]
    labels: list[dict[str, Any]]
    points: FloatArray
    warnings: tuple[str, ...]


def shape_mesh(shape: PlacedShape, colour: Sequence[float], extent: float) -> Mesh:
    """A shape as a mesh, in the axes of its placement.

    Args:
        shape: The shape.
        colour: Red, green, blue and opacity.
        extent: Size of drawn half spaces [m].

    Raises:
        InputError: A file can't be read.
    """
    if shape.kind == "half_space":
        normal, offset = np.array(shape.size[:3]), shape.size[3]
        thin = 0.004 * extent
        made = box([2 * extent, 2 * extent, thin], colour)
        made = made.moved(frame_along(normal), (offset - thin / 2) * normal)
    elif shape.path is not None and shape.kind == "points":
        made = cloud_mesh(shape, shape.path, colour)
    elif shape.path is not None:
        parts = [drawable(part) for part in read_mesh(shape.path)]
        own = [one if one.coloured or one.fault else one.painted(colour) for one in parts]
        made = merged(own)
        made = made.scaled(shape.scale)
    elif shape.kind == "ellipsoid":
        made = sphere(1.0, colour).scaled(shape.size)
    elif shape.kind == "cone":
        radius, half = shape.size[0], shape.size[1] / 2
        made = turned([[0, -half], [radius, -half], [0, half]], colour)
    else:
        made = solid(shape.kind, shape.size, colour)
    return made.placed(shape.placement)


def scene_objects(shown: Shown, size: float) -> Objects:
    """Draw a scenario's scene: objects, tool, held objects, and the nearest points."""
    things: list[dict[str, Any]] = []
    labels: list[dict[str, Any]] = []
    drawn: list[tuple[str, Mesh]] = []
    points = [np.zeros((0, 3))]
    times = {waypoint.name: waypoint.time for waypoint in shown.scenario.waypoints}
    for one in shown.scenario.scene.objects:
        between = None if one.appears is None else [times[one.appears], None]
        plane = one.shape.kind == "half_space"
        carrier, placement = shown.carrying(one.carrier)
        mesh = shape_mesh(one.shape, PLANE if plane else OBJECT, size).placed(placement)
        own: dict[str, Any] = {"carrier": carrier, "between": between, "of": one.name}
        things.append(thing(OBJECTS, mesh, around=True, **own))
        drawn.append((f"object {one.name!r}", mesh))
        if plane:
            continue
        middle = mesh.vertices.mean(axis=0)
        labels.append(label(one.name, "object", middle, f"object {one.name!r}", carrier))
        if carrier is not None:
            continue
        corners = box_corners(mesh.vertices)
        if np.ptp(corners, axis=0).max() <= size:
            points.append(corners)
    for name, mesh, parts in _carried(shown, times, size):
        things += parts
        drawn.append((name, mesh))
    things += _hulls(shown.robot)
    if shown.report is not None:
        line, distance = _closest(shown.report, shown, size)
        things, labels = things + line, labels + distance
    faults = tuple(f"{name}: {mesh.fault}" for name, mesh in drawn if mesh.fault)
    return Objects(things, labels, np.concatenate(points), faults)


def _carried(
    shown: Shown, times: Mapping[str, float], size: float
) -> Iterator[tuple[str, Mesh, list[dict[str, Any]]]]:
    """The tool's shapes, and held objects: before they are taken, carried, and released."""
    robot, curve, scene = shown.robot, shown.curve, shown.scenario.scene
    frames = robot.model.frames
    if robot.tool_frame is None or not (scene.tool or scene.held):
        return
    frame = frames[robot.require_tool()]
    joint = int(frame.parentJoint)
    mount = frames[robot.frame_index(robot.tool_frame)].placement
    for shape in scene.tool:
        mesh = shape_mesh(shape, TOOL, size).placed(mount)
        yield "tool", mesh, [thing("tool shape", mesh, carrier=joint, of="tool")]
    for held in scene.held:
        mesh = shape_mesh(held.shape, HELD, size)
        taken, left = np.clip([times[held.take], times[held.leave]], *curve.x[[0, -1]]).tolist()
        appears = None if held.appears is None else times[held.appears]
        carried = mesh.placed(frame.placement)
        parts = [thing("held", carried, carrier=joint, between=[taken, left], of=held.name)]
        for at, frame_there, between in zip(
            (taken, left), held.carriers, ([appears, taken], [left, None]), strict=True
        ):
            rider, placement = shown.carrying(frame_there, at)
            lying = mesh.placed(placement * robot.forward(curve(at)))
            parts.append(thing("held", lying, carrier=rider, between=between, of=held.name))
        yield f"object {held.name!r}", mesh, parts


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
    report: Report, shown: Shown, size: float
) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """The line between the nearest points, and its label; empty if bodies are too close.

    Pairs with an object have priority.
    """
    base, names = shown.robot.base_placement, [one.name for one in shown.scenario.scene.objects]
    pairs = [found for found in report.select(subject="pair") if len(found.points) == 2]
    if not pairs or not all(found.ok for found in pairs):
        return [], []

    def rank(found: Finding) -> tuple[bool, bool, float]:
        ends = (f"{name}, " for name in names), (f", {name}" for name in names)
        around = found.name.startswith(tuple(ends[0])) or found.name.endswith(tuple(ends[1]))
        return found.detail, not around, found.value or 0.0

    nearest = min(pairs, key=rank)
    first, second = (base.act(np.array(point)) for point in nearest.points)
    distance = report.units.text(nearest.value or 0.0, "m", ".3g")
    text = f"{nearest.name}: {distance} at {nearest.time or 0.0:.2f} s"
    labels = [label(text, "closest", (first + second) / 2, nearest.message)]
    if np.linalg.norm(first - second) <= 1e-6:
        return [], labels
    dots = [sphere(0.006 * size, NEAREST).moved(np.eye(3), end) for end in (first, second)]
    mesh = merged([rod(first, second, 0.003 * size, NEAREST), *dots])
    return [thing(CLOSEST, mesh, lit=False)], labels
