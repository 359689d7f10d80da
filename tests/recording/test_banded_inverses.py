"""Entries of inverses of banded matrices within their bands."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import cholesky_banded

from knotwork.recording.banded import inverse_within_band


@pytest.mark.parametrize(("size", "width"), [(1, 1), (2, 4), (4, 4), (9, 4), (150, 4), (40, 2)])
@pytest.mark.parametrize("spread", [0.0, 3.0])
def test_they_are_those_of_the_dense_inverse(size: int, width: int, spread: float) -> None:
    """The weights of the rows differ by up to as many orders of magnitude."""
    random = np.random.default_rng(size)
    factors, inverses = [], []
    for _ in range(3):
        rows = np.zeros((4 * size, size))
        for i, row in enumerate(rows):
            row[i // 4 : i // 4 + width] = random.uniform(0.1, 1.0, min(width, size - i // 4))
        rows *= 10.0 ** random.uniform(-spread, 0.0, (4 * size, 1))
        matrix = rows.T @ rows
        band = np.zeros((width, size))
        for k in range(min(width, size)):
            band[k, : size - k] = np.diagonal(matrix, k)
        factors.append(cholesky_banded(band, lower=True))
        inverses.append(np.linalg.inv(matrix))
    found = inverse_within_band(np.stack(factors, axis=-1))
    for j, inverse in enumerate(inverses):
        scale = np.sqrt(np.outer(np.diag(inverse), np.diag(inverse)))
        for k in range(min(width, size)):
            off = (found[k, : size - k, j] - np.diagonal(inverse, k)) / np.diagonal(scale, k)
            assert np.abs(off).max() < 1e-11
