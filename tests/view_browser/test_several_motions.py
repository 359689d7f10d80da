"""Two motions side by side, the map of a study, and the video of a motion."""

from __future__ import annotations

import base64
import urllib.error
import urllib.request
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from serving import READY, needs_signals, serve

import knotwork as kw
from drawn import scene
from knotwork.view import view_trajectory
from plans import planned
from shipped import SCENARIO_FILES


def hurried(folder: Path) -> Path:
    """The shipped task of the planar arm in too little time."""
    source = SCENARIO_FILES["planar2_closed_form"]
    task = kw.Task.load(source)
    first, second, *others = task.waypoints
    waypoints = [first, second.replace(after=0.3), *others]
    return task.replace(name="hurried", waypoints=waypoints).save(folder / "hurried.yaml")


@pytest.mark.exhaustive
def test_motions_share_one_clock(tabs: Any, knotwork: Any, tmp_path: Path, barriers: Any) -> None:
    other = hurried(tmp_path)
    page = tmp_path / "both.html"
    ran = knotwork("view", "planar2_closed_form", "--beside", other, "--html", page)
    assert (ran.code, ran.err) == (0, ""), ran.err
    tab = tabs.open(page.as_uri() + "#t=0.9")
    assert tab.evaluate("clock.time") == 0.9
    names = ["planar2_closed_form passed 3.6 s", "hurried FAILED 2.4 s"]
    assert tab.locator("h1").all_inner_texts() == names
    plans = [planned("planar2_closed_form"), kw.plan(other)]
    first, second = plans
    robot, at = first.joints.robot, 0.5 * first.trajectory.duration
    tab.evaluate("at => seek(at)", at)
    for inner in tab.frames[1:]:
        inner.wait_for_function("at => Math.abs(knotwork.time() - at) < 0.01", arg=at)
    tools = [robot.forward(plan.trajectory.position(at)).translation for plan in plans]
    share = at / first.trajectory.duration  # the longer one
    value = "share => data.curves[0].value[Math.round(share * (data.time.length - 1))]"
    shown = tab.evaluate(value, share)
    assert shown == pytest.approx(np.linalg.norm(tools[0] - tools[1]), rel=0.02)
    assert "distance of the tools" in tab.inner_text("#values")
    # a colour is one speed on both sides, and the time line has what fails in each
    ends = [inner.locator("#legend .ends").all_text_contents() for inner in tab.frames[1:]]
    assert ends[0] == ends[1]
    failing = [scene(plan.view())["strip"]["exceeded"] for plan in plans]
    assert not failing[0]
    assert "fails, below: hurried" in tab.inner_text("#values")
    red = """[...document.querySelectorAll("#curves rect")].map((one) =>
      ["x", "y", "width"].map((name) => Number(one.getAttribute(name))))"""
    whole = first.trajectory.duration
    spans = [[start / whole, 1.0, (end - start) / whole] for start, end in failing[1]]
    assert np.array(tab.evaluate(red)) == pytest.approx(np.array(spans))
    assert (
        tab.evaluate("getComputedStyle(document.querySelector('#curves rect')).fill")
        == "rgb(165, 13, 20)"
    )
    # one camera: a turn in one scene turns both, which are of one size
    one, other_scene = tab.frames[1:]
    place = "viewer.camera.position.toArray()"
    before = one.evaluate(place)
    assert other_scene.evaluate(place) == pytest.approx(before)
    tab.locator("iframe").nth(1).focus()
    other_scene.locator("body").press("Shift+ArrowRight")
    assert other_scene.evaluate(place) != pytest.approx(before)
    assert one.evaluate(place) == pytest.approx(other_scene.evaluate(place))
    # why the second fails is in its head, and a click goes there
    assert not tab.locator("section").nth(0).locator(".failures").count()
    tab.locator("section").nth(1).locator(".failures button").first.click()
    miss = second.report.failures[0]
    assert tab.evaluate("clock.time") == pytest.approx(miss.time - second.trajectory.start_time)
    # in a small pane of a phone one label leaves the arm in view
    tab.set_viewport_size({"width": 390, "height": 844})
    tab.evaluate("at => seek(at)", 0.1)
    labels = "[...document.querySelectorAll('.label.miss')]"
    seen = f"{labels}.filter((one) => one.style.visibility === 'visible').length"
    other_scene.wait_for_function(f"innerWidth < 390 && {seen} === 1")
    assert not barriers(tab)


