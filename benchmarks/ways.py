"""Ways round obstacles beside roboplan and TOPP-RA, on MotionBenchMaker's problems for the Panda.

Each problem is a scenario with `way: clear`, planned and checked as any other, with Franka's limits
of velocity, acceleration and jerk and a margin of 0. Beside it:

* TOPP-RA on the polyline that the motion was made from, and on the motion's own curve. It keeps
  limits of velocity and acceleration, not of jerk;
* roboplan: RRT-Connect, shortcuts, then TOPP-RA with its Hermite fit, all at their defaults but for
  samples every 3 ms. It claims no limit of jerk, and it would take longer with finer steps.

Motions are judged by plain Pinocchio and Coal every 3 ms, on the meshes of the URDF: whether the
arm touches an object, and what part of their limits accelerations reach.

The peers are no dependencies of Knotwork:

    python -m venv peers
    peers/bin/pip install . roboplan toppra

With `--save benchmarks/results` the results are saved there, and the site shows them.
"""

from __future__ import annotations

import importlib
import tempfile
import time as clock
from collections.abc import Callable, Mapping
from functools import lru_cache
from itertools import combinations, pairwise
from pathlib import Path
from typing import Any, NamedTuple

import click
import coal
import numpy as np
import pinocchio as pin
import yaml
from rich.console import Console
from rich.progress import track

import knotwork as kw
import results
from knotwork.arrays import FloatArray
from knotwork.errors import InputError
from knotwork.planning.timing import Progress
from motion_bench import FOLDER, KINDS, Problem, problems
from toppra_peer import toppra_duration
from ways_tables import tables

STEP = 0.003
"""Motions are judged at this [s]."""


class Motion(NamedTuple):
    """Samples every `STEP`: positions and accelerations, shape (n, d) each; duration [s]."""

    q: FloatArray
    a: FloatArray
    duration: float


@lru_cache(maxsize=1)
def arm() -> kw.Robot:
    """The Panda with its fingers open."""
    return kw.load_robot(FOLDER / "panda_open.yaml")


def urdf_folder() -> Path:
    """Where the meshes of the URDF are."""
    return next(one for one in arm().urdf.parents if (one / "example-robot-data").is_dir())


@lru_cache(maxsize=1)
def links() -> Any:
    """Meshes of the links as the URDF has them."""
    robot = arm()
    folders = [str(urdf_folder())]
    return pin.buildGeomFromUrdf(
        robot.model, str(robot.urdf), pin.GeometryType.COLLISION, package_dirs=folders
    )


def judged(problem: Problem, motion: Motion) -> dict[str, Any]:
    """What is wrong with a motion, by plain Pinocchio and Coal."""
    geometry, model = links().copy(), arm().model
    count = len(geometry.geometryObjects)
    for name, shape in problem.objects.items():
        may_touch = tuple(shape.get("allow", ()))
        k = geometry.addGeometryObject(pin.GeometryObject(name, 0, place(shape), solid(shape)))
        for i, link in enumerate(geometry.geometryObjects):
            if i < count and link.parentJoint and not link.name.startswith(may_touch):
                geometry.addCollisionPair(pin.CollisionPair(i, k))
    data, found = model.createData(), geometry.createData()
    limit = arm().limits.acceleration
    return {
        "duration": round(motion.duration, 4),
        "collides": any(
            pin.computeCollisions(model, data, geometry, found, q, True) for q in motion.q
        ),
        "acceleration": round(float((np.abs(motion.a) / limit).max()), 3),
    }


def place(shape: Mapping[str, Any]) -> Any:
    """Where an object stands."""
    x, y, z, w = shape["quaternion_xyzw"]
    return pin.SE3(pin.Quaternion(w, x, y, z).matrix(), np.array(shape["position"]))


def solid(shape: Mapping[str, Any]) -> Any:
    """An object of a scenario as Coal has it."""
    if "box" in shape:
        return coal.Box(*shape["box"])
    if "sphere" in shape:
        return coal.Sphere(shape["sphere"])
    return coal.Cylinder(shape["cylinder"]["radius"], shape["cylinder"]["length"])


def knotwork(problem: Problem, row: dict[str, Any], peers: bool) -> Motion | None:
    """Plan a problem; what it took goes into its row, with TOPP-RA's durations if it is a peer."""
    first: list[float] = []
    begun = clock.process_time()

    def progress(step: Progress) -> None:
        if step.duration is not None:  # a proved motion exists
            first.append(clock.process_time() - begun)

    try:
        plan = kw.plan(problem.scenario(), progress=progress)
    except InputError as error:
        row["error"] = str(error)
        return None
    row["seconds"] = round(clock.process_time() - begun, 3)
    row["first"] = round(first[0], 3) if first else row["seconds"]
    row["ok"] = plan.report.ok
    motion = plan.trajectory
    if peers:
        (line,) = (
            [one.line for one in plan.chosen_values.sections] if plan.chosen_values else [None]
        )
        if line is not None:
            row["line"] = round(along(_dense(line)), 4)
        q = motion.position(np.linspace(0.0, motion.end_time, 300))
        row["curve"] = round(along(q), 4)
    times = np.arange(0.0, motion.end_time + STEP, STEP).clip(max=motion.end_time)
    return Motion(motion.position(times), motion.acceleration(times), motion.end_time)


