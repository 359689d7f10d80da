"""Faults of plans of the shipped scenarios: one thing is done, whatever is wrong then."""

from __future__ import annotations

import copy
from collections.abc import Callable

import numpy as np
from scipy.interpolate import CubicSpline

from judge.bodies import Surroundings
from judge.cases import Case, Fault, Rng, Shelf, bumped, sign
from judge.files import read_yaml
from judge.motion import Motion
from judge.task import Task

KNOTS = 200


def plan_case(*, robot: bool = True, path: bool = False) -> Callable[[Rng, Shelf], Case]:
    """The plan of a shipped scenario.

    Args:
        robot: Only of those with a robot.
        path: Only of those with tool paths.
    """

    def make(rng: Rng, shelf: Shelf) -> Case:
        known = {}
        for name, folder in shelf.plans.items():
            data = read_yaml(folder / "judged.yaml")
            for row in data["waypoints"]:
                match row:
                    case {"along": {"points": str(file)}}:
                        row["along"]["points"] = str(folder / file)
            paths = any("along" in row for row in data["waypoints"])
            if (paths or not path) and ("robot" in data or not robot):
                known[name] = data
        name = sorted(known)[int(rng.integers(len(known)))]
        motion = Motion.read(shelf.plans[name] / "trajectory.json")
        return Case(known[name], motion, {"task": Task(known[name], shelf.folder)})

    return make


def retimed(motion: Motion, low: float, high: float, rise: float) -> Motion:
    """The same way, but ahead of time by a hump between two times [s]."""
    t = np.unique(np.concatenate((motion.x, np.linspace(low, high, KNOTS))))
    t = t[np.concatenate(([True], np.diff(t) > 1e-9))]
    u = np.clip((t - low) / (high - low), 0.0, 1.0)
    at = np.clip(t + rise * (4.0 * u * (1.0 - u)) ** 4, motion.x[0], motion.x[-1])
    ends = [(1, motion(end, 1)) for end in motion.x[[0, -1]]]
    spline = CubicSpline(t, motion(at), bc_type=tuple(ends))
    return Motion(motion.names, spline.x, spline.c)


def _window(case: Case, rng: Rng) -> tuple[float, float]:
    """Within the window of full speed of a path [s]."""
    paths = case.extra["task"].paths
    stretches = paths[int(rng.integers(len(paths)))].stretches
    low, high = stretches[int(rng.integers(len(stretches)))].full
    return low, high


def back_and_forth(case: Case, rng: Rng, shelf: Shelf) -> Case:
    low, high = _window(case, rng)
    rise = (high - low) * rng.uniform(0.1, 0.25)
    begin = low + (high - low) * rng.uniform(0.0, 0.3)
    width = rise * rng.uniform(0.8, 2.0)
    return case.with_motion(retimed(case.motion, begin, begin + width, rise))


def late(case: Case, rng: Rng, shelf: Shelf) -> Case:
    """Slower and then faster along a path, or the other way about."""
    low, high = _window(case, rng)
    rise = sign(rng) * (high - low) * rng.uniform(0.02, 0.15)
    return case.with_motion(retimed(case.motion, low, high, rise))


def off_the_path(case: Case, rng: Rng, shelf: Shelf) -> Case:
    low, high = _window(case, rng)
    half = 0.5 * (high - low) * rng.uniform(0.2, 0.9)
    middle = rng.uniform(low + half, high - half)
    j = int(rng.integers(4))  # one that moves the tool
    height = sign(rng) * 10.0 ** rng.uniform(-2.0, -1.3)
    return case.with_motion(bumped(case.motion, j, middle, half, height))


def off_a_waypoint(case: Case, rng: Rng, shelf: Shelf) -> Case:
    given = case.extra["task"].waypoints
    one = given[int(rng.integers(len(given)))]
    j = int(rng.integers(len(case.motion.names)))
    half, height = 10.0 ** rng.uniform(-1.5, -0.5), sign(rng) * 10.0 ** rng.uniform(-4.5, -2.0)
    return case.with_motion(bumped(case.motion, j, one.time, half, height))


