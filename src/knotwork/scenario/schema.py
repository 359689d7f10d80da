"""What a scenario file may say: the models behind `knotwork schema`.

Values stand here as the file gives them, in the file's units; `knotwork.scenario.resolve` turns
them into SI in the robot's base frame.
"""

from __future__ import annotations

import difflib
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Discriminator, Field, Tag, model_validator

from knotwork.documents import StrictModel, Text

# No length, angle, time or limit of a real task is larger, and nothing computed from numbers of
# this size leaves the range of floats.
LARGEST = 1e12
Number = Annotated[float, Field(strict=True, ge=-LARGEST, le=LARGEST)]
Positive = Annotated[float, Field(strict=True, gt=0, le=LARGEST)]
Vector3 = Annotated[list[Number], Field(min_length=3, max_length=3)]
Vector4 = Annotated[list[Number], Field(min_length=4, max_length=4)]
JointMap = Annotated[dict[str, Number], Field(min_length=1)]

_EULER_ORDERS = tuple(a + b + c for a in "XYZ" for b in "XYZ" for c in "XYZ" if a != b and b != c)
ORIENTATIONS = (
    "quaternion_xyzw",
    "quaternion_wxyz",
    "rpy",
    "euler",
    "rotation_vector",
    "rotation_matrix",
)


def _kind(value: Any) -> str | None:
    """Tell text, a mapping, a list and a number apart, so that only one of them is tried."""
    if isinstance(value, str):
        return "text"
    if isinstance(value, dict | StrictModel):
        return "mapping"
    if isinstance(value, list | tuple):
        return "list"
    if isinstance(value, int | float) and not isinstance(value, bool):
        return "number"
    return None


def _by_kind(accepted: str) -> Discriminator:
    return Discriminator(
        _kind, custom_error_type="kind", custom_error_message=f"Input should be {accepted}"
    )


def _euler_order(order: str) -> str:
    if order in _EULER_ORDERS:
        return order
    if order.upper() in _EULER_ORDERS and order.islower():
        raise ValueError(
            f"lower case would mean fixed axes; write {order.upper()!r} for turns about the moving "
            "axes, or use rpy for fixed x, y, z axes"
        )
    raise ValueError(f"must be one of {', '.join(_EULER_ORDERS)} (moving axes, in this order)")


class Units(StrictModel):
    """Units of every value in the file; seconds and kilograms stay what they are."""

    length: Literal["m", "mm"] = Field(
        default="m", description="Of positions, speeds and sliding joints"
    )
    angle: Literal["rad", "deg"] = Field(
        default="rad", description="Of orientations and turning joints"
    )


class Euler(StrictModel):
    """Euler angles: turns about the moving axes, in the order given."""

    order: Annotated[str, AfterValidator(_euler_order)] = Field(
        description="Axes in order, capital letters, for example ZYX"
    )
    angles: Vector3 = Field(description="Turns in that order [angle]")


class Placement(StrictModel):
    """A position and at most one form of orientation; none means the axes are parallel."""

    position: Vector3 = Field(description="Origin: x, y, z [length]")
    quaternion_xyzw: Vector4 | None = Field(
        None, description="Unit quaternion, its scalar part last, as in ROS and SciPy"
    )
    quaternion_wxyz: Vector4 | None = Field(
        None, description="Unit quaternion, its scalar part first, as in Eigen's constructor"
    )
    rpy: Vector3 | None = Field(
        None, description="Turns about the fixed x, y, z axes, in this order, as in URDF [angle]"
    )
    euler: Euler | None = Field(None, description="Turns about moving axes, in an order of choice")
    rotation_vector: Vector3 | None = Field(None, description="Unit axis times angle [angle]")
    rotation_matrix: Annotated[list[Vector3], Field(min_length=3, max_length=3)] | None = Field(
        None, description="Three rows of three numbers; orthonormal, right-handed"
    )

    @model_validator(mode="after")
    def _one_orientation(self) -> Placement:
        given = [name for name in ORIENTATIONS if getattr(self, name) is not None]
        if len(given) > 1:
            raise ValueError(f"gives {' and '.join(given)}; give one orientation only")
        return self


class Pose(Placement):
    """A position and exactly one form of orientation."""

    @model_validator(mode="after")
    def _an_orientation(self) -> Pose:
        if all(getattr(self, name) is None for name in ORIENTATIONS):
            raise ValueError(f"has no orientation; give one of {', '.join(ORIENTATIONS)}")
        return self


class Frame(Placement):
    """A named frame, placed in the base or in another named frame."""

    parent: Text = Field("base", alias="in", description="base or the name of another frame")


class Tool(StrictModel):
    """The tool: which frame of the robot carries it, and where its centre point (TCP) is."""

    frame: Text | None = Field(None, description="Frame of the robot; left out: the robot's own")
    offset: Placement | None = Field(None, description="TCP in the axes of that frame")


