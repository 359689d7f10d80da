"""The tool, its path and the given path, as meshes coloured by speed, deviation and limits."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from knotwork.robot import Robot
from knotwork.spline.polynomial import PiecewisePolynomial
from knotwork.verification.bounds.path_samples import follow_stretch
from knotwork.view.mesh import Mesh, merge_meshes
from knotwork.view.primitive_meshes import rod, sphere, triad, tube
from knotwork.view.scene_parts import SceneParts
from knotwork.view.shown_motion import ShownMotion
from knotwork.view.task_marks import RED
from knotwork.view.tool_curves import stretches, times_along
from knotwork.view.tool_trace import ToolTrace, tool_trace
from knotwork.waypoints import FloatArray

# Slow to fast: dark violet, blue, green, yellow; evenly lighter, to be readable in grey, too.
SPEED_COLOURS = (
    np.array([(68, 1, 84), (59, 82, 139), (33, 145, 140), (94, 201, 98), (217, 222, 31)]) / 255.0
)
# Colours in their place if the speed along tool paths is shown in colours.
GREYS = np.array([[0.3, 0.31, 0.34], [0.74, 0.76, 0.79]])
# Slower than given, as given, faster
OFF_COLOURS = np.array([[0.13, 0.3, 0.85], [0.1, 0.62, 0.35], [0.93, 0.45, 0.05]])
# Speeds closer than this fraction of the largest share a mark; largest number of marks.
LEAST_APART, MOST_MARKS = 0.08, 3


def speed_colours(path: ToolTrace, shown: ShownMotion) -> tuple[FloatArray, dict[str, Any]]:
    """Choose the colours of a path.

    Returns:
        The colour of each sample, shape (n, 3); and the legend: scales with their colours, and the
        given speeds as marks on them [m/s].
    """
    along = [part for _, part, *_ in stretches(shown.scenario, shown.curve)]
    targets = () if along else shown.given_velocities
    given_speeds = sorted(
        (float(np.linalg.norm(target.linear)) for target in targets), reverse=True
    )
    # A failing tool may be slower than required: the scale shows both speeds.
    high = max([float(path.speed.max()), *given_speeds, shown.fastest])
    marks: list[float] = []
    for speed in given_speeds:
        if all(abs(speed - mark) > LEAST_APART * high for mark in (0.0, *marks)):
            marks.append(speed)
    scale = GREYS if along else SPEED_COLOURS
    legend = {"high": high, "colours": css_colours(scale), "marks": marks[:MOST_MARKS]}
    colours = mix_colours(path.speed / high if high > 0 else np.zeros_like(path.speed), scale)
    if not along:
        return colours, legend
    tolerance = shown.scenario.si.tolerances.path_speed
    for part in along:
        start, end = part.full_speed
        on = (path.time >= start) & (path.time <= end)
        off = (path.speed[on] / part.speed - 1.0) / tolerance
        colours[on] = mix_colours(0.5 + 0.5 * off, OFF_COLOURS)
    speeds = sorted({round(part.speed, 9) for part in along})
    off_legend = {"off_colours": css_colours(OFF_COLOURS), "off_tolerance": tolerance}
    return colours, {**legend, **off_legend, "off_speeds": speeds}


def mix_colours(share: FloatArray, colours: FloatArray) -> FloatArray:
    """Colours for positions in 0 … 1 on a scale, shape (n, 3)."""
    at = np.linspace(0.0, 1.0, len(colours))
    return np.stack([np.interp(share, at, column) for column in colours.T], axis=1)


def css_colours(colours: FloatArray) -> list[str]:
    """Colours in the format of pages."""
    return ["#" + bytes(colour).hex() for colour in np.round(255 * colours).astype(np.uint8)]


OTHER = (0.45, 0.45, 0.5)
STEEL = (0.35, 0.36, 0.4, 1.0)


def draw_paths(
    parts: SceneParts, shown: ShownMotion, motions: Mapping[str, PiecewisePolynomial], size: float
) -> dict[str, Any]:
    """Draw the tool, its path, those of other motions and of the task; empty without a tool.

    Returns:
        The legend.
    """
    robot, trace = shown.robot, shown.trace
    if trace is None:
        return {}
    colours, legend = speed_colours(trace, shown)
    parts.draw("path", line_mesh(trace.position, colours, 0.0032 * size), lit=False)
    parts.draw("limits broken", _broken_mesh(trace, size), lit=False)
    deviation, clear = _deviation_mesh(shown, size), _clear_motion_mesh(trace, shown, size)
    parts.draw("deviation", deviation, lit=False, hidden=True)
    parts.draw("way", clear, lit=False)
    for name, motion in motions.items():
        line = _line_mesh(tool_trace(robot, motion).position, OTHER, 0.0022 * size)
        parts.draw(f"path of {name}", line, lit=False)
    carrier = int(robot.model.frames[robot.tcp_frame_id].parentJoint)
    parts.draw("tool", _tool_mesh(robot, size), carrier=carrier)
    for joint, dashes in asked_points(shown, size):
        lines = (_line_mesh(points, ASKED, WIDTH * size) for points in dashes)
        parts.draw("path asked for", _merged_lines(lines), lit=False, carrier=joint)
    legend |= {"broken": bool(trace.broken.any()), "way": clear is not None}
    if deviation is not None:
        legend["moving"] = any(
            path.motion.seam_carrier is not None for path in shown.scenario.paths
        )
        legend["tolerance"] = shown.scenario.si.tolerances.path
        legend["deviation_colours"] = css_colours(DEVIATION_COLOURS)
    return legend


def _broken_mesh(trace: ToolTrace, size: float) -> Mesh | None:
    """The parts of a tool's path with exceeded limits."""
    red: list[Mesh] = []
    for run in _runs(trace.broken):
        part = trace.position[max(run.start - 1, 0) : run.stop + 1]
        # the tool may be at rest while the limit is exceeded
        ball = sphere(0.012 * size, RED).shift(part[0])
        red.append(_line_mesh(part, RED[:3], 0.0065 * size) or ball)
    return merge_meshes(red) if red else None


