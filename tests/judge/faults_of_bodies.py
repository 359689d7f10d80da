"""Faults of collisions: pairs of bodies of all kinds, and meshes that are cut or broken.

An arm of three links in a plane sweeps through what stands in its way. Only the pair that the
fault is about comes near: no other pair can give it away.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

import urdfs
from judge.cases import Case, Fault, Rng, Shelf, _mapping, size, uniform_spline
from judge.motion import Motion

JOINTS = ("turn", "bend", "twist")
UPPER, FORE, HAND, SIDE = 0.5, 0.3, 0.1, 0.06
"""Lengths of the links along x, and their width and height [m]."""

LIMITS = urdfs.limits(-3.1, 3.1, velocity=100, effort=0)


def _box(x: float, y: float, z: float) -> str:
    return f'<box size="{x!r} {y!r} {z!r}"/>'


def _arm(names: tuple[str, str, str]) -> str:
    """Links and joints of the arm: at zero it lies along x."""
    thin = 0.8 * SIDE
    parts = [urdfs.link("base", urdfs.collision(_box(0.1, 0.1, 0.1), "-0.1 0 -0.2"))]
    for name, length in zip(names, (UPPER, FORE, HAND), strict=True):
        place, shape = f"{0.5 * length + 0.02} 0 0", _box(length - 0.04, thin, SIDE)
        parts.append(urdfs.link(name, urdfs.collision(shape, place)))
    for joint, parent, child, at in zip(
        JOINTS, ("base", *names), names, (0.0, UPPER, FORE), strict=False
    ):
        parts.append(urdfs.joint(joint, parent, child, at=f"{at} 0 0", more=LIMITS))
    return "".join(parts)


def _attached(
    name: str, parent: str, place: np.ndarray, shape: str, joint: str = "", kind: str = "fixed"
) -> str:
    """A link that a joint joins to another one."""
    at = " ".join(repr(float(number)) for number in place)
    link = urdfs.link(name, urdfs.collision(shape))
    return link + urdfs.joint(joint or f"to {name}", parent, name, kind, at=at, more=LIMITS)


def _sweep(rng: Rng, start: np.ndarray, end: np.ndarray) -> Motion:
    """From rest to rest, back and forth."""
    shares = [0, 0, 0, rng.uniform(0.2, 0.4), rng.uniform(0.6, 0.8), 1, 1, 1]
    controls = start + np.outer(shares, end - start)
    return uniform_spline(JOINTS, controls, float(10.0 ** rng.uniform(-0.5, 0.3)))


def _by_joints(robot: dict[str, Any], motion: Motion, **keys: Any) -> dict[str, Any]:
    """A scenario whose waypoints are read off the motion: its ends and its middle."""
    times = [float(motion.x[0]), float(motion.x[len(motion.x) // 2]), float(motion.x[-1])]
    rows = [
        {
            "name": f"point {i + 1}",
            "time": t,
            "joints": _mapping(motion, motion(t)),
            "velocity": _mapping(motion, motion(t, 1)),
        }
        for i, t in enumerate(times)
    ]
    return {"robot": robot, "waypoints": rows, **keys}


class Bench:
    """Writes robots of one case."""

    def __init__(self, rng: Rng, shelf: Shelf) -> None:
        self.rng, self.folder = rng, shelf.folder / "arms"
        self.folder.mkdir(exist_ok=True)
        # so that nothing that is remembered of one file is taken for another
        self.name = f"arm {rng.integers(1 << 62)}"

    def robot(
        self, more: str = "", names: tuple[str, str, str] = ("upper", "fore", "hand"), **keys: Any
    ) -> dict[str, Any]:
        path = self.folder / f"{self.name}.urdf"
        path.write_text(urdfs.robot(_arm(names), more), encoding="utf-8")
        home = dict.fromkeys(JOINTS, 0.0)
        return {
            "urdf": str(path), "base_frame": "base", "tool_frame": names[2],
            "configurations": {"home": home}, **keys,
        }  # fmt: skip

    def srdf(self, first: str, second: str) -> str:
        path = self.folder / f"{self.name}.srdf"
        pair = f'<disable_collisions link1="{first}" link2="{second}" reason="Never"/>'
        path.write_text(urdfs.robot(pair), encoding="utf-8")
        return str(path)


def _in_the_way(rng: Rng, far: float, near: float = 0.3) -> tuple[np.ndarray, np.ndarray, Motion]:
    """A place that a sweep of the first joint comes through, one behind, and that sweep.

    Args:
        rng: For all of them.
        far: How far from the axis, at most, as a part of the upper link.
        near: At least.
    """
    turned = rng.uniform(0.6, 1.2) * rng.choice([-1.0, 1.0])
    out = UPPER * rng.uniform(near, far)
    at = turned * rng.uniform(0.55, 0.7)
    place = out * np.array([np.cos(at), np.sin(at), 0.0])
    motion = _sweep(rng, np.zeros(3), np.array([turned, 0.0, 0.0]))
    return place, np.array([-0.6, 0.0, 0.0]), motion


def standing(make: Callable[[Rng, Shelf, np.ndarray, Motion], dict[str, Any]], far: float) -> Any:
    """A right case and its spoiled one: the same thing behind the arm, or in its way."""

    def right(rng: Rng, shelf: Shelf) -> Case:
        place, behind, motion = _in_the_way(rng, far)
        state = rng.bit_generator.state
        data = make(rng, shelf, behind, motion)
        return Case(data, motion, {"place": place, "state": state})

    def spoil(case: Case, rng: Rng, shelf: Shelf) -> Case:
        rng.bit_generator.state = case.extra["state"]
        rng.integers(1 << 62)  # another file
        return replace(case, data=make(rng, shelf, case.extra["place"], case.motion))

    return right, spoil


def post(rng: Rng, shelf: Shelf, place: np.ndarray, motion: Motion) -> dict[str, Any]:
    """A link that is fixed to the base, against the link that a joint joins to the base."""
    thick = 0.01 * 10.0 ** rng.uniform(-1.0, 0.5)
    shape = f'<cylinder radius="{thick!r}" length="0.3"/>'
    return _by_joints(Bench(rng, shelf).robot(_attached("post", "base", place, shape)), motion)


def second_arm(rng: Rng, shelf: Shelf, place: np.ndarray, motion: Motion) -> dict[str, Any]:
    """An arm whose joint is locked, or moves nothing here, against the first moving link."""
    bench, stand = Bench(rng, shelf), place + np.array([0.0, 0.0, 0.25])
    more = _attached("stand", "base", stand, _box(0.02, 0.02, 0.02))
    shape, down = _box(0.02, 0.02, 0.2), np.array([0, 0, -0.15])
    more += _attached("other arm", "stand", down, shape, "other turn", "revolute")
    keys: dict[str, Any] = {"locked": {"other turn": float(rng.uniform(-3, 3))}}
    return _by_joints(bench.robot(more, **(keys if rng.random() < 0.5 else {})), motion)


def standing_object(rng: Rng, shelf: Shelf, place: np.ndarray, motion: Motion) -> dict[str, Any]:
    """An object of the scene, of any shape and size, against a link."""
    r = 0.01 * 10.0 ** rng.uniform(-1.0, 0.3)
    shapes: list[dict[str, Any]] = [
        {"box": [2 * r, 2 * r, 0.3]}, {"sphere": r}, {"cylinder": {"radius": r, "length": 0.2}},
        {"capsule": {"radius": r, "length": 0.2}}, {"cone": {"radius": r, "length": 0.3}},
        {"ellipsoid": [r, r, 0.1]},
    ]  # fmt: skip
    shape = shapes[int(rng.integers(len(shapes)))]
    # names that mean something elsewhere are names here
    name = str(rng.choice(["thing", "world", "universe", "tip", "object", "held", "scene"]))
    scene = {"objects": {name: {**shape, "position": place.tolist()}}}
    return _by_joints(Bench(rng, shelf).robot(), motion, scene=scene)


def folding(make: Callable[[Rng, Shelf, Motion], dict[str, Any]], bend: float) -> Any:
    """A right case, the arm hardly bent, and a spoiled one that folds its hand onto its arm."""

    def right(rng: Rng, shelf: Shelf) -> Case:
        motion = _sweep(rng, np.zeros(3), np.array([rng.uniform(-1, 1), 0.5, 0.0]))
        return Case(make(rng, shelf, motion), motion)

    def spoil(case: Case, rng: Rng, shelf: Shelf) -> Case:
        turned = bend * rng.uniform(0.98, 1.02) * rng.choice([-1.0, 1.0])
        motion = _sweep(rng, np.zeros(3), np.array([rng.uniform(-1, 1), turned, 0.0]))
        return Case(make(rng, shelf, motion), motion)

    return right, spoil


def tool_called_like_a_link(rng: Rng, shelf: Shelf, motion: Motion) -> dict[str, Any]:
    """The SRDF takes a link `tool` out; the scenario's tool is another body."""
    bench = Bench(rng, shelf)
    more = _attached("tool", "fore", np.array([FORE + HAND, 0, 0.5]), _box(0.01, 0.01, 0.01))
    srdf = {"collision": {"srdf": bench.srdf("tool", "upper")}}
    reach = rng.uniform(0.2, 0.24)
    shape = {"box": [0.02, 2 * reach, 0.02], "position": [HAND + 0.02, 0, 0]}
    return _by_joints(bench.robot(more, **srdf), motion, tool={"shape": shape})


