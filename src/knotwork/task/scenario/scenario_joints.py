"""The joints that a scenario moves, and its requirements on them, in SI.

The joints are those of its robot, with its tool and limits, or bare joints without a robot.
Planning and checking start with it. `joint_reader` converts joint values from the units of files.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.errors import InputError, RobotError, UnknownNameError
from knotwork.errors.old_names import OldAttribute
from knotwork.files.documents import Location
from knotwork.joint_quantities import MOTION_QUANTITIES, JointLimits
from knotwork.task import JointWaypoint, LinkSpeed, TaskUnits, Tool
from knotwork.task.scenario.joint_reader import JointReader, JointState, find_rest_intervals
from knotwork.task.scenario.payloads import LoadedRobots, read_payload, robots_with_loads
from knotwork.task.scenario.scenario import Scenario
from knotwork.task.si_units import to_si
from knotwork.units import Units
from knotwork.waypoints import CartesianWaypoint, ChosenSection

if TYPE_CHECKING:
    from knotwork.curves.trajectory import JointTrajectory
    from knotwork.robot import Robot


@dataclass(frozen=True, eq=False)
class ScenarioJoints:
    """The joints of a scenario and the requirements on them, in SI, by index of its waypoint.

    Planning and check read joint values only from here, never from the task, whose units differ.

    Attributes:
        joint_names: Names, length d.
        joint_units: `"rad"` or `"m"` for each joint.
        limits: Their limits: the fraction that the task uses.
        robot: The robot with the scenario's tool and position limits, or `None`.
        loaded_robots: The same robot with its loads over the motion, or `None`.
        targets: Required joint values at each waypoint; `None` for a pose.
        near: Joint positions near which solutions are chosen [rad or m], shape (d,), or `None`.
        end_acceleration: Required at the start and at the end [rad/s² or m/s²], shape (d,) each,
            or `None`.
        accelerations: Planner option of this name; values as an array of shape (n, d) in SI.
        tolerances: By `"joint_position"`, `"joint_velocity"` and `"joint_acceleration"`, each of
            shape (d,), in the unit of the joint, per second and per second squared.
        rest_intervals: Intervals over which the arm rests, by index of the waypoint before.
        chosen_sections: Sections of waypoints with a chosen motion, or `None`.
        near_at_waypoints: Joint positions near which solutions are chosen at waypoints [rad or m],
            shape (d,), by index of the waypoint.
        units: Units of the scenario, for output.
    """

    joint_names: tuple[str, ...]
    joint_units: tuple[str, ...]
    limits: JointLimits
    robot: Robot | None = None
    loaded_robots: LoadedRobots | None = None
    targets: tuple[JointState | None, ...] = ()
    near: FloatArray | None = None
    end_acceleration: tuple[FloatArray, FloatArray] | None = None
    accelerations: str | FloatArray | None = None
    tolerances: Mapping[str, FloatArray] = field(default_factory=dict)
    rest_intervals: tuple[int, ...] = ()
    chosen_sections: tuple[ChosenSection, ...] | None = None
    near_at_waypoints: Mapping[int, FloatArray] = field(default_factory=dict)
    units: Units = field(default_factory=Units)

    waits = OldAttribute("rest_intervals")


def to_file_units(
    joints: ScenarioJoints | JointTrajectory, values: FloatArray, units: TaskUnits
) -> dict[str, Any]:
    """Values by joint in the units of a task.

    Args:
        joints: The joints.
        values: Their values in SI, shape (d,), or (n, d) for a list of each joint.
        units: Units of the task.
    """
    length, angle = units.in_si
    unit = np.where(np.array(joints.joint_units) == "m", length, angle)
    return dict(zip(joints.joint_names, (values / unit).T.tolist(), strict=True))


def read_scenario_joints(scenario: Scenario) -> ScenarioJoints:
    """Load the joints or robot of a scenario, and resolve its joint values.

    Raises:
        InputError: The robot, its tool frame or a joint or configuration named in the scenario
            does not exist, joint values leave a joint out, or the robot is not supported.

    >>> ends = [{"joints": {"a": 0}}, {"joints": {"a": 90}, "after": 1}]
    >>> scenario = kw.load_scenario({"units": {"angle": "deg"}, "waypoints": ends})
    >>> read_scenario_joints(scenario).targets[1].position
    array([1.57079633])
    """
    used_fraction = scenario.task.limits.used_fraction
    robot = loaded_robots = None
    if scenario.task.robot is None:
        reader = _bare_joints(scenario)
        limits = JointLimits.by_joint(reader.names, reader.limits()).scaled(used_fraction)
    else:
        robot = _configured_robot(scenario)
        reader = JointReader(scenario, robot.joint_names, robot.joint_units, robot.configurations)
        robot = robot.with_limits(**reader.limits()).with_used_fraction(used_fraction)
        limits = robot.limits
        if not robot.base_moves:
            loaded_robots = robots_with_loads(scenario, robot)
    near = scenario.task.near
    targets = reader.targets()
    return ScenarioJoints(
        reader.names,
        reader.units,
        limits,
        robot,
        loaded_robots,
        targets,
        near=None if near is None else reader.array(near, "near"),
        end_acceleration=reader.end_acceleration(),
        accelerations=reader.accelerations(),
        tolerances={f"joint_{name}": reader.tolerance(name) for name in MOTION_QUANTITIES[:3]},
        rest_intervals=tuple(find_rest_intervals(scenario, targets)),
        chosen_sections=reader.chosen_sections(),
        near_at_waypoints=reader.near_at_waypoints(),
        units=scenario.units,
    )


def _configured_robot(scenario: Scenario) -> Robot:
    """The robot of a scenario with its tool, gravity, weights and unplanned joints."""
    task = scenario.task
    robot = _with_unplanned_joints(scenario, robot_with_tool(scenario))
    if task.gravity is not None:
        with scenario.locations.errors_at("gravity"):
            robot = robot.with_gravity(task.gravity)
    if isinstance(task.prefer, Mapping):
        with scenario.locations.errors_at("prefer"):
            robot = robot.with_weights(task.prefer)
    if any(isinstance(waypoint, CartesianWaypoint) for waypoint in scenario.waypoints):
        with scenario.locations.errors_at("robot"):
            robot.require_tool()
    _check_followers(scenario, robot)
    _check_motion_limits(scenario, robot)
    return robot


def robot_with_tool(scenario: Scenario) -> Robot:
    """The robot of a scenario with its tool; its base is the frame of the poses.

    Raises:
        InputError: The robot, its tool frame or a link of a frame does not exist, or no robot
            is named.
    """
    from knotwork.robot import load_robot
    from knotwork.task.scenario.geometry import read_placement

    task = scenario.task
    file = scenario.locations.file
    if task.robot is None:
        raise InputError(f"{scenario.name} names no robot")
    with scenario.locations.errors_at("robot"):
        robot = load_robot(
            scenario.locations.document(task.robot, ("robot",))
            if isinstance(task.robot, dict)
            else task.robot,
            relative_to=file.parent if file is not None else None,
        )
    tool = to_si(task.tool or Tool.model_construct(), task.units)
    offset = None
    if tool.offset is not None:
        offset = read_placement(tool.offset, scenario.locations, ("tool", "offset"))
    payload = read_payload(tool, scenario.locations, ("tool",))
    with scenario.locations.errors_at("tool", "frame"):
        robot = robot.with_tool(frame=tool.frame, offset=offset, payload=payload)
    for name, frame in task.frames.items():  # all links that carry frames exist
        if frame.on is not None:
            with scenario.locations.errors_at("frames", name, "on"):
                robot.link_index(frame.on)
                if frame.on == scenario.pose_frame_link and not robot.base_moves:
                    robot = robot.with_base(frame.on)
    return robot


def _with_unplanned_joints(scenario: Scenario, robot: Robot) -> Robot:
    """The robot with its unplanned joints set from the task's named configurations."""
    joint_values: dict[Location, Any] = {("start",): scenario.task.start}
    for i, waypoint in enumerate(scenario.task.waypoints):
        if isinstance(waypoint, JointWaypoint):
            joint_values["waypoints", i, "joints"] = waypoint.joints
    for location, joints in joint_values.items():
        if isinstance(joints, str) and joints in robot.configurations:
            with scenario.locations.errors_at(*location):
                robot = robot.with_unplanned_at(joints)
    return robot


