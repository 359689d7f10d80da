"""Curves and orientations of a scenario's tool paths, in the base frame."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, cast

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves import tool_paths
from knotwork.curves.tool_paths import Curve, OrientationCurve
from knotwork.curves.tool_paths.curve import SAME_POINT
from knotwork.curves.tool_paths.rotations import rotation_vector, transport_axes
from knotwork.curves.tool_paths.seam import seam_frames, torch_rotation
from knotwork.errors import InputError, PathError
from knotwork.files.documents import Location
from knotwork.task import AlongArc, AlongPoints, Arc, PathWaypoint, PoseWaypoint, Torch
from knotwork.task.scenario.task_reading import TaskReading

if TYPE_CHECKING:
    import pinocchio as pin

END_POINT_TOLERANCE, END_ANGLE_TOLERANCE = 1e-6, 1e-3
"""Distance of points [m] and orientations [rad] of a file from those of a waypoint within which
they are equal.
"""

MAX_SPACINGS = 3.0
"""Maximum distance of the end points of a curve from the waypoints, relative to its largest
spacing.
"""

MESSAGE_DECIMALS = 9
"""Number of decimals for points in messages [m]."""

BLEND_ROUNDING = 1e-6
"""Fraction by which a blend may exceed half a line."""


class StretchGeometry(NamedTuple):
    """Geometry of a stretch of a path.

    Attributes:
        curve: Positions of the tool.
        orientation: Orientation of the tool along the curve.
        turn_is_free: Whether its points have normals, which leave the turn about them open.
    """

    curve: Curve
    orientation: OrientationCurve
    turn_is_free: bool


@dataclass(frozen=True, eq=False)
class PathCurves:
    """Makes the curves and orientations of a task's paths.

    Attributes:
        reading: The task in SI, with its frames.
        poses: Poses of its waypoints by index, with all frames at rest.
    """

    reading: TaskReading
    poses: Mapping[int, pin.SE3]

    def waypoint(self, i: int) -> PathWaypoint:
        """Waypoint i of the task, the end of a path."""
        return cast(PathWaypoint, self.reading.task.waypoints[i])

    @contextmanager
    def errors_at(self, i: int, *key: str) -> Iterator[None]:
        """Have errors of geometry name a key of the waypoint."""
        try:
            yield
        except InputError as error:
            message = (
                error.in_units(self._length_text, partial(self._point_text, i))
                if isinstance(error, PathError)
                else str(error)
            )
            location: Location = ("waypoints", i, *(key or ("along",)))
            raise self.reading.locations.error(location, message) from error

    def _length_text(self, length: float) -> str:
        return self.reading.units.text(length, "m", ".9g")

    def _point_text(self, i: int, point: FloatArray) -> str:
        """Format a point as in the file: in the frame of the path to waypoint i."""
        units = self.reading.units
        local = self.reading.pose_frames[i].rest_placement.actInv(np.array(point))
        numbers = (units.number(x, "m", ".9g") for x in np.round(local, MESSAGE_DECIMALS))
        return f"({', '.join(numbers)}) {units.length}"

    def stretch(self, i: int, start_rotation: FloatArray) -> StretchGeometry:
        """The stretch from the previous waypoint to waypoint i.

        Args:
            i: The waypoint.
            start_rotation: Rotation of the tool at the start, shape (3, 3). It has no effect where
                the start has no orientation and the stretch defines one.

        Raises:
            DocumentError: The stretch is infeasible as given.
        """
        waypoint, start = self.waypoint(i), self.reading.task.waypoints[i - 1]
        requested = waypoint.orientation
        location: Location = ("waypoints", i)
        with self.errors_at(i):
            curve, rotations, axes = self._curve(i, start_rotation)
            if axes is not None and requested is None:
                rotations = transport_axes(start_rotation, axes)
        if requested is not None and rotations is not None:
            raise self.reading.locations.error(
                (*location, "orientation"),
                "is given together with points that have orientations",
                "orientation: tangent, or columns of orientations or normals, not both",
            )
        start_place = location if rotations is None else (*location, "along", "points")
        if isinstance(requested, Torch) or (requested is not None and axes is not None):
            torch = requested if isinstance(requested, Torch) else Torch()
            rotations = self._torch_rotations(i, torch, curve, axes)
            if isinstance(start, PoseWaypoint) and not start.pose.has_orientation:
                start_rotation = rotations[0]
        if rotations is not None:
            self._check_rotation(
                float(np.linalg.norm(rotation_vector(start_rotation.T @ rotations[0]))),
                start_place,
                "at the first point the tool is rotated by {} degrees from the start of the path",
                "the orientation of the previous waypoint; or a point between the two",
            )
            rotations[0] = start_rotation
        orientation = self._orientation(i, curve, start_rotation, rotations)
        turn_is_free = axes is not None and requested is None
        if waypoint.pose.has_orientation:
            end = orientation.rotations[-1].T @ self.poses[i].rotation
            angle = np.linalg.norm(rotation_vector(end))
            if turn_is_free:
                angle = np.arctan2(np.linalg.norm(end[:2, 2]), end[2, 2])
            self._check_rotation(
                float(angle),
                (*location, "pose"),
                "is rotated by {} degrees from the end of the path",
                "no orientation if the path has its own, or that of its end",
            )
        return StretchGeometry(curve, orientation, turn_is_free)

    def _orientation(
        self, i: int, curve: Curve, start_rotation: FloatArray, rotations: FloatArray | None
    ) -> OrientationCurve:
        """Orientation along the stretch to waypoint i, through rotations at its points, if any.

        A single rotation, at the start, turns with the path.
        """
        waypoint = self.waypoint(i)
        with self.errors_at(i, "pose" if waypoint.pose.has_orientation else "along"):
            if rotations is not None and len(rotations) > 1:
                s = cast(tool_paths.ThroughPoints, curve).arc_lengths
                return OrientationCurve.through(s, rotations)
            if waypoint.orientation is not None:
                return tool_paths.tangent_orientation(curve, start_rotation)
            if waypoint.pose.has_orientation:
                end_rotation = self.poses[i].rotation
                return OrientationCurve.even_turning(start_rotation, end_rotation, curve.length)
            return OrientationCurve.constant(start_rotation, curve.length)

    def _check_rotation(self, angle: float, location: Location, fault: str, accepted: str) -> None:
        """Refuse an orientation at an angle [rad] to that of a waypoint."""
        if angle > END_ANGLE_TOLERANCE:
            raise self.reading.locations.error(
                location, fault.format(f"{np.degrees(angle):.4g}"), accepted
            )

    def _curve(
        self, i: int, start_rotation: FloatArray
    ) -> tuple[Curve, FloatArray | None, FloatArray | None]:
        """The curve to waypoint i, and rotations or z axes of the tool at its points, if any.

        Rotations have shape (k, 3, 3), axes (k, 3).
        """
        start, end = self.poses[i - 1].translation, self.poses[i].translation
        along = self.waypoint(i).along
        if isinstance(along, AlongPoints):
            return self._through_points(i, along, start_rotation)
        if isinstance(along, AlongArc):
            return self._arc(i, along.arc), None, None
        return tool_paths.Line(start, end), None, None

    def _arc(self, i: int, arc: Arc) -> Curve:
        start, end = self.poses[i - 1].translation, self.poses[i].translation
        frame = self.reading.pose_frames[i].rest_placement
        normal = None if arc.normal is None else frame.rotation @ np.array(arc.normal)
        if arc.through is not None:
            return tool_paths.Arc.through(start, frame.act(np.array(arc.through)), end)
        if arc.centre is not None:
            centre = frame.act(np.array(arc.centre))
            return tool_paths.Arc.about(start, centre, end, normal, arc.turns or 0)
        axis = np.zeros(3) if normal is None else normal
        return tool_paths.Arc.of_radius(start, end, arc.radius or 0.0, axis, large=bool(arc.large))

    def _through_points(
        self, i: int, along: AlongPoints, start_rotation: FloatArray
    ) -> tuple[Curve, FloatArray | None, FloatArray | None]:
        """As `_curve`; waypoints that are not among the points are added at the ends."""
        waypoint, start, end = self.waypoint(i), self.poses[i - 1], self.poses[i]
        points, rotations, axes = self._points(i, along)
        self._check_ends(i, points)
        adds_start = np.linalg.norm(points[0] - start.translation) > END_POINT_TOLERANCE
        adds_end = np.linalg.norm(points[-1] - end.translation) > END_POINT_TOLERANCE
        rows = [*([0] if adds_start else []), *range(len(points)), *([-1] if adds_end else [])]
        points = points[rows]
        points[0], points[-1] = start.translation, end.translation
        if rotations is not None:
            rotations = rotations[rows]
            if adds_start:
                rotations[0] = start_rotation
            if adds_end and waypoint.pose.has_orientation:
                rotations[-1] = end.rotation
        if axes is not None:
            axes = axes[rows]
            if adds_start and waypoint.orientation is None:
                axes[0] = start_rotation[:, 2]
            if adds_end and waypoint.orientation is None and waypoint.pose.has_orientation:
                axes[-1] = end.rotation[:, 2]
        return tool_paths.ThroughPoints(points), rotations, axes

    def _points(
        self, i: int, along: AlongPoints
    ) -> tuple[FloatArray, FloatArray | None, FloatArray | None]:
        """Points in the base frame, and the tool's rotations or z axes there, if any."""
        frame = self.reading.pose_frames[i].rest_placement
        axes = self.reading.pose_frames.axes(i)
        rotations = z_axes = None
        if isinstance(along.points, str):
            file = self.reading.locations.file
            path = (file.parent if file is not None else Path()) / along.points
            read = tool_paths.read_points(path, self.reading.metres_per_unit)
            points = read.points
            rotations = None if read.rotations is None else axes @ read.rotations
            z_axes = None if read.normals is None else -read.normals @ axes.T
        else:
            points = np.array(along.points)
        return points @ frame.rotation.T + frame.translation, rotations, z_axes

    def _torch_rotations(
        self, i: int, torch: Torch, curve: Curve, axes: FloatArray | None
    ) -> FloatArray:
        """Rotations at a torch's angles to seam and surface, shape (k, 3, 3).

        They are at the points of a path whose z axes are given, else at its start.
        """
        if (torch.normal is None) == (axes is None):
            raise self.reading.locations.error(
                ("waypoints", i, "orientation"),
                "gives no normal" if axes is None else "gives a normal, and so do the points",
                "normal: out of the surface at the path's start, or columns nx, ny, nz of points",
            )
        with self.errors_at(i, "orientation"):
            if axes is None:
                s, normals = np.zeros(1), self.reading.pose_frames.axes(i) @ np.array(torch.normal)
            else:
                s, normals = cast(tool_paths.ThroughPoints, curve).arc_lengths, -axes
            turned = torch_rotation(torch.work_angle, torch.travel_angle, torch.tangent)
            return np.asarray(seam_frames(curve.position(s, 1), normals) @ turned)

    def _check_ends(self, i: int, points: FloatArray) -> None:
        """Refuse points that are far from a waypoint of the path, relative to their spacing."""
        spacing = np.linalg.norm(np.diff(points, axis=0), axis=1)
        if not spacing.size or not spacing.all():  # repeated points are reported elsewhere
            return
        allowed = MAX_SPACINGS * float(spacing.max())
        text = self.reading.units.text
        for name, point, end in (("first", points[0], i - 1), ("last", points[-1], i)):
            distance = float(np.linalg.norm(point - self.poses[end].translation))
            if distance > allowed:
                raise PathError(
                    f"its {name} point is {text(distance, 'm')} from waypoints[{end}]; the "
                    "points must begin and end at the waypoints, or at most this far from them: "
                    f"{text(allowed, 'm')}, {MAX_SPACINGS:g} times their spacing"
                )

    def round_corners(
        self, first: int, curves: Sequence[Curve], waypoints: Sequence[PathWaypoint]
    ) -> tuple[list[Curve], FloatArray]:
        """The curves with corners rounded, and the arc lengths at the ends of stretches."""
        pieces: list[Curve] = []
        ends = []
        length = 0.0
        begin: FloatArray | None = None  # start of a line after a rounded corner
        for k, (curve, waypoint) in enumerate(zip(curves, waypoints, strict=True)):
            if begin is not None and isinstance(curve, tool_paths.Line):
                curve = tool_paths.Line(begin, curve.end)
            if waypoint.blend is None:
                pieces.append(curve)
                length += curve.length
                ends.append(length)
                begin = None
                continue
            blend = self._blend(first + k, curves[k : k + 2], waypoint.blend)
            start, enter = curve.position([0.0])[0], blend.position([0.0])[0]
            if np.linalg.norm(enter - start) > SAME_POINT:
                pieces.append(tool_paths.Line(start, enter))
                length += pieces[-1].length
            pieces.append(blend)
            ends.append(length + 0.5 * blend.length)
            length += blend.length
            begin = blend.position([blend.length])[0]
        return pieces, np.array(ends)

    def _blend(self, i: int, curves: Sequence[Curve], distance: float) -> Curve:
        """The curve that rounds the corner between two lines."""
        lines = [curve for curve in curves if isinstance(curve, tool_paths.Line)]
        if len(lines) < 2:
            raise self.reading.locations.error(
                ("waypoints", i, "blend"),
                "rounds the corner between two lines, and this waypoint is not between two lines",
                "no blend; or along: line here and at the next waypoint",
            )
        longest = 0.5 * min(line.length for line in lines)
        if distance > longest * (1.0 + BLEND_ROUNDING):
            raise self.reading.locations.error(
                ("waypoints", i, "blend"),
                f"is {self.reading.units.text(distance, 'm')}, more than half of the shorter line",
                f"at most {self.reading.units.text(longest, 'm')}",
            )
        with self.errors_at(i, "blend"):
            blend: Curve = tool_paths.Blend(lines[0].start, lines[0].end, lines[1].end, distance)
        return blend


def rescale_orientation(turn: OrientationCurve, length: float) -> OrientationCurve:
    """The same rotation on a stretch of another length [m], as after a rounded corner."""
    if turn.length == length:
        return turn
    factor = length / turn.length
    return OrientationCurve(
        turn.s * factor, turn.rotations, turn.rates / factor, turn.changes / factor**2
    )
