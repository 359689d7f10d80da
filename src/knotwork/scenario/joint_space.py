"""The joints that a scenario moves, and its requirements on them, in SI.

The joints are those of its robot, with its tool and limits, or bare joints without a robot.
Planning and checking both start here; only here joint values are converted from the file's units.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from knotwork.errors import InputError, RobotError, UnknownNameError, did_you_mean
from knotwork.joint_quantities import JOINT_QUANTITIES, MAGNITUDES
from knotwork.scenario import JointTarget, JointValues, Scenario
from knotwork.scenario.payloads import Carrying, carrying
from knotwork.scenario.waits import waits
from knotwork.task import PoseWaypoint
from knotwork.units import Units
from knotwork.waypoints import CartesianWaypoint, ChosenRun, FloatArray

if TYPE_CHECKING:
    from knotwork.robot import Robot


@dataclass(frozen=True, eq=False)
class JointState:
    """Joint values required at a waypoint.

    Attributes:
        position: Joint positions [rad or m], shape (d,).
        velocity: Joint velocities [rad/s or m/s], shape (d,).
    """

    position: FloatArray
    velocity: FloatArray


@dataclass(frozen=True, eq=False)
class JointSpace:
    """Joints with their units and limits, their robot, and the requirements on them.

    Attributes:
        joint_names: Names, length d.
        joint_units: `"rad"` or `"m"` for each joint.
        lower_position_limit, upper_position_limit: Limits [rad or m], shape (d,); infinite without
            one.
        limits: Largest magnitude by quantity, each of shape (d,), in the unit of
            `JOINT_QUANTITIES`, infinite without a limit.
        configurations: Named joint positions, each of shape (d,).
        robot: The robot with the scenario's tool and position limits, or `None`.
        carrying: The same robot with its loads over the motion, or `None`.
        targets: Required joint values at each waypoint; `None` for a pose.
        near: Joint positions near which solutions are chosen [rad or m], shape (d,), or `None`.
        end_acceleration: Required at the start and at the end [rad/s² or m/s²], shape (d,) each,
            or `None`.
        accelerations: Planner option of this name; values as an array of shape (n, d) in SI.
        waits: Waypoints at which the arm dwells until the next one, by index.
        chosen: Sections of waypoints with a chosen motion, or `None`.
        solutions: Joint positions near which solutions are chosen, shape (d,), by index of the
            waypoint.
        shown_in: Units of the scenario, for output.
    """

    joint_names: tuple[str, ...]
    joint_units: tuple[str, ...]
    lower_position_limit: FloatArray
    upper_position_limit: FloatArray
    limits: Mapping[str, FloatArray]
    configurations: Mapping[str, FloatArray] = field(default_factory=dict)
    robot: Robot | None = None
    carrying: Carrying | None = None
    targets: tuple[JointState | None, ...] = ()
    near: FloatArray | None = None
    end_acceleration: tuple[FloatArray, FloatArray] | None = None
    accelerations: str | FloatArray | None = None
    waits: tuple[int, ...] = ()
    chosen: tuple[ChosenRun, ...] | None = None
    solutions: Mapping[int, FloatArray] = field(default_factory=dict)
    shown_in: Units = field(default_factory=Units)

    def bounds(self, quantity: str) -> tuple[FloatArray, FloatArray]:
        """Lower and upper limit of a quantity, shape (d,) each; infinite without a limit.

        Args:
            quantity: A name in `JOINT_QUANTITIES`.
        """
        if JOINT_QUANTITIES[quantity].limit == "range":
            return self.lower_position_limit, self.upper_position_limit
        return -self.limits[quantity], self.limits[quantity]


def joint_space(scenario: Scenario) -> JointSpace:
    """Load the joints or robot of a scenario, and resolve its joint values.

    Raises:
        InputError: The robot, its tool frame or a joint or configuration named in the scenario
            does not exist, joint values leave a joint out, or the robot is not supported.

    >>> ends = [{"joints": {"a": 0}}, {"joints": {"a": 90}, "after": 1}]
    >>> space = joint_space(kw.load_scenario({"units": {"angle": "deg"}, "waypoints": ends}))
    >>> space.targets[1].position
    array([1.57079633])
    """
    if scenario.robot is None:
        return _of_bare_joints(scenario)
    robot = _at_rest(scenario, moved_robot(scenario))
    if scenario.gravity is not None:
        with scenario.error_context("gravity"):
            robot = robot.with_gravity(scenario.gravity)
    if isinstance(scenario.prefer, Mapping):
        with scenario.error_context("prefer"):
            robot = robot.with_weights(scenario.prefer)
    if any(isinstance(one, CartesianWaypoint) for one in scenario.waypoints):
        with scenario.error_context("robot"):
            robot.require_tool()
    _check_followers(scenario, robot)
    _check_motion_limits(scenario, robot)
    read = _Reader(robot.joint_names, robot.joint_units, robot.configurations)
    robot = robot.with_limits(**read.limits(scenario))
    if scenario.margin != 1.0:
        robot = robot.with_limits(
            **{
                kind: {
                    joint: scenario.margin * limit
                    for joint, limit in zip(robot.joint_names, robot.limits[kind], strict=True)
                    if np.isfinite(limit)
                }
                for kind in MAGNITUDES
            }
        )
    return JointSpace(
        robot.joint_names,
        robot.joint_units,
        robot.lower_position_limit,
        robot.upper_position_limit,
        dict(robot.limits),
        dict(robot.configurations),
        robot,
        None if robot.base_moves else carrying(scenario, robot),
        **read.task(scenario),
    )


def moved_robot(scenario: Scenario) -> Robot:
    """The robot of a scenario with its tool; its base is the frame of the poses.

    Raises:
        InputError: The robot, its tool frame or a link of a frame does not exist, or no robot
            is named.
    """
    from knotwork.robot import load_robot

    if scenario.robot is None:
        raise InputError(f"{scenario.name} names no robot")
    with scenario.error_context("robot"):
        robot = load_robot(scenario.robot, relative_to=scenario.relative_to)
    tool = scenario.tool
    with scenario.error_context("tool", "frame"):
        robot = robot.with_tool(frame=tool.frame, offset=tool.offset, payload=tool.payload)
    for name, frame in scenario.task.frames.items():  # all links that carry frames are there
        if frame.on is not None:
            with scenario.error_context("frames", name, "on"):
                robot.frame_index(frame.on)
                if frame.on == scenario.on and not robot.base_moves:
                    robot = robot.with_base(frame.on)
    return robot


def _at_rest(scenario: Scenario, robot: Robot) -> Robot:
    """The robot with its unplanned joints set from the task's named configurations."""
    waypoints = enumerate(scenario.task.waypoints)
    named = [(("waypoints", i, "joints"), getattr(one, "joints", None)) for i, one in waypoints]
    for place, name in [(("start",), scenario.task.start), *named]:
        if isinstance(name, str) and name in robot.configurations:
            with scenario.error_context(*place):
                robot = robot.with_rest(name)
    return robot


