"""How far a tool has turned about its axis, or its angles to a seam, beyond what is left open."""

from __future__ import annotations

import numpy as np

from knotwork.waypoints import FloatArray, PoseFreedom, TorchRanges


def open_ranges(freedom: PoseFreedom) -> dict[tuple[str, str], tuple[float, float]]:
    """What is free, by name and unit, from what to what [rad or m], as the file gives it."""
    spans: dict[tuple[str, str], tuple[float, float]] = {("turn", "rad"): freedom.turn}
    if freedom.torch is not None:
        (low, high), own = freedom.torch.travel, freedom.torch.own
        spans["travel angle", "rad"] = (own + low, own + high)
        (low, high), own = freedom.torch.work, freedom.torch.own_work
        spans["work angle", "rad"] = (own + low, own + high)
    else:
        spans["tilt", "rad"] = (0.0, freedom.tilt)
    spans |= {(axis, "m"): span for axis, span in zip("xyz", freedom.box, strict=True)}
    return {key: (low, high) for key, (low, high) in spans.items() if low < high}


def turned_beyond(freedom: PoseFreedom, asked: FloatArray, found: FloatArray) -> FloatArray:
    """Angle by which single poses are beyond their ranges [rad], negative inside; shape (k,).

    Args:
        freedom: The ranges; endless ones are never left.
        asked: Rotations that turns are from, shape (k, 3, 3).
        found: Rotations of the tool, shape (k, 3, 3).
    """
    return beyond_ranges(freedom, nearest_turns(freedom, free_angles(freedom, asked, found)))


def free_angles(freedom: PoseFreedom, asked: FloatArray, found: FloatArray) -> FloatArray:
    """Turn, and travel and work angle of a torch (else zeros), from those asked for [rad].

    The turn is the yaw of roll, pitch and yaw in the axes asked for: the tool turns about z and
    then leans. Where both z axes are φ apart it changes by 1/cos(φ) of their angular velocities at
    most.

    Args:
        freedom: Of a torch or not.
        asked: Rotations that angles are from, shape (k, 3, 3).
        found: Rotations of the tool, shape (k, 3, 3).

    Returns:
        Shape (k, 3), turns within half a turn.
    """
    R = asked.transpose(0, 2, 1) @ found
    if freedom.torch is not None:
        return torch_angles(freedom.torch, R).T
    turn = np.arctan2(R[:, 1, 0], R[:, 0, 0])
    return np.stack((turn, np.zeros_like(turn), np.zeros_like(turn)), axis=1)


def nearest_turns(freedom: PoseFreedom, angles: FloatArray) -> FloatArray:
    """Angles (k, 3) with each turn by itself as near the middle of its range as it can be."""
    middle = sum(freedom.turn) / 2 if np.isfinite(freedom.turn).all() else 0.0
    turn = middle + np.remainder(angles[:, 0] - middle + np.pi, 2.0 * np.pi) - np.pi
    return np.column_stack((turn, angles[:, 1:]))


def followed_turns(angles: FloatArray, start: float) -> FloatArray:
    """Angles (k, 3) with turns that go on from one to the next, the first as near `start` [rad]."""
    turn = np.unwrap(np.concatenate(([start], angles[:, 0])))[1:]
    return np.column_stack((turn, angles[:, 1:]))


def beyond_ranges(freedom: PoseFreedom, angles: FloatArray) -> FloatArray:
    """Angle by which the worst of angles (k, 3) is beyond its range [rad], shape (k,)."""
    torch = freedom.torch
    spans = [freedom.turn] if torch is None else [freedom.turn, torch.travel, torch.work]
    worst = np.full(len(angles), -np.inf)
    for (low, high), one in zip(spans, angles.T, strict=False):
        worst = np.maximum(worst, np.maximum(low - one, one - high))
    return worst


def torch_angles(torch: TorchRanges, turned: FloatArray) -> FloatArray:
    """Turn about its z axis, travel and work angle of a torch, from the pose's [rad], shape (3, k).

    Seen from the seam's axes leant by the pose's work angle, it stands at Rx(-work) Ry(-travel)
    diag(1, -1, -1) Rz(turn - about). Turn and work angle change by 1/cos(travel angle) of its
    angular velocity at most.

    Args:
        torch: Has the pose's own angles.
        turned: Its rotations in the axes of the pose, shape (k, 3, 3).
    """
    c, s, cosine, sine = (f(a) for a in (torch.own, torch.about) for f in (np.cos, np.sin))
    leant = np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])
    about = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    R = leant @ np.diag([1.0, -1.0, -1.0]) @ about @ turned @ about.T
    travel = np.arcsin(np.clip(R[:, 0, 2], -1.0, 1.0))
    work, turn = np.arctan2(-R[:, 1, 2], -R[:, 2, 2]), np.arctan2(-R[:, 0, 1], R[:, 0, 0])
    return np.array([turn, travel - torch.own, work])
