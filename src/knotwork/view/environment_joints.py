"""Joints of moving frames and other robots, which follow those of the robot in the tree."""

from __future__ import annotations

from typing import Any

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.tool_paths.task_frame import BASE_FRAME
from knotwork.scene.collision_model import CollisionModel
from knotwork.scene.other_robots import load_other_motion
from knotwork.view.base_joints import drawn_joints
from knotwork.view.links import link_shapes
from knotwork.view.mesh import merge_meshes
from knotwork.view.scene_parts import SceneParts
from knotwork.view.shown_motion import ShownMotion
from knotwork.view.surroundings import HELD_COLOUR, TOOL_COLOUR, solid_mesh


def environment_joints(shown: ShownMotion) -> list[dict[str, Any]]:
    """Describe the joints after the robot's for the page, in the form of `drawn_joints`."""
    if shown.collision_model is None:
        return []
    tree, first = shown.collision_model.tree, shown.robot.model.njoints
    names = (f"known joint {i}" for i in range(first, len(tree.parent)))
    return drawn_joints(tree, names, first)


def environment_positions(model: CollisionModel | None, time: FloatArray) -> FloatArray:
    """Positions of the joints after the robot's, shape (k, m) at k times; m is 0 if none moves."""
    known = () if model is None else model.known_motions
    return np.hstack([np.zeros((len(time), 0)), *(positions(time) for positions in known)])


def draw_other_robots(parts: SceneParts, shown: ShownMotion, size: float) -> None:
    """Draw links, tools and held objects of other robots."""
    for other in shown.scenario.scene.robots:
        robot, root = shown.collision_model.robots[other.name]  # type: ignore[union-attr]
        links = link_shapes(robot)
        for joint, mesh in enumerate(links.shapes):
            parts.draw("other robots", mesh, carrier=root + joint)
        motion = load_other_motion(other)
        for body in motion.model.bodies:
            held = body.kind == "held" or body.name in motion.held
            if body.kind == "tool" or held:
                meshes = [
                    solid_mesh(part, HELD_COLOUR if held else TOOL_COLOUR, size)
                    for part in body.solids
                ]
                span = [
                    end + other.delay if np.isfinite(end) else None
                    for end in (body.start, body.end)
                ]
                carrier = root + body.joint
                parts.draw("other robots", merge_meshes(meshes), carrier=carrier, between=span)
        carrier, base = shown.carrier_of(BASE_FRAME)
        position = (base * other.placement).translation
        parts.write(other.name, "object", position, f"robot {other.name!r}", carrier=carrier)
        parts.warnings += [f"robot {other.name!r}: {warning}" for warning in links.warnings]


def joint_origins(shown: ShownMotion, count: int = 20) -> tuple[FloatArray, FloatArray]:
    """Positions of the joints after the robot's over the motion [m], shape (n, 3).

    Returns:
        Positions of all these joints, and of those of other robots only.
    """
    model, curve = shown.collision_model, shown.curve
    if model is None:
        return np.zeros((0, 3)), np.zeros((0, 3))
    time = np.linspace(curve.x[0], curve.x[-1], count)
    _, origin = model.joint_placements(curve(time), time)
    placed = np.asarray(origin).reshape(count, -1, 3)
    of_robots = [
        placed[:, root : root + robot.model.njoints].reshape(-1, 3)
        for robot, root in model.robots.values()
    ]
    known = placed[:, shown.robot.model.njoints :].reshape(-1, 3)
    return known, np.concatenate([np.zeros((0, 3)), *of_robots])
