"""`knotwork view` and `knotwork report` as a user runs them, and the server of their pages."""

from __future__ import annotations

import socket
import struct
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from http.client import HTTPConnection
from pathlib import Path
from typing import Any

import pytest
from serving import needs_signals, serve

from command_line import without_progress
from shipped import SCENARIO_FILES


def test_a_stored_trajectory_is_shown_with_its_scenario_or_robot(run: Any, tmp_path: Path) -> None:
    assert run("plan", "planar2_closed_form", "--out", "moved").code == 0
    for option in ((), ("-s", "planar2_closed_form"), ("--robot", "planar2")):
        ran = run("view", "moved", *option, "--html", "a.html")
        assert (ran.code, ran.out.strip()) == (0, "wrote a.html"), ran.err
        text = (tmp_path / "a.html").read_text(encoding="utf-8")
        for output in (ran.err, text):
            assert ("does not name its tool" in output) == ("--robot" in option)
        (tmp_path / "a.html").unlink()
    for options, words in (
        (("--robot", "ur5"), "shoulder_pan_joint"),
        (("-s", "ur5_deburring"), "lacks joint"),
        (("-s", "planar2_closed_form", "--planner", "cubic"), "planned already"),
    ):
        assert words in run("view", "moved", *options, "--html", "a.html").refused()
        assert not (tmp_path / "a.html").exists()


def test_joints_alone_are_plots_only(run: Any, tmp_path: Path) -> None:
    ran = run("report", "paper_case", "--html", "new/report.html")
    assert ran.code == 0
    assert "names no robot" in ran.err
    assert (tmp_path / "new" / "report.html").is_file()


def test_a_port_in_use_is_reported(run: Any) -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = str(other.getsockname()[1])
        ran = run("view", "planar2_closed_form", "--no-open", "--port", port)
    assert f"port {port} is in use" in ran.refused()


HOST = "127.0.0.1"


@pytest.fixture(scope="module")
def port() -> Iterator[int]:
    """Port of a page; whatever browsers do, only its end is printed."""
    with serve("view", "planar2_closed_form", "--no-open") as serving:
        yield int(serving.address.rsplit(":")[-1].strip("/"))
    assert serving.out == "stopped\n"
    assert not without_progress(serving.err)


def test_a_connection_that_breaks_off_is_passed_over(port: int) -> None:
    for _ in range(3):
        client = socket.create_connection((HOST, port))
        client.sendall(b"GET / HTTP/1.0\r\n\r\n")
        client.recv(10)
        # close with a reset, as a browser does that is closed in the middle of a page
        client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        client.close()
    with urllib.request.urlopen(f"http://{HOST}:{port}/") as answer:  # and it still answers
        assert b"</html>" in answer.read()[-20:]
    with pytest.raises(urllib.error.HTTPError, match="404") as refused:
        urllib.request.urlopen(f"http://{HOST}:{port}/etc/passwd")
    refused.value.close()


OWN_NAMES = ("127.0.0.1:{}", "localhost:{}", "LOCALHOST:8000", "[::1]:{}", "localhost")
FOREIGN_NAMES = (
    *("evil.example:{}", "evil.example", "127.0.0.1.evil.example:{}", ""),
    "localhost:{}.evil.example",
)


def test_only_its_own_names_are_answered(port: int) -> None:
    """A foreign page may give its own name this machine's address, and read the answer."""
    for host in (*OWN_NAMES, *FOREIGN_NAMES):
        client = HTTPConnection(HOST, port)
        client.request("GET", "/", headers={"Host": host.format(port)})
        answer = client.getresponse()
        assert answer.status == (200 if host in OWN_NAMES else 421), host
        assert (b"planar2_closed_form" in answer.read()) == (host in OWN_NAMES)
        assert int(answer.headers["Content-Length"]) > 0
        client.close()


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

def faulty(motion, scenario, joints):
    if "fault" in scenario.task.description:
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
def test_page_follows_saves_and_keeps_last_good_motion(tabs: Any, tmp_path: Path) -> None:
    task = tmp_path / "task.yaml"
    source = SCENARIO_FILES["planar2_closed_form"]
    good = source.read_text(encoding="utf-8")
    task.write_text("waypoints: 5\n", encoding="utf-8")
    arguments = ("view", "task.yaml", "--watch", "--no-open")
    with serve(*arguments, program=("-c", FAULTY), folder=tmp_path) as serving:
        try:
            wrong_at_first = "#live.wrong:text('waypoints'):text('mended in the file')"
            tab = tabs.open(f"{serving.address}#paused", wrong_at_first, online=True)
            assert tab.locator(wrong_at_first).is_visible()
            save(task, good)
            tab.wait_for_selector("html[data-ready=true]", state="attached")
            tab.evaluate("viewer.camera.position.x += 0.5; viewer.controls.update()")
            tab.evaluate("knotwork.seek(0.8)")
            seen, held = tab.evaluate(STATE), tab.evaluate(HELD)

            save(task, good.replace("waypoints:", "way:"))
            tab.wait_for_selector("#live.wrong:text('way')")
            assert tab.locator("#live").bounding_box()["width"] > 0.9 * 640
            assert tab.locator("body.outdated").count() == 1
            content = tab.locator("#head .verdict").evaluate(
                "it => getComputedStyle(it, '::after').content"
            )
            assert content == '" before"'
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
