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
    (batch, "tolerance", NO_TOLERANCES, "^tolerance must be positive"),
    (nearest, "orientation_tolerance", NO_TOLERANCES, "^orientation_tolerance must be positive"),
    (every, "orientation_tolerance", NO_TOLERANCES, "^orientation_tolerance must be positive"),
    (velocity, "linear_tolerance", [float("nan")], "must be positive and finite, not nan"),
    (velocity, "angular_tolerance", [float("nan")], "must be positive and finite, not nan"),
    (batch, "max_restarts", NO_COUNTS, "max_restarts must be an integer, 0 or more"),
    (nearest, "max_restarts", NO_COUNTS, "max_restarts must be an integer, 0 or more"),
    (every, "spread", [0, -3, 1.5], "spread must be an integer, 1 or more"),
    (pull, "rate", [float("nan"), float("inf")], "rate must be finite"),
]


@pytest.mark.parametrize(("solve", "option", "values", "message"), REFUSED)
def test_refuses_invalid_option(
    solve: Callable[..., Any], option: str, values: list[Any], message: str
) -> None:
    for value in values:
        with pytest.raises(WaypointDataError, match=message):
            solve(**{option: value})
