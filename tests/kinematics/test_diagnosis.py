"""Why a pose is not reached, and what the solvers for poses do not take."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from scipy.optimize import brentq, least_squares

import knotwork as kw
from knotwork import Robot, load_robot
from knotwork.errors import ArrayError, OutsideLimitsError, UnreachablePoseError
from knotwork.robot.kinematics import solve_pose_ik
from knotwork.units import Units
from sweeps import first_of, mostly_exhaustive

UR5, KINOVA = load_robot("ur5"), load_robot("kinova")
NARROW = UR5.with_limits(position=dict.fromkeys(UR5.joint_names, (-1.5, 1.5)))
ARMS = {"ur5": UR5, "ur5 narrow": NARROW} | {
    name: load_robot(name) for name in ("z1", "talos_arm", "planar2")
}
Refused = OutsideLimitsError | UnreachablePoseError


def off(robot: Robot, q: np.ndarray, pose: pin.SE3) -> np.ndarray:
    """Position and orientation error in tool axes, shape (6,)."""
    error = robot.forward(q).actInv(pose)
    return np.concatenate([error.translation, pin.log3(error.rotation)])


def refusal(robot: Robot, pose: pin.SE3, start: np.ndarray) -> Refused | None:
    """Why a pose is not reached, or `None` if it is, to 1e-8."""
    try:
        found = solve_pose_ik(robot, pose, start, nearest=False)
    except (OutsideLimitsError, UnreachablePoseError) as error:
        return error
    assert np.linalg.norm(off(robot, found.q, pose)) <= 2e-8
    return None


@cache
def refusals(name: str, count: int) -> list[tuple[pin.SE3, Refused]]:
    """Poses that an arm does not reach: turned at random, or reached outside the limits only."""
    robot, generator = ARMS[name], np.random.default_rng(9)
    lower, upper = robot.limits.lower, robot.limits.upper
    found: list[tuple[pin.SE3, Refused]] = []
    while len(found) < count:
        outside, stretch = generator.random() < 0.5, generator.uniform(0.5, 1.3)
        q = generator.uniform(-3, 3, robot.dof) if outside else generator.uniform(lower, upper)
        turn, pose = pin.exp3(generator.uniform(-3, 3, 3)), robot.forward(q)
        if not outside:
            pose = pin.SE3(turn @ pose.rotation, stretch * pose.translation)
        error = refusal(robot, pose, np.clip(np.zeros(robot.dof), lower, upper))
        if error is not None:
            found.append((pose, error))
    return found


def least_by_scipy(
    robot: Robot, pose: pin.SE3, lower: np.ndarray, upper: np.ndarray, metre: float = 1.0
) -> float:
    """The least distance² + angle² that SciPy finds from six random starts.

    A metre counts for as many radians as `metre` says.
    """
    generator = np.random.default_rng(4)
    low, high = np.maximum(lower, -np.pi), np.minimum(upper, np.pi)
    weight = np.repeat([metre, 1.0], 3)
    return min(
        2.0
        * least_squares(
            lambda q: weight * off(robot, q, pose),
            generator.uniform(low, high),
            bounds=(lower, upper),
            ftol=1e-4,
            xtol=1e-4,
            max_nfev=30,
        ).cost
        for _ in range(6)
    )


@pytest.mark.parametrize("count", first_of(4, 20))
@pytest.mark.parametrize("name", mostly_exhaustive(ARMS, *[*ARMS][:2]))
def test_closest_pose_within_limits_beats_other_searches(name: str, count: int) -> None:
    robot = ARMS[name]
    limits = robot.limits.lower, robot.limits.upper
    for pose, error in refusals(name, count):
        if isinstance(error, OutsideLimitsError):
            continue
        closest = np.array(error.closest)
        assert (closest >= robot.limits.lower).all()
        assert (closest <= robot.limits.upper).all()
        left = off(robot, closest, pose)
        assert error.closest_distance == pytest.approx(np.linalg.norm(left[:3]), abs=1e-12)
        assert error.closest_angle == pytest.approx(np.linalg.norm(left[3:]), abs=1e-12)
        weighted = 1e6 * error.closest_distance**2 + error.closest_angle**2
        assert weighted <= 1.01 * least_by_scipy(robot, pose, *limits, metre=1e3)


@pytest.mark.parametrize("count", first_of(6, 20))
@pytest.mark.parametrize("name", ["ur5 narrow", "z1"])
def test_reports_joints_outside_limits(name: str, count: int) -> None:
    robot = ARMS[name]
    refused = [error for _, error in refusals(name, count) if isinstance(error, OutsideLimitsError)]
    assert refused
    for error in refused:
        assert error.joints
        for joint, value, lower, upper in error.joints:
            i = robot.joint_names.index(joint)
            assert (lower, upper) == (robot.limits.lower[i], robot.limits.upper[i])
            assert not lower <= value <= upper
            assert f"{joint} at {Units().text(value, 'rad')}, outside [" in str(error)


@pytest.mark.parametrize("option", ["position_tolerance", "orientation_tolerance"])
def test_refuses_tolerance_finer_than_rounding(option: str) -> None:
    panda, start = load_robot("panda"), np.zeros(7)
    lower, upper = panda.limits.lower, panda.limits.upper
    for q in np.random.default_rng(2).uniform(-2, 2, (3, 7)):
        pose = panda.forward(np.clip(q, lower, upper))
        assert solve_pose_ik(panda, pose, start, nearest=False, **{option: 1e-12}).converged
    with pytest.raises(ArrayError, match=f"{option} 9e-13 is finer than rounding; 1e-12 or"):
        solve_pose_ik(panda, pose, start, **{option: 9e-13})


def shoulder_above(robot: Robot, q: list[float], low: float, high: float) -> list[float]:
    """Turn joint 2 until the wrist is on the axis of joint 1, where the Jacobian is singular."""

    def determinant(angle: float) -> float:
        return float(np.linalg.det(robot.jacobian([q[0], angle, *q[2:]])))

    return [q[0], brentq(determinant, low, high, xtol=1e-15), *q[2:]]


SINGULAR = {
    "ur5 stretched": (UR5, [0.3, -1.0, 0.0, -0.7, 0.9, 0.2]),
    "ur5 stretched backwards": (UR5, [-1.0, 1.7, 0.0, -0.3, -2.2, -0.6]),
    "ur5 stretched low": (UR5, [2.4, -0.5, 0.0, -2.9, 1.0, 2.5]),
    "ur5 shoulder": (UR5, shoulder_above(UR5, [0.3, 0.0, 1.2, -0.7, 0.9, 0.2], -2.3, -2.2)),
    "kinova elbow": (KINOVA, [0.3, 2.0, np.pi, 0.5, 1.9, 0.2]),
    "kinova shoulder": (KINOVA, shoulder_above(KINOVA, [0.3, 0, 2.0, 0.5, 1.9, 0.2], 2.6, 2.7)),
}


def beside(robot: Robot, q: list[float], distance: float) -> pin.SE3:
    """A pose moved along the direction that is lost at a singular configuration."""
    pose = robot.forward(q)
    directions, sizes, _ = np.linalg.svd(robot.jacobian(q))
    assert sizes[-1] < 1e-9
    assert sizes[-2] > 1e-3
    u = distance * directions[:, -1]
    return pin.SE3(pin.exp3(u[3:]) @ pose.rotation, pose.translation + u[:3])


@pytest.mark.parametrize("place", mostly_exhaustive(SINGULAR, "ur5 stretched", "kinova shoulder"))
@pytest.mark.parametrize("size", mostly_exhaustive([1e-6, 1e-7], 1e-6))
def test_reports_micrometre_shortfall(place: str, size: float) -> None:
    robot, q = SINGULAR[place]
    for start in (np.add(q, 0.05), robot.configuration("home")):
        both = [refusal(robot, beside(robot, q, distance), start) for distance in (size, -size)]
        (error,) = (error for error in both if error is not None)
        assert isinstance(error, UnreachablePoseError)
        if "not in this orientation" in str(error):
            assert error.closest_distance <= 1e-8
            assert error.closest_angle >= 0.9 * size
            assert f"is off by {Units().text(error.closest_angle, 'rad', '.4g')}" in str(error)
        else:
            assert error.closest_distance <= 1.1 * size
            assert f"{Units().text(error.closest_distance, 'm', '.4g')} away" in str(error)


def test_reports_small_excess_of_joint() -> None:
    q = [0.3, -1.2, 1.4, -1.7, 0.8, 0.3]
    limits = {"elbow_joint": (1.0, 1.4 - 1e-7), "wrist_2_joint": (0.5, 1.0)}
    narrow = UR5.with_limits(position=limits | {"shoulder_lift_joint": (-1.3, -1.1)})
    message = r"elbow_joint at 1\.4 rad, outside \[1, 1\.4\] by 1e-7 rad$"
    with pytest.raises(OutsideLimitsError, match=message):
        solve_pose_ik(narrow, UR5.forward(q), np.zeros(6))


@pytest.mark.parametrize("name", ["ur5", "talos_arm", "planar2"])
@pytest.mark.parametrize("far", [1e3, 1e9, 1e149])
def test_distance_of_far_pose(name: str, far: float) -> None:
    with pytest.raises(UnreachablePoseError, match="out of reach") as caught:
        solve_pose_ik(
            ARMS[name], pin.SE3(np.eye(3), np.array([far, 0, 0])), np.zeros(ARMS[name].dof)
        )
    assert caught.value.closest_distance == pytest.approx(far, rel=1e-9, abs=2.0)


HOME = np.array(UR5.configuration("home"))
AT_HOME = UR5.forward(HOME)
SOLVERS: dict[str, Callable[[Any], Any]] = {
    "solve_pose_ik": lambda pose: kw.solve_pose_ik(UR5, pose, HOME),
    "solve_pose_ik, first": lambda pose: kw.solve_pose_ik(UR5, pose, HOME, nearest=False),
    "solve_pose_ik_all": lambda pose: kw.solve_pose_ik_all(UR5, pose),
    "solve_pose_ik_batch": lambda pose: kw.kinematics.solve_pose_ik_batch(
        UR5, [UR5.forward(HOME), pose], HOME
    ),
}
PLACE = np.array([0.3, 0.2, 0.3])
NO_POSES = {
    "a reflection": (pin.SE3(np.diag([1.0, 1.0, -1.0]), PLACE), "not a rot.*determinant is -1"),
    "scaled": (pin.SE3(2.0 * np.eye(3), PLACE), "not a rotation.*differs from I by 3"),
    "a shear": (pin.SE3(np.eye(3) + 1e-5 * np.eye(3, k=1), PLACE), "not a rotation.*up to 1e-06"),
    "zero": (pin.SE3(np.zeros((3, 3)), PLACE), "not a rotation.*differs from I by 1"),
    "not a number": (pin.SE3(np.full((3, 3), np.nan), PLACE), "finite pin.SE3"),
    "infinite": (pin.SE3(np.eye(3), np.array([np.inf, 0, 0])), "finite pin.SE3"),
    "too far to square": (pin.SE3(np.eye(3), np.array([0, -1e200, 0])), r"up to 1e\+150 m"),
    "no pose": ("home", "must be a finite pin.SE3, not 'home'"),
}


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("what", NO_POSES)
def test_refuses_invalid_pose(solver: str, what: str) -> None:
    pose, complaint = NO_POSES[what]
    name = r"poses\[1\]" if solver == "solve_pose_ik_batch" else "pose"
    with pytest.raises(ArrayError, match=f"{name}.*{complaint}"):
        SOLVERS[solver](pose)


def test_accepts_rounded_rotation() -> None:
    exact = UR5.forward(HOME + 0.1)
    rounded = pin.SE3(np.round(exact.rotation, 8), exact.translation)
    assert kw.solve_pose_ik(UR5, rounded, HOME).converged
    assert kw.kinematics.solve_pose_ik_batch(UR5, [rounded], HOME).converged.all()


def test_batch_of_no_poses() -> None:
    none = kw.kinematics.solve_pose_ik_batch(UR5, [], HOME)
    assert none.q.shape == (0, 6)
    assert none.converged.shape == (0,)


def test_accepts_generator_of_poses() -> None:
    poses = (UR5.forward(HOME) for _ in range(2))
    assert kw.kinematics.solve_pose_ik_batch(UR5, poses, HOME).converged.all()


def batch(poses: Any = (AT_HOME,), start: Any = HOME, **options: Any) -> Any:
    return kw.kinematics.solve_pose_ik_batch(UR5, poses, start, **options)


def nearest(**options: Any) -> Any:
    return kw.solve_pose_ik(UR5, UR5.forward(HOME), HOME, **options)


def every(**options: Any) -> Any:
    return kw.solve_pose_ik_all(UR5, UR5.forward(HOME), **options)


def velocity(**options: Any) -> Any:
    return kw.solve_velocity_ik(UR5, [0.2, -1.2, 0.0, -1.7, 0.4, 0.3], [0.1] * 6, **options)


def pull(rate: Any) -> Any:
    return kw.kinematics.pull_to_middle(UR5, HOME, rate)


NO_TOLERANCES = [0, -1e-8, float("nan"), float("inf"), "fine", None, True]
NO_COUNTS = [-1, 2.5, "3", None, True]
REFUSED: list[tuple[Callable[..., Any], str, list[Any], str]] = [
    (batch, "poses", [None, 5, UR5.forward(HOME)], r"poses must be a sequence of pin\.SE3"),
    (batch, "start", [[[1, 2, 3, 4, 5, 6], [1, 2]]], "start must be numbers"),
    (batch, "tolerance", NO_TOLERANCES, "^tolerance is .*must be a positive"),
    (nearest, "orientation_tolerance", NO_TOLERANCES, "^orientation_tolerance is .*a positive"),
    (every, "orientation_tolerance", NO_TOLERANCES, "^orientation_tolerance is .*a positive"),
    (velocity, "linear_tolerance", [float("nan")], "must be a positive and finite number"),
    (velocity, "angular_tolerance", [float("nan")], "must be a positive and finite number"),
    (batch, "max_restarts", NO_COUNTS, "max_restarts is .*must be (a whole|at least 0)"),
    (every, "samples", [0, -3, 1.5], "samples is .*must be (a whole|at least 1)"),
    (pull, "rate", [float("nan"), float("inf"), None], "rate is (nan|inf); every value must"),
    (pull, "rate", ["a"], "rate must be numbers, not 'a'"),
]


@pytest.mark.parametrize(("solve", "option", "values", "message"), REFUSED)
def test_refuses_invalid_option(
    solve: Callable[..., Any], option: str, values: list[Any], message: str
) -> None:
    for value in values:
        with pytest.raises(kw.InputError, match=message):
            solve(**{option: value})
