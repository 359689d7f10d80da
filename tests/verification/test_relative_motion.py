"""How far solids can come nearer, against placements by Pinocchio at many times."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray

import knotwork as kw
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.robot.joint_tree import place_joints
from knotwork.scene.building import build_collision_model
from knotwork.scene.distances import DistanceMeter
from knotwork.scene.solid_pairs import SolidPairs
from knotwork.scene.solids import Placed, make_solid, support_values
from knotwork.task.scenario import PlacedShape
from knotwork.task.scenario.joint_space import joint_space
from knotwork.verification.bounds.rate_bounds import Intervals
from knotwork.verification.bounds.relative_motion import RelativeMotion

Array = NDArray[np.float64]
LENGTHS = np.array([1e-3, 0.02, 0.1, 0.5])


def solid_pairs(arm: str) -> SolidPairs:
    """All pairs of an arm with a tool and a box."""
    task = kw.load_scenario(
        {
            "robot": arm,
            "tool": {"shape": {"box": [0.1, 0.05, 0.2], "position": [0, 0, 0.1]}},
            "scene": {"objects": {"box": {"box": [0.3, 0.2, 0.1], "position": [0.2, 0.9, 0.9]}}},
            "waypoints": [
                {"joints": dict.fromkeys(kw.load_robot(arm).joint_names, 0.1), "stop": True},
                {"joints": dict.fromkeys(kw.load_robot(arm).joint_names, 0.2), "after": 1},
            ],
        }
    )
    robot = joint_space(task).robot
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


@pytest.mark.parametrize("arm", ["planar2", "ur5", "panda"])
def test_solids_approach_at_most_as_proved(arm: str) -> None:
    """The gap along a direction, carried along with the link that both are attached to."""
    rng = np.random.default_rng(3)
    table = solid_pairs(arm)
    joints = table.model.joints
    model = kw.load_robot(arm).model
    tight = []
    for scale in (0.1, 1.0, 5.0):
        c = scale * rng.normal(size=(4, 1, len(joints.column) - 1))
        curve = PiecewisePolynomial(c, np.array([0.0, 1.0]))
        start = rng.uniform(0.0, 1.0 - LENGTHS)
        intervals = Intervals(np.zeros(len(start), dtype=np.intp), start, LENGTHS)
        middle = curve(start + LENGTHS / 2)
        rotation, origin = place_joints(joints, middle)
        motions = RelativeMotion(joints, table, curve, intervals, rotation, origin)
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
                    n = turned @ rotation[k, common].T @ normal
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
    q = rng.uniform(-2.5, 2.5, (20, len(table.model.joints.column) - 1))
    turn, shift = table.axes(*place_joints(table.model.joints, q))
    combo = np.flatnonzero(table.convex)
    for k in range(len(q)):
        item = np.full(len(combo), k)
        distance, normal = np.empty(len(combo)), rng.normal(size=(len(combo), 3))
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        across = np.empty_like(normal)
        for i, c in enumerate(combo):
            distance[i], across[i] = table.measure(int(c), turn[k], shift[k]), table.normal
        apart = distance > 1e-3
        assert (table.gaps(item, combo, normal, turn, shift)[apart] <= distance[apart] + 1e-6).all()
        gaps = table.gaps(item, combo, across, turn, shift)
        np.testing.assert_allclose(gaps[apart], distance[apart], atol=1e-6)


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
