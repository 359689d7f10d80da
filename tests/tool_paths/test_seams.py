"""Woven paths and torch angles along seams, against closed forms and plain Pinocchio."""

from __future__ import annotations

import functools
import re
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import knotwork as kw
from plain import tool_poses
from plans import passing_plan
from sweeps import first_of, mostly_exhaustive

WIDTH, RATE, SPEED, TOLERANCE = 3e-3, 2.0, 8e-3, 5e-5
START, END = np.array([0.6, -0.2, 0.25]), np.array([0.64, -0.2, 0.25])
LEANING = {"rpy": [np.pi, np.radians(10), 0]}


def seam(weave: dict[str, Any] | None, *more: dict[str, Any], **keys: Any) -> dict[str, Any]:
    """A line along x, woven, and what follows it on the path."""
    woven = {"weave": {"width": WIDTH, "frequency": RATE, **weave}} if weave else {}
    line = {"along": "line", "speed": SPEED, "pose": {"position": END.tolist()}, **woven}
    return {
        "robot": "ur10",
        "start": "home",
        "tolerances": {"path": TOLERANCE},
        "waypoints": [
            {"after": 3, "pose": {"position": START.tolist(), **LEANING}, "stop": True},
            line,
            *more,
            {"after": 2, "pose": {"position": [0.6, -0.2, 0.35], **LEANING}},
        ],
        **keys,
    }


@functools.cache
def planned(name: str) -> kw.Plan:
    return kw.plan(seam(SHAPES[name][0]))


def tool(plan: kw.Plan, t: np.ndarray) -> np.ndarray:
    return np.array([pose.translation for pose in tool_poses(plan, t)])


def ramp(t: np.ndarray, duration: float) -> np.ndarray:
    z = np.clip(np.minimum(t, duration - t) * RATE, 0.0, 1.0)
    return np.asarray(10 * z**3 - 15 * z**4 + 6 * z**5)


def sharp(t: np.ndarray, dwell: float = 0.0) -> np.ndarray:
    """A triangle from edge to edge with sharp corners, that holds its edges."""
    half, crossing = 0.5 / RATE, 0.5 / RATE - dwell
    corners = np.array([-0.5 * crossing, 0.5 * crossing, 0.5 * crossing + dwell])
    times = np.append(corners, [half + 0.5 * crossing, half + 0.5 * crossing + dwell])
    values = 0.5 * WIDTH * np.array([-1, 1, 1, -1, -1])
    return np.interp((t + 0.5 * crossing) % (2 * half) - 0.5 * crossing, times, values)


A, TURN = 0.5 * WIDTH, 2 * np.pi * RATE
ACROSS, UP = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
ALONG = np.array([1.0, 0.0, 0.0])
SHAPES = {
    "sine": ({"shape": "sine"}, lambda t: A * np.outer(np.sin(TURN * t), ACROSS)),
    "circle": (
        {"shape": "circle"},
        lambda t: A * (np.outer(np.sin(TURN * t), ACROSS) + np.outer(np.cos(TURN * t), ALONG)),
    ),
    "eight": (
        {"shape": "eight", "in": ["across", "normal"]},
        lambda t: (
            A * (np.outer(np.sin(TURN * t), ACROSS) + np.outer(0.5 * np.sin(2 * TURN * t), UP))
        ),
    ),
    "fillet": (
        {"shape": "sine", "normal": [5, -1, 1]},
        lambda t: A * np.outer(np.sin(TURN * t), (ACROSS + UP) / np.sqrt(2)),
    ),
}


