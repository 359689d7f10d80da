"""`Task`: a scenario's file, read with ruamel.yaml and the descriptions of its schema alone.

What no shipped scenario uses is not read, and is an error here: blends, arcs by their radius,
quaternions from a file of points, freedoms but that of the turn, tangent turning along a curve
through points, and speeds at a pose without a path. Times and speeds that are free must have
numbers, as the scenario that `knotwork plan --out` saves has them.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from judge import curves, weaving
from judge.arm import KINDS, Arm, no_limits, replaced
from judge.files import read_yaml
from judge.placing import FORMS, frames, leaning, placement

TOLERANCES = {"path": 1e-4, "path_orientation": math.radians(0.1), "path_speed": 0.01}


@dataclass
class Goal:
    """A waypoint: when it is reached [s], and how."""

    name: str
    time: float
    pose: pin.SE3 | None = None
    twist: np.ndarray | None = None
    joints: np.ndarray | None = None
    velocity: np.ndarray | None = None
    free: bool = False


def _waiting(one: Any) -> Any:
    """A waypoint whose `do` has the arm wait, as one with `wait`."""
    do = one.get("do") or []
    waits = [act["wait"] for act in (do if isinstance(do, list) else [do]) if "wait" in act]
    return {**one, "wait": waits[0]} if waits else one


@dataclass
class Task:
    """What a scenario asks for, in SI, in the base.

    Attributes:
        waits: From when to when [s] the arm stands still.
        limits: By kind, of each joint.
    """

    data: Mapping[str, Any]
    folder: Path
    waypoints: list[Goal] = field(default_factory=list)
    waits: list[tuple[str, float, float]] = field(default_factory=list)
    paths: list[curves.ToolPath] = field(default_factory=list)
    arm: Arm | None = None

    def __post_init__(self) -> None:
        units = self.data.get("units") or {}
        self.length = {"m": 1.0, "mm": 1e-3}[units.get("length", "m")]
        self.angle = {"rad": 1.0, "deg": math.pi / 180.0}[units.get("angle", "rad")]
        given = [_waiting(one) for one in self.data["waypoints"]]
        if self.data.get("robot") is not None:
            tool = self.data.get("tool") or {}
            gravity = self.data.get("gravity")
            scales = self.length, self.angle
            self.arm = Arm(
                self.data["robot"], self.folder, tool, *scales, gravity, self._carrier("on")
            )
            self._ride()
            self.names, self.units = self.arm.names, self.arm.units
        else:
            self.names = tuple(given[0]["joints"])
            kinds = self.data.get("joint_units") or {}
            self.units = tuple(kinds.get(name, "rad") for name in self.names)
        self.scale = np.array([self.length if u == "m" else self.angle for u in self.units])
        self.frames = frames(self.data.get("frames") or {}, self.length, self.angle)
        self._read_waypoints(given)
        self._read_waits()
        self._read_limits()

    # --- what carries the poses

    def _carrier(self, key: str) -> Any:
        """What the frame of all poses, or one that it is in, says under a key."""
        name = self.data.get("frame") or "base"
        given = self.data.get("frames") or {}
        while name in given:
            if key in given[name]:
                return given[name][key] if key == "on" else (name, given[name][key])
            name = given[name].get("in", "base")
        return None

    def _ride(self) -> None:
        """Take the poses along with a frame that moves at constant speeds."""
        found = self._carrier("moves")
        if found is None:
            return
        name, moves = found
        rest = frames(self.data["frames"], self.length, self.angle)[name]
        linear = self.length * np.array(moves.get("linear", (0, 0, 0)), dtype=float)
        angular = self.angle * np.array(moves.get("angular", (0, 0, 0)), dtype=float)
        begin = float(moves.get("at", 0.0))

        def ground(t: float) -> pin.SE3:
            moved = pin.SE3(pin.exp3((t - begin) * angular), (t - begin) * linear)
            return rest * moved * rest.inverse()

        self.arm.ground = ground

    @classmethod
    def read(cls, path: Path) -> Task:
        return cls(read_yaml(path), path.parent)

    def tolerance(self, name: str) -> float:
        """By default 1e-6 in SI; `joint_` ones are got by joint."""
        value = (self.data.get("tolerances") or {}).get(name)
        if value is None:
            return TOLERANCES.get(name, 1e-6)
        if name == "path_speed":
            return float(value)
        turning = name in ("orientation", "angular_velocity", "path_orientation")
        return float(value) * (self.angle if turning else self.length)

    def joint_tolerance(self, name: str) -> np.ndarray:
        value = (self.data.get("tolerances") or {}).get(name)
        return np.full(len(self.names), 1e-6) if value is None else float(value) * self.scale

    def joint_values(self, given: Any, missing: float | None = None) -> np.ndarray:
        if isinstance(given, str):
            return self.arm.configurations[given]
        values = [
            given[name] if missing is None else given.get(name, missing) for name in self.names
        ]
        return np.array(values, dtype=float) * self.scale

    # --- waypoints

    def _frame(self, one: Mapping[str, Any]) -> pin.SE3:
        return self.frames[one.get("frame") or self.data.get("frame") or "base"]

    def _pose(self, one: Mapping[str, Any]) -> pin.SE3:
        frame, own = self._frame(one), placement(one["pose"], self.length, self.angle)
        placed = frame * own
        if one.get("orientation_in"):
            placed.rotation = self.frames[one["orientation_in"]].rotation @ own.rotation
        return placed

    def _stops(self, i: int, given: list[Any]) -> bool:
        one = given[i]
        first = i == 0 and self.data.get("start") is None
        return bool(one.get("stop") or one.get("wait")) or first or i == len(given) - 1

    def _read_waypoints(self, given: list[Any]) -> None:
        now: float | None = None
        if self.data.get("start") is not None:
            home = self.joint_values(self.data["start"])
            self.waypoints.append(Goal("start", 0.0, joints=home, velocity=0.0 * home))
            now = 0.0
        i = 0
        while i < len(given):
            one = given[i]
            if "along" in one:
                i, now = self._read_path(i, given, now or 0.0)
                continue
            waypoint = self._read_waypoint(i, one)
            if one.get("time") is not None:
                waypoint.time = float(one["time"])
            elif one.get("after") is not None:
                waypoint.time = (now or 0.0) + float(one["after"])
            else:
                assert now is None, "a time is free"
            now = self._add(waypoint, one)
            i += 1

    def _add(self, point: Goal, one: Mapping[str, Any]) -> float:
        self.waypoints.append(point)
        if one.get("wait") is None:
            return point.time
        over = point.time + float(one["wait"])
        after = Goal(point.name, over, point.pose, point.twist, point.joints, point.velocity)
        self.waypoints.append(after)
        return over

    def _read_waypoint(self, i: int, one: Mapping[str, Any]) -> Goal:
        name = one.get("name") or f"waypoint {i + 1}"
        velocity = one.get("velocity") or {}
        if "joints" in one:
            joints = self.joint_values(one["joints"])
            return Goal(name, 0.0, joints=joints, velocity=self.joint_values(velocity, 0.0))
        assert one.get("speed") is None, "a speed without a path is not read here"
        pose = self._pose(one)
        axes = velocity.get("in")
        frame = self._frame(one) if axes is None else self.frames.get(axes, pose)
        linear, angular = (
            scale * (frame.rotation @ np.array(velocity.get(key, (0.0, 0.0, 0.0)), dtype=float))
            for key, scale in (("linear", self.length), ("angular", self.angle))
        )
        twist = np.concatenate((linear, angular))
        return Goal(name, 0.0, pose=pose, twist=twist, free=self._free(one))

    def _free(self, one: Mapping[str, Any]) -> bool:
        """Whether the turn about the tool's z axis is free; that alone is read here."""
        free = one.get("free") or (self.data.get("tool") or {}).get("free") or "none"
        assert free in ("none", {"turn": "z"}), "not read here"
        return bool(free != "none")

    # --- tool paths

    def _read_path(self, first: int, given: list[Any], start: float) -> tuple[int, float]:
        """A path from the waypoint before to where it stops or no path goes on."""
        last = first
        while not self._stops(last, given) and last + 1 < len(given) and "along" in given[last + 1]:
            last += 1
        pose = self.waypoints[-1].pose
        parts = []
        for i in range(first, last + 1):
            curve, rate, end = self._stretch(given[i], pose)
            parts.append((curve, rate, pose.rotation.copy(), end))
            pose = end
        lengths = [curve.length for curve, *_ in parts]
        prescribed = (self.data.get("path") or {}).get("acceleration")
        acceleration = 1.0 if prescribed is None else self.length * prescribed
        before_stops = first == 0 or self._stops(first - 1, given)
        ends = (0.0 if before_stops else None, 0.0 if self._stops(last, given) else None)
        speeds = self._speeds(given[first : last + 1], lengths, ends, acceleration)
        times = curves.timed(lengths, speeds, ends, acceleration, start)
        names = [self.waypoints[-1].name] + [one["name"] for one in given[first : last + 1]]
        path = curves.ToolPath(
            [
                curves.Stretch(curve, R, rate, v, *when, (names[k], names[k + 1]))
                for k, ((curve, rate, R, _), v, when) in enumerate(
                    zip(parts, speeds, times, strict=True)
                )
            ]
        )
        if self._free(given[first]):
            path.axis = self._axis(given[first], path)
        if any("weave" in one for one in given[first : last + 1]):
            path.woven = self._woven(given[first], path)
        self.paths.append(path)
        self.waypoints[-1].twist = path.twist(0, times[0][3][0])
        for k, (when, (*_, end)) in enumerate(zip(times, parts, strict=True)):
            if path.axis is not None:
                z = path.axis(path.ends[k : k + 1])[0]
                turn = pin.Quaternion.FromTwoVectors(end.rotation[:, 2], z).matrix()
                end.rotation = turn @ end.rotation
            twist = path.twist(k + 1, when[3][1])
            free = self._free(given[first + k])
            waypoint = Goal(names[k + 1], when[1], end, twist, free=free)
            now = self._add(waypoint, given[first + k])
        return last + 1, now

    def _axis(self, one: Mapping[str, Any], path: curves.ToolPath) -> Any:
        """The tool's z axis along a path: against the normals, or that of its rotations."""
        file = one["along"].get("points") if isinstance(one["along"], dict) else None
        if not isinstance(file, str):
            return lambda s: path.rotations(s)[:, :, 2]
        rows = np.loadtxt(self.folder / file, delimiter=",", skiprows=1)
        turn = self._frame(one).rotation.T
        s = np.linspace(0.0, path.length, 20 * len(rows))
        points, places = self._points(one["along"], self._frame(one)), path.at(s)[0]
        at = s[[np.linalg.norm(places - point, axis=1).argmin() for point in points]]

        def axis(along: np.ndarray) -> np.ndarray:
            found = [-np.interp(along, at, column) for column in (rows[:, 3:6] @ turn).T]
            return np.asarray((found / np.linalg.norm(found, axis=0)).T)

        return axis

    def _points(self, along: Mapping[str, Any], frame: pin.SE3) -> np.ndarray:
        rows = along["points"]
        if isinstance(rows, str):
            rows = np.loadtxt(self.folder / rows, delimiter=",", skiprows=1)[:, :3]
        return np.array([frame.act(self.length * np.array(row, dtype=float)) for row in rows])

    def _woven(self, one: Mapping[str, Any], path: curves.ToolPath) -> weaving.Added:
        """What a weave adds to one line, square to it and to the tool."""
        (stretch,) = path.stretches
        assert isinstance(stretch.curve, curves.Line), "other paths are not read here"
        side = np.cross(-stretch.rotation[:, 2], stretch.curve.way)
        side /= np.linalg.norm(side)
        weave, start = one["weave"], stretch.start
        width, rounding = (self.length * weave[key] for key in ("width", "rounding"))
        added = weaving.across(weave, width, rounding, stretch.end - start)
        return lambda t: np.outer(added(np.clip(t, start, stretch.end) - start), side)

    def _speeds(
        self,
        given: list[Any],
        lengths: list[float],
        ends: tuple[float | None, float | None],
        acceleration: float,
    ) -> list[float]:
        if all(waypoint.get("speed") is not None for waypoint in given):
            return [self.length * float(waypoint["speed"]) for waypoint in given]
        assert len(given) == 1, "of several stretches each must give its speed here"
        duration, ramps = float(given[0]["after"]), ends.count(0.0)
        if not ramps:
            return [lengths[0] / duration]
        # the duration is L / v, and 0.75 v / a more for each ramp
        root = math.sqrt(duration**2 - 3.0 * ramps * lengths[0] / acceleration)
        return [(duration - root) * acceleration / (1.5 * ramps)]

    def _stretch(
        self, one: Mapping[str, Any], before: pin.SE3
    ) -> tuple[curves.Curve, np.ndarray, pin.SE3]:
        """The curve to a waypoint, how the tool turns along it [rad/m], and the pose at its end."""
        assert one.get("blend") is None, "blends are not read here"
        frame, end = self._frame(one), self._pose(one)
        curve = self._curve(one["along"], frame, before.translation, end.translation)
        if isinstance(one.get("orientation"), dict):
            assert isinstance(curve, curves.Line), "not read here"
            seam = frame.rotation.T @ curve.way
            before.rotation = frame.rotation @ leaning(seam, one["orientation"], self.angle)
        turned = any(one["pose"].get(form) is not None for form in FORMS)
        if one.get("orientation") == "tangent":
            assert not isinstance(curve, curves.Spline), "not read here"
            rate = curve.normal / curve.radius if isinstance(curve, curves.Arc) else np.zeros(3)
        elif turned:
            rate = pin.log3(end.rotation @ before.rotation.T) / curve.length
        else:
            rate = np.zeros(3)
        end.rotation = pin.exp3(rate * curve.length) @ before.rotation
        return curve, rate, end

    def _curve(
        self, along: Any, frame: pin.SE3, start: np.ndarray, end: np.ndarray
    ) -> curves.Curve:
        def point(values: list[float]) -> np.ndarray:
            return np.asarray(frame.act(self.length * np.array(values, dtype=float)))

        if along == "line":
            return curves.Line(start, end)
        if "points" in along:
            points = self._points(along, frame)
            near = [np.linalg.norm(points[k] - p) > 1e-6 for k, p in ((0, start), (-1, end))]
            points = np.vstack((start, points[0 if near[0] else 1 :]))
            return curves.Spline(np.vstack((points[: None if near[1] else -1], end)))
        arc = along["arc"]
        normal = arc.get("normal")
        axis = None if normal is None else frame.rotation @ np.array(normal, dtype=float)
        if "through" in arc:
            return curves.arc_through(start, point(arc["through"]), end)
        assert "centre" in arc, "arcs by their radius are not read here"
        turns = int(arc.get("turns") or 0)
        return curves.arc_about(start, point(arc["centre"]), end, axis, turns)

    # --- the rest

    def _read_waits(self) -> None:
        """Two equal stops one after the other, without a path between them."""
        moving = {path.stretches[0].start for path in self.paths}
        for one, other in itertools.pairwise(self.waypoints):
            if one.time in moving:
                continue
            if one.pose is not None and other.pose is not None:
                gap = np.abs(one.pose.homogeneous - other.pose.homogeneous).max()
                rates = [one.twist, other.twist]
            elif one.joints is not None and other.joints is not None:
                gap = np.abs(one.joints - other.joints).max()
                rates = [one.velocity, other.velocity]
            else:
                continue
            if gap <= 1e-12 and not np.any(rates):
                self.waits.append((one.name, one.time, other.time))

    def _read_limits(self) -> None:
        given = self.data.get("limits") or {}
        own = self.arm.limits if self.arm else no_limits(len(self.names))
        self.limits = replaced(own, given, self.names, self.scale)
        margin = float(given.get("used_fraction", 1.0))
        for kind in KINDS[1:]:
            self.limits[kind] *= margin
        self.tool_speed, self.tool_acceleration = (
            None if given.get(key) is None else margin * self.length * given[key]
            for key in ("tool_speed", "tool_acceleration")
        )
        frame = given.get("frame_speed") or []
        self.frame_speed = [
            (one["frame"], margin * self.length * one["speed"])
            for one in (frame if isinstance(frame, list) else [frame])
        ]
        self.singular_value = given.get("singular_value")
        ends = self.data.get("end_acceleration")
        self.end_acceleration = None
        if ends is not None:
            ends = {} if ends == "zero" else ends
            self.end_acceleration = [
                self.joint_values(ends.get(key) or {}, 0.0) for key in ("start", "end")
            ]
