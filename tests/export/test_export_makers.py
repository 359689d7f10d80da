"""Programs and streams for controllers of other makers, read as these would read them."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import knotwork as kw
from command_line import Command
from knotwork import export
from knotwork.errors import ExportError, InputError
from knotwork.trajectory import JointTrajectory

NUMBER = r"(-?\d+\.\d+)"


@pytest.fixture(scope="module")
def motion() -> JointTrajectory:
    return kw.plan("ur5_deburring").trajectory


def numbers(pattern: str, text: str) -> np.ndarray:
    return np.array(re.findall(pattern, text), dtype=float)


def read_krl(text: str) -> tuple[np.ndarray, np.ndarray]:
    axes = numbers(r"\{" + ", ".join(f"A{i} {NUMBER}" for i in range(1, 7)), text)
    parts = numbers(rf"PART = {NUMBER}", text)
    end = numbers(rf"END = {NUMBER}", text)[0]
    assert text.index("PTP_SPLINE") < text.index("TIME_BLOCK START") < text.index("ENDSPLINE")
    return np.append(0.0, np.cumsum(parts) * end / parts.sum()), axes


def read_rapid(text: str) -> tuple[np.ndarray, np.ndarray]:
    targets = numbers(r"\[\[" + ",".join([NUMBER] * 6) + r"\],\[9E9,", text)
    moves = re.findall(
        r"MoveAbsJ kw_q\{(\d+)\}\\NoEOffs, v\d+(?:\\T:=([\d.]+))?, (\w+), tool0;", text
    )
    assert [int(index) for index, _, _ in moves] == list(range(1, len(targets) + 1))
    assert [zone for _, _, zone in moves if zone == "fine"] == ["fine"] * 2
    return np.cumsum([float(time or 0.0) for _, time, _ in moves]), targets


def read_ls(text: str) -> tuple[np.ndarray, np.ndarray]:
    axes = numbers(", ".join(f"J{i} = {NUMBER} deg" for i in range(1, 7)), text)
    moves = re.findall(r"J P\[(\d+)\] (\d+)(msec|%) (FINE|CNT100) ;", text)
    assert [int(move) for move, *_ in moves] == list(range(1, len(axes) + 1))
    axes[:, 2] += axes[:, 1]  # J3 counts from the horizontal
    return np.cumsum([float(n) if unit == "msec" else 0.0 for _, n, unit, _ in moves]) / 1e3, axes


def read_stream(text: str) -> tuple[np.ndarray, np.ndarray]:
    rows = [line for line in text.splitlines() if not line.startswith("#")]
    table = np.array([row.split(",") for row in rows[1:]], dtype=float)
    return table[:, 0], table[:, 1:]


READERS = {
    "krl": (read_krl, 1e-6),
    "rapid": (read_rapid, 1e-6),
    "ls": (read_ls, 1e-4),
    "rsi": (read_stream, 0.0),
    "egm": (read_stream, 0.0),
}


@pytest.mark.parametrize("name", READERS)
@pytest.mark.parametrize("fit", [None, 1e-4])
def test_lines_between_points_are_as_far_off_as_the_file_says(
    motion: JointTrajectory, name: str, fit: float | None
) -> None:
    read, digit = READERS[name]
    streamed = name in export.CYCLES
    if streamed and fit is not None:
        with pytest.raises(InputError, match="takes no option 'fit'"):
            export.export(motion, name, fit=fit)
        return
    text = export.export(motion, name, **({} if fit is None else {"fit": fit}))
    time, axes = read(text)
    points = export.straight_points(motion, cycle=export.CYCLES.get(name), fit=fit)
    assert name == "ls" or points.describe() in text
    assert points.error <= (fit or 1e-3) * 1.01
    assert time[-1] == pytest.approx(motion.duration, abs=1e-3)
    dense = np.linspace(0.0, motion.duration, 20_001)
    lines = np.stack([np.interp(dense, time, column) for column in np.radians(axes.T)], axis=1)
    off = np.abs(lines - motion.position(motion.start_time + dense)).max()
    assert 0.95 * points.error < off < points.error * (1 + 1e-9) + np.radians(2 * digit) + 1e-12


def test_stream_motion_counts_the_third_axis_from_the_horizontal(motion: JointTrajectory) -> None:
    time, axes = read_stream(export.to_j519(motion))
    q = np.degrees(motion.position(np.minimum(time, motion.end_time)))
    np.testing.assert_allclose(axes[:, 2], q[:, 2] - q[:, 1], atol=1e-9)
    np.testing.assert_allclose(np.diff(time), 0.008)


def test_what_slides_is_an_external_axis(motion: JointTrajectory) -> None:
    names, units = ("rail", *motion.joint_names), ("m",) + ("rad",) * 6
    position = np.zeros((2, 7))
    position[1, 0] = 0.5
    rail = JointTrajectory.from_knots(names, [0, 2], position, 0 * position, joint_units=units)
    assert "A6 0.000000, E1 0.000000}" in export.to_krl(rail)
    assert "[500.000000,9E9,9E9,9E9,9E9,9E9]]" in export.to_rapid(rail)
    assert "E1 = 500.0000 mm" in export.to_ls(rail)


def test_other_arms_and_moving_ends_are_refused(motion: JointTrajectory) -> None:
    panda = kw.plan("panda_pick_place").trajectory
    with pytest.raises(ExportError, match=r"7 turning and 0 sliding .* 6 turning axes"):
        export.to_krl(panda)
    cut = JointTrajectory.from_knots(["a"], [0, 1], [[0], [1]], [[0], [0.5]])
    with pytest.raises(ExportError, match=r"ends with joint 'a' at 0.5 rad/s.*stop: true after it"):
        export.to_egm(cut)
    with pytest.raises(InputError, match=r"more than 1000000 points"):
        export.to_rapid(motion, fit=1e-15)
    with pytest.raises(InputError, match="fit"):
        export.to_rapid(motion, fit=-1.0)


def test_rows_for_franka_keep_its_limits_or_are_refused(panda_arm: kw.Robot) -> None:
    plan = kw.plan("panda_pick_place")
    text = export.to_franka(plan.trajectory, robot=panda_arm)
    time, q = read_stream(text)
    np.testing.assert_allclose(q, plan.trajectory.position(time), atol=1e-15)
    jerk = np.abs(np.diff(np.repeat(q, 1, axis=0), 3, axis=0)) / 1e-9
    use = (jerk / panda_arm.jerk_limit).max()
    said = float(re.search(r"jerk ([\d.e-]+) % of its limit", text)[1])  # type: ignore[index]
    assert said == pytest.approx(100 * use, rel=0.05)
    assert "torque rate" in text
    assert "not checked" in export.to_franka(plan.trajectory)
    # a start with an acceleration is a step of it for the interface
    abrupt = JointTrajectory.from_knots(
        panda_arm.joint_names, [0.0, 0.3], np.outer([0, 0.1], np.ones(7)), np.zeros((2, 7))
    )
    with pytest.raises(ExportError, match=r"torque rate of joint 'panda_joint2' is .* at 0.000 s"):
        export.to_franka(abrupt, robot=panda_arm)


@pytest.fixture(scope="module")
def panda_arm() -> kw.Robot:
    return kw.load_robot("panda")


@pytest.mark.parametrize(
    ("name", "task", "note"),
    [
        ("krl", "ur5_deburring", "70 points; straight lines between them are off"),
        ("franka", "panda_pick_place", "3001 points; straight lines between them are off"),
        ("mujoco", "planar2_closed_form", ""),
    ],
)
def test_the_command_prints_how_far_off_they_are(
    knotwork: Command, tmp_path: Path, name: str, task: str, note: str
) -> None:
    ran = knotwork("export", task, "--format", name, "-o", tmp_path / "file")
    assert ran.code == 0
    assert note in ran.out
    assert name != "franka" or "torque rate" in (tmp_path / "file").read_text()
