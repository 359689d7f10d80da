"""A tool's turn about its axis and its angles to a seam, and their excess over free ranges."""

from __future__ import annotations

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.waypoints import PoseFreedom, TorchRanges


def open_ranges(freedom: PoseFreedom) -> dict[tuple[str, str], tuple[float, float]]:
    """Free ranges [rad or m] by name, as messages write it, and unit."""
    spans: dict[tuple[str, str], tuple[float, float]] = {("turn", "rad"): freedom.turn}
    if freedom.torch is not None:
        torch = freedom.torch
        for name, (low, high), angle in (
            ("travel angle", torch.travel, torch.pose_travel),
            ("work angle", torch.work, torch.pose_work),
        ):
            spans[name, "rad"] = (angle + low, angle + high)
    else:
        spans["tilt", "rad"] = (0.0, freedom.tilt)
    spans |= {(axis, "m"): span for axis, span in zip("xyz", freedom.box, strict=True)}
    return {key: (low, high) for key, (low, high) in spans.items() if low < high}


def turned_beyond(freedom: PoseFreedom, requested: FloatArray, reached: FloatArray) -> FloatArray:
    """Excess of poses over their free ranges, each pose by itself [rad], negative inside; (k,).

    Args:
        freedom: The ranges; unlimited ones are never exceeded.
        requested: Reference rotations, shape (k, 3, 3).
        reached: Rotations of the tool, shape (k, 3, 3).
    """
    angles = centre_turns(freedom, free_angles(freedom, requested, reached))
    return excess_over_ranges(freedom, angles)


def free_angles(freedom: PoseFreedom, requested: FloatArray, reached: FloatArray) -> FloatArray:
    """Turn, and travel and work angle of a torch (otherwise zero), relative to the reference [rad].

    The turn is the yaw of roll, pitch and yaw in the reference axes: the tool turns about z and
    then tilts. At an angle φ between the z axes, the rate of the turn is at most 1/cos(φ) times the
    rates of the tool and the reference.

    Args:
        freedom: The freedom, with or without a torch.
        requested: Reference rotations, shape (k, 3, 3).
        reached: Rotations of the tool, shape (k, 3, 3).

    Returns:
        Shape (k, 3), turns within half a turn.
    """
    R = requested.transpose(0, 2, 1) @ reached
    if freedom.torch is not None:
        return torch_angles(freedom.torch, R).T
    turn = np.arctan2(R[:, 1, 0], R[:, 0, 0])
    return np.stack((turn, np.zeros_like(turn), np.zeros_like(turn)), axis=1)


def centre_turns(freedom: PoseFreedom, angles: FloatArray) -> FloatArray:
    """Shift the turn of each of k angles (k, 3) by whole turns, nearest the middle of its range."""
    middle = sum(freedom.turn) / 2 if np.isfinite(freedom.turn).all() else 0.0
    turn = middle + np.remainder(angles[:, 0] - middle + np.pi, 2.0 * np.pi) - np.pi
    return np.column_stack((turn, angles[:, 1:]))


def continue_turns(angles: FloatArray, start: float) -> FloatArray:
    """Shift the turns of angles (k, 3) by whole turns, continuous and first near `start` [rad]."""
    turn = np.unwrap(np.concatenate(([start], angles[:, 0])))[1:]
    return np.column_stack((turn, angles[:, 1:]))


def excess_over_ranges(freedom: PoseFreedom, angles: FloatArray) -> FloatArray:
    """Largest excess of angles (k, 3) over their ranges [rad], shape (k,)."""
    torch = freedom.torch
    spans = [freedom.turn] if torch is None else [freedom.turn, torch.travel, torch.work]
    worst = np.full(len(angles), -np.inf)
    for (low, high), angle in zip(spans, angles.T, strict=False):
        worst = np.maximum(worst, np.maximum(low - angle, angle - high))
    return worst


def torch_angles(torch: TorchRanges, turned: FloatArray) -> FloatArray:
    """Turn, travel and work angle of a torch, relative to the pose's [rad], shape (3, k).

    In the axes of the seam, tilted by the work angle of the pose, its rotation is Rx(-work)
    Ry(-travel) diag(1, -1, -1) Rz(turn - axis_angle). The rates of turn and work angle are at
    most 1/cos(travel angle) times its angular velocity.

    Args:
        torch: The torch, with the pose's angles.
        turned: Rotations of the torch in the axes of the pose, shape (k, 3, 3).
    """
    c, s = np.cos(torch.pose_travel), np.sin(torch.pose_travel)
    cosine, sine = np.cos(torch.axis_angle), np.sin(torch.axis_angle)
    leant = np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])
    axes = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    R = leant @ np.diag([1.0, -1.0, -1.0]) @ axes @ turned @ axes.T
    travel = np.arcsin(np.clip(R[:, 0, 2], -1.0, 1.0))
    work, turn = np.arctan2(-R[:, 1, 2], -R[:, 2, 2]), np.arctan2(-R[:, 0, 1], R[:, 0, 0])
    return np.array([turn, travel - torch.pose_travel, work])
