"""Closed-form inverse kinematics of a UR5 and of an arm with a spherical wrist: the truth."""

from __future__ import annotations

import numpy as np

import urdfs

Array = np.ndarray
# Denavit–Hartenberg parameters of the UR5 as its manufacturer publishes them [m].
D1, A2, A3, D4, D5, D6 = 0.089159, -0.425, -0.39225, 0.10915, 0.09465, 0.0823
UR5_DH = [
    (0.0, D1, np.pi / 2),
    (A2, 0.0, 0.0),
    (A3, 0.0, 0.0),
    (0.0, D4, np.pi / 2),
    (0.0, D5, -np.pi / 2),
    (0.0, D6, 0.0),
]


def link(angle: float, a: float, d: float, alpha: float) -> Array:
    """Transform of one joint: turn about z, along z, along x, turn about x."""
    c, s, ca, sa = np.cos(angle), np.sin(angle), np.cos(alpha), np.sin(alpha)
    return np.array(
        [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]]
    )


def turned(q: Array) -> Array:
    """Angles within half a turn of zero."""
    return (np.asarray(q) + np.pi) % (2 * np.pi) - np.pi


def ur5(pose: Array) -> list[Array]:
    """Every solution of a UR5 for its flange in the controller's base, shape (4, 4).

    The wrist centre O5 = p − d6 z lies at distance d4 from the plane of the arm, which gives
    joint 1; the angle between that plane and the tool joint 5; the tool's axes joint 6; the law
    of cosines joints 2, 3 and 4.
    """
    R, p = pose[:3, :3], pose[:3, 3]
    centre = p - D6 * R[:, 2]
    radius = np.hypot(centre[0], centre[1])
    if radius < D4:
        return []
    found = []
    for shoulder in (1, -1):
        q1 = np.arctan2(centre[1], centre[0]) + shoulder * np.arccos(D4 / radius) + np.pi / 2
        s1, c1 = np.sin(q1), np.cos(q1)
        cosine = (p[0] * s1 - p[1] * c1 - D4) / D6
        if abs(cosine) > 1:
            continue
        for wrist in (1, -1):
            q5 = wrist * np.arccos(cosine)
            s5 = np.sin(q5)
            q6 = np.arctan2((-R[0, 1] * s1 + R[1, 1] * c1) / s5, (R[0, 0] * s1 - R[1, 0] * c1) / s5)
            first = link(q1, *UR5_DH[0])
            last = link(q5, *UR5_DH[4]) @ link(q6, *UR5_DH[5])
            arm = np.linalg.inv(first) @ pose @ np.linalg.inv(last)
            # Of joints 2 to 4: their sum, and where joint 4 is in the plane of the arm.
            total = np.arctan2(arm[1, 0], arm[0, 0])
            x, y = arm[0, 3], arm[1, 3]
            cosine3 = (x * x + y * y - A2 * A2 - A3 * A3) / (2 * A2 * A3)
            if abs(cosine3) > 1:
                continue
            for elbow in (1, -1):
                q3 = elbow * np.arccos(cosine3)
                q2 = np.arctan2(y, x) - np.arctan2(A3 * np.sin(q3), A2 + A3 * np.cos(q3))
                found.append(turned([q1, q2, q3, total - q2 - q3, q5, q6]))
    return found


# An arm in the manner of a Puma: base height, shoulder offset from joint 1, shoulder to elbow,
# elbow to wrist centre, wrist centre to flange [m].
HEIGHT, OFFSET, UPPER, FOREARM, FLANGE = 0.5, 0.15, 0.6, 0.55, 0.12


def spherical_wrist_urdf() -> str:
    """The arm: z, then y, y, then the wrist z, y, z; straight up at zero."""
    joints = [
        ("0 0 0", "0 0 1"),
        (f"{OFFSET} 0 {HEIGHT}", "0 1 0"),
        (f"0 0 {UPPER}", "0 1 0"),
        (f"0 0 {FOREARM}", "0 0 1"),
        ("0 0 0", "0 1 0"),
        ("0 0 0", "0 0 1"),
    ]
    wide = urdfs.limits(-3.2, 3.2, velocity=3, effort=50)
    parts = [urdfs.link(f"l{i}") for i in range(8)]
    for i, (xyz, axis) in enumerate(joints):
        parts.append(urdfs.joint(f"j{i + 1}", f"l{i}", f"l{i + 1}", at=xyz, axis=axis, more=wide))
    return urdfs.robot(*parts, urdfs.joint("flange", "l6", "l7", "fixed", at=f"0 0 {FLANGE}"))


def _about(axis: str, angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array(
        [[c, -s, 0], [s, c, 0], [0, 0, 1]] if axis == "z" else [[c, 0, s], [0, 1, 0], [-s, 0, c]]
    )


def spherical_wrist(pose: Array) -> list[Array]:
    """Every solution of that arm for its flange, shape (4, 4)."""
    R, p = pose[:3, :3], pose[:3, 3]
    centre = p - FLANGE * R[:, 2]
    found = []
    for front in (1, -1):
        q1 = np.arctan2(front * centre[1], front * centre[0])
        x = front * np.hypot(centre[0], centre[1]) - OFFSET
        z = centre[2] - HEIGHT
        cosine = (x * x + z * z - UPPER**2 - FOREARM**2) / (2 * UPPER * FOREARM)
        if abs(cosine) > 1:
            continue
        for elbow in (1, -1):
            q3 = elbow * np.arccos(cosine)
            q2 = np.arctan2(x, z) - np.arctan2(FOREARM * np.sin(q3), UPPER + FOREARM * np.cos(q3))
            wrist = (_about("z", q1) @ _about("y", q2 + q3)).T @ R
            for flip in (1, -1):
                q5 = flip * np.arctan2(np.hypot(wrist[0, 2], wrist[1, 2]), wrist[2, 2])
                q4 = np.arctan2(flip * wrist[1, 2], flip * wrist[0, 2])
                q6 = np.arctan2(flip * wrist[2, 1], -flip * wrist[2, 0])
                found.append(turned([q1, q2, q3, q4, q5, q6]))
    return found
