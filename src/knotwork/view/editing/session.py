"""An editing session: requests of the page, and a plan after each edit."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from knotwork.arrays import FloatArray, checked_array
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import InputError, KnotworkError
from knotwork.files import storage
from knotwork.files.documents import read, validate, with_values
from knotwork.files.documents.edits import value_at
from knotwork.planning import Plan, plan
from knotwork.robot import Robot
from knotwork.robot.kinematics import solve_pose_ik
from knotwork.task import Task
from knotwork.task.scenario import Scenario, resolve_task
from knotwork.task.scenario.scenario_joints import read_scenario_joints
from knotwork.task.task_source import moved_paths
from knotwork.view.editing.additions import box_at, waypoint_here
from knotwork.view.editing.draft import Draft, location_key, structure_digest, unit_by_location
from knotwork.view.editing.handles import Handle, handles, move_handle
from knotwork.view.live_server import LiveServer
from knotwork.view.scene_data import make_scene, scene_of
from knotwork.view.shown_motion import ShownMotion

Request = Mapping[str, Any]
Answer = dict[str, Any]


@dataclass(frozen=True, eq=False)
class DraftReading:
    """A draft that can be read, at one revision.

    Attributes:
        revision: The draft's revision.
        scenario: The scenario.
        robot: The robot of the task, or `None`.
        handles: Handles of the task; of repeated waypoints only those of the first repetition.
        structure: Digest of the structure of the text, from `structure_digest`.
        units: Units of the file's values, by their location as JSON.
        names: Names of waypoints in the scene, by location in the file.
    """

    revision: int
    scenario: Scenario
    robot: Robot | None
    handles: list[Handle]
    structure: str
    units: dict[str, str]
    names: dict[str, str]

    @classmethod
    def read(cls, draft: Draft) -> DraftReading:
        """Read a draft.

        Raises:
            KnotworkError: The draft can't be read.
        """
        revision, document = draft.revision, draft.document()
        scenario = resolve_task(validate(Task, document), document)
        robot = read_scenario_joints(scenario).robot
        all_handles = [] if robot is None else handles(scenario, robot)
        return cls(
            revision=revision,
            scenario=scenario,
            robot=robot,
            handles=[handle for handle in all_handles if value_at(document.data, handle.at)],
            structure=structure_digest(document.data),
            units=unit_by_location(document.data, robot),
            names=_names(scenario),
        )


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
        self._planned = -1
        self._verdict: Answer = {}
        self._reading: DraftReading | None = None
        self._lock = threading.Lock()
        actions: dict[str, Callable[[Request], Answer | None]] = {
            "jog": self._jog,
            "edit": self._edit,
            "move": self._move,
            "add": self._add,
            "undo": lambda _: draft.undo(),
            "redo": lambda _: draft.redo(),
            "save": lambda _: draft.save(),
        }
        answering = {name: partial(self._answer, action) for name, action in actions.items()}
        self.server = LiveServer(draft.file.name, port, answering, self._state)

    def _answer(self, action: Callable[[Request], Answer | None], request: Request) -> Answer:
        """Handle a request, and send the state again afterwards, also after an error."""
        try:
            answer = action(request) or {}
        finally:
            self.server.notify()
        return {**answer, "revision": self.draft.revision}

    def replan(self) -> tuple[dict[str, Any], Plan] | None:
        """Plan the present draft, and return its scene and plan, or `None` if it was edited since.

        Raises:
            KnotworkError: The draft can't be read or planned.
        """
        revision = self.draft.revision
        try:
            planned, scene = self._plan_draft(revision)
        except KnotworkError:
            if self.draft.revision != revision:
                return None
            raise
        if self.draft.revision != revision:
            return None
        self.plan, self._planned = planned, revision
        return {**scene, "revision": revision}, planned

    def _plan_draft(self, revision: int) -> tuple[Plan, dict[str, Any]]:
        reading = self._read()
        if reading.robot is not None:
            self.server.announce_next()
            if self.server.scene is None:
                scene = unplanned_scene(reading.scenario, reading.robot)
                self.server.show({**scene, "revision": -1})
                self.server.announce_next()
        planned = plan(reading.scenario, budget=self._budget)
        self._verdict = {"revision": revision, "ok": planned.report.ok}
        self.server.notify()  # before drawing the scene
        return planned, scene_of(planned, previous=self.server.scene)

    def _read(self) -> DraftReading:
        """Read the present draft, once for each revision.

        Raises:
            KnotworkError: The draft can't be read.
        """
        with self._lock:
            if self._reading is None or self._reading.revision != self.draft.revision:
                self._reading = DraftReading.read(self.draft)
            return self._reading

    def _last_reading(self) -> DraftReading | None:
        """The present draft, or the last one that could be read."""
        with contextlib.suppress(KnotworkError):
            self._read()
        return self._reading

    def _state(self) -> Answer:
        """State of the page besides the scene, with handles of the present text only."""
        reading, draft = self._last_reading(), self.draft.state()
        shown_state: Answer = {"handled": -1, "handles": [], "names": {}, "units": {}}
        if reading is not None:
            shown_state |= {"handled": reading.revision, "units": reading.units}
            if draft["structure"] == reading.structure:
                shown = [
                    {**item.to_dict(), "structure": reading.structure} for item in reading.handles
                ]
                shown_state |= {"handles": shown, "names": reading.names}
        return {"draft": {**draft, **shown_state, "verdict": self._verdict}}

    def _edit(self, request: Request) -> None:
        """Change the text; if the request states a structure, the text must still have it."""
        if "structure" in request:
            self._require_same_structure(request)
        changes = request.get("changes")
        if not isinstance(changes, list) or not all(isinstance(change, dict) for change in changes):
            raise InputError("an edit needs changes: a list of mappings with at and value")
        self.draft.apply(changes, str(request.get("gesture", "")))

    def _require_same_structure(self, request: Request) -> None:
        """Refuse a request if the draft no longer has the structure that the page shows."""
        if request.get("structure") != structure_digest(self.draft.document().data):
            raise InputError("nothing was changed: the task has changed since; try again")

    def _move(self, request: Request) -> Answer:
        """Move a handle of the present text."""
        self._require_same_structure(request)
        reading, place = self._read(), (tuple(request.get("at", ())), str(request.get("name")))
        by_place = {(handle.at, handle.name): handle for handle in reading.handles}
        handle = by_place.get(place)
        if handle is None:
            raise InputError(f"there is no handle at {request.get('at')!r}")
        sizes = {"position": 3, "quaternion": 4}
        values = {
            key: checked_array(request[key], (size,), key)
            for key, size in sizes.items()
            if key in request
        }
        if not 0.99 < np.linalg.norm(values.get("quaternion", [1.0])) < 1.01:
            raise InputError("the quaternion of a handle must have norm 1")
        changes = move_handle(handle, reading.scenario.task.units.in_si, **values)
        self.draft.apply(changes, str(request.get("gesture", "")))
        return {"structure": structure_digest(self.draft.document().data)}

    def _jog(self, request: Request) -> Answer:
        """Compute the tool's pose from joint positions, or the reverse, and return both."""
        robot, q = self._arm(request)
        base = robot.base_placement
        if "position" in request:
            turn = pin.Quaternion(checked_array(request["quaternion"], (4,), "quaternion")).matrix()
            pose = pin.SE3(turn, np.array(checked_array(request["position"], (3,), "position")))
            q = solve_pose_ik(robot, base.actInv(pose), q).q
        pose = base * robot.forward(q)
        turned = pin.Quaternion(pose.rotation).coeffs()
        return {
            "q": q.tolist(),
            "position": pose.translation.tolist(),
            "quaternion": turned.tolist(),
        }

    def _add(self, request: Request) -> Answer:
        """Add a box, or a waypoint at the jogged arm's state or at a time of the motion."""
        reading = self._reading
        if self.plan is None or reading is None or self._planned != self.draft.revision:
            raise InputError("nothing can be added before the task is planned")
        robot, q = self._arm(request)
        scenario, planned = reading.scenario, self.plan.scenario
        task, count = scenario.task, len(scenario.task.waypoints)
        if request.get("what") == "box":
            point = robot.forward(q).translation
            changes = box_at(task, 1.3 * point, 0.1 * self.server.scene_size)
        else:
            after, fraction = _place_in_task(planned, float(request.get("time", 0.0)))
            if "after" in request:
                place, fraction = tuple(request["after"]), 0.5
                locations = [scenario.locations.in_file(("waypoints", i)) for i in range(count)]
                inside = [i for i, known in enumerate(locations) if known[: len(place)] == place]
                after = max(inside, default=after)
            joints = request.get("what") == "joints"
            changes = waypoint_here(scenario, robot, q, after, fraction=fraction, joints=joints)
        self.draft.apply(changes)
        return {"at": changes[-1]["at"]}

    def _arm(self, request: Request) -> tuple[Robot, FloatArray]:
        """The robot, and joint positions from the request or at a time of the motion."""
        if self.plan is None or self.plan.joints.robot is None:
            raise InputError("the task has not been planned yet")
        robot, motion = self.plan.joints.robot, self.plan.trajectory
        if "q" in request:
            return robot, checked_array(request["q"], (robot.dof,), "q")
        curve = motion.reordered(robot.joint_names, robot.joint_units, owner="the robot").polynomial
        return robot, np.asarray(curve(np.clip(float(request["time"]), curve.x[0], curve.x[-1])))


