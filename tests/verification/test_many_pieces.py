"""Motions of thousands of pieces that keep still at their breaks and break limits between them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import knotwork as kw
from command_line import Command
from sweeps import mostly_exhaustive

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
def test_dithering_between_thousands_of_rows_fails(
    rows: int, width: float, knotwork: Command, tmp_path: Path
) -> None:
    motion, task = dithering(tmp_path, rows, width)
    ran = knotwork("check", motion, "--scenario", task)
    assert ran.code == 1
    assert "effort reaches" in ran.out
    assert "tool: acceleration" in ran.out


def test_time_slack_is_bounded_for_large_times(knotwork: Command, tmp_path: Path) -> None:
    start = 1.7e9
    task = tmp_path / "task.yaml"
    ends = [f"  - {{joints: {{a: {q}}}, time: {start + t}}}" for t, q in ((0, 0), (4, 1))]
    task.write_text("waypoints:\n" + "\n".join(ends))
    rows = [f"{start + t:.1f},{q},0,0" for t, q in ((0.0, 0), (1.5, 0.5), (2.5, 1))]
    motion = tmp_path / "late.csv"
    motion.write_text("time,a,a_velocity,a_acceleration\n" + "\n".join(rows))
    ran = knotwork("check", motion, "--scenario", task)
    assert ran.code == 1
    assert "but the waypoints" in ran.out
