"""Collisions, by Coal, of every pair that docs/collisions.md does not exempt, dense in time."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import coal
import numpy as np
import pinocchio as pin

from judge.arm import Arm, found
from judge.motion import Motion
from judge.placing import placement
from judge.task import Task

SAMPLES = 400
TOUCHING = 1e-6
"""Coal's distances are right to a micrometre."""

SHAPES = ("box", "sphere", "cylinder", "capsule", "cone", "ellipsoid", "half_space", "mesh")
Row = tuple[str, str, float, float]


@dataclass
class Body:
    """Shapes that one frame of the model carries, and from when to when they are there [s]."""

    name: str
    kind: str  # link, tool, held or object
    joint: int
    shapes: list[int]
    start: float = -np.inf
    end: float = np.inf
    apart: bool = False


class Surroundings:
    """An arm with all that may collide."""

    def __init__(self, task: Task, motion: Motion) -> None:
        arm = task.arm
        self.task, self.arm = task, arm
        self.model = arm.model
        self.geometry = link_shapes(arm)
        self.bodies = self._bodies(motion)
        self.scene = task.data.get("scene") or {}
        self.rules = task.data.get("collisions") or {}
        self._pair()

    def _shape(self, name: str, given: Mapping[str, Any], joint: int, carrier: pin.SE3) -> int:
        shape, extra = solid(given, self.task.length, self.task.folder)
        placed = carrier * placement(given, self.task.length, self.task.angle) * extra
        index = len(self.geometry.geometryObjects)
        one = pin.GeometryObject(f"judge {name} {index}", joint, placed, shape)
        return int(self.geometry.addGeometryObject(one))

    def _bodies(self, motion: Motion) -> list[Body]:
        by_link: dict[str, Body] = {}
        for i, one in enumerate(self.geometry.geometryObjects):
            link = self.model.frames[one.parentFrame].name
            body = by_link.setdefault(link, Body(link, "link", one.parentJoint, []))
            body.shapes.append(i)
        bodies = list(by_link.values())
        arm, tool = self.arm, self.task.data.get("tool") or {}
        if tool.get("shape"):
            shapes = tool["shape"] if isinstance(tool["shape"], list) else [tool["shape"]]
            parts = [self._shape("tool", one, arm.tool_joint, arm.tool_placement) for one in shapes]
            bodies.append(Body("tool", "tool", arm.tool_joint, parts))
        for name, one in ((self.task.data.get("scene") or {}).get("objects") or {}).items():
            if not one.get("visual"):
                carrier = arm.base * self.task.frames[one.get("in", "base")]
                shapes = [self._shape(name, one, 0, carrier)]
                bodies.append(Body(name, "object", 0, shapes, start=self._since(one)))
        for name, one in (tool.get("holds") or {}).items():
            bodies += self._held(name, one, motion)
        return bodies

    def _since(self, one: Mapping[str, Any]) -> float:
        """When an object appears."""
        return next((w.time for w in self.task.waypoints if w.name == one.get("appears")), -np.inf)

    def _held(self, name: str, one: Mapping[str, Any], motion: Motion) -> list[Body]:
        """Standing before, in the tool, standing after; near the tool it may touch it."""
        given, arm = self.task.waypoints, self.arm
        take, leave = (
            next(k for k, w in enumerate(given) if w.name == one[key]) for key in ("from", "to")
        )
        times = np.array([w.time for w in given])
        poses = arm.poses(motion(np.clip(times, motion.x[0], motion.x[-1])))

        def away(k: int, other: int) -> bool:
            gap = poses[k].translation - poses[other].translation
            return bool(np.abs(gap).max() > 1e-6)

        coming = next((times[k] for k in range(take - 1, -1, -1) if away(k, take)), -np.inf)
        gone = next((times[k] for k in range(leave + 1, len(given)) if away(k, leave)), np.inf)
        here, there = ([self._shape(name, one, 0, arm.base * poses[k])] for k in (take, leave))
        carried = [self._shape(name, one, arm.tool_joint, arm.tcp_placement)]
        start, end, since = float(times[take]), float(times[leave]), self._since(one)
        bodies = [
            Body(name, "standing", 0, here, since, coming, apart=True),
            Body(name, "standing", 0, here, max(since, coming), start),
            Body(name, "held", arm.tool_joint, carried, start, end),
            Body(name, "standing", 0, there, end, gone),
            Body(name, "standing", 0, there, gone, apart=True),
        ]
        return [body for body in bodies if body.start < body.end]

    def _moves(self, body: Body) -> int:
        """The last joint of the arm that moves a body; 0 if none does."""
        joint = body.joint
        while joint and joint not in self.arm.joints:
            joint = self.model.parents[joint]
        return int(joint)

    def _exempt(self) -> tuple[set[frozenset[str]], set[frozenset[str]]]:
        """Pairs of names that the scenario takes out: always, and while a thing is handled."""
        always = {frozenset(pair) for pair in self.rules.get("ignore") or []}
        handled = set()
        objects = self.scene.get("objects") or {}
        holds = (self.task.data.get("tool") or {}).get("holds") or {}
        for name, one in objects.items():
            for other in one.get("allow") or []:
                (handled if other in holds else always).add(frozenset((name, other)))
        for name, one in holds.items():
            handled |= {frozenset((name, other)) for other in one.get("allow") or []}
        return always, handled

    def _links_exempt(self) -> set[frozenset[str]]:
        """Pairs of links that a joint joins, or that the robot's file or SRDF takes out."""
        joints = ET.parse(self.arm.urdf).getroot().findall("joint")
        pairs = [(j.find("parent").get("link"), j.find("child").get("link")) for j in joints]  # type: ignore[union-attr]
        rules = self.arm.file.get("collision") or {}
        pairs += [tuple(pair) for pair in rules.get("ignore") or []]
        if rules.get("srdf"):
            srdf = ET.parse(found(rules["srdf"], self.arm.folder)).getroot()
            pairs += [(e.get("link1"), e.get("link2")) for e in srdf.iter("disable_collisions")]
        return {frozenset(pair) for pair in pairs}  # type: ignore[arg-type]

    def _pair(self) -> None:
        """The pairs of bodies to look at, and the least distance of each [m]."""
        always, handled = self._exempt()
        links = self._links_exempt()
        margin = self.task.length * float(self.scene.get("margin") or 0.0)
        itself = self.rules.get("self", True)
        moved = [self._moves(body) for body in self.bodies]
        self.pairs: list[tuple[Body, Body, float, list[int]]] = []
        for i, one in enumerate(self.bodies):
            for j in range(i + 1, len(self.bodies)):
                other = self.bodies[j]
                kinds, names = {one.kind, other.kind}, frozenset((one.name, other.name))
                if moved[i] == moved[j] or one.start >= other.end or other.start >= one.end:
                    continue
                own, apart = kinds <= {"link", "tool"}, one.apart or other.apart
                if (own and not itself) or names in always or (names in handled and not apart):
                    continue
                carried = "tool" in kinds and bool(kinds & {"held", "standing"}) and not apart
                if carried or (kinds == {"link"} and names in links):
                    continue
                around = "object" in kinds
                self.pairs.append((one, other, margin if around else 0.0, []))
        for one, other, _, indices in self.pairs:
            for a in one.shapes:
                for b in other.shapes:
                    pair = pin.CollisionPair(min(a, b), max(a, b))
                    if not self.geometry.existCollisionPair(pair):
                        self.geometry.addCollisionPair(pair)
                    indices.append(self.geometry.findCollisionPair(pair))
        self.found = pin.GeometryData(self.geometry)
        for request in self.found.distanceRequests:
            request.enable_signed_distance = True

    def distances(self, q: np.ndarray) -> np.ndarray:
        """Of all pairs of shapes [m]."""
        whole = self.arm.whole(q[None])[0]
        pin.updateGeometryPlacements(self.model, self.arm.data, self.geometry, self.found, whole)
        pin.computeDistances(self.geometry, self.found)
        return np.array([one.min_distance for one in self.found.distanceResults])


