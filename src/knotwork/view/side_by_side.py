"""Two motions on one page, with one clock, and their difference over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import InputError
from knotwork.robot import Robot
from knotwork.verification.report import CheckedMotion
from knotwork.view.page import Page, asset, iframe, json_in_html, render_template, scene_page
from knotwork.view.path_meshes import max_speed
from knotwork.view.scene_data import make_scene
from knotwork.view.shown_motion import ShownMotion

DIFFERENCE_SAMPLES = 400
"""Number of intervals at whose ends the difference is sampled."""
MIN_DIFFERENCE = 1e-3
"""Minimum value at the top of a curve, in the displayed unit; smaller differences look flat."""


def side_by_side(plans: Sequence[CheckedMotion], names: Sequence[str]) -> Page:
    """Put two motions on a page, each in its own scene, with one camera.

    Args:
        plans: Two plans for one robot.
        names: Names of the two motions on the page.

    Raises:
        InputError: A plan has no robot, or the robots differ.
    """
    shown = [ShownMotion.of_checked(plan) for plan in plans]
    scale_end = max(map(max_speed, shown))  # the same colour is the same speed on both sides
    scenes = [make_scene(motion, min_scale_end=scale_end) for motion in shown]
    for scene in scenes:
        scene["legend"]["units"] = scenes[0]["units"]
    view = _common_view(scenes)
    pages = [scene_page({**scene, **view}, embedded=True, autoplay=False) for scene in scenes]
    parts = {"style": asset("side_by_side.css"), "script": asset("side_by_side.js")}
    difference = _difference(plans)
    parts["json"] = json_in_html(difference)
    for key, page, name in zip(("first", "second"), pages, names, strict=True):
        parts[key] = iframe(page.html, height="100%", name=name)
    title = " and ".join(names)
    text = render_template(
        "side_by_side.html",
        parts,
        title=title,
        shown=list(zip(names, scenes, strict=True)),
        duration=difference["duration"],
        curves=[_drawn(difference["time"], **curve) for curve in difference["curves"]],
    )
    warnings = dict.fromkeys(line for page in pages for line in page.warnings)
    return Page(title, text, tuple(warnings))


def _common_view(scenes: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """The common first view, from the direction of the first scene, with both scenes in view."""
    joined: dict[str, Any] = {"view": None, "work": None}
    for key in joined:
        views = [scene[key] for scene in scenes]
        if all(views):
            points = [point for view in views for point in view["points"]]
            joined[key] = {"towards_camera": views[0]["towards_camera"], "points": points}
    return joined


def _difference(plans: Sequence[CheckedMotion]) -> dict[str, Any]:
    """Distance of the tools, and difference of the joint that differs most, over time.

    Both motions start at time 0. After its end a motion stays at its last state.

    Raises:
        InputError: The robots differ.
    """
    arms = [plan.joints.robot for plan in plans]
    first, second = arms
    if first is None or second is None or first.joint_names != second.joint_names:
        named = " and ".join("no robot" if arm is None else arm.name for arm in arms)
        raise InputError(f"only motions of one robot are shown side by side, not of {named}")
    units = plans[0].scenario.units
    duration = max(plan.trajectory.duration for plan in plans)
    time = np.linspace(0.0, duration, DIFFERENCE_SAMPLES + 1)
    (tool, q), (other_tool, other_q) = (
        _sample(arm, plan.trajectory, time)
        for arm, plan in zip((first, second), plans, strict=True)
    )
    joint = int(np.abs(q - other_q).max(axis=0).argmax())
    difference = f"difference of {first.joint_names[joint]}"
    curves = (
        ("distance of the tools", "m", np.linalg.norm(tool - other_tool, axis=1)),
        (difference, first.joint_units[joint], np.abs(q - other_q)[:, joint]),
    )
    shown = [(name, *units.shown(1.0, unit), value) for name, unit, value in curves]
    return {
        "duration": duration,
        "starts": [plan.trajectory.start_time for plan in plans],
        "time": time.tolist(),
        "curves": [
            {"name": name, "unit": unit, "value": (factor * value).tolist()}
            for name, factor, unit, value in shown
        ],
    }


def _drawn(time: list[float], name: str, unit: str, value: list[float]) -> dict[str, str]:
    """A curve for the template: its maximum, and its points in a box of width 1 and height 2."""
    most = max(value)
    scale = max(most, MIN_DIFFERENCE)
    points = (
        f"{t / time[-1]:.5f},{2.0 - 2.0 * y / scale:.4f}" for t, y in zip(time, value, strict=True)
    )
    at = f"{time[value.index(most)]:.2f}"
    return {"name": name, "unit": unit, "points": " ".join(points), "most": f"{most:.3g}", "at": at}


def _sample(
    robot: Robot, motion: JointTrajectory, time: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Positions of the tool [m], shape (n, 3), and of the joints, at times since the start."""
    curve = motion.reordered(robot.joint_names, robot.joint_units, owner=robot.name).polynomial
    q = curve(np.clip(time + curve.x[0], curve.x[0], curve.x[-1]))
    return np.array([robot.forward(row).translation for row in q]), q
