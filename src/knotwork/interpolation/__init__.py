"""Planners: curves through joint waypoints. Nothing here knows a robot."""

from knotwork.interpolation.hermite import ModifiedHermiteSpline
from knotwork.interpolation.knots import BalancedKnots
from knotwork.interpolation.options import Planner, PlannerOptions
from knotwork.interpolation.registry import PLANNERS, get_planner, planner_and_rule, rules
from knotwork.interpolation.specs import PLANNER_SPECS, PlannerSpec

__all__ = [
    "PLANNERS",
    "PLANNER_SPECS",
    "BalancedKnots",
    "ModifiedHermiteSpline",
    "Planner",
    "PlannerOptions",
    "PlannerSpec",
    "get_planner",
    "planner_and_rule",
    "rules",
]
