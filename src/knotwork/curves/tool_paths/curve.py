"""`Curve`: the interface of curves in space, parametrised by arc length."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import ArrayLike

from knotwork.arrays import FloatArray, checked_array
from knotwork.errors import PathError

SAME_POINT = 1e-9
"""Distance within which points count as one [m]."""


class Curve(ABC):
    """A smooth curve in space as a function of its arc length s, 0 <= s <= length [m].

    Attributes:
        length: Length of the curve [m].
    """

    length: float

    @abstractmethod
    def position(self, s: ArrayLike, order: int = 0) -> FloatArray:
        """Points of the curve, or their derivatives with respect to arc length.

        The curve is extended smoothly beyond both ends.

        Args:
            s: Arc lengths [m], shape (k,).
            order: Order of the derivative, 0 to 3.

        Returns:
            Points [m], or derivatives [m^(1 - order)], shape (k, 3).
        """

    def derivatives(self, s: ArrayLike, order: int) -> list[FloatArray]:
        """Points of the curve and their derivatives up to an order: see `position`."""
        return [self.position(s, k) for k in range(checked_curve_order(order) + 1)]

    @abstractmethod
    def nearest(self, points: ArrayLike, guess: ArrayLike) -> FloatArray:
        """Arc lengths of the nearest points of the curve, near a guess.

        Args:
            points: Points in space [m], shape (k, 3).
            guess: Arc lengths to start from [m], shape (k,).

        Returns:
            Arc lengths in [0, length] [m], shape (k,).
        """

    @abstractmethod
    def curvature_bound(self, s0: ArrayLike, s1: ArrayLike) -> FloatArray:
        """Upper bounds of the curvature from arc length s0 to s1 [1/m], shape (k,)."""

    def chords_and_bulges(self) -> FloatArray:
        """Lengths of the chords between given points, and largest distances from them [m].

        Shape (2, n - 1) for n points; a large bulge shows points that are few or uneven.
        """
        return np.empty((2, 0))


def sort_ends(s0: ArrayLike, s1: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Lower and upper ends of intervals, shape (k,) each."""
    ends = np.broadcast_arrays(np.asarray(s0, dtype=float), np.asarray(s1, dtype=float))
    return np.minimum(*ends), np.maximum(*ends)


def checked_curve_order(order: int, max_order: int = 3) -> int:
    """Return the order of a derivative.

    Raises:
        PathError: The order is not one of 0 to `max_order`.
    """
    if order not in range(max_order + 1):
        raise PathError(f"derivative order is {order!r}; accepted: 0 to {max_order}")
    return int(order)


def to_unit_vector(direction: ArrayLike, name: str) -> FloatArray:
    """Return a direction as a unit vector, shape (3,).

    Raises:
        PathError: The direction is zero.
    """
    vector = checked_array(direction, (3,), name)
    size = float(np.linalg.norm(vector))
    if size == 0.0:
        raise PathError(f"{name} is zero; it must be a direction")
    return np.asarray(vector / size)


def geometry_error(text: str, **values: float | FloatArray) -> PathError:
    """Make the error for points and lengths that define no curve.

    Args:
        text: The message, with the names of the values in braces.
        values: Points [m], shape (3,), and lengths [m].
    """
    message = PathError(text=text, values=values).in_units("{:.9g} m".format, point_text)
    return PathError(message, text=text, values=values)


def point_text(point: FloatArray) -> str:
    """Write a point for a message: `(0.1, 0.2, 0.3) m`."""
    return f"({', '.join(f'{value:.9g}' for value in point)}) m"
