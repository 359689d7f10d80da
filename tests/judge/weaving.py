"""What a weave adds to a seam, from its definition in docs/tool_paths.md and the schema."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

Added = Callable[[np.ndarray], np.ndarray]


def across(given: Mapping[str, Any], width: float, rounding: float, duration: float) -> Added:
    """A triangle across the seam, as a function of time since it begins [m].

    Args:
        given: The weave.
        width: From edge to edge [m].
        rounding: How far it may be from one with sharp corners [m].
        duration: From begin to end [s].
    """
    assert given["shape"] == "triangle", "others are not read here"
    assert not given.keys() & {"in", "normal"}, "others are not read here"
    half = 0.5 / given["frequency"]
    crossing = half - given.get("dwell", 0.0)
    turn = crossing * min(2.0 * rounding / width, 0.5)
    x = np.linspace(0.0, crossing, 20001)
    z = np.minimum(np.minimum(x, crossing - x) / turn, 1.0)
    speed = 3.0 * z**2 - 2.0 * z**3
    way = np.concatenate(([0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]))))
    way *= width / way[-1]

    def added(t: np.ndarray) -> np.ndarray:
        count, since = np.divmod(t + 0.5 * crossing, half)
        side = np.where(count % 2, -1.0, 1.0)
        r = np.clip(np.minimum(t, duration - t) / (2.0 * half), 0.0, 1.0)
        rise = r * r * r * (10.0 - r * (15.0 - 6.0 * r))
        return np.asarray(rise * side * (np.interp(since, x, way) - 0.5 * width))

    return added
