"""Bounds on derivatives against derivatives by differences of Pinocchio's own functions."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import factorial

import numpy as np
import pinocchio as pin
import pytest

import knotwork as kw
from knotwork.robot.joint_tree import joint_tree
from knotwork.verification.bounds.link_motion import tree_motion
from knotwork.verification.bounds.tool_motion import jacobian_sizes
from knotwork.verification.bounds.torque import masses, torque_sizes

POINTS = np.arange(-7.0, 8.0)
STEP = 0.01


def difference_weights() -> np.ndarray:
    """Row k turns values at POINTS * STEP into the k-th derivative at 0, of order 14 - k.

    They are the derivatives of Lagrange's polynomials, whose coefficients are exact in floats.
    """
    columns = []
    for i, point in enumerate(POINTS):
        others = np.delete(POINTS, i)
        columns.append(np.poly(others)[::-1] / np.prod(point - others))
    orders = np.array([factorial(k) / STEP**k for k in range(POINTS.size)])
    return np.array(columns).T * orders[:, None]


WEIGHTS = difference_weights()


class Motion:
    """Joint positions as random polynomials of degree six about an instant."""

    def __init__(self, model, rng: np.random.Generator) -> None:
        self.model = model
        scale = rng.choice([0.3, 1.0, 2.0], size=(7, model.nv)) * rng.uniform(-1, 1, (7, model.nv))
        scale[0] *= np.pi
        if rng.random() < 0.5:  # one joint at a time, one or two derivatives: little hides the rest
            scale[1:] *= (np.arange(model.nv) == rng.integers(model.nv)) * rng.choice(2, (6, 1))
        self.c = scale / np.array([factorial(k) for k in range(7)]).reshape(-1, 1)

    def at(self, t: float, nu: int) -> np.ndarray:
        powers = [factorial(k) / factorial(k - nu) * t ** (k - nu) for k in range(nu, 7)]
        return np.array(powers) @ self.c[nu:]

    def state(self, t: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return configuration(self.model, self.at(t, 0)), self.at(t, 1), self.at(t, 2)

    def derivatives(self, f: Callable[..., np.ndarray], orders: int) -> np.ndarray:
        values = np.array([f(*self.state(t)) for t in POINTS * STEP])
        return np.tensordot(WEIGHTS[:orders], values, 1)


def configuration(model, angles: np.ndarray) -> np.ndarray:
    """One number a joint, as Pinocchio wants it: cosine and sine for unbounded joints."""
    q = np.zeros(model.nq)
    for joint in list(model.joints)[1:]:
        value = angles[joint.idx_v]
        if joint.nq == 1:
            q[joint.idx_q] = value
        else:
            q[joint.idx_q : joint.idx_q + 2] = np.cos(value), np.sin(value)
    return q


def random_tree(rng: np.random.Generator):
    """A tree of joints of every kind, with motors that have inertia of their own."""
    model = pin.Model()
    for i in range(int(rng.integers(2, 8))):
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        kinds = [
            pin.JointModelRX(),
            pin.JointModelRUBY(),
            pin.JointModelPZ(),
            pin.JointModelHX(0.3),
            pin.JointModelRevoluteUnaligned(axis),
            pin.JointModelPrismaticUnaligned(axis),
        ]
        parent = 0 if i == 0 else int(rng.integers(max(0, i - 2), i + 1))
        placement = pin.SE3(pin.exp3(rng.normal(size=3)), rng.normal(size=3) * 0.4)
        joint = model.addJoint(parent, kinds[rng.integers(len(kinds))], placement, f"joint{i}")
        model.appendBodyToJoint(joint, inertia(rng), pin.SE3.Identity())
    model.gravity.linear = rng.normal(size=3) * 9.81
    model.armature = rng.uniform(0, 0.5, model.nv)
    return model


def inertia(rng: np.random.Generator):
    """A body of three to five point masses."""
    body = pin.Inertia.Zero()
    for _ in range(int(rng.integers(3, 6))):
        body += pin.Inertia(rng.uniform(0.1, 3), rng.normal(size=3) * 0.2, np.zeros((3, 3)))
    return body


def robot_models(rng: np.random.Generator) -> Iterator[tuple[str, object]]:
    """Every robot that is shipped, as it is, then with a payload."""
    for name in kw.robot_names():
        model = kw.load_robot(name).model
        yield name, model
        loaded = model.copy()
        loaded.appendBodyToJoint(loaded.njoints - 1, inertia(rng), pin.SE3.Random())
        yield f"{name} with payload", loaded


def examine(model, rng: np.random.Generator, instants: int) -> None:
    """Compare bounds with derivatives at random instants of random motions."""
    motions = [Motion(model, rng) for _ in range(instants)]
    rates = np.array([[np.abs(motion.at(0.0, nu)) for nu in range(5)] for motion in motions])
    rates = rates.transpose(1, 2, 0)
    joints = joint_tree(model)
    moved = tree_motion(joints, rates)
    torques = torque_sizes(moved, masses(model), rates)
    data = model.createData()
    last = model.njoints - 1
    lever = rng.normal(size=3) * 0.3
    point = pin.Frame("point", last, pin.SE3(np.eye(3), lever), pin.OP_FRAME)
    framed = model.copy()
    frame = framed.addFrame(point)
    framed_data = framed.createData()

    def position(q, _v, _a):
        pin.forwardKinematics(framed, framed_data, q)
        return pin.updateFramePlacement(framed, framed_data, frame).translation.copy()

    def angular(q, v, _a):
        pin.forwardKinematics(model, data, q, v)
        return pin.getVelocity(model, data, last, pin.LOCAL_WORLD_ALIGNED).angular

    def jacobian(q, _v, _a):
        pin.computeJointJacobians(framed, framed_data, q)
        pin.updateFramePlacement(framed, framed_data, frame)
        J = pin.getFrameJacobian(framed, framed_data, frame, pin.LOCAL_WORLD_ALIGNED)
        return np.ravel(J)

    def torque(q, v, a):
        return pin.rnea(model, data, q, v, a).copy()

    reach = float(np.linalg.norm(lever))
    J = jacobian_sizes(moved, last, reach)
    for i, motion in enumerate(motions):
        found = np.abs(motion.derivatives(torque, 3))
        within(found, torques[:, :, i], torques[0, :, i])
        norms = np.linalg.norm(motion.derivatives(position, 5), axis=1)
        bound = moved.point(last, reach)[:, i]
        within(norms, bound, bound[0])
        norms = np.linalg.norm(motion.derivatives(angular, 4), axis=1)
        within(norms, moved.angular[last][:, i], moved.angular[last][0, i])
        norms = np.linalg.norm(motion.derivatives(jacobian, 3), axis=1)
        within(norms, J[:, i], J[0, i])


def within(found: np.ndarray, bound: np.ndarray, size: np.ndarray) -> None:
    """No derivative is above its bound, but for the rounding of differences."""
    for order, (value, largest) in enumerate(zip(found, bound, strict=True)):
        noise = 1e-13 * (1.0 + size) / STEP**order
        assert np.all(value <= largest * (1 + 1e-9) + noise), (order, value, largest)


EXHAUSTIVE = pytest.mark.exhaustive


@pytest.mark.parametrize(("seed", "instants"), [(1, 8), pytest.param(3, 300, marks=EXHAUSTIVE)])
def test_shipped_robots_stay_within_derivative_bounds(seed: int, instants: int) -> None:
    rng = np.random.default_rng(seed)
    for _, model in robot_models(rng):
        examine(model, rng, instants)


@pytest.mark.parametrize(
    ("seed", "trees", "instants"), [(2, 25, 6), pytest.param(3, 500, 10, marks=EXHAUSTIVE)]
)
def test_random_trees_stay_within_derivative_bounds(seed: int, trees: int, instants: int) -> None:
    rng = np.random.default_rng(seed)
    for _ in range(trees):
        examine(random_tree(rng), rng, instants)


def test_pendulum_attains_its_bounds() -> None:
    """One link at a steady rate: position and torque turn like vectors, the bounds are exact."""
    model = pin.Model()
    joint = model.addJoint(0, pin.JointModelRY(), pin.SE3.Identity(), "hinge")
    model.appendBodyToJoint(
        joint, pin.Inertia(2.0, np.array([0.5, 0, 0]), np.zeros((3, 3))), pin.SE3.Identity()
    )
    rate = 3.0
    rates = np.zeros((5, 1, 1))
    rates[1] = rate
    moved = tree_motion(joint_tree(model), rates)
    np.testing.assert_allclose(moved.point(1, 0.5)[:, 0], 0.5 * rate ** np.arange(5))


def test_refuses_joint_with_several_freedoms() -> None:
    model = pin.Model()
    model.addJoint(0, pin.JointModelSpherical(), pin.SE3.Identity(), "ball")
    with pytest.raises(kw.InputError, match="joint 'ball' has 3 degrees of freedom"):
        joint_tree(model)
