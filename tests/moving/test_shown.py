"""Pages show what moves by itself where it is: the drawn joints are read back and placed anew."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import drawn
import knotwork as kw
from drawn import placed
from moving.moving_truth import links
from moving.test_moving_things import LEFT, belt, in_tray, tool, tray, two_arms
from plans import arm


def scene_of(plan: kw.Plan) -> dict[str, Any]:
    shown: dict[str, Any] = drawn.scene(plan.view())
    return shown


def times(scene: dict[str, Any]) -> Any:
    return drawn.numbers(scene["arm"]["time"], "<f4", 1)[:, 0]


def middles(scene: dict[str, Any], name: str, frame: int) -> np.ndarray:
    """Middles of the boxes round things of a name [m], shape (n, 3)."""
    places = placed(scene, frame)
    middle = []
    for thing in scene["things"]:
        if thing["name"] == name:
            middle.append(_middle(thing, places))
    return np.array(middle)


def middle_of_held(data: Any, time: float, k: int) -> Any:
    """Middle of the box that is drawn for what is held, at a time [s], that of column k."""
    (here,) = (
        one
        for one in data["things"]
        if one["name"] == "held"
        and (one["between"][0] is None or time >= one["between"][0])
        and (one["between"][1] is None or time < one["between"][1])
    )
    return _middle(here, placed(data, k))


def _middle(thing: dict[str, Any], places: list[pin.SE3]) -> Any:
    at = places[thing.get("carrier", 0)]
    corners = drawn.vertices(thing["mesh"]) @ at.rotation.T + at.translation
    return 0.5 * (corners.min(axis=0) + corners.max(axis=0))


def test_draws_scene_relative_to_moving_frame() -> None:
    """Speeds on the path, the path asked for, frames and labels, against plain Pinocchio."""
    box = {"in": "tray", "box": [0.06, 0.06, 0.04], "position": [0, 0, -0.04]}
    plan = kw.plan(belt(scene={"objects": {"box": box}}))
    scene, motion = scene_of(plan), plan.scenario.paths[0].motion
    time, speed = times(scene), drawn.numbers(scene["arm"]["speed"], "<f4", 1)[:, 0]
    on = np.flatnonzero((time > motion.start_time) & (time < motion.end_time))
    for k in [*on[::40].tolist(), 20, len(time) - 20]:
        world = np.linalg.norm(tool(plan, float(time[k]))[1].linear)
        seen = np.linalg.norm(in_tray(plan, float(time[k]))[1])
        assert speed[k] == pytest.approx(seen if k in on else world, abs=1e-4)
        assert k not in on or world > seen + 0.1
    for frame in (0, len(time) - 1):
        now = tray(float(time[frame]))
        (path,) = middles(scene, "path asked for", frame)
        assert now.actInv(path) == pytest.approx(np.array([0.05, 0, 0.1]), abs=6e-3)
        places = placed(scene, frame)
        labels = {
            one["text"]: places[one.get("carrier", 0)].act(np.array(one["at"]))
            for one in scene["labels"]
        }
        assert labels["tray"] == pytest.approx(now.translation, abs=1e-5)
        assert labels["box"] == pytest.approx(now.act(np.array([0, 0, -0.04])), abs=1e-5)


def test_draws_other_robot_along_its_motion(tmp_path: Path) -> None:
    plan = kw.plan(two_arms(tmp_path, delay=0.5))
    scene = scene_of(plan)
    there = links(
        kw.plan(LEFT).trajectory,
        pin.SE3(pin.rpy.rpyToMatrix(0, 0, np.pi), np.array([0.9, 0, 0])),
    )
    time = times(scene)
    robot = arm(plan)
    first = len(scene["joints"]) - robot.dof + 1  # the other arm's joints come last
    for frame in (0, len(time) // 3, len(time) - 1):
        places = placed(scene, frame)
        bodies = set(there(0.0))
        for joint, at in enumerate(places[first:], 1):
            body = next(
                f for f in robot.model.frames if f.parentJoint == joint and f.name in bodies
            )
            geometry = there(float(time[frame]) - 0.5)[body.name][0][1]
            rest = there(-1.0)[body.name][0][1]
            # the same step from the start to now, seen from the first place of the joint
            start = placed(scene, 0)[first + joint - 1]
            assert (at * start.inverse() * rest).isApprox(geometry, 1e-4)
    assert sum(one["name"].startswith("other robots") for one in scene["things"]) >= robot.dof
