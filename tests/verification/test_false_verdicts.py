"""Bad motions in disguise, some of thousands of pieces: none may pass the check."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import knotwork as kw
from command_line import Command
from plans import planned, pose_of
from sweeps import mostly_exhaustive
from texts import written


def one_joint(**rest: Any) -> kw.Scenario:
    """One joint from 0 to 1 rad in 2 s, from rest to rest."""
    return kw.load_scenario(
        {
            "waypoints": [
                {"name": "A", "joints": {"turn": 0}},
                {"name": "B", "joints": {"turn": 1}, "after": 2},
            ],
            **rest,
        }
    )


def motion(c: Any, x: Any) -> kw.JointTrajectory:
    """One joint's trajectory from its local polynomials, shape (k+1, m)."""
    return kw.JointTrajectory(("turn",), kw.PiecewisePolynomial(np.asarray(c)[:, :, None], x))


# (3 t² - t³)/4 goes from 0 to 1 in 2 s with no speed at the ends.
RISE = np.array([-0.25, 0.75, 0.0, 0.0])


@pytest.mark.parametrize("start", [0.0, 3.0, 40.0])
@pytest.mark.parametrize("gap", [1e-13, 1e-10, 1e-7])
def test_short_corner_pieces_break_acceleration_limit(gap: float, start: float) -> None:
    scenario = one_joint(
        continuity=0,
        limits={"acceleration": {"turn": 5}},
        tolerances={"joint_velocity": 1},
        waypoints=[
            {"joints": {"turn": start}, "velocity": {"turn": 0.5}},
            {"joints": {"turn": start + 0.5}, "velocity": {"turn": 0.5}, "after": 1},
            {"joints": {"turn": start + 0.65}, "velocity": {"turn": 0.15}, "after": 1},
        ],
    )
    x = [0.0, 1.0, 1.0 + gap, 2.0]
    c = np.array([[0.5, 0.15, 0.15], [start, start + 0.5, start + 0.5 + 0.15 * (x[2] - x[1])]])
    assert not kw.check(motion(c, x), scenario).ok
    # the corner itself as a tiny piece of the right positions and velocities at its ends
    corner = kw.JointTrajectory.from_knots(
        ["turn"],
        [0.0, 1.0 - gap, 1.0, 2.0],
        [[start], [start + 0.5 - 0.5 * gap], [start + 0.5], [start + 0.65]],
        [[0.5], [0.5], [0.15], [0.15]],
    )
    report = kw.check(corner, scenario)
    assert not report.ok
    changes = report.select(quantity="velocity_change")
    assert {found.unit for found in changes} == {"rad/s²"}


def test_many_close_small_jumps_count_as_large_one() -> None:
    steps, change = 40_000, 0.3
    gap = 1e-14 * 1e3
    x = np.concatenate([[0.0], 1.0 + gap * np.arange(steps), [2.0]])
    h, acceleration = np.diff(x), 1.0 + change * np.arange(steps + 1) / steps
    velocity = np.cumsum(acceleration * h) - acceleration * h
    way = velocity * h + 0.5 * acceleration * h**2
    c = np.array([0.5 * acceleration, velocity, np.cumsum(way) - way])
    loose = {"joint_position": 10, "joint_velocity": 10}
    assert not kw.check(motion(c, x), one_joint(tolerances=loose)).ok


@pytest.mark.parametrize("degree", [4, 30, 60])
def test_refuses_overflowing_coefficient(degree: int) -> None:
    """A coefficient of 1.7e308 in a last piece of 5 ns."""
    c = np.zeros((degree + 1, 2))
    c[-4:, 0] = RISE
    c[0, 1] = 1.7e308
    c[-1, 1] = 1.0
    with pytest.raises(kw.InputError, match=r"reach 1.7e\+308 within|degree is 60; at most 30"):
        motion(c, [0.0, 2.0 - 5e-9, 2.0])


def test_refuses_terms_overflowing_in_long_piece() -> None:
    c = np.zeros((31, 1))
    c[0] = 1.0
    with pytest.raises(kw.InputError, match="terms of piece 1 reach inf within 1e\\+12 s"):
        motion(c, [0.0, 1e12])
    with pytest.raises(kw.InputError, match="within 1e\\+250 s"):
        motion(c, [0.0, 1e250])


