"""Distances of an arm's links and objects by Pinocchio's own reader and Coal, without Knotwork."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import coal
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

import knotwork as kw

Array = NDArray[np.float64]


class Truth:
    """An arm whose base is the root of its URDF, with hulls of its links, and objects around it."""

    def __init__(self, name: str, objects: dict[str, tuple[Any, Any]]) -> None:
        robot = kw.load_robot(name)
        self.joints = robot.joint_names
        self.locked = dict(robot.locked)
        self.model = pin.buildModelFromUrdf(str(robot.urdf))
        data = next(p for p in Path(robot.urdf).parents if p.name == "robots")
        folders = [str(data.parent.parent), str(data.parent), str(data)]
        self.geometry = pin.buildGeomFromUrdf(
            self.model, str(robot.urdf), pin.GeometryType.COLLISION, package_dirs=folders
        )
        self.owner: dict[str, list[int]] = {}
        for i, one in enumerate(self.geometry.geometryObjects):
            if isinstance(one.geometry, coal.BVHModelBase):
                one.geometry.buildConvexHull(True, "Qt")
                one.geometry = one.geometry.convex
            link = self.model.frames[one.parentFrame].name
            self.owner.setdefault(link, []).append(i)
        for one, (geometry, placement) in objects.items():
            shape = pin.GeometryObject(one, 0, placement, geometry)
            self.owner[one] = [self.geometry.addGeometryObject(shape)]
        self.geometry.addAllCollisionPairs()
        self.index = {
            frozenset((pair.first, pair.second)): i
            for i, pair in enumerate(self.geometry.collisionPairs)
        }
        self.data, self.found = self.model.createData(), pin.GeometryData(self.geometry)
        for request in self.found.distanceRequests:
            request.enable_signed_distance = True

    def place(self, values: Array) -> None:
        q = pin.neutral(self.model)
        for name, value in [*self.locked.items(), *zip(self.joints, values, strict=True)]:
            q[self.model.joints[self.model.getJointId(name)].idx_q] = value
        pin.updateGeometryPlacements(self.model, self.data, self.geometry, self.found, q)

    def distance(self, first: str, second: str) -> float:
        """Distance of two links, or a link and an object, where they have been placed [m]."""
        return min(
            pin.computeDistance(
                self.geometry, self.found, self.index[frozenset((a, b))]
            ).min_distance
            for a in self.owner[first]
            for b in self.owner[second]
        )
