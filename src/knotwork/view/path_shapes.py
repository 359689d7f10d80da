"""The tool and its path as meshes: coloured by speed, in red where a limit is broken."""

from __future__ import annotations

import numpy as np

from knotwork.robot import Robot
from knotwork.view.marks import RED
from knotwork.view.mesh import Mesh, merged
from knotwork.view.solids import rod, sphere, triad, tube
from knotwork.view.tool_trace import ToolTrace
from knotwork.waypoints import FloatArray

OTHER = (0.45, 0.45, 0.5)
STEEL = (0.35, 0.36, 0.4, 1.0)


def path_meshes(path: ToolTrace, colours: FloatArray, size: float) -> dict[str, Mesh]:
    """Draw a tool's path in colours of shape (n, 3); in a scene of some size [m].

    Empty if the tool stands still.
    """
    meshes = {}
    line = line_mesh(path.position, colours, 0.0032 * size)
    if line is not None:
        meshes["path"] = line
    broken = np.flatnonzero(path.broken)
    red: list[Mesh] = []
    for run in np.split(broken, np.flatnonzero(np.diff(broken) > 1) + 1) if len(broken) else ():
        part = path.position[max(run[0] - 1, 0) : run[-1] + 2]
        tubes = line_mesh(part, np.tile(RED[:3], (len(part), 1)), 0.0065 * size)
        red.append(
            tubes
            if tubes is not None  # the tool stands still while the limit is broken
            else sphere(0.012 * size, RED).moved(np.eye(3), part[0])
        )
    if red:
        meshes["limits broken"] = merged(red)
    return meshes


def other_path_mesh(path: ToolTrace, size: float) -> Mesh | None:
    """Draw the path of a motion that is compared with; `None` if the tool stands still."""
    return line_mesh(path.position, np.tile(OTHER, (len(path.time), 1)), 0.0022 * size)


def tool_mesh(robot: Robot, size: float) -> Mesh:
    """A rod from the tool frame to the tool centre point, and the axes there; joint's axes."""
    tip = robot.model.frames[robot.tcp_frame_id].placement
    flange = tip * robot.tool_offset.inverse()
    parts = [triad(0.06 * size, 0.0028 * size).moved(tip.rotation, tip.translation)]
    if np.linalg.norm(tip.translation - flange.translation) > 1e-6:
        parts.append(rod(flange.translation, tip.translation, 0.006 * size, STEEL))
    return merged(parts)


def line_mesh(points: FloatArray, colours: FloatArray, radius: float) -> Mesh | None:
    """Draw a line as a tube; `None` if it has no length.

    Args:
        points: [m], shape (n, 3).
        colours: Of each point, shape (n, 3).
        radius: [m].
    """
    apart = np.linalg.norm(np.diff(points, axis=0), axis=1)
    keep = np.concatenate([[True], apart > 1e-9])
    points, colours = points[keep], colours[keep]
    return tube(points, colours, radius) if len(points) > 1 else None
