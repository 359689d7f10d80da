"""A scenario, resolved: SI units, poses and velocities in the robot's base frame."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from knotwork.documents import Document, Location, Places
from knotwork.errors import DocumentError, InputError
from knotwork.robot.payload import Payload
from knotwork.scenario.free_times import FreeTimes
from knotwork.scenario.scene_model import Scene
from knotwork.task.tool import Limits
from knotwork.task.units import si_factors
from knotwork.trajectory.events import Event
from knotwork.units import Units
from knotwork.waypoints import CartesianWaypoint, FloatArray, PoseFreedom

if TYPE_CHECKING:
    import pinocchio as pin

    from knotwork.scenario.path_timing import AskedTiming
    from knotwork.task import PlainTask
    from knotwork.tool_paths import TimedPath
    from knotwork.tool_paths.weave import Weave
    from knotwork.trajectory import JointTrajectory


@dataclass(frozen=True)
class JointValues:
    """Values by joint name as the file gives them, in its units.

    Whether a value is an angle or a length depends on the joint: `joint_space` turns them into SI.

    Attributes:
        values: By joint name numbers, or for limits of position pairs; or one number for every
            joint, or the name of a configuration.
        length: The file's unit of length [m].
        angle: The file's unit of angle [rad].
        places: Of the file, for errors.
        location: Where the values are in it.
    """

    values: Mapping[str, Any] | float | str
    length: float
    angle: float
    places: Places
    location: Location

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the joints that values are given for."""
        return tuple(self.values) if isinstance(self.values, Mapping) else ()


@dataclass(frozen=True)
class JointTarget:
    """A waypoint given by joint values.

    Attributes:
        name: Name of the waypoint.
        time: When [s].
        joints: Joint positions, or the name of a configuration.
        velocity: Joint velocities, or `None` for standing still.
        where: Where the waypoint was defined, for messages.

    >>> ends = [{"joints": {"lift": 0}}, {"joints": {"lift": 1}, "after": 2}]
    >>> target = kw.load_scenario({"waypoints": ends}).waypoints[1]
    >>> type(target).__name__, target.time, target.joints.names
    ('JointTarget', 2.0, ('lift',))
    """

    name: str
    time: float
    joints: JointValues
    velocity: JointValues | None
    where: str = ""
    standing: ClassVar[bool] = False


ScenarioWaypoint = CartesianWaypoint | JointTarget


@dataclass(frozen=True, eq=False)
class Stretch:
    """The part of a tool path that leads from one waypoint to the next.

    Attributes:
        kind: `"line"`, `"arc"` or `"points"`, and before it `"woven "` if a weave is added.
        start, end: When it begins and ends [s].
        speed: That of the TCP along it [m/s].
        full_speed: From when to when [s] that speed is asked for; outside, the speed changes.
        weave: What is added to it, or `None`.
    """

    kind: str
    start: float
    end: float
    speed: float
    full_speed: tuple[float, float]
    weave: Weave | None = None


@dataclass(frozen=True, eq=False)
class ScenarioPath:
    """A tool path through consecutive waypoints of a scenario.

    Attributes:
        first: Index of the waypoint where it begins.
        motion: Poses of the tool over time.
        stretches: From waypoint to waypoint.
        asked: Requirements on their speeds.
        freedom: What its poses leave open, or `None`.
    """

    first: int
    motion: TimedPath
    stretches: tuple[Stretch, ...]
    asked: AskedTiming
    freedom: PoseFreedom | None = None

    @property
    def last(self) -> int:
        """Index of the waypoint where it ends."""
        return self.first + len(self.stretches)


@dataclass(frozen=True, eq=False)
class AskedEvent:
    """An event, and where the tool is to be then.

    Attributes:
        event: What is switched, and when.
        delay: How long after arrival at its waypoint that is [s]; before it, if negative.
        distance: How far along the path it is after its waypoint [m]; before it, if negative.
        path: That path, or `None` where the event has its time from the waypoint.
        arc_length: Of the place along the path [m].
    """

    event: Event
    delay: float = 0.0
    distance: float = 0.0
    path: ScenarioPath | None = None
    arc_length: float = 0.0