def itself(rng: Rng, shelf: Shelf, motion: Motion) -> dict[str, Any]:
    """The hand against the upper arm."""
    bench = Bench(rng, shelf)
    reach = rng.uniform(0.2, 0.24)
    names = ("upper", "fore", str(rng.choice(["hand", "tool"])))
    more = _attached("bar", names[2], np.array([HAND + 0.02, 0, 0]), _box(0.02, 2 * reach, 0.02))
    return _by_joints(bench.robot(more, names), motion)


def margin_case(rng: Rng, shelf: Shelf) -> Case:
    """The arm passes below a ball: what is between them is known."""
    place, _, motion = _in_the_way(rng, 0.8)
    gap, r = 10.0 ** rng.uniform(-3.0, -1.0), rng.uniform(0.005, 0.05)
    ball = {"sphere": r, "position": [*place[:2], 0.5 * SIDE + r + gap]}
    scene = {"margin": 0.5 * gap, "objects": {"ball": ball}}
    data = _by_joints(Bench(rng, shelf).robot(), motion, scene=scene)
    return Case(data, motion, {"gap": gap})


def margin(case: Case, rng: Rng, shelf: Shelf) -> Case:
    """A little more is to be kept than is."""
    more = min(2e-6 * size(rng, 3.0), 0.05)
    scene = {**case.data["scene"], "margin": case.extra["gap"] + more}
    return case.with_data({"scene": scene})


