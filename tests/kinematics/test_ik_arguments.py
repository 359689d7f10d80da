"""What the solvers for poses do not take, and say so."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import knotwork as kw
from knotwork.errors import WaypointDataError

UR5 = kw.load_robot("ur5")
HOME = np.array(UR5.configuration("home"))
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
    with pytest.raises(WaypointDataError, match=f"{name}.*{complaint}"):
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


@pytest.mark.parametrize("poses", [None, 5, UR5.forward(HOME)])
def test_refuses_poses_that_are_not_a_sequence(poses: Any) -> None:
    with pytest.raises(WaypointDataError, match=r"poses must be a sequence of pin\.SE3"):
        kw.kinematics.solve_pose_ik_batch(UR5, poses, HOME)


def test_accepts_generator_of_poses() -> None:
    poses = (UR5.forward(HOME) for _ in range(2))
    assert kw.kinematics.solve_pose_ik_batch(UR5, poses, HOME).converged.all()


@pytest.mark.parametrize("bad", [0, -1e-8, float("nan"), float("inf"), "fine", None, True])
def test_refuses_tolerances_that_are_not_positive(bad: Any) -> None:
    pose = UR5.forward(HOME)
    with pytest.raises(WaypointDataError, match=r"^tolerance must be positive"):
        kw.kinematics.solve_pose_ik_batch(UR5, [pose], HOME, tolerance=bad)
    for solve in (
        kw.solve_pose_ik_all,
        lambda *given, **more: kw.solve_pose_ik(*given, HOME, **more),
    ):
        with pytest.raises(WaypointDataError, match=r"^orientation_tolerance must be positive"):
            solve(UR5, pose, orientation_tolerance=bad)


@pytest.mark.parametrize("bad", [-1, 2.5, "3", None, True])
def test_refuses_invalid_max_restarts(bad: Any) -> None:
    with pytest.raises(WaypointDataError, match="max_restarts must be an integer, 0 or more"):
        kw.kinematics.solve_pose_ik_batch(UR5, [UR5.forward(HOME)], HOME, max_restarts=bad)
    with pytest.raises(WaypointDataError, match="max_restarts must be an integer, 0 or more"):
        kw.solve_pose_ik(UR5, UR5.forward(HOME), HOME, max_restarts=bad)


def test_refuses_starts_of_wrong_shape() -> None:
    pose = UR5.forward(HOME)
    with pytest.raises(WaypointDataError, match="start must be numbers"):
        kw.kinematics.solve_pose_ik_batch(UR5, [pose, pose], [[1, 2, 3, 4, 5, 6], [1, 2]])


@pytest.mark.parametrize("bad", [0, -3, 1.5])
def test_refuses_invalid_spread(bad: Any) -> None:
    with pytest.raises(WaypointDataError, match="spread must be an integer, 1 or more"):
        kw.solve_pose_ik_all(UR5, UR5.forward(HOME), spread=bad)


def test_refuses_invalid_velocity_tolerance() -> None:
    singular = np.array([0.2, -1.2, 0.0, -1.7, 0.4, 0.3])
    twist = np.array([0.1, 0.2, 0.3, 0.0, 0.0, 0.0])
    for name in ("linear_tolerance", "angular_tolerance"):
        with pytest.raises(WaypointDataError, match=f"{name} must be positive and finite, not nan"):
            kw.solve_velocity_ik(UR5, singular, twist, **{name: float("nan")})


@pytest.mark.parametrize("rate", [float("nan"), float("inf")])
def test_refuses_infinite_rate(rate: float) -> None:
    with pytest.raises(WaypointDataError, match="rate must be finite"):
        kw.kinematics.pull_to_middle(UR5, HOME, rate)
