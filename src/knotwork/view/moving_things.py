"""Moving objects of a scene: in moving frames, and of other robots.

They are carried by joints after those of the robot, with known positions.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin

from knotwork.scene.collision_model import CollisionModel
from knotwork.scene.other_robots import OtherMotion, other_motion
from knotwork.view.footing import drawn_joint
from knotwork.view.links import link_shapes
from knotwork.view.mesh import Mesh, merged
from knotwork.view.objects import HELD, TOOL, Objects, shape_mesh
from knotwork.view.packing import label, thing
from knotwork.view.shown import Shown
from knotwork.waypoints import FloatArray


def known_joints(shown: Shown) -> list[dict[str, Any]]:
    """Describe the joints after the robot's, like `drawn_joints`."""
    if shown.model is None:
        return []
    tree, first = shown.model.joints, shown.robot.model.njoints
    return [drawn_joint(tree, i, f"known joint {i}") for i in range(first, len(tree.parent))]


def known_positions(model: CollisionModel | None, time: FloatArray) -> FloatArray:
    """Positions of these joints, shape (k, m), with m = 0 without moving objects."""
    known = () if model is None else model.known
    return np.hstack([np.zeros((len(time), 0)), *(one(time) for one in known)])


def other_robots(shown: Shown, size: float) -> Objects:
    """Links, tools and held objects of other robots."""
    things: list[dict[str, Any]] = []
    labels: list[dict[str, Any]] = []
    warnings: list[str] = []
    model = shown.model
    for given in shown.scenario.scene.robots if model is not None else ():
        robot, root = model.robots[given.name]  # type: ignore[union-attr]
        links = link_shapes(robot)
        things += [
            thing("other robots", mesh, carrier=root + joint)
            for joint, mesh in enumerate(links.shapes)
            if mesh is not None
        ]
        for joint, mesh, span in _carried(other_motion(given), size):
            between = [end + given.delay if np.isfinite(end) else None for end in span]
            things.append(thing("other robots", mesh, carrier=root + joint, between=between))
        carrier, base = shown.carrying(given.carrier)
        at = (base * given.placement).translation
        labels.append(label(given.name, "object", at, f"robot {given.name!r}", carrier))
        warnings += [f"robot {given.name!r}: {one}" for one in links.warnings]
    return Objects(things, labels, np.zeros((0, 3)), tuple(warnings))


def _carried(other: OtherMotion, size: float) -> Iterator[tuple[int, Mesh, tuple[float, float]]]:
    """Its tool and held objects: carrying joint, mesh, and time interval of each."""
    for body in other.model.bodies:
        held = body.kind == "held" or body.name in other.held
        if body.kind == "tool" or held:
            meshes = [
                shape_mesh(
                    replace(one.shape, placement=pin.SE3.Identity()), HELD if held else TOOL, size
                ).moved(one.rotation, one.translation)
                for one in body.solids
            ]
            yield body.joint, merged(meshes), (body.start, body.end)


def origins(shown: Shown, count: int = 20) -> tuple[FloatArray, FloatArray]:
    """Positions of the joints after the robot's over the motion [m], shape (n, 3).

    Returns:
        All of them, and only those of other robots.
    """
    model, curve = shown.model, shown.curve
    if model is None:
        return np.zeros((0, 3)), np.zeros((0, 3))
    time = np.linspace(curve.x[0], curve.x[-1], count)
    _, origin = model.joint_placements(curve(time), time)
    placed = np.asarray(origin).reshape(count, -1, 3)
    theirs = [placed[:, root : root + one.model.njoints] for one, root in model.robots.values()]
    others = np.concatenate([np.zeros((0, 3)), *(one.reshape(-1, 3) for one in theirs)])
    return placed[:, shown.robot.model.njoints :].reshape(-1, 3), others