@needs_signals
@pytest.mark.exhaustive
def test_a_click_on_the_map_shows_a_motion_or_why_there_is_none(tabs: Any, tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    vary = {"waypoints[1].pose.position[0]": [0.16, 9.0], "rate": [100, 200]}
    study = kw.sweep("planar2_closed_form", vary, out=tmp_path / "study", workers=0)
    refused = study["verdict"].index("refused")
    shown = study["verdict"].index("passed")
    with serve("view", tmp_path / "study", "--no-open") as serving:
        try:
            # nothing is blank before a click
            tab = tabs.open(serving.address, "#row:text('row 0:')", online=True)
            for row in (shown, refused):
                x, y = tab.evaluate("row => layout().place(row)", row)
                tab.locator("#map").click(position={"x": x, "y": y})
                tab.wait_for_selector(f"#row:text('row {row}:')")
                if row == shown:
                    tab.frame_locator("#motion").locator(READY).wait_for(state="attached")
            assert tab.inner_text("#why") == study["message"][refused]
            assert not tab.locator("#motion").is_visible()
            for query in ("row=99", "row=-1", "row=../etc", ""):
                with pytest.raises(urllib.error.HTTPError):
                    urllib.request.urlopen(f"{serving.address}motion?{query}")
        finally:
            tab.context.close()
    assert not serving.err
    tabs.complaints.clear()  # of the frame that was left


@pytest.mark.exhaustive
def test_map_in_one_file_names_command(tabs: Any, knotwork: Any, tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    vary = {"waypoints[1].pose.position[0]": [0.16, 9.0], "waypoints[1].after": [1.5, 1.9]}
    folder, page = tmp_path / "study", tmp_path / "map.html"
    study = kw.sweep("planar2_closed_form", vary, out=folder, workers=0)
    moving = [i for i, one in enumerate(study["verdict"]) if one in ("passed", "failed")]
    refused = study["verdict"].index("refused")
    command = f"knotwork view {folder}"
    assert f"{command} shows the motions" in knotwork("view", folder, "-o", page).out
    tab = tabs.new()
    tab.goto(page.as_uri())
    tab.evaluate("choose", moving[0])
    assert tab.inner_text("#row").endswith(f"its motion is shown by: {command}")
    assert f"{study['clearance'][moving[0]]:.4g}" in tab.inner_text("#figures")
    assert not tab.locator("#motion").is_visible()
    tab.evaluate("choose", refused)
    assert tab.inner_text("#why") == study["message"][refused]


LAST_TIME = """data => new Promise(done => {
  const video = document.createElement("video");
  video.onseeked = () => done(video.currentTime);
  video.onloadedmetadata = () => { video.currentTime = 1e6; };
  video.src = `data:video/webm;base64,${data}`;
})"""


@pytest.mark.exhaustive
def test_the_motion_is_recorded_as_a_video(tabs: Any, tmp_path: Path) -> None:
    motion = planned("planar2_closed_form").trajectory
    page = view_trajectory(kw.load_robot("planar2"), motion).save(tmp_path / "arm.html")
    tab = tabs.open(page.as_uri() + "#paused", accept_downloads=True)
    tab.select_option("#rate", "2")
    tab.click("#shown summary")
    with tab.expect_download() as found:
        tab.click("#video")
    video = Path(found.value.path()).read_bytes()
    assert video[:4] == b"\x1a\x45\xdf\xa3"  # Matroska, of which WebM is a part
    lasts = tab.evaluate(LAST_TIME, base64.b64encode(video).decode())
    assert lasts > motion.duration / 2
    assert tab.evaluate("knotwork.time()") == pytest.approx(motion.duration, abs=1e-3)
