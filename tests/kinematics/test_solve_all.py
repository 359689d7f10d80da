"""All solutions of a pose: complete against closed forms, with turns, flags and a spread."""

from __future__ import annotations

from pathlib import Path

import closed_form
import numpy as np
import pinocchio as pin
import pytest
from test_pose_ik import assert_solves

import knotwork as kw
from knotwork import Robot, load_robot, robot_names
from knotwork.errors import ArrayError
from knotwork.robot.kinematics.chain.batch import Targets
from knotwork.robot.kinematics.geometry.closed_form import solve_closed_form as in_closed_form
from knotwork.robot.kinematics.sequence import find_candidates
from knotwork.robot.kinematics.solutions.enumeration import search_branches
from knotwork.waypoints import CartesianWaypoint
from sweeps import first_of, mostly_exhaustive

ROBOTS = {name: load_robot(name) for name in robot_names()}
UR5 = ROBOTS["ur5"]
# The frame that the manufacturer's parameters are in is turned by half a turn about z.
CONTROLLER = pin.SE3(pin.utils.rotate("z", np.pi), np.zeros(3))


@pytest.fixture(scope="module")
def spherical(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    path = tmp_path_factory.mktemp("arm") / "spherical.urdf"
    path.write_text(closed_form.spherical_wrist_urdf())
    return load_robot(Path(path)).with_tool("l7")


def truth(robot: Robot, pose: pin.SE3) -> list[np.ndarray]:
    """Solutions of the closed form within half a turn of zero."""
    if robot is UR5:
        found = closed_form.ur5((CONTROLLER * pose).homogeneous)
    else:
        found = closed_form.spherical_wrist(pose.homogeneous)
    return [q for q in found if (np.abs(q) <= np.pi).all()]


def answers(robot: Robot, pose: pin.SE3) -> np.ndarray:
    """One solution of each branch that is found."""
    return np.array([branch.q for branch in kw.solve_pose_ik_all(robot, pose)])


def gap(found: np.ndarray, q: np.ndarray) -> float:
    """How far the nearest of some solutions is, in the joint that is off most [rad]."""
    return float(np.abs(closed_form.turned(found - q)).max(axis=1).min())


def one_turn(robot: Robot) -> tuple[np.ndarray, np.ndarray]:
    """Limits, at most one turn from each other."""
    lower = np.maximum(robot.limits.lower, -np.pi)
    return lower, np.minimum(robot.limits.upper, lower + 2 * np.pi)


@pytest.mark.parametrize("count", first_of(20, 60))
@pytest.mark.parametrize("arm", ["ur5", "spherical"])
def test_finds_every_branch_of_closed_form(arm: str, count: int, spherical: Robot) -> None:
    robot = UR5 if arm == "ur5" else spherical
    generator = np.random.default_rng(11)
    wanted = found = 0
    for _ in range(count):
        pose = robot.forward(generator.uniform(-np.pi, np.pi, 6))
        branches = kw.solve_pose_ik_all(robot, pose)
        q, expected = np.array([branch.q for branch in branches]), truth(robot, pose)
        wanted += len(expected)
        found += sum(gap(q, solution) < 1e-6 for solution in expected)
        assert len(branches) == len(expected)
        for branch in branches:
            assert max(branch.position_error, branch.orientation_error) <= 1e-8
    assert wanted > 6.3 * count
    assert found == wanted


@pytest.mark.parametrize("arm", ["ur10", "z1", "kinova"])
def test_solve_closed_form_equals_searches(arm: str) -> None:
    robot = kw.load_robot(arm)
    chosen = np.random.default_rng(8).uniform(-np.pi, np.pi, (12, 6))
    targets = Targets.from_poses([robot.forward(q) for q in chosen])
    found = in_closed_form(robot, targets)
    assert sum(solutions.certain for solutions in found) > 8
    for solutions, searched, q in zip(found, search_branches(robot, targets), chosen, strict=True):
        if solutions.certain:
            assert len(solutions.q) == len(searched)
            assert gap(solutions.q, q) < 1e-9


@pytest.mark.parametrize("arm", ["ur5", "spherical"])
@pytest.mark.parametrize("bent", mostly_exhaustive([1e-2, 1e-3, 1e-4, 1e-5], 1e-2, 1e-5))
def test_finds_every_branch_near_wrist_singularity(arm: str, bent: float, spherical: Robot) -> None:
    """There the arm can move far while the tool hardly does, and searches do not converge."""
    robot = UR5 if arm == "ur5" else spherical
    generator = np.random.default_rng(4)
    for _ in range(8):
        q = generator.uniform(-2.5, 2.5, 6)
        q[4] = bent
        pose = robot.forward(q)
        found, expected = answers(robot, pose), truth(robot, pose)
        rounding = max(1e-6, 1e-9 / bent)  # of the pose and of the closed form, magnified
        assert all(gap(found, x) < rounding for x in [q, *expected])
        assert len(found) == len(expected)


@pytest.mark.parametrize(("elbow", "bent"), [(1e-4, 1e-5), (1e-3, 1e-6)])
def test_solutions_once_near_singularities(elbow: float, bent: float, spherical: Robot) -> None:
    """Along the curve of a nearly straight wrist the error is small far beside a solution, too."""
    generator = np.random.default_rng(77)
    for _ in range(4):
        q = generator.uniform(-2.5, 2.5, 6)
        q[2], q[4] = elbow, bent
        pose = spherical.forward(q)
        assert len(kw.solve_pose_ik_all(spherical, pose)) == len(truth(spherical, pose))


@pytest.mark.parametrize("bent", first_of(1e-6, 1e-7))
def test_finds_origin_of_pose_at_rounding_limit(bent: float) -> None:
    generator = np.random.default_rng(4)
    for _ in range(12):
        q = generator.uniform(-2.5, 2.5, 6)
        q[4] = bent
        # the closed form itself is no better there
        assert gap(answers(UR5, UR5.forward(q)), q) < 5e-3


@pytest.mark.parametrize("elbow", mostly_exhaustive([0.0, 1e-6, 1e-5], 0.0, 1e-6))
def test_merges_branches_that_meet(elbow: float) -> None:
    generator = np.random.default_rng(3)
    for _ in range(8):
        q = generator.uniform(-2.5, 2.5, 6)
        q[2] = elbow
        found = answers(UR5, UR5.forward(q))
        assert gap(found, q) < 1e-4
        assert all(gap(found[:i], solution) > 1e-2 for i, solution in enumerate(found) if i)


@pytest.mark.parametrize("arm", ["ur5", "spherical"])
@pytest.mark.parametrize("straight", [True, False])
@pytest.mark.parametrize("count", first_of(3, 12))
def test_finds_branches_of_sequence(arm: str, straight: bool, count: int, spherical: Robot) -> None:
    """Where the branches of one waypoint start the search at the next, none gets lost."""
    robot = UR5 if arm == "ur5" else spherical
    generator = np.random.default_rng(3)
    for _ in range(count):
        q = generator.uniform(-np.pi, np.pi, (12, 6))
        if straight:
            q = np.linspace(q[0], q[0] + 0.2 * (q[1] - q[0]), 12)
        poses = [robot.forward(x) for x in q]
        waypoints = [
            CartesianWaypoint(str(i), i, pose, pin.Motion.Zero()) for i, pose in enumerate(poses)
        ]
        for pose, candidates in zip(poses, find_candidates(robot, waypoints, list(q)), strict=True):
            wanted = truth(robot, pose)
            assert all(gap(candidates.q, x) < 1e-5 for x in wanted)
            assert candidates.branches == len(wanted)


def test_turns_are_all_copies_within_limits() -> None:
    q = np.array([0.4, -1.2, 1.1, -0.8, 1.0, 0.3])
    branches = kw.solve_pose_ik_all(UR5, UR5.forward(q))
    assert len(branches) == 8
    for branch in branches:
        assert len(branch.turns) == 32  # five joints with two turns each, the elbow with one
        assert (branch.turns >= UR5.limits.lower).all()
        assert (branch.turns <= UR5.limits.upper).all()
        assert len(np.unique(np.round(branch.turns, 6), axis=0)) == 32
        for turn in branch.turns[::7]:
            assert UR5.forward(turn).isApprox(UR5.forward(q), 1e-7)
    assert any(np.abs(branch.q - q).max() < 1e-7 for branch in branches)
    assert len({solution.branch for solution in branches}) == 8


def test_joint_on_limit_has_both_turns() -> None:
    q = np.array([2 * np.pi, -1.2, 1.1, -0.8, 1.0, 0.0])
    (branch,) = (
        b
        for b in kw.solve_pose_ik_all(UR5, UR5.forward(q))
        if np.abs(b.turns - q).max(axis=1).min() < 1e-7
    )
    assert len(branch.turns) == 3 * 2 * 2 * 2 * 3
    assert (np.abs(branch.turns) <= UR5.limits.upper).all()


@pytest.mark.parametrize("count", first_of(3, 6))
@pytest.mark.parametrize("name", robot_names())
def test_origin_of_pose_is_among_solutions(name: str, count: int) -> None:
    robot, generator = ROBOTS[name], np.random.default_rng(4)
    for _ in range(count):
        q = generator.uniform(*one_turn(robot))
        branches = kw.solve_pose_ik_all(robot, robot.forward(q))
        for branch in branches:
            assert max(branch.position_error, branch.orientation_error) <= 1e-8
            assert (branch.q >= robot.limits.lower).all()
            assert (branch.q <= robot.limits.upper).all()
        has_closed_form = name in ("ur3", "ur5", "ur10", "z1", "kinova")
        smallest = np.linalg.svd(robot.jacobian(q), compute_uv=False)[-1]
        if robot.dof <= 6 and (has_closed_form or smallest > 3e-3):
            assert gap(np.array([branch.q for branch in branches]), q) < 1e-6


@pytest.mark.parametrize("name", ["panda", "xarm7"])
def test_spreads_samples_of_self_motion(name: str) -> None:
    robot = ROBOTS[name]
    pose = robot.forward(robot.configuration("home"))
    q, again = (
        np.array([branch.q for branch in kw.solve_pose_ik_all(robot, pose, samples=12)])
        for _ in range(2)
    )
    assert len(q) == 12
    np.testing.assert_array_equal(q, again)
    gaps = np.abs(closed_form.turned(q[:, None] - q[None])).max(axis=2) + 10 * np.eye(12)
    assert gaps.min() > 0.1
    with pytest.warns(DeprecationWarning, match="option 'spread' is now 'samples'"):
        assert len(kw.solve_pose_ik_all(robot, pose, spread=30)) == 30


@pytest.mark.parametrize("name", robot_names())
def test_batch_errors_equal_forward_kinematics(name: str) -> None:
    """Of those that are not solved, too, and at angles up to half a turn."""
    robot, generator = ROBOTS[name], np.random.default_rng(1)
    q = generator.uniform(-3, 3, (8, robot.dof))
    axis = np.array([0.6, 0.0, 0.8])
    turns = [pin.exp3(angle * axis) for angle in (0.0, 1e-9, 1e-3, 0.5, 1.0, 2.0, 3.0, np.pi)]
    poses = [
        pin.SE3(turn @ pose.rotation, pose.translation + np.array([3.0, 4.0, 0.0]))
        for turn, pose in zip(turns, map(robot.forward, q), strict=True)
    ]
    found = kw.kinematics.solve_pose_ik_batch(robot, poses, q, max_restarts=0)
    assert not found.converged.any()
    for i, (pose, one) in enumerate(zip(poses, found.q, strict=True)):
        error = robot.forward(one).actInv(pose)
        assert found.position_error[i] == pytest.approx(np.linalg.norm(error.translation))
        angle = np.linalg.norm(pin.log3(error.rotation))
        assert found.orientation_error[i] == pytest.approx(angle, abs=1e-8)


@pytest.mark.parametrize("arm", ["ur5", "ur10", "kinova", "z1", "spherical"])
def test_flags_change_only_at_singularities(arm: str, spherical: Robot) -> None:
    """Elbow × wrist is the sign of the Jacobian's determinant, up to one sign for the arm."""
    robot = spherical if arm == "spherical" else ROBOTS[arm]
    generator, products = np.random.default_rng(9), set()
    for _ in range(12):
        middle = generator.uniform(-np.pi, np.pi, 6)
        middle = np.clip(middle, robot.limits.lower, robot.limits.upper)
        for branch in kw.solve_pose_ik_all(robot, robot.forward(middle)):
            # Up and down trade places where the shoulder changes sides.
            flags = ("elbow up" in branch.branch) ^ ("no flip" in branch.branch)
            products.add(flags ^ bool(np.linalg.det(robot.jacobian(branch.q)) > 0))
    assert len(products) == 1


def test_flags_describe_posture(spherical: Robot) -> None:
    def flags(robot: Robot, q: list[float]) -> str:
        pose = robot.forward(np.array(q))
        branches = kw.solve_pose_ik_all(robot, pose)
        return min(branches, key=lambda b: np.abs(closed_form.turned(b.q - q)).max()).branch

    # The wrist in front of the arm at the height of the shoulder, the elbow above or below.
    above = [0.0, 0.5, 1.9, 0.2, 0.5, 0.1]
    assert "elbow up" in flags(spherical, above)
    below = [0.0, 2.4, -1.9, 0.2, 0.5, 0.1]
    assert "elbow down" in flags(spherical, below)
    assert flags(spherical, above).split(",")[0] == flags(spherical, below).split(",")[0]
    # Reaching over its own back with the same elbow shape.
    assert "elbow up" in flags(spherical, [0.0, -0.7, -1.5, 0.2, 0.5, 0.1])
    assert "elbow up" in flags(UR5, list(UR5.configuration("home")))
    assert "shoulder left" in flags(UR5, list(UR5.configuration("home")))


@pytest.mark.parametrize("name", robot_names())
def test_solves_batch_of_poses(name: str) -> None:
    robot, generator = ROBOTS[name], np.random.default_rng(6)
    lower, upper = one_turn(robot)
    q = generator.uniform(lower, upper, (25, robot.dof))
    poses = [robot.forward(one) for one in q]
    beside = np.clip(q + generator.uniform(-0.02, 0.02, q.shape), lower, upper)
    for start in (np.array(robot.configuration("home")), beside):
        found = kw.kinematics.solve_pose_ik_batch(robot, poses, start)
        assert found.converged.all()
        for pose, one in zip(poses, found.q, strict=True):
            assert_solves(robot, pose, one, independent=False)


def test_batch_reports_unreachable_poses() -> None:
    away = pin.SE3(np.eye(3), np.array([3.0, 0, 0]))
    home = UR5.configuration("home")
    found = kw.kinematics.solve_pose_ik_batch(UR5, [away, UR5.forward(home)], home, max_restarts=3)
    assert found.converged.tolist() == [False, True]
    assert found.position_error[0] > 1.9
    with pytest.raises(ArrayError):
        kw.kinematics.solve_pose_ik_batch(UR5, [away], np.zeros((2, 6)))


@pytest.mark.parametrize("wide", mostly_exhaustive([20.0, 1e12], 1e12))
def test_wide_limits_keep_bounded_number_of_turns(wide: float) -> None:
    robot = UR5.with_limits(position=dict.fromkeys(UR5.joint_names, (-wide, wide)))
    q = np.array([0.4, -1.2, 1.1, -0.8, 1.0, 0.3])
    branches = kw.solve_pose_ik_all(robot, robot.forward(q))
    assert len(branches) == 8
    for branch in branches:
        assert 500 < len(branch.turns) <= 1024
        assert len(np.unique(np.round(branch.turns, 6), axis=0)) == len(branch.turns)
        assert np.abs(branch.turns).max() < 5 * np.pi
        for turn in branch.turns[::97]:
            assert robot.forward(turn).isApprox(robot.forward(q), 1e-7)


def test_marks_samples_of_self_motion() -> None:
    pose = UR5.forward(np.array([0.3, -1.1, 1.3, -1.6, 0.0, 0.3]))
    assert all(branch.sampled for branch in kw.solve_pose_ik_all(UR5, pose))
    assert not any(
        branch.sampled for branch in kw.solve_pose_ik_all(UR5, UR5.forward(np.full(6, 0.7)))
    )
    panda = ROBOTS["panda"]
    middle = 0.5 * (panda.limits.lower + panda.limits.upper)
    assert all(branch.sampled for branch in kw.solve_pose_ik_all(panda, panda.forward(middle)))


LOST = {
    "ur5 1": (-3.0133886649, -5.4532247406, 2.0591139657, 1.6349482979, -3.09315796, -2.634759863),
    "ur5 elbow and wrist": (-0.9537, -0.6456, 0.0024, 0.4131, 1e-5, 1.2927),
    "ur5 2": (1.5789, -0.3091, 1e-4, 0.358, 1e-4, -1.902),
    "talos_arm": (1.45171674, -0.30725185, -0.14865706, 2.27148330, -1.04704167, -0.48629108),
    "kinova": (0.2872108578, 4.0027804159, 5.5840493566, -1.1034071512, 3.1146773948, 2.3344353158),
}


@pytest.mark.parametrize("where", LOST)
def test_finds_origin_of_pose_near_singularities(where: str) -> None:
    """Found by looking all around singularities of all arms; each was lost once."""
    robot, q = ROBOTS[where.split()[0]], np.array(LOST[where])
    assert gap(answers(robot, robot.forward(q)), q) < 1e-3
