"""Everything is in view at first, and what is seen at a time is the same however one came to it."""

from __future__ import annotations

import io
import json
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

import knotwork as kw
from drawn import numbers, scene
from shipped import QUICK
from sweeps import first_of

# Of all that is drawn, what lies outside of the pane, whose edges are at 1, and how far; the
# tip of an arrow may touch an edge
OUTSIDE = """() => {
  viewer.render();
  const root = viewer.scene_tree.find(["Knotwork"]).object;
  root.updateWorldMatrix(true, true);
  const found = [];
  root.traverseVisible((one) => {
    if (!one.isMesh) return;
    const { position } = one.geometry.attributes;
    let most = 0;
    for (let i = 0; i < position.count; i++) {
      const p = new MeshCat.THREE.Vector3().fromBufferAttribute(position, i);
      p.applyMatrix4(one.matrixWorld).project(viewer.camera);
      most = Math.max(most, Math.abs(p.x), Math.abs(p.y));
    }
    if (most > 1.02) found.push([one.parent?.name, position.count, most]);
  });
  return found;
}"""
SHOWN = [name for name in QUICK if not name.startswith("paper_case")]  # that has no robot


def is_ground(thing: dict[str, Any], size: float) -> bool:
    """Whether an object, such as a bench or a floor, is larger than arm and task together."""
    extent = np.ptp(numbers(thing["mesh"]["vertices"], "<f4"), axis=0).max()
    return thing["name"] == "objects" and bool(extent > size)


@pytest.mark.exhaustive
@pytest.mark.parametrize("name", SHOWN)
def test_all_of_a_shipped_scenario_is_in_view(name: str, tabs: Any, tmp_path: Path) -> None:
    plan = kw.plan(name)
    page = plan.view()
    data = scene(page)
    robot = plan.joints.robot
    known = data["first_joint"] + robot.model.njoints  # joints of what moves by itself
    data["meshes"] = [
        one
        for one in data["meshes"]
        if not is_ground(one, data["size"]) and one.get("carrier", 0) < known  # a belt leads out
    ]
    start, end = page.html.split('<script id="data" type="application/json">')
    rest = end[end.index("</script>") :]
    text = json.dumps(data).replace("<", "\\u003c")
    file = tmp_path / "scene.html"
    file.write_text(f'{start}<script id="data" type="application/json">{text}{rest}', "utf-8")
    tab = tabs.open(file.as_uri() + "#paused", size=(1280, 800))
    for width, height in ((1280, 800), (390, 844)):
        tab.set_viewport_size({"width": width, "height": height})
        tab.wait_for_function("width => innerWidth === width", arg=width)
        for share in (0.0, 0.6):
            tab.evaluate("share => knotwork.seek(share * knotwork.duration())", share)
            assert not tab.evaluate(OUTSIDE), (width, share)


TASK = {
    "robot": "planar2",
    "tool": {"holds": {"block": {"from": "take", "to": "leave", "box": [0.25, 0.25, 0.25]}}},
    "scene": {
        "objects": {
            "shelf": {"box": [0.4, 0.4, 0.1], "position": [0, -1.2, 0]},
            "floor": {"half_space": {"normal": [0, 0, 1]}, "position": [0, 0, -0.5]},
        }
    },
    "waypoints": [
        {"name": "start", "joints": {"shoulder": 0.9, "elbow": 0.6}},
        {"name": "take", "joints": {"shoulder": -0.4, "elbow": 0.9}, "after": 1, "stop": True},
        {"name": "leave", "joints": {"shoulder": 0.4, "elbow": -1.1}, "after": 1, "stop": True},
        {"name": "end", "joints": {"shoulder": -0.7, "elbow": -0.3}, "after": 1},
    ],
}
FRAMES = """new Promise((done) => {
  let left = 4;
  const next = () => (left-- ? requestAnimationFrame(next) : done());
  next();
})"""

# Before the block is taken, while it is held, and after.
SEEKS = [("Home", 0.15), ("End", 0.5), ("Home", 0.5), ("End", 0.85)]

# Pixels: an address has the time to a microsecond.
ROUNDED = 8


def pixels(tab: Any) -> NDArray[np.int64]:
    """The window as the screen has it, the pointer out of the way: `capture_image` would draw."""
    tab.mouse.move(2, 2)
    tab.evaluate("document.activeElement.blur()")
    tab.evaluate(FRAMES)
    image = Image.open(io.BytesIO(tab.screenshot())).convert("RGB")
    return np.asarray(image).astype(np.int64)


@pytest.fixture
def address(tmp_path: Path) -> str:
    return kw.plan(TASK).view().save(tmp_path / "block.html").as_uri()


def differ(one: NDArray[np.int64], other: NDArray[np.int64]) -> int:
    """How many pixels differ to the eye."""
    return int((np.abs(one - other).max(axis=2) > 12).sum())


@pytest.mark.parametrize("count", first_of(2, 4))
def test_paused_scene_shows_time_from_either_side(count: int, tabs: Any, address: str) -> None:
    """Against pages opened at that time."""
    opened: dict[float, NDArray[np.int64]] = {}
    tab = tabs.open(f"{address}#paused", size=(800, 600))
    for first, share in SEEKS[:count]:
        tab.keyboard.press(first)
        pixels(tab)
        box = tab.locator("#strip").bounding_box()
        tab.mouse.click(box["x"] + share * box["width"], box["y"] + 20)
        shown, time = pixels(tab), tab.evaluate("knotwork.time()")
        if time not in opened:
            fresh = tabs.open(f"{address}#t={time:.6f}", size=(800, 600))
            assert fresh.evaluate("knotwork.time()") == pytest.approx(time, abs=1e-5)
            opened[time] = pixels(fresh)
            fresh.close()
        assert differ(shown, opened[time]) <= ROUNDED, (first, share)
    assert min(differ(*two) for two in pairwise(opened.values())) > 1000
