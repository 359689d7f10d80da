"""An editing session: requests of the page, and a plan after each edit."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from knotwork.editing.additions import box_at, waypoint_here
from knotwork.editing.draft import Draft, as_javascript, build, units
from knotwork.editing.handles import Handle, handles, moved
from knotwork.errors import InputError, KnotworkError
from knotwork.files.documents import validate
from knotwork.files.documents.items import part_of
from knotwork.kinematics import solve_pose_ik
from knotwork.planning import Plan, plan
from knotwork.robot import Robot
from knotwork.scenario import Scenario, resolved
from knotwork.scenario.joint_space import joint_space
from knotwork.task import Task
from knotwork.task.si_units import si_factors
from knotwork.view.edit_server import EditServer
from knotwork.view.scene_data import make_scene, scene_of
from knotwork.view.shown_motion import ShownMotion
from knotwork.waypoints import FloatArray, read_only

Asked = Mapping[str, Any]
Answer = dict[str, Any]


class Session:
    """Plans a draft for its page, and handles the page's requests.

    Attributes:
        draft: The edited file.
        server: Server of the page.
        plan: The last plan, perhaps of an older version; `None` at first.
    """

    def __init__(self, draft: Draft, port: int = 0, budget: float | None = None) -> None:
        self.draft, self._budget = draft, budget
        self.plan: Plan | None = None
        self._planned = self._handled = -1
        self._verdict: Answer = {}
        self._scenario: Scenario | None = None
        self._robot: Robot | None = None
        self._handles: list[Handle] = []
        self._build, self._axes = "", dict[str, Any]()
        self._units: dict[str, str] = {}
        self._names: dict[str, str] = {}
        self._lock = threading.Lock()
        actions: dict[str, Callable[[Asked], Answer]] = {
            "jog": self._jog,
            "edit": self._changing(self._edit),
            "move": self._changing(self._move),
            "add": self._changing(self._add),
            "undo": self._changing(lambda _: draft.undo()),
            "redo": self._changing(lambda _: draft.redo()),
            "save": self._changing(lambda _: draft.save()),
        }
        self.server = EditServer(draft.file.name, actions, self._state, port)

    def renew(self) -> tuple[dict[str, Any], Plan] | None:
        """Plan the present draft; the scene and the plan, or `None` if it was edited meanwhile.

        Raises:
            KnotworkError: The draft can't be read or planned.
        """
        revision = self.draft.revision
        try:
            made, scene = self._made(revision)
        except KnotworkError:
            if self.draft.revision != revision:
                return None
            raise
        if self.draft.revision != revision:
            return None
        self.plan, self._planned = made, revision
        return {**scene, "revision": revision}, made

    def _made(self, revision: int) -> tuple[Plan, dict[str, Any]]:
        scenario = self._read()
        robot = self._robot
        if robot is not None:
            self.server.start()
            if self.server.scene is None:
                self.server.show({**standing_scene(scenario, robot), "revision": -1})
                self.server.start()
        made = plan(scenario, budget=self._budget)
        self._verdict = {"revision": revision, "ok": made.report.ok}
        self.server.notify()  # before drawing the scene
        return made, scene_of(made, before=self.server.scene)

    def _read(self) -> Scenario:
        """Read the present draft and its handles.

        Raises:
            KnotworkError: The draft can't be read.
        """
        with self._lock:
            revision = self.draft.revision
            if self._scenario is None or self._handled != revision:
                document = self.draft.document()
                scenario = resolved(validate(Task, document), document.places)
                robot = joint_space(scenario).robot
                found = handles(scenario, robot) if robot is not None else []
                # only the first repetition has handles
                first = {one.at: one for one in reversed(found)}
                there = [one for one in first.values() if part_of(document.data, one.at)]
                self._scenario, self._robot, self._handles = scenario, robot, there[::-1]
                self._handled, self._axes = revision, _axes(document.data)
                self._names = _names(scenario)
                now = build(document.data)
                if self._build != now:
                    self._build = now
                    self._units = units(document.data, robot)
            return self._scenario

    def _changing(self, change: Callable[[Asked], Answer | None]) -> Callable[[Asked], Answer]:
        """An action that changes the draft, and answers with the new revision."""

        def done(asked: Asked) -> Answer:
            answer = change(asked) or {}
            return {**answer, "revision": self.draft.revision}

        return done

    def _state(self) -> Answer:
        """State of the page besides the scene, with handles of the present text only."""
        with contextlib.suppress(KnotworkError):
            self._read()
        draft = self.draft.state()
        known = self._handles if draft["build"] == self._build else []
        shown = [{**one.to_dict(), "build": self._build} for one in known]
        more = {"handled": self._handled, "handles": shown, "verdict": self._verdict}
        more["names"] = self._names if draft["build"] == self._build else {}
        return {"draft": {**draft, **more, "units": self._units}}

    def _edit(self, asked: Asked) -> None:
        """Change the text; if the page names a structure, only while the text has it."""
        if "build" in asked:
            self._same_build(asked)
        self.draft.apply(_changes(asked), str(asked.get("gesture", "")))

    def _same_build(self, asked: Asked) -> Any:
        """The data of the draft, if it still has the structure that the page shows."""
        data = self.draft.document().data
        if asked.get("build") != build(data):
            raise InputError("nothing was changed: the task has changed since; try again")
        return data

    def _move(self, asked: Asked) -> Answer:
        """Move a handle; while the text can't be read, one of the last valid text."""
        data = self._same_build(asked)
        with contextlib.suppress(KnotworkError):
            self._read()
        what = tuple(asked.get("at", ())), asked.get("name")
        handle = next((one for one in self._handles if (one.at, one.name) == what), None)
        if handle is None or self._scenario is None:
            raise InputError(f"there is no handle at {asked.get('at')!r}")
        if _axes(data) != self._axes:
            raise InputError(
                "nothing can be moved: the task can't be read, and its frames have changed"
            )
        sizes = {"position": 3, "quaternion": 4}
        given = {
            key: read_only(asked[key], (size,), key) for key, size in sizes.items() if key in asked
        }
        if not 0.99 < np.linalg.norm(given.get("quaternion", [1.0])) < 1.01:
            raise InputError("the quaternion of a handle must have norm 1")
        changes = moved(handle, si_factors(self._scenario.task.units), **given)
        self.draft.apply(changes, str(asked.get("gesture", "")))
        return {"build": build(self.draft.document().data)}

    def _jog(self, asked: Asked) -> Answer:
        """Joint positions and the pose of the tool, one of them computed from the other."""
        robot, q = self._arm(asked)
        base = robot.base_placement
        if "position" in asked:
            turn = pin.Quaternion(read_only(asked["quaternion"], (4,), "quaternion")).matrix()
            pose = pin.SE3(turn, np.array(read_only(asked["position"], (3,), "position")))
            q = solve_pose_ik(robot, base.actInv(pose), q).q
        pose = base * robot.forward(q)
        turned = pin.Quaternion(pose.rotation).coeffs()
        return {
            "q": q.tolist(),
            "position": pose.translation.tolist(),
            "quaternion": turned.tolist(),
        }

    def _add(self, asked: Asked) -> Answer:
        """Add a waypoint at the arm's state, jogged or at a time of the motion; or a box."""
        scenario = self._scenario
        if self.plan is None or scenario is None or self._planned != self.draft.revision:
            raise InputError("nothing can be added before the task is planned")
        robot, q = self._arm(asked)
        planned, task, count = self.plan.scenario, scenario.task, len(scenario.task.waypoints)
        if asked.get("what") == "box":
            point = robot.forward(q).translation
            changes = box_at(task, 1.3 * point, 0.1 * self.server.scene_size)
        else:
            after, share = _between(planned, float(asked.get("time", 0.0)))
            if "after" in asked:
                part, share = tuple(asked["after"]), 0.5
                places = map(scenario.places.given, (("waypoints", i) for i in range(count)))
                inside = [i for i, one in enumerate(places) if one[: len(part)] == part]
                after = max(inside, default=after)
            joints = asked.get("what") == "joints"
            changes = waypoint_here(scenario, robot, q, after, share=share, joints=joints)
        self.draft.apply(changes)
        return {"at": changes[-1]["at"]}

    def _arm(self, asked: Asked) -> tuple[Robot, FloatArray]:
        """The robot, and its joint positions: as given, or at a time of the motion."""
        if self.plan is None or self.plan.space.robot is None:
            raise InputError("the task has not been planned yet")
        robot, motion = self.plan.space.robot, self.plan.trajectory
        if "q" in asked:
            return robot, read_only(asked["q"], (robot.dof,), "q")
        curve = motion.reordered(robot.joint_names, robot.joint_units, owner="the robot").polynomial
        return robot, np.asarray(curve(np.clip(float(asked["time"]), curve.x[0], curve.x[-1])))


