"""What the proof of collisions costs beside samples at 1 kHz, and what these miss.

The same bodies and pairs are checked by Knotwork's proof over all time, and by Pinocchio's
`computeCollisions` at every millisecond. Both run in turn in one process, and the least time of
the processor counts. The part is a sphere of 5,120 triangles in the block, as its convex hull and
as it is. Then an arm of two joints swings a thin blade through thin rods: how many of them does
each find?
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
from knotwork import documents, resources
from knotwork.scene.model import CollisionModel
from knotwork.verification import Motion
from knotwork.verification.collisions import collisions, motion_model
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
    robot = plan.space.robot
    assert robot is not None
    motion = Motion(plan.trajectory, plan.space)
    geometry = pinocchio_geometry(motion_model(motion, plan.scenario, robot))
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
    robot = plan.space.robot
    assert robot is not None
    motion = Motion(plan.trajectory, plan.space)
    geometry = pinocchio_geometry(motion_model(motion, plan.scenario, robot))
    data, found = robot.model.createData(), pin.GeometryData(geometry)
    seen: set[int] = set()
    for q in motion.curve(np.arange(motion.start_time, motion.end_time, 1 / RATE)):
        pin.computeCollisions(robot.model, data, geometry, found, q, False)
        seen |= {i for i, one in enumerate(found.collisionResults) if one.isCollision()}
    return len(seen)


@click.command()
@click.option("--runs", default=7, help="Times each check is made; the fastest counts.")
def main(runs: int) -> None:
    """Compare the proof with samples."""
    with tempfile.TemporaryDirectory() as folder:
        part = Path(folder) / "part.stl"
        trimesh.creation.icosphere(subdivisions=4, radius=60).export(part)
        plans = {
            "ur5_deburring": kw.plan("ur5_deburring"),
            "with a part, its hull": deburring(part, exact=False),
            "with a part, exact": deburring(part, exact=True),
            "panda_pick_place": kw.plan("panda_pick_place"),
        }
        rows = []
        for name, plan in plans.items():
            motion, look = Motion(plan.trajectory, plan.space), sampled(plan)

            def prove(plan: kw.Plan = plan, motion: Motion = motion) -> None:
                list(collisions(motion, plan.scenario, plan.space))

            least = {"proof": np.inf, "samples": np.inf}
            for _ in range(runs):
                least["proof"] = min(least["proof"], cost(prove))
                least["samples"] = min(least["samples"], cost(look))
            pairs = len(plan.report.select(quantity="clearance"))
            ratio = least["samples"] / least["proof"]
            rows.append(
                [name, str(pairs), *(f"{1e3 * one:.1f}" for one in least.values()), f"{ratio:.1f}"]
            )
        columns = ("motion", "pairs", "proof [ms]", f"samples at {RATE} Hz [ms]", "ratio")
        Table("Collisions over a whole motion", columns, rows, f"least of {runs}, CPU time").show(
            Console()
        )
    plan = swing(np.random.default_rng(0))
    proved = sum(not found.ok for found in plan.report.select(quantity="clearance"))
    rows = [["proof", str(proved)], [f"samples at {RATE} Hz", str(sampled_rods(plan))]]
    Table(f"Rods found, of {RODS} in the way", ("", "found"), rows, "").show(Console())


if __name__ == "__main__":
    main()
