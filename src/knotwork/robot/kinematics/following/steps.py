"""One step along a tool path from several starts, halved where it leaves the path."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from knotwork.curves.tool_paths import TimedPath
from knotwork.robot.kinematics.following.joint_field import JointField
from knotwork.waypoints import FloatArray

# Distance from the path after a step [m, rad] above which the step was too long.
PATH_ERROR = 1e-7
# Correction by Newton's method above which a step is halved [rad or m], because it could end in
# another branch. After `MAX_HALVINGS` the start is blocked.
MAX_CORRECTION = 1e-3
MAX_HALVINGS = 9
# Difference of the two midpoints of a step above which it is halved [rad or m]. Joint speeds may
# peak within such a step, and the self-motion of a redundant arm would deviate from the integral.
MIDPOINT_TOLERANCE = 1e-3
# Factor on the limits of joint speeds above which a continuation ends, because the arm is singular
# there. It does not end if a tool speed above 1 m/s or rad/s is the cause.
HOPELESS_SPEED_FACTOR = 1000.0


class Stages(NamedTuple):
    """Motion of the tool at some times of one piece of a path."""

    time: FloatArray
    position: FloatArray
    rotation: FloatArray
    twist: FloatArray
    share: FloatArray
    along: FloatArray

    @classmethod
    def evaluate(cls, field: JointField, path: TimedPath, time: FloatArray, at: float) -> Stages:
        """Evaluate the piece of a path that contains `at` at some times."""
        position, rotation, twist, _ = path.state(time, at=at)
        share = np.linalg.norm(twist[:, :3], axis=1) / path.full_speed
        return cls(time, position, rotation, twist, share, field.arc_lengths(path, time))

    def velocities(self, field: JointField, q: FloatArray, k: int) -> FloatArray:
        """Joint velocities at the k-th time, shape (n, d)."""
        return field.velocities(q, self.twist[k], self.share[k], self.along[k])

    def three(self, k: int) -> Stages:
        """The stages of one step: the k-th, which is its start, and the next two."""
        return Stages(*(values[k : k + 3] for values in self))


class StepEnd(NamedTuple):
    """End of a step.

    If it is blocked, positions are NaN, and it has the time and the smallest singular value.
    """

    q: FloatArray
    reached: FloatArray
    smallest: FloatArray


def take_step(
    field: JointField,
    path: TimedPath,
    limit: FloatArray,
    q: FloatArray,
    v: FloatArray,
    stages: Stages,
    halvings: int = MAX_HALVINGS,
) -> StepEnd:
    """Take one step from some starts, halved where it leaves the path."""
    start, middle, end = stages.time
    guess, bent = _step(field, q, v, stages, end - start)
    end_q, error = field.project(guess, stages.position[2], stages.rotation[2])
    fast = max(1.0, float(np.abs(stages.twist[0]).max()))
    hopeless = (np.abs(v) > HOPELESS_SPEED_FACTOR * fast * limit).any(axis=1)
    stray = ~(error <= PATH_ERROR) | ~(
        np.abs(end_q - guess).max(axis=1, initial=0.0) <= MAX_CORRECTION
    )
    stray |= hopeless | ~(bent <= MIDPOINT_TOLERANCE)
    result = StepEnd(end_q, np.full(len(q), end), np.full(len(q), np.nan))
    if not stray.any():
        return result
    result.reached[stray] = start
    result.smallest[stray] = field.smallest(q[stray])
    result.q[stray] = np.nan
    retried = np.flatnonzero(stray & ~hopeless)
    if not halvings or not retried.size:
        return result
    now, going = q[retried], retried
    for a, b in ((start, middle), (middle, end)):
        half = Stages.evaluate(field, path, np.linspace(a, b, 3), middle)
        rates = half.velocities(field, now, 0)
        part = take_step(field, path, limit, now, rates, half, halvings - 1)
        result.q[going] = part.q
        result.reached[going], result.smallest[going] = part.reached, part.smallest
        on = np.isfinite(part.q).all(axis=1)
        now, going = part.q[on], going[on]
        if not going.size:
            break
    return result


def _step(
    field: JointField, q: FloatArray, v: FloatArray, stages: Stages, h: float
) -> tuple[FloatArray, FloatArray]:
    """One Runge-Kutta step, and the difference of its two midpoints.

    The difference is large at peaks of joint speed.

    `v` are the velocities at its start; `stages` are its start, middle and end.
    """
    k2 = stages.velocities(field, q + 0.5 * h * v, 1)
    k3 = stages.velocities(field, q + 0.5 * h * k2, 1)
    k4 = stages.velocities(field, q + h * k3, 2)
    bent = h * np.abs(k3 - k2).max(axis=1, initial=0.0)
    return q + h / 6.0 * (v + 2.0 * k2 + 2.0 * k3 + k4), bent
