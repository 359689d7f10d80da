"""Inverse kinematics of poses (eq 3) and velocities (eq 4), and how near a singularity is."""

from typing import TYPE_CHECKING

from knotwork.lazy import lazy_names

if TYPE_CHECKING:
    from knotwork.kinematics.chain.batch import BatchSolution as BatchSolution
    from knotwork.kinematics.chain.velocity import pull_to_middle as pull_to_middle
    from knotwork.kinematics.chain.velocity import singular_values as singular_values
    from knotwork.kinematics.chain.velocity import (
        smallest_singular_value as smallest_singular_value,
    )
    from knotwork.kinematics.chain.velocity import solve_velocity_ik as solve_velocity_ik
    from knotwork.kinematics.solutions.branches import Branch as Branch
    from knotwork.kinematics.solutions.branches import solve_all as solve_all
    from knotwork.kinematics.solutions.many import solve_many as solve_many
    from knotwork.kinematics.solutions.pose import IKSolution as IKSolution
    from knotwork.kinematics.solutions.pose import solve_pose_ik as solve_pose_ik

__getattr__, __dir__, __all__ = lazy_names(__name__)