def link_shapes(arm: Arm) -> pin.GeometryModel:
    """Collision shapes of the links; meshes as their convex hulls."""
    folders = [str(p) for p in arm.urdf.parents if p.name in ("share", "robots")]
    folders += [str(arm.urdf.parent), str(arm.urdf.parent.parent.parent)]
    geometry = pin.buildGeomFromUrdf(
        arm.model, str(arm.urdf), pin.GeometryType.COLLISION, package_dirs=folders
    )
    for one in geometry.geometryObjects:
        if isinstance(one.geometry, coal.BVHModelBase):
            one.geometry = _hull(one.geometry)
    return geometry


def _hull(mesh: Any) -> Any:
    mesh.buildConvexHull(True, "Qt")
    return mesh.convex


def solid(given: Mapping[str, Any], length: float, folder: Path) -> tuple[Any, pin.SE3]:
    """Coal's shape of a scenario's, and how it stands to that."""
    kind = next(name for name in SHAPES if name in given)
    value, still = given[kind], pin.SE3.Identity()
    if kind == "box":
        return coal.Box(*(length * float(edge) for edge in value)), still
    if kind == "sphere":
        return coal.Sphere(length * value), still
    if kind == "ellipsoid":
        return coal.Ellipsoid(*(length * float(axis) for axis in value)), still
    if kind == "half_space":
        normal = np.array(value["normal"], dtype=float)
        offset = length * float(value.get("offset") or 0.0)
        return coal.Halfspace(normal / np.linalg.norm(normal), offset), still
    if kind == "mesh":
        factor = length * float(given.get("scale") or 1.0)
        mesh = coal.MeshLoader().load(str(folder / value), np.full(3, factor))
        return (mesh if given.get("exact") else _hull(mesh)), still
    shape = {"cylinder": coal.Cylinder, "capsule": coal.Capsule, "cone": coal.Cone}[kind]
    return shape(length * value["radius"], length * value["length"]), still


def collision_wrongs(task: Task, motion: Motion) -> Iterator[Row]:
    around = Surroundings(task, motion)
    if not around.pairs:
        return
    t = motion.dense(SAMPLES)
    distances = np.array([around.distances(q) for q in motion(t)])
    for one, other, margin, indices in around.pairs:
        both = (t > max(one.start, other.start)) & (t < min(one.end, other.end))
        if not both.any():
            continue
        nearest = float(distances[np.ix_(both, indices)].min())
        if nearest < margin - TOUCHING:
            yield "collision", f"{one.name}, {other.name}", nearest, margin
