"""`knotwork edit` by clicks and keys in a browser, and what its server refuses."""

from __future__ import annotations

import json
from collections.abc import Iterator
from http.client import HTTPConnection
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
from serving import needs_signals, serve

import knotwork as kw
from patience import PATIENCE
from shipped import SCENARIO_FILES

pytestmark = needs_signals

# Where an arrow of the gizmo has its tip on the page
TIP = """(axis) => {
  const { tool } = knotwork.edit.gizmo;
  const tip = new MeshCat.THREE.Vector3(...axis).multiplyScalar(0.95 * tool.scale.x);
  const at = tip.applyQuaternion(tool.quaternion).add(tool.position);
  const p = new MeshCat.THREE.Vector3(at.x, at.z, -at.y).project(viewer.camera);
  const pane = document.getElementById("scene").getBoundingClientRect();
  return [pane.left + (p.x + 1) / 2 * pane.width, pane.top + (1 - p.y) / 2 * pane.height];
}"""


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory, all_tabs: Any) -> Iterator[tuple[str, Path]]:
    """Address of the page of a task, and its file; its tab is closed before the server stops."""
    file = tmp_path_factory.mktemp("edit") / "task.yaml"
    source = SCENARIO_FILES["ur5_deburring"]
    text = source.read_text(encoding="utf-8")
    file.write_text(text.replace("[-40, 0, 30]", "[-40, 0, -60]"), encoding="utf-8")
    with serve("edit", file, "--no-open") as serving:
        serving.process.stdout.readline()  # the first plan is made
        yield serving.address, file
        if "edit" in all_tabs.opened:
            all_tabs.opened.pop("edit").close()


def post(address: str, action: str, body: Any, **headers: str) -> tuple[int, Any]:
    """What the server answers to a request, its token and headers as given."""
    parts = urlsplit(address)
    client = HTTPConnection(parts.netloc, timeout=PATIENCE)
    given = {"Host": parts.netloc, "Content-Type": "application/json"} | headers
    content = body if isinstance(body, bytes) else json.dumps(body).encode()
    client.request("POST", f"/{action}?{parts.query}", content, given)
    answer = client.getresponse()
    text = answer.read()
    client.close()
    return answer.status, json.loads(text) if answer.status == 200 else text


def test_strangers_are_refused(served: tuple[str, Path]) -> None:
    address, _ = served
    parts = urlsplit(address)
    undo = (address, "undo", {})
    for query in ("", "token=", "token=wrong", f"{parts.query}x", "token=%C3%A9"):
        assert post(parts._replace(query=query).geturl(), "undo", {})[0] == 403
        for path in ("/", "/scene", "/changes"):
            client = HTTPConnection(parts.netloc)
            client.request("GET", f"{path}?{query}")
            assert client.getresponse().status == 403
            client.close()
    assert post(*undo, Host="evil.example")[0] == 421
    assert post(*undo, Origin="http://evil.example")[0] == 403
    assert post(*undo, **{"Content-Type": "text/plain"})[0] == 415
    assert post(address, "open", {})[0] == 404
    assert post(address, "edit", {}, **{"Content-Length": "1000001"})[0] == 413
    assert post(*undo, Origin=f"http://{parts.netloc}")[0] == 200


@pytest.mark.parametrize(
    ("action", "body", "words"),
    [
        ("edit", b"[1]", "invalid request"),
        ("edit", b"{", "invalid request"),
        ("edit", b'{"changes": [{"at": ["rate"], "value": NaN}]}', "not a JSON number"),
        ("edit", {}, "needs changes"),
        ("edit", {"changes": [{"at": "rate"}]}, "list of keys"),
        ("edit", {"changes": [{"at": ["waypoints", 99, "time"], "value": 1}]}, "waypoints[99]"),
        ("move", {"at": ["waypoints", 0, "pose"], "name": "approach"}, "the task has changed"),
        ("jog", {"q": [0, 0]}, "shape"),
        ("jog", {"time": 0, "position": [9, 9, 9], "quaternion": [0, 0, 0, 1]}, "reach"),
    ],
)
def test_wrong_requests_change_nothing(
    action: str, body: Any, words: str, served: tuple[str, Path], tab: Any
) -> None:
    status, answer = post(served[0], action, body)
    assert status == 200
    assert words in answer["error"]


@pytest.fixture
def tab(served: tuple[str, Path], tabs: Any) -> Any:
    """The page, opened once, with the motion of what was edited last."""
    if "edit" not in tabs.opened:
        tabs.opened["edit"] = tabs.open(f"{served[0]}#paused", size=(1000, 640), online=True)
    known(tabs.opened["edit"])
    return tabs.opened["edit"]


def known(tab: Any) -> None:
    """Wait for the motion of what was edited last."""
    tab.wait_for_function("knotwork.edit.known")


