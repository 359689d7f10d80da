"""How far a tool has turned about its axis beyond what a pose leaves open."""

from __future__ import annotations

import numpy as np

from knotwork.waypoints import FloatArray, PoseFreedom


def turned_beyond(freedom: PoseFreedom, asked: FloatArray, found: FloatArray) -> FloatArray:
    """Angle by which turns are beyond their range [rad], negative inside; shape (k,).

    The turn is that of the shortest rotation that takes one z axis to the other, followed by one
    about z. Where both axes are φ apart it changes by 1/cos(φ/2) of their angular velocities at
    most.

    Args:
        freedom: The range; endless, it is never left.
        asked: Rotations that turns are from, shape (k, 3, 3).
        found: Rotations of the tool, shape (k, 3, 3).
    """
    least, greatest = freedom.turn
    if not np.isfinite(greatest - least):
        return np.full(len(found), -np.inf)
    R = asked.transpose(0, 2, 1) @ found
    turn = np.arctan2(R[:, 1, 0] - R[:, 0, 1], R[:, 0, 0] + R[:, 1, 1])
    off = np.remainder(turn - 0.5 * (least + greatest) + np.pi, 2.0 * np.pi) - np.pi
    return np.asarray(np.abs(off) - 0.5 * (greatest - least))
