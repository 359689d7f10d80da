"""What is seen at a time is the same, however the page came to it."""

from __future__ import annotations

import io
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

import knotwork as kw
from sweeps import first_of

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
READY = "document.documentElement.dataset.ready === 'true'"
FRAMES = """new Promise((done) => {
  let left = 4;
  const next = () => (left-- ? requestAnimationFrame(next) : done());
  next();
})"""

# Before the block is taken, while it is held, and after.
SEEKS = [("Home", 0.15), ("End", 0.5), ("Home", 0.5), ("End", 0.85)]

# Pixels: an address has the time to a microsecond.
ROUNDED = 8


class Scene:
    """A page whose pixels are looked at as the screen has them: `capture_image` would draw."""

    def __init__(self, tabs: Any, address: str, at: str = "paused", **options: Any) -> None:
        self.tab = tabs.new(**options)
        self.tab.set_viewport_size({"width": 800, "height": 600})
        self.tab.goto(f"{address}#{at}")
        self.tab.wait_for_function(READY)

    @property
    def time(self) -> float:
        return float(self.tab.evaluate("knotwork.time()"))

    def pixels(self) -> NDArray[np.int64]:
        """The window, the pointer out of the way."""
        self.tab.mouse.move(2, 2)
        self.tab.evaluate("document.activeElement.blur()")
        self.tab.evaluate(FRAMES)
        image = Image.open(io.BytesIO(self.tab.screenshot())).convert("RGB")
        return np.asarray(image).astype(np.int64)

    def click(self, share: float) -> None:
        """Click the strip at a share of its width."""
        box = self.tab.locator("#strip").bounding_box()
        self.tab.mouse.click(box["x"] + share * box["width"], box["y"] + 20)

    def key(self, name: str) -> None:
        self.tab.keyboard.press(name)


@pytest.fixture
def address(tmp_path: Path) -> str:
    return kw.plan(TASK).view().save(tmp_path / "block.html").as_uri()


def differ(one: NDArray[np.int64], other: NDArray[np.int64]) -> int:
    """How many pixels differ to the eye."""
    return int((np.abs(one - other).max(axis=2) > 12).sum())


@pytest.mark.parametrize("count", first_of(2, 4))
def test_a_paused_scene_shows_the_time_sought_from_either_side(
    count: int, tabs: Any, address: str
) -> None:
    """Against pages opened at that time."""
    opened: dict[float, NDArray[np.int64]] = {}

    def afresh(time: float) -> NDArray[np.int64]:
        if time not in opened:
            fresh = Scene(tabs, address, f"t={time:.6f}")
            assert fresh.time == pytest.approx(time, abs=1e-5)
            opened[time] = fresh.pixels()
            fresh.tab.close()
        return opened[time]

    scene = Scene(tabs, address)
    for first, share in SEEKS[:count]:
        scene.key(first)
        scene.pixels()
        scene.click(share)
        assert differ(scene.pixels(), afresh(scene.time)) <= ROUNDED, (first, share)
    assert min(differ(*two) for two in pairwise(opened.values())) > 1000
