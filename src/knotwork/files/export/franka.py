"""Positions each millisecond for Franka's control interface, within its limits.

The limits are those of the interface in its documentation and libfranka's `rate_limiting.h`, and
not those of a robot file or scenario, which may be wider.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import ExportError
from knotwork.files.export.straight import STRAIGHT, StraightPoints, straight_points
from knotwork.files.storage import csv_text

if TYPE_CHECKING:
    from knotwork.robot import Robot

CYCLE = STRAIGHT["franka"]["cycle"]
TORQUE_RATE = np.full(7, 1000.0)
"""Largest torque rate of each joint [N m/s]."""


@dataclass(frozen=True, eq=False)
class Arm:
    """Limits of one arm's control interface, each of shape (7,) or (7, 2).

    Attributes:
        name: Name of the arm.
        position: Lower and upper limit [rad].
        velocity: Largest velocity [rad/s].
        acceleration: Largest acceleration [rad/s²].
        jerk: Largest jerk [rad/s³].
        slowing: Coefficients of the velocity limit sqrt(k |e - q|) - o towards an end e of the
            range of a joint at q. The rows are k [rad/s²], o [rad/s], lower and upper e [rad],
            shape (4, 7).
    """

    name: str
    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray
    slowing: FloatArray | None = None

    def speeds(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Largest speeds towards the lower and the upper end at positions, shape (n, 7) each."""
        if self.slowing is None:
            return (np.broadcast_to(self.velocity, q.shape),) * 2
        k, offset, lower, upper = self.slowing
        distance = np.stack((q - lower, upper - q))
        down, up = np.clip(np.sqrt(np.maximum(k * distance, 0.0)) - offset, 0.0, self.velocity)
        return down, up


PANDA = Arm(
    "Panda",
    np.array(
        [
            [-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973],
            [2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973],
        ]
    ).T,
    np.array([2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61]),
    np.array([15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0]),
    np.array([7500.0, 3750.0, 5000.0, 6250.0, 7500.0, 10000.0, 10000.0]),
)
FR3 = Arm(
    "FR3",
    np.array(
        [
            [-2.7437, -1.7837, -2.9007, -3.0421, -2.8065, 0.5445, -3.0159],
            [2.7437, 1.7837, 2.9007, -0.1518, 2.8065, 4.5169, 3.0159],
        ]
    ).T,
    np.array([2.62, 2.62, 2.62, 2.62, 5.26, 4.18, 5.26]),
    np.full(7, 10.0),
    np.full(7, 5000.0),
    np.array(
        [
            [12.0, 5.17, 7.0, 8.0, 34.0, 11.0, 34.0],
            [0.3, 0.2, 0.2, 0.3, 0.35, 0.35, 0.35],
            [-2.7501, -1.7918, -2.9065, -3.0481, -2.8101, 0.54092, -3.0196],
            [2.7501, 1.7918, 2.9065, -0.1458, 2.8101, 4.5205, 3.0196],
        ]
    ),
)
ARMS = {"panda": PANDA, "fer": PANDA, "fr3": FR3}
"""Arms by the stem of their joint names, as in `fr3_joint1`; a prefix is allowed."""


def to_franka(motion: JointTrajectory | StraightPoints, *, robot: Robot | None = None) -> str:
    """Write joint positions for Franka's control interface, one row per 1 ms, within its limits.

    The interface takes differences of the rows. Velocities, accelerations and jerks must keep its
    limits, and torques without gravity may change by 1000 N m/s. A motion must begin and end at
    rest, with zero acceleration. A callback of libfranka, or of pylibfranka, returns
    `JointPositions` of one row per call.

    >>> panda = kw.load_robot("panda")
    >>> text = to_franka(kw.plan("panda_pick_place").trajectory, robot=panda)
    >>> "# jerk 0.25 % of its limit: panda_joint2 at" in text
    True

    Args:
        motion: Motion of the seven joints of a Panda or FR3, base first.
        robot: The arm, with its load, for the torques.

    Raises:
        ExportError: The joints are of another arm, no robot is given, the motion moves at an end,
            or it exceeds a limit of the interface.
    """
    points = straight_points(motion, cycle=CYCLE)
    names = points.trajectory.joint_names
    arm = _arm_of(names)
    if robot is None:
        raise ExportError(
            "format 'franka' needs the arm for the rate of its torques: give "
            "robot=plan.joints.robot (--scenario SCENARIO)"
        )
    if robot.joint_names != names:
        raise ExportError(f"the robot has {', '.join(robot.joint_names)}, not the motion's joints")
    about = [
        f"Franka control interface of {arm.name}, 1 ms: joint positions.",
        f"{points.describe()}.",
        "The arm must stand at the first row.",
        *_limit_notes(points, arm, robot),
    ]
    columns = {"time_s": points.time}
    for name, values in zip(names, points.position.T, strict=True):
        columns[f"{name}_rad"] = values
    return "".join(f"# {line}\n" for line in about) + csv_text(columns)


