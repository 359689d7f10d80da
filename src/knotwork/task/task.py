"""`Task`: what a robot arm is to do, as a scenario file or a program in Python gives it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field

from knotwork import storage
from knotwork.documents import Document, Text, edited, validate
from knotwork.documents.edits import block
from knotwork.documents.values import (
    Forms,
    Items,
    JointsOrName,
    Number,
    Positive,
    Several,
    Vector3,
    optional,
)
from knotwork.task.actions import Output, one_name_each
from knotwork.task.freedoms import ChosenMotion, Way, Weights
from knotwork.task.options import (
    Balanced,
    Branch,
    EndAcceleration,
    PathOptions,
    Presets,
    Tolerances,
)
from knotwork.task.part import TaskPart
from knotwork.task.places import moved_paths, read_document
from knotwork.task.poses import Frame
from knotwork.task.repeats import Step
from knotwork.task.scene import Collisions, Surroundings
from knotwork.task.tool import Limits, Tool
from knotwork.task.waypoints import Waypoint


class TaskUnits(TaskPart):
    """Units of every value in the file; seconds and kilograms stay what they are."""

    length: Literal["m", "mm"] = optional("Of positions, speeds and sliding joints", "m")
    angle: Literal["rad", "deg"] = optional("Of orientations and turning joints", "rad")


class Task(TaskPart):
    """A task for a robot arm: waypoints with times and speeds, and how to plan and check it.

    Its fields are the keys of a scenario file; values are in SI unless `units` says
    otherwise. `kw.plan` and all that takes a scenario take it.

    >>> ends = [kw.task.JointWaypoint(joints={"lift": z}, after=z or None) for z in (0.0, 2.0)]
    >>> kw.plan(kw.Task(waypoints=ends)).trajectory.duration
    2.0

    Raises:
        DocumentError: A value is missing, unknown or wrong; names every one of them.
    """

    name: Text | None = optional("Left out: the file's name")
    description: str = optional("What the task is, for reports", "")
    units: TaskUnits = optional("Units of every value in the file", TaskUnits.model_construct())
    robot: (
        Annotated[
            Text | dict[str, Any],
            Forms("a robot's name, a path, or a mapping that describes one"),
        ]
        | None
    ) = optional(
        "A shipped robot's name, the path of a robot file or URDF (relative to this "
        "file), or a robot description in place"
    )
    joint_units: dict[str, Literal["rad", "m"]] = optional(
        "Without a robot: which joints slide (m); those left out turn (rad)", {}
    )
    tool: Tool | None = optional("The tool; left out: the robot's tool frame is the TCP")
    gravity: Vector3 | None = optional(
        "In the axes of the base frame, for an arm on a wall or a ceiling [m/s²]; left "
        "out: 9.81 along -z of the URDF's root"
    )
    frames: dict[str, Frame] = optional("Named frames, in the base or in one another", {})
    frame: Text | None = optional("Frame of poses that name none; left out: base")
    scene: Surroundings = Field(
        default_factory=Surroundings, description="What stands around the robot"
    )
    collisions: Collisions = Field(
        default_factory=Collisions, description="What is checked for collisions, and how closely"
    )
    outputs: Annotated[dict[Text, Output], AfterValidator(one_name_each)] = optional(
        "Numbers of the digital outputs that signals of do switch, by their names", {}
    )
    start: JointsOrName | None = optional(
        "Where the motion starts, at rest, at time 0, before the waypoints: a "
        "configuration by name, or every joint [angle or length]"
    )
    near: JointsOrName | None = optional(
        "Prefer the solutions nearest to this, for every waypoint; whole turns follow "
        "the motion. Left out: the way of least travel from the start, else from home"
    )
    branch: Annotated[
        Literal["free", "keep", "fixed"] | Branch,
        Forms("free, keep, fixed or a mapping of shoulder, elbow and wrist to words"),
    ] = optional(
        "Branch of the solutions: keep that of the first waypoint unless speeds forbid "
        "it, hold it fixed, or the one named; for arms of six joints, all others have near",
        "free",
    )
    prefer: Annotated[
        Literal["travel", "clearance"] | dict[Text, Positive],
        Forms("travel, clearance or a mapping of joints to weights"),
    ] = optional(
        "What decides among solutions that nothing else rules out: least travel, or "
        "most room to everything: at the waypoints, up to 0.1 m, and then of a few sequences over "
        "the whole motion; near comes before. A mapping gives weights of joints, 1 for those left "
        "out, to travel and to the joint speeds of a redundant arm: {rail: 0.2} lets the rail "
        "follow and the arm keep its posture",
        "travel",
    )
    pull_to_middle: Positive | None = optional(
        "For an arm of more than six joints: where it passes a pose at speed, its "
        "joints also move at this rate to the middle of their ranges, as far as tool and velocity "
        "limits let them [1/s]; left out: the least joint speeds that move the tool as asked"
    )
    planner: Text = optional("A planner's name; `knotwork planners` lists them", "modified-hermite")
    knots: Annotated[
        Literal["paper", "balanced", "optimal"] | Balanced | Items[Number],
        Forms("paper, balanced, optimal, {balanced: c} or a list of knot times"),
    ] = optional(
        "Where modified-hermite builds its knots: by the paper's Eq. (39), balanced "
        "next to each waypoint, at the times given [s], or optimal: where they serve the objective "
        "best, within the limits. Left out where some times are free: optimal",
        "paper",
    )
    times: Literal["fastest"] | None = optional(
        "fastest: for every waypoint that gives no time, as after: fastest there"
    )
    ways: Way | None = optional("As way at every waypoint that does not end a tool path")
    duration: Positive | None = optional(
        "Of the whole motion, where times are free: the smoothest so long [s]"
    )
    objective: (
        Annotated[
            Literal["time", "jerk", "effort", "acceleration"] | Weights,
            Forms("time, jerk, effort, acceleration, or a mapping of these to weights"),
        ]
        | None
    ) = optional(
        "What is minimised where times or knots are chosen: the duration, or the "
        "integral of jerk, effort or acceleration squared; "
        "left out: the duration, or jerk where that is given"
    )
    chosen: Several[ChosenMotion] | None = optional(
        "Knots and accelerations of runs whose times were chosen, as `knotwork plan "
        "--freeze` writes them"
    )
    end_acceleration: (
        Annotated[
            Literal["zero"] | EndAcceleration,
            Forms("zero or a mapping with start and end"),
        ]
        | None
    ) = optional("Joint accelerations at the two ends; left out: what the planner makes of them")
    planner_options: Presets = optional(
        "Further options of some planners", Presets.model_construct()
    )
    limits: Limits = optional(
        "Take the place of the robot's limits, or limit the motion of tool and links",
        Limits.model_construct(),
    )
    tolerances: Tolerances = optional(
        "How far the check lets the motion be from what was asked", Tolerances.model_construct()
    )
    continuity: Literal[0, 1, 2] = optional(
        "Continuity the check asks for: 2 means no jump of acceleration", 2
    )
    path: PathOptions = optional("How the tool moves along paths", PathOptions.model_construct())
    rate: Positive = optional("Samples per second in samples.csv [Hz]", 100.0)
    waypoints: Several[Step] = Field(
        description="Two at least, or one after a start, in order of time; some may be repeated"
    )

    @classmethod
    def load(cls, reference: str | Path | Mapping[str, Any]) -> Task:
        """Read a task: a shipped scenario by name, a file by path, or a mapping of the same shape.

        Paths in it become absolute; the name of a file is that of a task without one.

        >>> [one.name for one in kw.Task.load("ur5_deburring").waypoints][:2]
        ['approach', 'edge start']

        Raises:
            InputError: The file can't be read, or something in it is wrong: as `load_scenario`.
        """
        document = read_document(reference)
        if document.file is None:
            return validate(cls, document)
        moved = moved_paths(document.data, document.file.parent.resolve(), None)
        task = validate(cls, edited(document, moved))
        return task if task.name else task.replace(name=document.file.stem)

    def save(self, path: str | Path) -> Path:
        """Write a scenario file that gives this task again.

        Args:
            path: The file to write; an existing one is replaced.

        Raises:
            InputError: The file can't be written.
        """
        target, data = Path(path), self.to_dict()
        moved = moved_paths(data, Path.cwd(), target.parent.resolve())
        text = block(edited(Document(data), moved).data)
        return storage.write_files(target.parent, {target.name: text})[0]


class PlainTask(Task):
    """A task in which nothing is repeated."""

    waypoints: Several[Waypoint] = Field(
        description="Two at least, or one after a start, in order of time"
    )

    def with_waypoints(self, changes: Mapping[int, Mapping[str, Any]]) -> PlainTask:
        """A copy in which some waypoints have other values, checked like any.

        Args:
            changes: By the index of the waypoint values by the name of the field, as `replace`
                takes them.

        Raises:
            DocumentError: A value is unknown or wrong.
        """
        given = enumerate(self.waypoints)
        return self.replace(waypoints=[one.replace(**changes.get(i, {})) for i, one in given])
