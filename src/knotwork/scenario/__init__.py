"""Scenarios: a task for a robot arm in one YAML file, or as a mapping in Python."""

from knotwork.scenario.free_times import FreeTimes, FreeWay
from knotwork.scenario.model import (
    SMALLEST_PATH_TOLERANCE,
    AskedEvent,
    JointTarget,
    JointValues,
    Scenario,
    ScenarioPath,
    ScenarioWaypoint,
    Stretch,
    ToleranceSet,
    ToolPlacement,
)
from knotwork.scenario.path_timing import AskedTiming
from knotwork.scenario.resolve import load_scenario, resolved
from knotwork.scenario.scene_model import (
    CollisionRules,
    HeldObject,
    OtherRobot,
    Scene,
    SceneObject,
    Shape,
)

__all__ = [
    "SMALLEST_PATH_TOLERANCE",
    "AskedEvent",
    "AskedTiming",
    "CollisionRules",
    "FreeTimes",
    "FreeWay",
    "HeldObject",
    "JointTarget",
    "JointValues",
    "OtherRobot",
    "Scenario",
    "ScenarioPath",
    "ScenarioWaypoint",
    "Scene",
    "SceneObject",
    "Shape",
    "Stretch",
    "ToleranceSet",
    "ToolPlacement",
    "load_scenario",
    "resolved",
]
