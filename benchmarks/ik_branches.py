"""How many of all solutions are found, against closed forms, also next to a singular wrist."""

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

import knotwork as kw
from ik_arms import arm
from knotwork.arrays import FloatArray
from knotwork.robot import Robot, load_robot

BENT = (1e-2, 1e-4, 1e-6)
"""How far from straight the wrist is [rad]."""


def branches(poses: int) -> dict[str, Any]:
    """All solutions of a UR5 and a spherical wrist against their closed forms."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "kinematics"))
    closed_form: Any = importlib.import_module("closed_form")
    turn = pin.SE3(pin.utils.rotate("z", np.pi), np.zeros(3))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "spherical.urdf"
        path.write_text(closed_form.spherical_wrist_urdf(), encoding="utf-8")
        spherical = load_robot(path).with_tool("l7")
    truths: list[tuple[Robot, Callable[[Any], list[FloatArray]]]] = [
        (arm("ur5"), lambda pose: list(closed_form.ur5((turn * pose).homogeneous))),
        (spherical, lambda pose: list(closed_form.spherical_wrist(pose.homogeneous))),
    ]
    rows = []
    for robot, truth in truths:
        for bent in (None, *BENT):
            count = poses if bent is None else max(poses // 10, 1)
            row = {"arm": robot.name, "from_straight": bent}
            rows.append(row | _row(robot, truth, count, bent, closed_form.turned))
    return {"poses": poses, "rows": rows}


def _row(
    robot: Robot,
    truth: Callable[[Any], list[FloatArray]],
    poses: int,
    bent: float | None,
    turned: Callable[[FloatArray], FloatArray],
) -> dict[str, Any]:
    """Solutions of the closed form, those found of them, others; and ms a pose."""
    generator = np.random.default_rng(45)
    wanted = found = extra = 0
    seconds = 0.0
    # What rounding of pose and closed form makes of solutions next to a singularity.
    same = 1e-5 if bent is None else max(1e-5, 1e-9 / bent)
    for _ in range(poses):
        q = generator.uniform(-np.pi, np.pi, 6)
        if bent is not None:
            q[4] = bent
        pose = robot.forward(q)
        start = time.process_time()
        answers = np.array([branch.q for branch in kw.solve_pose_ik_all(robot, pose)])
        seconds += time.process_time() - start
        expected = truth(pose)
        hits = sum(bool((np.abs(turned(answers - x)).max(axis=1) < same).any()) for x in expected)
        wanted, found = wanted + len(expected), found + hits
        extra += len(answers) - hits
    ms = round(1e3 * seconds / poses, 1)
    return {"closed_form": wanted, "found": found, "beside": extra, "ms": ms}