def test_refuses_too_high_degree(knotwork: Command, tmp_path: Path) -> None:
    c = np.full((601, 20), 1e-3)
    with pytest.raises(kw.InputError, match="degree is 600; at most"):
        motion(c, np.linspace(0, 2, 21))
    planned("paper_case").save(tmp_path)
    path = tmp_path / "trajectory.json"
    data = json.loads(path.read_text(encoding="utf-8"))
    data["coefficients"] = [[[1e-3] for _ in data["breaks"][1:]] for _ in range(601)]
    err = knotwork("check", written(path, data), "--scenario", "paper_case").refused()
    assert "coefficients" in err
    assert "at most" in err


@pytest.mark.parametrize("where", ["tolerances", "limits"])
def test_refuses_values_that_are_zero_in_si(knotwork: Command, tmp_path: Path, where: str) -> None:
    """In the file's unit the number is so small that it is zero in radians: 45° off passed."""
    key = {"tolerances": "joint_position", "limits": "velocity"}[where]
    data = {
        "units": {"angle": "deg"},
        where: {key: 5e-324},
        "waypoints": [{"joints": {"turn": 0}}, {"joints": {"turn": 45}, "after": 2}],
    }
    path = written(tmp_path / "task.yaml", data)
    err = knotwork("plan", path).refused()
    assert f"{path}: line 4: {where}.{key}: 5e-324: is so small that" in err
    assert "may round to zero in SI; give at least 1e-100" in err


def test_self_motion_at_stop_of_tool_fails() -> None:
    """With its wrist straight, a UR5 moves its joints and holds its tool still."""
    robot = kw.load_robot("ur5")
    q = np.array([0.0, -1.2, 1.4, -0.2, 0.0, 0.3])
    still = np.linalg.svd(robot.jacobian(q))[2][-1]
    start = dict(zip(robot.joint_names, (q - 0.5 * still).tolist(), strict=True))
    end = {"name": "end", "after": 2, "pose": pose_of(robot, q)}
    task = kw.load_scenario({"robot": "ur5", "waypoints": [{"joints": start}, end]})
    moved = kw.JointTrajectory.from_knots(
        robot.joint_names, [0, 2], [q - 0.5 * still, q], [0 * q, 0.8 * still]
    )
    (finding,) = kw.check(moved, task).failures
    assert (finding.name, finding.quantity) == ("end", "joint_velocity")


HOME = (0.0, -1.57, 1.57, -1.57, -1.57, 0.0)


def dithering(folder: Path, rows: int, width: float) -> tuple[Path, Path]:
    """A CSV file whose second joint goes to and fro by a width [rad] from row to row, in 10 s."""
    names = list(kw.load_robot("ur5").joint_names)
    heads = [f"{name}{end}" for end in ("", "_velocity", "_acceleration") for name in names]
    lines = [",".join(("time", *heads))]
    for k in range(rows + 1):
        q = np.array(HOME)
        q[1] += width * (k % 2)
        lines.append(",".join((f"{10.0 * k / rows:.9f}", *(f"{x:.10g}" for x in q), *["0"] * 12)))
    (folder / "dither.csv").write_text("\n".join(lines))
    joints = ", ".join(f"{name}: {value}" for name, value in zip(names, HOME, strict=True))
    (folder / "task.yaml").write_text(
        "robot: ur5\n"
        "limits: {acceleration: 1.0e+5, jerk: 1.0e+9, tool_acceleration: 50, "
        "frame_speed: {frame: forearm_link, speed: 0.05}}\n"
        f"waypoints:\n  - joints: {{{joints}}}\n  - {{joints: {{{joints}}}, after: 10}}\n"
    )
    return folder / "dither.csv", folder / "task.yaml"


@pytest.mark.parametrize(
    ("rows", "width"),
    mostly_exhaustive([(3000, 4e-4), (4000, 2.4e-4), (10_000, 1.5e-5)], (3000, 4e-4)),
)
def test_dithering_fails(rows: int, width: float, knotwork: Command, tmp_path: Path) -> None:
    motion, task = dithering(tmp_path, rows, width)
    out = knotwork("check", motion, "--scenario", task).failed()
    assert "effort reaches" in out
    assert "tool: acceleration" in out


def test_time_slack_is_bounded_for_large_times(knotwork: Command, tmp_path: Path) -> None:
    start = 1.7e9
    ends = [f"  - {{joints: {{a: {q}}}, time: {start + t}}}" for t, q in ((0, 0), (4, 1))]
    task = written(tmp_path / "task.yaml", "waypoints:\n" + "\n".join(ends))
    rows = [f"{start + t:.1f},{q},0,0" for t, q in ((0.0, 0), (1.5, 0.5), (2.5, 1))]
    head = "time,a,a_velocity,a_acceleration"
    motion = written(tmp_path / "late.csv", "\n".join([head, *rows]))
    assert "but the waypoints" in knotwork("check", motion, "--scenario", task).failed()
