"""Clearance from the surroundings over time, sampled, with the nearest pair."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from knotwork.scenario import Scenario
from knotwork.scenario.joint_space import JointSpace
from knotwork.scene.collision_model import CollisionModel, Pair
from knotwork.spline.trajectory import JointTrajectory
from knotwork.verification import Finding, Motion
from knotwork.verification.collisions import motion_model
from knotwork.waypoints import FloatArray

CLEARANCE_SAMPLES = 200
# Interval of the samples that test whether a pair moves, and motion [m] below which it is at rest.
STEP_OF_TEST, AT_REST = 8, 1e-6


class ClearanceCurve(NamedTuple):
    """Clearance of the robot and its load from the surroundings.

    Attributes:
        time: Times [s], shape (n,).
        distance: Distance of the pair with the smallest margin [m], shape (n,); NaN without a pair.
        pair: Index of that pair's name, shape (n,).
        names: Names of pairs.
    """

    time: FloatArray
    distance: FloatArray
    pair: list[int]
    names: list[str]


def clearance_curve(
    trajectory: JointTrajectory,
    scenario: Scenario,
    space: JointSpace,
    span: tuple[float, float],
    also: Sequence[float] = (),
) -> ClearanceCurve | None:
    """Sample the clearance; `None` without moving pairs with the surroundings.

    A pair that keeps its margin at a constant distance, such as a floor and the shoulder
    turning above it, is left out.

    Args:
        trajectory: The whole motion, for the poses of held objects.
        scenario: The task.
        space: The joints and their robot.
        span: Time interval of the samples [s].
        also: More times to sample [s].
    """
    if space.robot is None or not scenario.scene.objects:
        return None
    motion = Motion(trajectory, space)
    model = motion_model(motion, scenario, space.robot)
    time = np.unique([*np.linspace(*span, CLEARANCE_SAMPLES - len(also)), *also])
    q = motion.curve(time)
    if not (np.ptp(q, axis=0).any() or model.known):
        return None
    around = tuple(pair for pair in model.pairs if pair.around)
    nearest = _nearest(model, around, q, time)
    while still := {
        k for k in set(nearest.pairs) - {-1} if _stands_still(model, around[k], q, time)
    }:
        around = tuple(pair for k, pair in enumerate(around) if k not in still)
        nearest = _nearest(model, around, q, time)
    pairs, distance = nearest
    if np.isnan(distance).all():
        return None
    kinds = sorted({k for k in pairs if k >= 0})
    bodies = [(model.bodies[around[k].second], model.bodies[around[k].first]) for k in kinds]
    return ClearanceCurve(
        time,
        distance,
        [kinds.index(k) if k >= 0 else -1 for k in pairs],
        [f"{first.name}, {second.name}" for first, second in bodies],
    )


def nearest_around(findings: Sequence[Finding]) -> Finding | None:
    """The finding on the pair with the surroundings that is nearest to its margin."""
    pairs = [pair for pair in findings if pair.quantity == "clearance" and pair.around]
    return min(pairs, key=lambda pair: (pair.value or 0.0) - (pair.limit or 0.0), default=None)


class _NearestPairs(NamedTuple):
    pairs: list[int]
    distance: FloatArray


def _nearest(
    model: CollisionModel, pairs: tuple[Pair, ...], q: FloatArray, time: FloatArray
) -> _NearestPairs:
    """The pair with the smallest margin at each time, or -1, and its distance [m]."""
    if not pairs:
        return _NearestPairs([-1] * len(time), np.full(len(time), np.nan))
    from knotwork.scene.solid_pairs import SolidPairs

    table = SolidPairs(replace(model, pairs=pairs))
    nearest = list(table.nearest(q, time))
    distance = [gap + table.margin[c] if c >= 0 else np.nan for gap, c in nearest]
    return _NearestPairs(
        [int(table.pair[c]) if c >= 0 else -1 for _, c in nearest], np.array(distance)
    )


def _stands_still(model: CollisionModel, pair: Pair, q: FloatArray, time: FloatArray) -> bool:
    """Whether a pair keeps its margin at a constant distance."""
    sparse = slice(None, None, STEP_OF_TEST)
    distance = _nearest(model, (pair,), q[sparse], time[sparse]).distance
    least, most = np.nanmin(distance), np.nanmax(distance)
    return bool(least > pair.margin and most - least < AT_REST)
