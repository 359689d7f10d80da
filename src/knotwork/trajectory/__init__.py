"""Motions of named joints: `JointTrajectory`, its samples and its exports."""

from knotwork.trajectory.joint_trajectory import Continuity, JointTrajectory, Jump
from knotwork.trajectory.sampling import Knots, Samples

__all__ = [
    "Continuity",
    "JointTrajectory",
    "Jump",
    "Knots",
    "Samples",
]
