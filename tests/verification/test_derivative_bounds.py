"""Bounds on derivatives and on how far solids approach, against Pinocchio."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import factorial
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray

import knotwork as kw
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.robot.joint_tree import joint_tree, place_joints
from knotwork.scene.building import build_collision_model
from knotwork.scene.distances import DistanceMeter
from knotwork.scene.solid_pairs import SolidPairs
from knotwork.scene.solids import Placed, make_solid, support_values
from knotwork.task.scenario import PlacedShape
from knotwork.task.scenario.scenario_joints import read_scenario_joints
from knotwork.verification.bounds.effort import effort_rate_bounds
from knotwork.verification.bounds.link_motion import tree_motion
from knotwork.verification.bounds.rate_bounds import Intervals
from knotwork.verification.bounds.relative_motion import RelativeMotion
from knotwork.verification.bounds.tool_motion import jacobian_rate_bounds
from sweeps import first_of, mostly_exhaustive

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
    torques = effort_rate_bounds(moved, model, rates)
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
    J = jacobian_rate_bounds(moved, last, reach)
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


@pytest.mark.parametrize(("seed", "instants"), first_of((1, 8), (3, 300)))
def test_shipped_robots_stay_within_derivative_bounds(seed: int, instants: int) -> None:
    rng = np.random.default_rng(seed)
    for _, model in robot_models(rng):
        examine(model, rng, instants)


@pytest.mark.parametrize(("seed", "trees", "instants"), first_of((2, 25, 6), (3, 500, 10)))
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


Array = NDArray[np.float64]
LENGTHS = np.array([1e-3, 0.02, 0.1, 0.5])


def solid_pairs(arm: str, **objects: Any) -> SolidPairs:
    """All pairs of an arm with a tool, a box and further objects."""
    box = {"box": [0.3, 0.2, 0.1], "position": [0.2, 0.9, 0.9]}
    task = kw.load_scenario(
        {
            "robot": arm,
            "tool": {"shape": {"box": [0.1, 0.05, 0.2], "position": [0, 0, 0.1]}},
            "scene": {"objects": {"box": box, **objects}},
            "waypoints": [
                {"joints": dict.fromkeys(kw.load_robot(arm).joint_names, 0.1), "stop": True},
                {"joints": dict.fromkeys(kw.load_robot(arm).joint_names, 0.2), "after": 1},
            ],
        }
    )
    robot = read_scenario_joints(task).robot
    assert robot is not None
    return SolidPairs(build_collision_model(task, robot))


def placed_corners(table: SolidPairs, model: Any, q: Array) -> Array:
    """Corners of the boxes around all solids, placed by Pinocchio; shape (s, 8, 3)."""
    data = model.createData()
    pin.forwardKinematics(model, data, q)
    placements = [data.oMi[int(joint)] for joint in table.joint]
    return np.array(
        [
            one.corners @ np.array(place.rotation).T + np.array(place.translation)
            for one, place in zip(table.solids, placements, strict=True)
        ]
    )


@pytest.mark.parametrize("arm", mostly_exhaustive(["planar2", "ur5", "panda"], "planar2", "ur5"))
def test_solids_approach_at_most_as_proved(arm: str) -> None:
    """The gap along a direction, carried along with the link that both are attached to."""
    rng = np.random.default_rng(3)
    table = solid_pairs(arm)
    joints = table.model.tree
    model = kw.load_robot(arm).model
    tight = []
    for scale in (0.1, 1.0, 5.0):
        c = scale * rng.normal(size=(4, 1, len(joints.column) - 1))
        curve = PiecewisePolynomial(c, np.array([0.0, 1.0]))
        start = rng.uniform(0.0, 1.0 - LENGTHS)
        intervals = Intervals(np.zeros(len(start), dtype=np.intp), start, LENGTHS)
        motions = RelativeMotion(table, curve, intervals)
        for combo in rng.choice(len(table.first), min(12, len(table.first)), replace=False):
            a, b = table.first[combo], table.second[combo]
            both = np.flatnonzero(joints.carriers[table.joint[a]] & joints.carriers[table.joint[b]])
            common = int(both[-1]) if len(both) else 0
            for k in range(len(start)):
                normal = rng.normal(size=3)
                normal /= np.linalg.norm(normal)
                at, one = np.array([k]), np.array([combo])
                along = motions.approach(at, one, normal[None])[0]
                gaps = []
                for t in np.linspace(start[k], start[k] + LENGTHS[k], 21):
                    corners = placed_corners(table, model, curve(t))
                    turned = place_joints(joints, curve(np.array([t])))[0][0, common]
                    n = turned @ motions.rotation[k, common].T @ normal
                    gaps.append((corners[a] @ n)[:, None] - (corners[b] @ n)[None])
                moved = np.abs(np.array(gaps) - gaps[10])
                assert moved.max() <= along * (1 + 1e-9) + 1e-12
                largest = motions.largest(at, one)[0]
                assert moved.max() <= largest * (1 + 1e-9) + 1e-12
                if largest > 0 and k == 0:
                    tight.append(moved.max() / along)
    assert np.median(tight) > 0.5


@pytest.mark.parametrize("arm", ["planar2", "ur5", "panda"])
def test_plane_gap_is_at_most_distance(arm: str) -> None:
    """Distances are Coal's; across the line of the nearest points the gap is the distance."""
    rng = np.random.default_rng(8)
    table = solid_pairs(arm)
    q = rng.uniform(-2.5, 2.5, (20, len(table.model.tree.column) - 1))
    turn, shift = table.placements(*place_joints(table.model.tree, q))
    combo = np.flatnonzero(table.convex)
    for k in range(len(q)):
        item = np.full(len(combo), k)
        distance, normal = np.empty(len(combo)), rng.normal(size=(len(combo), 3))
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        across = np.empty_like(normal)
        for i, c in enumerate(combo):
            distance[i], across[i] = table.measure(int(c), turn[k], shift[k])
        apart = distance > 1e-3
        gaps = table.distances_along(item, combo, normal, turn, shift)
        assert (gaps[apart] <= distance[apart] + 1e-6).all()
        gaps = table.distances_along(item, combo, across, turn, shift)
        np.testing.assert_allclose(gaps[apart], distance[apart], atol=1e-6)


