"""Scenarios: a task for a robot arm in one YAML file, or as a mapping in Python."""

from knotwork.scenario.model import (
    SMALLEST_PATH_TOLERANCE,
    FrameSpeed,
    JointTarget,
    JointValues,
    MotionLimits,
    Scenario,
    ScenarioPath,
    ScenarioWaypoint,
    Stretch,
    ToleranceSet,
    ToolPlacement,
)
from knotwork.scenario.resolve import load_scenario

__all__ = [
    "SMALLEST_PATH_TOLERANCE",
    "FrameSpeed",
    "JointTarget",
    "JointValues",
    "MotionLimits",
    "Scenario",
    "ScenarioPath",
    "ScenarioWaypoint",
    "Stretch",
    "ToleranceSet",
    "ToolPlacement",
    "load_scenario",
]