def _arm_of(names: tuple[str, ...]) -> Arm:
    for name, arm in ARMS.items():
        prefix = names[0].removesuffix(f"{name}_joint1")
        if names == tuple(f"{prefix}{name}_joint{i}" for i in range(1, 8)):
            return arm
    raise ExportError(
        f"the motion moves {', '.join(names)}; Franka's control interface moves seven joints, "
        f"named {', '.join(f'{name}_joint1' for name in ARMS)} to 7, base first, all with the same "
        "prefix if any"
    )


def _limit_notes(points: StraightPoints, arm: Arm, robot: Robot) -> Iterator[str]:
    """Describe the utilisation of each limit, with the arm at rest before and after the motion.

    Raises:
        ExportError: A limit is exceeded.
    """
    motion, q = points.trajectory, points.position
    lower, upper = arm.position.T
    outside = np.argwhere((q < lower) | (q > upper))
    if len(outside):
        row, joint = outside[0].tolist()
        raise ExportError(
            f"joint {motion.joint_names[joint]!r} is at {q[row, joint]:.4g} rad at "
            f"{row * CYCLE:.3f} s; Franka's control interface accepts {lower[joint]:g} to "
            f"{upper[joint]:g} rad",
            joint=motion.joint_names[joint],
            time=row * CYCLE,
        )
    still = np.concatenate((np.repeat(q[:1], 3, axis=0), q, np.repeat(q[-1:], 3, axis=0)))
    v, a, j = (np.diff(still, n, axis=0) / CYCLE**n for n in (1, 2, 3))
    down, up = arm.speeds(still[1:])
    yield _limit_note(motion, "velocity", v, np.where(v < 0.0, down, up), 2)
    yield _limit_note(motion, "acceleration", a, arm.acceleration, 1)
    yield _limit_note(motion, "jerk", j, arm.jerk, 0)
    unweighted = robot.with_gravity(np.zeros(3))
    torque = np.array(
        [unweighted.effort(*state) for state in zip(still[2:], v[1:], a, strict=True)]
    )
    yield _limit_note(motion, "torque rate", np.diff(torque, axis=0) / CYCLE, TORQUE_RATE, 0)


def _limit_note(
    motion: JointTrajectory, quantity: str, values: FloatArray, limit: FloatArray, first: int
) -> str:
    """Describe the utilisation of a limit by differences of rows; index `first` is at time 0.

    Raises:
        ExportError: The limit is exceeded.
    """
    limit = np.broadcast_to(limit, values.shape)
    with np.errstate(divide="ignore", invalid="ignore"):
        utilisation = np.where(values == 0.0, 0.0, np.abs(values) / limit)
    row, joint = (int(i) for i in np.unravel_index(int(utilisation.argmax()), utilisation.shape))
    name, time = motion.joint_names[joint], max(0, row - first) * CYCLE
    if utilisation[row, joint] > 1.0:
        raise ExportError(
            f"{quantity} of joint {name!r} is {abs(values[row, joint]):.4g} at {time:.3f} s, by "
            f"differences of rows; Franka's control interface accepts {limit[row, joint]:.4g} "
            "there; give the motion more time, or end_acceleration: zero",
            joint=name,
            error=float(abs(values[row, joint])),
            time=time,
        )
    return f"{quantity} {100 * utilisation[row, joint]:.2g} % of its limit: {name} at {time:.3f} s."
