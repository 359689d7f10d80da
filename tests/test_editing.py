"""A task edited by hand: its text, its handles, and plans that are overtaken."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import knotwork as kw
from knotwork.errors import DocumentError, InputError
from knotwork.files.documents.resources import names
from knotwork.task.scenario.scenario_joints import read_scenario_joints
from knotwork.view.editing import session as sessions
from knotwork.view.editing.draft import Draft
from knotwork.view.editing.handles import handles, move_handle
from knotwork.view.editing.session import Session, draft_of, unplanned_scene
from shipped import SCENARIO_FILES
from sweeps import mostly_exhaustive
from texts import written

UNITS = {"m": 1.0, "mm": 1e-3, "rad": 1.0, "deg": np.pi / 180}

ARCS = ("ur10_weld", "kinova_dispense")
SHIPPED = (*ARCS, "panda_pick_place_fastest")


def draft_in(folder: Path, name: str = "ur5_deburring") -> Draft:
    return draft_of(SCENARIO_FILES[name], folder / "task.yaml")


def session_in(folder: Path, name: str = "ur5_deburring") -> Session:
    """A task that is edited, and no page of it."""
    session = Session(draft_in(folder, name))
    session.server.server_close()
    return session


def comments(text: str) -> list[str]:
    return [line for line in text.splitlines() if "#" in line]


@pytest.mark.parametrize("name", SHIPPED)
def test_handle_is_at_pose_and_moves(name: str, tmp_path: Path) -> None:
    """Each is moved and turned; read again, the scenario has it there."""
    scenario = kw.load_scenario(name)
    robot = kw.load_robot(str(scenario.task.robot))
    turn = pin.exp3(np.array([0.2, -0.1, 0.3]))
    shift = np.array([0.0123, -0.02, 0.031])
    for handle in handles(scenario, robot):
        where = pin.SE3(turn @ handle.pose.rotation, handle.pose.translation + shift)
        draft = draft_in(tmp_path / str(handle.at).replace("/", " "), name)
        scales = UNITS[scenario.units.length], UNITS[scenario.units.angle]
        turned = pin.Quaternion(where.rotation).coeffs()
        draft.apply(move_handle(handle, scales, where.translation, turned))
        task = kw.Task.load(draft.document().data)
        try:
            again = kw.load_scenario(task)
        except DocumentError:
            if name in ARCS and handle.at[0] == "waypoints":
                continue  # an arc moved in part is none
            raise
        same = next(one for one in handles(again, robot) if one.at == handle.at)
        assert np.abs(same.pose.translation - where.translation).max() <= 1e-5
        if handle.form:
            assert np.linalg.norm(pin.log3(same.pose.rotation.T @ where.rotation)) <= 3e-4
        assert comments(draft.text) == comments(SCENARIO_FILES[name].read_text())


def test_only_what_rests_where_poses_are_has_handles() -> None:
    """Seen from a turntable its stand moves, and the drum on it does not."""
    scenario = kw.load_scenario("ur5_turntable_rim")
    robot = read_scenario_joints(scenario).robot
    found = {(one.name, one.kind): one.pose.translation for one in handles(scenario, robot)}
    assert ("stand", "object") not in found
    assert found["drum", "frame"] == pytest.approx([0.0, 0.0, 0.15])
    assert found["above", "waypoint"] == pytest.approx([-0.18, 0.0, 0.25])


def test_edits_of_one_gesture_are_undone_together(tmp_path: Path) -> None:
    draft = draft_in(tmp_path)
    first = draft.text
    for k in (1, 2, 3):
        draft.apply([{"at": ["waypoints", 0, "time"], "value": 3 + k}], gesture="a")
    draft.apply([{"at": ["rate"], "value": 250}], gesture="b")
    assert (draft.revision, draft.state()["unsaved"]) == (4, True)
    draft.undo()
    assert draft.document().data["waypoints"][0]["time"] == 6
    draft.undo()
    draft.undo()  # nothing is left
    assert draft.text == first
    assert not draft.state()["unsaved"]
    draft.redo()
    draft.redo()
    assert draft.document().data["rate"] == 250


def test_what_another_program_writes_is_not_overwritten(tmp_path: Path) -> None:
    draft = draft_in(tmp_path)
    draft.apply([{"at": ["rate"], "value": 250}])
    mine, theirs = draft.text, draft.text.replace("UR5", "The UR5")
    draft.file.write_text(theirs, encoding="utf-8")
    with pytest.raises(InputError, match="changed by another program"):
        draft.save()
    assert draft.text == draft.file.read_text(encoding="utf-8") == theirs
    draft.undo()
    assert draft.text == mine
    draft.save()
    assert draft.file.read_text(encoding="utf-8") == mine


@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"])
def test_lines_end_as_they_did_and_a_byte_order_mark_stays(mark: bytes, tmp_path: Path) -> None:
    file = written(tmp_path / "task.yaml", mark + b"rate: 100 # Hz\r\nwaypoints: []\r\n")
    draft = Draft(file)
    draft.apply([{"at": ["rate"], "value": 200}])
    draft.save()
    assert file.read_bytes() == mark + b"rate: 200 # Hz\r\nwaypoints: []\r\n"


ADDED = [
    *(("planar2_closed_form", 1.0, "pose"), ("ur5_deburring", 3.9, "pose")),
    *(("ur10_weld", 14.2, "pose"), ("ur3_lid", 6.0, "joints")),
]


@pytest.mark.parametrize(("name", "time", "what"), mostly_exhaustive(ADDED, ADDED[1]))
def test_waypoint_is_added_at_arm(name: str, time: float, what: str, tmp_path: Path) -> None:
    """The motion leads through the pose that the arm had, and all checks pass as before."""
    session = session_in(tmp_path, name)
    assert session.replan() is not None
    robot, before = session.plan.joints.robot, session.plan
    pose = robot.forward(before.trajectory.position(time))
    add = session.server.actions["add"]
    _, *place = add({"what": what, "time": time})["at"]
    assert session.replan() is not None
    assert session.plan.report.ok
    scenario = session.plan.scenario
    assert len(scenario.waypoints) == len(before.scenario.waypoints) + 1
    at = scenario.waypoints[scenario.task_index.index(place[0])].time
    there = robot.forward(session.plan.trajectory.position(at))
    assert np.abs(there.translation - pose.translation).max() < 0.01  # on a line, it is blended
    session.draft.apply([{"at": ["rate"], "value": 90}])
    with pytest.raises(InputError, match="before the task is planned"):
        add({"what": what, "time": time})


def test_what_can_not_be_planned_at_first_has_handles(tmp_path: Path) -> None:
    """The robot stands in its scene; a waypoint out of reach is brought back."""
    session = session_in(tmp_path, "ur3_lid")
    session.draft.apply([{"at": ["waypoints", 0, "pose", "position"], "value": [0, 0, 2000]}])
    with pytest.raises(InputError, match="out of reach"):
        session.replan()
    state = session.server.state()["draft"]
    assert session.server.scene["revision"] != state["revision"] == state["handled"]
    high = next(one for one in state["handles"] if one["name"] == "above")
    x, y, z = high["position"]
    session.server.actions["move"]({**high, "position": [x, y, z - 1.94]})
    assert session.replan()[1].report.ok


def test_a_handle_moves_what_it_was_shown_for_or_nothing(tmp_path: Path) -> None:
    """A waypoint is taken out of a text that can't be read: what was shown stays unmoved."""
    session = session_in(tmp_path)
    state, actions = session.server.state, session.server.actions
    first = state()["draft"]["handles"]
    two, three = (one for one in first if one["at"] in (["waypoints", k, "pose"] for k in (1, 2)))
    actions["edit"]({"changes": [{"at": ["waypoints", 0, "time"], "value": -3}]})
    with pytest.raises(InputError, match=r"waypoints\[0\]\.time: time -3 s is not later than 0 s"):
        actions["move"]({**two, "position": [0.4, 0.1, 0.2]})
    actions["edit"]({"changes": [{"at": ["waypoints", 1]}]})
    text = session.draft.text
    for gone in (two, three, {**three, "structure": None}, {**three, "at": two["at"]}):
        with pytest.raises(InputError, match="the task has changed since"):
            actions["move"]({**gone, "position": [0.4, 0.1, 0.2]})
    with pytest.raises(InputError, match="the task has changed since"):
        actions["edit"]({"changes": [{"at": two["at"][:2]}], "structure": two["structure"]})
    assert session.draft.text == text
    assert state()["draft"]["handles"] == []
    actions["edit"]({"changes": [{"at": ["waypoints", 0, "time"], "value": 3}]})
    again = next(one for one in state()["draft"]["handles"] if one["name"] == three["name"])
    assert again["at"] == two["at"]
    actions["move"]({**again, "position": (np.array(again["position"]) + 0.01).tolist()})
    with pytest.raises(InputError, match="no handle"):
        actions["move"]({**again, "name": "another"})
    with pytest.raises(InputError, match="shape"):
        actions["move"]({**again, "position": [1]})
    kept = [one["name"] for one in session.draft.document().data["waypoints"]]
    assert kept.count(two["name"]) == 0


