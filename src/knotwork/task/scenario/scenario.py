"""A scenario, resolved: SI units, poses and velocities in the robot's base frame."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.trajectory.motion_events import Event
from knotwork.errors.old_names import OldAttribute
from knotwork.files.documents import Locations
from knotwork.task.scenario.scene_model import Scene
from knotwork.task.scenario.unknowns_reader import ScenarioUnknowns
from knotwork.task.task_options import ToolTolerances
from knotwork.task.tool_and_limits import MotionLimits
from knotwork.units import Units
from knotwork.waypoints import CartesianWaypoint, PoseFreedom

if TYPE_CHECKING:
    import pinocchio as pin

    from knotwork.curves.polynomial import PiecewisePolynomial
    from knotwork.curves.tool_paths import TimedPath
    from knotwork.curves.tool_paths.weave import WeavePattern
    from knotwork.curves.trajectory import JointTrajectory
    from knotwork.task import ExpandedTask
    from knotwork.task.scenario.requested_timing import RequestedTiming


@dataclass(frozen=True)
class JointTarget:
    """A waypoint given by joint values, which `ScenarioJoints.targets` has in SI.

    Attributes:
        name: Name of the waypoint.
        time: Time [s].
        where: Location of the waypoint's definition, for messages.
        in_world_frame: Always `False`, because joint values have no frame.

    >>> ends = [{"joints": {"lift": 0}}, {"joints": {"lift": 1}, "after": 2}]
    >>> target = kw.load_scenario({"waypoints": ends}).waypoints[1]
    >>> type(target).__name__, target.time
    ('JointTarget', 2.0)
    """

    name: str
    time: float
    where: str = ""
    in_world_frame: ClassVar[bool] = False


ScenarioWaypoint = CartesianWaypoint | JointTarget


@dataclass(frozen=True, eq=False)
class Stretch:
    """The part of a tool path between two consecutive waypoints.

    Attributes:
        kind: Kind, as in messages: `"line"`, `"arc"` or `"points"`, prefixed by `"woven "` if a
            weave is added, or `"place"` for a wait in a moving frame.
        start, end: Time interval [s].
        speed: Speed of the TCP along it [m/s]; in a wait, the scale of its tolerances.
        full_speed_interval: Time interval of that speed [s]; outside, the speed changes.
        weave: The added weave, or `None`.
    """

    kind: str
    start: float
    end: float
    speed: float
    full_speed_interval: tuple[float, float]
    weave: WeavePattern | None = None


@dataclass(frozen=True, eq=False)
class ScenarioPath:
    """A tool path through consecutive waypoints of a scenario.

    Attributes:
        first: Index of its first waypoint in the scenario.
        timed_path: Poses of the tool over time.
        stretches: Stretches from waypoint to waypoint.
        requested: Requirements on their speeds.
        freedom: Freedom of its poses, or `None`.
        clock: Time in `timed_path` as a function of the time of the stretches, if it is executed at
            another speed; `None` in a task.
    """

    first: int
    timed_path: TimedPath
    stretches: tuple[Stretch, ...]
    requested: RequestedTiming
    freedom: PoseFreedom | None = None
    clock: PiecewisePolynomial | None = None

    motion = OldAttribute("timed_path")

    @property
    def last(self) -> int:
        """Index of its last waypoint in the scenario."""
        return self.first + len(self.stretches)

    @property
    def times(self) -> FloatArray:
        """Times of its waypoints [s]."""
        return np.array([self.stretches[0].start, *(part.end for part in self.stretches)])


@dataclass(frozen=True, eq=False)
class RequestedEvent:
    """An event and its position in the motion.

    Attributes:
        event: The signal and its time.
        delay: Time after arrival at its waypoint [s]; before it, if negative.
        distance: Distance along the path after its waypoint [m]; before it, if negative.
        path: Its path, or `None` for an event timed relative to the waypoint.
        arc_length: Arc length of the event along the path [m].
    """

    event: Event
    delay: float = 0.0
    distance: float = 0.0
    path: ScenarioPath | None = None
    arc_length: float = 0.0


MIN_PATH_TOLERANCE = 1e-9
"""Limit of floating point for the tolerances of a path [m, rad, fraction of the speed]."""


@dataclass(frozen=True)
class Scenario:
    """A task for a robot arm, in SI except `task`, with poses in the robot's base frame.

    Joint values have units that depend on the robot: `ScenarioJoints` has them in SI. Its waypoints
    include the start and the ends of waits; "by waypoint" is by their index. The duration to a
    waypoint is NaN in `durations` if planning chooses it, or the speed along a path to there; all
    later waypoints are NaN in `times`. `expected_times` has guesses in place of NaN, for moving
    frames and bodies.

    Attributes:
        name: Name of the scenario.
        waypoints: At least two waypoints, in order of time.
        task: The task in its own units, its repeats written out. Planning and check read their
            options from it; changed tasks are made from it, and it is saved.
        planner: Name of the planner: the task's own, or the one passed to `plan`.
        tolerances: Tolerances of tool and path, in SI.
        task_index: Index in the task of each waypoint, -1 for the start; one with a wait appears
            twice.
        units: Units of the file, for output.
        pose_frame_link: Link that carries the frame of poses, if it is not the robot's base frame.
        paths: Tool paths between its waypoints, in order of time.
        events: Events in order of time; empty while times are unknown.
        unknowns: Durations, speeds and knots to be chosen, or `None`.
        motion_limits: Limits on the motion of tool and links, in SI, scaled by their used fraction.
        scene: Surroundings, held objects, and options of the collision check.
        locations: Locations of its parts in the file, for errors.
        continued_motion: The motion that it continues, and the time in it [s], or `None`.

    >>> from knotwork import load_scenario
    >>> scenario = load_scenario("ur5_deburring")
    >>> [waypoint.name for waypoint in scenario.waypoints][:3]
    ['start', 'approach', 'edge start']
    """

    name: str
    waypoints: tuple[ScenarioWaypoint, ...]
    task: ExpandedTask = field(repr=False, compare=False)
    planner: str
    tolerances: ToolTolerances
    task_index: tuple[int, ...] = ()
    units: Units = field(default_factory=Units)
    pose_frame_link: str = ""
    paths: tuple[ScenarioPath, ...] = ()
    events: tuple[RequestedEvent, ...] = ()
    unknowns: ScenarioUnknowns | None = None
    motion_limits: MotionLimits = field(default_factory=MotionLimits)
    scene: Scene = field(default_factory=Scene)
    locations: Locations = field(default_factory=Locations, repr=False, compare=False)
    continued_motion: tuple[JointTrajectory, float] | None = field(
        default=None, repr=False, compare=False
    )

    given = OldAttribute("task")

    @property
    def source(self) -> Path | None:
        """Its file, or `None`."""
        return self.locations.file

    def where(self, *location: str | int) -> str:
        """Location of a field for messages, with file and line where known.

        Args:
            location: Keys and indices of the field.
        """
        return self.locations.where(location)

    @property
    def branch(self) -> str | dict[str, str]:
        """`"free"`, `"keep"`, `"fixed"`, or words by `"shoulder"`, `"elbow"` and `"wrist"`."""
        branch = self.task.branch
        if isinstance(branch, str):
            return branch
        return {part: word for part, word in branch if word is not None}

    @property
    def frame_placements(self) -> dict[str, pin.SE3]:
        """Named frames of the file, each at rest in the base frame."""
        return {name: frame.rest_placement for name, frame in self.scene.frames.items()}

    @property
    def required_unknowns(self) -> ScenarioUnknowns:
        """The unknowns, which must exist."""
        if self.unknowns is None:
            raise TypeError("every time and speed of the scenario is given")
        return self.unknowns

    @property
    def times(self) -> FloatArray:
        """Times of the waypoints [s], shape (n,); NaN after an unknown duration."""
        times = self.expected_times
        times[1:][np.isnan(self.durations.cumsum())] = np.nan
        return times

    @property
    def durations(self) -> FloatArray:
        """Time from each waypoint to the next [s], shape (n - 1,); NaN where it is not given."""
        durations = np.diff(self.expected_times)
        if self.unknowns is not None:
            arrivals = self.unknowns.at_waypoints[1:]
            durations[[not arrival.duration_is_given for arrival in arrivals]] = np.nan
        return durations

    @property
    def expected_times(self) -> FloatArray:
        """Times of the waypoints [s], shape (n,); unknown ones as expected."""
        return np.array([waypoint.time for waypoint in self.waypoints])
