"""Bodies of a robot's links, from the collision shapes of its URDFs."""

from __future__ import annotations

from typing import NamedTuple

import pinocchio as pin

from knotwork.errors import InputError
from knotwork.robot import Robot
from knotwork.robot.urdf_shapes import UrdfShapes
from knotwork.scene.bodies import Body
from knotwork.scene.meshes.locating import find_mesh
from knotwork.scene.solids import make_solid
from knotwork.task.scenario import PlacedShape


class LinkBodies(NamedTuple):
    """Bodies of the links of a robot that have collision shapes.

    Attributes:
        bodies: A body for each such link.
        missing_notes: Sentences on links whose shapes are not available.
        bare: Names of links with visual shapes but no collision shapes.
    """

    bodies: tuple[Body, ...]
    missing_notes: tuple[str, ...]
    bare: tuple[str, ...]


def read_link_bodies(robot: Robot) -> LinkBodies:
    """Read the bodies of a robot's links.

    Raises:
        InputError: A mesh file exists, but can't be read whole.
    """
    urdf_shapes = UrdfShapes(robot.urdf_files)
    bodies, missing_notes, bare = [], [], []
    for frame in robot.model.frames:
        link = str(frame.name)
        if frame.type != pin.FrameType.BODY or link not in urdf_shapes.links:
            continue
        shapes, faults = urdf_shapes.link_shapes(link, "collision")
        missing_notes += [f"link {link!r}: {fault}" for fault in faults]
        if not shapes and not faults and any(urdf_shapes.link_shapes(link, "visual")):
            bare.append(link)
        solids = []
        for shape in shapes:
            path = None
            if shape.kind == "mesh":
                try:
                    path = find_mesh(shape.mesh, shape.urdf, robot.package_paths)
                except InputError as error:
                    missing_notes.append(f"link {link!r}: {error}")
                    continue
            x, y, z = shape.scale.tolist()
            placed = PlacedShape(shape.kind, shape.size, shape.placement, path, scale=(x, y, z))
            try:
                solids.append(make_solid(placed, frame.placement))
            except InputError as error:
                error.locate(f"{shape.urdf}: collision shape of link {link!r}")
                raise
        if solids:
            bodies.append(Body(link, "link", int(frame.parentJoint), tuple(solids), link=link))
    return LinkBodies(tuple(bodies), tuple(missing_notes), tuple(bare))
