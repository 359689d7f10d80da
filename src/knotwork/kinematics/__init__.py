"""Inverse kinematics of poses (eq 3) and velocities (eq 4), and how near a singularity is."""

from knotwork.kinematics.chain.batch import BatchSolution
from knotwork.kinematics.chain.velocity import (
    pull_to_middle,
    singular_values,
    smallest_singular_value,
    solve_velocity_ik,
)
from knotwork.kinematics.solutions.branches import Branch, solve_all
from knotwork.kinematics.solutions.many import solve_many
from knotwork.kinematics.solutions.pose import IKSolution, solve_pose_ik

__all__ = [
    "BatchSolution",
    "Branch",
    "IKSolution",
    "pull_to_middle",
    "singular_values",
    "smallest_singular_value",
    "solve_all",
    "solve_many",
    "solve_pose_ik",
    "solve_velocity_ik",
]
