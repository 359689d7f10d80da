"""Scenes opened from disk in a real browser: what is seen, where, and how it moves."""

from __future__ import annotations

import base64
import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import knotwork as kw
from knotwork.view.page import Page
from knotwork.view.show import view_plan

FAILING = Path(__file__).parents[1] / "failing"
WIDTH, HEIGHT = 900, 600
SCENARIOS = ("ur5_deburring", "panda_pick_place", "kinova_dispense", "planar2_closed_form")
HIDE = "(path) => viewer.set_property(['Knotwork', ...path], 'visible', false)"


def open_page(tab: Any, page: Page, folder: Path, hash: str = "#paused") -> None:
    path = page.save(folder / "scene.html")
    tab.set_viewport_size({"width": WIDTH, "height": HEIGHT})
    tab.goto(path.as_uri() + hash)
    tab.wait_for_function("document.documentElement.dataset.ready === 'true'", timeout=60_000)


def picture(tab: Any) -> np.ndarray[Any, Any]:
    """What the canvas shows, shape (height, width, 3)."""
    data = tab.evaluate("knotwork.picture()").partition(",")[2]
    image = Image.open(io.BytesIO(base64.b64decode(data))).convert("RGB")
    return np.asarray(image).astype(int)


def changed(before: np.ndarray[Any, Any], after: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Which pixels differ to the eye."""
    return np.abs(before - after).max(axis=2) > 12


def tool_position(tab: Any) -> np.ndarray[Any, Any]:
    """Where the page has the tool centre point, in the axes of the URDF's root [m]."""
    x, y, z = tab.evaluate(
        """() => {
          const data = JSON.parse(document.getElementById("data").textContent);
          const carrier = data.things.find((thing) => thing.name === "tool").carrier;
          const names = [];
          for (let joint = carrier; joint > 0; joint = data.joints[joint - 1].parent)
            names.unshift(data.joints[joint - 1].name);
          const object = viewer.scene_tree.find(["Knotwork", "arm", ...names]).object;
          object.updateWorldMatrix(true, false);
          const point = new MeshCat.THREE.Vector3(...data.tip);
          return object.localToWorld(point).toArray();
        }"""
    )
    return np.array([x, -z, y])


def true_position(plan: kw.Plan, time: float) -> np.ndarray[Any, Any]:
    robot = plan.space.robot
    assert robot is not None
    pose = robot.base_placement * robot.forward(plan.trajectory.position(time))
    return np.array(pose.translation)


@pytest.mark.parametrize("name", SCENARIOS)
def test_the_first_look_shows_arm_path_and_labels(tab: Any, name: str, tmp_path: Path) -> None:
    plan = kw.plan(name)
    page = view_plan(plan)
    assert not page.warnings
    assert len(page.html.encode()) < 20e6
    open_page(tab, page, tmp_path)
    whole = picture(tab)
    assert whole.std(axis=(0, 1)).max() > 10

    shown = tab.evaluate(
        """() => [...document.querySelectorAll(".label")]
          .filter((label) => label.style.visibility === "visible")
          .map((label) => [label.textContent, label.getBoundingClientRect().toJSON()])"""
    )
    names = {waypoint.name for waypoint in plan.scenario.waypoints} | set(plan.scenario.frames)
    assert {text for text, _ in shown} == names
    for i, (_, box) in enumerate(shown):
        assert box["height"] >= 14
        assert 0 <= box["left"] < box["right"] <= WIDTH
        assert 0 <= box["top"] < box["bottom"] <= HEIGHT
        for _, other in shown[:i]:
            beside = box["right"] <= other["left"] or other["right"] <= box["left"]
            assert beside or box["bottom"] <= other["top"] or other["bottom"] <= box["top"]

    tab.evaluate(HIDE, ["ghosts"])
    with_path = picture(tab)
    tab.evaluate(HIDE, ["path"])
    without_path = picture(tab)
    assert changed(with_path, without_path).sum() > 150
    tab.evaluate(HIDE, ["arm"])
    arm = changed(without_path, picture(tab))
    # Large, in view as a whole, and higher than its foot.
    rows, columns = np.nonzero(arm)
    assert 0.02 < arm.mean() < 0.6
    assert 0 < rows.min() < rows.max() < HEIGHT - 1
    assert 0 < columns.min() < columns.max() < WIDTH - 1


def test_the_arm_is_in_its_colours(tab: Any, tmp_path: Path) -> None:
    open_page(tab, view_plan(kw.plan("planar2_closed_form"), ghosts=False), tmp_path)
    red, green, blue = np.moveaxis(picture(tab), 2, 0)
    orange = (red > 150) & (green > 60) & (green < 200) & (blue < 90)
    assert orange.mean() > 0.02


def test_the_motion_is_the_trajectory(tab: Any, tmp_path: Path) -> None:
    plan = kw.plan("ur5_deburring")
    open_page(tab, view_plan(plan, ghosts=False), tmp_path)
    for time in (0.0, 2.5, 7.975, plan.trajectory.end_time):
        tab.evaluate("(time) => knotwork.seek(time)", time)
        assert tool_position(tab) == pytest.approx(true_position(plan, time), abs=2e-6)
    # Between two frames, 120 a second, the one before is shown and none is made up.
    tab.evaluate("knotwork.seek(2.5 + 0.7 / 120)")
    assert tool_position(tab) == pytest.approx(true_position(plan, 2.5), abs=2e-6)


def test_playing_moves_the_arm_to_the_end(tab: Any, tmp_path: Path) -> None:
    plan = kw.plan("panda_pick_place")
    open_page(tab, view_plan(plan, ghosts=False), tmp_path)
    before = picture(tab)
    tab.click("#play")
    tab.wait_for_function("knotwork.time() > 1")
    tab.evaluate("knotwork.pause()")  # on a slow machine it may have come to its end already
    stopped = tab.evaluate("knotwork.time()")
    assert 1 < stopped <= plan.trajectory.end_time
    assert changed(before, picture(tab)).mean() > 0.01
    tab.evaluate("knotwork.seek(2.5)")
    tab.select_option("#rate", "2")
    tab.click("#play")
    tab.wait_for_function(f"knotwork.time() >= {plan.trajectory.end_time} - 1e-6")
    assert tool_position(tab) == pytest.approx(
        true_position(plan, plan.trajectory.end_time), abs=2e-6
    )


def test_what_fails_stands_out(tab: Any, tmp_path: Path) -> None:
    plan = kw.plan(FAILING / "velocity_limit_broken.yaml")
    assert not plan.report.ok
    open_page(tab, view_plan(plan), tmp_path)
    assert tab.inner_text(".verdict") == "FAILED"
    assert "velocity" in tab.inner_text(".label.miss")
    red, green, blue = np.moveaxis(picture(tab), 2, 0)
    assert ((red > 170) & (green < 60) & (blue < 60)).sum() > 500


def test_a_missed_waypoint_says_by_how_much(tab: Any, tmp_path: Path) -> None:
    plan = kw.plan("ur5_deburring", planner="parabolic-blend")
    miss = next(
        item for item in plan.report.requirements if item.quantity == "position" and not item.ok
    )
    open_page(tab, view_plan(plan), tmp_path)
    labels = tab.locator(".label.miss").all_inner_texts()
    assert any(
        text.startswith(f"{miss.waypoint}: off by {1000 * miss.error:.3g} mm") for text in labels
    )


def test_a_second_planner_is_a_second_arm(tab: Any, tmp_path: Path) -> None:
    page = kw.plan("planar2_closed_form").view(compare=["trapezoidal"])
    open_page(tab, page, tmp_path, "#t=1.2")
    said = tab.inner_text("#head .other")
    assert "trapezoidal" in said
    assert "FAILED" in said  # it stops where a speed is asked for
    both = picture(tab)
    tab.click("#shown summary")
    tab.uncheck("input[name='arm: trapezoidal']")
    assert changed(both, picture(tab)).sum() > 500
    tab.uncheck("input[name='ghosts']")
    tab.uncheck("input[name='labels']")
    assert not tab.locator(".label").first.is_visible()


def test_a_robot_without_shapes_is_drawn_as_lines(tab: Any, tmp_path: Path) -> None:
    urdf = FAILING / "arms" / "two_joints.urdf"
    robot = kw.load_robot(urdf).with_tool(kw.load_robot(urdf).tool_candidates[0])
    trajectory = kw.JointTrajectory.from_knots(
        robot.joint_names,
        [0, 1],
        np.outer([0, 0.5], np.ones(robot.dof)),
        np.zeros((2, robot.dof)),
        joint_units=robot.joint_units,
    )
    from knotwork.view.show import view_trajectory

    page = view_trajectory(robot, trajectory)
    assert any("lines" in warning for warning in page.warnings)
    open_page(tab, page, tmp_path)
    before = picture(tab)
    tab.evaluate(HIDE, ["arm"])
    assert changed(before, picture(tab)).sum() > 300
