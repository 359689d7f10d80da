"""How far a tool has turned about its axis, or its angles to a seam, beyond what is left open."""

from __future__ import annotations

import numpy as np

from knotwork.waypoints import FloatArray, PoseFreedom, TorchRanges


def turned_beyond(freedom: PoseFreedom, asked: FloatArray, found: FloatArray) -> FloatArray:
    """Angle by which turns are beyond their range [rad], negative inside; shape (k,).

    The turn is that of the shortest rotation that takes one z axis to the other, followed by one
    about z. Where both axes are φ apart it changes by 1/cos(φ/2) of their angular velocities at
    most. Of a torch the worst of turn, travel and work angle counts: see `torch_angles`.

    Args:
        freedom: The range; endless, it is never left.
        asked: Rotations that turns are from, shape (k, 3, 3).
        found: Rotations of the tool, shape (k, 3, 3).
    """
    least, greatest = freedom.turn
    if freedom.torch is not None:
        angles = torch_angles(freedom.torch, asked.transpose(0, 2, 1) @ found)
        spans = np.array([freedom.turn, freedom.torch.travel, freedom.torch.work])
        spans = spans[np.isfinite(spans).all(axis=1)]
        off = angles[3 - len(spans) :] - spans.mean(axis=1, keepdims=True)
        return np.asarray((np.abs(off) - 0.5 * np.diff(spans)).max(axis=0))
    if not np.isfinite(greatest - least):
        return np.full(len(found), -np.inf)
    R = asked.transpose(0, 2, 1) @ found
    turn = np.arctan2(R[:, 1, 0] - R[:, 0, 1], R[:, 0, 0] + R[:, 1, 1])
    off = np.remainder(turn - 0.5 * (least + greatest) + np.pi, 2.0 * np.pi) - np.pi
    return np.asarray(np.abs(off) - 0.5 * (greatest - least))


def torch_angles(torch: TorchRanges, turned: FloatArray) -> FloatArray:
    """Turn about its z axis, travel and work angle of a torch, from the pose's [rad], shape (3, k).

    Seen from the seam's axes leant by the pose's work angle, it stands at Rx(-work) Ry(-travel)
    diag(1, -1, -1) Rz(turn - about).

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
