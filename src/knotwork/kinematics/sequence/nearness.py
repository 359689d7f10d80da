"""How near limits and singularities configurations are, at waypoints and between them."""

from __future__ import annotations

import numpy as np

from knotwork.kinematics.chain.joint_ranges import BoolArray
from knotwork.robot import Robot
from knotwork.robot.joint_axes import joint_axes
from knotwork.waypoints import FloatArray

# Nearer than this to a limit [rad or m] or with a singular value below, travel counts for more, up
# to twice as much on a limit, and likewise on a singularity.
LIMIT_MARGIN = 0.2
SINGULAR_MARGIN = 0.05
# Times between two waypoints at which an interval is sampled, evenly spread.
SAMPLES = 4


def limit_nearness(robot: Robot, q: FloatArray) -> FloatArray:
    """How near configurations (n, d) are to position limits, shape (n,).

    0 far, 1 on or beyond one: the square of how much of `LIMIT_MARGIN` is used up.
    """
    return np.asarray(np.clip(1.0 - _room(robot, q) / LIMIT_MARGIN, 0.0, 1.0) ** 2)


def _room(robot: Robot, q: FloatArray) -> FloatArray:
    """Distance of the joint that is nearest a limit from it, negative beyond [rad or m].

    Virtual joints, which nothing moves, do not count.
    """
    room = np.minimum(q - robot.lower_position_limit, robot.upper_position_limit - q)
    return np.asarray(room[:, ~robot.virtual].min(axis=1))


def singular_nearness(J: FloatArray) -> FloatArray:
    """How near configurations of Jacobians (n, 6, d) are to singularities, shape (n,).

    0 far, 1 on one: the square of how far below `SINGULAR_MARGIN` the smallest singular value is.
    """
    # Of J Jᵀ or Jᵀ J the smaller; its smallest eigenvalue is the square of what is asked for.
    gram = J @ J.transpose(0, 2, 1) if J.shape[2] > 6 else J.transpose(0, 2, 1) @ J
    near, result = np.flatnonzero(_any_below(gram, SINGULAR_MARGIN**2)), np.zeros(len(J))
    if near.size:
        smallest = np.sqrt(np.maximum(np.linalg.eigvalsh(gram[near])[:, 0], 0.0))
        result[near] = np.maximum(0.0, 1.0 - smallest / SINGULAR_MARGIN) ** 2
    return result


def weights(robot: Robot, q: FloatArray, J: FloatArray | None = None) -> FloatArray:
    """Factor of the travel at configurations (n, d): 1, and more near limits and singularities.

    Their Jacobians (n, 6, d) are taken where they are given.
    """
    J = joint_axes(robot).jacobians(q) if J is None else J
    return 1.0 + limit_nearness(robot, q) + singular_nearness(J)


def _any_below(gram: FloatArray, margin: float) -> BoolArray:
    """Which symmetric matrices (n, k, k) have an eigenvalue below a margin, shape (n,).

    Those that are not positive definite less the margin: a pivot of their factorisation shows it,
    and takes a fraction of the time that eigenvalues take.
    """
    A = np.array(gram.transpose(1, 2, 0), order="C")
    k, n = A.shape[1:]
    A[range(k), range(k)] -= margin
    below = np.zeros(n, dtype=bool)
    for j in range(k):
        below |= ~(A[j, j] > 0.0)
        column = A[j + 1 :, j] / np.where(below, 1.0, A[j, j])
        A[j + 1 :, j + 1 :] -= column[:, None] * A[j, j + 1 :]
    return below


def interval_nearness(
    robot: Robot,
    start: tuple[FloatArray, FloatArray],
    end: tuple[FloatArray, FloatArray],
    durations: FloatArray,
    samples: int = SAMPLES,
    ends: tuple[FloatArray, FloatArray] | None = None,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """How near limits and singularities cubics between configurations come, and how far beyond.

    Each joint moves as the cubic Hermite polynomial with these positions and velocities, which is
    near what any planner makes of them.

    Args:
        robot: The robot.
        start: Joint positions [rad or m] and velocities [rad/s or m/s], shape (n, d) each.
        end: Likewise.
        durations: [s], shape (n,).
        samples: Times between at which it is evaluated, evenly spread.
        ends: `weights` at the start and at the end, if these are to count too, shape (n,) each.

    Returns:
        Of `weights` beyond 1 the mean by the trapezoidal rule, shape (n,), and the most, (n,);
        without the ends their share of the mean is left out. And how far a joint is beyond a
        position limit on the way [rad or m], shape (n,).
    """
    (q0, v0), (q1, v1) = start, end
    mean, most, beyond = np.zeros((3, len(q0)))
    if samples:
        s = np.linspace(0.0, 1.0, samples + 2)[1:-1, None, None]
        q = (1 + 2 * s) * (1 - s) ** 2 * q0 + s**2 * (3 - 2 * s) * q1
        q = q + durations[:, None] * s * (1 - s) * ((1 - s) * v0 - s * v1)
        q = q.reshape(-1, robot.dof)
        near = weights(robot, q).reshape(samples, -1) - 1.0
        beyond = np.maximum(0.0, -_room(robot, q).reshape(samples, -1).min(axis=0))
        mean, most = near.sum(axis=0) / (samples + 1), near.max(axis=0)
    if ends is not None:
        first, last = ends[0] - 1.0, ends[1] - 1.0
        mean = mean + 0.5 * (first + last) / (samples + 1)
        most = np.maximum(most, np.maximum(first, last))
    return mean, most, beyond
