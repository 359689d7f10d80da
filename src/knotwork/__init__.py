"""Tool poses and speeds in, a verified C² joint trajectory out.

    import knotwork as kw

    plan = kw.plan("ur5_deburring")
    plan.report.raise_if_failed()
    plan.trajectory.velocity(1.2)  # joint velocities at 1.2 s [rad/s]
    plan.save("out")

Everything is loaded when it is first used, so that importing `knotwork` costs next to nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from knotwork.lazy import lazy_names

if TYPE_CHECKING:
    from knotwork import verification as verification
    from knotwork.comparison import Comparison, compare
    from knotwork.errors import CheckFailedError, InputError, KnotworkError
    from knotwork.interpolation import (
        PLANNERS,
        BalancedKnots,
        ModifiedHermiteSpline,
        PlannerOptions,
        get_planner,
    )
    from knotwork.kinematics import solve_all, solve_many, solve_pose_ik, solve_velocity_ik
    from knotwork.pipeline import Plan, plan
    from knotwork.polynomial import PiecewisePolynomial
    from knotwork.robot import Robot, load_robot, robot_names
    from knotwork.scenario import Scenario, load_scenario
    from knotwork.storage import load_trajectory
    from knotwork.trajectory import JointTrajectory
    from knotwork.verification import Report, check
    from knotwork.waypoints import CartesianWaypoint, JointWaypoints

__version__ = "0.1.0"

__all__ = [
    "PLANNERS",
    "BalancedKnots",
    "CartesianWaypoint",
    "CheckFailedError",
    "Comparison",
    "InputError",
    "JointTrajectory",
    "JointWaypoints",
    "KnotworkError",
    "ModifiedHermiteSpline",
    "PiecewisePolynomial",
    "Plan",
    "PlannerOptions",
    "Report",
    "Robot",
    "Scenario",
    "check",
    "compare",
    "get_planner",
    "load_robot",
    "load_scenario",
    "load_trajectory",
    "plan",
    "robot_names",
    "solve_all",
    "solve_many",
    "solve_pose_ik",
    "solve_velocity_ik",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "comparison": ("Comparison", "compare"),
        "errors": ("CheckFailedError", "InputError", "KnotworkError"),
        "interpolation": (
            "PLANNERS",
            "BalancedKnots",
            "ModifiedHermiteSpline",
            "PlannerOptions",
            "get_planner",
        ),
        "kinematics": ("solve_all", "solve_many", "solve_pose_ik", "solve_velocity_ik"),
        "pipeline": ("Plan", "plan"),
        "polynomial": ("PiecewisePolynomial",),
        "robot": ("Robot", "load_robot", "robot_names"),
        "scenario": ("Scenario", "load_scenario"),
        "storage": ("load_trajectory",),
        "trajectory": ("JointTrajectory",),
        "waypoints": ("CartesianWaypoint", "JointWaypoints"),
        "verification": ("Report", "check", "verification"),
    },
)
