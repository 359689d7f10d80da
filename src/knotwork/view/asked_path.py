"""Tool paths in a scene: where they lead, and how far the tool is off them, in colours."""

from __future__ import annotations

import numpy as np

from knotwork.deviation import deviation_from_path
from knotwork.polynomial import PiecewisePolynomial
from knotwork.robot import Robot
from knotwork.scenario import Scenario
from knotwork.view.marks import RED
from knotwork.view.mesh import Mesh, merged
from knotwork.view.path_shapes import line_mesh
from knotwork.view.speed_colours import mixed
from knotwork.view.tool_curves import stretches, times_along
from knotwork.waypoints import FloatArray

# Exact to beyond the tolerance; they differ in lightness, too.
DEVIATION_COLOURS = np.array([[0.05, 0.4, 0.45], [0.45, 0.7, 0.45], [0.98, 0.85, 0.25]])
ASKED = (0.1, 0.1, 0.12)
# Dashes along a path, and points of each, and of most paths; relative to the scene's size.
DASH, DASH_POINTS, MOST_DASHES = 0.016, 5, 3000
# A dash takes so much of its half of a period: the path's colours are to be seen between dashes.
DASHED = 0.3
WIDTH, DEVIATION_WIDTH = 0.0045, 0.004


def asked_points(scenario: Scenario | None, robot: Robot, size: float) -> list[FloatArray]:
    """Points of dashes along the scenario's tool paths, in the axes of the URDF's root [m].

    Args:
        scenario: The task.
        robot: The arm.
        size: Extent of the scene [m].
    """
    base = robot.base_placement
    dashes: list[FloatArray] = []
    for path in scenario.paths if scenario is not None else ():
        whole = path.motion.path
        count = int(min(max(np.ceil(whole.length / (2 * DASH * size)), 4), MOST_DASHES))
        starts = np.linspace(0.0, whole.length, 2 * count)  # dash, gap, dash, …, dash
        for low, far in zip(starts[:-1:2], starts[1::2], strict=True):
            high = low + DASHED * (far - low)
            points = whole.position(np.linspace(low, high, DASH_POINTS))
            dashes.append(points @ base.rotation.T + base.translation)
    return dashes


def asked_path_mesh(scenario: Scenario | None, robot: Robot, size: float) -> Mesh | None:
    """Draw the scenario's tool paths as dashed lines; `None` if there is none."""
    parts = [
        line_mesh(points, np.tile(ASKED, (len(points), 1)), WIDTH * size)
        for points in asked_points(scenario, robot, size)
    ]
    drawn = [part for part in parts if part is not None]
    return merged(drawn) if drawn else None


def deviation_mesh(
    scenario: Scenario | None, robot: Robot, curve: PiecewisePolynomial, size: float
) -> Mesh | None:
    """Draw where the tool goes along paths, coloured by its distance from them.

    Args:
        scenario: The task, with the tolerance.
        robot: The arm.
        curve: Its motion, joints in the robot's order.
        size: Extent of the scene [m].

    Returns:
        Colours from none of the tolerance to all of it, red beyond; `None` if there is no path.
    """
    parts: list[Mesh | None] = []
    base = robot.base_placement
    for path, stretch, start, end in stretches(scenario, curve):
        time = times_along(curve, start, end)
        q = curve(time)
        off, _ = deviation_from_path(robot, q, path, stretch, time)
        points = np.array([(base * robot.forward(row)).translation for row in q])
        parts.append(line_mesh(points, _colours(off, scenario), DEVIATION_WIDTH * size))
    drawn = [part for part in parts if part is not None]
    return merged(drawn) if drawn else None


def _colours(off: FloatArray, scenario: Scenario | None) -> FloatArray:
    share = off / scenario.tolerances.path if scenario is not None else off
    return np.where(share[:, None] > 1.0, RED[:3], mixed(share, DEVIATION_COLOURS))