@dataclass(frozen=True)
class ToolPlacement:
    """The frame that carries the tool, and the place of the tool centre point (TCP) in it.

    Attributes:
        frame: Name of the frame, or `None` for the robot's own tool frame.
        offset: TCP in the axes of that frame, or `None` for its origin.
        payload: What that frame carries, in its axes, or `None`.
    """

    frame: str | None = None
    offset: pin.SE3 | None = None
    payload: Payload | None = None


def _one_for_each_unit() -> dict[str, float]:
    return {"rad": 1e-6, "m": 1e-6}


@dataclass(frozen=True)
class ToleranceSet:
    """Largest allowed differences between the motion and the task.

    Attributes:
        position: Distance of the TCP [m].
        orientation: Angle between the orientations of the tool [rad].
        linear_velocity: Difference for the TCP [m/s].
        angular_velocity: Difference for the tool [rad/s].
        joint_position: Difference at waypoints given by joint values, by unit: `"rad"`, `"m"`.
        joint_velocity: Difference at the same waypoints, and where the tool is to stop, by unit of
            the joint, per second.
        joint_acceleration: Difference at the two ends, where asked for, by unit of the joint, per
            second squared.
        path: Distance of the TCP from a tool path [m].
        path_orientation: Angle from the orientation along it [rad].
        path_speed: Difference from the speed along it, as a part of that speed.

    >>> ToleranceSet(position=1e-4).joint_position
    {'rad': 1e-06, 'm': 1e-06}
    """

    position: float = 1e-6
    orientation: float = 1e-6
    linear_velocity: float = 1e-6
    angular_velocity: float = 1e-6
    joint_position: Mapping[str, float] = field(default_factory=_one_for_each_unit)
    joint_velocity: Mapping[str, float] = field(default_factory=_one_for_each_unit)
    joint_acceleration: Mapping[str, float] = field(default_factory=_one_for_each_unit)
    path: float = 1e-4
    path_orientation: float = math.radians(0.1)
    path_speed: float = 0.01


SMALLEST_PATH_TOLERANCE = 1e-9
"""Floating point does not hold a motion nearer to a path than this [m, rad, part of the speed]."""


