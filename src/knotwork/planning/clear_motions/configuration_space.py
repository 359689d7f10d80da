"""Collisions, distances and gravity at single configurations, all pairs in one Pinocchio call."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from knotwork.arrays import FloatArray
from knotwork.joint_quantities import JointLimits
from knotwork.scene.collision_model import CollisionModel
from knotwork.scene.distances import DISTANCE_ERROR, NEAREST_POINT_TOLERANCE

SURFACE_DISTANCE = 1e-9
"""Below this distance [m] two bodies have no nearest points, and Coal's normal is used."""


class NearPair(NamedTuple):
    """A pair of nearby solids at a configuration.

    Attributes:
        gap: Distance minus required clearance [m].
        gradient: Derivative of the gap over each joint position [m/rad or m/m], shape (d,).
    """

    gap: float
    gradient: FloatArray


def model_at(model: CollisionModel, time: float) -> CollisionModel:
    """The collision model at a time [s]: pairs of bodies that exist then, at all times."""
    exists = [body.start <= time <= body.end for body in model.bodies]
    return replace(
        model,
        bodies=tuple(replace(body, start=-math.inf, end=math.inf) for body in model.bodies),
        pairs=tuple(pair for pair in model.pairs if exists[pair.first] and exists[pair.second]),
    )


