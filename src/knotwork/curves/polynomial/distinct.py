"""Distinct values of an array."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

NumberT = TypeVar("NumberT", np.float64, np.intp)


def sort_distinct(values: NDArray[NumberT], *others: ArrayLike) -> NDArray[NumberT]:
    """Return the distinct values in order.

    `np.unique` does the same, but first loads NumPy's masked arrays, which takes longer than all
    other NumPy imports of a plan.

    Args:
        values: Values of any shape, without NaN.
        others: Additional values: scalars or arrays of any shape.

    Returns:
        Shape (k,).

    >>> from knotwork.curves.polynomial.distinct import sort_distinct
    >>> sort_distinct(np.array([[2.0, 1.0], [1.0, 0.0]]), [0.5, 2.0], 3.0)
    array([0. , 0.5, 1. , 2. , 3. ])
    """
    ordered = np.concatenate([np.ravel(array) for array in (values, *others)])
    ordered.sort()
    is_new = np.ones(ordered.shape, bool)
    np.not_equal(ordered[1:], ordered[:-1], out=is_new[1:])
    return ordered[is_new]