def _check_followers(scenario: Scenario, robot: Robot) -> None:
    """Refuse joints that mimic planned ones: other code assumes that their links do not move."""
    for follower, master in robot.followers.items():
        with scenario.error_context("robot"):
            raise RobotError(
                robot.name,
                f"joint {follower!r} mimics {master!r}, which moves: links that follow a planned "
                f"joint are not supported; lock one of the two with `locked: {{{follower}: "
                "0}`",
                joint=follower,
            )


def _check_motion_limits(scenario: Scenario, robot: Robot) -> None:
    """Check that the links named in limits exist, and the tool that they require."""
    limits = scenario.motion_limits
    for key in ("tool_speed", "tool_acceleration", "singular_value"):
        if getattr(limits, key) is not None:
            with scenario.error_context("limits", key):
                robot.require_tool()
    for i, one in enumerate(limits.frame_speeds):
        place = [i] * (len(limits.frame_speeds) > 1)
        with scenario.error_context("limits", "frame_speed", *place, "frame"):
            robot.frame_index(one.frame)


def _of_bare_joints(scenario: Scenario) -> JointSpace:
    names = scenario.joint_names
    for name in scenario.joint_units:
        if name not in names:
            with scenario.error_context("joint_units", name):
                raise UnknownNameError("joint", name, names)
    units = tuple(scenario.joint_units.get(name, "rad") for name in names)
    read = _Reader(names, units, {})
    given = read.limits(scenario)
    position = given.get("position", {})
    lower, upper = np.array([position.get(name, (-np.inf, np.inf)) for name in names]).T
    limits = {
        kind: scenario.margin * np.array([given.get(kind, {}).get(name, np.inf) for name in names])
        for kind in MAGNITUDES
    }
    return JointSpace(names, units, lower, upper, limits, **read.task(scenario))


