"""MotionBenchMaker's problems for the Panda as scenarios; see mbm/README.md."""

from __future__ import annotations

import tarfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import yaml

FOLDER = Path(__file__).parent / "mbm"
KINDS = (
    "bookshelf_small",
    "bookshelf_tall",
    "bookshelf_thin",
    "box",
    "cage",
    "table_pick",
    "table_under_pick",
)
TOUCHED = {"cage": ("Cube1", ["panda_leftfinger", "panda_rightfinger"])}


@dataclass(frozen=True)
class Problem:
    """Motion from one configuration to another among boxes and cylinders.

    Attributes:
        kind: Its class.
        number: From 1 to 50.
        start, goal: Joint positions by name [rad].
        objects: Of the scene, as scenarios have them.
    """

    kind: str
    number: int
    start: Mapping[str, float]
    goal: Mapping[str, float]
    objects: Mapping[str, Any]

    def scenario(self, margin: float = 0.0) -> dict[str, Any]:
        """The scenario, with a margin [m]."""
        return {
            "name": f"{self.kind} {self.number}",
            "robot": str(FOLDER / "panda_open.yaml"),
            "start": dict(self.start),
            "scene": {"margin": margin, "objects": dict(self.objects)},
            "waypoints": [
                {"name": "goal", "joints": dict(self.goal), "stop": True, "way": "clear"},
            ],
        }


def problems(kinds: tuple[str, ...] = KINDS, numbers: range = range(1, 51)) -> Iterator[Problem]:
    """Problems, one of each class by turns."""
    texts = _texts()
    for number in numbers:
        for kind in kinds:
            folder = f"{kind}_panda"
            request = _read(texts[f"{folder}/request{number:04d}.yaml"])
            scene = _read(texts[f"{folder}/scene{number:04d}.yaml"])
            (wanted,) = request["goal_constraints"]
            goal = {one["joint_name"]: one["position"] for one in wanted["joint_constraints"]}
            state = request["start_state"]["joint_state"]
            start = dict(zip(state["name"], state["position"], strict=True))
            objects = dict(_objects(scene))
            if kind in TOUCHED:
                name, links = TOUCHED[kind]
                objects[name] = {**objects[name], "allow": links}
            yield Problem(kind, number, {name: start[name] for name in goal}, goal, objects)


@lru_cache(maxsize=1)
def _texts() -> dict[str, bytes]:
    with tarfile.open(FOLDER / "panda_problems_1_50.tar.xz") as archive:
        files = ((one, archive.extractfile(one)) for one in archive.getmembers())
        return {one.name.removeprefix("./"): file.read() for one, file in files if file}


def _read(text: bytes) -> Any:
    return yaml.load(text, getattr(yaml, "CSafeLoader", yaml.SafeLoader))


def _objects(scene: Any) -> Iterator[tuple[str, dict[str, Any]]]:
    for one in scene["world"]["collision_objects"]:
        base = _placement(one["pose"]) if "pose" in one else pin.SE3.Identity()
        parts = zip(one["primitives"], one["primitive_poses"], strict=True)
        for k, (primitive, pose) in enumerate(parts):
            placed, size = base * _placement(pose), primitive["dimensions"]
            name = one["id"].replace(" ", "_") + (f"_{k}" if k else "")
            yield (
                name,
                {
                    **_shape(primitive["type"], [float(length) for length in size]),
                    "position": placed.translation.tolist(),
                    "quaternion_xyzw": pin.Quaternion(placed.rotation).coeffs().tolist(),
                },
            )


def _shape(kind: str, size: list[float]) -> dict[str, Any]:
    if kind == "box":
        return {"box": size}
    return {"cylinder": {"length": size[0], "radius": size[1]}}


def _placement(given: Any) -> Any:
    x, y, z, w = given["orientation"]
    turn = pin.Quaternion(w, x, y, z).normalized()
    return pin.SE3(turn.matrix(), np.array(given["position"], dtype=float))
