from . import export as export
from . import interpolation as interpolation
from . import kinematics as kinematics
from . import recording as recording
from . import sweeps as sweeps
from . import timing as timing
from . import tool_paths as tool_paths
from . import verification as verification
from . import view as view
from .comparison import compare as compare
from .errors import CheckFailedError as CheckFailedError
from .errors import InputError as InputError
from .errors import KnotworkError as KnotworkError
from .following import follow_path as follow_path
from .interpolation import ModifiedHermiteSpline as ModifiedHermiteSpline
from .kinematics import solve_pose_ik as solve_pose_ik
from .kinematics import solve_pose_ik_all as solve_pose_ik_all
from .kinematics import solve_velocity_ik as solve_velocity_ik
from .payload import Payload as Payload
from .pipeline import Plan as Plan
from .pipeline import plan as plan
from .polynomial import PiecewisePolynomial as PiecewisePolynomial
from .robot import Robot as Robot
from .robot import load_robot as load_robot
from .robot import robot_names as robot_names
from .scenario import Scenario as Scenario
from .scenario import load_scenario as load_scenario
from .storage import load_trajectory as load_trajectory
from .sweeps import Study as Study
from .sweeps import plan_many as plan_many
from .sweeps import sweep as sweep
from .trajectory import JointTrajectory as JointTrajectory
from .verification import Report as Report
from .verification import check as check
from .waypoints import JointWaypoints as JointWaypoints

__all__: list[str]
__version__: str
