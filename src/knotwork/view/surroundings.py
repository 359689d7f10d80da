"""Surroundings, tool, held objects and collision shapes in a scene."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from knotwork.robot import Robot
from knotwork.robot.joint_tree import frame_along
from knotwork.scene.cells import read_cells
from knotwork.scene.meshes.mesh_files import read_mesh
from knotwork.task.scenario import PlacedShape
from knotwork.view.mesh import Mesh, box_corners, drawable, from_triangles, merge_meshes
from knotwork.view.primitive_meshes import solid, sphere
from knotwork.view.scene_parts import SceneParts
from knotwork.view.shown_motion import ShownMotion

MAX_DRAWN = 10_000
"""Maximum number of drawn cells; if there are more, larger cells are drawn."""
OBJECT_COLOUR = (0.76, 0.70, 0.58, 1.0)
PLANE_COLOUR = (0.80, 0.80, 0.77, 1.0)
TOOL_COLOUR = (0.33, 0.37, 0.42, 1.0)
HELD_COLOUR = (0.88, 0.62, 0.22, 1.0)
HULL_COLOUR = (0.20, 0.55, 0.85, 0.45)


def cloud_mesh(shape: PlacedShape, path: Path, colour: Sequence[float]) -> Mesh:
    """Draw the outer sides of a cloud's cells, in its own axes.

    Raises:
        InputError: The file can't be read.
    """
    from trimesh import creation

    changed = path.stat().st_mtime_ns
    cells = read_cells(path, changed, shape.scale[0], shape.resolution, shape.units)
    while len(cells.index) > MAX_DRAWN:
        cells = cells.coarser()
    cube = creation.box(bounds=[[0, 0, 0], [1, 1, 1]])
    occupied = set(map(tuple, cells.index.tolist()))
    sides = []
    for side in cube.facets:  # two triangles each
        outwards = np.round(cube.face_normals[side[0]]).astype(np.int64)
        neighbours = map(tuple, (cells.index + outwards).tolist())
        bare = cells.index[[cell not in occupied for cell in neighbours]]
        sides.append(bare[:, np.newaxis, np.newaxis, np.newaxis] + cube.triangles[side])
    return from_triangles(np.concatenate(sides).reshape(-1, 3, 3) * cells.edge, colour)


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
        plate = solid("box", [2 * extent, 2 * extent, thin], colour)
        mesh = plate.move(frame_along(normal), (offset - thin / 2) * normal)
    elif shape.path is not None and shape.kind == "points":
        mesh = cloud_mesh(shape, shape.path, colour)
    elif shape.path is not None:
        parts = [drawable(part, colour) for part in read_mesh(shape.path)]
        mesh = merge_meshes(parts).scale(shape.scale)
    elif shape.kind == "ellipsoid":
        mesh = sphere(1.0, colour).scale(shape.size)
    else:
        mesh = solid(shape.kind, shape.size, colour)
    return mesh.place(shape.placement)


def draw_surroundings(parts: SceneParts, shown: ShownMotion, size: float) -> None:
    """Draw a scenario's scene: objects, tool and held objects."""
    times = [waypoint.time for waypoint in shown.scenario.waypoints]
    for item in shown.scenario.scene.objects:
        between = None if item.appears is None else [times[item.appears], None]
        plane = item.shape.kind == "half_space"
        carrier, placement = shown.carrier_of(item.frame)
        mesh = shape_mesh(item.shape, PLANE_COLOUR if plane else OBJECT_COLOUR, size).place(
            placement
        )
        parts.draw("objects", mesh, around=True, carrier=carrier, between=between, of=item.name)
        if plane:
            continue
        middle = mesh.vertices.mean(axis=0)
        parts.write(item.name, "object", middle, f"object {item.name!r}", carrier=carrier)
        corners = box_corners(mesh.vertices)
        if carrier is None and np.ptp(corners, axis=0).max() <= size:
            parts.corners.append(corners)
    _draw_carried(parts, shown, times, size)
    _draw_hulls(parts, shown.robot)


def _draw_carried(
    parts: SceneParts, shown: ShownMotion, times: Sequence[float], size: float
) -> None:
    """Draw the tool's shapes, and held objects: before they are taken, carried, and released."""
    robot, curve, scene = shown.robot, shown.curve, shown.scenario.scene
    frames = robot.model.frames
    if robot.tool_frame is None or not (scene.tool or scene.held):
        return
    frame = frames[robot.require_tool()]
    joint = int(frame.parentJoint)
    mount = frames[robot.link_index(robot.tool_frame)].placement
    for shape in scene.tool:
        mesh = shape_mesh(shape, TOOL_COLOUR, size).place(mount)
        parts.draw("tool shape", mesh, carrier=joint, of="tool")
    for held in scene.held:
        mesh = shape_mesh(held.shape, HELD_COLOUR, size)
        span = [times[held.taken_at], times[held.released_at]]
        taken, released = np.clip(span, *curve.x[[0, -1]]).tolist()
        appears = None if held.appears is None else times[held.appears]
        in_tool = mesh.place(frame.placement)
        parts.draw("held", in_tool, carrier=joint, between=[taken, released], of=held.name)
        spans = [appears, taken], [released, None]
        ends = (held.taken_at, taken), (held.released_at, released)
        for (waypoint, time), lies_in, between in zip(ends, held.end_frames, spans, strict=True):
            carrier, placement = shown.carrier_of(lies_in, time)
            in_world = shown.scenario.waypoints[waypoint].in_world_frame
            tool = robot.tool_pose(curve(time), in_world_frame=in_world)
            lying = mesh.place(placement * tool)
            parts.draw("held", lying, carrier=carrier, between=between, of=held.name)


def _draw_hulls(parts: SceneParts, robot: Robot) -> None:
    """Draw the collision shapes of the links, shown on demand."""
    from knotwork.scene.building import build_robot_collision_model

    by_joint: dict[int, list[Mesh]] = {}
    for body in build_robot_collision_model(robot).bodies:
        meshes = [
            solid_mesh(part, HULL_COLOUR, 0.0)
            if part.hull is None
            else from_triangles(part.hull, HULL_COLOUR).move(part.rotation, part.translation)
            for part in body.solids
        ]
        by_joint.setdefault(body.joint, []).extend(meshes)
    for joint, meshes in by_joint.items():
        parts.draw("collision shapes", merge_meshes(meshes), carrier=joint or None, hidden=True)


def solid_mesh(part: Any, colour: Sequence[float], extent: float) -> Mesh:
    """The shape of a body's part, in the body's axes; `colour` and `extent` as for `shape_mesh`."""
    at_origin = replace(part.shape, placement=pin.SE3.Identity())
    return shape_mesh(at_origin, colour, extent).move(part.rotation, part.translation)
