"""`knotwork view --watch`: the open page follows the file that is written."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import knotwork as kw
from knotwork.cli import watching
from knotwork.cli.view import _named_in
from knotwork.cli.watching import Files
from knotwork.view.live_server import LiveServer

STATE = "[knotwork.time(), ...viewer.camera.position.toArray()]"


FETCHED = "performance.getEntriesByType('resource').map((one) => one.name.split('/').pop())"
ANOTHER_ROBOT = """
description: Another robot
robot: z1
waypoints: [{joints: home}, {joints: home, after: 1}]
"""


@pytest.mark.skipif(sys.platform == "win32", reason="Ctrl-C is sent as a signal")
def test_the_page_follows_each_save_and_keeps_the_last_good_motion(
    tabs: Any, tmp_path: Path
) -> None:
    task = tmp_path / "task.yaml"
    source = kw.load_scenario("planar2_closed_form").source
    assert source is not None
    good = source.read_text(encoding="utf-8")
    task.write_text("waypoints: 5\n", encoding="utf-8")
    command = [sys.executable, "-u", "-m", "knotwork", "view", "task.yaml", "--watch", "--no-open"]
    with subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=tmp_path,
        env=dict(os.environ),
    ) as process:
        assert process.stdout is not None
        try:
            address = process.stdout.readline().split(" at ")[1].split()[0]
            tab = tabs.new()
            tab.context.set_offline(False)
            tab.goto(f"{address}#paused")
            tab.wait_for_selector("#live.wrong:text('waypoints')")  # wrong before there is a motion
            task.write_text(good, encoding="utf-8")
            tab.wait_for_selector("html[data-ready=true]", state="attached")
            tab.evaluate("viewer.camera.position.x += 0.5; viewer.controls.update()")
            tab.evaluate("knotwork.seek(0.8)")
            seen = tab.evaluate(STATE)

            task.write_text(good.replace("waypoints:", "way:"), encoding="utf-8")
            tab.wait_for_selector("#live.wrong:text('way')")
            assert tab.locator("body.outdated").count() == 1
            changed = tmp_path / "new.yaml"  # as editors save
            changed.write_text(good.replace("description:", "description: Changed!"), "utf-8")
            changed.replace(task)
            words = "#head .description:text('Changed!')"  # in a low window they are not seen
            tab.wait_for_selector(words, state="attached")
            assert not tab.locator("#live").is_visible()
            assert tab.evaluate(STATE) == pytest.approx(seen, abs=1e-6)
            assert tab.inner_text("#head .verdict") == "passed"
            assert "changing" in tab.evaluate(FETCHED)
            assert "still" not in tab.evaluate(FETCHED)  # the robot is the same

            task.write_text(ANOTHER_ROBOT, encoding="utf-8")
            tab.wait_for_selector("#head .description:text('Another')", state="attached")
            assert "still" in tab.evaluate(FETCHED)
            assert tab.locator("#joint-rows > div").count() == 6
        finally:
            process.send_signal(signal.SIGINT)
            out, err = process.communicate(timeout=60)
        tab.wait_for_selector("#live:text('stopped')")
        tabs.complaints.clear()  # of the connection that has ended
        tab.context.close()
    assert process.returncode == 0
    assert out.count(" passed: ") == 3
    assert err.count(" error: task.yaml") == 2


def test_files_changed_are_noticed_once(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_text("1", encoding="utf-8")
    files = Files([path])
    assert not files.changed()
    path.write_text("12", encoding="utf-8")
    assert files.changed()
    assert not files.changed()
    path.unlink()
    assert not files.changed()  # an editor may be about to put another in its place
    path.write_text("12", encoding="utf-8")
    assert files.changed()


def test_a_fault_of_our_own_is_shown_and_does_not_end_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delenv("KNOTWORK_TRACEBACK", raising=False)
    faults = [ZeroDivisionError("boom"), KeyboardInterrupt()]

    def made(_: int) -> Any:
        raise faults.pop(0)

    shown: list[str] = []
    monkeypatch.setattr(LiveServer, "refuse", lambda _, error: shown.append(error))
    monkeypatch.setattr(Files, "changed", lambda _: True)
    with LiveServer("task") as server:
        watching.follow(server, Files([]), made)
    assert not faults  # it went on after the first
    assert "ZeroDivisionError: boom" in shown[0]
    assert "Please report it" in shown[0]
    assert shown[0].splitlines()[0] in capsys.readouterr().err


def test_files_that_a_scenario_names_are_followed(tmp_path: Path) -> None:
    (tmp_path / "curve.csv").write_text("x,y,z\n", encoding="utf-8")
    data = {"waypoints": [{"along": {"points": "curve.csv"}}, {"joints": {"a": 1}}], "name": "a.b"}
    assert _named_in(data, tmp_path) == [tmp_path / "curve.csv"]
