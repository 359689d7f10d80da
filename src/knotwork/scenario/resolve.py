"""From a scenario file's values to a `Scenario` in SI in the robot's base frame."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from knotwork import documents, resources
from knotwork.documents import Document, Location
from knotwork.scenario.model import (
    JointTarget,
    JointValues,
    LimitOverrides,
    Presets,
    Scenario,
    ScenarioWaypoint,
    ToleranceSet,
    ToolPlacement,
)
from knotwork.scenario.schema import (
    Balanced,
    EndAcceleration,
    JointWaypoint,
    PoseWaypoint,
    ScenarioFile,
    Velocity,
)
from knotwork.waypoints import CartesianWaypoint, FloatArray

if TYPE_CHECKING:
    import pinocchio as pin

    from knotwork.scenario.geometry import Frames

START = "start"


def load_scenario(reference: str | Path | Mapping[str, Any]) -> Scenario:
    """Read a scenario: a shipped one by name, a file by path, or a mapping of the same shape.

    Raises:
        DocumentError: The file can't be read, or something in it is wrong; names every problem
            with its line, field, value and what would be accepted.
        UnknownNameError: No scenario of this name is shipped.
    """
    if isinstance(reference, Mapping):
        document = Document(_plain(reference))
    else:
        document = documents.read(resources.find("scenarios", reference))
    return _Resolver(document).scenario()


# No scenario nests deeper; what does is refused as it is.
_DEEPEST = 8


def _plain(value: Any, depth: int = 0) -> Any:
    """A mapping from Python as a file would give it: NumPy's arrays as lists, its numbers plain."""
    if isinstance(value, Mapping) and depth < _DEEPEST:
        return {key: _plain(item, depth + 1) for key, item in value.items()}
    if isinstance(value, list | tuple) and depth < _DEEPEST:
        return [_plain(item, depth + 1) for item in value]
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    return value


