"""All of every shipped scenario is in view at first: arm, path, waypoints, objects."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import knotwork as kw
from drawn import numbers, scene
from plans import arm
from shipped import QUICK

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
    robot = arm(plan)
    known = data["first_joint"] + robot.model.njoints  # joints of what moves by itself
    data["things"] = [
        one
        for one in data["things"]
        if not is_ground(one, data["size"]) and one.get("carrier", 0) < known  # a belt leads out
    ]
    tab = tabs.new()
    tab.set_viewport_size({"width": 1280, "height": 800})
    start, end = page.html.split('<script id="data" type="application/json">')
    rest = end[end.index("</script>") :]
    text = json.dumps(data).replace("<", "\\u003c")
    file = tmp_path / "scene.html"
    file.write_text(f'{start}<script id="data" type="application/json">{text}{rest}', "utf-8")
    tab.goto(file.as_uri() + "#paused")
    tab.wait_for_selector("html[data-ready=true]", state="attached")
    for width, height in ((1280, 800), (390, 844)):
        tab.set_viewport_size({"width": width, "height": height})
        tab.wait_for_function("width => innerWidth === width", arg=width)
        for share in (0.0, 0.6):
            tab.evaluate("share => knotwork.seek(share * knotwork.duration())", share)
            assert not tab.evaluate(OUTSIDE), (width, share)