@dataclass(frozen=True)
class Scenario:
    """A task for a robot arm, in SI, with poses and velocities in the robot's base frame.

    Attributes:
        name: Name of the scenario.
        description: What the task is.
        waypoints: In order of time; at least two.
        task: What was asked, as it was given; joint values stand in it alone.
        index: Of each waypoint in the task, -1 for the start; one with a wait stands twice.
        robot: Shipped name, path, or inline description; `None` for a task of joints alone.
        relative_to: Folder that relative paths in `robot` start from, or `None`.
        units: Those of the file, for whatever people read.
        joint_units: Without a robot: `"rad"` or `"m"` by joint; `"rad"` for those left out.
        frames: Named frames of the file, each as `pin.SE3` in the base frame.
        on: Link that poses are given in, if it is not the robot's base frame.
        tool: Where the tool is, and what it weighs.
        gravity: In the axes of the base frame [m/s²], shape (3,); `None` for 9.81 along -z of the
            URDF's root.
        branch: `"free"`; `"keep"`, changed only where speeds ask for it; `"fixed"`; or
            configuration flags by `"shoulder"`, `"elbow"` and `"wrist"`.
        prefer: What decides among solutions: `"travel"` or `"clearance"`; or weights by joint.
        pull_to_middle: For a redundant arm, how fast its joints are pulled to the middle of their
            ranges while the tool passes a waypoint [1/s]; 0 for not at all.
        planner: Name of the planner, with a rule after a colon or without.
        knots: As `knotwork.interpolation` takes it: `"paper"`, `"balanced"`, the constant of
            balanced knots, or the knot times [s], shape (m,).
        paths: Tool paths between its waypoints, in order of time.
        events: What is switched on the way, in order of time; empty while times are free.
        free: Durations, speeds and knots left to be chosen; `None` if it is nothing.
        motion_limits: Limits on the motion of tool and links, in SI, their margin applied.
        scene: The surroundings of the robot, what it carries, and the rules of the collision check.
        margin: Part that is used of limits, but those of position; `motion_limits` have it already.
        tolerances: For the check.
        continuity: Order of continuity that the check asks for.
        rate: Samples per second [Hz].
        source: The file it came from, or `None`.
        places: Where its parts stand in the file, for errors.
        under_way: The motion that it goes on from, and when [s]; `None` for a task by itself.

    >>> from knotwork import load_scenario
    >>> scenario = load_scenario("ur5_deburring")
    >>> [waypoint.name for waypoint in scenario.waypoints][:3]
    ['start', 'approach', 'edge start']
    """

    name: str
    waypoints: tuple[ScenarioWaypoint, ...]
    task: PlainTask = field(repr=False, compare=False)
    index: tuple[int, ...] = ()
    description: str = ""
    robot: str | Document | None = None
    relative_to: Path | None = None
    units: Units = field(default_factory=Units)
    joint_units: Mapping[str, str] = field(default_factory=dict)
    frames: Mapping[str, pin.SE3] = field(default_factory=dict)
    on: str = ""
    tool: ToolPlacement = field(default_factory=ToolPlacement)
    gravity: FloatArray | None = None
    branch: str | Mapping[str, str] = "free"
    prefer: str | Mapping[str, float] = "travel"
    pull_to_middle: float = 0.0
    planner: str = "modified-hermite"
    knots: str | float | FloatArray = "paper"
    paths: tuple[ScenarioPath, ...] = ()
    events: tuple[AskedEvent, ...] = ()
    free: FreeTimes | None = None
    motion_limits: Limits = field(default_factory=Limits)
    scene: Scene = field(default_factory=Scene)
    margin: float = 1.0
    tolerances: ToleranceSet = field(default_factory=ToleranceSet)
    continuity: int = 2
    rate: float = 100.0
    source: Path | None = None
    places: Places = field(default_factory=Places, repr=False, compare=False)
    under_way: tuple[JointTrajectory, float] | None = field(default=None, repr=False, compare=False)

    @contextmanager
    def error_context(self, *location: str | int) -> Iterator[None]:
        """Add to errors of the input which field of the file is at fault.

        Args:
            location: Keys and indices of the field, for example `"tool", "frame"`.

        Raises:
            InputError: As it was raised inside, with file and line where the scenario has them.
        """
        try:
            yield
        except DocumentError:
            raise  # it says so already
        except InputError as error:
            error.locate(self.where(*location))
            raise

    def where(self, *location: str | int) -> str:
        """Where a field is, for messages: with file and line where the scenario has them.

        Args:
            location: Keys and indices of the field.
        """
        return self.places.where(location)

    def joint_values(self, values: Any, *location: str | int) -> JointValues:
        """Joint values of the task with their units and their place in it."""
        length, angle = si_factors(self.task.units)
        return JointValues(values, length, angle, self.places, location)

    @property
    def prefers_clearance(self) -> bool:
        """Whether room to everything counts before travel."""
        return self.prefer == "clearance" and self.task.near is None

    @property
    def shown_length(self) -> tuple[float, str]:
        """How many of the file's units of length a metre has, and the unit's name, for messages."""
        return self.units.shown(1.0, "m")

    @property
    def times(self) -> FloatArray:
        """Times of the waypoints [s], shape (n,); NaN from the first that is free."""
        times = self.provisional_times
        if self.free is not None:
            times[self.free.first_untimed :] = np.nan
        return times

    @property
    def provisional_times(self) -> FloatArray:
        """Times from which free ones are chosen [s], shape (n,), with 1 s or so for each."""
        return np.array([waypoint.time for waypoint in self.waypoints])

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Joints named by the first waypoint; for a scenario without a robot, all its joints."""
        first = self.waypoints[0]
        return first.joints.names if isinstance(first, JointTarget) else ()
