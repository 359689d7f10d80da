"""CppFlow's paths for redundant arms as scenarios, and a dome; see cppflow/README.md."""

from __future__ import annotations

import csv
import io
import tarfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import yaml

import knotwork as kw
from knotwork.task.scenario import Scenario

FOLDER = Path(__file__).parent / "cppflow"
SPEED = 0.05
# Where the direction of a path changes by more than this [rad], it has a corner.
CORNER = 0.02
TOLERANCES = {"path": 1e-4, "path_orientation": float(np.radians(0.1))}


@dataclass(frozen=True)
class Arm:
    """An arm for a problem.

    Attributes:
        robot, tool: What drives the path.
        path, boxes: How far path and boxes are moved [m]; by default not at all.
        turned: Rotation of the tool beyond that of the path, roll, pitch, yaw [rad].
    """

    robot: str
    tool: str
    path: tuple[float, float, float] = (0.0, 0.0, 0.0)
    boxes: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turned: tuple[float, float, float] = (0.0, 0.0, 0.0)


ARMS = {
    "panda__1cube": Arm("panda", "panda_hand"),
    "panda__2cubes": Arm("panda", "panda_hand"),
    "fetch_arm__s": Arm(
        "xarm7", "link_eef", (-0.45, 0.0, -0.083), (-0.25, 0.0, -0.46), (0.0, np.pi / 2, 0.0)
    ),
}


def problem(name: str, arm: Arm | None = None) -> dict[str, Any]:
    """The scenario of a problem: lines at constant speed, with stops at corners."""
    arm = ARMS[name] if arm is None else arm
    with tarfile.open(FOLDER / "problems.tar.xz") as archive:
        texts = {one.name: archive.extractfile(one).read().decode() for one in archive}  # type: ignore[union-attr]
    given = yaml.safe_load(texts[f"{name}.yaml"])
    return scenario(name, given, texts[f"{given['path_name']}.csv"], arm)


def scenario(name: str, given: Any, path: str, arm: Arm) -> dict[str, Any]:
    """What a problem's files say as a scenario."""
    rows = np.array(list(csv.reader(io.StringIO(path)))[1:], dtype=float)
    place = np.array(given["path_R_offset"], dtype=float)
    points = rows[:, 1:4] @ place.T + given["path_xyz_offset"] + arm.path
    step = np.diff(points, axis=0)
    direction = step / np.linalg.norm(step, axis=1)[:, None]
    bend = np.linalg.norm(np.diff(direction, axis=0), axis=1)
    kept = [0, *(np.flatnonzero(bend > CORNER) + 1).tolist(), len(points) - 1]
    w, x, y, z = rows[0, 4:]
    rotation = place @ pin.Quaternion(w, x, y, z).matrix() @ pin.rpy.rpyToMatrix(*arm.turned)
    first = {"position": points[0].tolist(), "rotation_matrix": rotation.tolist()}
    waypoints: list[dict[str, Any]] = [{"name": "start", "pose": first, "stop": True}]
    for k, i in enumerate(kept[1:], 1):
        pose = {"position": points[i].tolist()}
        line = {"name": f"end {k}", "along": "line", "speed": SPEED, "pose": pose, "stop": True}
        waypoints.append(line)
    boxes = np.array(given.get("obstacle_xyz_offset", [0, 0, 0])) + arm.boxes
    objects = {}
    for k, listed in enumerate(given.get("obstacles", [])):
        box = {key: value for one in listed for key, value in one.items()}
        objects[f"box {k + 1}"] = {
            "box": [box[f"size_{axis}"] for axis in "xyz"],
            "position": (boxes + [box[axis] for axis in "xyz"]).tolist(),
            "rpy": [box[angle] for angle in ("roll", "pitch", "yaw")],
        }
    return {
        "name": name,
        "robot": arm.robot,
        "tool": {"frame": arm.tool},
        "scene": {"objects": objects},
        "tolerances": TOLERANCES,
        "waypoints": waypoints,
    }


def dome(folder: Path, *, free: bool) -> Scenario:
    """The shipped dome, or one whose points have rotations, so that nothing is free."""
    shipped = kw.load_scenario("ur5_dome")
    if free or shipped.source is None:
        return shipped
    given = yaml.safe_load(shipped.source.read_text(encoding="utf-8"))
    del given["tool"]["free"]
    path = shipped.paths[0].timed_path.tool_path
    frame = shipped.frame_placements["top"]
    s = np.linspace(0.0, path.length, 500)
    turns = [pin.Quaternion(frame.rotation.T @ R).coeffs() for R in path.rotation(s)]
    points = (path.position(s) - frame.translation) @ frame.rotation * 1000.0
    lines = [",".join(f"{x:.9f}" for x in (*a, *b)) for a, b in zip(points, turns, strict=True)]
    (folder / "points.csv").write_text("x,y,z,qx,qy,qz,qw\n" + "\n".join(lines), encoding="utf-8")
    given["waypoints"][2]["along"]["points"] = "points.csv"
    for k, R in ((2, path.rotation(s[-1:])[0]), (3, path.rotation(s[-1:])[0])):
        place = {"position": given["waypoints"][k]["pose"]["position"]}
        given["waypoints"][k]["pose"] = place | {"rotation_matrix": (frame.rotation.T @ R).tolist()}
    (folder / "dome.yaml").write_text(yaml.safe_dump(given), encoding="utf-8")
    return kw.load_scenario(folder / "dome.yaml")


def measured(case: str, task: Scenario | dict[str, Any]) -> dict[str, Any]:
    """A plan: what is proved of its path [mm, deg], what its last joint does there, CPU seconds."""
    task = kw.load_scenario(task) if isinstance(task, dict) else task
    begun = time.process_time()
    plan = kw.plan(task)
    taken = time.process_time() - begun
    found = plan.report.select(group="Tool paths")
    bounds = {
        quantity: max(
            (one.value or 0.0) + one.proof_gap for one in found if one.quantity == quantity
        )
        for quantity in ("path_deviation", "path_orientation")
    }
    first, last = plan.scenario.paths[0].timed_path, plan.scenario.paths[-1].timed_path
    times = np.linspace(first.start_time, last.end_time, 4000)
    q, v = plan.trajectory.position(times)[:, -1], plan.trajectory.velocity(times)[:, -1]
    return {
        "case": case,
        "passed": plan.report.ok,
        "bound_mm": float(f"{1e3 * bounds['path_deviation']:.3g}"),
        "bound_deg": float(f"{np.degrees(bounds['path_orientation']):.3g}"),
        "last_joint_deg": float(f"{np.degrees(np.ptp(q)):.3g}"),
        "last_joint_peak_deg_s": float(f"{np.degrees(np.abs(v).max()):.3g}"),
        "cpu_s": float(f"{taken:.2g}"),
    }
