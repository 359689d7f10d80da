"""Planners: curves through joint waypoints. Nothing here knows a robot."""

from knotwork.interpolation.hermite import ModifiedHermiteSpline
from knotwork.interpolation.knots import BalancedKnots

__all__ = ["BalancedKnots", "ModifiedHermiteSpline"]