def unplanned_scene(scenario: Scenario, robot: Robot) -> dict[str, Any]:
    """Make the scene of a task before it is planned, with the robot at rest."""
    nearest_zero = np.clip(0.0, robot.limits.lower, robot.limits.upper)
    q = robot.configurations.get("home", nearest_zero)
    timed = replace(scenario, unknowns=None)  # with expected times
    motion = JointTrajectory.from_knots(
        robot.joint_names,
        timed.times[[0, -1]],
        np.tile(q, (2, 1)),
        np.zeros((2, robot.dof)),
        joint_units=robot.joint_units,
    )
    return make_scene(ShownMotion.of_trajectory(motion, timed))


def _names(scenario: Scenario) -> dict[str, str]:
    """Names of waypoints in the scene, by location in the file; only the first repetition."""
    named: dict[str, str] = {}
    for i, waypoint in zip(scenario.task_index, scenario.waypoints, strict=True):
        if i >= 0:
            at = scenario.locations.in_file(("waypoints", i))
            named.setdefault(location_key(at), waypoint.name)
    return named


def _place_in_task(scenario: Scenario, time: float) -> tuple[int, float]:
    """Task index of the last waypoint before a time, and the fraction of the interval since."""
    times = np.array(scenario.times)
    i = int(np.clip(np.searchsorted(times, time, "right") - 1, 0, len(times) - 1))
    if i + 1 == len(times):
        return scenario.task_index[i], 1.0
    fraction = (time - times[i]) / (times[i + 1] - times[i])
    return scenario.task_index[i], float(np.clip(fraction, 0.2, 0.8))


def draft_of(source: Path, copy: Path | None = None) -> Draft:
    """Make the draft of a scenario file, or of a new copy of it.

    Raises:
        InputError: The file does not exist, or the copy exists already.
    """
    if copy is None:
        return Draft(source)
    document = read(source)
    folders = source.parent.resolve(), copy.parent.resolve()
    text = with_values(Draft(source).text, moved_paths(Task, document.data, *folders))
    return Draft(storage.write_file(copy, text, kind="a scenario", replace=False))