@pytest.mark.parametrize("name", mostly_exhaustive(SHAPES, "eight", "fillet"))
def test_tool_follows_seam_plus_weave(name: str) -> None:
    plan, shape = planned(name), SHAPES[name][1]
    assert plan.report.ok, plan.report
    motion = plan.scenario.paths[0].timed_path
    t = np.linspace(0.0, motion.end_time - motion.start_time, 1501)
    added = ramp(t, t[-1])[:, None] * shape(t)
    off = tool(plan, motion.start_time + t) - START - added
    assert np.hypot(off[:, 1], off[:, 2]).max() < TOLERANCE  # off the seam, once weaving is gone
    speed = np.gradient(off[:, 0], t)
    inside = (t > 0.1) & (t < t[-1] - 0.1)
    assert abs(speed[inside] / SPEED - 1.0).max() < 0.01
    for quantity in ("path_deviation", "path_speed", "path_progress"):
        (row,) = plan.report.select(quantity=quantity)
        assert row.ok
        assert row.proof == "bounded"
    assert " from the woven line, tolerance" in str(
        plan.report.select(quantity="path_deviation")[0]
    )


EDGES = [("triangle", 0.0, TOLERANCE), ("triangle", 0.1, 4e-4), ("sine", 0.1, 0.0)]


@pytest.mark.parametrize(("shape", "dwell", "rounding"), mostly_exhaustive(EDGES, EDGES[1]))
def test_weave_reaches_and_holds_edges(shape: str, dwell: float, rounding: float) -> None:
    numbers = {"dwell": dwell, "rounding": rounding}
    plan = passing_plan(seam({"shape": shape} | {key: one for key, one in numbers.items() if one}))
    motion = plan.scenario.paths[0].timed_path
    t = np.linspace(0.0, motion.end_time - motion.start_time, 4001)
    across = tool(plan, motion.start_time + t)[:, 1] - START[1]
    full = (t > 1 / RATE) & (t < t[-1] - 1 / RATE)
    assert np.ptp(across[full]) == pytest.approx(WIDTH, abs=2 * TOLERANCE)
    expected = ramp(t, t[-1]) * sharp(t, dwell)
    if shape == "triangle":
        assert 0.7 * rounding < abs(across - expected).max() < rounding + TOLERANCE
    held = full & (abs(sharp(t, dwell)) >= A * (1 - 1e-9))
    assert abs(across - expected)[held].max(initial=0.0) < TOLERANCE
    assert held.any() == (dwell > 0)
    assert all(finding.ok for finding in plan.report.select(group="Continuity"))


def test_weave_continues_into_arc() -> None:
    """Its axes turn with the seam; on the arc the tool is off the circle by the weave."""
    arc = {
        "along": {"arc": {"centre": [0.64, -0.17, 0.25]}},
        "speed": SPEED,
        "pose": {"position": [0.67, -0.17, 0.25]},
        "weave": {"shape": "sine", "width": WIDTH, "frequency": RATE},
    }
    plan = passing_plan(seam({"shape": "sine"}, arc))
    first, second = plan.scenario.paths[0].stretches
    t = np.linspace(first.start, second.end, 1501)
    place = tool(plan, t) - [0.64, -0.17, 0.25]
    added = ramp(t - t[0], t[-1] - t[0]) * A * np.sin(TURN * (t - t[0]))
    # the axes pass from line to arc on a quarter of the shorter one before and after
    quarter = 0.25 * min(first.end - first.start, second.end - second.start)
    line, round_ = t < first.end - quarter, t > first.end + quarter
    assert abs(place[line, 1] + 0.03 - added[line]).max() < TOLERANCE
    radius = np.hypot(place[:, 0], place[:, 1])
    assert abs(0.03 - radius[round_] - added[round_]).max() < TOLERANCE
    angle = np.unwrap(np.arctan2(place[:, 1], place[:, 0]))
    turned = 0.03 * (angle[-1] - angle[round_][0])
    assert turned == pytest.approx(SPEED * (t[-1] - t[round_][0]), rel=0.01)


