"""Motions of named joints: `JointTrajectory`, its samples and its exports."""

from knotwork.trajectory.events import Event, Load, Segment
from knotwork.trajectory.joint_trajectory import Continuity, JointTrajectory, Jump
from knotwork.trajectory.sampling import Knots, Samples

__all__ = [
    "Continuity",
    "Event",
    "JointTrajectory",
    "Jump",
    "Knots",
    "Load",
    "Samples",
    "Segment",
]
