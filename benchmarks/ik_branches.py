"""How many of all solutions are found, against closed forms."""

from __future__ import annotations

import importlib
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
from rich.table import Table

import knotwork as kw
from ik_arms import arm
from knotwork.robot import Robot, load_robot
from knotwork.waypoints import FloatArray


def branches(poses: int) -> Table:
    """All solutions of a UR5 and a spherical wrist against their closed forms."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "kinematics"))
    closed_form: Any = importlib.import_module("closed_form")
    table = Table(title=f"Branches found, {poses} poses", title_justify="left")
    for column in (
        "arm",
        "closed form",
        "found",
        "share",
        "a pose",
        "not in the closed form",
        "ms",
    ):
        table.add_column(column)
    turn = pin.SE3(pin.utils.rotate("z", np.pi), np.zeros(3))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "spherical.urdf"
        path.write_text(closed_form.spherical_wrist_urdf(), encoding="utf-8")
        spherical = load_robot(path).with_tool("l7")
    truths: list[tuple[Robot, Callable[[Any], list[FloatArray]]]] = [
        (arm("ur5"), lambda pose: list(closed_form.ur5((turn * pose).homogeneous))),
        (spherical, lambda pose: list(closed_form.spherical_wrist(pose.homogeneous))),
    ]
    for robot, truth in truths:
        generator = np.random.default_rng(45)
        wanted = found = extra = 0
        seconds = 0.0
        for _ in range(poses):
            pose = robot.forward(generator.uniform(-np.pi, np.pi, 6))
            start = time.perf_counter()
            answers = np.array([branch.q for branch in kw.solve_all(robot, pose)])
            seconds += time.perf_counter() - start
            expected = truth(pose)
            hits = sum(
                bool((np.abs(closed_form.turned(answers - q)).max(axis=1) < 1e-5).any())
                for q in expected
            )
            wanted, found = wanted + len(expected), found + hits
            extra += len(answers) - hits
        cells = [wanted, found, f"{found / wanted:.3%}", f"{wanted / poses:.2f}", extra]
        table.add_row(robot.name, *map(str, cells), f"{1e3 * seconds / poses:.1f}")
    return table