def test_weave_on_belt() -> None:
    task = seam({"shape": "circle"}, frames={"belt": {"position": [0, 0, 0]}}, frame="belt")
    task["frames"]["belt"]["moves"] = {"linear": [0, 0.01, 0], "angular": [0, 0, 0.02]}
    task["scene"] = {"objects": {"part": {"in": "belt", "sphere": 0.01, "position": [0.6, 0, 0.1]}}}
    plan = passing_plan(task)
    assert "given path" in plan.view().html
    motion = plan.scenario.paths[0].timed_path
    t = np.linspace(motion.start_time, motion.end_time, 301)
    local = t - t[0]
    added = ramp(local, local[-1])[:, None] * SHAPES["circle"][1](local)
    turned = np.array([pin.exp3(np.array([0, 0, -0.02 * s])) for s in t])
    seen = np.einsum("kij,kj->ki", turned, tool(plan, t) - np.outer(t, [0, 0.01, 0]))
    off = seen - START - added
    assert np.hypot(off[:, 1], off[:, 2]).max() < TOLERANCE


@pytest.mark.parametrize("changed", [{"width": 3.3e-3}, {"frequency": 2.04}, {"in": ["normal"]}])
def test_check_fails_for_other_weave(changed: dict[str, Any]) -> None:
    plan = planned("sine")
    other = kw.load_scenario(seam({"shape": "sine", **changed}))
    failed = {finding.quantity for finding in kw.check(plan.trajectory, other).failures}
    assert "path_deviation" in failed


def test_reports_joint_that_weave_exceeds() -> None:
    fast = seam({"shape": "sine", "width": 0.1, "frequency": 8})
    says = "shoulder_pan_joint(?s:.*)its limit is 2.16 rad/s"
    with pytest.raises(kw.errors.InputError, match=says):
        kw.plan(fast)


def test_refuses_weave_that_exceeds_acceleration() -> None:
    limits = {"acceleration": 1.0, "jerk": 1e4}
    fast = seam({"shape": "sine", "width": 0.01}, limits=limits)
    assert {finding.quantity for finding in kw.plan(fast).report.failures} >= {"acceleration"}
    fast["waypoints"][0]["after"] = "fastest"
    with pytest.raises(kw.errors.InputError, match="a narrower weave, a lower frequency"):
        kw.plan(fast)


WORK, TRAVEL = np.radians(20), np.radians(-12)
ANGLES = {"work_angle": WORK, "travel_angle": TRAVEL}
TORCH_START, TORCH_END = [0.6, -0.2, 0.25], [0.66, -0.2, 0.25]
TORCH_UP = [0.0, 0.0, 1.0]


def welded(*path: dict[str, Any]) -> dict[str, Any]:
    angles = {"torch": {"seam": [1, 0, 0], "normal": TORCH_UP, **ANGLES}}
    return {
        "robot": "ur10",
        "start": "home",
        "path": {"acceleration": 0.1},
        "waypoints": [
            {"after": 3, "pose": {"position": [0.6, -0.2, 0.3], **angles}, "stop": True},
            {"after": 1, "pose": {"position": TORCH_START}, "stop": True},
            *path,
        ],
    }


def seam_at(pose: pin.SE3, on_arc: bool) -> np.ndarray:
    """Direction of the line or the arc where the tool is."""
    if not on_arc:
        return np.array([1.0, 0.0, 0.0])
    spoke = pose.translation - [0.66, -0.17, 0.25]
    return np.array([-spoke[1], spoke[0], 0.0]) / np.hypot(*spoke[:2])


def angles_of(z: np.ndarray, seam: np.ndarray, normal: np.ndarray) -> tuple[float, float]:
    """Work and travel angle as a welder measures them, to the left and forward.

    Work: in the plane square to the seam, from the normal to the tool. Travel: from that plane.
    """
    out, left = -z, np.cross(normal, seam)
    flat = out - (out @ seam) * seam
    work = np.arctan2(flat @ left, flat @ normal)
    return float(work), float(np.arcsin(-(out @ seam)))


