"""Scenes opened from disk in a real browser: what is seen, where, and how it moves."""

from __future__ import annotations

import base64
import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from serving import NEXT_FRAME

import knotwork as kw
from plans import planned
from sweeps import mostly_exhaustive
from walls import through_wall

HIDE = "(path) => viewer.set_property(['Knotwork', ...path], 'visible', false)"
Picture = NDArray[np.int64]


@pytest.fixture
def show(tabs: Any, tmp_path: Path) -> Any:
    """Open the scene of a scenario, planned by a planner."""

    def shown(scenario: str, planner: str | None = None) -> Any:
        name = f"{Path(scenario).stem} {planner}"
        return tabs.scene(name, lambda: planned(scenario, planner).view(), tmp_path)

    return shown


def resize(tab: Any, width: int, height: int) -> None:
    """Make the window another size; the scene has followed when this returns."""
    tab.set_viewport_size({"width": width, "height": height})
    tab.wait_for_function(
        """([width, height]) => {
          const canvas = document.querySelector("#scene canvas");
          return canvas.clientWidth === width && canvas.clientHeight === height;
        }""",
        arg=[width, height],
    )
    tab.evaluate(NEXT_FRAME)  # labels follow with it


def picture(tab: Any) -> Picture:
    """What the canvas shows, shape (height, width, 3)."""
    data = tab.evaluate("knotwork.picture()").partition(",")[2]
    image = Image.open(io.BytesIO(base64.b64decode(data))).convert("RGB")
    return np.asarray(image).astype(np.int64)


def changed(before: Picture, after: Picture) -> NDArray[np.bool_]:
    """Which pixels differ to the eye."""
    return np.asarray(np.abs(before - after).max(axis=2) > 12)


def is_red(shown: Picture) -> NDArray[np.bool_]:
    red, green, blue = np.moveaxis(shown, 2, 0)
    return np.asarray((red > 170) & (green < 60) & (blue < 60))


def tool_position(tab: Any, plan: kw.Plan) -> NDArray[np.float64]:
    """Where the page has the tool centre point, in the axes of the URDF's root [m]."""
    robot = plan.joints.robot
    x, y, z = tab.evaluate(
        """(tip) => {
          const data = JSON.parse(document.getElementById("data").textContent);
          const carrier = data.meshes.find((item) => item.name === "tool").carrier;
          const names = [];
          for (let joint = carrier; joint > 0; joint = data.joints[joint - 1].parent)
            names.unshift(data.joints[joint - 1].name);
          const object = viewer.scene_tree.find(["Knotwork", "arm", ...names]).object;
          object.updateWorldMatrix(true, false);
          const point = new MeshCat.THREE.Vector3(...tip);
          return object.localToWorld(point).toArray();
        }""",
        robot.model.frames[robot.tcp_frame_id].placement.translation.tolist(),
    )
    return np.array([x, -z, y])


def true_position(plan: kw.Plan, time: float) -> NDArray[np.float64]:
    robot = plan.joints.robot
    pose = robot.base_placement * robot.forward(plan.trajectory.position(time))
    return np.array(pose.translation)


def shown_labels(tab: Any) -> list[Any]:
    found: list[Any] = tab.evaluate(
        """() => [...document.querySelectorAll(".label")]
          .filter((label) => label.style.visibility === "visible")
          .map((label) => [label.textContent, label.getBoundingClientRect().toJSON()])"""
    )
    return found


@pytest.mark.parametrize(
    "name", mostly_exhaustive(("ur5_deburring", "panda_pick_place"), "ur5_deburring")
)
def test_the_first_look_shows_arm_path_and_labels(show: Any, name: str) -> None:
    tab, plan = show(name), planned(name)
    assert not tab.locator("#head .warnings").count()
    resize(tab, 900, 600)
    shown = shown_labels(tab)
    names = {waypoint.name for waypoint in plan.scenario.waypoints} | set(
        plan.scenario.frame_placements
    )
    texts = {text for text, _ in shown}
    objects = {thing.name for thing in plan.scenario.scene.objects}
    waypoints = {waypoint.name for waypoint in plan.scenario.waypoints}
    assert waypoints <= texts <= names | objects  # others wait until they are hovered
    for i, (_, box) in enumerate(shown):
        assert box["height"] >= 14
        assert 0 <= box["left"] < box["right"] <= 900
        assert 0 <= box["top"] < box["bottom"] <= 600
        for _, other in shown[:i]:
            beside = box["right"] <= other["left"] or other["right"] <= box["left"]
            assert beside or box["bottom"] <= other["top"] or other["bottom"] <= box["top"]

    resize(tab, 640, 400)
    with_path = picture(tab)
    assert with_path.std(axis=(0, 1)).max() > 10
    tab.evaluate(HIDE, ["path"])
    without_path = picture(tab)
    assert changed(with_path, without_path).sum() > 40
    tab.evaluate(HIDE, ["arm"])
    rows, _ = np.nonzero(changed(without_path, picture(tab)))
    assert np.ptp(rows) > 60


