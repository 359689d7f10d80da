"""Meshes of the tool, of its path coloured by speed, and of the given path."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from knotwork.arrays import FloatArray
from knotwork.robot import Robot
from knotwork.view.mesh import Mesh, merge_meshes
from knotwork.view.primitive_meshes import rod, sphere, triad, tube
from knotwork.view.scene_parts import SceneParts
from knotwork.view.shown_motion import ShownMotion
from knotwork.view.targets import given_velocities
from knotwork.view.task_marks import RED
from knotwork.view.tool_curves import full_speeds
from knotwork.view.tool_trace import ToolTrace, tool_trace

SPEED_COLOURS = (
    np.array([(68, 1, 84), (59, 82, 139), (33, 145, 140), (94, 201, 98), (217, 222, 31)]) / 255.0
)
"""Slow to fast: dark violet, blue, green, yellow.

The lightness increases evenly, so that the scale is readable in grey.
"""
MAX_MARKS = 3
"""Maximum number of given speeds that are marked on the scale."""
STEEL = (0.35, 0.36, 0.4, 1.0)
GIVEN, WAY = (0.1, 0.1, 0.12), (0.82, 0.1, 0.5)
DASH, DASH_POINTS, MAX_DASHES = 0.016, 5, 3000
"""Half the period of the dashes along a path, relative to the scene's size; number of points of a
dash, and largest number of dashes of a path.
"""
DASHED = 0.3
"""Length of a dash in half periods: the path's colours must be visible between dashes."""
WIDTH = 0.0045
"""Radius of dashes relative to the scene's size."""


def speed_colours(
    path: ToolTrace, shown: ShownMotion, min_scale_end: float
) -> tuple[FloatArray, dict[str, Any]]:
    """Choose the colours of a path by speed.

    Returns:
        The colour of each sample, shape (n, 3); and the legend, which has the end of the scale
        [m/s], its colours, and given speeds as marks on it [m/s].
    """
    high = max(max_speed(shown), min_scale_end)
    marks = sorted(_given_speeds(shown) - {0.0}, reverse=True)
    shares = path.speed / max(high, 1e-9)
    scale = np.linspace(0.0, 1.0, len(SPEED_COLOURS))
    colours = np.stack([np.interp(shares, scale, part) for part in SPEED_COLOURS.T], axis=1)
    css = ["#" + bytes(colour).hex() for colour in np.round(255 * SPEED_COLOURS).astype(np.uint8)]
    return colours, {"high": high, "colours": css, "marks": marks[:MAX_MARKS]}


def max_speed(shown: ShownMotion) -> float:
    """Largest speed of the tool or in the task, which a tool that fails may not reach [m/s]."""
    trace = tool_trace(shown)
    speeds = () if trace is None else trace.speed
    return float(max([0.0, *speeds, *_given_speeds(shown)]))


def _given_speeds(shown: ShownMotion) -> set[float]:
    """Given speeds at waypoints and along paths [m/s]."""
    along = {part.speed for _, part, *_ in full_speeds(shown)}
    return along | {float(np.linalg.norm(target.linear)) for target in given_velocities(shown)}


def draw_paths(
    parts: SceneParts, shown: ShownMotion, size: float, min_scale_end: float
) -> dict[str, Any]:
    """Draw the tool, its path and the tool paths of the task.

    Returns:
        The legend; empty without a tool.
    """
    robot, trace = shown.robot, tool_trace(shown)
    if trace is None:
        return {}
    colours, legend = speed_colours(trace, shown, min_scale_end)
    parts.draw("path", line_mesh(trace.position, colours, 0.0032 * size), lit=False)
    parts.draw("limits exceeded", _exceeded_mesh(trace, size), lit=False)
    clear = _clear_motion_mesh(trace, shown, size)
    parts.draw("way", clear, lit=False)
    carrier = int(robot.model.frames[robot.tcp_frame_id].parentJoint)
    parts.draw("tool", _tool_mesh(robot, size), carrier=carrier)
    for joint, dashes in given_path_points(shown, size):
        lines = (line_mesh(points, GIVEN, WIDTH * size) for points in dashes)
        parts.draw("given path", _merged_lines(lines), lit=False, carrier=joint)
    paths = shown.scenario.paths
    return legend | {
        "exceeded": bool(trace.exceeded.any()),
        "way": clear is not None,
        "path": bool(paths),
        "moving": any(path.timed_path.frame.is_moving for path in paths),
    }


