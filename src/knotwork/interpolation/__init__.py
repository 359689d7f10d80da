"""Planners: curves through joint waypoints. Nothing here knows a robot."""

from knotwork.interpolation.catalogue import RECORDS, PlannerRecord
from knotwork.interpolation.hermite import ModifiedHermiteSpline
from knotwork.interpolation.knots import BalancedKnots
from knotwork.interpolation.options import Planner, PlannerOptions
from knotwork.interpolation.registry import PLANNERS, get_planner, planner_and_rule, rules

__all__ = [
    "PLANNERS",
    "RECORDS",
    "BalancedKnots",
    "ModifiedHermiteSpline",
    "Planner",
    "PlannerOptions",
    "PlannerRecord",
    "get_planner",
    "planner_and_rule",
    "rules",
]