def test_half_space_is_separated_by_its_plane() -> None:
    """Its distance is infinite along any other direction; measured directions are not changed."""
    slope = {"half_space": {"normal": [0, 0.6, 0.8]}, "position": [0, 0, -2]}
    table = solid_pairs("ur5", slope=slope)
    pairs = np.arange(len(table.first))
    measured = np.random.default_rng(9).normal(size=(len(pairs), 3))
    measured /= np.linalg.norm(measured, axis=1)[:, None]
    measured.flags.writeable = False
    normals = table.separating_normals(pairs, measured)
    on_slope = np.array([table.solids[solid].plane is not None for solid in table.first])
    assert 0 < on_slope.sum() < len(pairs)
    np.testing.assert_array_equal(normals[~on_slope], measured[~on_slope])
    turn, shift = table.placements(*place_joints(table.model.tree, np.full((1, 6), 0.3)))
    gaps = table.distances_along(np.zeros_like(pairs), pairs, normals, turn, shift)
    for pair in np.flatnonzero(on_slope).tolist():
        np.testing.assert_allclose(normals[pair], [0, -0.6, -0.8], atol=1e-15)
        assert gaps[pair] == pytest.approx(table.measure(pair, turn[0], shift[0])[0], abs=1e-6)


@pytest.mark.parametrize(
    ("kind", "size"),
    [
        ("box", (0.1, 0.2, 0.3)),
        ("sphere", (0.1,)),
        ("ellipsoid", (0.1, 0.2, 0.05)),
        ("capsule", (0.1, 0.3)),
        ("cylinder", (0.1, 0.3)),
        ("cone", (0.1, 0.3)),
    ],
)
def test_support_values_of_shapes_equals_that_of_coal(kind: str, size: tuple[float, ...]) -> None:
    rng, meter, here = np.random.default_rng(2), DistanceMeter(), pin.SE3.Identity()
    one = make_solid(PlacedShape(kind, size, here), here)
    at_origin = Placed(one, np.eye(3), np.zeros(3))
    directions = rng.normal(size=(200, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    for n, reach in zip(directions, support_values(one, directions), strict=True):
        beyond = make_solid(PlacedShape("half_space", (*-n, -1.0), here), here)  # n·p ≥ 1 m
        wall = Placed(beyond, np.eye(3), np.zeros(3))
        assert meter.distance(wall, at_origin) == pytest.approx(1.0 - reach, abs=1e-9)