def _dense(line: FloatArray) -> FloatArray:
    """A polyline with a point at least every 0.1 rad."""
    found = [line[:1]]
    for start, end in pairwise(line):
        n = max(1, int(np.ceil(np.linalg.norm(end - start) / 0.1)))
        found.append(start + np.arange(1, n + 1)[:, None] / n * (end - start))
    return np.concatenate(found)


def along(q: FloatArray) -> float:
    """TOPP-RA along configurations, with limits of velocity and acceleration [s]."""
    q = q[np.append(True, np.linalg.norm(np.diff(q, axis=0), axis=1) > 1e-7)]
    s = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(q, axis=0), axis=1)))
    return toppra_duration(s, q, arm().limits.velocity, arm().limits.acceleration, grid=400)


def roboplan(problem: Problem) -> Motion | None:
    """RRT-Connect, shortcuts and TOPP-RA."""
    core: Any = importlib.import_module("roboplan.core")
    rrt: Any = importlib.import_module("roboplan.rrt")
    toppra: Any = importlib.import_module("roboplan.toppra")
    scene, names = _roboplan_scene(core, problem)
    options = rrt.RRTOptions(group_name="arm", rrt_connect=True, max_planning_time=10.0)
    ends = (
        core.JointConfiguration(names, np.array([state[name] for name in names]))
        for state in (problem.start, problem.goal)
    )
    planner = rrt.RRT(scene, options)
    planner.setRngSeed(0)
    try:
        path = planner.plan(*ends)
        cutter = core.PathShortcutter(scene, core.PathShortcuttingOptions(group_name="arm"))
        timed = toppra.PathParameterizerTOPPRA(scene, "arm").generate(
            cutter.shortcut(path), toppra.TOPPRAOptions(dt=STEP)
        )
    except RuntimeError:
        return None
    q = np.array(timed.positions)
    return Motion(q, np.array(timed.accelerations), STEP * (len(q) - 1))


def _roboplan_scene(core: Any, problem: Problem) -> tuple[Any, list[str]]:
    robot = arm()
    folders = [str(urdf_folder()), str(robot.urdf.parents[1])]
    scene = core.Scene("panda", core.loadUrdfSceneDescription(str(robot.urdf), folders))
    scene.importSrdf((robot.urdf.parents[1] / "srdf" / "panda.srdf").read_text())
    names = list(robot.joint_names)
    scene.addGroup("arm", names)
    limits = {
        name: {"max_acceleration": [float(a)], "max_jerk": [float(j)]}
        for name, a, j in zip(names, robot.limits.acceleration, robot.limits.jerk, strict=True)
    }
    with tempfile.TemporaryDirectory() as folder:
        config = Path(folder) / "limits.yaml"
        config.write_text(yaml.safe_dump({"joint_limits": limits}))
        scene.importJointLimitsFromConfig(core.loadJointLimitsConfig(config))
    scene.setJointPositions(_open(scene))
    for name, shape in problem.objects.items():
        where = np.asfortranarray(place(shape).homogeneous)
        if "box" in shape:
            scene.addBoxGeometry(name, "universe", core.Box(*shape["box"]), where, np.ones(4))
        else:
            size = core.Cylinder(shape["cylinder"]["radius"], shape["cylinder"]["length"])
            scene.addCylinderGeometry(name, "universe", size, where, np.ones(4))
        for link in shape.get("allow", ()):
            scene.setCollisions(name, link, False)
    scene.setCollisions(list(combinations(problem.objects, 2)), False)
    return scene, names


def _open(scene: Any) -> FloatArray:
    """The whole arm with its fingers open."""
    names = scene.getJointNames()
    q = np.array(scene.getCurrentJointPositions())
    q[[k for k, name in enumerate(names) if "finger" in name]] = 0.04
    return q


@click.command()
@click.option("--numbers", default=50, show_default=True, help="Problems of each class.")
@click.option("--kinds", default=",".join(KINDS), show_default=True, help="Classes.")
@click.option("--peers/--no-peers", default=True, help="Whether roboplan and TOPP-RA run.")
@results.save_option
def main(numbers: int, kinds: str, peers: bool, save: Path | None) -> None:
    """Plan the problems and print the tables."""
    chosen = list(problems(tuple(kinds.split(",")), range(1, numbers + 1)))
    rows: list[dict[str, Any]] = []
    for problem in track(chosen, "planning"):
        row: dict[str, Any] = {"kind": problem.kind, "number": problem.number}
        contenders: dict[str, Callable[[], Motion | None]] = {
            "knotwork": lambda: knotwork(problem, row, peers)  # noqa: B023
        }
        if peers:
            contenders["roboplan"] = lambda: roboplan(problem)  # noqa: B023
        for name, contender in contenders.items():
            motion = contender()
            row[name] = None if motion is None else judged(problem, motion)
        rows.append(row)
        if save is not None:  # a long run that ends early keeps what it measured
            results.save(save, "ways", {"rows": rows})
    for table in tables({"rows": rows}):
        table.show(Console())


if __name__ == "__main__":
    main()
