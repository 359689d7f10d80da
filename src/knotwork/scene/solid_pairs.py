"""Pairs of solids of a collision model, as arrays, for many times at once."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from knotwork.arrays import FloatArray, IndexArray
from knotwork.scene.collision_model import CollisionModel
from knotwork.scene.containment import is_one_inside_other
from knotwork.scene.distances import DISTANCE_ERROR, DistanceMeter
from knotwork.scene.solids import Placed, support_values


class SolidPairs:
    """The pairs of solids of all checked pairs of bodies, as arrays.

    Attributes:
        model: Bodies and pairs.
        solids: Solids of all bodies.
        joint: Index of the joint that carries each solid, shape (s,).
        first, second: Indices of the two solids of each pair, shape (c,).
        body_pair: Index of the pair of bodies of each pair of solids, shape (c,).
        required_clearance: Required clearance [m], shape (c,).
        exact: Whether one of the two solids is an exact mesh, shape (c,).
        convex: Whether both solids are convex, shape (c,).
        presence: Time interval of the presence of each pair of bodies [s], shape (p, 2).
    """

    def __init__(self, model: CollisionModel) -> None:
        self.model = model
        self.solids = [solid for body in model.bodies for solid in body.solids]
        offset = np.cumsum([0, *(len(body.solids) for body in model.bodies)])
        self.joint = np.array([body.joint for body in model.bodies for _ in body.solids])
        solid_pairs = [
            (offset[pair.first] + a, offset[pair.second] + b, k)
            for k, pair in enumerate(model.pairs)
            for a in range(len(model.bodies[pair.first].solids))
            for b in range(len(model.bodies[pair.second].solids))
        ]
        self.first, self.second, self.body_pair = np.array(solid_pairs).T
        self.required_clearance = np.array(
            [model.pairs[k].required_clearance for k in self.body_pair]
        )
        exact = np.array([solid.triangles is not None for solid in self.solids])
        self.exact = exact[self.first] | exact[self.second]
        convex = np.array([solid.outer_hull is None for solid in self.solids])
        self.convex = convex[self.first] & convex[self.second]
        self.presence = model.presence
        corners = np.array([solid.corners for solid in self.solids])
        corners[~np.isfinite(corners)] = 0.0  # half spaces are fixed
        self._rotation = np.array([solid.rotation for solid in self.solids])
        self._origin = np.array([solid.translation for solid in self.solids])
        # corners, middle and half the edges of each box, in the solid's own axes
        corners = (corners - self._origin[:, None]) @ self._rotation
        self._corners = corners.swapaxes(1, 2)
        self._middle = (corners[:, 0] + corners[:, -1]) / 2
        self._half_edges = corners[:, -1] - self._middle
        self._planes = [
            (np.flatnonzero(self.first == s), solid.plane)
            for s, solid in enumerate(self.solids)
            if solid.plane is not None
        ]
        self._meter = DistanceMeter()

    def placements(self, rotation: FloatArray, origin: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Rotations and origins of the solids' own axes, shapes (k, s, 3, 3) and (k, s, 3).

        Args:
            rotation: Rotations of all joints, shape (k, n + 1, 3, 3).
            origin: Origins of all joints [m], shape (k, n + 1, 3).
        """
        carrier = rotation[:, self.joint]
        solid_origin = (carrier @ self._origin[:, :, None])[..., 0] + origin[:, self.joint]
        return carrier @ self._rotation, solid_origin

    def corners(self, rotation: FloatArray, origin: FloatArray) -> FloatArray:
        """Corners of boxes around the solids [m], shape (k, s, 3, 8).

        Args:
            rotation: Rotations of the solids' own axes, shape (k, s, 3, 3).
            origin: Their origins [m], shape (k, s, 3).
        """
        return np.asarray(rotation @ self._corners + origin[:, :, :, None])

    def min_distances(
        self, placement: IndexArray, pair: IndexArray, rotation: FloatArray, origin: FloatArray
    ) -> FloatArray:
        """Lower bounds of distances, by planes that separate their boxes [m], shape (m,).

        The planes are parallel to the sides, or normal to the line between the middles.

        Args:
            placement: Indices of the k placements, shape (m,).
            pair: Indices of the pairs of solids, shape (m,).
            rotation: Rotations of the solids' own axes, shape (k, s, 3, 3).
            origin: Their origins [m], shape (k, s, 3).
        """
        first, second = self.first[pair], self.second[pair]
        middle = (rotation @ self._middle[:, :, None])[..., 0] + origin
        # axis; component; pair: contiguous memory access
        axes, middle = rotation.reshape(-1, 3, 3).T, middle.reshape(-1, 3).T
        at_first, at_second = (len(self.solids) * placement + solid for solid in (first, second))
        a, b = axes.take(at_first, 2), axes.take(at_second, 2)
        half_a, half_b = self._half_edges.T[:, first], self._half_edges.T[:, second]
        between = middle[:, at_second] - middle[:, at_first]
        # along the axes of both boxes: the distance of the middles less the halves of both boxes
        between_a, between_b = (np.abs(np.einsum("ijm,jm->im", box, between)) for box in (a, b))
        cosines = np.abs(np.einsum("ijm,kjm->ikm", a, b))
        along_a = between_a - half_a - np.einsum("ikm,km->im", cosines, half_b)
        along_b = between_b - half_b - np.einsum("ikm,im->km", cosines, half_a)
        along_axes = np.maximum(along_a, along_b).max(axis=0)
        # the same along the line between the middles
        length = np.maximum(np.linalg.norm(between, axis=0), np.finfo(float).tiny)
        halves = (between_a * half_a + between_b * half_b).sum(axis=0) / length
        bounds: FloatArray = along_axes.clip(length - halves)
        for columns, plane in self._planes:
            rows = np.flatnonzero(np.isin(pair, columns))
            half = (np.abs(plane[:3] @ b[:, :, rows]) * half_b[:, rows]).sum(axis=0)
            bounds[rows] = plane[:3] @ middle[:, at_second[rows]] - plane[3] - half
        return bounds

    def measure(
        self, pair: int, rotation: FloatArray, origin: FloatArray, max_distance: float = math.inf
    ) -> tuple[float, FloatArray]:
        """Distance of a pair of solids [m], at most 0 if they overlap, and its direction.

        The direction is a unit vector from the second to the first, shape (3,), if both are convex.

        Args:
            pair: Index of the pair of solids.
            rotation: Rotations of the solids' own axes, shape (s, 3, 3).
            origin: Their origins [m], shape (s, 3).
            max_distance: Upper bound of relevant distances [m], as in `DistanceMeter.distance`.
        """
        placed = self.placed_pair(pair, rotation, origin)
        return self._meter.distance_and_normal(*placed, max_distance)

    def separating_normals(self, pair: IndexArray, measured: FloatArray) -> FloatArray:
        """Normals of planes that may separate solids, shape (m, 3): measured, or of a half space.

        A measured direction is rounded, and a half space is unbounded in all but its own.

        Args:
            pair: Indices of the pairs of solids, shape (m,).
            measured: Unit vectors from the second to the first, see `measure`, shape (m, 3).
        """
        normals = measured.copy()
        for columns, plane in self._planes:
            normals[np.isin(pair, columns)] = -plane[:3]
        return normals

    def distances_along(
        self,
        placement: IndexArray,
        pair: IndexArray,
        normal: FloatArray,
        rotation: FloatArray,
        origin: FloatArray,
    ) -> FloatArray:
        """Distances of two convex solids along a direction [m], shape (m,).

        Args:
            placement: Indices of the k placements, shape (m,).
            pair: Indices of the pairs of solids, shape (m,).
            normal: Unit vectors from the second to the first, see `separating_normals`, (m, 3).
            rotation: Rotations of the solids' own axes, shape (k, s, 3, 3).
            origin: Their origins [m], shape (k, s, 3).
        """
        result = np.zeros(len(placement))
        first, second = self.first[pair], self.second[pair]
        for solids, direction in ((first, -normal), (second, normal)):
            local = np.einsum("mji,mj->mi", rotation[placement, solids], direction)
            result -= np.einsum("mi,mi->m", direction, origin[placement, solids])
            for s in set(solids.tolist()):
                rows = np.flatnonzero(solids == s)
                result[rows] -= support_values(self.solids[s], local[rows])
        return result

    def placed_pair(
        self, pair: int, rotation: FloatArray, origin: FloatArray
    ) -> tuple[Placed, Placed]:
        """Place the two solids of a pair; arguments as in `measure`."""
        a, b = int(self.first[pair]), int(self.second[pair])
        first = Placed(self.solids[a], rotation[a], origin[a])
        return first, Placed(self.solids[b], rotation[b], origin[b])

    def min_gaps(self, q: FloatArray, time: float, max_gap: float = 0.0) -> FloatArray:
        """The minimum gap at configurations [m], shape (m,).

        The arguments are those of `nearest_pairs`, with one time for all configurations.
        """
        return np.array([gap for gap, _ in self.nearest_pairs(q, np.full(len(q), time), max_gap)])

    def nearest_pairs(
        self, q: FloatArray, time: FloatArray, max_gap: float = math.inf
    ) -> Iterator[tuple[float, int]]:
        """Find the minimum gap at each configuration [m]: distance minus required clearance.

        Each gap comes with the index of its pair of solids, or -1 if none is nearer than
        `max_gap`.

        Args:
            q: Joint positions [rad or m], shape (m, d).
            time: Times [s], shape (m,); bodies that are absent then are ignored.
            max_gap: Upper bound of the gaps [m]. With 0 only the sign is meaningful.
        """
        low, high = self.presence[self.body_pair].T
        placement, pair = np.nonzero((low <= time[:, None]) & (time[:, None] <= high))
        placed = self.model.joint_placements(np.asarray(q, dtype=float), time)
        rotation, origin = self.placements(*placed)
        bounds = np.full((len(time), len(low)), np.inf)
        bounds[placement, pair] = self.min_distances(placement, pair, rotation, origin)
        bounds -= self.required_clearance
        for i, lower in enumerate(bounds):
            min_gap, nearest = max_gap, -1
            for c in np.argsort(lower).tolist():
                if lower[c] > min_gap or (max_gap == 0.0 and min_gap < 0.0):
                    break
                required = float(self.required_clearance[c])
                limit = min_gap + required + DISTANCE_ERROR
                gap = self.measure(c, rotation[i], origin[i], limit)[0] - required
                if gap > 0.0 and self.exact[c]:
                    placed_pair = self.placed_pair(c, rotation[i], origin[i])
                    gap = -gap if is_one_inside_other(*placed_pair) else gap
                gap = gap if gap > 0.0 else min(gap, -1e-300)  # touching counts as too near
                if gap < min_gap:
                    min_gap, nearest = gap, c
            yield min_gap, nearest