def standing_scene(scenario: Scenario, robot: Robot) -> dict[str, Any]:
    """The scene of a task before it is planned: the robot at rest."""
    q = robot.configurations.get(
        "home", np.clip(0.0, robot.lower_position_limit, robot.upper_position_limit)
    )
    joints = dict(zip(robot.joint_names, q.tolist(), strict=True))
    units = dict(zip(robot.joint_names, robot.joint_units, strict=True))
    timed = replace(scenario, free=None)  # with the provisional times
    rest = [{"joints": joints, "time": float(timed.times[at])} for at in (0, -1)]
    motion = plan({"joint_units": units, "waypoints": rest}).trajectory
    return make_scene(ShownMotion.of_trajectory(motion, timed))


def _names(scenario: Scenario) -> dict[str, str]:
    """Names of waypoints in the scene, by location in the file; only the first repetition."""
    named: dict[str, str] = {}
    for i, one in zip(scenario.index, scenario.waypoints, strict=True):
        if i >= 0:
            named.setdefault(as_javascript(scenario.places.given(("waypoints", i))), one.name)
    return named


def _axes(data: Any) -> dict[str, Any]:
    """The parts of a file that determine the axes of handles, within one structure."""
    return {key: part for key, part in data.items() if key not in ("waypoints", "scene")}


def _between(scenario: Scenario, time: float) -> tuple[int, float]:
    """Index in the file of the last waypoint before a time, and the elapsed fraction since."""
    times = np.array(scenario.times)
    i = int(np.clip(np.searchsorted(times, time, "right") - 1, 0, len(times) - 1))
    if i + 1 == len(times):
        return scenario.index[i], 1.0
    share = (time - times[i]) / (times[i + 1] - times[i])
    return scenario.index[i], float(np.clip(share, 0.2, 0.8))


def _changes(asked: Asked) -> list[Mapping[str, Any]]:
    given = asked.get("changes")
    if not isinstance(given, list) or not all(isinstance(one, dict) for one in given):
        raise InputError("an edit needs changes: a list of mappings with at and value")
    return given


def draft_of(source: Path, copy: Path | None = None) -> Draft:
    """The draft of a scenario file, or of a new copy of it.

    Raises:
        InputError: The file does not exist, or the copy exists already.
    """
    from knotwork.files import storage
    from knotwork.files.documents import edited_text, read
    from knotwork.task.places import moved_paths

    if copy is None:
        return Draft(source)
    document = read(source)
    folders = source.parent.resolve(), copy.parent.resolve()
    text = edited_text(Draft(source).text, moved_paths(document.data, *folders))
    return Draft(storage.write_file(copy, text, what="a scenario", replace=False))
