"""Arithmetic with bounds on derivatives.

The bounds of a quantity are an array whose entry k bounds the norm of its k-th time derivative, one
column per time interval. Sums of quantities add their bounds; products follow Leibniz's rule.
"""

from __future__ import annotations

from functools import lru_cache
from math import comb

import numpy as np

from knotwork.waypoints import FloatArray


def product(a: FloatArray, b: FloatArray) -> FloatArray:
    """Bound the derivatives of a product: |(ab)^(k)| <= sum of C(k, m) |a^(m)| |b^(k-m)|.

    This holds for every product with |ab| <= |a| |b|: of numbers, of a number and a vector, dot and
    cross product, and a matrix applied to a vector.

    Args:
        a: Bounds of the first factor, shape (orders, n).
        b: Bounds of the second factor, possibly with another number of orders.

    Returns:
        Bounds of the common orders.
    """
    orders = min(len(a), len(b))
    result = np.asarray(a[0] * b[:orders])
    for m in range(1, orders):
        result[m:] += _choose(orders)[m:, m] * (a[m] * b[: orders - m])
    return result


def unit_bounds(angular: FloatArray, constant: float = 1.0) -> FloatArray:
    """Bound the derivatives of a unit vector fixed in a body, from its angular velocity.

    Args:
        angular: Bounds of the body's angular velocity, shape (k, n).
        constant: Factor of the rate: 1 for vectors, 2 for tensors T, whose rate is ωT - Tω.

    Returns:
        Bounds of orders 0 … k, shape (k+1, n).
    """
    orders = len(angular)
    result = np.empty((orders + 1, *angular.shape[1:]))
    result[0] = 1.0
    for k in range(orders):
        factor = constant * _choose(orders)[k, : k + 1]
        result[k + 1] = (factor * (angular[: k + 1] * result[k::-1])).sum(axis=0)
    return result


@lru_cache(maxsize=16)
def _choose(orders: int) -> FloatArray:
    """C(k, m), zero for m above k, shape (orders, orders, 1)."""
    return np.array([[[float(comb(k, m))] for m in range(orders)] for k in range(orders)])