def waypoint_elsewhere(case: Case, rng: Rng, shelf: Shelf) -> Case:
    made = copy.deepcopy(case.data)
    rows = made["waypoints"]
    along = ["along" in row for row in [*rows, {}]]  # no path ends or begins there
    free = [row for k, row in enumerate(rows) if "pose" in row and not any(along[k : k + 2])]
    last = free[-1]["pose"]
    last["position"][int(rng.integers(3))] += sign(rng) * 10.0 ** rng.uniform(-2.5, -1.0)
    return case.with_data(made)


def limit(case: Case, rng: Rng, shelf: Shelf) -> Case:
    motion, task = case.motion, case.extra["task"]
    order = int(rng.integers(1, 4))
    low, high = motion.critical(order, motion.x[0], motion.x[-1])
    peaks = np.maximum(-low, high)
    j = int(rng.integers(len(peaks)))
    if peaks[j] < 1e-3:
        j = int(peaks.argmax())
    share = task.margin * task.scale[j]
    below = float(peaks[j] * (1.0 - 10.0 ** rng.uniform(-6, -1)) / share)
    kind = ("velocity", "acceleration", "jerk")[order - 1]
    limits = {**(case.data.get("limits") or {}), kind: {motion.names[j]: below}}
    return case.with_data({"limits": limits})


def object_in_the_way(case: Case, rng: Rng, shelf: Shelf) -> Case:
    """A ball in the middle of a link, for a moment of the motion."""
    task, motion = case.extra["task"], case.motion
    around = Surroundings(task, motion)
    arm = task.arm
    moving = [
        i
        for body in around.bodies
        if body.kind == "link" and body.joint in arm.joints[1:]
        for i in body.shapes
    ]
    t = rng.uniform(motion.x[0], motion.x[-1])
    around.distances(motion(np.array([t]))[0])
    i = moving[int(rng.integers(len(moving)))]
    shape = around.geometry.geometryObjects[i].geometry
    shape.computeLocalAABB()
    place = arm.base.actInv(around.found.oMg[i].act(shape.aabb_center))
    ball = {
        "sphere": float(10.0 ** rng.uniform(-3, -1.5)) / task.length,
        "position": (place / task.length).tolist(),
    }
    scene = copy.deepcopy(case.data.get("scene") or {})
    scene.setdefault("objects", {})["a ball"] = ball
    return case.with_data({"scene": scene})


RATES = {f"{kind} limit" for kind in ("velocity", "acceleration", "jerk", "effort")}
LIMITS = RATES | {"tool speed", "position limit"}
AT_PATH = LIMITS | {"path", "orientation", "speed", "velocity", "hold", "end acceleration"}
RETIMED = LIMITS | {"path", "velocity", "jump"}
"""What a retimed motion may break beside: a weave depends on time, and a window may be short."""

ALONG = plan_case(path=True)
FAULTS: dict[str, Fault] = {
    name: Fault(right, spoil, kinds, count, 300, collisions, beside)
    for name, right, spoil, kinds, beside, count, collisions in (
        ("a plan: back and forth on its path", ALONG, back_and_forth,
         {"direction"}, RETIMED | {"speed"}, 10, False),
        ("a plan: late on its path", ALONG, late, {"speed"}, RETIMED, 8, False),
        ("a plan: off its path", ALONG, off_the_path,
         {"path", "orientation"}, LIMITS | {"speed", "direction"}, 8, False),
        ("a plan: off a waypoint", plan_case(), off_a_waypoint, {"pose"},
         AT_PATH | {"direction"}, 10, False),
        ("a plan: a waypoint elsewhere", plan_case(), waypoint_elsewhere, {"pose"}, (), 8, False),
        ("a plan: a limit", plan_case(robot=False), limit, RATES - {"effort limit"}, (), 8, False),
        ("a plan: an object in its way", plan_case(), object_in_the_way,
         {"collision"}, (), 8, True),
    )
}  # fmt: skip