def _check_followers(scenario: Scenario, robot: Robot) -> None:
    """Refuse joints that mimic planned ones: other code assumes that their links do not move."""
    if robot.followers:
        follower, master = next(iter(robot.followers.items()))
        raise RobotError(
            robot.name,
            f"joint {follower!r} mimics {master!r}, which moves: links that follow a planned joint "
            f"are not supported; lock one of the two with `locked: {{{follower}: 0}}`",
            joint=follower,
            where=scenario.where("robot"),
        )


def _check_motion_limits(scenario: Scenario, robot: Robot) -> None:
    """Check that the links named in limits exist, and the tool that they require."""
    limits = scenario.motion_limits
    for key, value in limits:
        if value is not None and key != "frame_speed":
            with scenario.locations.errors_at("limits", key):
                robot.require_tool()
    for i, limit in enumerate(limits.link_speeds):
        item = () if isinstance(scenario.task.limits.frame_speed, LinkSpeed) else (i,)
        with scenario.locations.errors_at("limits", "frame_speed", *item, "frame"):
            robot.link_index(limit.link)


def _bare_joints(scenario: Scenario) -> JointReader:
    """The reader of the joints of a scenario without a robot."""
    task = scenario.task
    first = task.waypoints[0]
    names = tuple(task.start or (first.joints if isinstance(first, JointWaypoint) else ()))
    for name in task.joint_units:
        if name not in names:
            where = scenario.where("joint_units", name)
            raise UnknownNameError("joint", name, names, where=where)
    return JointReader(scenario, names, tuple(task.joint_units.get(name, "rad") for name in names))