class Velocity(StrictModel):
    """Velocity of the TCP and of the tool's rotation, in the axes of a frame."""

    linear: Vector3 = Field(default=[0.0, 0.0, 0.0], description="Of the TCP [length/s]")
    angular: Vector3 = Field(default=[0.0, 0.0, 0.0], description="Of the tool [angle/s]")
    axes: Text | None = Field(
        None,
        alias="in",
        description="A named frame, base or tool; left out: the frame the waypoint's pose is in",
    )


class _Waypoint(StrictModel):
    name: Text | None = Field(
        None, description="For messages and reports; left out: its number. Each name once"
    )
    time: Number | None = Field(None, description="Time since the start [s]")
    after: Positive | None = Field(None, description="Time since the waypoint before [s]")
    stop: Literal[True] | None = Field(None, description="The arm stands still here")

    @model_validator(mode="after")
    def _one_time(self) -> _Waypoint:
        if self.time is not None and self.after is not None:
            raise ValueError("gives both time and after; give one")
        return self


class PoseWaypoint(_Waypoint):
    """A waypoint given by the pose of the tool."""

    pose: Pose = Field(description="Of the TCP")
    frame: Text | None = Field(
        None, description="Frame the pose is in; left out: the file's `frame`, else base"
    )
    velocity: Velocity | None = Field(
        None,
        description="Of the tool as it passes; the first and last waypoint stop without one, "
        "inner ones must give velocity, speed or stop",
    )
    speed: Positive | None = Field(
        None,
        description="Speed of the TCP along the smooth path through the neighbouring waypoints "
        "(a circle or a line); the tool turns with it [length/s]",
    )

    @model_validator(mode="after")
    def _one_velocity(self) -> PoseWaypoint:
        given = [name for name in ("velocity", "speed", "stop") if getattr(self, name) is not None]
        if len(given) > 1:
            raise ValueError(f"gives {' and '.join(given)}; give one")
        return self


class JointWaypoint(_Waypoint):
    """A waypoint given by joint values."""

    joints: Annotated[
        Annotated[Text, Tag("text")] | Annotated[JointMap, Tag("mapping")],
        _by_kind("the name of a configuration or a mapping of joint names to values"),
    ] = Field(description="A configuration of the robot by name, or every joint [angle or length]")
    velocity: JointMap | None = Field(
        default=None,
        description="By joint; joints left out stand still [angle/s or length/s]",
    )

    @model_validator(mode="after")
    def _one_velocity(self) -> JointWaypoint:
        if self.velocity is not None and self.stop is not None:
            raise ValueError("gives velocity and stop; give one")
        return self


def _waypoint_kind(value: Any) -> str | None:
    if isinstance(value, PoseWaypoint | JointWaypoint):
        return type(value).__name__
    if not isinstance(value, dict) or ("pose" in value and "joints" in value):
        return None
    kinds = {"pose": "PoseWaypoint", "joints": "JointWaypoint"}
    for key, kind in kinds.items():
        if key in value:
            return kind
    # a key that is nearly one of them is a slip: let that key be reported
    slips = (difflib.get_close_matches(str(key).lower(), kinds, n=1, cutoff=0.7) for key in value)
    return next((kinds[slip[0]] for slip in slips if slip), None)


Waypoint = Annotated[
    Annotated[PoseWaypoint, Tag("PoseWaypoint")] | Annotated[JointWaypoint, Tag("JointWaypoint")],
    Discriminator(
        _waypoint_kind,
        custom_error_type="waypoint_kind",
        custom_error_message="Input should be a mapping with either pose or joints, not both",
    ),
]


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
    """What some planners can be told beyond knots; `knotwork planners` says which takes what."""

    accelerations: (
        Annotated[
            Annotated[Literal["zero", "estimated"], Tag("text")]
            | Annotated[PerWaypoint, Tag("list")],
            _by_kind("zero, estimated, or a list of mappings of joint names to accelerations"),
        ]
        | None
    ) = Field(
        default=None,
        description="Zero, estimated, or a mapping by joint for each waypoint in order, the start "
        "included; 3-5-3 takes none for the first two and the last two [angle/s² or length/s²]",
    )
    jerks: PerWaypoint | None = Field(
        default=None,
        description="A mapping by joint for each waypoint, the start included "
        "[angle/s³ or length/s³]",
    )
    snaps: PerWaypoint | None = Field(
        default=None,
        description="Fourth derivatives, a mapping by joint for each waypoint, the start included "
        "[angle/s⁴ or length/s⁴]",
    )
    transition_time: (
        Annotated[
            Annotated[Positive, Tag("number")]
            | Annotated[Annotated[list[Positive], Field(min_length=2)], Tag("list")],
            _by_kind("a positive number of seconds, or a list of one for each waypoint"),
        ]
        | None
    ) = Field(
        default=None,
        description="Of the parabolic transitions, one for all waypoints or one for each [s]",
    )


