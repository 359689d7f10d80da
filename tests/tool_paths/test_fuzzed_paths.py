"""Random lines and arcs on six arms: followed within tolerance, or refused with a true reason.

Pinocchio alone says where the tool is, how it is turned and how fast it goes. A reason is checked
by integrating joint velocities along the path, step by step, without correction.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
import pytest

import knotwork as kw
from knotwork.errors import FollowingError, PathError, RampError
from sweeps import first_of

tp = kw.tool_paths
ARMS = ("ur3", "ur10", "panda", "kinova", "z1", "xarm7")
ORDINARY, ALL = 6, 504
SAMPLES, STEPS, JOINT_STEP = 301, 200, 0.01
# Near a singularity limits are reached so steeply that no place is known better than this [m].
CLOSE = 1e-4


@dataclass
class Task:
    arm: kw.Robot
    q: np.ndarray
    path: tp.ToolPath
    speed: float
    acceleration: float | None
    tolerance: float

    def follow(self):
        given = self.arm, self.path, self.speed, self.tolerance
        return kw.follow_path(*given, start=self.q, acceleration=self.acceleration)


def random_task(seed: int) -> Task:
    rng = np.random.default_rng([13, seed])
    arm = kw.load_robot(ARMS[seed % len(ARMS)])
    limits = arm.limits.lower, arm.limits.upper
    lower, upper = (np.nan_to_num(limit, posinf=np.pi, neginf=-np.pi) for limit in limits)
    q = lower + (upper - lower) * rng.uniform(0.2, 0.8, arm.dof)
    pose = arm.forward(q)
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    normal = axes[2] * np.sign(np.linalg.det(axes))
    arc, mode = rng.random() < 0.5, rng.integers(3)
    length = rng.uniform(0.02, 0.3)
    curve = tp.Line(pose.translation, pose.translation + length * axes[1])
    if arc:
        spoke = rng.uniform(0.02, 0.15) * axes[0]
        angle = rng.uniform(0.5, 3 * np.pi)
        centre = pose.translation - spoke
        end = centre + pin.exp3(normal * angle) @ spoke
        turns = int(angle // (2 * np.pi))
        curve = tp.Arc.about(pose.translation, centre, end, normal, turns)
    turn = rng.normal(size=3)
    turn *= rng.uniform(0.0, 1.5) / np.linalg.norm(turn) if mode == 1 else 0.0
    if mode == 2:
        turning = tp.tangent_orientation(curve, pose.rotation)
    else:
        turned = pin.exp3(turn) @ pose.rotation
        turning = tp.OrientationCurve.even_turning(pose.rotation, turned, curve.length)
    return Task(
        arm,
        q,
        tp.ToolPath([curve], turning),
        np.exp(rng.uniform(np.log(0.005), np.log(0.3))),
        rng.uniform(0.2, 2.0) if rng.random() < 0.5 else None,
        np.exp(rng.uniform(np.log(1e-6), np.log(1e-3))),
    )


def check_followed(task: Task, motion: kw.JointTrajectory) -> None:
    """Compare the tool with the path, by Pinocchio."""
    arm, model = task.arm, task.arm.model
    data, frame = model.createData(), arm.require_tool()
    ramp = 1.5 * task.speed / task.acceleration if task.acceleration else 0.0
    for t in np.linspace(0.0, motion.end_time, SAMPLES):
        pin.forwardKinematics(model, data, motion.position(t), motion.velocity(t))
        pose = arm.base_placement.actInv(pin.updateFramePlacement(model, data, frame))
        velocity = pin.getFrameVelocity(model, data, frame, pin.LOCAL_WORLD_ALIGNED).linear
        guess = np.clip([task.speed * (t - ramp / 2)], 0.0, task.path.length)
        s = task.path.nearest([pose.translation], guess)
        off = pose.translation - task.path.position(s)[0]
        assert np.linalg.norm(off) <= task.tolerance
        turned = task.path.rotation(s)[0].T @ pose.rotation
        assert np.linalg.norm(pin.log3(turned)) <= np.radians(0.1)
        if ramp <= t <= motion.end_time - ramp:
            assert np.linalg.norm(velocity) == pytest.approx(task.speed, rel=0.01)
    assert np.abs(motion.polynomial.jumps(2)).max() < 1e-6
    assert (
        np.abs(motion.velocity(np.linspace(0, motion.end_time, 999))) < arm.limits.velocity * 1.01
    ).all()


def jacobian(task: Task, q: np.ndarray) -> np.ndarray:
    model = task.arm.model
    data, frame = model.createData(), task.arm.require_tool()
    J = pin.computeFrameJacobian(model, data, q, frame, pin.LOCAL_WORLD_ALIGNED)
    turn = task.arm.base_placement.rotation.T
    return np.vstack((turn @ J[:3], turn @ J[3:]))


def twist(task: Task, s: float) -> np.ndarray:
    """Of the tool, for a metre of path a second."""
    along, spin = task.path.position([s], 1)[0], task.path.orientation.rate([s])[0]
    return np.concatenate((along, spin))


def speed_at(task: Task, s: float) -> float:
    ends = None if task.acceleration is None else 0.0
    options = {"acceleration": task.acceleration or 1.0, "start_speed": ends, "end_speed": ends}
    timing = tp.speed_profile([task.path.length], [task.speed], **options)
    return float(timing(timing.time_of([s]), 1)[0])


def integrated(task: Task, length: float) -> tuple[np.ndarray, np.ndarray]:
    """Joint positions and their rates by arc length at the end of a part of the path."""
    q = task.q.copy()

    limit = task.arm.limits.velocity
    # of all that do, those that are least beside the limits
    scale = limit / limit.mean() if task.arm.dof > 6 else np.ones(task.arm.dof)

    def rates(q: np.ndarray, s: float) -> np.ndarray:
        return scale * (np.linalg.pinv(jacobian(task, q) * scale) @ twist(task, s))

    s = 0.0
    while s < length:
        k1 = rates(q, s)
        h = min(length / STEPS, JOINT_STEP / np.abs(k1).max(), length - s)
        k2 = rates(q + 0.5 * h * k1, s + 0.5 * h)
        k3 = rates(q + 0.5 * h * k2, s + 0.5 * h)
        k4 = rates(q + h * k3, s + h)
        q = q + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        s = length if length - s - h < 1e-12 else s + h
    return q, rates(q, length)


def check_refused(task: Task, error: FollowingError) -> None:
    arm = task.arm
    q, rates = integrated(task, error.arc_length)
    if error.cause == "singularity":
        assert np.linalg.svd(jacobian(task, q), compute_uv=False)[-1] < 0.02
        return
    j = arm.joint_names.index(error.joint)
    if error.cause == "velocity limit":
        places = error.arc_length + CLOSE * np.array([0.0, 0.01, 0.1, 1.0])
        rates = [
            np.abs(integrated(task, s)[1][j]) * speed_at(task, s)
            for s in np.minimum(places, task.path.length)
        ]
        assert max(rates) > 0.999 * arm.limits.velocity[j]
        return
    assert error.cause == "joint limit"
    off = min(abs(q[j] - arm.limits.upper[j]), abs(q[j] - arm.limits.lower[j]))
    assert off < max(1e-3, CLOSE * abs(rates[j]))


def check(seed: int) -> str:
    task = random_task(seed)
    try:
        motion = task.follow()
    except FollowingError as error:
        check_refused(task, error)
        return error.cause
    except PathError as error:
        if not isinstance(error, RampError):
            raise
        assert 1.5 * task.speed**2 / task.acceleration > task.path.length
        return "ramp"
    check_followed(task, motion)
    # neither the branch nor the self-motion is another one
    np.testing.assert_allclose(
        motion.position(motion.end_time), integrated(task, task.path.length)[0], atol=1e-3
    )
    return "followed"


@pytest.mark.parametrize("count", first_of(ORDINARY, ALL))
def test_follows_random_path_or_gives_true_reason(count: int) -> None:
    found = [check(seed) for seed in range(count)]
    assert found.count("followed") > count / 4


def test_reports_fast_joints_near_singularity() -> None:
    # at 4.0 mm, between rest and the first millimetres, one would need 1.94 of its limit
    assert check(386) == "velocity limit"


def test_rounding_margin_with_enough_waypoints() -> None:
    # the start is near a singularity, where joints become slower soon
    assert check(115) == "velocity limit"