SCENARIOS = {name: kw.load_scenario(name) for name in names("scenarios")}
FREE = [name for name, task in SCENARIOS.items() if task.task.robot and task.unknowns]
TIMED = [name for name, task in SCENARIOS.items() if task.task.robot and not task.unknowns]


@pytest.mark.parametrize("name", mostly_exhaustive(FREE, "panda_pick_place_fastest"))
def test_a_task_with_free_times_is_edited(name: str, tmp_path: Path) -> None:
    assert session_in(tmp_path, name).replan()[1].report.ok


def test_an_overtaken_plan_is_dropped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Both the motion and the error of an older text: the newer one alone is shown."""
    session = session_in(tmp_path, "planar2_closed_form")
    plan, begun, go_on = sessions.plan, threading.Event(), threading.Event()

    def slow(*arguments: Any, **options: Any) -> Any:
        begun.set()
        go_on.wait()
        return plan(*arguments, **options)

    found: list[Any] = []
    for value, rate in ((100, 120), ("no planner", 140)):
        begun.clear()
        go_on.clear()
        key = "rate" if rate == 120 else "planner"
        session.draft.apply([{"at": [key], "value": value}])
        monkeypatch.setattr(sessions, "plan", slow)
        worker = threading.Thread(target=lambda: found.append(session.replan()))
        worker.start()
        begun.wait()
        session.draft.apply([{"at": ["rate"], "value": rate}])
        go_on.set()
        worker.join()
        assert found.pop() is None
        assert session.plan is None
    session.draft.undo()
    session.draft.undo()
    assert session.replan() is not None
    assert session.plan.scenario.task.rate == 120


@pytest.mark.parametrize("name", mostly_exhaustive([*FREE, *TIMED], *FREE[:3]))
def test_before_a_task_is_planned_the_robot_stands_in_its_scene(name: str) -> None:
    scenario = SCENARIOS[name]
    robot = read_scenario_joints(scenario).robot
    scene = unplanned_scene(scenario, robot)
    drawn = {one.get("of") for one in scene["meshes"]}
    assert drawn >= set(scenario.task.scene.objects)
    times = [one["time"] for one in scene["waypoints"]]
    assert np.all(np.diff(times) > 0)
