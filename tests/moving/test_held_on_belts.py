"""Parts that are taken from one belt and put on another, and ways among what moves."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import coal
import numpy as np
import pinocchio as pin

import knotwork as kw
from moving.moving_truth import Bodies, down, frame, links, sampled
from moving.test_moving_things import refused, tool, two_arms
from moving.test_positioners import on_table
from plans import passing_plan

SIZE = (0.05, 0.06, 0.07)
OFFSET = pin.SE3(np.eye(3), np.array([0, 0, 0.136]))
PICK, PLACE = 3.5, 8.5


def carry() -> dict[str, Any]:
    def over(where: str, speed: float, after: float) -> dict[str, Any]:
        passing = {"pose": down(0, 0, 0.2), "velocity": {"linear": [0, 0, speed]}}
        return {"frame": where, "after": after, **passing}

    def at(where: str, name: str) -> dict[str, Any]:
        pose = down(0, 0, 0.06)
        return {"frame": where, "name": name, "pose": pose, "after": 1.5, "stop": True}

    return {
        "robot": "ur5",
        "start": "home",
        "frames": {
            "belt": {"position": [0.45, -0.5, 0.1], "moves": {"linear": [0, 0.1, 0]}},
            "out": {
                "position": [0.45, 0.35, 0.1],
                "moves": {"linear": [0, 0.05, 0], "angular": [0, 0, 0.1], "at": 8},
            },
        },
        "tool": {
            "offset": {"position": [0, 0, 0.1]},
            "holds": {
                "box": {"from": "pick", "to": "place", "box": SIZE, "position": [0, 0, 0.036]}
            },
        },
        "waypoints": [
            over("belt", -0.05, 2),
            at("belt", "pick"),
            over("belt", 0.05, 1),
            over("out", -0.05, 2.5),
            at("out", "place"),
            {"joints": "home", "after": 2},
        ],
    }


def box(plan: kw.Plan, t: float) -> pin.SE3:
    """Where the box is: on the belt, in the tool, on the other belt."""

    def belt(s: float) -> pin.SE3:
        return frame([0.45, -0.5, 0.1], [0, 0.1, 0], [0, 0, 0], s)

    def out(s: float) -> pin.SE3:
        return frame([0.45, 0.35, 0.1], [0, 0.05, 0], [0, 0, 0.1], s - 8.0)

    if t < PICK:
        return belt(t) * belt(PICK).actInv(tool(plan, PICK)[0] * OFFSET)
    if t < PLACE:
        return tool(plan, t)[0] * OFFSET
    return out(t) * out(PLACE).actInv(tool(plan, PLACE)[0] * OFFSET)


def check_box(
    plan: kw.Plan, own: Bodies, box: Callable[[float], pin.SE3], checked: set[str]
) -> None:
    """What is proved of a box and links holds at samples, and is near the least of them."""
    moments = np.linspace(0.0, plan.trajectory.end_time, 150)
    rows = sampled(own, lambda t: {"box": [(coal.Box(*SIZE), box(t))]}, moments)
    for (link, _), row in rows.items():
        found = [
            finding
            for finding in plan.report.select(subject="pair")
            if {*finding.name.split(", ")} == {link, "box"} and finding.value is not None
        ]
        if found:
            checked = checked - {link}
            assert row.min() >= min(one.value - one.proof_gap for one in found) - 1e-6, link
            nearest = min(finding.value for finding in found)
            assert nearest <= max(1.25 * row.min(), row.min() + 2e-3), link
    assert not checked


def test_carries_part_from_belt_to_belt() -> None:
    plan = passing_plan(carry())
    waypoints = {waypoint.name: waypoint.time for waypoint in plan.scenario.waypoints}
    assert (waypoints["pick"], waypoints["place"]) == (PICK, PLACE)
    fixed = {"base_link", "shoulder_link", "upper_arm_link", "forearm_link"}
    check_box(plan, links(plan.trajectory, pin.SE3.Identity()), lambda t: box(plan, t), fixed)


def test_clear_motion_avoids_fixed_objects_and_refuses_moving_ones(tmp_path: Path) -> None:
    post = {"objects": {"post": {"box": [0.06, 0.06, 0.5], "position": [0.35, -0.2, 0.25]}}}
    way = {"pose": down(0, -0.1, 0.2), "way": "clear", "stop": True}
    plan = passing_plan(on_table(limits={"acceleration": 5}, scene=post, waypoints=[way]))
    (finding,) = plan.report.select(quantity="way")
    assert "minimum clearance" in finding.message
    task = two_arms(tmp_path, delay=0.5)
    task["limits"] = {"acceleration": 5}
    task["waypoints"] = [{**way, "pose": down(0.4, 0.3, 0.3)}]
    assert "does not support moving obstacles (left); accepted" in refused(task)
