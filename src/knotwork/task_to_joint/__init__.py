"""A scenario's waypoints at the joints: inverse kinematics, position (eq 3) and velocity (eq 4)."""

from knotwork.task_to_joint.inserted import followed_path
from knotwork.task_to_joint.solution import Choice, Infeasibility, PathStart, Step, TaskSolution
from knotwork.task_to_joint.solve import solve_task

__all__ = [
    "Choice",
    "Infeasibility",
    "PathStart",
    "Step",
    "TaskSolution",
    "followed_path",
    "solve_task",
]
