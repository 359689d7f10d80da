"""Motions that stay on their path and do not make it as asked: none may pass the check."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gantry
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import knotwork as kw
from sweeps import examples


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("gantry")


def failures(motion: kw.JointTrajectory, task: kw.Scenario) -> dict[str, str]:
    """What fails, by quantity, with the message."""
    return {one.quantity: one.message for one in kw.check(motion, task).failures}


def circle(folder: Path, radius: float, turns: int = 0, **more: Any) -> kw.Scenario:
    """Turns about a centre beside the origin, all ramps: so no speed is asked for in full."""
    length = 2.0 * np.pi * radius * (turns + 1)
    speed = length / 4.0
    arc: dict[str, Any] = {"centre": [-radius, 0, 0], "normal": [0, 0, 1]}
    if turns:
        arc["turns"] = turns
    return gantry.scenario(
        folder,
        {"arc": arc},
        [0, 0, 0],
        speed,
        acceleration=1.5 * speed**2 / length,
        tolerances={"path": 0.5},
        **more,
    )


def ends(task: kw.Scenario) -> tuple[float, float]:
    motion = task.paths[0].motion
    return motion.start_time, motion.end_time


def seam(folder: Path) -> kw.Scenario:
    """200 mm at 50 mm/s, in full from 3 s to 4 s of 7 s."""
    return gantry.scenario(folder, "line", [200, 0, 0], 50, acceleration=25)


def eight(folder: Path) -> kw.Scenario:
    """A figure eight through points, from its crossing on and closed there."""
    u = np.linspace(0.0, 2.0 * np.pi, 41)
    points = 40.0 * np.column_stack((np.sin(u), np.sin(u) * np.cos(u), 0.0 * u))
    path = folder / "eight.csv"
    np.savetxt(path, points, delimiter=",", header="x,y,z", comments="")
    return gantry.scenario(
        folder, {"points": str(path)}, [0, 0, 0], 50, acceleration=200, tolerances={"path": 0.5}
    )


def ramped(task: kw.Scenario, width: float) -> Any:
    """Progress whose ramps take a part of their time only, at its middle."""
    (stretch,) = task.paths[0].stretches
    v, (low, high) = 1e3 * stretch.speed, stretch.full_speed

    def rise(t: np.ndarray, start: float, end: float) -> np.ndarray:
        """What a ramp from rest covers in between."""
        middle, half = 0.5 * (start + end), 0.5 * width * (end - start)
        u = np.clip((t - middle + half) / (2.0 * half), 0.0, None)
        inside = 2.0 * half * v * (np.minimum(u, 1.0) ** 3 - 0.5 * np.minimum(u, 1.0) ** 4)
        return inside + 2.0 * half * v * np.maximum(u - 1.0, 0.0)

    def along(t: np.ndarray) -> np.ndarray:
        start, end = stretch.start, stretch.end
        return rise(t, start, low) - rise(t, high, end)

    return along


@examples(12, 72)
@given(
    kind=st.sampled_from(["line", "eight", 2.0, 20.0, 50.0]),
    turns=st.integers(0, 5),
    width=st.floats(0.4, 1.0),
    aside=st.just(0.0) | st.floats(1e-3, 0.2),
    waves=st.integers(1, 3),
)
def test_other_allowed_ramps_pass(
    folder: Path, kind: Any, turns: int, width: float, aside: float, waves: int
) -> None:
    """Late in its ramps by up to turns, and a little aside."""
    if kind == "line":
        task = seam(folder)
        aside *= 0.2
    else:
        task = eight(folder) if kind == "eight" else circle(folder, kind, turns)
    start, end = ends(task)

    def off(t: np.ndarray) -> np.ndarray:
        u = (t - start) / (end - start)
        height = aside * np.sin(waves * np.pi * u) ** 2 * np.sin(np.pi * u) ** 2
        return np.column_stack((0.0 * u, 0.0 * u, height))

    moved = gantry.motion(task, ramped(task, width), off)
    report = kw.check(moved, task)
    assert report.ok, report.failures
    assert {one.proof for one in report.select(group="Tool paths")} == {"bounded"}