def _range(values: list[float]) -> list[float]:
    if values[0] >= values[1]:
        raise ValueError(f"lower limit {values[0]:g} must be less than upper limit {values[1]:g}")
    return values


JointLimits = Annotated[
    Annotated[Positive, Tag("number")]
    | Annotated[Annotated[dict[str, Positive], Field(min_length=1)], Tag("mapping")],
    _by_kind("a positive number for every joint or a mapping of joint names to positive numbers"),
]


class Limits(StrictModel):
    """Limits that take the place of the robot's."""

    position: (
        dict[
            str,
            Annotated[list[Number], Field(min_length=2, max_length=2), AfterValidator(_range)],
        ]
        | None
    ) = Field(default=None, description="Lower and upper limit by joint [angle or length]")
    velocity: JointLimits | None = Field(
        default=None, description="Largest speed, for all joints or by joint [angle/s or length/s]"
    )
    acceleration: JointLimits | None = Field(
        default=None, description="Largest acceleration, likewise [angle/s² or length/s²]"
    )
    jerk: JointLimits | None = Field(
        default=None, description="Largest jerk, likewise [angle/s³ or length/s³]"
    )
    effort: JointLimits | None = Field(
        default=None, description="Largest torque or force, likewise [N m or N]"
    )


class Tolerances(StrictModel):
    """How far the check lets the motion be from what was asked; left out: 1e-6 in SI."""

    position: Positive | None = Field(default=None, description="Of the TCP at a pose [length]")
    orientation: Positive | None = Field(default=None, description="Of the tool at a pose [angle]")
    linear_velocity: Positive | None = Field(default=None, description="Of the TCP [length/s]")
    angular_velocity: Positive | None = Field(default=None, description="Of the tool [angle/s]")
    joint_position: Positive | None = Field(
        default=None, description="At waypoints given by joint values [angle or length]"
    )
    joint_velocity: Positive | None = Field(
        default=None, description="Likewise [angle/s or length/s]"
    )
    joint_acceleration: Positive | None = Field(
        default=None, description="At the ends, where asked for [angle/s² or length/s²]"
    )


JointsOrName = Annotated[
    Annotated[Text, Tag("text")] | Annotated[JointMap, Tag("mapping")],
    _by_kind("the name of a configuration or a mapping of joint names to values"),
]


class ScenarioFile(StrictModel):
    """A task for a robot arm: waypoints with times and speeds, and how to plan and check it."""

    name: Text | None = Field(None, description="Left out: the file's name")
    description: str = Field("", description="What the task is, for reports")
    units: Units = Field(Units(), description="Units of every value in the file")
    robot: (
        Annotated[
            Annotated[Text, Tag("text")] | Annotated[dict[str, Any], Tag("mapping")],
            _by_kind("a robot's name, a path, or a mapping that describes one"),
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
    frames: dict[str, Frame] = Field(
        default_factory=dict, description="Named frames, in the base or in one another"
    )
    frame: Text | None = Field(None, description="Frame of poses that name none; left out: base")
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
        _by_kind("free, keep, fixed or a mapping of shoulder, elbow and wrist to words"),
    ] = Field(
        "free",
        description="Branch of the solutions: keep that of the first waypoint unless speeds forbid "
        "it, hold it fixed, or the one named; for arms of six joints, all others have near",
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
        Annotated[Literal["paper", "balanced"], Tag("text")]
        | Annotated[Balanced, Tag("mapping")]
        | Annotated[list[Number], Tag("list")],
        _by_kind("paper, balanced, {balanced: c} or a list of knot times"),
    ] = Field(
        "paper",
        description="Where modified-hermite builds its knots: by the paper's Eq. (39), balanced "
        "beside each waypoint, or at the times given [s]",
    )
    end_acceleration: (
        Annotated[
            Annotated[Literal["zero"], Tag("text")] | Annotated[EndAcceleration, Tag("mapping")],
            _by_kind("zero or a mapping with start and end"),
        ]
        | None
    ) = Field(
        None,
        description="Joint accelerations at the two ends; left out: what the planner makes of them",
    )
    planner_options: PlannerOptionsFile = Field(
        PlannerOptionsFile(), description="What some planners can be told beyond knots"
    )
    limits: Limits = Field(Limits(), description="Take the place of the robot's limits")
    tolerances: Tolerances = Field(
        Tolerances(), description="How far the check lets the motion be from what was asked"
    )
    continuity: Literal[0, 1, 2] = Field(
        2, description="Continuity the check asks for: 2 means no jump of acceleration"
    )
    rate: Positive = Field(100.0, description="Samples per second in samples.csv [Hz]")
    waypoints: Annotated[list[Waypoint], Field(min_length=1)] = Field(
        description="In order of time; two at least, or one after a start"
    )