def test_waypoint_is_dragged_out_of_collision_and_saved(served: tuple[str, Path], tab: Any) -> None:
    file = served[1]
    before = file.read_text(encoding="utf-8")
    assert tab.inner_text("#head .verdict") == "FAILED"
    tab.locator(".label.waypoint", has_text="approach").click()
    assert tab.input_value("#part") == '["waypoints",0]'
    assert tab.evaluate("knotwork.time()") == pytest.approx(3, abs=0.02)  # the arm goes there
    row = tab.locator("#rows .row", has=tab.locator("[aria-label='pose.position 1']"))
    assert row.locator(".key").inner_text().split() == ["position", "mm"]
    for _ in range(4):
        revision = tab.evaluate("knotwork.edit.draft.revision")
        x, y = tab.evaluate(TIP, [0, 0, 1])
        tab.mouse.move(x, y)
        tab.mouse.down()
        tab.mouse.move(x, y - 30, steps=4)
        tab.mouse.up()
        edited = "knotwork.edit.draft.revision === Math.max(knotwork.edit.sent, {})"
        tab.wait_for_function(edited.format(revision + 1))
        known(tab)
        if tab.inner_text("#head .verdict") == "passed":
            break
    assert tab.inner_text("#head .verdict") == "passed"
    assert tab.inner_text("#edit-state") == "unsaved"
    assert file.read_text(encoding="utf-8") == before
    tab.click("#save")
    tab.wait_for_selector("#edit-state:text-is('saved')")
    text = file.read_text(encoding="utf-8")
    assert kw.plan(file).report.ok
    changed = [
        pair
        for pair in zip(before.split("\n"), text.split("\n"), strict=True)
        if len(set(pair)) > 1
    ]
    assert [old for old, _ in changed] == [
        "    pose: {position: [-40, 0, -60], rpy: [-135, 0, 180]}"
    ]
    tab.keyboard.press("Control+z")
    tab.wait_for_function("knotwork.edit.draft.unsaved")
    tab.keyboard.press("Control+Shift+z")
    tab.wait_for_selector("#edit-state:text-is('saved')")


def test_a_wrong_number_is_shown_over_the_last_good_motion(tab: Any) -> None:
    verdict = tab.inner_text("#head .verdict")
    tab.select_option("#part", '["waypoints",0]')
    tab.fill("#rows [aria-label=time]", "-3")
    tab.wait_for_selector("#live.wrong:text('waypoints[0].time')")
    tab.wait_for_selector("#edit-state.wrong:text('not planned')")
    assert tab.locator("body.outdated").count() == 1
    assert tab.inner_text("#head .verdict") == verdict
    # what was shown for a text of other waypoints can't be taken hold of
    tab.select_option("#part", '["waypoints",1]')
    tab.click("#remove")
    tab.wait_for_function("knotwork.edit.gizmo.handles.length === 0")
    tab.locator(".label.waypoint", has_text="edge end").dispatch_event("click")
    assert not tab.evaluate("knotwork.edit.gizmo.tool.visible")
    tab.click("#undo")
    tab.wait_for_function("knotwork.edit.gizmo.handles.length > 0")
    tab.select_option("#part", '["waypoints",0]')
    tab.click("#undo")
    known(tab)
    assert tab.input_value("#rows [aria-label=time]") == "3"
    assert not tab.locator("#live").is_visible()


def test_what_is_no_number_is_refused_and_numbers_are_read_whole(tab: Any) -> None:
    tab.select_option("#part", '["waypoints",0]')
    field = tab.locator("#rows [aria-label='pose.position 1']")
    before, given = tab.evaluate("knotwork.edit.draft.revision"), field.input_value()
    for wrong, words in (("0.2,5", "'0.2,5' is no number"), ("", "nothing is typed")):
        field.fill(wrong)
        field.press("Tab")
        tab.wait_for_selector(f"#edit-error:text(\"{words}\"):text('keeps {given}')")
    assert tab.evaluate("knotwork.edit.sent") == before
    field.fill(given)
    field.press("Tab")
    assert not tab.locator("#edit-error").is_visible()
    assert tab.evaluate("knotwork.edit.draft.revision") == before


@pytest.mark.exhaustive
def test_waypoint_is_added_at_jogged_arm_and_removed(served: tuple[str, Path], tab: Any) -> None:
    count = len(kw.Task.load(served[1]).waypoints)
    tab.evaluate("knotwork.seek(1.5)")
    shown = "document.getElementById('add-where').textContent.endsWith(\"1.50 s, after 'start'\")"
    tab.wait_for_function(shown)
    tab.select_option("#part", '["waypoints",3]')
    chosen = tab.locator("#part option:checked").inner_text()
    tab.click("#jog summary")
    assert tab.inner_text("#jog-where") == f"a waypoint here comes after '{chosen}'"
    tab.wait_for_function("knotwork.edit.jog.handle")
    tab.locator("#sliders input").first.evaluate(
        "it => { it.value = 10; it.dispatchEvent(new Event('input')); }"
    )
    tab.click("#jog-joints")
    tab.wait_for_function(f"knotwork.edit.draft.data.waypoints.length === {count + 1}")
    known(tab)
    added = tab.evaluate("knotwork.edit.draft.data.waypoints[4]")
    assert added["joints"]["shoulder_pan_joint"] == pytest.approx(10, abs=0.01)
    tab.click("#jog summary")
    tab.select_option("#part", '["waypoints",4]')
    tab.click("#remove")
    tab.wait_for_function(f"knotwork.edit.draft.data.waypoints.length === {count}")
    known(tab)
    assert tab.input_value("#part") == "null"  # so that another click removes nothing
    assert not tab.locator("#remove").is_visible()
    assert not tab.locator("#rows .row").count()


def test_nothing_hinders_people_who_edit(tab: Any, barriers: Any) -> None:
    assert not barriers(tab)