def _exceeded_mesh(trace: ToolTrace, size: float) -> Mesh | None:
    """The parts of a tool's path with exceeded limits."""
    red: list[Mesh] = []
    for span in _runs(trace.exceeded):
        part = trace.position[max(span.start - 1, 0) : span.stop + 1]
        # the tool may be at rest while the limit is exceeded
        ball = sphere(0.012 * size, RED).shift(part[0])
        red.append(line_mesh(part, RED[:3], 0.0065 * size) or ball)
    return merge_meshes(red) if red else None


def _merged_lines(lines: Iterable[Mesh | None]) -> Mesh | None:
    drawn = [line for line in lines if line is not None]
    return merge_meshes(drawn) if drawn else None


def _tool_mesh(robot: Robot, size: float) -> Mesh:
    """A rod from the tool frame to the tool centre point, and the tool's axes, in joint axes."""
    tip = robot.model.frames[robot.tcp_frame_id].placement
    flange = tip * robot.tool_offset.inverse()
    parts = [triad(0.06 * size, 0.0028 * size).place(tip)]
    if np.linalg.norm(tip.translation - flange.translation) > 1e-6:
        parts.append(rod(flange.translation, tip.translation, 0.006 * size, STEEL))
    return merge_meshes(parts)


def line_mesh(points: FloatArray, colours: ArrayLike, radius: float) -> Mesh | None:
    """Draw a line as a tube; `None` if it has no length.

    Args:
        points: Points [m], shape (n, 3).
        colours: Colour of each point, shape (n, 3), or of all of them, shape (3,).
        radius: Radius [m].
    """
    segment_lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    keep = np.concatenate([[True], segment_lengths > 1e-9])
    painted = np.broadcast_to(np.asarray(colours, dtype=float), points.shape)
    return tube(points[keep], painted[keep], radius) if keep.sum() > 1 else None


def given_path_points(
    shown: ShownMotion, size: float, *, at_rest: bool = False
) -> Iterator[tuple[int | None, list[FloatArray]]]:
    """Points of dashes along each of the scenario's tool paths [m], in a scene of a given size [m].

    Yields:
        The joint that carries the path, and points in its axes; or `None`, and points in the axes
        of the URDF's root, if no joint does or `at_rest` is true.
    """
    for path in shown.scenario.paths:
        curve, dashes = path.timed_path.tool_path, []
        carrier, base = shown.root_carrier if at_rest else shown.carrier_of(path.timed_path.frame)
        count = int(min(max(np.ceil(curve.length / (2 * DASH * size)), 4), MAX_DASHES))
        starts = np.linspace(0.0, curve.length, 2 * count)  # dash, gap, dash, …, dash
        for low, far in zip(starts[:-1:2], starts[1::2], strict=True):
            high = low + DASHED * (far - low)
            points = curve.position(np.linspace(low, high, DASH_POINTS))
            dashes.append(points @ base.rotation.T + base.translation)
        yield carrier, dashes


def _clear_motion_mesh(trace: ToolTrace, shown: ShownMotion, size: float) -> Mesh | None:
    """Draw dashes along collision-free motions; `None` without any."""
    steps = np.linalg.norm(np.diff(trace.position, axis=0), axis=1)
    dashed = np.cumsum([0.0, *steps]) % (2 * DASH * size) < 2 * DASHED * DASH * size
    lines: list[Mesh | None] = []
    for finding in shown.findings:
        if finding.quantity == "way" and finding.interval is not None:
            start, end = finding.interval
            on = dashed & (trace.time >= start) & (trace.time <= end)
            lines += [line_mesh(trace.position[span], WAY, WIDTH * size) for span in _runs(on)]
    return _merged_lines(lines)


def _runs(on: NDArray[Any]) -> list[slice]:
    """Slices of consecutive true values."""
    runs: list[slice] = np.ma.clump_unmasked(np.ma.masked_equal(on, value=False))  # type: ignore[no-untyped-call]
    return runs
