"""One step along a tool path from several starts, halved where it leaves the path."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.tool_paths import TimedPath
from knotwork.robot.kinematics.following.joint_field import JointField

PATH_ERROR = 1e-7
"""Distance from the path after a step [m, rad] above which the step was too long."""
MAX_CORRECTION = 1e-3
"""Correction by Newton's method above which a step is halved [rad or m], because it could end in
another branch.
"""
MAX_HALVINGS = 9
"""Number of halvings after which the start is blocked."""
MIDPOINT_TOLERANCE = 1e-3
"""Difference of the two midpoints of a step above which it is halved [rad or m].

Joint speeds may peak within such a step, and the self-motion of a redundant arm would deviate from
the integral.
"""
HOPELESS_SPEED_FACTOR = 1000.0
"""Factor on the limits of joint speeds above which a continuation ends, because the arm is singular
there. It does not end if a tool speed above 1 m/s or rad/s is the cause.
"""


class Stages(NamedTuple):
    """Motion of the tool at m times of one piece of a path.

    Attributes:
        time: Times [s], shape (m,).
        position: TCP positions [m], shape (m, 3).
        rotation: Tool rotations, shape (m, 3, 3).
        twist: Tool velocities [m/s, rad/s], shape (m, 6).
        speed_fraction: Tool speeds relative to the full speed of the path, shape (m,).
        arc_length: Arc lengths [m], shape (m,).
    """

    time: FloatArray
    position: FloatArray
    rotation: FloatArray
    twist: FloatArray
    speed_fraction: FloatArray
    arc_length: FloatArray

    @classmethod
    def evaluate(cls, field: JointField, path: TimedPath, time: FloatArray, at: float) -> Stages:
        """Evaluate the piece of a path that contains `at` at some times."""
        position, rotation, twist, _ = path.state(time, at=at)
        speed_fraction = np.linalg.norm(twist[:, :3], axis=1) / path.full_speed
        return cls(time, position, rotation, twist, speed_fraction, field.arc_lengths(path, time))

    def velocities(self, field: JointField, q: FloatArray, k: int) -> FloatArray:
        """Joint velocities at the k-th time, shape (n, d)."""
        return field.velocities(q, self.twist[k], self.speed_fraction[k], self.arc_length[k])

    def of_step(self, k: int) -> Stages:
        """The stages of the step that starts at the k-th: that one and the next two."""
        return Stages(*(values[k : k + 3] for values in self))


class StepEnd(NamedTuple):
    """End of a step.

    Attributes:
        q: Joint positions [rad or m], shape (n, d); NaN for a blocked start.
        reached: Time at the end of the step [s], shape (n,); for a blocked start, the time at
            which it was blocked.
        smallest_singular_value: Smallest singular value of the Jacobian where a start was blocked,
            NaN for other starts, shape (n,).
    """

    q: FloatArray
    reached: FloatArray
    smallest_singular_value: FloatArray


def take_step(
    field: JointField,
    path: TimedPath,
    plausible: FloatArray,
    q: FloatArray,
    v: FloatArray,
    stages: Stages,
    halvings: int = MAX_HALVINGS,
) -> StepEnd:
    """Take one step from some starts; halve it for those that leave the path.

    Args:
        field: Joint velocities along the path.
        path: The path.
        plausible: Highest plausible joint speeds [rad/s or m/s], shape (d,).
        q: Joint positions at the start [rad or m], shape (n, d).
        v: Joint velocities at the start [rad/s or m/s], shape (n, d).
        stages: Tool motion at the start, the middle and the end.
        halvings: Number of halvings that are left.
    """
    start, middle, end = stages.time
    guess, midpoint_error = _step(field, q, v, stages, end - start)
    end_q, error = field.project(guess, stages.position[2], stages.rotation[2])
    fast = max(1.0, float(np.abs(stages.twist[0]).max()))
    hopeless = (np.abs(v) > HOPELESS_SPEED_FACTOR * fast * plausible).any(axis=1)
    off_path = ~(error <= PATH_ERROR) | ~(
        np.abs(end_q - guess).max(axis=1, initial=0.0) <= MAX_CORRECTION
    )
    off_path |= hopeless | ~(midpoint_error <= MIDPOINT_TOLERANCE)
    result = StepEnd(end_q, np.full(len(q), end), np.full(len(q), np.nan))
    if not off_path.any():
        return result
    result.reached[off_path] = start
    result.smallest_singular_value[off_path] = field.smallest_singular_values(q[off_path])
    result.q[off_path] = np.nan
    retried = np.flatnonzero(off_path & ~hopeless)
    if not halvings or not retried.size:
        return result
    q_retry, row_retry = q[retried], retried
    for a, b in ((start, middle), (middle, end)):
        half = Stages.evaluate(field, path, np.linspace(a, b, 3), middle)
        rates = half.velocities(field, q_retry, 0)
        part = take_step(field, path, plausible, q_retry, rates, half, halvings - 1)
        result.q[row_retry] = part.q
        result.reached[row_retry] = part.reached
        result.smallest_singular_value[row_retry] = part.smallest_singular_value
        still_on_path = np.isfinite(part.q).all(axis=1)
        q_retry, row_retry = part.q[still_on_path], row_retry[still_on_path]
        if not row_retry.size:
            break
    return result


def _step(
    field: JointField, q: FloatArray, v: FloatArray, stages: Stages, h: float
) -> tuple[FloatArray, FloatArray]:
    """Take one Runge-Kutta step; return also the difference of its two midpoint estimates.

    A large difference means that the step skips a peak of joint speed.

    Args:
        field: Joint velocities along the path.
        q: Joint positions at the start [rad or m], shape (n, d).
        v: Joint velocities at the start [rad/s or m/s], shape (n, d).
        stages: Tool motion at the start, the middle and the end.
        h: Duration of the step [s].
    """
    k2 = stages.velocities(field, q + 0.5 * h * v, 1)
    k3 = stages.velocities(field, q + 0.5 * h * k2, 1)
    k4 = stages.velocities(field, q + h * k3, 2)
    midpoint_error = h * np.abs(k3 - k2).max(axis=1, initial=0.0)
    return q + h / 6.0 * (v + 2.0 * k2 + 2.0 * k3 + k4), midpoint_error
