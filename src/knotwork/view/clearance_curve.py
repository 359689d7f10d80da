"""Clearance from the surroundings over time, sampled, with the nearest pair."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.scene.collision_model import CollisionModel, Pair
from knotwork.scene.solid_pairs import SolidPairs
from knotwork.verification import Motion
from knotwork.verification.collisions import collision_model_of
from knotwork.view.shown_motion import ShownMotion, nearest_around

CLEARANCE_SAMPLES = 200
STEP_OF_TEST, AT_REST = 8, 1e-6
"""Interval, in samples, at which a pair is tested for motion, and the change of its distance below
which it is at rest [m].
"""


class ClearanceCurve(NamedTuple):
    """Clearance of the robot and its load from the surroundings.

    Attributes:
        time: Times [s], shape (n,).
        distance: Distance of the pair with the smallest gap [m], shape (n,); NaN without a pair.
        pair: Index of that pair's name, -1 without a pair, shape (n,).
        names: Names of pairs.
    """

    time: FloatArray
    distance: FloatArray
    pair: list[int]
    names: list[str]


def clearance_curve(shown: ShownMotion) -> ClearanceCurve | None:
    """Sample the clearance; `None` if no pair with the surroundings moves.

    Only pairs that the check examines are sampled. A pair that keeps its clearance at a constant
    distance, such as a floor and the shoulder turning above it, is left out. The time of the
    smallest clearance in the check is one of the samples.
    """
    robot, scenario = shown.joints.robot, shown.scenario
    if robot is None or not scenario.scene.objects:
        return None
    motion = Motion(shown.trajectory, shown.joints)
    model = collision_model_of(motion, scenario, robot)
    nearest = nearest_around(shown.findings)
    worst = [] if nearest is None or nearest.time is None else [nearest.time]
    start, end = shown.trajectory.start_time, shown.trajectory.end_time
    time = np.unique([*np.linspace(start, end, CLEARANCE_SAMPLES - len(worst)), *worst])
    q = motion.curve(time)
    if not (np.ptp(q, axis=0).any() or model.known_motions):
        return None
    presence = model.presence_within(start, end)
    pairs_with_scene = tuple(
        pair
        for pair, (appears, disappears) in zip(model.pairs, presence, strict=True)
        if pair.involves_scene and disappears > appears
    )
    pairs, distance = _nearest(model, pairs_with_scene, q, time)
    while still := {
        k for k in set(pairs) - {-1} if _stands_still(model, pairs_with_scene[k], q, time)
    }:
        pairs_with_scene = tuple(pair for k, pair in enumerate(pairs_with_scene) if k not in still)
        pairs, distance = _nearest(model, pairs_with_scene, q, time)
    if np.isnan(distance).all():
        return None
    kinds = sorted({k for k in pairs if k >= 0})
    drawn = [pairs_with_scene[k] for k in kinds]
    return ClearanceCurve(
        time,
        distance,
        [kinds.index(k) if k >= 0 else -1 for k in pairs],
        [f"{model.bodies[p.second].name}, {model.bodies[p.first].name}" for p in drawn],
    )


def _nearest(
    model: CollisionModel, pairs: tuple[Pair, ...], q: FloatArray, time: FloatArray
) -> tuple[list[int], FloatArray]:
    """Index of the pair with the smallest gap at each time, or -1, and its distance [m]."""
    if not pairs:
        return [-1] * len(time), np.full(len(time), np.nan)
    table = SolidPairs(replace(model, pairs=pairs))
    nearest = list(table.nearest_pairs(q, time))
    distance = [gap + table.required_clearance[c] if c >= 0 else np.nan for gap, c in nearest]
    return [int(table.body_pair[c]) if c >= 0 else -1 for _, c in nearest], np.array(distance)


def _stands_still(model: CollisionModel, pair: Pair, q: FloatArray, time: FloatArray) -> bool:
    """Whether a pair keeps its required clearance at a constant distance."""
    sparse = slice(None, None, STEP_OF_TEST)
    _, distance = _nearest(model, (pair,), q[sparse], time[sparse])
    least, most = np.nanmin(distance), np.nanmax(distance)
    return bool(least > pair.required_clearance and most - least < AT_REST)