class _Resolver:
    """Resolves one scenario file; the steps share its units, frames and document."""

    def __init__(self, document: Document) -> None:
        self.document = document
        self.file = documents.validate(ScenarioFile, document)
        self.length = 1.0 if self.file.units.length == "m" else 1e-3
        self.angle = 1.0 if self.file.units.angle == "rad" else math.pi / 180

    def scenario(self) -> Scenario:
        file, source = self.file, self.document.file
        if file.robot is None:
            self._check_joints_alone()
        elif file.joint_units:
            raise self.document.error(
                ("joint_units",), "is for scenarios without a robot, which knows its joints"
            )
        if isinstance(file.robot, dict):
            self._check_description_in_si(file.robot)
        if file.frame is not None or file.frames:
            self.frames.find(file.frame or "base", ("frame",))
        return Scenario(
            name=file.name or (source.stem if source is not None else "scenario"),
            description=file.description,
            waypoints=self._waypoints(),
            robot=self.document.part(("robot",)) if isinstance(file.robot, dict) else file.robot,
            relative_to=source.parent if source is not None else None,
            joint_units=file.joint_units,
            frames={name: self.frames[name].copy() for name in file.frames},
            tool=self._tool(),
            near=self._joints(file.near, ("near",)) if file.near is not None else None,
            branch=self._branch(),
            planner=file.planner,
            knots=self._knots(),
            end_acceleration=self._end_acceleration(),
            presets=self._presets(),
            limits=self._limits(),
            tolerances=self._tolerances(),
            continuity=file.continuity,
            rate=file.rate,
            source=source,
            document=self.document,
        )

    def _check_description_in_si(self, robot: Mapping[str, Any]) -> None:
        """A robot description is in SI like a robot file, so numbers in other units are refused."""
        if self.length == self.angle == 1.0:
            return
        for key in ("locked", "configurations", "limits"):
            if robot.get(key):
                raise self.document.error(
                    ("robot", key),
                    "is in SI like every robot description, but the file's units are others",
                    "a robot file of its own (robot: its path), units m and rad, or limits: of the "
                    "scenario",
                )

    def _check_joints_alone(self) -> None:
        """Without a robot only joint values make sense."""
        for i, waypoint in enumerate(self.file.waypoints):
            if isinstance(waypoint, PoseWaypoint):
                raise self.document.error(
                    ("waypoints", i, "pose"),
                    "a pose needs a robot",
                    "robot: the name of one (`knotwork robots` lists them) or a path",
                )
        for key in ("tool", "near", "branch"):
            if getattr(self.file, key) not in (None, "free"):
                raise self.document.error((key,), "needs a robot, and the file names none")

    def _joints(self, values: Mapping[str, float] | float | str, location: Location) -> JointValues:
        return JointValues(values, self.length, self.angle, self.document, location)

    # Waypoints

    def _waypoints(self) -> tuple[ScenarioWaypoint, ...]:
        given = self.file.waypoints
        names, times = self._names(), self._times()
        offset = 1 if self.file.start is not None else 0
        if len(given) + offset < 2:
            raise self.document.error(
                ("waypoints",),
                "a motion needs at least two waypoints, and there is one",
                "two or more, or one with start: where the motion begins",
            )
        poses = self._poses()
        waypoints: list[ScenarioWaypoint] = []
        if self.file.start is not None:
            joints = self._joints(self.file.start, ("start",))
            where = self.document.where(("start",))
            waypoints.append(JointTarget(START, 0.0, joints, None, where))
        for i, waypoint in enumerate(given):
            where = self.document.where(("waypoints", i))
            inner = 0 < i + offset < len(given) + offset - 1
            if isinstance(waypoint, JointWaypoint):
                velocity = self._joint_velocity(i, waypoint, inner)
                joints = self._joints(waypoint.joints, ("waypoints", i, "joints"))
                waypoints.append(JointTarget(names[i], times[i], joints, velocity, where))
                continue
            pose = poses[i]
            linear, angular = self._velocity(i, waypoint, inner, poses)
            waypoints.append(
                CartesianWaypoint(
                    names[i], times[i], pose.translation, pose.rotation, linear, angular, where
                )
            )
        return tuple(waypoints)

    def _names(self) -> list[str]:
        names: list[str] = []
        taken = {START} if self.file.start is not None else set()
        for i, waypoint in enumerate(self.file.waypoints):
            name = waypoint.name or f"waypoint {i + 1}"
            if name in taken:
                raise self.document.error(
                    ("waypoints", i, "name"),
                    f"{name!r} is the name of another waypoint",
                    "a name of its own",
                )
            taken.add(name)
            names.append(name)
        return names

    def _times(self) -> list[float]:
        times: list[float] = []
        before: float | None = 0.0 if self.file.start is not None else None
        for i, waypoint in enumerate(self.file.waypoints):
            location: Location = ("waypoints", i)
            if waypoint.time is not None:
                time = waypoint.time
                location = (*location, "time")
            elif waypoint.after is not None:
                time = (before or 0.0) + waypoint.after
                location = (*location, "after")
            elif before is None:
                time = 0.0
            else:
                raise self.document.error(
                    location, "has no time", "time (since 0) or after (since the one before) [s]"
                )
            if before is not None and time <= before:
                earlier = "start" if i == 0 else "the waypoint before it"
                raise self.document.error(
                    location,
                    f"time {time:g} s is not later than {before:g} s, the time of {earlier}",
                    f"a time greater than {before:g} s",
                )
            times.append(time)
            before = time
        return times

    def _poses(self) -> dict[int, pin.SE3]:
        """Poses in the base frame of those waypoints that are given by one."""
        if not any(isinstance(waypoint, PoseWaypoint) for waypoint in self.file.waypoints):
            return {}
        from knotwork.scenario.geometry import placement_in_si

        poses: dict[int, pin.SE3] = {}
        for i, waypoint in enumerate(self.file.waypoints):
            if isinstance(waypoint, PoseWaypoint):
                location: Location = ("waypoints", i, "pose")
                own = placement_in_si(
                    waypoint.pose, self.length, self.angle, self.document, location
                )
                poses[i] = self.frames[self._frame(i, waypoint)] * own
        return poses

    @property
    def frames(self) -> Frames:
        if not hasattr(self, "_frames"):
            from knotwork.scenario.geometry import Frames

            self._frames = Frames(self.file.frames, self.length, self.angle, self.document)
        return self._frames

    def _frame(self, i: int, waypoint: PoseWaypoint) -> str:
        if waypoint.frame is not None:
            return self.frames.find(waypoint.frame, ("waypoints", i, "frame"))
        if self.file.frame is not None:
            return self.frames.find(self.file.frame, ("frame",))
        return "base"

    def _velocity(
        self, i: int, waypoint: PoseWaypoint, inner: bool, poses: Mapping[int, pin.SE3]
    ) -> tuple[FloatArray, FloatArray]:
        if waypoint.velocity is not None:
            return self._given_velocity(i, waypoint, waypoint.velocity, poses[i])
        if waypoint.speed is not None:
            return self._passing_velocity(i, waypoint.speed, poses)
        if inner and waypoint.stop is None:
            raise self.document.error(
                ("waypoints", i),
                "is passed on the way and says no speed",
                "velocity: {linear, angular}, speed: along the path, or stop: true",
            )
        return np.zeros(3), np.zeros(3)

    def _given_velocity(
        self, i: int, waypoint: PoseWaypoint, velocity: Velocity, pose: pin.SE3
    ) -> tuple[FloatArray, FloatArray]:
        axes = velocity.axes or self._frame(i, waypoint)
        self.frames.find(axes, ("waypoints", i, "velocity", "in"), "tool")
        turn = pose.rotation if axes == "tool" else self.frames[axes].rotation
        linear = self.length * np.array(velocity.linear)
        return turn @ linear, turn @ (self.angle * np.array(velocity.angular))

    def _passing_velocity(
        self, i: int, speed: float, poses: Mapping[int, pin.SE3]
    ) -> tuple[FloatArray, FloatArray]:
        from knotwork.scenario.speed import NoDirectionError, passing_velocity

        location: Location = ("waypoints", i, "speed")
        first = i
        while first - 1 in poses and first > i - 2:
            first -= 1
        last = i
        while last + 1 in poses and last < i + 2:
            last += 1
        # The neighbours decide; one further on is needed only at the two ends of the motion.
        at_start = i == 0 and self.file.start is None
        at_end = i == len(self.file.waypoints) - 1
        if (first == i and not at_start) or (last == i and not at_end) or first == last:
            raise self.document.error(
                location,
                "the path's direction is not known, because a neighbouring waypoint is given by "
                "joint values",
                "velocity: {linear, angular} instead",
            )
        if not at_start and not at_end:
            first, last = i - 1, i + 1
        try:
            return passing_velocity(
                [poses[k] for k in range(first, last + 1)], i - first, self.length * speed
            )
        except NoDirectionError as error:
            raise self.document.error(
                location, str(error), "velocity: {linear, angular} or stop: true instead"
            ) from error

    def _joint_velocity(self, i: int, waypoint: JointWaypoint, inner: bool) -> JointValues | None:
        if waypoint.velocity is not None:
            return self._joints(waypoint.velocity, ("waypoints", i, "velocity"))
        if inner and waypoint.stop is None:
            raise self.document.error(
                ("waypoints", i),
                "is passed on the way and says no speed",
                "velocity: by joint name, or stop: true",
            )
        return None

    # The rest

    def _tool(self) -> ToolPlacement:
        tool = self.file.tool
        if tool is None:
            return ToolPlacement()
        if tool.offset is None:
            return ToolPlacement(tool.frame)
        from knotwork.scenario.geometry import placement_in_si

        location: Location = ("tool", "offset")
        return ToolPlacement(
            tool.frame,
            placement_in_si(tool.offset, self.length, self.angle, self.document, location),
        )

    def _branch(self) -> str | dict[str, str]:
        branch = self.file.branch
        if isinstance(branch, str):
            return branch
        return {key: str(word) for key, word in branch if word is not None}

    def _knots(self) -> str | float | FloatArray:
        knots = self.file.knots
        if isinstance(knots, Balanced):
            return knots.balanced
        return np.array(knots) if isinstance(knots, list) else knots

    def _end_acceleration(self) -> str | tuple[JointValues, JointValues] | None:
        given = self.file.end_acceleration
        if isinstance(given, EndAcceleration):
            return (
                self._joints(given.start, ("end_acceleration", "start")),
                self._joints(given.end, ("end_acceleration", "end")),
            )
        return given

    def _presets(self) -> Presets:
        given = self.file.planner_options
        count = len(self.file.waypoints) + (self.file.start is not None)

        def counted(name: str, values: list[Any]) -> list[Any]:
            if len(values) != count:
                also = ", the start included" if self.file.start is not None else ""
                raise self.document.error(
                    ("planner_options", name),
                    f"has {len(values)} entries",
                    f"{count}, one for each waypoint{also}",
                )
            return values

        def joints(name: str) -> tuple[JointValues, ...] | None:
            values = getattr(given, name)
            if values is None:
                return None
            return tuple(
                self._joints(value, ("planner_options", name, i))
                for i, value in enumerate(counted(name, values))
            )

        times = given.transition_time
        return Presets(
            given.accelerations
            if isinstance(given.accelerations, str)
            else joints("accelerations"),
            joints("jerks"),
            joints("snaps"),
            tuple(counted("transition_time", times)) if isinstance(times, list) else times,
        )

    def _limits(self) -> LimitOverrides:
        limits = self.file.limits
        values: dict[str, JointValues] = {
            kind: self._joints(given, ("limits", kind))
            for kind in ("velocity", "acceleration", "jerk", "effort")
            if (given := getattr(limits, kind)) is not None
        }
        for side, name in enumerate(("position_lower", "position_upper")):
            if limits.position is not None:
                bounds = {joint: pair[side] for joint, pair in limits.position.items()}
                values[name] = self._joints(bounds, ("limits", "position"))
        return LimitOverrides(**values)

    def _tolerances(self) -> ToleranceSet:
        given = self.file.tolerances
        values: dict[str, Any] = {}
        for name in type(given).model_fields:
            value = getattr(given, name)
            if value is None:
                continue
            if name.startswith("joint"):
                values[name] = {"rad": value * self.angle, "m": value * self.length}
            else:
                linear = name in ("position", "linear_velocity")
                values[name] = value * (self.length if linear else self.angle)
        return ToleranceSet(**values)
