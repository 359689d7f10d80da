"""`Task`: a task for a robot arm, as given by a scenario file or a Python program."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Tag

from knotwork.files import storage
from knotwork.files.documents import Text, apply_edits, validate
from knotwork.files.documents.values import (
    Forms,
    Items,
    JointsOrName,
    NonEmpty,
    NotNegative,
    Number,
    Positive,
    Vector3,
    optional,
    required,
)
from knotwork.files.documents.yaml_text import to_block_yaml
from knotwork.task.actions import Output, one_name_each
from knotwork.task.left_to_planning import ChosenSectionFields, Way, Weights
from knotwork.task.poses import Frame
from knotwork.task.scene_shapes import Collisions, HeldObject, Surroundings
from knotwork.task.task_options import (
    Balanced,
    Branch,
    EndAcceleration,
    PathOptions,
    PlannerOptionFields,
    Tolerances,
)
from knotwork.task.task_part import TaskPart
from knotwork.task.task_source import moved_paths, read_document, with_moved_paths
from knotwork.task.task_waypoints import KINDS, JointWaypoint, TaggedWaypoint, Waypoint, by_key
from knotwork.task.tool_and_limits import Limits, Tool
from knotwork.units import Units


class TaskUnits(TaskPart):
    """Units of every value in the file; times are in seconds and masses in kilograms."""

    length: Literal["m", "mm"] = optional("Unit of positions, speeds and prismatic joints", "m")
    angle: Literal["rad", "deg"] = optional("Unit of orientations and revolute joints", "rad")

    @property
    def in_si(self) -> tuple[float, float]:
        """The units of length [m] and angle [rad]."""
        return 1.0 if self.length == "m" else 1e-3, 1.0 if self.angle == "rad" else math.pi / 180

    @property
    def for_output(self) -> Units:
        """The same units, with methods to show values."""
        return Units(self.length, self.angle)


class PlacesFile(TaskPart):
    """Places in a CSV file."""

    file: Text = required(
        "Path of a CSV file, relative to this file, with the columns x, y, z, and "
        "qx, qy, qz, qw for orientations; its numbers are in this file's unit of "
        "length",
        path=True,
    )
    parent: Text = optional("base or the name of a frame", "base", key="in")


class Repeat(TaskPart):
    """Waypoints that are repeated, once at each place."""

    over: Annotated[
        Text
        | PlacesFile
        | NonEmpty[
            Annotated[Text | Frame, Forms("the name of a frame, or a mapping with a position")]
        ],
        Forms("the name of a frame with a grid, a list of frames and places, or a file"),
    ] = required(
        "Places: a frame with a grid, a list of frame names and of places, or a CSV "
        "file; inside the block, the frame place is the current place"
    )
    holds: dict[Text, HeldObject] = optional(
        "Objects held by the tool in each repetition, as holds of the tool", {}
    )
    repeat: NonEmpty[Waypoint] = required(
        "Waypoints of one repetition; its number is added to all names in it"
    )


TaskItem = Annotated[
    TaggedWaypoint | Annotated[Repeat, Tag("Repeat")],
    by_key({"repeat": "Repeat"} | KINDS, "either pose or joints, not both, or with repeat"),
]


class Task(TaskPart):
    """A task for a robot arm, in its own `units`: waypoints, and options of plan and check.

    Its fields are the keys of a scenario file. The default of `units` is SI.
    `kw.plan` and all other functions with a scenario as argument accept a task.

    >>> ends = [kw.task.JointWaypoint(joints={"lift": z}, after=z or None) for z in (0.0, 2.0)]
    >>> kw.plan(kw.Task(waypoints=ends)).trajectory.duration
    2.0

    Raises:
        DocumentError: A value is missing, unknown or wrong; `problems` has all of them.
    """

    name: Text | None = optional("Name of the task; left out: the file's name")
    description: str = optional("Description of the task, for reports", "")
    units: TaskUnits = optional("Units of every value in the file", TaskUnits.model_construct())
    robot: (
        Annotated[
            Text | dict[str, Any], Forms("a robot's name, a path, or a mapping that describes one")
        ]
        | None
    ) = optional(
        "A shipped robot's name, the path of a robot file or URDF (relative to this "
        "file), or a robot description in place",
        path=True,
    )
    joint_units: dict[str, Literal["rad", "m"]] = optional(
        "Without a robot: prismatic joints (m); joints left out are revolute (rad)", {}
    )
    tool: Tool | None = optional(
        "The tool; left out: the robot's tool frame is the TCP", needs_robot=True
    )
    gravity: Vector3 | None = optional(
        "Gravity in the axes of the base frame, for an arm on a wall or a ceiling; "
        "left out: 9.81 along -z of the URDF's root",
        unit="m/s²",
        needs_robot=True,
    )
    frames: dict[str, Frame] = optional("Named frames, in the base or in one another", {})
    frame: Text | None = optional("Frame of poses that name none; left out: base")
    scene: Surroundings = optional(
        "Surroundings of the robot", Surroundings.model_construct(), needs_robot=True
    )
    collisions: Collisions = optional(
        "Collision checks and their precision", Collisions.model_construct(), needs_robot=True
    )
    outputs: Annotated[dict[Text, Output], AfterValidator(one_name_each)] = optional(
        "Numbers of the digital outputs switched by the signals of do, by signal name", {}
    )
    start: JointsOrName | None = optional(
        "Configuration at time 0, at rest, before the waypoints: a configuration by "
        "name, or every joint",
        unit="angle or length",
        defines_motion=True,
    )
    near: JointsOrName | None = optional(
        "Reference configuration; at every waypoint the IK solution nearest to it is taken, with "
        "the whole turns that are nearest to the motion before; left out: minimum travel from the "
        "start, else from home",
        unit="angle or length",
        needs_robot=True,
        defines_motion=True,
    )
    branch: Annotated[
        Literal["free", "keep", "fixed"] | Branch,
        Forms("free, keep, fixed or a mapping of shoulder, elbow and wrist to words"),
    ] = optional(
        "IK branch. keep: that of the first waypoint, unless a velocity limit needs another one; "
        "fixed: that of the first waypoint in any case; a mapping names it. For arms of six "
        "joints; others have near",
        "free",
        needs_robot=True,
        defines_motion=True,
    )
    prefer: Annotated[
        Literal["travel", "clearance"] | dict[Text, Positive],
        Forms("travel, clearance or a mapping of joints to weights"),
    ] = optional(
        "Criterion among the remaining solutions. travel: minimum joint travel; clearance: "
        "maximum clearance at the waypoints, up to 0.1 m; near takes precedence. A mapping gives "
        "weights of joints, 1 for joints left out, in the travel and in the joint speeds of a "
        "redundant arm: {rail: 0.2} lets the rail follow and the arm keep its posture",
        "travel",
        needs_robot=True,
        defines_motion=True,
    )
    pull_to_middle: NotNegative = optional(
        "Rate at which self-motion pulls joints towards the middle of their range; for arms of "
        "more than six joints, where they pass a pose at speed, as far as the tool's velocity and "
        "the limits allow; left out: minimum joint speeds",
        0.0,
        unit="1/s",
        needs_robot=True,
        defines_motion=True,
    )
    planner: Text = optional(
        "A planner's name; `knotwork planners` lists them", "modified-hermite", defines_motion=True
    )
    knots: Annotated[
        Literal["paper", "balanced", "optimal"] | Balanced | Items[Number],
        Forms("paper, balanced, optimal, {balanced: c} or a list of knot times"),
    ] = optional(
        "Knots of modified-hermite: by the paper's Eq. (39), balanced next to each "
        "waypoint, at the given times, or optimal: for the best objective within "
        "the limits; left out where some times are chosen: optimal",
        "paper",
        unit="s",
        defines_motion=True,
    )
    times: Literal["fastest"] | None = optional(
        "fastest: the default of after, for waypoints without a time", defines_motion=True
    )
    ways: Way | None = optional(
        "Default of way, for waypoints that end no tool path", needs_robot=True, defines_motion=True
    )
    duration: Positive | None = optional(
        "Total duration, where times are chosen; the smoothest motion of that duration is planned",
        unit="s",
        defines_motion=True,
    )
    objective: (
        Annotated[
            Literal["time", "jerk", "effort", "acceleration"] | Weights,
            Forms("time, jerk, effort, acceleration, or a mapping of these to weights"),
        ]
        | None
    ) = optional(
        "Objective minimised where times or knots are chosen: the duration, or the "
        "integral of jerk, effort or acceleration squared; "
        "left out: the duration, or jerk where that is given",
        defines_motion=True,
    )
    chosen: NonEmpty[ChosenSectionFields] | None = optional(
        "Knots and accelerations of sections with chosen times, as `knotwork plan "
        "--freeze` writes them",
        defines_motion=True,
    )
    end_acceleration: (
        Annotated[Literal["zero"] | EndAcceleration, Forms("zero or a mapping with start and end")]
        | None
    ) = optional(
        "Joint accelerations at the two ends; left out: chosen by the planner", defines_motion=True
    )
    planner_options: PlannerOptionFields = optional(
        "Further options of some planners",
        PlannerOptionFields.model_construct(),
        defines_motion=True,
    )
    limits: Limits = optional(
        "Limits that replace those of the robot, or limit the motion of tool and links",
        Limits.model_construct(),
    )
    tolerances: Tolerances = optional("Tolerances of the check", Tolerances.model_construct())
    continuity: Literal[0, 1, 2] = optional(
        "Continuity required by the check: 2 means no jump of acceleration", 2
    )
    path: PathOptions = optional(
        "Options of tool paths", PathOptions.model_construct(), defines_motion=True
    )
    rate: Positive = optional("Samples per second in samples.csv", 100.0, unit="Hz")
    waypoints: NonEmpty[TaskItem] = required(
        "At least two in order of time, or one after a start; some may be repeated",
        defines_motion=True,
    )

    @classmethod
    def load(cls, reference: str | Path | Mapping[str, Any]) -> Task:
        """Read a task: a shipped scenario by name, a file by path, or a mapping with the same keys.

        Paths become absolute. A task without a name gets the name of the file.

        >>> [one.name for one in kw.Task.load("ur5_deburring").waypoints][:2]
        ['approach', 'edge start']

        Raises:
            InputError: The file can't be read, or a value in it is wrong, as for `load_scenario`.
        """
        document = read_document(reference)
        if document.file is None:
            return validate(cls, document)
        moved = moved_paths(cls, document.data, document.file.parent.resolve(), None)
        task = validate(cls, apply_edits(document, moved))
        return task if task.name else task.replace(name=document.file.stem)

    def save(self, path: str | Path) -> Path:
        """Write a scenario file that gives this task again.

        Args:
            path: The file to write; an existing one is replaced.

        Raises:
            InputError: The file can't be written.
        """
        target = Path(path)
        data = self.to_dict()
        text = to_block_yaml(
            with_moved_paths(type(self), data, Path.cwd(), target.parent.resolve())
        )
        return storage.write_files(target.parent, {target.name: text})[0]


class ExpandedTask(Task):
    """A task in its own `units`, with repeats written out; `task_index` refers to its waypoints."""

    waypoints: NonEmpty[Waypoint] = required("At least two in order of time, or one after a start")

    def is_moving_frame(self, name: str) -> bool:
        """Whether a frame, or one of its parents, moves."""
        while (frame := self.frames.get(name)) is not None and frame.moves is None:
            name = frame.parent
        return frame is not None

    def frame_of(self, waypoint: Waypoint) -> str:
        """Name of the frame of a waypoint; joint values do not depend on it."""
        own = None if isinstance(waypoint, JointWaypoint) else waypoint.frame
        return own or self.frame or "base"

    def with_waypoints(self, changes: Mapping[int, Mapping[str, Any]]) -> ExpandedTask:
        """A copy with changed values at some waypoints, validated.

        Args:
            changes: Values by field name, as for `replace`, by index of the waypoint.

        Raises:
            DocumentError: A value is unknown or wrong.
        """
        waypoints = [
            waypoint.replace(**changes.get(i, {})) for i, waypoint in enumerate(self.waypoints)
        ]
        return self.replace(waypoints=waypoints)
