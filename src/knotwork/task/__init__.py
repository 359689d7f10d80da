"""A task for a robot arm: what it is to do, in typed parts; a scenario file says the same."""

from knotwork.task.freedoms import AtMost, ChosenMotion, Fastest, Weights
from knotwork.task.options import (
    Balanced,
    Branch,
    EndAcceleration,
    PathOptions,
    Presets,
    Tolerances,
)
from knotwork.task.part import TaskPart
from knotwork.task.poses import Euler, Frame, Placement, Pose, Velocity
from knotwork.task.scene import (
    Collisions,
    HalfSpace,
    HeldObject,
    PointCloud,
    SceneObject,
    Surroundings,
    ToolShape,
    Turned,
)
from knotwork.task.task import Task, TaskUnits
from knotwork.task.tool import FrameSpeed, Inertia, Limits, Tool
from knotwork.task.waypoints import (
    AlongArc,
    AlongPoints,
    Arc,
    JointWaypoint,
    PathWaypoint,
    PoseWaypoint,
)

__all__ = [
    "AlongArc",
    "AlongPoints",
    "Arc",
    "AtMost",
    "Balanced",
    "Branch",
    "ChosenMotion",
    "Collisions",
    "EndAcceleration",
    "Euler",
    "Fastest",
    "Frame",
    "FrameSpeed",
    "HalfSpace",
    "HeldObject",
    "Inertia",
    "JointWaypoint",
    "Limits",
    "PathOptions",
    "PathWaypoint",
    "Placement",
    "PointCloud",
    "Pose",
    "PoseWaypoint",
    "Presets",
    "SceneObject",
    "Surroundings",
    "Task",
    "TaskPart",
    "TaskUnits",
    "Tolerances",
    "Tool",
    "ToolShape",
    "Turned",
    "Velocity",
    "Weights",
]
