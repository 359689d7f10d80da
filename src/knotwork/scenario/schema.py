"""Contents of a scenario file: the models behind `knotwork schema`.

Values stand here as the file gives them, in the file's units; `knotwork.scenario.resolve` turns
them into SI in the robot's base frame.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, Tag, model_validator

from knotwork.documents import StrictModel, Text
from knotwork.documents.values import JointsOrName, Number, Positive, Vector3, by_kind
from knotwork.scenario.scene_schema import Collisions, Scene
from knotwork.scenario.timing_schema import ChosenRunFile, ObjectiveFile
from knotwork.scenario.tool_schema import ScenarioLimits, Tool
from knotwork.scenario.waypoint_schema import Frame, Waypoint


class Units(StrictModel):
    """Units of every value in the file; seconds and kilograms stay what they are."""

    length: Literal["m", "mm"] = Field(
        default="m", description="Of positions, speeds and sliding joints"
    )
    angle: Literal["rad", "deg"] = Field(
        default="rad", description="Of orientations and turning joints"
    )


class Balanced(StrictModel):
    """Balanced knots with their constant given."""

    balanced: Annotated[float, Field(strict=True, gt=0, le=0.5)] = Field(
        description="Constant c: knots sit c times the shorter neighbouring interval away from "
        "each waypoint; smaller lowers the peaks of velocity and raises the jerk"
    )


class EndAcceleration(StrictModel):
    """Joint accelerations at the two ends; joints left out have none."""

    start: dict[str, Number] = Field(
        default_factory=dict, description="At the first waypoint [angle/s² or length/s²]"
    )
    end: dict[str, Number] = Field(
        default_factory=dict, description="At the last waypoint [angle/s² or length/s²]"
    )


class Branch(StrictModel):
    """The branch of solutions to take, in words; what is left out is free."""

    shoulder: Literal["left", "right"] | None = Field(
        None, description="Side of axis 1 on which the upper arm is, seen from behind the arm"
    )
    elbow: Literal["up", "down"] | None = Field(
        None, description="Above or below the line from shoulder to wrist"
    )
    wrist: Literal["flip", "no flip"] | None = Field(
        None,
        description="no flip: axis 6 is turned from axis 4 in the positive sense of joint 5",
    )

    @model_validator(mode="after")
    def _one_at_least(self) -> Branch:
        if not (self.shoulder or self.elbow or self.wrist):
            raise ValueError("names no branch; give one of shoulder, elbow, wrist")
        return self


PerWaypoint = Annotated[list[dict[str, Number]], Field(min_length=1)]


class PlannerOptionsFile(StrictModel):
    """Options of some planners beyond knots; `knotwork planners` says which takes which."""

    accelerations: (
        Annotated[
            Annotated[Literal["zero", "estimated"], Tag("text")]
            | Annotated[PerWaypoint, Tag("list")],
            by_kind(
                "zero, estimated, or a list of mappings of joint names to accelerations",
                ["zero", "estimated"],
            ),
        ]
        | None
    ) = Field(
        default=None,
        description="Zero, estimated, or a mapping by joint for each waypoint in order, the start "
        "included, each joint named; 3-5-3 takes none for the first two and the last two "
        "[angle/s² or length/s²]",
    )
    jerks: PerWaypoint | None = Field(
        default=None,
        description="A mapping by joint for each waypoint, the start included, each joint named "
        "[angle/s³ or length/s³]",
    )
    snaps: PerWaypoint | None = Field(
        default=None,
        description="Fourth derivatives, a mapping by joint for each waypoint, each joint named "
        "[angle/s⁴ or length/s⁴]",
    )
    transition_time: (
        Annotated[
            Annotated[Positive, Tag("number")]
            | Annotated[Annotated[list[Positive], Field(min_length=2)], Tag("list")],
            by_kind("a positive number of seconds, or a list of one for each waypoint"),
        ]
        | None
    ) = Field(
        default=None,
        description="Of the parabolic transitions, one for all waypoints or one for each [s]",
    )


class Tolerances(StrictModel):
    """Largest differences from the task that pass the check; by default 1e-6 in SI."""

    position: Positive | None = Field(default=None, description="Of the TCP at a pose [length]")
    orientation: Positive | None = Field(default=None, description="Of the tool at a pose [angle]")
    linear_velocity: Positive | None = Field(default=None, description="Of the TCP [length/s]")
    angular_velocity: Positive | None = Field(default=None, description="Of the tool [angle/s]")
    joint_position: Positive | None = Field(
        default=None, description="At waypoints given by joint values [angle or length]"
    )
    joint_velocity: Positive | None = Field(
        default=None,
        description="At waypoints given by joint values, and where the tool is to stop "
        "[angle/s or length/s]",
    )
    joint_acceleration: Positive | None = Field(
        default=None, description="At the ends, where asked for [angle/s² or length/s²]"
    )
    path: Positive | None = Field(
        default=None, description="Distance of the TCP from a path [length]; left out: 0.1 mm"
    )
    path_orientation: Positive | None = Field(
        default=None, description="Of the tool along a path [angle]; left out: 0.1 degrees"
    )
    path_speed: Annotated[float, Field(strict=True, gt=0, lt=1)] | None = Field(
        default=None,
        description="Of the speed along a path, as a part of the full speed; left out: 0.01",
    )


class PathOptionsFile(StrictModel):
    """How the tool moves along paths."""

    acceleration: Positive | None = Field(
        None,
        description="Largest acceleration along the path where its speed changes, at a stop or "
        "where two speeds meet [length/s²]; left out: 1 m/s²",
    )


class ScenarioFile(StrictModel):
    """A task for a robot arm: waypoints with times and speeds, and how to plan and check it."""

    name: Text | None = Field(None, description="Left out: the file's name")
    description: str = Field("", description="What the task is, for reports")
    units: Units = Field(Units.model_construct(), description="Units of every value in the file")
    robot: (
        Annotated[
            Annotated[Text, Tag("text")] | Annotated[dict[str, Any], Tag("mapping")],
            by_kind("a robot's name, a path, or a mapping that describes one"),
        ]
        | None
    ) = Field(
        None,
        description="A shipped robot's name, the path of a robot file or URDF (relative to this "
        "file), or a robot description in place",
    )
    joint_units: dict[str, Literal["rad", "m"]] = Field(
        default_factory=dict,
        description="Without a robot: which joints slide (m); those left out turn (rad)",
    )
    tool: Tool | None = Field(
        None, description="The tool; left out: the robot's tool frame is the TCP"
    )
    gravity: Vector3 | None = Field(
        None,
        description="In the axes of the base frame, for an arm on a wall or a ceiling [m/s²]; left "
        "out: 9.81 along -z of the URDF's root",
    )
    frames: dict[str, Frame] = Field(
        default_factory=dict, description="Named frames, in the base or in one another"
    )
    frame: Text | None = Field(None, description="Frame of poses that name none; left out: base")
    scene: Scene = Field(default_factory=Scene, description="What stands around the robot")
    collisions: Collisions = Field(
        default_factory=Collisions, description="What is checked for collisions, and how closely"
    )
    start: JointsOrName | None = Field(
        None,
        description="Where the motion starts, at rest, at time 0, before the waypoints: a "
        "configuration by name, or every joint [angle or length]",
    )
    near: JointsOrName | None = Field(
        None,
        description="Prefer the solutions nearest to this, for every waypoint; whole turns follow "
        "the motion. Left out: the way of least travel from the start, else from home",
    )
    branch: Annotated[
        Annotated[Literal["free", "keep", "fixed"], Tag("text")]
        | Annotated[Branch, Tag("mapping")],
        by_kind(
            "free, keep, fixed or a mapping of shoulder, elbow and wrist to words",
            ["free", "keep", "fixed"],
        ),
    ] = Field(
        "free",
        description="Branch of the solutions: keep that of the first waypoint unless speeds forbid "
        "it, hold it fixed, or the one named; for arms of six joints, all others have near",
    )
    prefer: Literal["travel", "clearance"] = Field(
        "travel",
        description="What decides among solutions that nothing else rules out: least travel, or "
        "most room to everything: at the waypoints, up to 0.1 m, and then of a few sequences over "
        "the whole motion; near comes before",
    )
    pull_to_middle: Positive | None = Field(
        None,
        description="For an arm of more than six joints: where it passes a pose at speed, its "
        "joints also move at this rate to the middle of their ranges, as far as tool and velocity "
        "limits let them [1/s]; left out: the least joint speeds that move the tool as asked",
    )
    planner: Text = Field(
        "modified-hermite", description="A planner's name; `knotwork planners` lists them"
    )
    knots: Annotated[
        Annotated[Literal["paper", "balanced", "optimal"], Tag("text")]
        | Annotated[Balanced, Tag("mapping")]
        | Annotated[list[Number], Tag("list")],
        by_kind(
            "paper, balanced, optimal, {balanced: c} or a list of knot times",
            ["paper", "balanced", "optimal"],
        ),
    ] = Field(
        "paper",
        description="Where modified-hermite builds its knots: by the paper's Eq. (39), balanced "
        "beside each waypoint, at the times given [s], or optimal: where they serve the objective "
        "best, within the limits. Left out where some times are free: optimal",
    )
    times: Literal["fastest"] | None = Field(
        None, description="fastest: for every waypoint that gives no time, as after: fastest there"
    )
    duration: Positive | None = Field(
        None, description="Of the whole motion, where times are free: the smoothest so long [s]"
    )
    objective: (
        Annotated[
            Annotated[
                Literal["time", "jerk", "effort", "acceleration", "peak_jerk", "peak_acceleration"],
                Tag("text"),
            ]
            | Annotated[ObjectiveFile, Tag("mapping")],
            by_kind(
                "time, jerk, effort, acceleration, peak_jerk, peak_acceleration, or a mapping of "
                "these to weights",
                ["time", "jerk", "effort", "acceleration", "peak_jerk", "peak_acceleration"],
            ),
        ]
        | None
    ) = Field(
        None,
        description="What is minimised where times or knots are chosen: the duration, or the "
        "integral of jerk, effort or acceleration squared, or the greatest jerk or acceleration; "
        "left out: the duration, or jerk where that is given",
    )
    chosen: Annotated[list[ChosenRunFile], Field(min_length=1)] | None = Field(
        None,
        description="Knots and accelerations of runs whose times were chosen, as `knotwork plan "
        "--freeze` writes them",
    )
    end_acceleration: (
        Annotated[
            Annotated[Literal["zero"], Tag("text")] | Annotated[EndAcceleration, Tag("mapping")],
            by_kind("zero or a mapping with start and end", ["zero"]),
        ]
        | None
    ) = Field(
        None,
        description="Joint accelerations at the two ends; left out: what the planner makes of them",
    )
    planner_options: PlannerOptionsFile = Field(
        PlannerOptionsFile.model_construct(),
        description="Further options of some planners",
    )
    limits: ScenarioLimits = Field(
        ScenarioLimits.model_construct(),
        description="Take the place of the robot's limits, or limit the motion of tool and links",
    )
    tolerances: Tolerances = Field(
        Tolerances.model_construct(),
        description="How far the check lets the motion be from what was asked",
    )
    continuity: Literal[0, 1, 2] = Field(
        2, description="Continuity the check asks for: 2 means no jump of acceleration"
    )
    path: PathOptionsFile = Field(
        PathOptionsFile.model_construct(), description="How the tool moves along paths"
    )
    rate: Positive = Field(100.0, description="Samples per second in samples.csv [Hz]")
    waypoints: Annotated[list[Waypoint], Field(min_length=1)] = Field(
        description="Two at least, or one after a start, in order of time"
    )
