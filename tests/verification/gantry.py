"""A gantry whose joints are the place of its tool: any motion of the tool is a motion of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import BPoly, CubicSpline

import knotwork as kw

AXES = ("x", "y", "z")
SAMPLES = 600


def urdf(folder: Path) -> Path:
    """Write the robot: three prismatic joints, one after the other."""
    links = "".join(f'<link name="{name}"/>' for name in ("base", *AXES))
    joints = "".join(
        f'<joint name="{name}_slide" type="prismatic"><parent link="{parent}"/>'
        f'<child link="{name}"/><axis xyz="{" ".join(str(int(name == one)) for one in AXES)}"/>'
        '<limit lower="-5" upper="5" effort="1" velocity="100"/></joint>'
        for parent, name in zip(("base", *AXES), AXES, strict=False)
    )
    path = folder / "gantry.urdf"
    path.write_text(f'<robot name="gantry">{links}{joints}</robot>')
    return path


def scenario(
    folder: Path, along: Any, end: Sequence[float], speed: float, **more: Any
) -> kw.Scenario:
    """From rest in the origin along a path to rest at its end, in mm."""
    path = {key: more.pop(key) for key in ("acceleration",) if key in more}
    given = {
        "units": {"length": "mm"},
        "robot": str(urdf(folder)),
        "tool": {"frame": "z"},
        "path": path,
        "waypoints": [
            {"name": "on", "stop": True, "pose": {"position": [0, 0, 0], "rpy": [0, 0, 0]}},
            {
                "name": "off",
                "along": along,
                "speed": speed,
                "stop": True,
                "pose": {"position": list(end)},
            },
        ],
        **more,
    }
    return kw.load_scenario(given)


def progress(*states: tuple[float, float, float]) -> Callable[[np.ndarray], np.ndarray]:
    """Arc length over time through states (time, arc length, speed), without acceleration there."""
    times = [state[0] for state in states]
    return BPoly.from_derivatives(times, [[s, v, 0.0] for _, s, v in states])


def motion(
    task: kw.Scenario,
    along: Callable[[np.ndarray], np.ndarray],
    aside: Callable[[np.ndarray], np.ndarray] = lambda t: np.zeros((len(t), 3)),
) -> kw.JointTrajectory:
    """The tool on the path at arc lengths over time [mm], and aside of it [mm]."""
    timed = task.paths[0].motion
    t = np.linspace(timed.start_time, timed.end_time, SAMPLES + 1)
    s = 1e-3 * np.asarray(along(t))
    if len(timed.path.curves) == 1:  # beyond its ends, too: a circle goes on
        places = timed.path.curves[0].position(s)
    else:
        places = timed.path.position(np.clip(s, 0.0, timed.path.length))
    joints = CubicSpline(t, places + 1e-3 * aside(t), bc_type="clamped")
    names = tuple(f"{name}_slide" for name in AXES)
    return kw.JointTrajectory(
        names, kw.PiecewisePolynomial(joints.c, joints.x), joint_units=("m",) * 3
    )