@pytest.mark.parametrize(
    ("scenario", "planner", "size"),
    [
        ("ur5_deburring", None, (900, 560)),
        pytest.param(
            "panda_pick_place", "parabolic-blend", (390, 700), marks=pytest.mark.exhaustive
        ),
    ],
)
def test_no_panel_covers_the_arm_at_first(
    show: Any, scenario: str, planner: str | None, size: tuple[int, int]
) -> None:
    tab = show(scenario, planner)
    resize(tab, *size)
    whole = picture(tab)
    tab.evaluate(HIDE, ["arm"])
    arm = changed(whole, picture(tab))
    assert 0.02 < arm.mean() < 0.6
    rows, columns = np.nonzero(arm)
    assert 0 < rows.min() < rows.max() < size[1] - 1
    assert 0 < columns.min() < columns.max() < size[0] - 1
    for panel in tab.locator(".panel").all():
        box = panel.bounding_box()
        if box is not None:
            left, top = max(int(box["x"]), 0), max(int(box["y"]), 0)
            part = arm[top : int(box["y"] + box["height"]), left : int(box["x"] + box["width"])]
            assert not part.any()


def test_the_motion_is_the_trajectory(show: Any) -> None:
    tab, plan = show("ur5_deburring"), planned("ur5_deburring")
    for time in (0.0, 2.5, 7.975, plan.trajectory.end_time):
        tab.evaluate("(time) => knotwork.seek(time)", time)
        assert tool_position(tab, plan) == pytest.approx(true_position(plan, time), abs=2e-6)
    # Between two frames, 120 a second, the one before is shown and none is made up.
    tab.evaluate("knotwork.seek(2.5 + 0.7 / 120)")
    assert tool_position(tab, plan) == pytest.approx(true_position(plan, 2.5), abs=2e-6)


# Whether a point is seen beside the panels
BESIDE_PANELS = """(at) => {
  const p = new MeshCat.THREE.Vector3(at[0], at[2], -at[1]).project(viewer.camera);
  const pane = document.getElementById("scene").getBoundingClientRect();
  const [x, y] = [pane.left + (p.x + 1) / 2 * pane.width, pane.top + (1 - p.y) / 2 * pane.height];
  const there = document.elementFromPoint(x, y);
  return there !== null && !there.closest(".panel");
}"""

# Labels of failures behind which rays from the camera meet the arm
LABELS_OVER_THE_ARM = """(() => {
  const { camera, scene_tree: tree } = viewer;
  const pane = document.getElementById("scene").getBoundingClientRect();
  const ray = new MeshCat.THREE.Raycaster();
  const arm = [];
  tree.find(["Knotwork", "arm"]).object.traverse((one) => { if (one.isMesh) arm.push(one); });
  const meets = (x, y) => {
    const at = [((x - pane.left) / pane.width) * 2 - 1, 1 - ((y - pane.top) / pane.height) * 2];
    ray.setFromCamera(new MeshCat.THREE.Vector2(...at), camera);
    return ray.intersectObjects(arm).length > 0;
  };
  const labels = [...document.querySelectorAll(".label.miss")]
    .filter((one) => one.style.visibility === "visible");
  if (!labels.length) return ["none is seen"];
  return labels.filter((label) => {
    const { left, top, width, height } = label.getBoundingClientRect();
    const over = (x) => [0, 0.5, 1].some((y) => meets(left + x * width, top + y * height));
    return [0, 0.25, 0.5, 0.75, 1].some(over);
  }).map((label) => label.textContent);
})()"""


def test_click_on_failure_goes_there_with_links_in_red(tabs: Any, tmp_path: Path) -> None:
    plan = through_wall()
    tab = tabs.scene("touching", plan.view, tmp_path)
    tab.evaluate("knotwork.pause()")
    tab.evaluate("knotwork.seek(0)")
    tab.evaluate(NEXT_FRAME)
    assert not tab.locator(".label.miss:visible").count()
    clean = picture(tab)
    button = tab.locator(".failures button").first
    button.click()
    tab.evaluate(NEXT_FRAME)
    time = float(button.get_attribute("data-at"))
    assert tab.evaluate("knotwork.time()") == pytest.approx(time, abs=2e-3)
    failed = plan.report.failures[0]
    assert time == pytest.approx(failed.shown_time)
    # its place is seen, beside all panels
    point = np.mean(failed.points, axis=0).tolist()
    for size in ((390, 844), (1280, 800)):
        resize(tab, *size)
        tab.evaluate("knotwork.look('whole arm')")
        button.click()
        tab.evaluate(NEXT_FRAME)
        assert tab.evaluate(BESIDE_PANELS, point), size
    resize(tab, 640, 400)
    tab.evaluate("knotwork.look('whole arm')")
    button.click()
    tab.evaluate(NEXT_FRAME)
    assert 1 <= tab.locator(".label.miss:visible").count() <= 3
    assert is_red(picture(tab)).sum() > 3 * is_red(clean).sum()
    tab.evaluate("knotwork.look('whole arm')")
    resize(tab, 1280, 800)
    assert not tab.evaluate(LABELS_OVER_THE_ARM)
    wall_drawn = """(() => {
      let found = null;
      const { object } = viewer.scene_tree.find(["Knotwork", "objects"]);
      object.traverse((one) => { if (one.isMesh) found = one.material; });
      return [found.opacity < 1, found.emissive.getHex() > 0];
    })()"""
    assert tab.evaluate(wall_drawn)[1]
    hides = []
    for side in (-1, 1):  # the wall lies between one of them and the contact
        tab.evaluate(f"viewer.camera.position.set(0.45, 0.25, {side}); viewer.set_dirty()")
        tab.evaluate(NEXT_FRAME)
        hides.append(tab.evaluate(wall_drawn)[0])
    assert any(hides)
    tab.evaluate("knotwork.seek(0)")
    tab.evaluate(NEXT_FRAME)
    assert tab.evaluate(wall_drawn) == [False, False]
