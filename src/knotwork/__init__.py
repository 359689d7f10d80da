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
    from knotwork import recording as recording
    from knotwork import timing as timing
    from knotwork import tool_paths as tool_paths
    from knotwork import verification as verification
    from knotwork.comparison import Comparison as Comparison
    from knotwork.comparison import compare as compare
    from knotwork.errors import CheckFailedError as CheckFailedError
    from knotwork.errors import InputError as InputError
    from knotwork.errors import KnotworkError as KnotworkError
    from knotwork.following import follow as follow
    from knotwork.interpolation import PLANNERS as PLANNERS
    from knotwork.interpolation import BalancedKnots as BalancedKnots
    from knotwork.interpolation import ModifiedHermiteSpline as ModifiedHermiteSpline
    from knotwork.interpolation import PlannerOptions as PlannerOptions
    from knotwork.interpolation import get_planner as get_planner
    from knotwork.kinematics import solve_all as solve_all
    from knotwork.kinematics import solve_many as solve_many
    from knotwork.kinematics import solve_pose_ik as solve_pose_ik
    from knotwork.kinematics import solve_velocity_ik as solve_velocity_ik
    from knotwork.payload import Payload as Payload
    from knotwork.pipeline import Plan as Plan
    from knotwork.pipeline import plan as plan
    from knotwork.polynomial import PiecewisePolynomial as PiecewisePolynomial
    from knotwork.robot import Robot as Robot
    from knotwork.robot import load_robot as load_robot
    from knotwork.robot import robot_names as robot_names
    from knotwork.scenario import Scenario as Scenario
    from knotwork.scenario import load_scenario as load_scenario
    from knotwork.storage import load_trajectory as load_trajectory
    from knotwork.sweeps import Study as Study
    from knotwork.sweeps import SweepProgress as SweepProgress
    from knotwork.sweeps import plan_many as plan_many
    from knotwork.sweeps import sweep as sweep
    from knotwork.tradeoffs import Tradeoff as Tradeoff
    from knotwork.tradeoffs import tradeoff as tradeoff
    from knotwork.trajectory import JointTrajectory as JointTrajectory
    from knotwork.verification import Report as Report
    from knotwork.verification import check as check
    from knotwork.waypoints import CartesianWaypoint as CartesianWaypoint
    from knotwork.waypoints import JointWaypoints as JointWaypoints

__version__ = "0.1.0"

__getattr__, __dir__, __all__ = lazy_names(__name__)
