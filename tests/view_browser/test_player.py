"""The player below a scene: its slider and its keys, in the scene's page and in the report."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from serving import NEXT_FRAME

import knotwork as kw
from plans import planned

FRAMES = 120


@pytest.fixture
def scene(tabs: Any, deburring: kw.Plan, tmp_path: Path) -> Any:
    """A scene's page, at rest at the start; nothing has the focus."""
    tab = tabs.scene("ur5_deburring player", deburring.view, tmp_path)
    tab.evaluate("document.activeElement.blur()")
    return tab


def click_slider(tab: Any, share: float) -> None:
    """Click the slider at a share of its width."""
    box = tab.locator("#scrub").bounding_box()
    tab.mouse.click(box["x"] + share * box["width"], box["y"] + box["height"] / 2)
    tab.evaluate(NEXT_FRAME)


def time_in(tab: Any) -> float:
    return float(tab.evaluate("knotwork.time()"))


def press(tab: Any, key: str) -> float:
    """Press a key; the time shown thereafter."""
    tab.keyboard.press(key)
    tab.evaluate(NEXT_FRAME)
    return time_in(tab)


def test_slider_covers_whole_motion_and_leaves_keys(scene: Any, deburring: kw.Plan) -> None:
    duration = deburring.trajectory.duration
    for share in (0.25, 0.98, 0.5):
        click_slider(scene, share)
        # the slider's knob takes a little of its width at both ends
        assert time_in(scene) == pytest.approx(share * duration, abs=0.03 * duration)
        assert f"{time_in(scene):.2f} s" in scene.inner_text("#clock")
        assert float(scene.input_value("#scrub")) == pytest.approx(time_in(scene), abs=1e-3)
    first = press(scene, "ArrowRight")
    assert press(scene, "ArrowRight") == pytest.approx(first + 1 / FRAMES, abs=1e-5)
    assert press(scene, "ArrowLeft") == pytest.approx(first, abs=1e-5)


def test_space_plays_and_pauses_while_the_slider_has_the_focus(scene: Any) -> None:
    slowly = 'rate.value = "0.1"; rate.dispatchEvent(new Event("change"));'  # far from the end
    scene.evaluate(f"() => {{ const rate = document.getElementById('rate'); {slowly} }}")
    click_slider(scene, 0.3)
    assert scene.evaluate("document.activeElement.id") == "scrub"
    before = time_in(scene)
    scene.keyboard.press(" ")
    scene.wait_for_function(f"knotwork.time() > {before} + 0.1")
    scene.keyboard.press(" ")
    paused = press(scene, "Shift")
    assert press(scene, "Shift") == paused


def test_keys_strip_joints_and_cameras(scene: Any, deburring: kw.Plan) -> None:
    """One page shows them all: each key and click does what its words say."""
    times = [waypoint.time for waypoint in deburring.scenario.waypoints]
    end = deburring.trajectory.end_time
    assert press(scene, "End") == pytest.approx(end, abs=1e-5)
    assert press(scene, "Home") == 0.0
    assert [press(scene, "n") for _ in times[1:]] == pytest.approx(times[1:], abs=0.01)
    assert press(scene, "p") == pytest.approx(times[-2], abs=0.01)
    assert not scene.locator("#keys").is_visible()
    press(scene, "?")
    assert "waypoint before, next" in scene.inner_text("#keys")
    press(scene, "Escape")
    assert not scene.locator(".dg.main").is_visible()  # Meshcat's own player

    scene.set_viewport_size({"width": 1200, "height": 700})
    box = scene.locator("#strip").bounding_box()
    scene.mouse.click(box["x"] + box["width"] / 2, box["y"] + 20)
    assert press(scene, "Shift") == pytest.approx(0.5 * end, abs=0.02)
    assert "mm/s" in scene.inner_text("#tip")
    assert "% of a limit" in scene.inner_text("#tip")
    (segment,) = (one for one in deburring.segments if one.start <= 0.5 * end < one.end)
    assert segment.name in scene.inner_text("#tip")
    scene.evaluate("document.getElementById('joints').open = true")
    time = press(scene, "Shift")
    shown = scene.locator("#joint-rows .value").all_inner_texts()
    expected = np.degrees(deburring.trajectory.position(time))
    assert [float(text.split()[0]) for text in shown] == pytest.approx(expected, abs=0.2)
    scene.evaluate("document.getElementById('joints').open = false")

    far = "viewer.camera.position.distanceTo(viewer.controls.target)"
    whole = scene.evaluate(far)
    press(scene, "w")
    assert scene.evaluate(far) < 0.95 * whole
    press(scene, "a")
    assert scene.evaluate(far) == pytest.approx(whole, rel=0.05)
    scene.evaluate("knotwork.loop(true)")
    scene.evaluate(f"knotwork.seek({end - 0.2})")
    scene.keyboard.press(" ")
    scene.wait_for_function("knotwork.time() < 1")  # it has begun again
    scene.keyboard.press(" ")


@pytest.mark.exhaustive
def test_a_curve_is_chosen_below_the_slider(tabs: Any, tmp_path: Path) -> None:
    tab = tabs.scene("wall", planned("ur5_wall").view, tmp_path)
    tab.set_viewport_size({"width": 1200, "height": 700})
    assert tab.locator("#curve option").all_inner_texts() == ["tool speed", "clearance"]
    picture = "document.getElementById('strip').toDataURL()"
    tab.evaluate(NEXT_FRAME)
    before = tab.evaluate(picture)
    tab.select_option("#curve", "clearance")
    tab.evaluate(NEXT_FRAME)
    assert tab.evaluate(picture) != before
    box = tab.locator("#strip").bounding_box()
    tab.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 60)
    assert "limit: acceleration of 'elbow_joint'" in tab.inner_text("#tip")
    assert "above the lower bound" in tab.inner_text("#head")
    assert "1.01" in tab.inner_text("#head h1")
