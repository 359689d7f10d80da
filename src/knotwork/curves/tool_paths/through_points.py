"""`ThroughPoints`: a smooth curve through many points, for example from CAD."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from knotwork.curves.tool_paths.curve import SAME_POINT, geometry_error, to_unit_vector
from knotwork.curves.tool_paths.points_file import read_points
from knotwork.curves.tool_paths.polynomial_curve import PolynomialCurve
from knotwork.errors import PathError
from knotwork.waypoints import FloatArray, read_only


class ThroughPoints(PolynomialCurve):
    """Cubic spline through points, twice continuously differentiable, parametrised by arc length.

    The spline's parameter is the distance along the chords. Without directions at its ends it is a
    not-a-knot spline.

    Args:
        points: The points [m], shape (n, 3), n >= 2.
        start_direction: Direction at the first point, shape (3,).
        end_direction: Direction at the last point, shape (3,).
        quaternions: Rotations of the tool at the points (x, y, z, w), shape (n, 4), stored only.
        normals: Surface normals at the points, shape (n, 3), stored only.

    Attributes:
        points: The points.
        quaternions: Unit quaternions with consistent signs, or `None`.
        rotations: Rotation matrices of the quaternions, shape (n, 3, 3), or `None`.
        normals: Unit normals, or `None`.
        arc_lengths: Arc lengths at the points [m], shape (n,).

    Raises:
        WaypointDataError: Points are not finite or have a wrong shape.
        PathError: There are fewer than two points, two neighbours are the same, or the curve stops
            or turns back.

    >>> points = [[0, 0, 0], [0.1, 0, 0], [0.2, 0.05, 0], [0.3, 0.05, 0]]
    >>> kw.tool_paths.ThroughPoints(points).arc_lengths.round(6)
    array([0.      , 0.103013, 0.214897, 0.317909])
    """

    def __init__(
        self,
        points: ArrayLike,
        *,
        start_direction: ArrayLike | None = None,
        end_direction: ArrayLike | None = None,
        quaternions: ArrayLike | None = None,
        normals: ArrayLike | None = None,
    ) -> None:
        from scipy.interpolate import CubicSpline

        count = len(np.atleast_1d(np.asarray(points)))
        self.points = read_only(points, (count, 3), "points")
        if count < 2:
            raise PathError(f"{count} points are given; a curve needs at least two")
        chords = np.linalg.norm(np.diff(self.points, axis=0), axis=1)
        if (chords <= SAME_POINT).any():
            i = int((chords <= SAME_POINT).argmax())
            raise geometry_error(
                f"points {i} and {i + 1} are the same, {{point}}; leave one out",
                point=self.points[i],
            )
        x = np.concatenate(([0.0], np.cumsum(chords)))
        ends = [
            "not-a-knot" if direction is None else (1, to_unit_vector(direction, name))
            for direction, name in (
                (start_direction, "start_direction"),
                (end_direction, "end_direction"),
            )
        ]
        c = CubicSpline(x, self.points, bc_type=tuple(ends)).c
        powers = np.arange(len(c) - 1, -1, -1.0)[:, None, None]
        # The coefficients of SciPy are for the chord distance, these are for a unit parameter.
        super().__init__(c * np.diff(x)[:, None] ** powers)
        self.arc_lengths: FloatArray = self.piece_ends
        self.quaternions: FloatArray | None = None
        self.rotations: FloatArray | None = None
        if quaternions is not None:
            from scipy.spatial.transform import Rotation

            self.quaternions = _align_signs(quaternions, count)
            self.rotations = Rotation.from_quat(self.quaternions).as_matrix()
        self.normals: FloatArray | None = None
        if normals is not None:
            vectors = read_only(normals, (count, 3), "normals")
            self.normals = np.array(
                [to_unit_vector(vector, f"normals[{i}]") for i, vector in enumerate(vectors)]
            )

    def bulges(self) -> FloatArray:
        """Largest distances from the straight lines between successive points [m], shape (n - 1,).

        They are sampled, and show points that are few or uneven.
        """
        fractions = np.linspace(0.0, 1.0, 17)
        s = self.arc_lengths[:-1, None] + np.diff(self.arc_lengths)[:, None] * fractions
        offset = self.position(s.ravel()).reshape(*s.shape, 3) - self.points[:-1, None]
        chord = np.diff(self.points, axis=0)[:, None]
        along = np.clip((offset * chord).sum(axis=2) / (chord**2).sum(axis=2), 0.0, 1.0)
        return np.asarray(np.linalg.norm(offset - along[:, :, None] * chord, axis=2).max(axis=1))

    @classmethod
    def from_csv(cls, path: str | Path, length_unit: float = 1.0) -> ThroughPoints:
        """Read the points from a CSV file.

        The first row has the headings: x, y, z and optionally qx, qy, qz, qw for the tool's
        rotation or nx, ny, nz for the surface normal, in any order. Empty rows and rows that start
        with `#` are skipped.

        Args:
            path: The file.
            length_unit: Unit of length in the file [m].

        Raises:
            DocumentError: The file can't be read, a heading or value is wrong, or two neighbouring
                points are the same; with its line and column.
            PathError: The curve stops or turns back.
        """
        points, quaternions, normals = read_points(Path(path), length_unit)
        try:
            return cls(points, quaternions=quaternions, normals=normals)
        except PathError as error:
            error.locate(str(path))
            raise


def _align_signs(quaternions: ArrayLike, count: int) -> FloatArray:
    """Unit quaternions with signs that are consistent between neighbours.

    Raises:
        PathError: A quaternion is zero.
    """
    values = read_only(quaternions, (count, 4), "quaternions")
    size = np.linalg.norm(values, axis=1)
    if not size.all():
        raise PathError(f"quaternion {int(size.argmin())} is zero; it must have a length of 1")
    unit_quaternions = values / size[:, None]
    turned = np.einsum("ki,ki->k", unit_quaternions[1:], unit_quaternions[:-1]) < 0.0
    unit_quaternions[1:] *= np.where(np.cumsum(turned) % 2 == 1, -1.0, 1.0)[:, None]
    return np.asarray(unit_quaternions)
