"""Work and travel angles along seams, against their definition and plain Pinocchio."""

from __future__ import annotations

import functools
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import knotwork as kw
from plain import tool_poses

WORK, TRAVEL = np.radians(20), np.radians(-12)
ANGLES = {"work_angle": WORK, "travel_angle": TRAVEL}
START, END = [0.6, -0.2, 0.25], [0.66, -0.2, 0.25]
UP = [0.0, 0.0, 1.0]


def welded(*path: dict[str, Any], before: dict[str, Any] | None = None) -> dict[str, Any]:
    angles = {"torch": {"seam": [1, 0, 0], "normal": UP, **ANGLES}}
    return {
        "robot": "ur10",
        "start": "home",
        "path": {"acceleration": 0.1},
        "waypoints": [
            {"after": 3, "pose": {"position": [0.6, -0.2, 0.3], **angles}, "stop": True},
            {"after": 1, "pose": {"position": START, **(before or {})}, "stop": True},
            *path,
        ],
    }


def angles_of(z: np.ndarray, seam: np.ndarray, normal: np.ndarray) -> tuple[float, float]:
    """Work and travel angle as a welder measures them, to the left and forward.

    Work: in the plane square to the seam, from the normal to the tool. Travel: from that plane.
    """
    out, left = -z, np.cross(normal, seam)
    flat = out - (out @ seam) * seam
    work = np.arctan2(flat @ left, flat @ normal)
    return float(work), float(np.arcsin(-(out @ seam)))


ARC = {
    "along": {"arc": {"centre": [0.66, -0.17, 0.25]}},
    "speed": 0.02,
    "pose": {"position": [0.69, -0.17, 0.25]},
    "orientation": "tangent",
}


def test_torch_keeps_angles_along_line_and_arc() -> None:
    line = {"along": "line", "speed": 0.02, "pose": {"position": END}}
    line["orientation"] = {"normal": UP, **ANGLES}
    plan = kw.plan(welded(line, ARC))
    assert plan.report.ok, plan.report
    first, second = plan.scenario.paths[0].stretches
    for t in (first.start, 0.5 * (first.start + first.end), 0.5 * (second.start + second.end)):
        (pose,) = tool_poses(plan, [t])
        turned = pose.translation - [0.66, -0.17, 0.25]
        seam = np.array([-turned[1], turned[0], 0.0]) if t > first.end else np.array([1.0, 0, 0])
        seam /= np.linalg.norm(seam)
        found = angles_of(pose.rotation[:, 2], seam, np.array(UP))
        assert found == pytest.approx((WORK, TRAVEL), abs=2e-3)
        # the tool's x axis shows along the seam
        assert pose.rotation[:, 0] @ seam > np.cos(abs(TRAVEL)) - 1e-3


@pytest.mark.parametrize("orientation", [{}, {**ANGLES, "tangent": "-y"}])
def test_normals_of_points_lean_torch(tmp_path: Path, orientation: dict[str, Any]) -> None:
    """Over a cylinder about x, slantwise: normals turn with the surface, and nothing is free."""
    radius, whole, axis = 0.2, np.radians(25), np.array([0.6, -0.2, 0.05])
    angle = np.linspace(0.0, whole, 21)
    out = np.column_stack((0.0 * angle, np.sin(angle), np.cos(angle)))
    points = axis + radius * out + np.outer(angle / whole, [0.06, 0, 0])
    rows = [",".join(map(str, row)) for row in np.hstack((points, out))]
    (tmp_path / "seam.csv").write_text("\n".join(["x,y,z,nx,ny,nz", *rows]))
    end = {"along": {"points": str(tmp_path / "seam.csv")}, "speed": 0.03}
    end |= {"pose": {"position": points[-1].tolist()}, "orientation": orientation}
    plan = kw.plan(welded(end))
    assert plan.report.ok, plan.report
    (path,) = plan.scenario.paths
    assert path.freedom is None
    wanted = orientation.get("work_angle", 0.0), orientation.get("travel_angle", 0.0)
    for t in np.linspace(path.motion.start_time, path.motion.end_time, 9):
        (pose,) = tool_poses(plan, [t])
        normal = (pose.translation - axis) * [0, 1, 1] / radius
        seam = np.array([0.06, 0.0, 0.0]) + radius * whole * np.cross([-1, 0, 0], normal)
        seam /= np.linalg.norm(seam)
        assert angles_of(pose.rotation[:, 2], seam, normal) == pytest.approx(wanted, abs=3e-3)
        forward = -pose.rotation[:, 1] if orientation else pose.rotation[:, 0]
        assert forward @ seam > np.cos(abs(wanted[1])) - 1e-3


def free_angles(free: dict[str, Any] | None) -> dict[str, Any]:
    line = {"along": "line", "speed": 0.02, "pose": {"position": END}}
    line["orientation"] = {"normal": UP, **ANGLES}
    task = welded(line, ARC)
    for one in task["waypoints"][1:]:
        one["free"] = free or "none"
    return task


@functools.cache
def planned_fixed() -> kw.Plan:
    return kw.plan(free_angles(None))


WIDE = {"work_angle": [0.2, 0.5], "travel_angle": [-0.3, 0.0]}


@pytest.mark.parametrize("turn", [{}, {"turn": "z"}])
def test_free_torch_angles_stay_in_ranges(turn: dict[str, Any]) -> None:
    plan, fixed = kw.plan(free_angles({**WIDE, **turn})), planned_fixed()
    assert plan.report.ok, plan.report
    motion = plan.scenario.paths[0].motion
    corner = plan.scenario.paths[0].stretches[0].end
    worst, works = [], []
    for t in np.linspace(motion.start_time, motion.end_time, 60):
        (pose,) = tool_poses(plan, [t])
        turned = pose.translation - [0.66, -0.17, 0.25]
        seam = np.array([-turned[1], turned[0], 0.0]) if t > corner else np.array([1.0, 0, 0])
        seam /= np.linalg.norm(seam)
        work, travel = angles_of(pose.rotation[:, 2], seam, np.array(UP))
        works.append(work)
        worst.append(max(0.2 - work, work - 0.5, -0.3 - travel, travel))
    # the path's own tangent passes smoothly from line to arc
    assert max(worst) < np.radians(0.1) + 0.025 * np.pi / 2
    (used,) = plan.report.select(group="Freedom")
    row = re.search(r"work angle (\S+)(?: to (\S+))? of 0\.2 to 0\.5 rad", used.message)
    assert row is not None
    told = [float(one or row[1]) for one in row.groups()]
    assert told == pytest.approx([min(works), max(works)], abs=0.03)
    times = np.linspace(motion.start_time, motion.end_time, 300)
    moved = [np.abs(np.diff(one.trajectory(times), axis=0)).sum() for one in (plan, fixed)]
    assert moved[0] < 0.98 * moved[1]
    rows = plan.report.select(quantity="path_turn")
    assert [row.proof for row in rows] == ["bounded", "bounded"]
    narrow = {"work_angle": [WORK - 0.01, WORK + 0.01], "travel_angle": [TRAVEL - 0.01, TRAVEL]}
    scenario = kw.load_scenario(free_angles({**narrow, **turn}))
    failed = {one.quantity for one in kw.check(plan.trajectory, scenario).failures}
    assert "path_turn" in failed
