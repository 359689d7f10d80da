"""How much of its limits a quantity uses, over time."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from knotwork.waypoints import FloatArray


def limit_share(values: ArrayLike, lower: ArrayLike, upper: ArrayLike) -> FloatArray:
    """Part of the limit on its side that each value uses; NaN where there is none.

    As in findings, a value between two limits of one sign uses the more of them.

    Args:
        values: In the limits' unit, shape (n,) or (n, d).
        lower: Lower limits, shape () or (d,); infinite where there are none.
        upper: Upper limits, likewise.

    Returns:
        Signed as the values are, of their shape; beyond ±1 a limit is broken.

    >>> limit_share([-1.0, 0.5, 2.0], -2.0, 1.0)
    array([-0.5,  0.5,  2. ])
    """
    q, low, high = np.broadcast_arrays(np.asarray(values, float), lower, upper)
    with np.errstate(divide="ignore", invalid="ignore"):
        outer = np.where(q >= 0.0, q / np.abs(high), q / np.abs(low))
        inner = np.where(low > 0.0, low / q, np.where(high < 0.0, -high / q, 0.0))
        share = np.where(np.abs(inner) > np.abs(outer), inner, outer)
    limit = np.where(q >= 0.0, high, low)
    return np.asarray(np.where(np.isfinite(limit), share, np.nan))
