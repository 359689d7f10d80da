"""Curves and orientations of a scenario's tool paths, in the base frame."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, cast

import numpy as np

from knotwork.curves import tool_paths
from knotwork.curves.tool_paths import Curve, OrientationCurve
from knotwork.curves.tool_paths.curve import SAME_POINT
from knotwork.curves.tool_paths.rotations import rotation_vector, transport_axes
from knotwork.curves.tool_paths.seam import seam_frames, torch_rotation
from knotwork.errors import InputError, PathError
from knotwork.files.documents import Places
from knotwork.task import AlongArc, AlongPoints, PathWaypoint, PoseWaypoint, Torch
from knotwork.waypoints import FloatArray

if TYPE_CHECKING:
    import pinocchio as pin

    from knotwork.task import PlainTask

SAME_WAYPOINT_POINT, SAME_WAYPOINT_ANGLE = 1e-6, 1e-3
"""Distance of points [m] and orientations [rad] of a file from those of a waypoint within which
they are equal.
"""

MAX_SPACINGS = 3.0
"""Maximum distance of the end points of a curve from the waypoints, relative to its largest
spacing.
"""

MESSAGE_DECIMALS = 9
"""Number of decimals for points and lengths in messages, in the file's unit."""

BLEND_ROUNDING = 1e-6
"""Fraction by which a blend may exceed half a line."""