def held(rng: Rng, shelf: Shelf, place: np.ndarray, motion: Motion) -> dict[str, Any]:
    """What the tool holds, against an object; the arm itself passes above it."""
    bench = Bench(rng, shelf)
    out = UPPER + FORE + HAND
    way = place[:2] / np.linalg.norm(place[:2])
    thing = {"box": [0.03, 0.03, 0.1], "position": [*(out * way), -0.2]}
    held = {"box": [0.02, 0.02, 0.3], "position": [HAND, 0, -0.15]}
    tool = {"holds": {"part": {"from": "point 1", "to": "point 3", **held, "allow": ["hand"]}}}
    scene = {"objects": {"thing": thing}}
    return _by_joints(bench.robot(), motion, tool=tool, scene=scene)


COLLIDES = {"collision"}
FAULTS: dict[str, Fault] = {
    name: Fault(*parts, COLLIDES, count, collisions=True)
    for name, parts, count in (
        ("a post on the base", standing(post, 0.8), 100),
        ("a second arm on the base", standing(second_arm, 0.8), 60),
        ("an object", standing(standing_object, 0.8), 220),
        ("a held object and another", standing(held, 0.8), 90),
        ("a tool, and a link called so", folding(tool_called_like_a_link, 2.8), 60),
        ("the arm itself", folding(itself, 2.8), 60),
        ("a margin", (margin_case, margin), 90),
    )
}
