"""What the proof of collisions costs beside samples at 1 kHz, and what these miss.

The same bodies and pairs are checked by Knotwork's proof over all time, and by Pinocchio's
`computeCollisions` at every millisecond. Both run in turn in one process, and the least time of
the processor counts. A part of 5,120 triangles at the block is a ball, as its convex hull and as it
is, and a ring. Then an arm of two joints swings a thin blade through thin rods: how many of them
does each find?

With `--save benchmarks/results` the results are saved there.
"""

from __future__ import annotations

import math
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
import numpy as np
import pinocchio as pin
import trimesh
from rich.console import Console

import knotwork as kw
import results
from knotwork.files import documents
from knotwork.files.documents import resources
from knotwork.scene.collision_model import CollisionModel
from knotwork.verification import Motion
from knotwork.verification.collisions import check_collisions, collision_model_of
from results import Table

RATE = 1000
RODS = 40


def cost(action: Callable[[], object]) -> float:
    """Time of the processor [s]."""
    start = time.process_time()
    action()
    return time.process_time() - start


def pinocchio_geometry(model: CollisionModel) -> Any:
    """The bodies and pairs of a collision model as Pinocchio has them."""
    geometry = pin.GeometryModel()
    places: list[tuple[int, int]] = []
    for k, body in enumerate(model.bodies):
        for one in body.solids:
            placement = pin.SE3(one.rotation, one.translation)
            name = f"{body.name} {k} {len(places)}"
            shape = pin.GeometryObject(name, body.joint, placement, one.geometry)
            places.append((k, geometry.addGeometryObject(shape)))
    for pair in model.pairs:
        for i in (place for k, place in places if k == pair.first):
            for j in (place for k, place in places if k == pair.second):
                geometry.addCollisionPair(pin.CollisionPair(i, j))
    return geometry


def sampled(plan: kw.Plan) -> Callable[[], bool]:
    """Whether the samples of a motion collide, as a function to be timed."""
    robot = plan.joints.robot
    assert robot is not None
    motion = Motion(plan.trajectory, plan.joints)
    geometry = pinocchio_geometry(collision_model_of(motion, plan.scenario, robot))
    data, found = robot.model.createData(), pin.GeometryData(geometry)
    times = np.arange(motion.start_time, motion.end_time, 1 / RATE)

    def look() -> bool:
        hits = 0
        for q in motion.curve(times):
            hits += pin.computeCollisions(robot.model, data, geometry, found, q, True)
        return hits > 0

    return look


def deburring(part: Path, exact: bool) -> kw.Plan:
    """The plan of the main scenario with a part beside its block."""
    task = documents.read(resources.find("scenarios", "ur5_deburring")).data
    task["scene"]["objects"]["part"] = {
        "mesh": str(part),
        "in": "block",
        "position": [150, -60, -40],
        "exact": exact,
        "allow": ["tool"],
    }
    return kw.plan(task)


def swing(rng: np.random.Generator) -> kw.Plan:
    """A blade at the tip of a planar arm, 1 mm thick, goes at 4 m/s through rods of 0.4 mm."""
    rods = {
        f"rod {i}": {
            "cylinder": {"radius": 2e-4, "length": 0.2},
            "position": [0.93 * math.cos(angle), 0.93 * math.sin(angle), 0.0],
        }
        for i, angle in enumerate(rng.uniform(0.5, 2.1, RODS))
    }
    return kw.plan(
        {
            "robot": "planar2",
            "tool": {"shape": {"box": [0.1, 1e-3, 0.02], "position": [0.05, 0, 0]}},
            "scene": {"objects": rods},
            "waypoints": [
                {"joints": {"shoulder": 0, "elbow": 0}},
                {"joints": {"shoulder": 2.6, "elbow": 0}, "after": 1},
            ],
        }
    )


def sampled_rods(plan: kw.Plan) -> int:
    """How many rods touch the blade at a sample."""
    robot = plan.joints.robot
    assert robot is not None
    motion = Motion(plan.trajectory, plan.joints)
    geometry = pinocchio_geometry(collision_model_of(motion, plan.scenario, robot))
    data, found = robot.model.createData(), pin.GeometryData(geometry)
    seen: set[int] = set()
    for q in motion.curve(np.arange(motion.start_time, motion.end_time, 1 / RATE)):
        pin.computeCollisions(robot.model, data, geometry, found, q, False)
        seen |= {i for i, one in enumerate(found.collisionResults) if one.isCollision()}
    return len(seen)


def timed(name: str, plan: kw.Plan, runs: int) -> dict[str, Any]:
    """What the proof and the samples cost for one motion."""
    motion, look = Motion(plan.trajectory, plan.joints), sampled(plan)

    def prove() -> None:
        list(check_collisions(motion, plan.scenario, plan.joints))

    least = {"proof_ms": math.inf, "samples_ms": math.inf}
    for _ in range(runs):
        for kind, action in (("proof_ms", prove), ("samples_ms", look)):
            least[kind] = min(least[kind], 1e3 * cost(action))
    pairs = len(plan.report.select(quantity="clearance"))
    return {"motion": name, "pairs": pairs, **{kind: round(ms, 1) for kind, ms in least.items()}}


def measured(runs: int) -> dict[str, Any]:
    """All that is measured, as it is saved."""
    with tempfile.TemporaryDirectory() as folder:
        ball, ring = Path(folder) / "ball.stl", Path(folder) / "ring.stl"
        trimesh.creation.icosphere(subdivisions=4, radius=60).export(ball)
        trimesh.creation.torus(200, 30, major_sections=64, minor_sections=40).export(ring)
        plans = {
            "ur5_deburring, with bench, block and spindle": kw.plan("ur5_deburring"),
            "and a ball of 5,120 triangles, its hull": deburring(ball, exact=False),
            "and that ball, exact": deburring(ball, exact=True),
            "and a ring of 5,120 triangles, exact": deburring(ring, exact=True),
            "panda_pick_place, with rack, shield and vial": kw.plan("panda_pick_place"),
        }
        motions = [timed(name, plan, runs) for name, plan in plans.items()]
    plan = swing(np.random.default_rng(0))
    proved = sum(not found.ok for found in plan.report.select(quantity="clearance"))
    rods = [
        {"way": "proof", "found": proved},
        {"way": f"samples at {RATE} Hz", "found": sampled_rods(plan)},
    ]
    return {"runs": runs, "rods_in_the_way": RODS, "motions": motions, "rods": rods}


def tables(data: dict[str, Any]) -> list[Table]:
    """The results as tables."""
    rows = [
        [
            one["motion"],
            str(one["pairs"]),
            f"{one['proof_ms']:.1f}",
            f"{one['samples_ms']:.1f}",
            f"{one['samples_ms'] / one['proof_ms']:.1f}",
        ]
        for one in data["motions"]
    ]
    columns = ("motion", "pairs", "proof ms", f"samples at {RATE} Hz ms", "ratio")
    note = f"(least of {data['runs']}, CPU time)"
    rods = [[one["way"], str(one["found"])] for one in data["rods"]]
    return [
        Table("Collisions over a whole motion", columns, rows, note),
        Table(f"Rods found, of {data['rods_in_the_way']} in the way", ("", "found"), rods),
    ]


@click.command()
@click.option("--runs", default=7, help="Times each check is made; the fastest counts.")
@results.save_option
def main(runs: int, save: Path | None) -> None:
    """Compare the proof with samples."""
    data = measured(runs)
    for table in tables(data):
        table.show(Console(width=140))
    if save is not None:
        print(results.save(save, "collision", data))


if __name__ == "__main__":
    main()