def _merged_lines(lines: Iterable[Mesh | None]) -> Mesh | None:
    drawn = [line for line in lines if line is not None]
    return merge_meshes(drawn) if drawn else None


def _line_mesh(points: FloatArray, colour: Sequence[float], radius: float) -> Mesh | None:
    return line_mesh(points, np.tile(colour, (len(points), 1)), radius)


def _tool_mesh(robot: Robot, size: float) -> Mesh:
    """A rod from the tool frame to the tool centre point with its axes, in the joint's axes."""
    tip = robot.model.frames[robot.tcp_frame_id].placement
    flange = tip * robot.tool_offset.inverse()
    parts = [triad(0.06 * size, 0.0028 * size).place(tip)]
    if np.linalg.norm(tip.translation - flange.translation) > 1e-6:
        parts.append(rod(flange.translation, tip.translation, 0.006 * size, STEEL))
    return merge_meshes(parts)


def line_mesh(points: FloatArray, colours: FloatArray, radius: float) -> Mesh | None:
    """Draw a line as a tube; `None` if it has no length.

    Args:
        points: Points [m], shape (n, 3).
        colours: Colour of each point, shape (n, 3).
        radius: Radius [m].
    """
    apart = np.linalg.norm(np.diff(points, axis=0), axis=1)
    keep = np.concatenate([[True], apart > 1e-9])
    points, colours = points[keep], colours[keep]
    return tube(points, colours, radius) if len(points) > 1 else None


# Exact to beyond the tolerance; they differ in lightness, too.
DEVIATION_COLOURS = np.array([[0.05, 0.4, 0.45], [0.45, 0.7, 0.45], [0.98, 0.85, 0.25]])
ASKED, WAY = (0.1, 0.1, 0.12), (0.82, 0.1, 0.5)
# Dashes along a path: number of points of each, largest number on a path; size relative to
DASH, DASH_POINTS, MOST_DASHES = 0.016, 5, 3000
# Length of a dash in half periods: the path's colours must be visible between dashes.
DASHED = 0.3
WIDTH, DEVIATION_WIDTH = 0.0045, 0.004


def asked_points(
    shown: ShownMotion, size: float, *, at_rest: bool = False
) -> Iterator[tuple[int | None, list[FloatArray]]]:
    """Points of dashes along each of the scenario's tool paths [m], in a scene of a given size [m].

    Yields:
        The joint that carries the path, and points in its axes; without one, or at rest,
        points in the axes of the URDF's root.
    """
    for path in shown.scenario.paths:
        curve, dashes = path.motion.path, []
        carrier, base = shown.carrier_of(None if at_rest else path.motion.seam_carrier)
        count = int(min(max(np.ceil(curve.length / (2 * DASH * size)), 4), MOST_DASHES))
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
            for run in _runs(on):
                lines.append(_line_mesh(trace.position[run], WAY, WIDTH * size))
    return _merged_lines(lines)


def _runs(on: NDArray[Any]) -> list[slice]:
    """Runs of true values."""
    runs: list[slice] = np.ma.clump_unmasked(np.ma.masked_equal(on, value=False))  # type: ignore[no-untyped-call]
    return runs


def _deviation_mesh(shown: ShownMotion, size: float) -> Mesh | None:
    """Draw the tool's path along tool paths, coloured by its deviation.

    Returns:
        Colours from zero to the tolerance, red beyond; `None` without a path.
    """
    robot, curve, tolerance = shown.robot, shown.curve, shown.scenario.si.tolerances.path
    lines: list[Mesh | None] = []
    base = robot.base_placement
    for path, stretch, start, end in stretches(shown.scenario, curve):
        time = times_along(curve, start, end)
        points = np.array([(base * robot.forward(q)).translation for q in curve(time)])
        share = follow_stretch(robot, curve, path, stretch, time).distance / tolerance
        colours = np.where(share[:, None] > 1.0, RED[:3], mix_colours(share, DEVIATION_COLOURS))
        lines.append(line_mesh(points, colours, DEVIATION_WIDTH * size))
    return _merged_lines(lines)
