"""Tool paths in scenes and reports: where they are asked for, and how far the tool is off them."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

import knotwork as kw
from drawn import scene, thing, vertices
from seams import ON, task

SEAM = task(
    ON,
    {"name": "turn", "along": "line", "speed": 60, "pose": {"position": [450, 50, 60]}},
    {
        "name": "off",
        "along": {"arc": {"centre": [480, 50, 60], "normal": [0, 0, -1]}},
        "speed": 40,
        "stop": True,
        "pose": {"position": [510, 50, 60]},
    },
)


@cache
def planned(planner: str | None) -> kw.Plan:
    return kw.plan(SEAM, planner=planner)


@cache
def drawn(planner: str | None) -> Any:
    return scene(planned(planner).view())


def off_seam(points: Any) -> Any:
    """Distance from the line and the half circle [m], in the axes of the URDF's root."""
    robot = planned(None).space.robot
    assert robot is not None
    base = robot.base_placement.inverse()
    x, y, z = (points @ base.rotation.T + base.translation).T
    line = np.linalg.norm([x - 0.45, y - np.clip(y, -0.1, 0.05), z - 0.06], axis=0)
    arc = np.hypot(np.hypot(x - 0.48, y - 0.05) - 0.03, z - 0.06)
    end = np.linalg.norm([x - 0.51, y - 0.05, z - 0.06], axis=0)
    return np.minimum(line, np.where(y < 0.05, end, arc))


@pytest.mark.parametrize("planner", [None, "bspline"])
def test_the_path_asked_for_is_drawn_as_a_thin_dashed_line(planner: str | None) -> None:
    data = drawn(planner)
    points = vertices(thing(data, "path asked for"))
    thick = 0.0045 * data["size"]
    assert off_seam(points).max() == pytest.approx(thick, rel=0.02)
    assert off_seam(points).min() > 0.9 * thick
    corners = np.array([[0.45, -0.1], [0.45, 0.05], [0.48, 0.08], [0.51, 0.05]])
    for corner in corners:  # from its start to its end
        robot = planned(None).space.robot
        assert robot is not None
        at = robot.base_placement.act(np.array([*corner, 0.06]))
        assert np.linalg.norm(points - at, axis=1).min() < 0.03 * data["size"]


def test_a_deviation_is_no_limit_of_a_joint() -> None:
    data = drawn("bspline")
    assert {one["name"] for one in data["things"] if one["hidden"]} == {
        "knots",
        "collision shapes",
    }
    assert not data["legend"]["broken"]
    assert data["legend"]["path"]
    (failed,) = planned("bspline").report.select(name="on to turn", quantity="path_deviation")
    assert failed.fact in [one["fact"] for one in data["failures"]]
    wanted = f"on to turn path deviation {1e3 * failed.value:.4g} of 0.1 mm at {failed.at:.3f} s"
    assert any(label["text"] == wanted for label in data["labels"])
    assert any(one["line"].startswith(wanted) for one in data["failures"])  # the same words


def test_only_waypoints_of_the_scenario_have_labels() -> None:
    data, plan = drawn(None), planned(None)
    names = [one["text"] for one in data["labels"] if one["kind"] == "waypoint"]
    assert names == ["start", "on", "turn", "off"]
    assert len(plan.joint_waypoints.time) > 4