LINE = {
    "along": "line",
    "speed": 0.02,
    "pose": {"position": TORCH_END},
    "orientation": {"normal": TORCH_UP, **ANGLES},
}
ARC = {
    "along": {"arc": {"centre": [0.66, -0.17, 0.25]}},
    "speed": 0.02,
    "pose": {"position": [0.69, -0.17, 0.25]},
    "orientation": "tangent",
}


def test_torch_keeps_angles_along_line_and_arc() -> None:
    plan = passing_plan(welded(LINE, ARC))
    first, second = plan.scenario.paths[0].stretches
    for t in (first.start, 0.5 * (first.start + first.end), 0.5 * (second.start + second.end)):
        (pose,) = tool_poses(plan, [t])
        seam = seam_at(pose, t > first.end)
        found = angles_of(pose.rotation[:, 2], seam, np.array(TORCH_UP))
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
    plan = passing_plan(welded(end))
    (path,) = plan.scenario.paths
    assert path.freedom is None
    wanted = orientation.get("work_angle", 0.0), orientation.get("travel_angle", 0.0)
    for t in np.linspace(path.timed_path.start_time, path.timed_path.end_time, 9):
        (pose,) = tool_poses(plan, [t])
        normal = (pose.translation - axis) * [0, 1, 1] / radius
        seam = np.array([0.06, 0.0, 0.0]) + radius * whole * np.cross([-1, 0, 0], normal)
        seam /= np.linalg.norm(seam)
        assert angles_of(pose.rotation[:, 2], seam, normal) == pytest.approx(wanted, abs=3e-3)
        forward = -pose.rotation[:, 1] if orientation else pose.rotation[:, 0]
        assert forward @ seam > np.cos(abs(wanted[1])) - 1e-3


def free_angles(free: dict[str, Any] | None) -> dict[str, Any]:
    task = welded({**LINE}, {**ARC})
    for one in task["waypoints"][1:]:
        one["free"] = free or "none"
    return task


WIDE = {"work_angle": [0.2, 0.5], "travel_angle": [-0.3, 0.0]}


@pytest.mark.parametrize("turn", first_of({"turn": "z"}, {}))
def test_free_torch_angles_stay_in_ranges(turn: dict[str, Any]) -> None:
    plan, fixed = kw.plan(free_angles({**WIDE, **turn})), kw.plan(free_angles(None))
    assert plan.report.ok, plan.report
    motion = plan.scenario.paths[0].timed_path
    corner = plan.scenario.paths[0].stretches[0].end
    worst, works = [], []
    for t in np.linspace(motion.start_time, motion.end_time, 60):
        (pose,) = tool_poses(plan, [t])
        seam = seam_at(pose, t > corner)
        work, travel = angles_of(pose.rotation[:, 2], seam, np.array(TORCH_UP))
        works.append(work)
        worst.append(max(0.2 - work, work - 0.5, -0.3 - travel, travel))
    # the path's own tangent passes smoothly from line to arc
    assert max(worst) < np.radians(0.1) + 0.025 * np.pi / 2
    (used,) = plan.report.select(group="Freedom")
    row = re.search(r"work angle (\S+)(?: to (\S+))? of 0\.2 to 0\.5 rad", used.message)
    reported = [float(end or row[1]) for end in row.groups()]
    assert reported == pytest.approx([min(works), max(works)], abs=0.03)
    times = np.linspace(motion.start_time, motion.end_time, 300)
    moved = [np.abs(np.diff(one.trajectory(times), axis=0)).sum() for one in (plan, fixed)]
    assert moved[0] < 0.98 * moved[1]
    rows = plan.report.select(quantity="path_turn")
    assert [row.proof for row in rows] == ["bounded", "bounded"]
    narrow = {"work_angle": [WORK - 0.01, WORK + 0.01], "travel_angle": [TRAVEL - 0.01, TRAVEL]}
    scenario = kw.load_scenario(free_angles({**narrow, **turn}))
    failed = {finding.quantity for finding in kw.check(plan.trajectory, scenario).failures}
    assert "path_turn" in failed