@dataclass(frozen=True)
class _Reader:
    """Reads joint values of a scenario file, in SI."""

    names: tuple[str, ...]
    units: tuple[str, ...]
    configurations: Mapping[str, FloatArray]

    def by_joint(self, given: JointValues, *, si: bool = False) -> dict[str, Any]:
        """Values by joint [rad or m, and per second]; `si` for values that are in SI already."""
        scales = {"rad": 1.0 if si else given.angle, "m": 1.0 if si else given.length}
        scale = {name: scales[unit] for name, unit in zip(self.names, self.units, strict=True)}
        if not isinstance(given.values, Mapping):
            return {name: float(given.values) * scale[name] for name in self.names}
        for name in given.values:
            if name not in scale:
                raise given.places.error(
                    (*given.location, name),
                    f"unknown joint {name!r}",
                    did_you_mean(name, self.names),
                )
        items = given.values.items()
        return {name: np.multiply(value, scale[name]).tolist() for name, value in items}

    def array(self, given: JointValues, *, missing: float | None = None) -> FloatArray:
        """A value for every joint, shape (d,), or a list, (d, m); `missing` for joints left out."""
        if isinstance(given.values, str):
            if given.values not in self.configurations:
                raise given.places.error(
                    given.location,
                    f"unknown configuration {given.values!r}",
                    did_you_mean(given.values, self.configurations),
                )
            return np.array(self.configurations[given.values])
        values = self.by_joint(given)
        absent = [name for name in self.names if name not in values]
        if absent and missing is None:
            raise given.places.error(
                given.location,
                f"gives no value for joint {', '.join(absent)}",
                f"a value for each of {', '.join(self.names)}",
            )
        return np.array([values.get(name, missing or 0.0) for name in self.names])

    def limits(self, scenario: Scenario) -> dict[str, dict[str, Any]]:
        """Limits by quantity and joint; position limits are pairs."""
        found = {kind: getattr(scenario.task.limits, kind) for kind in JOINT_QUANTITIES}
        return {
            kind: self.by_joint(
                scenario.joint_values(values, "limits", kind),
                si=JOINT_QUANTITIES[kind].order is None,
            )
            for kind, values in found.items()
            if values is not None
        }

    def task(self, scenario: Scenario) -> dict[str, Any]:
        """The attributes of a `JointSpace` for the requirements on the joints."""
        task, given = scenario.task, scenario.joint_values
        targets = tuple(
            self._state(waypoint) if isinstance(waypoint, JointTarget) else None
            for waypoint in scenario.waypoints
        )
        standing = [None if one is None or one.velocity.any() else one.position for one in targets]
        near = {
            i: (waypoint.near, "waypoints", k, "near")
            for i, k in enumerate(scenario.index)
            if k >= 0
            and isinstance(waypoint := task.waypoints[k], PoseWaypoint)
            and waypoint.near is not None
        }
        return {
            "targets": targets,
            "waits": tuple(waits(scenario, standing)),
            "near": self.array(given(task.near, "near")) if task.near is not None else None,
            "end_acceleration": self._ends(scenario),
            "accelerations": self._presets(scenario, presets)
            if isinstance(presets := task.planner_options.accelerations, tuple)
            else presets,
            "chosen": tuple(self._chosen(scenario, i) for i in range(len(task.chosen or ())))
            or None,
            "solutions": {i: self.array(given(*one)) for i, one in near.items()},
            "shown_in": scenario.units,
        }

    def _presets(self, scenario: Scenario, values: tuple[Any, ...]) -> FloatArray:
        option = "planner_options", "accelerations"
        places = ((one, *option, i) for i, one in enumerate(values))
        return np.array([self.array(scenario.joint_values(*place)) for place in places])

    def _chosen(self, scenario: Scenario, i: int) -> ChosenRun:
        given = (scenario.task.chosen or ())[i]
        names = [waypoint.name for waypoint in scenario.waypoints]
        velocities = {
            name: scenario.joint_values(values, "chosen", i, "velocities", name)
            for name, values in given.velocities.items()
        }
        for name, values in velocities.items():
            if name not in names:
                raise values.places.error(
                    values.location, f"unknown waypoint {name!r}", did_you_mean(name, names)
                )
        accelerations = scenario.joint_values(given.accelerations, "chosen", i, "accelerations")
        return ChosenRun(
            np.array(given.times),
            self.array(accelerations).T,
            {name: self.array(values) for name, values in velocities.items()},
        )

    def _ends(self, scenario: Scenario) -> tuple[FloatArray, FloatArray] | None:
        ends = scenario.task.end_acceleration
        if ends is None:
            return None
        if isinstance(ends, str):
            return np.zeros(len(self.names)), np.zeros(len(self.names))
        start = scenario.joint_values(ends.start, "end_acceleration", "start")
        end = scenario.joint_values(ends.end, "end_acceleration", "end")
        return self.array(start, missing=0.0), self.array(end, missing=0.0)

    def _state(self, target: JointTarget) -> JointState:
        position = self.array(target.joints)
        if target.velocity is None:
            return JointState(position, np.zeros_like(position))
        return JointState(position, self.array(target.velocity, missing=0.0))
