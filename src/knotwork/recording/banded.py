"""The inverse of a banded matrix within its band, in linear time."""

from __future__ import annotations

import numpy as np

from knotwork.waypoints import FloatArray


def inverse_within_band(factors: FloatArray) -> FloatArray:
    """Entries of the inverse of A = L Lᵀ where A has some, for several matrices at once.

    With the last rows known, row i follows from Lᵀ A⁻¹ = L⁻¹, whose entries right of the diagonal
    are zero (Takahashi's equations). Each step needs the inverse next to it only.

    Args:
        factors: Diagonals of the L below each other, as from `scipy.linalg.cholesky_banded`
            with `lower=True`, shape (p + 1, K, d).

    Returns:
        Diagonal k of the inverse in row k, starting at its first entry, shape (p + 1, K, d).
    """
    width, size, count = factors.shape
    columns = np.moveaxis(factors, 1, 0)
    shares = (columns[:, 1:] / columns[:, :1]).transpose(0, 2, 1)[..., None]  # (K, d, p, 1)
    pivots = columns[:, 0] ** -2.0
    inverse = np.empty((size, count, width))
    known = np.zeros((count, width, width))  # that of rows i to i + p
    for i in range(size - 1, -1, -1):
        share = shares[i]
        beside = -(known[:, :-1, :-1] @ share)
        known[:, 1:, 1:] = known[:, :-1, :-1].copy()
        known[:, 0, 0] = pivots[i] - (share * beside).sum(axis=(1, 2))
        known[:, 0, 1:] = known[:, 1:, 0] = beside[..., 0]
        inverse[i] = known[:, 0]
    return np.ascontiguousarray(inverse.transpose(2, 0, 1))