@dataclass(frozen=True, eq=False)
class PathCurves:
    """Makes the curves and orientations of a file's paths.

    Attributes:
        file: Content of the file, in SI.
        places: Locations of its parts in the file, for errors.
        length: The file's unit of length [m].
        frames: Placement of the frame of each waypoint's path, by index.
        axes: Axes of the orientations of each waypoint's path, shape (3, 3), by index.
        poses: Poses of waypoints, by index; paths correct the poses on them.
        rotations: Rotations of the tool at the points of paths whose file has orientations.
        normals: Paths, by index, with normals in their file, which free the turn.
    """

    file: PlainTask
    places: Places
    length: float
    frames: Mapping[int, pin.SE3]
    axes: Mapping[int, FloatArray]
    poses: dict[int, pin.SE3]
    rotations: dict[int, FloatArray] = field(default_factory=dict)
    normals: set[int] = field(default_factory=set)

    def waypoint(self, i: int) -> PathWaypoint:
        """Waypoint i of the file, the end of a path."""
        return cast(PathWaypoint, self.file.waypoints[i])

    @contextmanager
    def errors(self, i: int, *key: str) -> Iterator[None]:
        """Have errors of geometry name a key of the waypoint."""
        try:
            yield
        except InputError as error:
            message = (
                error.in_units(self.text, partial(self._point_text, i))
                if isinstance(error, PathError)
                else str(error)
            )
            raise self.places.error(("waypoints", i, *(key or ("along",))), message) from error

    def text(self, value: float, per: str = "", digits: int = 9) -> str:
        """Write a length, speed or acceleration in the file's unit.

        Args:
            value: Value in m, m/s or m/s².
            per: `"/s"` or `"/s²"` for speeds and accelerations.
            digits: Number of significant digits.
        """
        number = round(value / self.length, MESSAGE_DECIMALS)
        return f"{number:.{digits}g} {self.file.units.length}{per}"

    def _point_text(self, i: int, point: FloatArray) -> str:
        """Format a point as in the file: in the frame of the path to waypoint i."""
        local = (
            np.round(self.frames[i].actInv(np.array(point)) / self.length, MESSAGE_DECIMALS) + 0.0
        )
        return f"({', '.join(f'{value:.9g}' for value in local)}) {self.file.units.length}"

    def _in_base(self, i: int, point: Sequence[float]) -> FloatArray:
        return np.asarray(self.frames[i].act(np.array(point)))

    def curve(self, i: int) -> Curve:
        """The curve from the previous waypoint to waypoint i."""
        start, end = self.poses[i - 1].translation, self.poses[i].translation
        along = self.waypoint(i).along
        with self.errors(i):
            if isinstance(along, AlongArc):
                curve: Curve = self._arc(i, along, start, end)
            elif isinstance(along, AlongPoints):
                curve = self._through_points(i, along, start, end)
            else:
                curve = tool_paths.Line(start, end)
        return curve

    def _arc(self, i: int, along: AlongArc, start: FloatArray, end: FloatArray) -> Curve:
        arc = along.arc
        normal = None
        if arc.normal is not None:
            normal = self.frames[i].rotation @ np.array(arc.normal)
        if arc.through is not None:
            return tool_paths.Arc.through(start, self._in_base(i, arc.through), end)
        if arc.centre is not None:
            centre = self._in_base(i, arc.centre)
            return tool_paths.Arc.about(start, centre, end, normal, arc.turns or 0)
        radius = arc.radius or 0.0
        axis = np.zeros(3) if normal is None else normal
        return tool_paths.Arc.of_radius(start, end, radius, axis, large=bool(arc.large))

    def _through_points(
        self, i: int, along: AlongPoints, start: FloatArray, end: FloatArray
    ) -> Curve:
        points, rotations = self._points(i, along)
        self._check_ends(i, points, start, end)
        if np.linalg.norm(points[0] - start) > SAME_WAYPOINT_POINT:
            points = np.vstack((start, points))
            if rotations is not None:
                before = self._turned_before(i, rotations[0, :, 2])
                rotations = np.concatenate((before[None], rotations))
        if np.linalg.norm(points[-1] - end) > SAME_WAYPOINT_POINT:
            points = np.vstack((points, end))
            if rotations is not None:
                end_is_given = self.waypoint(i).orientation is None and self.waypoint(i).pose.turned
                rotation = self.poses[i].rotation if end_is_given else rotations[-1]
                if i in self.normals:
                    rotation = transport_axes(rotations[-1], rotation[None, :, 2])[0]
                rotations = np.concatenate((rotations, rotation[None]))
        points[0], points[-1] = start, end
        if rotations is not None:
            self.rotations[i] = rotations
        curve: Curve = tool_paths.ThroughPoints(points)
        return curve

    def _torch_rotations(self, i: int, curve: Curve) -> FloatArray | None:
        """Rotations at the file's angles to seam and surface; `None` without them.

        Shape (k, 3, 3): at the points of a path with normals, else at its start.
        """
        requested, axes = self.waypoint(i).orientation, None
        if i in self.normals and requested is not None:
            self.normals.remove(i)
            axes = -self.rotations.pop(i)[:, :, 2]
        elif not isinstance(requested, Torch):
            return None
        torch = requested if isinstance(requested, Torch) else Torch()
        if (torch.normal is None) == (axes is None):
            raise self.places.error(
                ("waypoints", i, "orientation"),
                "gives no normal" if axes is None else "gives a normal, and so do the points",
                "normal: out of the surface at the path's start, or columns nx, ny, nz of points",
            )
        with self.errors(i, "orientation"):
            s = curve.arc_lengths if isinstance(curve, tool_paths.ThroughPoints) else np.zeros(1)
            if axes is None:
                s, axes = s[:1], self.axes[i] @ np.array(torch.normal)
            turned = torch_rotation(torch.work_angle, torch.travel_angle, torch.tangent)
            return np.asarray(seam_frames(curve.position(s, 1), axes) @ turned)

    def _points(self, i: int, along: AlongPoints) -> tuple[FloatArray, FloatArray | None]:
        """Points in the base frame, and the tool's rotations there if the file has them."""
        placed = self.frames[i]
        rotations = None
        if isinstance(along.points, str):
            file = Path(along.points)
            folder = self.places.file.parent if self.places.file is not None else Path()
            read = tool_paths.read_points(folder / file, self.length)
            points = read.points
            if read.rotations is not None:
                rotations = self.axes[i] @ read.rotations
            elif read.normals is not None:
                self.normals.add(i)
                axes = -read.normals @ np.array(self.axes[i]).T
                rotations = transport_axes(self._turned_before(i, axes[0]), axes)
        else:
            points = np.array(along.points)
        return points @ placed.rotation.T + placed.translation, rotations

    def _turned_before(self, i: int, axis: FloatArray) -> FloatArray:
        """Rotation at the start of a path.

        It is any rotation about its first z axis if that is sufficient.
        """
        import pinocchio as pin

        if self.waypoint(i).orientation is None:
            return np.array(self.poses[i - 1].rotation)
        return np.array(pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), axis).matrix())

    def _check_ends(self, i: int, points: FloatArray, start: FloatArray, end: FloatArray) -> None:
        """Refuse points that are far from a waypoint of the path, relative to their spacing."""
        spacing = np.linalg.norm(np.diff(points, axis=0), axis=1)
        if not spacing.size or not spacing.all():  # repeated points are reported elsewhere
            return
        allowed = MAX_SPACINGS * float(spacing.max())
        ends = (("first", points[0], i - 1, start), ("last", points[-1], i, end))
        for end_name, point, waypoint, position in ends:
            gap = float(np.linalg.norm(point - position))
            if gap > allowed:
                raise PathError(
                    f"its {end_name} point is {self.text(gap, digits=6)} from waypoints"
                    f"[{waypoint}]; the points must begin and end at the waypoints, or at most "
                    f"this far from them: {self.text(allowed, digits=6)}, {MAX_SPACINGS:g} "
                    "times their spacing"
                )

    def _angle_between(self, i: int, first: FloatArray, second: FloatArray) -> float:
        """Angle between two rotations on a path, or with normals between their z axes [rad]."""
        if i not in self.normals:
            return float(np.linalg.norm(rotation_vector(first.T @ second)))
        across = np.linalg.norm(np.cross(first[:, 2], second[:, 2]))
        return float(np.arctan2(across, first[:, 2] @ second[:, 2]))

    def _check_begin(self, i: int, rotation: FloatArray) -> None:
        angle = self._angle_between(i, self.poses[i - 1].rotation, rotation)
        if angle > SAME_WAYPOINT_ANGLE:
            raise self.places.error(
                ("waypoints", i, *(("along", "points") if i in self.rotations else ())),
                f"at the first point the tool is rotated by {np.degrees(angle):.4g} degrees from "
                "the start of the path",
                "the orientation of the previous waypoint; or a point between the two",
            )

    def orientation(self, i: int, curve: Curve, waypoint: PathWaypoint) -> OrientationCurve:
        """Orientation of the tool on the path to waypoint i, whose pose gets its rotation."""
        leaning = self._torch_rotations(i, curve)
        rotations = self.rotations.get(i) if leaning is None else leaning
        first, requested = self.file.waypoints[i - 1], waypoint.pose.turned
        if leaning is not None and isinstance(first, PoseWaypoint) and not first.pose.turned:
            self.poses[i - 1].rotation = leaning[0]
        before, end = np.array(self.poses[i - 1].rotation), np.array(self.poses[i].rotation)
        if rotations is not None:
            self._check_begin(i, rotations[0])
            rotations[0] = before
            rotations = rotations if len(rotations) > 1 else None
        tangent = waypoint.orientation is not None and (leaning is None or rotations is None)
        with self.errors(i, "pose" if requested else "along"):
            if rotations is not None and isinstance(curve, tool_paths.ThroughPoints):
                turn = OrientationCurve.through(curve.arc_lengths, rotations)
            elif tangent:
                turn = tool_paths.tangent_orientation(curve, before)
            elif requested:
                turn = OrientationCurve.even_turning(before, end, curve.length)
            else:
                turn = OrientationCurve.constant(before, curve.length)
        if tangent and rotations is not None:
            raise self.places.error(
                ("waypoints", i, "orientation"),
                "is given together with points that have orientations",
                "orientation: tangent, or columns of orientations or normals, not both",
            )
        if requested and (tangent or rotations is not None):
            self._check_end(i, turn.rotations[-1], end)
        pose = self.poses[i].copy()
        pose.rotation = turn.rotations[-1]
        self.poses[i] = pose
        return turn

    def _check_end(self, i: int, turned: FloatArray, end: FloatArray) -> None:
        angle = self._angle_between(i, turned, end)
        if angle > SAME_WAYPOINT_ANGLE:
            raise self.places.error(
                ("waypoints", i, "pose"),
                f"is rotated by {np.degrees(angle):.4g} degrees from the end of the path",
                "no orientation if the path has its own, or that of its end",
            )

    def round_corners(
        self, first: int, curves: list[Curve], steps: list[PathWaypoint]
    ) -> tuple[list[Curve], FloatArray]:
        """The curves with corners rounded, and the arc lengths at the ends of stretches."""
        pieces: list[Curve] = []
        ends, length = [], 0.0
        begin: FloatArray | None = None  # start of a line after a rounded corner
        for k, (curve, waypoint) in enumerate(zip(curves, steps, strict=True)):
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

    def _blend(self, i: int, curves: list[Curve], distance: float) -> Curve:
        """The curve that rounds the corner between two lines."""
        lines = [curve for curve in curves if isinstance(curve, tool_paths.Line)]
        if len(lines) < 2:
            raise self.places.error(
                ("waypoints", i, "blend"),
                "rounds the corner between two lines, and this waypoint is not between two lines",
                "no blend; or along: line here and at the next waypoint",
            )
        longest = 0.5 * min(line.length for line in lines)
        if distance > longest * (1.0 + BLEND_ROUNDING):
            raise self.places.error(
                ("waypoints", i, "blend"),
                f"is {self.text(distance, digits=6)}, more than half of the shorter line",
                f"at most {self.text(longest, digits=6)}",
            )
        with self.errors(i, "blend"):
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
