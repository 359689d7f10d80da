"""`knotwork view --watch`: the open page follows the file that is written."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import pytest
from serving import needs_signals, serve

import knotwork as kw

STATE = "[knotwork.time(), ...viewer.camera.position.toArray()]"
# What is on the graphics card, and which objects are the arm's
HELD = """() => {
  viewer.render();
  const arm = viewer.scene_tree.find(["Knotwork", "arm"]).object;
  return [viewer.renderer.info.memory.geometries, arm.uuid];
}"""

ANOTHER_ROBOT = """
description: Another robot
robot: z1
scene: {objects: {sign: {mesh: sign.stl, visual: true, position: [3, 0, 0]}}}
waypoints: [{joints: home}, {joints: home, after: 1}]
"""
SIGN = "solid a\nfacet normal 0 0 0\nouter loop\n{}endloop\nendfacet\nendsolid a\n".format(
    "vertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
)
# The command, with a check that has a fault.
FAULTY = """
import sys
from knotwork.cli.main import main
from knotwork.verification import CHECKS

def faulty(motion, scenario, space):
    if "fault" in scenario.given.description:
        raise ZeroDivisionError("boom")
    return ()

CHECKS["faulty"] = faulty
sys.argv[0] = "knotwork"
main()
"""


def save(file: Path, text: str) -> None:
    """Put a file in its place in one step, as editors do: it is never seen half written."""
    written = file.with_name("new")
    written.write_text(text, encoding="utf-8")
    written.replace(file)


@needs_signals
def test_the_page_follows_each_save_and_keeps_the_last_good_motion(
    tabs: Any, tmp_path: Path
) -> None:
    task = tmp_path / "task.yaml"
    source = kw.load_scenario("planar2_closed_form").source
    assert source is not None
    good = source.read_text(encoding="utf-8")
    task.write_text("waypoints: 5\n", encoding="utf-8")
    arguments = ("view", "task.yaml", "--watch", "--no-open")
    with serve(*arguments, program=("-c", FAULTY), folder=tmp_path) as serving:
        try:
            tab = tabs.new()
            tab.context.set_offline(False)
            tab.goto(f"{serving.address}#paused")
            tab.wait_for_selector(
                "#live.wrong:text('waypoints'):text('mended in the file')"
            )  # at first
            save(task, good)
            tab.wait_for_selector("html[data-ready=true]", state="attached")
            tab.evaluate("viewer.camera.position.x += 0.5; viewer.controls.update()")
            tab.evaluate("knotwork.seek(0.8)")
            seen, held = tab.evaluate(STATE), tab.evaluate(HELD)

            save(task, good.replace("waypoints:", "way:"))
            tab.wait_for_selector("#live.wrong:text('way')")
            assert tab.locator("#live").bounding_box()["width"] > 0.9 * 640
            assert tab.locator("body.outdated").count() == 1
            said = tab.locator("#head .verdict").evaluate(
                "it => getComputedStyle(it, '::after').content"
            )
            assert said == '" before"'
            save(task, good.replace("description:", "description: Changed!"))
            words = "#head .description:text('Changed!')"  # in a low window they are not seen
            tab.wait_for_selector(words, state="attached")
            assert not tab.locator("#live").is_visible()
            assert tab.evaluate(STATE) == pytest.approx(seen, abs=1e-6)
            assert tab.inner_text("#head .verdict") == "passed"
            tab.emulate_media(color_scheme="dark")
            for words in ("Again!", "Once more!"):
                save(task, good.replace("description:", f"description: {words}"))
                tab.wait_for_selector(f"#head .description:text('{words}')", state="attached")
                tab.wait_for_function("viewer.needs_render === false")
            assert tab.evaluate(HELD) == held

            save(task, good.replace("description:", "description: fault"))
            tab.wait_for_selector("#live.wrong:text('ZeroDivisionError: boom')")
            assert "Please report it" in tab.inner_text("#live")

            task.unlink()  # an editor may be about to put another in its place
            (tmp_path / "sign.stl").write_text(SIGN, encoding="utf-8")
            time.sleep(0.3)
            save(task, ANOTHER_ROBOT)
            tab.wait_for_selector("#head .description:text('Another')", state="attached")
            assert tab.locator("#joint-rows > div").count() == 6

            save(tmp_path / "sign.stl", "no mesh")
            tab.wait_for_selector("#live.wrong:text('sign.stl')")
        finally:
            serving.stop()
        tab.wait_for_selector("#live:text('stopped')")
        tabs.complaints.clear()  # of the connection that has ended
        tab.context.close()
    out, err = serving.out, serving.err
    assert out.count(" passed: ") == 5
    assert err.count(" error: ") == 4  # one of them of our own
    assert err.count("ZeroDivisionError: boom") == 1