class ConfigurationSpace:
    """The configuration space of an arm: collision tests and distances at configurations.

    Only single configurations are tested; `ClearMotionProblem.unproved_pairs` proves motions. A
    configuration that the arm can't hold against gravity counts as a collision.

    Args:
        arm_model: Pinocchio model of the arm.
        model: Bodies and their pairs.
        limits: Limits of positions and efforts.
        loaded_arm_model: Pinocchio model of the arm with its load, if efforts are limited.

    Attributes:
        checks: Number of configurations checked so far.
    """

    def __init__(
        self,
        arm_model: Any,
        model: CollisionModel,
        limits: JointLimits,
        loaded_arm_model: Any = None,
    ) -> None:
        self.arm_model, self.loaded_arm_model = arm_model, loaded_arm_model
        self.lower, self.upper, self.effort = limits.lower, limits.upper, limits.effort
        self.checks = 0
        self._data = arm_model.createData()
        self._loaded_data = loaded_arm_model and loaded_arm_model.createData()
        self._geometry = pin.GeometryModel()
        solids: list[list[int]] = []
        self._joint: list[int] = []
        for b, body in enumerate(model.bodies):
            solids.append([])
            for s, solid in enumerate(body.solids):
                placed = pin.SE3(solid.rotation, solid.translation)
                shape = pin.GeometryObject(f"{b} {s}", body.joint, placed, solid.geometry)
                solids[b].append(int(self._geometry.addGeometryObject(shape)))
                self._joint.append(body.joint)
        self._pairs: list[tuple[int, int]] = []
        required: list[float] = []
        self.pair_names: list[tuple[str, str]] = []
        for pair in model.pairs:
            for a in solids[pair.first]:
                for b in solids[pair.second]:
                    self._geometry.addCollisionPair(pin.CollisionPair(a, b))
                    self._pairs.append((a, b))
                    required.append(pair.required_clearance)
                    names = model.bodies[pair.first].name, model.bodies[pair.second].name
                    self.pair_names.append(names)
        self.required_clearance = np.array(required)
        self._geometry_data = self._geometry.createData()
        for request in self._geometry_data.distanceRequests:
            request.enable_signed_distance = True
            request.gjk_tolerance = NEAREST_POINT_TOLERANCE
        for request in self._geometry_data.collisionRequests:
            request.enable_contact = False
        self.keep_away(0.0)

    def keep_away(self, extra_clearance: float, ends: Sequence[FloatArray] = ()) -> None:
        """Require additional clearance in `is_clear`.

        Args:
            extra_clearance: The additional clearance [m].
            ends: Configurations that must be clear, see `possible_clearance`.
        """
        possible = self.possible_clearance(extra_clearance, ends)
        limits = self.required_clearance + possible + DISTANCE_ERROR
        for request, distance in zip(
            self._geometry_data.collisionRequests, limits.tolist(), strict=True
        ):
            request.security_margin = distance

    def possible_clearance(self, extra_clearance: float, ends: Sequence[FloatArray]) -> FloatArray:
        """Additional clearance of each pair of solids [m], reduced where the ends have less.

        Args:
            extra_clearance: The additional clearance wanted [m].
            ends: Configurations that must be clear, shape (d,) each. A pair with less than twice
                of that there must keep half of its gap.
        """
        clearances = np.full(len(self._pairs), extra_clearance)
        for q in ends:
            clearances = np.minimum(clearances, 0.5 * np.maximum(self.gaps(q), 0.0))
        return clearances

    def is_clear(self, q: FloatArray) -> bool:
        """Whether a configuration keeps every clearance, with that of `keep_away`."""
        self.checks += 1
        return self._holds_arm(q) and not pin.computeCollisions(
            self.arm_model, self._data, self._geometry, self._geometry_data, q, True
        )

    def _holds_arm(self, q: FloatArray) -> bool:
        """Whether efforts within the limits hold the arm at a configuration."""
        if self.loaded_arm_model is None:
            return True
        gravity = pin.computeGeneralizedGravity(self.loaded_arm_model, self._loaded_data, q)
        return bool((np.abs(gravity) <= self.effort).all())

    def is_clear_edge(self, start: FloatArray, end: FloatArray, step: float) -> bool:
        """Whether samples between two configurations, at most a step apart, are clear."""
        count = math.ceil(float(np.linalg.norm(end - start)) / step)
        return all(self.is_clear(start + k / count * (end - start)) for k in _coarse_first(count))

    def gaps(self, q: FloatArray) -> FloatArray:
        """Distances of all pairs of solids minus their required clearances [m]."""
        pin.computeDistances(self.arm_model, self._data, self._geometry, self._geometry_data, q)
        distances = [result.min_distance for result in self._geometry_data.distanceResults]
        return np.asarray(np.array(distances) - self.required_clearance)

    def worst(self, q: FloatArray) -> tuple[float, tuple[str, str]]:
        """The minimum gap at a configuration [m], and the two bodies."""
        gaps = self.gaps(q)
        k = int(np.argmin(gaps))
        return float(gaps[k]), self.pair_names[k]

    def near_pairs(self, q: FloatArray, within: float, max_pairs: int) -> list[NearPair]:
        """The nearest pairs of solids at a configuration, with the gradients of their gaps.

        Args:
            q: Configuration [rad or m], shape (d,).
            within: Maximum gap of pairs [m].
            max_pairs: Maximum number of pairs.
        """
        gaps = self.gaps(q)
        order = np.argsort(gaps, kind="stable")[:max_pairs]
        pin.computeJointJacobians(self.arm_model, self._data, q)
        return [NearPair(float(gaps[k]), self._gradient(int(k))) for k in order if gaps[k] < within]

    def _gradient(self, k: int) -> FloatArray:
        """Derivative of the distance of a pair, from the distances and Jacobians computed last."""
        result = self._geometry_data.distanceResults[k]
        points = np.array(result.getNearestPoint1()), np.array(result.getNearestPoint2())
        normal = points[1] - points[0]
        length = float(np.linalg.norm(normal))
        if result.min_distance > SURFACE_DISTANCE and length > SURFACE_DISTANCE:
            normal = normal / length
        else:
            normal = np.array(result.normal)
        gradient = np.zeros(self.arm_model.nv)
        for solid, point, sign in zip(self._pairs[k], points, (-1.0, 1.0), strict=True):
            joint = self._joint[solid]
            if joint:
                J = pin.getJointJacobian(self.arm_model, self._data, joint, pin.LOCAL_WORLD_ALIGNED)
                lever = point - self._data.oMi[joint].translation
                gradient += sign * (normal @ J[:3] + np.cross(lever, normal) @ J[3:])
        return gradient


@lru_cache(maxsize=512)
def _coarse_first(count: int) -> tuple[int, ...]:
    """The numbers 1 to count - 1 in order of bisection: the middle, the quarters, and so on."""
    order: dict[int, None] = {}
    step = count
    while step > 1:
        step = (step + 1) // 2
        order.update(dict.fromkeys(range(step, count, step)))
    return tuple(order)
